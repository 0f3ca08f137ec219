// What a budget's choice saves: budget_bench [TRUTH_LEVEL]
//
// Typical scenes under budgets of 0.3, 1, 3 and 10 %: processor seconds of the whole run (choice,
// medium, solution, views) and the true error over the hemisphere against everything on at the
// level named ("standard").
#include <fmt/format.h>

#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/budget_plan.h"
#include "sim/elapsed_time.h"
#include "sim/quality.h"

namespace twilight {
namespace {

struct Case {
  const char* name;
  double sun_deg;
  const char* aerosols;
  int wavelengths;
};

constexpr Case kCases[] = {{"noon, clear, 3 wavelengths", 60, "none", 3},
                           {"afternoon, continental average, 15", 25, "continental_average", 15},
                           {"sunset, continental average, 15", 0, "continental_average", 15},
                           {"twilight, continental average, 15", -4, "continental_average", 15},
                           {"deep twilight, clear, 8", -9, "none", 8}};

Scene scene_of(const Case& c) {
  Scene scene;
  scene.sun.elevation_deg = c.sun_deg;
  scene.aerosols.type = c.aerosols;
  scene.solver.method = "orders";
  scene.spectrum.wavelengths_nm.clear();
  for (int i = 0; i < c.wavelengths; ++i) {
    scene.spectrum.wavelengths_nm.push_back(380 + 400.0 * i / (c.wavelengths - 1));
  }
  return scene;
}

}  // namespace
}  // namespace twilight

int main(int argc, char** argv) try {
  using namespace twilight;
  const QualityLevel& truth_level = quality_level(argc > 1 ? argv[1] : "standard");
  const WantedSky wanted;
  fmt::print("| scene | budget | level | choice s | all s | full s | error |\n");
  fmt::print("|---|---|---|---|---|---|---|\n");
  for (const Case& c : kCases) {
    Scene full = scene_of(c);
    apply_quality(
        truth_level, [](std::string_view) { return true; }, full.solver);
    double start = processor_seconds();
    const SceneModel model = build_scene_model(full);
    const std::vector<double> truth = solve_sky(model)->radiance(wanted.views.views);
    const double full_seconds = processor_seconds() - start;
    for (const double budget : {0.003, 0.01, 0.03, 0.1}) {
      Scene scene = scene_of(c);
      scene.budget.max_relative_error = budget;
      KnownPhases known;
      start = processor_seconds();
      try {
        const BudgetPlan plan = plan_budget(scene, wanted, known, {});
        const auto sky = solve_sky(build_scene_model(plan.scene, &known));
        const std::vector<double> radiance = sky->radiance(wanted.views.views);
        const double seconds = processor_seconds() - start;
        std::string left_out;
        for (const LeftOut& e : plan.left_out) left_out += (left_out.empty() ? "" : "; ") + e.what;
        const double error =
            relative_difference(wanted.views, model.solar_irradiance, truth, radiance)
                .percentile_95;
        fmt::print("| {} | {} % | {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} % | {}\n", c.name,
                   100 * budget, plan.quality, plan.pilot_seconds, seconds, full_seconds,
                   100 * error, left_out);
      } catch (const std::invalid_argument& error) {
        fmt::print("| {} | {} % | {} |\n", c.name, 100 * budget, error.what());
      }
      std::fflush(stdout);
    }
  }
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  fmt::print(stderr, "budget_bench: {}\n", error.what());
  return EXIT_FAILURE;
}
