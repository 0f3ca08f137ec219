#include "sim/cost_model.h"

#include <fmt/format.h>
#include <oneapi/tbb/info.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "sim/angular_moments.h"
#include "sim/cell_grid.h"
#include "sim/scene_model.h"
#include "sim/spectral_lanes.h"
#include "sim/zenith_grid.h"

namespace twilight {
namespace {

constexpr double kMiB = 1024.0 * 1024.0;

// Processor seconds on two shared cores of an AMD EPYC with AVX-512; tests/bench/cost_bench prints
// predictions beside measurements.
constexpr double kOrdersStartSeconds = 0.35;
constexpr double kSunRaysSeconds = 0.05;   // per colour traced, 512 x 192 rays
constexpr double kSunlightSeconds = 0.08;  // per wavelength, 512 nodes
constexpr double kBeamSeconds = 3.4e-10;   // per sample, pair of Sun and azimuth, and lane
constexpr double kAerosolBeamSeconds = 1.7e-10;
constexpr double kAirSeconds = 2.5e-9;       // the same, of light scattered before
constexpr double kAerosolSeconds = 7.4e-10;  // and degree
constexpr double kViewSeconds = 1.2e-3;      // per 8 wavelengths
constexpr double kTableViews = 700;          // of an interpolated map
constexpr double kCellsStartSeconds = 0.4;
constexpr double kPairSeconds = 9.0e-7;     // per ring pair and lane, evaluated and passed 7 times
constexpr double kPairAgainSeconds = 4e-7;  // per pass where the kernels are not kept
constexpr double kPairBytes = 44;           // per lane
constexpr double kLargestStoreBytes = 1200 * kMiB;
constexpr double kCellViewSeconds = 3e-5;  // per 8 wavelengths
constexpr double kProcessBytes = 24 * kMiB;
constexpr double kPhaseBytes = 5 * kMiB;  // of aerosols, per lane

struct Sizes {
  double wavelengths, lanes, kinds;
};

double phase_seconds_per_wavelength(const Scene& scene) {
  if (!mie_phase(scene)) return 0;
  // Sea salt has the largest particles; what a mixture file holds is not looked at.
  const AerosolOptions& a = scene.aerosols;
  const double seconds = a.mixture || a.type.starts_with("maritime") ? 0.45 : 0.09;
  return a.humidity == "profile" ? 2 * seconds : seconds;
}

Sizes sizes_of(const Scene& scene) {
  Sizes s;
  s.wavelengths = static_cast<double>(solved_wavelengths_nm(scene.spectrum).size());
  s.lanes = static_cast<double>(padded_lanes(solved_wavelengths_nm(scene.spectrum).size()));
  const AerosolOptions& a = scene.aerosols;
  s.kinds = replaces_profile(scene) ? 1.0
            : !has_column_aerosol(scene)
                ? 0.0
                : static_cast<double>(a.mixing_layer) + static_cast<double>(a.free_troposphere) +
                      static_cast<double>(a.stratosphere);
  if (!replaces_profile(scene)) {
    s.kinds += static_cast<double>(scene.volcanic_sulfate.optical_depth_550nm > 0) +
               static_cast<double>(scene.dust_layer.optical_depth_550nm > 0);
  }
  return s;
}

// Altitudes of the aerosol's top and bottom decide how many levels carry it.
double aerosol_share_of_levels(const Scene& scene, double kinds) {
  if (kinds == 0) return 0;
  double top_km = replaces_profile(scene)           ? scene.atmosphere.top_km
                  : !has_column_aerosol(scene)      ? 0.0
                  : scene.aerosols.stratosphere     ? 35.0
                  : scene.aerosols.free_troposphere ? 12.0
                                                    : 3.0;
  for (const AddedLayerOptions* layer : std::initializer_list<const AddedLayerOptions*>{
           &scene.volcanic_sulfate, &scene.dust_layer}) {
    if (layer->optical_depth_550nm > 0) top_km = std::max(top_km, layer->top_km);
  }
  // Levels stand at top v^2 (0.6 + 0.4 v).
  double v = 0;
  while (v < 1 && scene.atmosphere.top_km * v * v * (0.6 + 0.4 * v) < top_km) v += 0.01;
  return v;
}

RunCost predict_orders(const Scene& scene, std::size_t views) {
  const SolverOptions& s = scene.solver;
  const Sizes size = sizes_of(scene);
  const ZenithGrid zenith(s.zenith_step_deg);
  const double all_nodes = static_cast<double>(zenith.size());
  const auto dark =
      std::ranges::upper_bound(zenith.zenith_rad(), s.darkest_zenith_deg * std::numbers::pi / 180);
  const double nodes = static_cast<double>(dark - zenith.zenith_rad().begin()) + 1;
  const double share = aerosol_share_of_levels(scene, size.kinds);
  const double stokes = polarised(scene) ? 3 : 1, polarisation_cost = polarised(scene) ? 1 : 0.5;
  const double Z = s.altitude_levels;
  const int most = s.scattering_orders.value_or(500);
  const double orders =
      std::min<double>(most, 2 + std::max(2.5, std::log(20 * s.order_tolerance / 0.2) /
                                                   std::log(size.kinds > 0 ? 0.55 : 0.4)));

  // Rays of a level meet about as many levels as there are, and bend round by some steps.
  constexpr double kTurns = 20;
  const auto sweep = [&](double levels, double polar, double azimuths, double sources) {
    return levels * polar * (sources + kTurns) * nodes * azimuths * size.lanes * polarisation_cost;
  };
  const double P = s.polar_directions, A = s.azimuth_directions;
  double seconds = kOrdersStartSeconds + size.wavelengths * phase_seconds_per_wavelength(scene);
  const double fineness = s.sunlight_nodes / 512.0;
  seconds += size.wavelengths * kSunlightSeconds * fineness +
             std::min(size.wavelengths, 3.0) * kSunRaysSeconds * fineness * fineness;
  if (orders >= 2) {
    seconds += sweep(Z, P, A, 6 * Z) * (kBeamSeconds + (size.kinds > 0 ? kAerosolBeamSeconds : 0));
  }
  const auto scattered = [&](double levels, double polar, double azimuths, double degree) {
    // Half of the work is done once per mode, of which there are some eight, not per azimuth.
    const double modes = 0.5 * (std::min(A, azimuths) + 8);
    return sweep(levels, std::min(P, polar), modes, 0.5 * levels) *
           (kAirSeconds + kAerosolSeconds * share * degree);
  };
  if (s.coarse_orders) {
    if (orders >= 3) seconds += scattered(Z, 24, 12, 17);
    if (orders >= 4) seconds += (orders - 3) * scattered(Z / 2, 20, 8, 9);
  } else {
    seconds += std::max(0.0, orders - 2) * scattered(Z, P, A, 9);
  }
  const auto all_views = static_cast<double>(views);
  const double looked = s.view_interpolation ? std::min(all_views, kTableViews) : all_views;
  seconds += looked * kViewSeconds * size.lanes / 8;
  seconds += static_cast<double>(views) * 2e-7 * size.lanes;

  // Light of four orders, two sources and the field, padded to lanes; beam and reference on the
  // fine scale.
  const double real = s.single_precision ? 4 : 8;
  const double moments =
      size.kinds > 0 ? stokes * static_cast<double>(moment_count(s.phase_degree)) : 0;
  const double light = Z * all_nodes * (4 + share * moments) * size.lanes;
  const double fine = static_cast<double>(ZenithGrid::kFineSize) * size.lanes;
  RunCost cost;
  cost.reference_seconds = seconds;
  const double held = orders < 2 ? 1 : 4;
  cost.peak_bytes = kProcessBytes + light * (held * real + 2 * 4) + fine * Z * (3 * real + 2 * 4) +
                    (size.kinds > 0 ? size.lanes * kPhaseBytes : 0) +
                    0.62 * fine * (s.sunlight_nodes / 2.0) * 4 +  // to the Earth's shadow
                    size.wavelengths * s.sunlight_nodes * s.sunlight_nodes * 3.0 / 8 * 16 +
                    size.kinds * size.lanes * 4096 * 4 * 4;
  return cost;
}

RunCost predict_cells(const Scene& scene, std::size_t views) {
  const SolverOptions& s = scene.solver;
  const Sizes size = sizes_of(scene);
  // The cells' geometry needs the layers alone.
  Medium air;
  air.earth_radius_km = scene.earth.radius_km.value_or(6371.0);
  const int layers = scene.atmosphere.layers;
  for (int i = 0; i <= layers; ++i) {
    air.boundary_km.push_back(scene.atmosphere.top_km * i / layers);
  }
  CellGridOptions options;
  options.azimuth_divisions = s.azimuth_divisions;
  options.inner_radius_km = s.inner_radius_m * 1e-3;
  options.observer_height_km = observer_altitude_km(scene);
  options.active_shell_stride = s.active_shell_stride;
  options.group_shells = s.active_shell_weighting != "rescale";
  options.cell_height_km = s.cell_height_km;
  const CellGrid grid(air, options);
  const auto rings = static_cast<double>(grid.rings().size());
  const double pairs = rings * (rings + 1) / 2 * size.lanes;
  const double passes = s.scattering_orders.value_or(8) - 1;
  constexpr double kPasses = 7;
  RunCost cost;
  cost.reference_seconds = kCellsStartSeconds +
                           pairs * kPairSeconds * (0.5 + 0.5 * passes / kPasses) +
                           static_cast<double>(views) * kCellViewSeconds * size.lanes / 8;
  const double store = pairs * kPairBytes;
  if (store > kLargestStoreBytes) cost.reference_seconds += passes * pairs * kPairAgainSeconds;
  cost.peak_bytes = kProcessBytes + 11 * kMiB + std::min(store, kLargestStoreBytes);
  return cost;
}

double seconds_now() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

RunCost predict_run(const Scene& scene, std::size_t views) {
  if (scene.solver.method == "orders") return predict_orders(scene, views);
  if (scene.solver.method == "cells") return predict_cells(scene, views);
  RunCost unknown;
  unknown.known = false;
  return unknown;
}

double machine_slowness() {
  // Least of some runs: others may use the machine too.
  constexpr double kReferenceSeconds = 2.4e-4;
  constexpr int kRuns = 7, kRounds = 1000;
  std::vector<float> x(1024);
  double least = std::numeric_limits<double>::infinity();
  for (int run = 0; run < kRuns; ++run) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = 1e-3F * static_cast<float>(i);
    const double start = seconds_now();
    for (int round = 0; round < kRounds; ++round) {
      for (float& v : x) v = 0.5F * v + 0.25F * v * v - 0.125F * v * v * v;
    }
    least = std::min(least, seconds_now() - start);
  }
  volatile float sink = x[17];
  (void)sink;
  return least / kReferenceSeconds;
}

double wall_seconds(double processor_seconds, const Scene& scene) {
  const int cores = oneapi::tbb::info::default_concurrency();
  const int threads = scene.solver.threads > 0 ? std::min(scene.solver.threads, cores) : cores;
  constexpr double kParallelShare = 0.95;
  return processor_seconds * (kParallelShare / threads + 1 - kParallelShare);
}

std::optional<double> available_bytes() {
  std::optional<double> least;
  const auto offer = [&](double bytes) { least = std::min(least.value_or(bytes), bytes); };
  std::ifstream info("/proc/meminfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("MemAvailable:")) offer(1024 * std::strtod(line.c_str() + 13, nullptr));
  }
  const auto number_in = [](const std::string& file) -> std::optional<double> {
    std::ifstream stream(file);
    double value = 0;  // "max" is no number
    if (stream >> value) return value;
    return std::nullopt;
  };
  // Control groups of version 2 (the process's own and the root), and of version 1.
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::string path = line.substr(line.rfind(':') + 1);
    for (const auto& [limit, used] :
         {std::pair{"/sys/fs/cgroup" + path + "/memory.max",
                    "/sys/fs/cgroup" + path + "/memory.current"},
          std::pair{std::string("/sys/fs/cgroup/memory.max"),
                    std::string("/sys/fs/cgroup/memory.current")},
          std::pair{"/sys/fs/cgroup/memory" + path + "/memory.limit_in_bytes",
                    "/sys/fs/cgroup/memory" + path + "/memory.usage_in_bytes"}}) {
      const auto most = number_in(limit), now = number_in(used);
      if (most && now) offer(std::max(0.0, *most - *now));
    }
  }
  return least;
}

