// Plain double-precision twins of the exchange's SIMD kernels, written apart from them.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "sim/aerosol_pass.h"
#include "sim/ring_pair_kernel.h"
#include "sim/ring_pass.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;

// The line of sight between two rings at an azimuth difference.
struct Sight {
  double distance2;  // km^2
  double s_low;      // signed distance from the perigee to the lower end, km: < 0 dips first
  bool blocked;      // by the ground
};

Sight line_of_sight(double earth_radius, const RingPoint& low, const RingPoint& high,
                    double sin_half) {
  const double dr = low.rho_km - high.rho_km, dz = low.z_km - high.z_km;
  const double d2 = dr * dr + dz * dz + 4 * low.rho_km * high.rho_km * sin_half * sin_half;
  Sight s{d2, 0.0, false};
  if (d2 <= 0) return s;
  const double n = (high.altitude_km - low.altitude_km) *
                   (2 * earth_radius + high.altitude_km + low.altitude_km);
  s.s_low = (n - d2) / (2 * std::sqrt(d2));
  if (s.s_low < 0) {
    const double r = earth_radius + low.altitude_km;
    const double p2 = r * r - s.s_low * s.s_low;
    const double perigee = low.altitude_km - s.s_low * s.s_low / (r + std::sqrt(std::max(0.0, p2)));
    s.blocked = perigee < -1e-9;
  }
  return s;
}

// Variance of a cell's positions along the unit vector (r, a, z) of its own frame.
double variance_along(const RingPoint& cell, double r, double a, double z) {
  const double first = r * cell.axis_r + z * cell.axis_z;
  const double third = z * cell.axis_r - r * cell.axis_z;
  return cell.variance_radial_km2 * first * first + cell.variance_azimuthal_km2 * a * a +
         cell.variance_third_km2 * third * third;
}

double variance_sum(const RingPoint& cell) {
  return cell.variance_radial_km2 + cell.variance_azimuthal_km2 + cell.variance_third_km2;
}

// Directions of the line of sight from source to target at azimuth sample k, in both frames.
struct SightDirection {
  double source_r, source_a, z, target_r, target_a;
};

SightDirection sight_direction(const RingPoint& source, const RingPoint& target, double distance,
                               double sin_k, double sin_half) {
  // 1 - cos = 2 sin^2(k/2) keeps near neighbours exact.
  const double dr = target.rho_km - source.rho_km;
  const double bend = 2 * sin_half * sin_half;
  return {(dr - target.rho_km * bend) / distance, target.rho_km * sin_k / distance,
          (target.z_km - source.z_km) / distance, (dr + source.rho_km * bend) / distance,
          source.rho_km * sin_k / distance};
}

double geometry_factor(double d2, const RingPoint& source, const RingPoint& target,
                       const SightDirection& dir) {
  const double along = variance_along(source, dir.source_r, dir.source_a, dir.z) +
                       variance_along(target, dir.target_r, dir.target_a, dir.z);
  const double all = variance_sum(source) + variance_sum(target);
  const double factor = near_field_factor(std::max(0.0, all - along) / d2, along / d2);
  return 1.0 / (4 * kPi * (d2 * factor + source.blur_km2 + target.blur_km2));
}

}  // namespace

std::vector<double> ring_pair_kernel_scalar(const ExchangeMedium& medium, const RingPoint& source,
                                            const RingPoint& target, int azimuth_divisions,
                                            bool same_ring) {
  const double R = medium.earth_radius_km;
  const double step = 2 * kPi / azimuth_divisions;
  const int n = azimuth_divisions / 2 + 1;
  std::vector<double> value(static_cast<std::size_t>(n) * medium.lanes, 0.0);
  const bool source_low = source.altitude_km <= target.altitude_km;
  const RingPoint& low = source_low ? source : target;
  const RingPoint& high = source_low ? target : source;
  for (int k = 0; k < n; ++k) {
    if (k == 0 && same_ring) continue;
    const Sight sight = line_of_sight(R, low, high, std::sin(0.5 * step * k));
    if (sight.blocked || sight.distance2 <= 0) continue;
    // Walk along the path: lengths inside every shell from the two crossings of its boundaries.
    const double r_low = R + low.altitude_km;
    const double p2 = r_low * r_low - sight.s_low * sight.s_low;
    const auto s_at = [&](double h) { return std::sqrt(std::max(0.0, (R + h) * (R + h) - p2)); };
    for (std::size_t w = 0; w < medium.lanes; ++w) {
      double depth = 0;
      for (int layer = 0; layer < medium.layers; ++layer) {
        const double b0 = medium.boundary_km[static_cast<std::size_t>(layer)];
        const double b1 = medium.boundary_km[static_cast<std::size_t>(layer) + 1];
        const double ext = medium.extinction[static_cast<std::size_t>(layer) * medium.lanes + w];
        const double lo = std::clamp(b0, low.altitude_km, high.altitude_km);
        const double hi = std::clamp(b1, low.altitude_km, high.altitude_km);
        depth += ext * (s_at(hi) - s_at(lo));
        if (sight.s_low < 0) {
          depth +=
              2 * ext * (s_at(std::min(b1, low.altitude_km)) - s_at(std::min(b0, low.altitude_km)));
        }
      }
      if (source.half_depth != nullptr) depth -= source.half_depth[w];
      if (target.half_depth != nullptr) depth -= target.half_depth[w];
      const SightDirection dir = sight_direction(source, target, std::sqrt(sight.distance2),
                                                 std::sin(step * k), std::sin(0.5 * step * k));
      value[static_cast<std::size_t>(k) * medium.lanes + w] =
          geometry_factor(sight.distance2, source, target, dir) *
          std::exp(-std::clamp(depth, 0.0, 80.0));
    }
  }
  return value;
}

