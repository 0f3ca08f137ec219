// How different two colours look.
#pragma once

#include "output/colour_matching.h"

namespace twilight {

/// CIE 1976 L*a*b*: lightness (100 for the white), green-red, blue-yellow.
struct LabColour {
  double lightness = 0.0, a = 0.0, b = 0.0;
};

/// L*a*b* of X, Y, Z seen with a white (CIE 15:2004, 8.2.1), in any common unit. Components below 0
/// continue the straight part of the curve. Throws std::invalid_argument unless the white's
/// components are finite and > 0 and the colour's finite.
LabColour lab_of(const Tristimulus& xyz, const Tristimulus& white);

/// CIEDE2000 colour difference, dimensionless, >= 0, symmetric in its arguments, with the
/// parametric factors 1 (CIE 142-2001; Sharma, Wu & Dalal 2005, Color Res. Appl. 30, 21-30, eqs.
/// 2-22). About 1 is just noticeable between patches side by side; made for differences up to about
/// 5 and lightness 0..100, a mere ranking beyond. Meets the 34 published pairs to their 4 digits.
/// Throws std::invalid_argument if a component is not finite.
double ciede2000(const LabColour& first, const LabColour& second);

}  // namespace twilight
