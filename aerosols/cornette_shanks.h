// The phase function that the real-time models use for haze.
#pragma once

#include <cmath>
#include <numbers>

namespace twilight {

/// Cornette-Shanks phase function, sr^-1 (Bruneton & Neyret 2008, Eq. 4; the Scratchapixel lesson's
/// Mie phase function):
///   p(theta) = 3/(8 pi) (1 - g^2)(1 + cos^2 theta) / ((2 + g^2)(1 + g^2 - 2 g cos theta)^(3/2)),
/// normalised to 1 over the sphere; Rayleigh's at g = 0. Its mean cosine is
/// 3 g (4 + g^2) / (5 (2 + g^2)), not g. `cos_angle` in [-1, 1] (1 = forward), `asymmetry` is g in
/// (-1, 1). Exact; neither argument is checked (inner loop), nothing is thrown.
inline double cornette_shanks(double cos_angle, double asymmetry) {
  const double g2 = asymmetry * asymmetry;
  const double s = 1.0 + g2 - 2.0 * asymmetry * cos_angle;
  return 3.0 / (8.0 * std::numbers::pi) * (1.0 - g2) * (1.0 + cos_angle * cos_angle) /
         ((2.0 + g2) * s * std::sqrt(s));
}

}  // namespace twilight
