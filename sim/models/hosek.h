// The nine-parameter form of a sky's distribution.
#pragma once

#include <algorithm>
#include <cmath>

namespace twilight {

/// Coefficients of the form of Hosek & Wilkie (2012, ACM TOG 31(4), Eq. 8), by the letters of the
/// paper: (a, b) darkening towards the horizon; c constant; (d, e) glow about the Sun; f Rayleigh's
/// cos^2; (g, h) forward peak, h its asymmetry, 0 <= h < 1; i brightening of the zenith. (Their
/// published data sets put i before h.)
struct HosekCoefficients {
  double a = 0.0, b = 0.0, c = 1.0, d = 0.0, e = 0.0, f = 0.0, g = 0.0, h = 0.0, i = 0.0;
};

/// chi(h, gamma) = (1 + cos^2 gamma) / (1 + h^2 - 2 h cos gamma)^(3/2), dimensionless.
inline double hosek_chi(double h, double cos_gamma) {
  const double base = 1.0 + h * h - 2.0 * h * cos_gamma;
  return (1.0 + cos_gamma * cos_gamma) / (base * std::sqrt(base));
}

/// F = (1 + a exp(b / (cos theta + 0.01)))
///     (c + d exp(e gamma) + f cos^2 gamma + g chi(h, gamma) + i sqrt(cos theta)), dimensionless;
/// theta is the view's zenith angle, gamma (rad, 0..pi) its angle to the Sun; cos_zenith in [0, 1].
/// A sky's radiance is its mean radiance times F.
inline double hosek(const HosekCoefficients& k, double cos_zenith, double sun_angle_rad) {
  const double up = std::max(cos_zenith, 0.0), cos_gamma = std::cos(sun_angle_rad);
  return (1.0 + k.a * std::exp(k.b / (up + 0.01))) *
         (k.c + k.d * std::exp(k.e * sun_angle_rad) + k.f * cos_gamma * cos_gamma +
          k.g * hosek_chi(k.h, cos_gamma) + k.i * std::sqrt(up));
}

}  // namespace twilight
