// The Perez form of a sky's distribution.
#pragma once

#include <algorithm>
#include <cmath>

namespace twilight {

/// Coefficients of the five-parameter all-weather form of Perez, Seals & Michalsky (1993), as in
/// Preetham et al. (1999), Eq. 3: a darkening (or brightening) of the horizon, b luminance
/// gradient near the horizon, c relative intensity of the circumsolar region, d its width, e
/// relative back-scattered light.
struct PerezCoefficients {
  double a = 0.0, b = 0.0, c = 0.0, d = 0.0, e = 0.0;
};

/// F = (1 + a exp(b / cos theta)) (1 + c exp(d gamma) + e cos^2 gamma), dimensionless; theta is the
/// view's zenith angle, gamma (rad, 0..pi) its angle to the Sun. cos_zenith in [0, 1]; at the
/// horizon, where b / cos theta has no limit in general, it is taken as 1e-4. A sky's radiance is
/// that of the zenith times F(theta, gamma) / F(0, Sun's zenith angle).
inline double perez(const PerezCoefficients& k, double cos_zenith, double sun_angle_rad) {
  constexpr double kHorizonCosine = 1e-4;
  const double cos_gamma = std::cos(sun_angle_rad);
  return (1.0 + k.a * std::exp(k.b / std::max(cos_zenith, kHorizonCosine))) *
         (1.0 + k.c * std::exp(k.d * sun_angle_rad) + k.e * cos_gamma * cos_gamma);
}

}  // namespace twilight
