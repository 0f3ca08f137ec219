// Light that arrives from all around a point, scattered again there (Bruneton & Neyret 2008, Eq.
// 7).
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "sim/models/bruneton_air.h"

namespace twilight {

/// Directions of arriving light about one point: Gauss-Legendre in zenith angle above and below its
/// horizon, crowding at it, times even steps of azimuth over half a turn from the Sun's; the other
/// half mirrors them. z up, x towards the Sun's azimuth.
struct BrunetonDirections {
  BrunetonDirections(const BrunetonSphere& sphere, double radius_km, int polar, int azimuths);
  std::vector<double> mu;            ///< of the polar nodes; the first half meets the ground
  std::vector<double> polar_weight;  ///< sums to 2
  std::vector<double> cos_azimuth;   ///< azimuths' cosines, each of weight pi / azimuths
  std::vector<float> x, y, z;        ///< [polar][azimuth]
  std::size_t size() const { return x.size(); }
};

/// Mean arriving light, weighted with a phase function, for any direction of the light scattered.
class BrunetonSource {
 public:
  /// `light` is [wavelength][direction], radiance times solid angle of a direction of half a turn.
  BrunetonSource(const BrunetonAir& air, const BrunetonDirections& directions,
                 std::span<const float> light);

  /// Integral of P(v.w) L(w) dw, per wavelength, for v with zenith cosine mu and component b
  /// towards the Sun's azimuth. Beyond directions that exist (|mu| > 1, or b^2 > 1 - mu^2; see
  /// bruneton_continued_ray): Rayleigh's term as the polynomial it is, the Mie term linear in b.
  void rayleigh(double mu, double b, std::span<double> out) const;
  void mie(double mu, double b, std::span<double> out) const;

 private:
  void mie_in(double mu, double b, std::span<double> out) const;

  const BrunetonAir& air_;
  const BrunetonDirections& directions_;
  std::span<const float> light_;
  std::vector<std::array<double, 5>> moments_;  // 1, xx, yy, zz, xz
};

}  // namespace twilight
