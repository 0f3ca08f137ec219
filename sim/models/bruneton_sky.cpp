#include "sim/models/bruneton_sky.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

#include "sim/models/bruneton_precompute.h"
#include "sim/solver_arena.h"

namespace twilight {
namespace {

using std::numbers::pi;

constexpr double kDegPerRad = 180 / pi;

}  // namespace

BrunetonSky::BrunetonSky(const SceneModel& model, const RunControl& control) : ModelSky(model) {
  place_sun();
  const int orders = bruneton_orders(model);
  const auto start = std::chrono::steady_clock::now();
  arena_->arena.execute(
      [&] { tables_ = bruneton_precompute(model, model.scene.bruneton, orders, control); });
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  summary_.stage_seconds.emplace_back("tables", seconds.count());
  const BrunetonSize& size = tables_->rayleigh_and_multiple.size();
  summary_.figures.emplace_back("scattering orders", fmt::format("{}", orders));
  summary_.figures.emplace_back(
      "scattering table",
      fmt::format("{} x {} x {} x {} (r, mu, mu_s, nu), {:.1f} MB in all", size.r, size.mu,
                  size.mu_s, size.nu, 1e-6 * static_cast<double>(tables_->bytes())));
}

BrunetonSky::BrunetonSky(const SceneModel& model, std::shared_ptr<const BrunetonTables> tables)
    : ModelSky(model), tables_(std::move(tables)) {
  place_sun();
}

void BrunetonSky::place_sun() {
  // -11.53: mu_s = -0.2, rounded into the table.
  const double lowest_deg = std::ceil(100 * std::asin(kBrunetonLowestMuS) * kDegPerRad) / 100;
  const double given_deg = model_.sun_elevation_rad * kDegPerRad;
  model_.sun_elevation_rad =
      within_model_range(model_, "sun.elevation_deg", given_deg, lowest_deg, 90.0, summary_) /
      kDegPerRad;
  mu_s_ = std::sin(model_.sun_elevation_rad);
  radius_km_ = model_.medium.earth_radius_km + observer_altitude_km(model_.scene);
  sun_ = model_.solar_irradiance;
  const std::vector<double>& filter = model_.medium.vertical_filter_optical_depth;
  for (std::size_t w = 0; w < filter.size(); ++w) sun_[w] *= std::exp(-filter[w]);
}

std::unique_ptr<Sky> BrunetonSky::with_sun_at(double sun_elevation_rad) const {
  SceneModel model = model_;
  model.sun_elevation_rad = sun_elevation_rad;
  return std::make_unique<BrunetonSky>(model, tables_);
}

std::vector<double> BrunetonSky::sun_transmittance() const {
  const std::size_t W = model_.medium.wavelengths();
  const BrunetonSphere& sphere = tables_->air.sphere();
  std::vector<double> out(W, 1.0);
  double r = radius_km_, mu = mu_s_;
  if (r > sphere.top_radius_km) {
    const double top = sphere.top_radius_km, b = r * mu;
    const double reach = b * b - (r - top) * (r + top);
    if (b >= 0 || reach <= 0) return out;
    const double d = -b - std::sqrt(reach);
    mu = std::clamp((b + d) / top, -1.0, 1.0);
    r = top;
  }
  tables_->transmittance.sunlight(r, mu, out);
  for (std::size_t w = 0; w < W; ++w) {
    if (model_.solar_irradiance[w] > 0) out[w] *= sun_[w] / model_.solar_irradiance[w];
  }
  return out;
}

BrunetonSky::Passage BrunetonSky::passage(const ViewDirection& view) const {
  const BrunetonSphere& sphere = tables_->air.sphere();
  Passage way;
  BrunetonPoint& p = way.start;
  p = {radius_km_, {std::sin(view.elevation_rad), false}, mu_s_, cos_sun_angle(view)};
  if (p.radius_km > sphere.top_radius_km) {
    const double r = p.radius_km, top = sphere.top_radius_km, b = r * p.view.mu;
    const double reach = b * b - (r - top) * (r + top);
    if (b >= 0 || reach <= 0) return way;
    way.before_km = -b - std::sqrt(reach);
    p.radius_km = top;
    p.view.mu = std::clamp((b + way.before_km) / top, -1.0, 1.0);
    p.mu_s = std::clamp((r * p.mu_s + way.before_km * p.nu) / top, -1.0, 1.0);
  }
  p.view.ground = bruneton_meets_ground(sphere, p.radius_km, p.view.mu);
  way.length_km = bruneton_distance_km(sphere, p.radius_km, p.view);
  return way;
}

std::vector<double> BrunetonSky::inscatter_at(const Passage& way, double distance_km) const {
  std::vector<double> out(model_.medium.wavelengths());
  if (distance_km >= way.length_km) return out;
  tables_->inscatter(bruneton_advanced(tables_->air.sphere(), way.start, distance_km), out);
  return out;
}

std::vector<double> BrunetonSky::transmittance_to(const Passage& way, double distance_km) const {
  std::vector<double> out(model_.medium.wavelengths(), 1.0);
  if (distance_km > 0) {
    tables_->transmittance.between(way.start.radius_km, way.start.view, distance_km, out);
  }
  return out;
}

std::vector<double> BrunetonSky::ground_radiance(const BrunetonPoint& on_ground) const {
  const std::size_t W = model_.medium.wavelengths();
  std::vector<double> out(W), sky(W);
  tables_->transmittance.sunlight(on_ground.radius_km, on_ground.mu_s, out);
  tables_->sky_irradiance(on_ground.radius_km, on_ground.mu_s, sky);
  for (std::size_t w = 0; w < W; ++w) {
    out[w] =
        sun_[w] * model_.ground_albedo[w] / pi * (out[w] * std::max(0.0, on_ground.mu_s) + sky[w]);
  }
  return out;
}

void BrunetonSky::spectrum(const ViewDirection& view, std::span<double> out) const {
  const Passage way = passage(view);
  const std::vector<double> scattered = inscatter_at(way, 0.0);
  for (std::size_t w = 0; w < out.size(); ++w) out[w] = sun_[w] * scattered[w];
  if (!way.start.view.ground) return;
  const BrunetonPoint end = bruneton_advanced(tables_->air.sphere(), way.start, way.length_km);
  const std::vector<double> through = transmittance_to(way, way.length_km);
  const std::vector<double> ground = ground_radiance(end);
  for (std::size_t w = 0; w < out.size(); ++w) out[w] += through[w] * ground[w];
}

std::optional<AerialLight> BrunetonSky::aerial_light(const ViewDirection& view,
                                                     double distance_km) const {
  const Passage way = passage(view);
  const double d = std::clamp(distance_km - way.before_km, 0.0, way.length_km);
  AerialLight result{transmittance_to(way, d), inscatter_at(way, 0.0)};
  const std::vector<double> beyond = inscatter_at(way, d);
  for (std::size_t w = 0; w < beyond.size(); ++w) {
    result.inscattered[w] =
        sun_[w] * std::max(0.0, result.inscattered[w] - result.transmittance[w] * beyond[w]);
  }
  return result;
}

std::vector<double> BrunetonSky::shadowed_inscatter(const ViewDirection& view,
                                                    double shadow_km) const {
  const Passage way = passage(view);
  const double l = std::clamp(shadow_km, 0.0, way.length_km);
  const bool ground = way.start.view.ground;
  return shadowed_inscatter(view, way.before_km + (ground ? way.length_km - l : 0.0),
                            way.before_km + (ground ? way.length_km : l));
}

std::vector<double> BrunetonSky::shadowed_inscatter(const ViewDirection& view,
                                                    double shadow_from_km,
                                                    double shadow_to_km) const {
  const Passage way = passage(view);
  const double from = std::clamp(shadow_from_km - way.before_km, 0.0, way.length_km);
  const double to = std::clamp(shadow_to_km - way.before_km, from, way.length_km);
  std::vector<double> out = inscatter_at(way, 0.0);
  const std::vector<double> s0 = inscatter_at(way, from), t0 = transmittance_to(way, from);
  const std::vector<double> s1 = inscatter_at(way, to), t1 = transmittance_to(way, to);
  for (std::size_t w = 0; w < out.size(); ++w) {
    out[w] = sun_[w] * std::max(0.0, out[w] - t0[w] * s0[w] + t1[w] * s1[w]);
  }
  return out;
}

}  // namespace twilight
