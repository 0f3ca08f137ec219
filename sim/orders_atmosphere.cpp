#include "sim/orders_atmosphere.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/aerosol_emission.h"
#include "sim/angular_moments.h"
#include "sim/elapsed_time.h"
#include "sim/emission_kernel.h"
#include "sim/field_reference.h"

namespace twilight {
namespace {

constexpr std::size_t kBasisNodes = 2049;
// Refractivities, relative, that share a ray.
constexpr double kSharedRefractivity = 0.008;

}  // namespace

OrdersOptions orders_options(const SceneModel& model) {
  const Scene& scene = model.scene;
  const SolverOptions& solver = scene.solver;
  OrdersOptions options;
  options.zenith_step_deg = solver.zenith_step_deg;
  options.altitude_levels = solver.altitude_levels;
  options.polar_directions = solver.polar_directions;
  options.azimuth_directions = solver.azimuth_directions;
  options.phase_degree = solver.phase_degree;
  options.order_tolerance = solver.order_tolerance;
  options.scattering_orders = solver.scattering_orders;
  options.polarised = polarised(scene);
  options.single_precision = solver.single_precision;
  options.disc_average = disc_averaged(scene);
  options.sun_distance_au = model.sun_distance_au;
  options.ground_light = solver.ground_light;
  options.coarse_orders = solver.coarse_orders;
  options.darkest_zenith_deg = solver.darkest_zenith_deg;
  options.sunlight_nodes = solver.sunlight_nodes;
  return options;
}

SolvedAtmosphere::SolvedAtmosphere(const SceneModel& model,
                                   std::shared_ptr<const OrdersField> given,
                                   const RunControl& control, RunSummary& summary)
    : medium(model.medium), options(orders_options(model)), field(std::move(given)) {
  auto stage = Clock::now();
  const auto timed = [&](const char* name) {
    summary.stage_seconds.emplace_back(name, seconds_since(stage));
    stage = Clock::now();
  };
  const std::size_t W = medium.wavelengths();
  const std::vector<double> albedo = model.ground_albedo.empty()
                                         ? std::vector<double>(W, model.scene.earth.ground_albedo)
                                         : model.ground_albedo;
  optics = make_orders_medium(medium, albedo, options);
  if (field) require_fit();
  DirectSunlightOptions exact;
  exact.exact = true;
  exact.angle_nodes = options.sunlight_nodes;
  exact.altitude_nodes = options.sunlight_nodes * 3 / 8;
  exact.refractive_spreading = model.scene.atmosphere.refractive_spreading;
  sunlight = std::make_unique<DirectSunlight>(optics.truncated, exact);
  timed("direct sunlight");
  if (!field) {
    field = std::make_shared<OrdersField>(solve_orders(optics, *sunlight, options, control));
    timed("orders");
  }
  control.check();
}

namespace {

// Boundaries at which haze ends or changes by half, where it dims level sunlight at all.
std::vector<double> haze_edges_km(const Medium& medium) {
  constexpr double kDims_per_km = 1e-4, kAbrupt = 1.5;
  const std::size_t w = medium.wavelengths() / 2;
  const auto haze = [&](std::size_t i) {
    return medium.aerosol_scattering_per_km(i, w) + medium.aerosol_absorption_per_km(i, w);
  };
  std::vector<double> edges;
  for (std::size_t i = 0; i + 1 < medium.layers(); ++i) {
    const double below = haze(i), above = haze(i + 1);
    if (std::abs(below - above) > kDims_per_km &&
        std::max(below, above) > kAbrupt * std::min(below, above)) {
      edges.push_back(medium.boundary_km[i + 1]);
    }
  }
  return edges;
}

}  // namespace

OrdersAtmosphere::OrdersAtmosphere(const SceneModel& model,
                                   std::shared_ptr<const OrdersField> given,
                                   const RunControl& control, RunSummary& summary)
    : SolvedAtmosphere(model, std::move(given), control, summary), zenith(field->zenith_step_deg) {
  const auto start = Clock::now();
  const std::size_t W = wavelengths();
  kinds = aerosol_kinds(medium);
  // Beyond the topmost shadow all is night.
  constexpr double kDiscAndSpare_rad = 0.03;
  sunlit = std::make_unique<SunlitAir>(
      *sunlight, options, medium.wavelength_nm, medium.top_km(), options.sunlight_nodes / 2, 0.0,
      std::min(std::numbers::pi, sunlight->shadow_zenith_rad(medium.top_km()) + kDiscAndSpare_rad),
      haze_edges_km(medium));
  phase = std::make_unique<PhaseTable>(kinds, optics, options, false);
  truncated_phase = std::make_unique<PhaseTable>(kinds, optics, options, true);
  for (std::size_t w = 0; w < W;) {
    std::size_t end = w + 1;
    while (end < W && std::abs(medium.refractivity(0, end) - medium.refractivity(0, w)) <=
                          kSharedRefractivity * medium.refractivity(0, w)) {
      ++end;
    }
    if (w <= W / 2) middle_colour = colours.size();
    colours.push_back({w, end, RefractedRays(medium, (w + end) / 2)});
    w = end;
  }
  const std::size_t layers = medium.layers(), K = kind_count();
  air_per_km.assign(layers * lanes(), 0.0F);
  kind_per_km.assign(layers * K * lanes(), 0.0F);
  constexpr double kClearStep_km = 0.5, kHazeStep_km = 0.05, kHazeStepDepth = 0.0001;
  for (std::size_t i = 0; i < layers; ++i) {
    double haze_per_km = 1e-9;
    for (std::size_t w = 0; w < W; ++w) {
      haze_per_km = std::max(haze_per_km, medium.aerosol_scattering_per_km(i, w) +
                                              medium.aerosol_absorption_per_km(i, w));
    }
    single_step_km.push_back(std::clamp(kHazeStepDepth / haze_per_km, kHazeStep_km, kClearStep_km));
  }
  for (std::size_t i = 0; i < layers; ++i) {
    for (std::size_t w = 0; w < W; ++w) {
      air_per_km[i * lanes() + w] = static_cast<float>(medium.air_scattering_per_km(i, w));
      for (std::size_t q = 0; q < K; ++q) {
        kind_per_km[(i * K + q) * lanes() + w] =
            static_cast<float>(kinds.scattering_per_km[q](i, w));
      }
    }
  }
  relate_field();
  tabulate_emission();
  summary.stage_seconds.emplace_back("prepare views", seconds_since(start));
}

std::vector<std::pair<std::string, std::string>> SolvedAtmosphere::figures() const {
  std::vector<std::pair<std::string, std::string>> figures;
  figures.emplace_back("field",
                       fmt::format("{} levels x {} solar zenith angles", field->altitude_km.size(),
                                   field->solar_zenith_rad.size()));
  figures.emplace_back("scattering events", fmt::format("{}", field->orders));
  if (optics.degree > 0) {
    figures.emplace_back("aerosol phase functions",
                         fmt::format("{} kinds to degree {}", optics.kinds.size(), optics.degree));
  }
  const std::size_t W = wavelengths();
  std::string shares;
  for (std::size_t k = W / 2; k < field->order_share.size(); k += W) {
    shares += fmt::format("{}{:.3g}", shares.empty() ? "" : ", ", field->order_share[k]);
  }
  if (!shares.empty()) {
    figures.emplace_back(fmt::format("share of each order in the mean radiance, Sun -6 deg, {} nm",
                                     medium.wavelength_nm[W / 2]),
                         shares);
  }
  return figures;
}

void OrdersAtmosphere::tabulate_emission() {
  if (optics.degree == 0) return;
  for (const TruncatedPhase& kind : optics.kinds) {
    kind_expansion.insert(kind_expansion.end(), kind.a1.begin(), kind.a1.end());
    kind_expansion.insert(kind_expansion.end(), kind.b1.begin(), kind.b1.end());
  }
  const std::size_t count = moment_count(optics.degree);
  basis_.resize(kBasisNodes * count);
  tbb::parallel_for(std::size_t{0}, kBasisNodes, [&](std::size_t k) {
    const double zenith_rad =
        std::numbers::pi * static_cast<double>(k) / static_cast<double>(kBasisNodes - 1);
    std::vector<float> basis;
    fill_mode_basis(optics.degree, zenith_rad, true, basis);
    for (int l = 0; l <= optics.degree; ++l) {
      for (int m = 0; m <= l; ++m) {
        basis_[k * count + moment_index(l, m)] = basis[3 * mode_major_index(optics.degree, l, m)];
      }
    }
  });
}

void OrdersAtmosphere::emission_basis(double zenith_rad, float* p) const {
  const std::size_t count = moment_count(optics.degree);
  const double u =
      std::clamp(zenith_rad / std::numbers::pi, 0.0, 1.0) * static_cast<double>(kBasisNodes - 1);
  const auto k = std::min(static_cast<std::size_t>(u), kBasisNodes - 2);
  const auto f = static_cast<float>(u - static_cast<double>(k));
  const float *a = &basis_[k * count], *b = a + count;
  for (std::size_t i = 0; i < count; ++i) p[i] = a[i] + f * (b[i] - a[i]);
}

void SolvedAtmosphere::require_fit() const {
  const OrdersField& f = *field;
  const std::size_t W = wavelengths(), nodes = f.solar_zenith_rad.size();
  const std::size_t count =
      optics.degree > 0 ? (options.polarised ? 3 : 1) * moment_count(optics.degree) : 0;
  const bool whole_aerosol =
      optics.degree == 0 || (f.aerosol_levels > 0 && f.aerosol_levels <= f.altitude_km.size() &&
                             f.altitude_km[f.aerosol_levels - 1] >= optics.aerosol_top_km - 1e-9);
  if (f.wavelength_nm != medium.wavelength_nm || f.altitude_km.empty() ||
      f.altitude_km.back() != medium.top_km() || f.phase_degree != optics.degree ||
      f.polarised != options.polarised || f.moments_per_node != count || !whole_aerosol ||
      f.coherency.size() != f.altitude_km.size() * nodes * 4 * W ||
      f.aerosol_moments.size() != f.aerosol_levels * nodes * f.moments_per_node * W ||
      f.ground_irradiance.size() != nodes * W || ZenithGrid(f.zenith_step_deg).size() != nodes) {
    throw std::invalid_argument(
        "the field does not belong to this scene: its wavelengths, "
        "top, phase degree, polarisation or sizes differ");
  }
}

void OrdersAtmosphere::relate_field() {
  const OrdersField& f = *field;
  const std::size_t nodes = f.solar_zenith_rad.size(), levels = f.altitude_km.size();
  const std::size_t W = wavelengths(), L = lanes();
  constexpr std::size_t kFine = ZenithGrid::kFineSize;
  coherency.assign(levels * nodes * 4 * L, 0.0F);
  moments.assign(f.aerosol_levels * nodes * f.moments_per_node * L, 0.0F);
  reference.assign(levels * kFine * L, 0.0F);
  ground.assign(kFine * L, 0.0F);
  tbb::parallel_for(std::size_t{0}, levels, [&](std::size_t i) {
    std::vector<double> trace(nodes * W);
    LevelLight<float, float> light;
    light.nodes = nodes;
    light.in_lanes = W;
    light.out_lanes = L;
    light.coherency = &f.coherency[i * nodes * 4 * W];
    light.anisotropic_share = optics.anisotropic_share.data();
    light.relative_coherency = &coherency[i * nodes * 4 * L];
    light.trace = trace.data();
    if (i < f.aerosol_levels) {
      light.moments = f.moments_per_node;
      light.moment = f.aerosol_moments.data() + i * nodes * f.moments_per_node * W;
      light.relative_moment = moments.data() + i * nodes * f.moments_per_node * L;
    }
    divide_by_trace(light);
    refine_trace(zenith, trace, W, L, 0, kFine, &reference[i * kFine * L]);
  });
  const std::vector<double> irradiance(f.ground_irradiance.begin(), f.ground_irradiance.end());
  refine_trace(zenith, irradiance, W, L, 0, kFine, ground.data());
}

}  // namespace twilight
