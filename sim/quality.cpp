#include "sim/quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace twilight {
namespace {

// Measured with tests/bench/quality_bench; see there for how.
constexpr QualityLevel kLevels[] = {
    {.name = "draft",
     .zenith_step_deg = 3,
     .altitude_levels = 20,
     .polar_directions = 16,
     .azimuth_directions = 6,
     .phase_degree = 12,
     .order_tolerance = 5e-3,
     .coarse_orders = true,
     .sunlight_nodes = 96,
     .seconds = 1.5,
     .mean_error = {0.002, 0.003, 0.01, 0.007, 0.02, 0.03, 0.05},
     .error_95 = {0.005, 0.009, 0.02, 0.012, 0.032, 0.04, 0.08}},
    {.name = "fair",
     .zenith_step_deg = 1.5,
     .altitude_levels = 30,
     .polar_directions = 20,
     .azimuth_directions = 8,
     .phase_degree = 16,
     .order_tolerance = 2e-3,
     .coarse_orders = true,
     .sunlight_nodes = 256,
     .seconds = 3,
     .mean_error = {0.001, 0.002, 0.003, 0.003, 0.007, 0.008, 0.008},
     .error_95 = {0.003, 0.005, 0.006, 0.006, 0.013, 0.019, 0.014}},
    {.name = "standard",
     .zenith_step_deg = 1,
     .altitude_levels = 50,
     .polar_directions = 32,
     .azimuth_directions = 16,
     .phase_degree = 24,
     .order_tolerance = 1e-3,
     .coarse_orders = true,
     .sunlight_nodes = 512,
     .seconds = 20,
     .mean_error = {0.0005, 0.0005, 0.0005, 0.0005, 0.0005, 0.0005, 0.001},
     .error_95 = {0.001, 0.001, 0.001, 0.001, 0.001, 0.001, 0.002}},
    {.name = "high",
     .zenith_step_deg = 0.7,
     .altitude_levels = 70,
     .polar_directions = 44,
     .azimuth_directions = 20,
     .phase_degree = 32,
     .order_tolerance = 5e-4,
     .coarse_orders = true,
     .sunlight_nodes = 768,
     .seconds = 80,
     .mean_error = {0.0003, 0.0003, 0.0003, 0.0003, 0.0003, 0.0003, 0.0005},
     .error_95 = {0.0005, 0.0005, 0.0005, 0.0005, 0.0005, 0.0005, 0.001}},
    {.name = "reference",
     .zenith_step_deg = 0.5,
     .altitude_levels = 100,
     .polar_directions = 64,
     .azimuth_directions = 24,
     .phase_degree = 40,
     .order_tolerance = 1e-4,
     .coarse_orders = false,
     .sunlight_nodes = 1024,
     .seconds = 600,
     .mean_error = {0.0001, 0.0001, 0.0001, 0.0001, 0.0001, 0.0001, 0.0002},
     .error_95 = {0.0002, 0.0002, 0.0002, 0.0002, 0.0002, 0.0002, 0.0005}},
};

}  // namespace

std::span<const QualityLevel> quality_levels() { return kLevels; }

const QualityLevel& quality_level(std::string_view name) {
  std::string names;
  for (const QualityLevel& level : kLevels) {
    if (level.name == name) return level;
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", level.name);
  }
  throw std::invalid_argument(fmt::format("quality = \"{}\": must be one of {}", name, names));
}

double discretisation_error(const QualityLevel& level, double sun_elevation_deg) {
  // Elevations decrease along the table.
  std::size_t below = 0;
  while (below + 1 < kQualitySun_deg.size() && kQualitySun_deg[below] > sun_elevation_deg) ++below;
  const std::size_t above = below > 0 ? below - 1 : 0;
  return std::max(level.error_95[above], level.error_95[below]);
}

void apply_quality(const QualityLevel& level, const std::function<bool(std::string_view)>& free,
                   SolverOptions& solver) {
  const auto set = [&](std::string_view key, auto& option, auto value) {
    if (free(key)) option = value;
  };
  set("solver.zenith_step_deg", solver.zenith_step_deg, level.zenith_step_deg);
  set("solver.altitude_levels", solver.altitude_levels, level.altitude_levels);
  set("solver.polar_directions", solver.polar_directions, level.polar_directions);
  set("solver.azimuth_directions", solver.azimuth_directions, level.azimuth_directions);
  set("solver.phase_degree", solver.phase_degree, level.phase_degree);
  set("solver.order_tolerance", solver.order_tolerance, level.order_tolerance);
  set("solver.coarse_orders", solver.coarse_orders, level.coarse_orders);
  set("solver.sunlight_nodes", solver.sunlight_nodes, level.sunlight_nodes);
}

std::string quality_table() {
  std::string text =
      "quality (--set quality=...): processor seconds of 8 wavelengths in continental average "
      "air;\n"
      "error of the radiance over the hemisphere, mean / 95 % of the sky, per cent, by Sun:\n";
  text += fmt::format("{:<11}{:>8}", "", "seconds");
  for (const double sun : kQualitySun_deg)
    text += fmt::format("{:>11}", fmt::format("{} deg", sun));
  text += "\n";
  for (const QualityLevel& level : kLevels) {
    text += fmt::format("{:<11}{:>8.3g}", level.name, level.seconds);
    for (std::size_t i = 0; i < kQualitySun_deg.size(); ++i) {
      text += fmt::format("{:>11}", fmt::format("{:.2g}/{:.2g}", 100 * level.mean_error[i],
                                                100 * level.error_95[i]));
    }
    text += "\n";
  }
  return text;
}

}  // namespace twilight
