// Spectra known at a few wavelengths.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace twilight {

/// A positive quantity at wavelength_nm (> 0) from its values at two or more increasing
/// wavelengths: a power law through the two nearest (straight in logarithms), continued beyond the
/// ends. Nothing is checked.
inline double power_law(std::span<const double> at_nm, std::span<const double> value,
                        double wavelength_nm) {
  const auto above = std::ranges::upper_bound(at_nm, wavelength_nm) - at_nm.begin();
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(above, 1, static_cast<std::ptrdiff_t>(at_nm.size()) - 1));
  const double t = std::log(wavelength_nm / at_nm[i - 1]) / std::log(at_nm[i] / at_nm[i - 1]);
  return value[i - 1] * std::pow(value[i] / value[i - 1], t);
}

}  // namespace twilight
