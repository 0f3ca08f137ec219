#include "sim/emission_fractions.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
std::size_t idx(int i) { return static_cast<std::size_t>(i); }

}  // namespace

void emission_fractions(const ExchangeMedium& medium, const CellGrid& grid, const CellRing& ring,
                        std::size_t wavelengths, double* escape, double* ground) {
  constexpr int kPolar = 20, kAzimuth = 4;
  const double R = medium.earth_radius_km;
  const double h0 = grid.options().observer_height_km;
  const double r = R + ring.altitude_km;
  const double top = medium.boundary_km.back();
  const double outer = grid.outer_radius_km();
  std::fill(escape, escape + wavelengths, 0.0);
  std::fill(ground, ground + wavelengths, 0.0);
  // Local frame: up along the Earth's radius, `out` away from the observer's axis.
  const double zc = R + h0 + ring.z_km;
  const double up_r = ring.rho_km / r, up_z = zc / r;
  const double out_r = up_z, out_z = -up_r;
  const double horizon_mu = -std::sqrt(std::max(0.0, 1 - (R / r) * (R / r)));
  std::vector<double> path(idx(medium.layers));
  for (int part = 0; part < 2; ++part) {
    const double mu0 = part == 0 ? -1.0 : horizon_mu;
    const double mu1 = part == 0 ? horizon_mu : 1.0;
    for (int i = 0; i < kPolar; ++i) {
      // Midpoints of a grid dense towards the horizon, where transmission bends most.
      const double e0 = static_cast<double>(i) / kPolar, e1 = static_cast<double>(i + 1) / kPolar;
      const auto spread = [&](double e) {
        return part == 0 ? mu1 - (mu1 - mu0) * (1 - e) * (1 - e) : mu0 + (mu1 - mu0) * e * e;
      };
      const double lo = spread(e0), hi = spread(e1);
      const double mu = 0.5 * (lo + hi);
      const double sin_t = std::sqrt(std::max(0.0, 1 - mu * mu));
      const double weight = (hi - lo) / 2 / kAzimuth;
      for (int k = 0; k < kAzimuth; ++k) {
        const double phi = kPi * (k + 0.5) / kAzimuth;
        const double dir_r = mu * up_r + sin_t * std::cos(phi) * out_r;
        const double dir_z = mu * up_z + sin_t * std::cos(phi) * out_z;
        const double b = ring.rho_km * dir_r + ring.z_km * dir_z;
        const double c = ring.rho_km * ring.rho_km + ring.z_km * ring.z_km - outer * outer;
        double end = -b + std::sqrt(std::max(0.0, b * b - c));
        const double s0 = r * mu;  // signed distance from the perigee
        const double p2 = r * r * (1 - mu * mu);
        const auto s_at = [&](double h) {
          return std::sqrt(std::max(0.0, (R + h) * (R + h) - p2));
        };
        const bool hits = part == 0;
        const double limit = hits ? -s_at(0) - s0 : s_at(top) - s0;
        const bool inside = end < limit;
        end = std::min(end, limit);
        const double s1 = s0 + end;
        for (int layer = 0; layer < medium.layers; ++layer) {
          const double a0 = s_at(medium.boundary_km[idx(layer)]);
          const double a1 = s_at(medium.boundary_km[idx(layer) + 1]);
          const double up = std::clamp(a1, s0, s1) - std::clamp(a0, s0, s1);
          const double down = std::clamp(-a0, s0, s1) - std::clamp(-a1, s0, s1);
          path[idx(layer)] = up + down;
        }
        for (std::size_t w = 0; w < wavelengths; ++w) {
          double depth = 0;
          for (int layer = 0; layer < medium.layers; ++layer) {
            depth += path[idx(layer)] *
                     static_cast<double>(medium.extinction[idx(layer) * medium.lanes + w]);
          }
          (hits && !inside ? ground : escape)[w] += weight * std::exp(-depth);
        }
      }
    }
  }
}

}  // namespace twilight
