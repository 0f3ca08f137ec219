#include "sim/phase_table.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "aerosols/henyey_greenstein.h"
#include "sim/gauss_legendre.h"
#include "solar/limb_darkening.h"

namespace twilight {
namespace {

using std::numbers::pi;

struct Elements {
  double p11, p12;
};

Elements in_table(const PhaseMatrix& m, double angle) {
  const auto above = std::ranges::upper_bound(m.angle_rad, angle);
  const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
      above - m.angle_rad.begin(), 1, static_cast<std::ptrdiff_t>(m.angle_rad.size()) - 1));
  const double f =
      std::clamp((angle - m.angle_rad[i - 1]) / (m.angle_rad[i] - m.angle_rad[i - 1]), 0.0, 1.0);
  return {std::lerp(m.p11[i - 1], m.p11[i], f), std::lerp(m.p12[i - 1], m.p12[i], f)};
}

// Mean over the Sun's disc, whose centre stands at `angle` from the direction of the light.
Elements over_disc(const std::function<Elements(double)>& point, const LimbDarkening& limb,
                   double radius_rad, double angle) {
  static const auto radial = gauss_legendre(6, 0, 1);
  constexpr int kAround = 12;
  Elements mean{0, 0};
  for (const GaussNode& g : radial) {
    const double rho = std::sqrt(1 - g.x * g.x);  // g.x is mu, in which the darkening is smooth
    const double weight = 2 * g.weight * g.x * limb(g.x) / kAround;
    for (int k = 0; k < kAround; ++k) {
      const double phi = 2 * pi * (k + 0.5) / kAround;
      const double x = angle + radius_rad * rho * std::cos(phi);
      const double y = radius_rad * rho * std::sin(phi);
      const Elements here = point(std::min(std::hypot(x, y), pi));
      mean.p11 += weight * here.p11;
      mean.p12 += weight * here.p12;
    }
  }
  return mean;
}

}  // namespace

PhaseTable::PhaseTable(const AerosolKinds& kinds, const OrdersMedium& medium,
                       const OrdersOptions& options, bool truncated)
    : lanes_(medium.lanes) {
  const std::size_t count = kinds.scattering_per_km.size();
  value_.assign(count * kNodes * 2 * lanes_, 0.0F);
  const std::vector<double>& wavelength = medium.truncated.wavelength_nm;
  const double radius = kSunAngularRadiusRad / options.sun_distance_au;
  for (std::size_t q = 0; q < count; ++q) {
    for (std::size_t w = 0; w < wavelength.size(); ++w) {
      const LimbDarkening limb(wavelength[w]);
      const auto point = [&](double angle) -> Elements {
        if (truncated) {
          const TruncatedPhase& phase = medium.kinds[q];
          const double c = std::cos(angle);
          double sum = 0, previous = 0, now = 1;
          for (std::size_t l = 0; l * lanes_ < phase.a1.size(); ++l) {
            sum += phase.a1[l * lanes_ + w] * now;
            const double next =
                ((2 * static_cast<double>(l) + 1) * c * now - static_cast<double>(l) * previous) /
                (static_cast<double>(l) + 1);
            previous = now;
            now = next;
          }
          return {sum * (1 - phase.peak[w]), 0.0};
        }
        if (q < kinds.phase.size()) return in_table(*kinds.phase[q][w], angle);
        return {4 * pi * henyey_greenstein(std::cos(angle), kinds.asymmetry[q][w]), 0.0};
      };
      for (std::size_t k = 0; k < kNodes; ++k) {
        const double t = static_cast<double>(k) / (kNodes - 1);
        const double angle = pi * t * t;
        const Elements e = options.disc_average && !truncated && angle < pi / 18
                               ? over_disc(point, limb, radius, angle)
                               : point(angle);
        float* out = &value_[(q * kNodes + k) * 2 * lanes_ + w];
        out[0] = static_cast<float>(e.p11);
        out[lanes_] = static_cast<float>(e.p12);
      }
    }
  }
}

void PhaseTable::at(std::size_t kind, double scattering_angle_rad, float* p11, float* p12) const {
  const double t = std::sqrt(std::clamp(scattering_angle_rad / pi, 0.0, 1.0)) * (kNodes - 1);
  const auto k = std::min(static_cast<std::size_t>(t), kNodes - 2);
  const auto f = static_cast<float>(t - static_cast<double>(k));
  const float* a = &value_[(kind * kNodes + k) * 2 * lanes_];
  const float* b = a + 2 * lanes_;
  for (std::size_t w = 0; w < lanes_; ++w) p11[w] = a[w] + f * (b[w] - a[w]);
  for (std::size_t w = 0; w < lanes_; ++w) {
    p12[w] = a[lanes_ + w] + f * (b[lanes_ + w] - a[lanes_ + w]);
  }
}

}  // namespace twilight