void require_memory(const Scene& scene, const RunCost& cost, std::optional<double> available) {
  if (!available || cost.peak_bytes <= *available) return;
  // The setting that would fit: halves of the one that memory is proportional to.
  struct Setting {
    const char* key;
    std::function<bool(Scene&)> halve;
  };
  const Setting orders[] = {{"solver.altitude_levels",
                             [](Scene& s) {
                               s.solver.altitude_levels /= 2;
                               return s.solver.altitude_levels >= 8;
                             }},
                            {"solver.phase_degree",
                             [](Scene& s) {
                               s.solver.phase_degree /= 2;
                               return s.solver.phase_degree >= 4;
                             }},
                            {"solver.zenith_step_deg", [](Scene& s) {
                               s.solver.zenith_step_deg *= 2;
                               return s.solver.zenith_step_deg <= 3;
                             }}};
  const Setting cells[] = {{"solver.azimuth_divisions",
                            [](Scene& s) {
                              s.solver.azimuth_divisions = s.solver.azimuth_divisions / 4 * 2;
                              return s.solver.azimuth_divisions >= 8;
                            }},
                           {"solver.active_shell_stride", [](Scene& s) {
                              s.solver.active_shell_stride *= 2;
                              return s.solver.active_shell_stride <= 32;
                            }}};
  std::string advice = "fewer wavelengths";
  Scene smaller = scene;
  const auto value = [](const Scene& s, std::string_view key) {
    if (key == "solver.altitude_levels") return static_cast<double>(s.solver.altitude_levels);
    if (key == "solver.phase_degree") return static_cast<double>(s.solver.phase_degree);
    if (key == "solver.zenith_step_deg") return s.solver.zenith_step_deg;
    if (key == "solver.azimuth_divisions") return static_cast<double>(s.solver.azimuth_divisions);
    return static_cast<double>(s.solver.active_shell_stride);
  };
  std::string so_far;
  const auto settings = scene.solver.method == "cells" ? std::span<const Setting>(cells)
                                                       : std::span<const Setting>(orders);
  for (const Setting& setting : settings) {
    bool fits = false;
    for (Scene next = smaller; setting.halve(next); setting.halve(next)) {
      smaller = next;
      fits = predict_run(smaller, 0).peak_bytes <= *available;
      if (fits) break;
    }
    so_far += fmt::format("{}{} = {}", so_far.empty() ? "" : " with ", setting.key,
                          value(smaller, setting.key));
    if (fits) {
      advice = so_far;
      break;
    }
  }
  throw std::invalid_argument(
      fmt::format("the run needs about {:.0f} MiB, the machine has {:.0f} MiB left: {} would fit",
                  cost.peak_bytes / kMiB, *available / kMiB, advice));
}

}  // namespace twilight
