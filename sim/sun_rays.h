// The rays on which sunlight of one wavelength reaches every point of the air.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"
#include "sim/sun_bending.h"

namespace twilight {

/// Refracted sunlight of one wavelength as a function of altitude and geometric solar zenith angle
/// (Haber et al. 2005, Sec. 4.4 and Eq. 3), all but exact.
///
/// In a spherical medium a ray is its Bouguer constant b = n r sin(a). Tabulated are
/// - bending chi - a and da/dchi (BendingTable, bicubic in its rows and columns);
/// - the outward optical depth from every shell boundary as a function of b. Layers of constant
///   extinction give it a square root at every boundary, so the nodes stand there and between
///   them in the square root of the distance below (cubic); the piece from the boundary down to
///   the point is exact.
///
/// Where refraction would duct rays (radii above about 25000 km), n r is kept rising with height
/// for the optical depth.
///
/// Immutable; safe to share between threads.
class SunRays {
 public:
  /// `bending`: of the wavelength, in this medium. Throws std::invalid_argument for a medium out of
  /// range (see RefractedRays).
  SunRays(const Medium& medium, std::size_t wavelength, BendingTable bending,
          bool refractive_spreading);

  /// -ln(E/E0) of the irradiance normal to the beam at an altitude (km, clamped to 0..top) under
  /// the geometric solar zenith angle (rad, 0..pi): optical depth along the bent ray, and with
  /// refractive_spreading less ln S, S = n^2 (sin a / sin chi) da/dchi (a apparent, chi geometric;
  /// conservation of 2 pi b db). False, attenuation untouched, in the Earth's shadow.
  bool attenuation(double altitude_km, double solar_zenith_rad, double& attenuation) const;

  /// S alone, whether attenuation holds it or not; exactly 1 without refraction, 0 in the shadow.
  double spreading(double altitude_km, double solar_zenith_rad) const;

  /// Apparent zenith angle of the Sun, rad; that of the horizon in the shadow.
  double apparent_zenith_rad(double altitude_km, double solar_zenith_rad) const;

  /// Geometric solar zenith angle at which the ray grazes the ground, rad.
  double shadow_zenith_rad(double altitude_km) const;

 private:
  struct Bending {
    double bending_rad, derivative;  // chi - a, da/dchi
  };
  struct Shell {
    double v_km;      // n r - R at its bottom
    double r_km;      // radius there
    double exponent;  // n r ~ r^m
    double depth;     // extinction times length over the change of n r cos(theta)
  };
  bool bending(double altitude_km, double solar_zenith_rad, Bending& out) const;
  void tabulate_depth(const Medium& medium, std::size_t wavelength);
  double spreading(double index, double solar_zenith_rad, const Bending& b) const;
  double depth_above(std::size_t row, std::size_t perigee_shell, double perigee_v_km) const;
  double v_km(double altitude_km, std::size_t shell) const;
  double x_km(double v_km, double perigee_v_km) const;
  std::size_t shell_of_altitude(double altitude_km) const;
  std::size_t shell_of_v(double v_km) const;

  double radius_km_ = 0, top_km_ = 0, filter_depth_ = 0;
  BendingTable bending_;
  bool spreading_ = false;
  std::vector<Shell> shell_;    // and one more for the top
  std::vector<float> grazing_;  // [boundary][node]: depth above it of rays with a perigee
  std::vector<float> steep_;    // [boundary][node]: of rays that come from the ground
  std::vector<unsigned> altitude_bin_, v_bin_;  // first shell that may hold a bin's values
};

}  // namespace twilight
