// The temperature of the black body that a light's colour is nearest to.
#pragma once

#include <array>

#include "output/colour_matching.h"

namespace twilight {

inline constexpr double kLowestColourTemperature_K = 1000;
inline constexpr double kHighestColourTemperature_K = 1e6;
/// Distance from the Planckian locus, in CIE 1960 u, v, beyond which a colour temperature has no
/// meaning (CIE 15).
inline constexpr double kFarthestFromPlanck_uv = 0.05;

/// X, Y, Z (CIE 1931, to a common factor) of a black body; c2 = 1.4388e-2 m K, as CIE 15 has it.
/// temperature_K > 0, else std::invalid_argument.
Tristimulus black_body_xyz(double temperature_K);

/// Correlated colour temperature, K, of a chromaticity x, y (CIE 1931): that of the nearest point
/// of the Planckian locus in the CIE 1960 uniform chromaticity diagram (CIE 15), found in steps of
/// a reciprocal megakelvin and between them by projection; error below 0.1 mired, 0.2 K at 1000 K
/// and 0.1 % at 10^4 K. NaN below 1000 K, above 1e6 K (the deep blue of twilight is beyond any
/// black body), further than kFarthestFromPlanck_uv from the locus, and where x, y are not finite.
double correlated_colour_temperature_K(const std::array<double, 2>& xy);

}  // namespace twilight
