// A budget of error is kept: over random scenes, by what is left out and the steps that are chosen.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <random>

#include "sim/budget_plan.h"
#include "sim/quality.h"
#include "sim/scene_file.h"

namespace twilight {
namespace {

class RandomScene {
 public:
  explicit RandomScene(unsigned seed) : random_(seed) {}

  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967296.0;
  }
  template <class T>
  const T& one_of(const std::vector<T>& values) {
    return values[static_cast<std::size_t>(between(0, static_cast<double>(values.size())))];
  }

  Scene scene(bool every_aerosol) {
    Scene s;
    s.sun.elevation_deg = between(-12, 60);
    if (between(0, 1) < 0.6) s.sun.elevation_deg = between(-12, 6);  // twilight is what matters
    s.atmosphere.profile =
        one_of<std::string>({"us_standard", "tropical", "midlatitude_summer", "midlatitude_winter",
                             "subarctic_summer", "subarctic_winter"});
    std::vector<std::string> aerosols = {
        "none", "none", "continental_clean", "continental_average", "urban", "arctic"};
    if (every_aerosol) {
      aerosols.insert(aerosols.end(), {"continental_polluted", "desert", "maritime_clean",
                                       "maritime_polluted", "maritime_tropical", "antarctic"});
    }
    s.aerosols.type = one_of(aerosols);
    if (s.aerosols.type != "none" && between(0, 1) < 0.3) {
      s.aerosols.optical_depth_550nm = 0.02 * std::pow(20.0, between(0, 1));
    }
    s.earth.ground_albedo = between(0, 1) < 0.3 ? 0.0 : between(0, 1);
    s.observer.height_m = between(0, 1) < 0.5 ? 0.0 : between(0, 12000);
    const std::vector<std::vector<double>> spectra = {
        {400, 440, 480, 520, 560, 600, 640, 680}, {550}, {440, 560, 680}};
    s.spectrum.wavelengths_nm = one_of(spectra);
    s.solver.method = "orders";
    return s;
  }

  WantedSky wanted() {
    WantedSky w;
    if (between(0, 1) < 0.5) return w;
    std::vector<ViewDirection> views;
    const int count = 1 + static_cast<int>(between(0, 4));
    for (int i = 0; i < count; ++i) {
      views.push_back({std::asin(between(0.03, 1)), between(-M_PI, M_PI)});
    }
    w.views = listed_views(views);
    return w;
  }

 private:
  std::mt19937 random_;
};

double error_of(const Scene& truth, const Scene& planned, const WantedSky& wanted,
                KnownPhases& known) {
  const SceneModel model = build_scene_model(truth, &known);
  const auto look = [&](const SceneModel& m) { return solve_sky(m)->radiance(wanted.views.views); };
  return relative_difference(wanted.views, model.solar_irradiance, look(model),
                             look(build_scene_model(planned, &known)))
      .percentile_95;
}

/// Everything on, at the steps of a level.
Scene at_steps(Scene scene, const QualityLevel& level) {
  apply_quality(
      level, [](std::string_view) { return true; }, scene.solver);
  return scene;
}

/// A plan at the steps of another level: what it leaves out stays out, but for the air above, whose
/// absence would move the coarse levels.
Scene moved_to(const BudgetPlan& plan, const Scene& full, const QualityLevel& level) {
  Scene scene = at_steps(plan.scene, level);
  const QualityLevel& own = quality_level(plan.quality);
  scene.atmosphere.top_km = full.atmosphere.top_km;
  if (plan.scene.solver.order_tolerance > own.order_tolerance) {
    scene.solver.order_tolerance =
        std::max(plan.scene.solver.order_tolerance, level.order_tolerance);
  }
  return scene;
}

// In the short run both the full model and the planned one have the steps of "draft", for the truth
// would take a minute per scene: what is left out is tested, and the error measured for the level's
// steps is added. TWILIGHT_NIGHTLY=200 takes 200 scenes with every aerosol, each as planned,
// against the full model at "standard" (at "high" where the plan itself has "standard" or finer
// steps).
TEST(Budget, IsKeptOverRandomScenes) {
  const char* nightly = std::getenv("TWILIGHT_NIGHTLY");
  const int scenes = nightly != nullptr ? std::max(1, std::atoi(nightly)) : 24;
  RandomScene random(20250301);
  KnownPhases known;
  int within = 0, refused = 0;
  for (int i = 0; i < scenes; ++i) {
    Scene full = random.scene(nightly != nullptr);
    const WantedSky wanted = random.wanted();
    const double budget = 0.003 * std::pow(100.0 / 3, random.between(0, 1));
    Scene asked = full;
    asked.budget.max_relative_error = budget;
    BudgetPlan plan;
    try {
      plan = plan_budget(asked, wanted, known, RunControl{});
    } catch (const std::invalid_argument&) {  // finer than any level: refused
      ++refused;
      continue;
    }
    double error = 0;
    if (nightly != nullptr) {
      const bool fine = plan.quality != "draft" && plan.quality != "fair";
      error = error_of(at_steps(full, quality_level(fine ? "high" : "standard")), plan.scene,
                       wanted, known);
    } else {
      const QualityLevel& steps = quality_level("draft");
      error = plan.discretisation_error +
              error_of(at_steps(full, steps), moved_to(plan, full, steps), wanted, known);
    }
    within += error <= budget;
    std::string left_out;
    for (const LeftOut& e : plan.left_out) left_out += e.what + "; ";
    EXPECT_LE(error, 2 * budget) << left_out << "\n" << to_toml(plan.scene);
    std::cout << "Sun " << *full.sun.elevation_deg << ", " << full.aerosols.type << ", "
              << full.spectrum.wavelengths_nm.size() << " nm, " << wanted.views.views.size()
              << " views, " << full.observer.height_m << " m, albedo " << full.earth.ground_albedo
              << ": " << plan.quality << ", budget " << budget << ", estimated "
              << plan.estimated_error << ", true " << error << ", without " << left_out
              << std::endl;
  }
  EXPECT_LE(refused, scenes / 4);
  EXPECT_GE(within, 0.95 * (scenes - refused));
}

}  // namespace
}  // namespace twilight
