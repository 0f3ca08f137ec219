#include "sim/quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace twilight {
namespace {

// Optical depth at 550 nm of the continental average air measured.
constexpr double kHazyDepth = 0.15;

// Errors: tests/bench/quality_bench --quick --truth 0.5:90:56:24:40:1e-4:1024 (400, 550, 700 nm);
// seconds: cost_bench, 8 wavelengths, continental average air.
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
     .seconds = 1.7,
     .clear = {.mean = {0.00019, 0.0013, 0.002, 0.0022, 0.0058, 0.0073, 0.0022},
               .percentile_95 = {0.00028, 0.0023, 0.0052, 0.0099, 0.011, 0.012, 0.0053}},
     .hazy = {.mean = {0.0016, 0.0024, 0.009, 0.008, 0.013, 0.036, 0.036},
              .percentile_95 = {0.0046, 0.0087, 0.019, 0.016, 0.023, 0.06, 0.058}},
     .turbid = {.mean = {0.0043, 0.01, 0.025, 0.012, 0.026, 0.065, 0.045},
                .percentile_95 = {0.018, 0.035, 0.053, 0.035, 0.052, 0.12, 0.083}}},
    {.name = "fair",
     .zenith_step_deg = 1.5,
     .altitude_levels = 30,
     .polar_directions = 20,
     .azimuth_directions = 8,
     .phase_degree = 16,
     .order_tolerance = 2e-3,
     .coarse_orders = true,
     .sunlight_nodes = 256,
     .seconds = 3.3,
     .clear = {.mean = {5.9e-05, 5.4e-05, 0.00018, 0.00025, 0.0011, 0.0012, 0.0025},
               .percentile_95 = {0.00015, 0.00035, 0.00033, 0.00092, 0.0021, 0.0017, 0.0028}},
     .hazy = {.mean = {0.0011, 0.0018, 0.0025, 0.002, 0.0053, 0.016, 0.0068},
              .percentile_95 = {0.003, 0.0043, 0.0051, 0.0068, 0.0096, 0.027, 0.0092}},
     .turbid = {.mean = {0.0011, 0.0045, 0.0053, 0.0071, 0.012, 0.023, 0.029},
                .percentile_95 = {0.0047, 0.0062, 0.0084, 0.0098, 0.017, 0.034, 0.047}}},
    {.name = "standard",
     .zenith_step_deg = 1,
     .altitude_levels = 50,
     .polar_directions = 32,
     .azimuth_directions = 16,
     .phase_degree = 24,
     .order_tolerance = 1e-3,
     .coarse_orders = true,
     .sunlight_nodes = 512,
     .seconds = 8.8,
     .clear = {.mean = {3.6e-05, 3.7e-05, 3.6e-05, 0.00036, 0.00067, 0.00057, 0.00043},
               .percentile_95 = {4.6e-05, 8.1e-05, 9.9e-05, 0.00058, 0.0016, 0.0012, 0.00072}},
     .hazy = {.mean = {0.00021, 0.00018, 0.00032, 0.00027, 0.00078, 0.0012, 0.00095},
              .percentile_95 = {0.0007, 0.00046, 0.00073, 0.00076, 0.0013, 0.0015, 0.0015}},
     .turbid = {.mean = {0.00061, 0.0019, 0.0018, 0.0021, 0.004, 0.0074, 0.013},
                .percentile_95 = {0.0011, 0.0027, 0.003, 0.0029, 0.0058, 0.01, 0.016}}},
    {.name = "high",
     .zenith_step_deg = 0.7,
     .altitude_levels = 70,
     .polar_directions = 44,
     .azimuth_directions = 20,
     .phase_degree = 32,
     .order_tolerance = 5e-4,
     .coarse_orders = true,
     .sunlight_nodes = 768,
     .seconds = 19,
     .clear = {.mean = {6.3e-06, 1.1e-05, 4.5e-05, 0.00015, 0.00069, 0.00038, 0.00013},
               .percentile_95 = {1.1e-05, 2.8e-05, 8e-05, 0.00041, 0.0011, 0.001, 0.00058}},
     .hazy = {.mean = {0.00015, 0.00032, 0.00049, 0.00037, 0.0013, 0.0034, 0.0023},
              .percentile_95 = {0.00029, 0.00058, 0.00088, 0.00066, 0.0022, 0.0054, 0.0037}},
     .turbid = {.mean = {0.00011, 0.00062, 0.0009, 0.00051, 0.00088, 0.0014, 0.0021},
                .percentile_95 = {0.00022, 0.00086, 0.0024, 0.00074, 0.0014, 0.0029, 0.0029}}},
    {.name = "reference",
     .zenith_step_deg = 0.5,
     .altitude_levels = 100,
     .polar_directions = 64,
     .azimuth_directions = 24,
     .phase_degree = 40,
     .order_tolerance = 1e-4,
     .coarse_orders = false,
     .sunlight_nodes = 1024,
     .seconds = 290,
     // Not measured: half of the errors of "high", whose steps are 1.4 times as long.
     .clear = {.mean = {3.2e-06, 5.5e-06, 2.2e-05, 7.5e-05, 0.00035, 0.00019, 6.5e-05},
               .percentile_95 = {5.5e-06, 1.4e-05, 4e-05, 0.0002, 0.00055, 0.0005, 0.00029}},
     .hazy = {.mean = {7.5e-05, 0.00016, 0.00024, 0.00018, 0.00065, 0.0017, 0.0011},
              .percentile_95 = {0.00015, 0.00029, 0.00044, 0.00033, 0.0011, 0.0027, 0.0019}},
     .turbid = {.mean = {5.5e-05, 0.00031, 0.00045, 0.00025, 0.00044, 0.0007, 0.001},
                .percentile_95 = {0.00011, 0.00043, 0.0012, 0.00037, 0.0007, 0.0014, 0.0014}}},
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

