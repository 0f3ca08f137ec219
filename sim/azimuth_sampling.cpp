#include "sim/azimuth_sampling.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;

}  // namespace

AzimuthModes::AzimuthModes(int azimuth_divisions, int n_modes)
    : divisions(azimuth_divisions),
      samples(azimuth_divisions / 2 + 1),
      modes(std::min(n_modes, azimuth_divisions / 2 + 1)) {
  const auto size = static_cast<std::size_t>(modes) * static_cast<std::size_t>(samples);
  cosine.resize(size);
  sine.resize(size);
  for (int k = 0; k < samples; ++k) {
    const double angle = 2 * kPi * k / divisions;
    sin_step.push_back(2 * k == divisions ? 0.0 : std::sin(angle));
    sin_half_step.push_back(std::sin(angle / 2));
  }
  for (int i = -divisions / 2; i <= divisions + 1; ++i) {
    const double angle = 2 * kPi * i / divisions;
    cos_around.push_back(static_cast<float>(std::cos(angle)));
    sin_around.push_back(static_cast<float>(std::sin(angle)));
    cos_around_8.insert(cos_around_8.end(), 8, cos_around.back());
    sin_around_8.insert(sin_around_8.end(), 8, sin_around.back());
  }
  for (int m = 0; m < modes; ++m) {
    for (int k = 0; k < samples; ++k) {
      // Reduced modulo the circle first: exact symmetry whatever m k is.
      const double angle = 2 * kPi * ((m * k) % divisions) / divisions;
      const auto i = static_cast<std::size_t>(m) * static_cast<std::size_t>(samples) +
                     static_cast<std::size_t>(k);
      cosine[i] = static_cast<float>(std::cos(angle));
      sine[i] = static_cast<float>(std::sin(angle));
    }
  }
}

AzimuthSampling azimuth_sampling(const ExchangeMedium& medium, const RingPoint& source,
                                 const RingPoint& target, int azimuth_divisions, int max_modes,
                                 double tolerance, int source_modes) {
  const int half = azimuth_divisions / 2;
  AzimuthSampling all{1, std::min(max_modes, half + 1)};
  if (tolerance <= 0) return all;
  const double folds = -std::log(tolerance);
  const double product = source.rho_km * target.rho_km;
  const double dr = source.rho_km - target.rho_km, dz = source.z_km - target.z_km;
  const double d2 = dr * dr + dz * dz;
  if (d2 <= 0) return all;
  // cosh(eta) - 1 = d0^2 / (2 rho_s rho_t)
  const double x = d2 / (2 * std::max(product, 1e-12));
  const double eta = std::log1p(x + std::sqrt(x * (x + 2)));
  double modes = folds / eta;
  const RingPoint& low = source.altitude_km <= target.altitude_km ? source : target;
  const double beta = medium.largest[static_cast<std::size_t>(low.layer)];
  const double d = std::sqrt(d2);
  modes = std::max(modes, std::sqrt(2 * folds * std::min(beta, 8 / d) * product / d));
  AzimuthSampling s;
  s.modes = std::min(all.modes, 1 + static_cast<int>(std::min(1e6, std::ceil(modes))));
  const double needed = std::max(8.0, std::max(s.modes, source_modes) + modes);
  for (int every = half; every > 1; --every) {
    if (half % every == 0 && azimuth_divisions / every >= needed) {
      s.every = every;
      break;
    }
  }
  return s;
}

}  // namespace twilight
