#include "sim/direct_sunlight.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "atmosphere/refraction.h"
#include "sim/spectral_lanes.h"

namespace twilight {
namespace {

// Bending against apparent zenith angle at one altitude and wavelength.
struct Fan {
  std::vector<double> apparent, truth;
};

// Apparent zenith angle whose ray leaves at the true one: inverse interpolation.
double apparent_of(const Fan& fan, double true_zenith) {
  const auto it = std::upper_bound(fan.truth.begin(), fan.truth.end(), true_zenith);
  const auto hi = std::clamp<std::ptrdiff_t>(it - fan.truth.begin(), 1,
                                             static_cast<std::ptrdiff_t>(fan.truth.size()) - 1);
  const auto i = static_cast<std::size_t>(hi);
  const double span = fan.truth[i] - fan.truth[i - 1];
  const double f = span > 0 ? std::clamp((true_zenith - fan.truth[i - 1]) / span, 0.0, 1.0) : 0.0;
  return fan.apparent[i - 1] + f * (fan.apparent[i] - fan.apparent[i - 1]);
}

}  // namespace

DirectSunlight::DirectSunlight(const Medium& medium, int altitude_nodes, int angle_nodes)
    : top_km_(medium.top_km()),
      wavelengths_(medium.wavelengths()),
      lanes_(padded_lanes(medium.wavelengths())),
      altitude_nodes_(altitude_nodes),
      angle_nodes_(angle_nodes) {
  if (altitude_nodes < 2 || angle_nodes < 2) {
    throw std::invalid_argument("DirectSunlight needs at least 2 nodes in each direction");
  }
  const std::size_t layers = medium.layers();
  const auto n_alt = static_cast<std::size_t>(altitude_nodes);
  const auto n_ang = static_cast<std::size_t>(angle_nodes);
  horizon_rad_.assign(n_alt, 0.0);
  table_.assign(n_alt * n_ang * lanes_, kOpaque);

  // Air disperses little (3 % over the visible): rays are traced at the least and the most
  // refracted wavelength, and path lengths are linear in refractivity between.
  std::size_t least = 0, most = 0;
  for (std::size_t w = 1; w < wavelengths_; ++w) {
    if (medium.refractivity(0, w) < medium.refractivity(0, least)) least = w;
    if (medium.refractivity(0, w) > medium.refractivity(0, most)) most = w;
  }
  const double dispersion = medium.refractivity(0, most) - medium.refractivity(0, least);
  const bool disperses = dispersion > 0;
  std::vector<RefractedRays> rays;
  rays.emplace_back(medium, most);
  if (disperses) rays.emplace_back(medium, least);
  std::vector<double> towards_least(wavelengths_, 0.0);
  for (std::size_t w = 0; disperses && w < wavelengths_; ++w) {
    towards_least[w] = (medium.refractivity(0, most) - medium.refractivity(0, w)) / dispersion;
  }

  tbb::parallel_for(std::size_t{0}, n_alt, [&](std::size_t a) {
    const double v = static_cast<double>(a) / static_cast<double>(n_alt - 1);
    const double altitude = top_km_ * v * v;
    std::vector<Fan> fans(rays.size());
    for (std::size_t w = 0; w < rays.size(); ++w) {
      const double limit = rays[w].horizon_apparent_zenith_rad(altitude);
      constexpr int kFan = 192;
      Fan& fan = fans[w];
      for (int k = 0; k <= kFan; ++k) {
        const double x = 1.0 - static_cast<double>(k) / kFan;
        // A hair inside the horizon, so that rounding does not send the ray underground.
        const double zenith = limit * (1 - x * x) - (k == kFan ? 1e-9 : 0.0);
        fan.apparent.push_back(zenith);
        fan.truth.push_back(rays[w].trace_outward(altitude, zenith, {}).true_zenith_rad);
      }
    }
    const double horizon = fans[0].truth.back();
    horizon_rad_[a] = horizon;
    std::vector<std::vector<double>> paths(rays.size(), std::vector<double>(layers));
    for (std::size_t k = 0; k < n_ang; ++k) {
      const double x = static_cast<double>(k) / static_cast<double>(n_ang - 1);
      const double true_zenith = horizon * (1 - x * x);
      for (std::size_t w = 0; w < rays.size(); ++w) {
        const double zenith = std::min(apparent_of(fans[w], true_zenith), fans[w].apparent.back());
        rays[w].trace_outward(altitude, zenith, paths[w]);
      }
      float* out = &table_[(a * n_ang + k) * lanes_];
      for (std::size_t w = 0; w < wavelengths_; ++w) {
        const double t = towards_least[w];
        const double limit =
            disperses ? (1 - t) * fans[0].truth.back() + t * fans[1].truth.back() : horizon;
        if (true_zenith > limit + 1e-12) continue;  // this wavelength is in shadow
        double depth = 0;
        for (std::size_t i = 0; i < layers; ++i) {
          const double path = disperses ? (1 - t) * paths[0][i] + t * paths[1][i] : paths[0][i];
          depth += path * medium.extinction_per_km(i, w);
        }
        if (!medium.vertical_filter_optical_depth.empty()) {
          depth += medium.vertical_filter_optical_depth[w];
        }
        out[w] = static_cast<float>(std::min(depth, static_cast<double>(kOpaque)));
      }
    }
  });
}

double DirectSunlight::shadow_zenith_rad(double altitude_km) const {
  const double f = std::sqrt(std::clamp(altitude_km / top_km_, 0.0, 1.0)) * (altitude_nodes_ - 1);
  const int i = std::min(static_cast<int>(f), altitude_nodes_ - 2);
  const double t = f - i;
  const auto row = static_cast<std::size_t>(i);
  return horizon_rad_[row] * (1 - t) + horizon_rad_[row + 1] * t;
}

bool DirectSunlight::optical_depth(double altitude_km, double solar_zenith_rad, float* out) const {
  const double f = std::sqrt(std::clamp(altitude_km / top_km_, 0.0, 1.0)) * (altitude_nodes_ - 1);
  const int i = std::min(static_cast<int>(f), altitude_nodes_ - 2);
  const double t = f - i;
  const auto row = static_cast<std::size_t>(i);
  const double horizon = horizon_rad_[row] * (1 - t) + horizon_rad_[row + 1] * t;
  const double x2 = 1 - solar_zenith_rad / horizon;
  if (!(x2 >= 0)) return false;
  const double g = std::sqrt(x2) * (angle_nodes_ - 1);
  const int k = std::min(static_cast<int>(g), angle_nodes_ - 2);
  const double u = g - k;
  const auto f00 = static_cast<float>((1 - t) * (1 - u)), f01 = static_cast<float>((1 - t) * u);
  const auto f10 = static_cast<float>(t * (1 - u)), f11 = static_cast<float>(t * u);
  const std::size_t n_ang = static_cast<std::size_t>(angle_nodes_);
  const float* p0 = &table_[(row * n_ang + static_cast<std::size_t>(k)) * lanes_];
  const float* p1 = p0 + n_ang * lanes_;
  const std::size_t L = lanes_;
  for (std::size_t w = 0; w < L; ++w) {
    out[w] = f00 * p0[w] + f01 * p0[w + L] + f10 * p1[w] + f11 * p1[w + L];
  }
  return true;
}

}  // namespace twilight
