// Seconds and errors of the quality levels: quality_bench [--truth LEVEL] [--quick] [LEVEL ...]
//
// Every level solves clear, continental average and urban air over albedo 0.1, 8 wavelengths (3
// with
// --quick), and is compared over the hemisphere with the truth: the reference level with all steps
// refined by a third, or the level named.
#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/elapsed_time.h"
#include "sim/orders_sky.h"
#include "sim/quality.h"
#include "sim/relative_difference.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;

struct Solved {
  double seconds = 0;
  std::vector<std::vector<double>> radiance;  // [Sun][view][wavelength]
};

Solved solve(const char* aerosol, const SolverOptions& solver, const std::vector<double>& nm,
             const WeightedViews& views) {
  Scene scene;
  scene.aerosols.type = aerosol;
  scene.solver = solver;
  scene.solver.method = "orders";
  scene.spectrum.wavelengths_nm = nm;
  scene.sun.spectrum = "unit";
  scene.sun.elevation_deg = kQualitySun_deg[0];
  Solved result;
  const double start = processor_seconds();
  const SceneModel model = build_scene_model(scene);
  const OrdersSky sky(model, RunControl{});
  result.seconds = processor_seconds() - start;
  for (const double sun : kQualitySun_deg) {
    result.radiance.push_back(sky.under(sun * kRadPerDeg)->radiance(views.views));
  }
  return result;
}

// Of a level's name, or of "ZENITH_STEP:LEVELS:POLAR:AZIMUTHS:DEGREE:TOLERANCE:SUNLIGHT_NODES".
SolverOptions steps_of(const std::string& name) {
  SolverOptions s;
  if (name.find(':') == std::string::npos) {
    apply_quality(
        quality_level(name), [](std::string_view) { return true; }, s);
    return s;
  }
  std::istringstream text(name);
  char colon = 0;
  text >> s.zenith_step_deg >> colon >> s.altitude_levels >> colon >> s.polar_directions >> colon >>
      s.azimuth_directions >> colon >> s.phase_degree >> colon >> s.order_tolerance >> colon >>
      s.sunlight_nodes;
  if (!text) throw std::invalid_argument(name + ": must be seven numbers with colons between them");
  return s;
}

SolverOptions refined(SolverOptions s) {
  s.zenith_step_deg *= 0.75;
  s.altitude_levels = s.altitude_levels * 4 / 3;
  s.polar_directions = s.polar_directions * 4 / 3;
  s.azimuth_directions = s.azimuth_directions * 4 / 3;
  s.phase_degree = std::min(64, s.phase_degree * 4 / 3);
  return s;
}

}  // namespace
}  // namespace twilight

int main(int argc, char** argv) try {
  using namespace twilight;
  SolverOptions truth_steps = refined(steps_of("reference"));
  std::vector<double> nm = {380, 420, 460, 500, 550, 600, 650, 700};
  std::vector<std::string> names;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--quick") {
      nm = {400, 550, 700};
    } else if (word == "--truth" && i + 1 < argc) {
      truth_steps = steps_of(argv[++i]);
    } else {
      names.push_back(word);
    }
  }
  if (names.empty()) {
    for (const QualityLevel& level : quality_levels()) names.emplace_back(level.name);
  }
  const WeightedViews views = coarse_hemisphere();
  const std::vector<double> unit(nm.size(), 1.0);
  for (const char* aerosol : {"none", "continental_average", "urban"}) {
    const Solved truth = solve(aerosol, truth_steps, nm, views);
    fmt::print("{}: truth {:.2f} processor seconds\n\n| level | seconds |", aerosol, truth.seconds);
    for (const double sun : kQualitySun_deg) fmt::print(" {}° |", sun);
    fmt::print("\n|---|---|");
    for (std::size_t i = 0; i < kQualitySun_deg.size(); ++i) fmt::print("---|");
    fmt::print("\n");
    for (const std::string& name : names) {
      const Solved level = solve(aerosol, steps_of(name), nm, views);
      fmt::print("| {} | {:.2f} |", name, level.seconds);
      for (std::size_t i = 0; i < kQualitySun_deg.size(); ++i) {
        const RelativeDifference d =
            relative_difference(views, unit, truth.radiance[i], level.radiance[i]);
        fmt::print(" {:.2g}/{:.2g}/{:.2g} |", 100 * d.mean, 100 * d.percentile_95, 100 * d.largest);
      }
      fmt::print("\n");
    }
    fmt::print("\n");
  }
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  fmt::print(stderr, "quality_bench: {}\n", error.what());
  return EXIT_FAILURE;
}
