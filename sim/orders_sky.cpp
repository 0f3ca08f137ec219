#include "sim/orders_sky.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "atmosphere/straight_path.h"
#include "sim/angular_moments.h"
#include "sim/elapsed_time.h"
#include "sim/gauss_legendre.h"
#include "sim/horizontal_quadrature.h"
#include "sim/sky_column.h"
#include "sim/solver_arena.h"
#include "sim/sun_disc_profile.h"
#include "sim/view_segment.h"
#include "solar/limb_darkening.h"

namespace twilight {
namespace {

using std::numbers::pi;

}  // namespace

OrdersSky::OrdersSky(const SceneModel& model, const RunControl& control)
    : OrdersSky(model, std::shared_ptr<const OrdersField>(), control) {}

OrdersSky::OrdersSky(const SceneModel& model, std::shared_ptr<const OrdersField> field,
                     const RunControl& control)
    : model_(model), arena_(std::make_unique<SolverArena>(model.scene.solver.threads)) {
  arena_->arena.execute([&] {
    const auto start = Clock::now();
    atmosphere_ = std::make_shared<OrdersAtmosphere>(model_, std::move(field), control, summary_);
    look(control);
    summary_.stage_seconds.emplace_back("solve, in all", seconds_since(start));
  });
}

OrdersSky::OrdersSky(const SceneModel& model, std::shared_ptr<const OrdersAtmosphere> atmosphere,
                     const RunControl& control)
    : model_(model),
      atmosphere_(std::move(atmosphere)),
      arena_(std::make_unique<SolverArena>(model.scene.solver.threads)) {
  arena_->arena.execute([&] { look(control); });
}

OrdersSky::~OrdersSky() = default;

// Everything that the Sun and the observer decide.
void OrdersSky::look(const RunControl& control) {
  control.check();
  const Medium& m = model_.medium;
  summary_.figures = atmosphere_->figures();
  const double height_km = observer_altitude_km(model_.scene);
  const double zenith = pi / 2 - model_.sun_elevation_rad;
  gather_ = std::make_unique<OrdersGather>(*atmosphere_, zenith, height_km);
  if (!rays_) rays_ = std::make_shared<ObserverRays>(*atmosphere_, height_km);
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
  if (atmosphere_->options.polarised) {
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
        if (!atmosphere_->options.polarised) continue;
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

std::vector<double> OrdersSky::scattered_radiance(std::span<const ViewDirection> views) const {
  return gather(views, OrdersGather::Light::kScattered).i;
}

std::unique_ptr<OrdersSky> OrdersSky::under(double sun_elevation_rad) const {
  SceneModel model = model_;
  model.sun_elevation_rad = sun_elevation_rad;
  auto sky = std::make_unique<OrdersSky>(model, atmosphere_, RunControl{});
  sky->rays_ = rays_;
  return sky;
}

void OrdersSky::tabulate() const {
  const auto start = Clock::now();
  const double zenith = pi / 2 - model_.sun_elevation_rad;
  // Waiting for the table, a thread must not take up a view that waits for it too.
  tbb::this_task_arena::isolate(
      [&] { table_ = std::make_unique<SkyTable>(*atmosphere_, *rays_, *gather_, zenith); });
  summary_.stage_seconds.emplace_back("view interpolation", seconds_since(start));
  summary_.figures.emplace_back(
      "views interpolated between",
      fmt::format("{} elevations x {} azimuths, to about {:.1g} %", table_->elevations(),
                  table_->azimuths(), 100 * SkyTable::kTolerance / 10));
}

std::vector<double> OrdersSky::map_radiance(std::span<const ViewDirection> views) const {
  if (!model_.scene.solver.view_interpolation || atmosphere_->kind_count() > SkyTable::kMostKinds) {
    return radiance(views);
  }
  const std::size_t W = model_.medium.wavelengths();
  std::vector<double> out(views.size() * W);
  std::vector<std::size_t> left;
  std::vector<char> missed(views.size(), 0);
  arena_->arena.execute([&] {
    std::call_once(tabulated_, [&] { tabulate(); });
    constexpr std::size_t kViewsPerTask = 256;
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, views.size(), kViewsPerTask), [&](const auto& range) {
          std::vector<float> seen(atmosphere_->lanes());
          for (std::size_t k = range.begin(); k < range.end(); ++k) {
            if (!table_->radiance(views[k].elevation_rad, views[k].relative_azimuth_rad,
                                  seen.data())) {
              missed[k] = 1;
              continue;
            }
            for (std::size_t w = 0; w < W; ++w) {
              out[k * W + w] = model_.solar_irradiance[w] * static_cast<double>(seen[w]);
              if (!std::isfinite(out[k * W + w])) {
                throw std::runtime_error("the sky radiance is not finite");
              }
            }
          }
        });
  });
  std::vector<ViewDirection> rest;
  for (std::size_t k = 0; k < views.size(); ++k) {
    if (missed[k] == 0) continue;
    left.push_back(k);
    rest.push_back(views[k]);
  }
  if (rest.empty()) return out;
  const std::vector<double> gathered = radiance(rest);
  for (std::size_t k = 0; k < left.size(); ++k) {
    std::copy_n(&gathered[k * W], W, &out[left[k] * W]);
  }
  return out;
}

StokesRadiance OrdersSky::stokes(std::span<const ViewDirection> views) const {
  return gather(views, OrdersGather::Light::kAll);
}

std::optional<AerialLight> OrdersSky::aerial_light(const ViewDirection& view,
                                                   double distance_km) const {
  const Medium& m = model_.medium;
  const std::size_t W = m.wavelengths();
  const double height_km = observer_altitude_km(model_.scene);
  const ViewSegment segment =
      view_segment(m.earth_radius_km, height_km, model_.sun_elevation_rad, view, distance_km);
  SceneModel there = model_;
  there.sun_elevation_rad = segment.sun_elevation_rad;
  there.scene.observer.height_m = 1000 * segment.altitude_km;
  std::vector<double> path(m.layers());
  straight_path(m, height_km, pi / 2 - view.elevation_rad, segment.length_km, path);
  const ViewDirection looked[] = {view}, seen_there[] = {segment.view};
  const std::vector<double> here = radiance(looked);
  const std::vector<double> behind = OrdersSky(there, atmosphere_, {}).radiance(seen_there);
  AerialLight light{std::vector<double>(W), std::vector<double>(W)};
  for (std::size_t w = 0; w < W; ++w) {
    light.transmittance[w] = std::exp(-slant_optical_depth(m, w, path));
    light.inscattered[w] = std::max(0.0, here[w] - light.transmittance[w] * behind[w]);
  }
  return light;
}

StokesRadiance OrdersSky::single_scattering(std::span<const ViewDirection> views) const {
  return gather(views, OrdersGather::Light::kSingle);
}

// Columns share a ray among azimuths, as maps do, but nothing is interpolated.
std::vector<double> OrdersSky::energy_radiance(std::span<const ViewDirection> views,
                                               std::size_t azimuths) const {
  if (!model_.scene.solver.view_interpolation || atmosphere_->kind_count() > SkyTable::kMostKinds) {
    return gather(views, OrdersGather::Light::kTruncated).i;
  }
  const std::size_t W = model_.medium.wavelengths();
  std::vector<double> out(views.size() * W);
  arena_->arena.execute([&] {
    const SkyColumns columns(*atmosphere_, *gather_, pi / 2 - model_.sun_elevation_rad, true);
    tbb::parallel_for(std::size_t{0}, views.size() / azimuths, [&](std::size_t e) {
      const double elevation = views[e * azimuths].elevation_rad;
      std::vector<double> around;
      for (std::size_t a = 0; a < azimuths; ++a) {
        around.push_back(views[e * azimuths + a].relative_azimuth_rad);
      }
      const std::vector<float> light = columns.at(*rays_->at(elevation), around);
      std::vector<float> seen(atmosphere_->lanes());
      for (std::size_t a = 0; a < azimuths; ++a) {
        SkyPoint point = columns.point(elevation, around[a]);
        point.phase = atmosphere_->truncated_phase->values();
        point.nodes = 2;
        point.node[0] = point.node[1] = &light[a * columns.block()];
        point.weight[0] = 1;
        sky_radiance(point, seen.data());
        for (std::size_t w = 0; w < W; ++w) {
          double& i = out[(e * azimuths + a) * W + w];
          i = model_.solar_irradiance[w] * static_cast<double>(seen[w]);
          if (!std::isfinite(i)) throw std::runtime_error("the sky radiance is not finite");
        }
      }
    });
  });
  return out;
}

Irradiance OrdersSky::irradiance() const {
  constexpr int kElevations = 24, kAzimuths = 16;
  const std::size_t W = model_.medium.wavelengths();
  const auto [views, weight] = horizontal_quadrature(kElevations, kAzimuths);
  // The truncated phase functions leave their forward peak in the beam, which the diffuse light
  // then takes from it.
  const std::vector<double> sky = energy_radiance(views, kAzimuths);
  Irradiance result{std::vector<double>(W), std::vector<double>(W)};
  const double height_km = observer_altitude_km(model_.scene);
  const double zenith = pi / 2 - model_.sun_elevation_rad;
  std::vector<double> path(model_.medium.layers());
  for (std::size_t w = 0; w < W; ++w) {
    for (std::size_t k = 0; k < views.size(); ++k) {
      result.diffuse[w] += weight[k] * sky[k * W + w];
    }
    // Irradiance of the beam with the true extinction and the truncated one, over the disc.
    const RefractedRays rays(model_.medium, w);
    const double filter = model_.medium.vertical_filter_optical_depth.empty()
                              ? 0.0
                              : model_.medium.vertical_filter_optical_depth[w];
    double direct = 0, truncated = 0;
    const double radius = kSunAngularRadiusRad / model_.sun_distance_au;
    constexpr int kStrips = 12;
    for (const GaussNode& strip : atmosphere_->options.disc_average
                                      ? disc_strips(wavelength_nm()[w], kStrips)
                                      : std::vector<GaussNode>{{0.0, 1.0}}) {
      const double chi = std::clamp(zenith + strip.x * radius, 0.0, pi);
      const auto apparent = rays.apparent_zenith_rad(height_km, chi);
      if (!apparent) continue;
      if (rays.trace_outward(height_km, *apparent, path).hits_ground) continue;
      double light = strip.weight * model_.solar_irradiance[w] *
                     std::max(0.0, std::cos(*apparent)) * std::exp(-filter);
      if (model_.scene.atmosphere.refractive_spreading) {
        light *= atmosphere_->sunlight->spreading(height_km, chi);
      }
      direct += light * std::exp(-slant_optical_depth(model_.medium, w, path));
      truncated += light * std::exp(-slant_optical_depth(atmosphere_->optics.truncated, w, path));
    }
    result.direct[w] = direct;
    result.diffuse[w] += std::max(0.0, truncated - direct);
  }
  return result;
}

}  // namespace twilight
