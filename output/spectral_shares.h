// What stands between the wavelengths that a sky was solved at.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

namespace twilight {

/// Calls add(i, share) for the one or two of the wavelengths (nm, strictly increasing, at least
/// one) that speak for a wavelength between or beyond them: L(nm) = E0(nm) sum share L_i / E0_i,
/// with (L/E0) lambda^4 piecewise linear between the wavelengths and constant beyond the first and
/// the last, which is exact for a pure Rayleigh sky. Nothing is checked.
template <class Add>
void add_spectral_shares(std::span<const double> wavelength_nm, double nm, Add add) {
  const auto share = [&](std::size_t i, double hat) {
    const double ratio = wavelength_nm[i] / nm;
    add(i, hat * ratio * ratio * ratio * ratio);
  };
  const auto above = std::ranges::upper_bound(wavelength_nm, nm);
  const auto next = static_cast<std::size_t>(above - wavelength_nm.begin());
  if (next == 0) return share(0, 1.0);
  if (next == wavelength_nm.size()) return share(next - 1, 1.0);
  const double t = (nm - wavelength_nm[next - 1]) / (wavelength_nm[next] - wavelength_nm[next - 1]);
  share(next - 1, 1.0 - t);
  share(next, t);
}

}  // namespace twilight
