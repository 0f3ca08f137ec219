// Wavelengths side by side in SIMD lanes.
#pragma once

#include <cstddef>

namespace twilight {

/// Number of floats that hold a spectrum of n wavelengths in whole lanes: the
/// next multiple of 8, or of 16 from 9 wavelengths on.
constexpr std::size_t padded_lanes(std::size_t n) { return n <= 8 ? 8 : (n + 15) / 16 * 16; }

}  // namespace twilight
