// The one-parameter phase function of aerosol scattering.
#pragma once

#include <cmath>
#include <numbers>

namespace twilight {

/// Henyey-Greenstein phase function, sr^-1 (Haber et al. 2005, Eq. 1, Sec. 4.5.2):
///   p(theta) = (1 - g^2) / (4 pi (1 + g^2 - 2 g cos theta)^(3/2)),
/// normalised to 1 over the sphere; the mean cosine is g. `cos_angle` is the cosine of the
/// angle between incident and scattered direction, in [-1, 1] (1 = forward); `asymmetry` is
/// g in (-1, 1). Exact; neither argument is checked (inner loop), nothing is thrown.
inline double henyey_greenstein(double cos_angle, double asymmetry) {
  const double g2 = asymmetry * asymmetry;
  const double s = 1.0 + g2 - 2.0 * asymmetry * cos_angle;
  return (1.0 - g2) / (4.0 * std::numbers::pi * s * std::sqrt(s));
}

}  // namespace twilight
