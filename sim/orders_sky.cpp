#include "sim/orders_sky.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/angular_moments.h"
#include "sim/gauss_legendre.h"
#include "sim/sun_disc_profile.h"
#include "solar/limb_darkening.h"

namespace twilight {
namespace {

using std::numbers::pi;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

OrdersOptions options_of(const SceneModel& model) {
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

}  // namespace

struct OrdersSky::Arena {
  explicit Arena(int threads) : arena(threads > 0 ? threads : tbb::task_arena::automatic) {}
  tbb::task_arena arena;
};

OrdersSky::OrdersSky(const SceneModel& model, const RunControl& control)
    : OrdersSky(model, nullptr, control) {}

OrdersSky::OrdersSky(const SceneModel& model, std::shared_ptr<const OrdersField> field,
                     const RunControl& control)
    : model_(model), options_(options_of(model)), field_(std::move(field)) {
  arena_ = std::make_unique<Arena>(model_.scene.solver.threads);
  if (model_.ground_albedo.empty()) {
    model_.ground_albedo.assign(model_.medium.wavelengths(), model_.scene.earth.ground_albedo);
  }
  const std::size_t W = model_.medium.wavelengths();
  arena_->arena.execute([&] {
    const auto start = Clock::now();
    optics_ = make_orders_medium(model_.medium, model_.ground_albedo, options_);
    DirectSunlightOptions exact;
    exact.exact = true;
    exact.angle_nodes = options_.sunlight_nodes;
    exact.altitude_nodes = options_.sunlight_nodes * 3 / 8;
    exact.refractive_spreading = model_.scene.atmosphere.refractive_spreading;
    sunlight_ = std::make_unique<DirectSunlight>(optics_.truncated, exact);
    summary_.stage_seconds.emplace_back("direct sunlight", seconds_since(start));
    if (field_) {
      const OrdersField& f = *field_;
      const std::size_t nodes = f.solar_zenith_rad.size();
      const std::size_t moments =
          optics_.degree > 0 ? (options_.polarised ? 3 : 1) * moment_count(optics_.degree) : 0;
      const bool whole_aerosol =
          optics_.degree == 0 ||
          (f.aerosol_levels > 0 && f.aerosol_levels <= f.altitude_km.size() &&
           f.altitude_km[f.aerosol_levels - 1] >= optics_.aerosol_top_km - 1e-9);
      if (f.wavelength_nm != model_.medium.wavelength_nm || f.altitude_km.empty() ||
          f.altitude_km.back() != model_.medium.top_km() || f.phase_degree != optics_.degree ||
          f.polarised != options_.polarised || f.moments_per_node != moments || !whole_aerosol ||
          f.coherency.size() != f.altitude_km.size() * nodes * 4 * W ||
          f.aerosol_moments.size() != f.aerosol_levels * nodes * f.moments_per_node * W ||
          f.ground_irradiance.size() != nodes * W ||
          ZenithGrid(f.zenith_step_deg).size() != nodes) {
        throw std::invalid_argument(
            "the field does not belong to this scene: its wavelengths, "
            "top, phase degree, polarisation or sizes differ");
      }
    } else {
      const auto stage = Clock::now();
      field_ = std::make_shared<OrdersField>(solve_orders(optics_, *sunlight_, options_, control));
      summary_.stage_seconds.emplace_back("orders", seconds_since(stage));
    }
    const auto stage = Clock::now();
    prepare(control);
    summary_.stage_seconds.emplace_back("prepare views", seconds_since(stage));
    summary_.stage_seconds.emplace_back("solve, in all", seconds_since(start));
  });
  auto& figures = summary_.figures;
  figures.emplace_back("field",
                       fmt::format("{} levels x {} solar zenith angles", field_->altitude_km.size(),
                                   field_->solar_zenith_rad.size()));
  figures.emplace_back("scattering events", fmt::format("{}", field_->orders));
  if (optics_.degree > 0) {
    figures.emplace_back(
        "aerosol phase functions",
        fmt::format("{} kinds to degree {}", optics_.kinds.size(), optics_.degree));
  }
  std::string shares;
  for (std::size_t k = W / 2; k < field_->order_share.size(); k += W) {
    shares += fmt::format("{}{:.3g}", shares.empty() ? "" : ", ", field_->order_share[k]);
  }
  if (!shares.empty()) {
    figures.emplace_back(fmt::format("share of each order in the mean radiance, Sun -6 deg, {} nm",
                                     model_.medium.wavelength_nm[W / 2]),
                         shares);
  }
}

OrdersSky::~OrdersSky() = default;

void OrdersSky::prepare(const RunControl& control) {
  control.check();
  const Medium& m = model_.medium;
  const double height_km = model_.scene.observer.height_m * 1e-3;
  const double zenith = pi / 2 - model_.sun_elevation_rad;
  OrdersGather::Inputs in;
  in.medium = &model_.medium;
  in.optics = &optics_;
  in.field = field_.get();
  in.sunlight = sunlight_.get();
  in.options = options_;
  in.solar_zenith_rad = zenith;
  in.observer_altitude_km = height_km;
  // The furthest air seen: over the horizon to the top.
  const double R = m.earth_radius_km;
  in.reach_rad = std::acos(R / (R + height_km)) + std::acos(R / (R + m.top_km())) + 0.05;
  gather_ = std::make_unique<OrdersGather>(in);

  sun_transmittance_.assign(m.wavelengths(), 0.0);
  apparent_elevation_rad_ = model_.sun_elevation_rad;
  std::vector<double> path(m.layers());
  for (std::size_t w = 0; w < m.wavelengths(); ++w) {
    const RefractedRays rays(m, w);
    const auto apparent = rays.apparent_zenith_rad(height_km, zenith);
    if (!apparent) continue;
    const RayTrace trace = rays.trace_outward(height_km, *apparent, path);
    if (trace.hits_ground) continue;
    const double filter =
        m.vertical_filter_optical_depth.empty() ? 0.0 : m.vertical_filter_optical_depth[w];
    sun_transmittance_[w] = std::exp(-slant_optical_depth(m, w, path) - filter);
    if (w == m.wavelengths() / 2) apparent_elevation_rad_ = pi / 2 - *apparent;
  }
}

std::span<const double> OrdersSky::wavelength_nm() const { return model_.medium.wavelength_nm; }
std::span<const double> OrdersSky::solar_irradiance() const { return model_.solar_irradiance; }

StokesRadiance OrdersSky::gather(std::span<const ViewDirection> views,
                                 OrdersGather::Light light) const {
  const std::size_t W = model_.medium.wavelengths();
  StokesRadiance out;
  out.i.resize(views.size() * W);
  if (options_.polarised) {
    out.q.resize(views.size() * W);
    out.u.resize(views.size() * W);
  }
  arena_->arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, views.size(), [&](std::size_t k) {
      const OrdersGather::Spectrum s =
          gather_->view(views[k].elevation_rad, views[k].relative_azimuth_rad, light);
      for (std::size_t w = 0; w < W; ++w) {
        const double sun = model_.solar_irradiance[w];
        out.i[k * W + w] = sun * s.i[w];
        if (!std::isfinite(out.i[k * W + w])) {
          throw std::runtime_error("the sky radiance is not finite");
        }
        if (!options_.polarised) continue;
        // Rounding must not polarise light by more than itself.
        const double p = std::hypot(s.q[w], s.u[w]);
        const double scale = p > s.i[w] ? s.i[w] / p : 1.0;
        out.q[k * W + w] = sun * scale * s.q[w];
        out.u[k * W + w] = sun * scale * s.u[w];
      }
    });
  });
  return out;
}

