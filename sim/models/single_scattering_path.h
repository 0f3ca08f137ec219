// Sunlight scattered once into straight rays.
#pragma once

#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "sim/models/nishita_options.h"
#include "sim/models/single_scattering_air.h"
#include "sim/sky.h"

namespace twilight {

/// A straight ray and the Sun, both in the horizontal frame of the ray's start.
struct RaySegment {
  double start_height_km = 0.0;       ///< above the ground, >= 0; beyond the air allowed
  double elevation_rad = 0.0;         ///< of the ray, -pi/2..pi/2
  double relative_azimuth_rad = 0.0;  ///< from the Sun's
  double length_km = std::numeric_limits<double>::infinity();  ///< >= 0
  double sun_elevation_rad = 0.0;                              ///< -pi/2..pi/2
};

/// What the air does to a ray between its two ends, and where it ends.
struct SingleScatteredRay : AerialLight {
  bool hits_ground = false;  ///< the ray ends on the ground, before or at its length
  /// Irradiance that the ground there gets from the Sun through the air, over the Sun's above it.
  std::vector<double> ground_irradiance;
};

/// Single scattering (Nishita et al. 1993; the Scratchapixel lesson's Eqs. 1-5) in any air of
/// constituents between two spheres, lit by a point Sun. No refraction, no polarisation.
///
/// With samples: the lesson's loop. Even segments of the view ray, light at their middles; the
/// optical depth up to a middle holds its whole segment (as in the lesson's code), which makes the
/// error first order in 1/view_samples; a ray to the Sun counts unless one of its sample points
/// lies below the ground.
///
/// Converged: the view ray is cut at the Earth's shadow, at its perigee and at the air's levels,
/// and each piece halved until Kronrod's and Gauss's rules differ by less than 1e-4 of the whole at
/// every wavelength (the rule kept is better than the difference by orders of magnitude).
class SingleScattering {
 public:
  /// `air` must outlive the object. solar_irradiance: above the air, per wavelength.
  SingleScattering(const SingleScatteringAir& air, const NishitaOptions& options,
                   std::span<const double> solar_irradiance);

  /// Safe to call from many threads. Every value is finite and >= 0.
  SingleScatteredRay along(const RaySegment& ray) const;

  /// Transmittance from a height (>= 0) to the Sun at an elevation there; 0 behind the planet.
  std::vector<double> sun_transmittance(double height_km, double sun_elevation_rad) const;

 private:
  const SingleScatteringAir& air_;
  NishitaOptions options_;
  std::vector<double> solar_irradiance_;
};

}  // namespace twilight
