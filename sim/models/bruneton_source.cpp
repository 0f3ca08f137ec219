#include "sim/models/bruneton_source.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/gauss_legendre.h"

namespace twilight {
namespace {

using std::numbers::pi;

constexpr double kTilt = 0.25;  // sine; how far from the vertical a slope is taken

// Sum of a[i] b[i], in eight lanes so that it vectorises; sizes are any.
float dot(const float* a, const float* b, std::size_t n) {
  std::array<float, 8> lanes{};
  std::size_t i = 0;
  for (; i + 8 <= n; i += 8) {
    for (std::size_t k = 0; k < 8; ++k) lanes[k] += a[i + k] * b[i + k];
  }
  for (; i < n; ++i) lanes[0] += a[i] * b[i];
  return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
         ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
}

}  // namespace

BrunetonDirections::BrunetonDirections(const BrunetonSphere& sphere, double radius_km, int polar,
                                       int azimuths) {
  const double horizon = -sphere.rho_km(radius_km) / radius_km;
  const std::vector<GaussNode> rule = gauss_legendre(polar / 2, 0, 1);
  for (const double end : {-1.0, 1.0}) {
    for (const GaussNode& g : rule) {
      mu.push_back(horizon + (end - horizon) * g.x * g.x);
      polar_weight.push_back(2 * g.x * g.weight * std::abs(end - horizon));
    }
  }
  for (int k = 0; k < azimuths; ++k) cos_azimuth.push_back(std::cos((k + 0.5) * pi / azimuths));
  for (const double m : mu) {
    const double sine = std::sqrt(std::max(0.0, 1 - m * m));
    for (const double c : cos_azimuth) {
      x.push_back(static_cast<float>(sine * c));
      y.push_back(static_cast<float>(sine * std::sqrt(1 - c * c)));
      z.push_back(static_cast<float>(m));
    }
  }
}

BrunetonSource::BrunetonSource(const BrunetonAir& air, const BrunetonDirections& directions,
                               std::span<const float> light)
    : air_(air), directions_(directions), light_(light), moments_(air.wavelengths()) {
  const std::size_t n = directions.size();
  for (std::size_t w = 0; w < air.wavelengths(); ++w) {
    for (std::size_t k = 0; k < n; ++k) {
      const double both = 2.0 * light[w * n + k];
      const double x = directions.x[k], y = directions.y[k], z = directions.z[k];
      moments_[w][0] += both;
      moments_[w][1] += both * x * x;
      moments_[w][2] += both * y * y;
      moments_[w][3] += both * z * z;
      moments_[w][4] += both * x * z;
    }
  }
}

void BrunetonSource::rayleigh(double mu, double b, std::span<double> out) const {
  const double c2 = 1 - mu * mu - b * b;
  for (std::size_t w = 0; w < out.size(); ++w) {
    const auto& [all, xx, yy, zz, xz] = moments_[w];
    out[w] = 3 / (16 * pi) * (all + b * b * xx + c2 * yy + mu * mu * zz + 2 * mu * b * xz);
  }
}

void BrunetonSource::mie_in(double mu, double b, std::span<double> out) const {
  const std::size_t n = directions_.size();
  const auto vx = static_cast<float>(b), vz = static_cast<float>(mu);
  const auto vy = static_cast<float>(std::sqrt(std::max(0.0, 1 - mu * mu - b * b)));
  std::vector<float> phase(n);
  for (std::size_t w = 0; w < out.size(); ++w) {
    const double g = air_.asymmetry(w);
    if (w == 0 || g != air_.asymmetry(w - 1)) {
      // Cornette-Shanks or Henyey-Greenstein on both sides of the Sun's plane.
      const auto q = static_cast<float>(air_.cornette_shanks_phase() ? 1 : 0);
      const double norm = air_.cornette_shanks_phase() ? 3 / (8 * pi) * (1 - g * g) / (2 + g * g)
                                                       : (1 - g * g) / (4 * pi);
      const auto scale = static_cast<float>(norm), g2 = static_cast<float>(2 * g);
      const auto one_g2 = static_cast<float>(1 + g * g);
      const float *x = directions_.x.data(), *y = directions_.y.data(), *z = directions_.z.data();
      for (std::size_t k = 0; k < n; ++k) {
        const float even = vx * x[k] + vz * z[k], odd = vy * y[k];
        const float c0 = even + odd, c1 = even - odd;
        const float s0 = one_g2 - g2 * c0, s1 = one_g2 - g2 * c1;
        phase[k] = scale * ((1 + q * c0 * c0) / (s0 * std::sqrt(s0)) +
                            (1 + q * c1 * c1) / (s1 * std::sqrt(s1)));
      }
    }
    out[w] = dot(phase.data(), &light_[w * n], n);
  }
}

void BrunetonSource::mie(double mu, double b, std::span<double> out) const {
  const double sine2 = 1 - mu * mu, side = b < 0 ? -1.0 : 1.0;
  if (b * b <= sine2) return mie_in(mu, b, out);
  std::vector<double> other(out.size());
  const double sine = std::sqrt(std::max(0.0, sine2));
  const auto continue_from = [&](double edge, double distance) {
    for (std::size_t w = 0; w < out.size(); ++w) {
      const double slope = (out[w] - other[w]) / distance;
      out[w] = std::max(0.0, out[w] + slope * std::min(std::abs(b) - edge, 1.0));
    }
  };
  if (sine > kTilt) {
    mie_in(mu, side * sine, out);
    mie_in(mu, side * (sine - kTilt), other);
    return continue_from(sine, kTilt);
  }
  // About the vertical: the slope between directions tilted towards the Sun and away from it.
  const double up = std::copysign(std::sqrt(1 - kTilt * kTilt), mu);
  std::vector<double> vertical(out.size());
  mie_in(std::copysign(std::sqrt(1 - sine * sine), mu), 0, vertical);
  mie_in(up, side * kTilt, out);
  mie_in(up, -side * kTilt, other);
  for (std::size_t w = 0; w < out.size(); ++w) {
    const double slope = (out[w] - other[w]) / (2 * kTilt);
    out[w] = std::max(0.0, vertical[w] + slope * std::min(std::abs(b), 1.0));
  }
}

}  // namespace twilight