double discretisation_error(const QualityLevel& level, double sun_elevation_deg,
                            double aerosol_optical_depth) {
  // Elevations decrease along the table.
  std::size_t below = 0;
  while (below + 1 < kQualitySun_deg.size() && kQualitySun_deg[below] > sun_elevation_deg) ++below;
  const std::size_t above = below > 0 ? below - 1 : 0;
  const auto at = [&](const QualityLevel::Errors& errors) {
    return std::max(errors.percentile_95[above], errors.percentile_95[below]);
  };
  const double clear = at(level.clear), hazy = std::max(clear, at(level.hazy)),
               turbid = std::max(hazy, at(level.turbid));
  const double depth = aerosol_optical_depth;
  if (depth <= kHazyDepth) return std::lerp(clear, hazy, depth / kHazyDepth);
  if (depth <= kTurbidOpticalDepth) {
    return std::lerp(hazy, turbid, (depth - kHazyDepth) / (kTurbidOpticalDepth - kHazyDepth));
  }
  return turbid * depth / kTurbidOpticalDepth;
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
      "error of the radiance over the hemisphere, mean/95 % of the sky, per cent, by Sun (clear "
      "air:\n"
      "less; urban air: more, see sim/README.md):\n";
  text += fmt::format("{:<11}{:>8}", "", "seconds");
  for (const double sun : kQualitySun_deg) {
    text += fmt::format("{:>13}", fmt::format("{} deg", sun));
  }
  text += "\n";
  for (const QualityLevel& level : kLevels) {
    text += fmt::format("{:<11}{:>8.3g}", level.name, level.seconds);
    for (std::size_t i = 0; i < kQualitySun_deg.size(); ++i) {
      text += fmt::format("{:>13}", fmt::format("{:.2g}/{:.2g}", 100 * level.hazy.mean[i],
                                                100 * level.hazy.percentile_95[i]));
    }
    text += "\n";
  }
  return text;
}

}  // namespace twilight
