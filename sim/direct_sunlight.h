// Sunlight that reaches a point of the air unscattered.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"
#include "sim/sun_rays.h"

namespace twilight {

struct DirectSunlightOptions {
  int altitude_nodes = 0;  ///< rows of the table, at least 4; 0: 256, with exact 192
  int angle_nodes = 0;     ///< its columns, at least 8; 0: 320, with exact 512
  /// Scale the irradiance by the Jacobian of the ray map, else bending alone (the paper).
  bool refractive_spreading = false;
  /// Look-ups follow the rays of SunRays, wavelength by wavelength, instead of a bilinear table:
  /// 0.14 us per wavelength instead of 6 ns, and some hundred times the accuracy. The nodes are
  /// then those of the bending.
  bool exact = false;
};

/// Attenuation of the (refracted) direct solar beam at any altitude and solar zenith angle (Haber
/// et al. 2005, Sec. 4.4 and Eq. 3) for one medium.
///
/// The table's coordinates are sqrt(altitude) and w = sqrt(1 - zenith/horizon), where horizon is
/// the true zenith angle of the ray that grazes the ground, so that no interval straddles the
/// Earth's shadow. Its entries come from SunRays, which documents the physics; errors of both:
/// sim/README.md.
class DirectSunlight {
 public:
  /// Runs on the current oneTBB arena. Throws std::invalid_argument for too few nodes.
  explicit DirectSunlight(const Medium& medium, const DirectSunlightOptions& options = {});

  /// Wavelengths padded to whole SIMD lanes; the size of every spectrum below.
  std::size_t lanes() const { return lanes_; }

  /// -ln(E/E0) per wavelength of the irradiance normal to the beam at an altitude (km, clamped to
  /// 0..top) under the geometric solar zenith angle (rad, 0..pi): optical depth, less the
  /// logarithm of the refractive spreading where that is on (so that it may fall just below 0).
  /// Returns false (and leaves out alone) where the Earth shadows every wavelength; a wavelength
  /// alone in the shadow gets kOpaque, and so do padding lanes.
  bool attenuation(double altitude_km, double solar_zenith_rad, float* out) const {
    return attenuation(level(altitude_km), solar_zenith_rad, out);
  }

  /// What look-ups at one altitude share.
  struct Level {
    double altitude_km = 0;
    double horizon_rad = 0;  ///< shadow_zenith_rad; 0 with exact
    std::size_t row = 0;     ///< of the table, and the place between it and the next
    double between = 0;
  };
  Level level(double altitude_km) const;
  bool attenuation(const Level& level, double solar_zenith_rad, float* out) const;

  /// Geometric solar zenith angle beyond which every wavelength is in shadow, rad.
  double shadow_zenith_rad(double altitude_km) const;

  /// Refractive spreading of the middle wavelength, whether attenuation holds it or not; exactly 1
  /// without refraction, 0 in the shadow.
  double spreading(double altitude_km, double solar_zenith_rad) const {
    return middle().spreading(altitude_km, solar_zenith_rad);
  }

  /// Zenith angle, rad, under which the Sun appears at an altitude (km, clamped) when its geometric
  /// one is solar_zenith_rad: of the middle wavelength (the colours differ by 2 % of the bending),
  /// to 1e-5 rad. In the shadow that of the ground's horizon.
  double apparent_zenith_rad(double altitude_km, double solar_zenith_rad) const;

  static constexpr float kOpaque = 100.0F;

 private:
  const SunRays& middle() const { return rays_[exact_ ? wavelengths_ / 2 : 0]; }
  bool look_up(const Level& level, double solar_zenith_rad, float* out) const;

  double top_km_;
  std::size_t wavelengths_, lanes_;
  int altitude_nodes_, angle_nodes_;
  bool exact_;
  std::vector<SunRays> rays_;        // exact: of every wavelength; else of the middle one
  std::vector<double> horizon_rad_;  // [altitude], of the most refracted wavelength
  std::vector<float> table_;         // [altitude][angle][lane]
};

}  // namespace twilight
