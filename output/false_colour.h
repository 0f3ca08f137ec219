// Errors as colours.
#pragma once

#include <array>
#include <cstdint>

namespace twilight {

using Rgb8 = std::array<std::uint8_t, 3>;  ///< sRGB

/// A diverging scale: -1 blue, 0 near white, 1 red (the end points of Moreland 2009, "Diverging
/// color maps for scientific visualization", blended linearly in sRGB); beyond +-1 the end colours.
/// NaN: mid grey.
Rgb8 diverging_colour(double value);

/// Of a ratio: log(ratio) / log(full), so that ratio = full is deep red, 1/full deep blue. 0 is
/// deep blue, NaN grey. full > 1.
Rgb8 ratio_colour(double ratio, double full);

}  // namespace twilight
