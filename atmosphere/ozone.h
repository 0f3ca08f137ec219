// Absorption of light by ozone.
#pragma once

namespace twilight {

/// Molecules per cm^2 in one Dobson unit (10 um of ozone at 0 C, 1013.25 hPa).
inline constexpr double kMoleculesPerCm2PerDobson = 2.6867e16;

/// Absorption cross section of ozone per molecule at 223 K, cm^2, wavelength in air 280..1000 nm:
/// Bogumil et al. (2003), 1 nm means, linear between them. In the Chappuis band other measurements
/// lie up to 5 % lower (Serdyuchenko et al. 2014: 3..4 %); from 360 to 400 nm the values are noise
/// of a few 1e-24 cm^2, an optical depth below 1e-4. The measurement ends at 830 nm (9.4e-23 cm^2,
/// an optical depth of 0.0008 for 300 DU); from there it falls linearly to 0 at 1000 nm, a stand-in
/// for the faint tail of the Wulf bands. Throws std::invalid_argument outside 280..1000 nm.
double ozone_cross_section_cm2(double wavelength_nm);

}  // namespace twilight