void moment_pass_scalar(const RingPairKernel& kernel, const AzimuthModes& modes,
                        const float* source, float* field) {
  const std::size_t lanes = kernel.lanes;
  for (int m = 0; m < std::min(modes.modes, kernel.modes); ++m) {
    for (int k = 0; k < kernel.samples; ++k) {
      const std::size_t row = static_cast<std::size_t>(k) * kMoments;
      const auto trig = static_cast<std::size_t>(m) * static_cast<std::size_t>(modes.samples) +
                        static_cast<std::size_t>(k * kernel.every);
      for (std::size_t w = 0; w < lanes; ++w) {
        const std::size_t base = static_cast<std::size_t>(m) * kMoments * lanes + w;
        double even = 0, odd = 0;
        for (std::size_t c = 0; c < kMoments; ++c) {
          const double term = static_cast<double>(kernel.emit[row + c]) * source[base + c * lanes];
          (c < kEvenMoments ? even : odd) += term;
        }
        const double value = kernel.value[static_cast<std::size_t>(k) * lanes + w];
        const double e = value * (modes.cosine[trig] * even - modes.sine[trig] * odd);
        const double o = value * (modes.sine[trig] * even + modes.cosine[trig] * odd);
        for (std::size_t c = 0; c < kMoments; ++c) {
          field[base + c * lanes] += static_cast<float>(
              static_cast<double>(kernel.receive[row + c]) * (c < kEvenMoments ? e : o));
        }
      }
    }
  }
}

void first_event_pass_scalar(const RingPairKernel& kernel, int azimuth_divisions,
                             const float* power, const unsigned char* lit, const float* asymmetry,
                             double sun_elevation_rad, float* field) {
  const int S = azimuth_divisions, half = S / 2;
  const std::size_t lanes = kernel.lanes;
  for (int j = 0; j <= half; ++j) {
    for (int i = 0; i < S; ++i) {
      int shift = j - i;
      if (shift > half) shift -= S;
      if (shift <= -half) shift += S;
      if (shift % kernel.every != 0) continue;
      const auto k = static_cast<std::size_t>(std::abs(shift) / kernel.every);
      const int mirror = i <= half ? i : S - i;
      if (!lit[mirror]) continue;
      const double both_sides = std::abs(shift) == 0 || std::abs(shift) == half ? 1.0 : 2.0;
      const double received = kernel.receive[k * kMoments] / both_sides;
      const double phi = 2 * kPi * i / S;
      const double wa = shift < 0 ? -kernel.dir_a[k] : kernel.dir_a[k];
      const double cosine =
          -(std::cos(sun_elevation_rad) * (kernel.dir_r[k] * std::cos(phi) - wa * std::sin(phi)) +
            std::sin(sun_elevation_rad) * kernel.dir_z[k]);
      for (std::size_t w = 0; w < lanes; ++w) {
        const double g = asymmetry[w];
        const double hg = (1 - g * g) / std::pow(1 + g * g - 2 * g * cosine, 1.5);
        field[static_cast<std::size_t>(j) * lanes + w] +=
            static_cast<float>(hg * kernel.value[k * lanes + w] * received *
                               power[static_cast<std::size_t>(mirror) * lanes + w]);
      }
    }
  }
}

}  // namespace twilight
