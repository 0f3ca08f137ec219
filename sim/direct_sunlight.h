// Sunlight that reaches a point of the air unscattered.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// Transmittance of the (refracted) direct solar beam at any altitude and solar
/// zenith angle (Haber et al. 2005, Sec. 4.4 and Eq. 3), tabulated for one medium.
///
/// For every altitude node a fan of rays is traced outwards by Snell's law at the
/// least and the most refracted wavelength; the search for the ray that leaves
/// towards the Sun is an inverse interpolation in that fan. The table's coordinates are
/// sqrt(altitude) and w = sqrt(1 - zenith/horizon), where horizon is the true zenith angle of the
/// ray that grazes the ground, so that no interval straddles the Earth's shadow.
class DirectSunlight {
 public:
  /// altitude_nodes x angle_nodes rays per wavelength; runs on the current
  /// oneTBB arena. Throws std::invalid_argument for fewer than 2 nodes.
  explicit DirectSunlight(const Medium& medium, int altitude_nodes = 256, int angle_nodes = 320);

  /// Wavelengths padded to whole SIMD lanes; the size of every spectrum below.
  std::size_t lanes() const { return lanes_; }

  /// Optical depth of the beam per wavelength at an altitude (km, clamped to
  /// 0..top) under the geometric solar zenith angle (rad, 0..pi). Returns false
  /// (and leaves out alone) where the Earth shadows every wavelength; a
  /// wavelength alone in the shadow gets kOpaque. Padding lanes get kOpaque.
  bool optical_depth(double altitude_km, double solar_zenith_rad, float* out) const;

  /// Geometric solar zenith angle beyond which every wavelength is in shadow, rad.
  double shadow_zenith_rad(double altitude_km) const;

  static constexpr float kOpaque = 100.0F;

 private:
  double top_km_;
  std::size_t wavelengths_, lanes_;
  int altitude_nodes_, angle_nodes_;
  std::vector<double> horizon_rad_;  // [altitude], of the most refracted wavelength
  std::vector<float> table_;         // [altitude][angle][lane]
};

}  // namespace twilight
