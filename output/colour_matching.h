// The CIE standard colorimetric observers.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

namespace twilight {

using Tristimulus = std::array<double, 3>;  ///< X, Y, Z (or the three functions at a wavelength)

enum class ColourObserver {
  kCie1931,  ///< 2 degree field; its y function is V(lambda), the one luminance is defined with
  kCie1964,  ///< 10 degree field, the one the paper uses (Sec. 3)
};

inline constexpr int kFirstObserverWavelength_nm = 360;
inline constexpr int kLastObserverWavelength_nm = 830;
inline constexpr std::size_t kObserverRows =
    kLastObserverWavelength_nm - kFirstObserverWavelength_nm + 1;

/// Colour matching functions of an observer at 360, 361 .. 830 nm (471 rows,
/// dimensionless, all >= 0), as tabulated in CIE 15.
std::span<const Tristimulus, kObserverRows> colour_matching_table(ColourObserver observer);

/// Colour matching functions at a wavelength in nm: linear between the 1 nm
/// rows, zero outside 360..830 nm. Throws std::invalid_argument if it is not finite.
Tristimulus colour_matching(ColourObserver observer, double wavelength_nm);

/// "cie1931" or "cie1964"; throws std::invalid_argument for any other name.
ColourObserver colour_observer_from_name(std::string_view name);

}  // namespace twilight