std::vector<double> OrdersSky::radiance(std::span<const ViewDirection> views) const {
  return gather(views, OrdersGather::Light::kAll).i;
}

StokesRadiance OrdersSky::stokes(std::span<const ViewDirection> views) const {
  return gather(views, OrdersGather::Light::kAll);
}

StokesRadiance OrdersSky::single_scattering(std::span<const ViewDirection> views) const {
  return gather(views, OrdersGather::Light::kSingle);
}

Irradiance OrdersSky::irradiance() const {
  constexpr int kElevations = 24, kAzimuths = 16;
  const std::size_t W = model_.medium.wavelengths();
  std::vector<ViewDirection> views;
  std::vector<double> weight;
  for (const GaussNode& g : gauss_legendre(kElevations, 0, 1)) {
    const double sine = g.x * g.x;  // crowds at the horizon
    for (int k = 0; k < kAzimuths; ++k) {
      views.push_back({std::asin(sine), (k + 0.5) * pi / kAzimuths});
      weight.push_back(2 * g.x * g.weight * sine * 2 * pi / kAzimuths);
    }
  }
  // The truncated phase functions leave their forward peak in the beam, which the diffuse light
  // then takes from it.
  const StokesRadiance sky = gather(views, OrdersGather::Light::kTruncated);
  Irradiance result{std::vector<double>(W), std::vector<double>(W)};
  const double height_km = model_.scene.observer.height_m * 1e-3;
  const double zenith = pi / 2 - model_.sun_elevation_rad;
  std::vector<double> path(model_.medium.layers());
  for (std::size_t w = 0; w < W; ++w) {
    for (std::size_t k = 0; k < views.size(); ++k) {
      result.diffuse[w] += weight[k] * sky.i[k * W + w];
    }
    // Irradiance of the beam with the true extinction and the truncated one, over the disc.
    const RefractedRays rays(model_.medium, w);
    const double filter = model_.medium.vertical_filter_optical_depth.empty()
                              ? 0.0
                              : model_.medium.vertical_filter_optical_depth[w];
    double direct = 0, truncated = 0;
    const double radius = kSunAngularRadiusRad / model_.sun_distance_au;
    constexpr int kStrips = 12;
    for (const GaussNode& strip : options_.disc_average ? disc_strips(wavelength_nm()[w], kStrips)
                                                        : std::vector<GaussNode>{{0.0, 1.0}}) {
      const double chi = std::clamp(zenith + strip.x * radius, 0.0, pi);
      const auto apparent = rays.apparent_zenith_rad(height_km, chi);
      if (!apparent) continue;
      if (rays.trace_outward(height_km, *apparent, path).hits_ground) continue;
      double light = strip.weight * model_.solar_irradiance[w] *
                     std::max(0.0, std::cos(*apparent)) * std::exp(-filter);
      if (model_.scene.atmosphere.refractive_spreading) {
        light *= sunlight_->spreading(height_km, chi);
      }
      direct += light * std::exp(-slant_optical_depth(model_.medium, w, path));
      truncated += light * std::exp(-slant_optical_depth(optics_.truncated, w, path));
    }
    result.direct[w] = direct;
    result.diffuse[w] += std::max(0.0, truncated - direct);
  }
  return result;
}

}  // namespace twilight
