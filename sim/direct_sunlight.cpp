#include "sim/direct_sunlight.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "sim/gather_kernel.h"
#include "sim/spectral_lanes.h"

namespace twilight {
namespace {

// Of the bending behind a bilinear table, whose own error is larger.
constexpr int kAltitudeNodes = 128, kAngleNodes = 192;

float opaque_at_most(double attenuation) {
  return static_cast<float>(std::min(attenuation, static_cast<double>(DirectSunlight::kOpaque)));
}

}  // namespace

DirectSunlight::DirectSunlight(const Medium& medium, const DirectSunlightOptions& options)
    : top_km_(medium.top_km()),
      wavelengths_(medium.wavelengths()),
      lanes_(padded_lanes(medium.wavelengths())),
      altitude_nodes_(options.altitude_nodes != 0 ? options.altitude_nodes
                                                  : (options.exact ? 192 : 256)),
      angle_nodes_(options.angle_nodes != 0 ? options.angle_nodes : (options.exact ? 512 : 320)),
      exact_(options.exact) {
  if (altitude_nodes_ < 4 || angle_nodes_ < 8) {
    throw std::invalid_argument("DirectSunlight needs at least 4 altitude and 8 angle nodes");
  }
  std::vector<BendingTable> bending = bending_tables(
      medium, exact_ ? altitude_nodes_ : kAltitudeNodes, exact_ ? angle_nodes_ : kAngleNodes);
  std::vector<std::optional<SunRays>> built(wavelengths_);
  tbb::parallel_for(std::size_t{0}, wavelengths_, [&](std::size_t w) {
    built[w].emplace(medium, w, std::move(bending[w]), options.refractive_spreading);
  });
  for (std::size_t w = 0; w < wavelengths_; ++w) rays_.push_back(std::move(*built[w]));
  if (exact_) return;

  const auto n_alt = static_cast<std::size_t>(altitude_nodes_);
  const auto n_ang = static_cast<std::size_t>(angle_nodes_);
  horizon_rad_.assign(n_alt, 0.0);
  table_.assign(n_alt * n_ang * lanes_, kOpaque);
  tbb::parallel_for(std::size_t{0}, n_alt, [&](std::size_t a) {
    const double v = static_cast<double>(a) / static_cast<double>(n_alt - 1);
    const double altitude = top_km_ * v * v;
    double horizon = 0;
    for (const SunRays& r : rays_) horizon = std::max(horizon, r.shadow_zenith_rad(altitude));
    horizon_rad_[a] = horizon;
    for (std::size_t k = 0; k < n_ang; ++k) {
      const double x = static_cast<double>(k) / static_cast<double>(n_ang - 1);
      float* out = &table_[(a * n_ang + k) * lanes_];
      double value;
      for (std::size_t w = 0; w < wavelengths_; ++w) {
        if (rays_[w].attenuation(altitude, horizon * (1 - x * x), value)) {
          out[w] = opaque_at_most(value);
        }
      }
    }
  });
  std::vector<SunRays> middle{std::move(rays_[wavelengths_ / 2])};
  rays_ = std::move(middle);
}

double DirectSunlight::shadow_zenith_rad(double altitude_km) const {
  if (!exact_) return level(altitude_km).horizon_rad;
  double horizon = 0;
  for (const SunRays& r : rays_) horizon = std::max(horizon, r.shadow_zenith_rad(altitude_km));
  return horizon;
}

DirectSunlight::Level DirectSunlight::level(double altitude_km) const {
  Level level;
  level.altitude_km = altitude_km;
  if (exact_) return level;
  const double f = std::sqrt(std::clamp(altitude_km / top_km_, 0.0, 1.0)) * (altitude_nodes_ - 1);
  const int i = std::min(static_cast<int>(f), altitude_nodes_ - 2);
  level.between = f - i;
  level.row = static_cast<std::size_t>(i);
  level.horizon_rad =
      horizon_rad_[level.row] * (1 - level.between) + horizon_rad_[level.row + 1] * level.between;
  return level;
}

double DirectSunlight::apparent_zenith_rad(double altitude_km, double solar_zenith_rad) const {
  return middle().apparent_zenith_rad(std::clamp(altitude_km, 0.0, top_km_), solar_zenith_rad);
}

bool DirectSunlight::attenuation(const Level& level, double solar_zenith_rad, float* out) const {
  if (!exact_) return look_up(level, solar_zenith_rad, out);
  bool lit = false;
  for (std::size_t w = 0; w < wavelengths_; ++w) {
    double value;
    if (rays_[w].attenuation(level.altitude_km, solar_zenith_rad, value)) {
      if (!lit) std::fill(out, out + lanes_, kOpaque);
      lit = true;
      out[w] = opaque_at_most(value);
    }
  }
  return lit;
}

bool DirectSunlight::look_up(const Level& level, double solar_zenith_rad, float* out) const {
  const double x2 = 1 - solar_zenith_rad / level.horizon_rad;
  if (!(x2 >= 0)) return false;
  const double g = std::sqrt(x2) * (angle_nodes_ - 1);
  const int k = std::min(static_cast<int>(g), angle_nodes_ - 2);
  const double t = level.between, u = g - k;
  const std::size_t n_ang = static_cast<std::size_t>(angle_nodes_);
  const float* near = &table_[(level.row * n_ang + static_cast<std::size_t>(k)) * lanes_];
  const float* const rows[] = {near, near + lanes_, near + n_ang * lanes_,
                               near + n_ang * lanes_ + lanes_};
  const float weights[] = {static_cast<float>((1 - t) * (1 - u)), static_cast<float>((1 - t) * u),
                           static_cast<float>(t * (1 - u)), static_cast<float>(t * u)};
  weighted_sum(rows, weights, lanes_, out);
  return true;
}

}  // namespace twilight
