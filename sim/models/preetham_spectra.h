// Spectral quantities of Preetham et al. (1999), Table 2.
#pragma once

namespace twilight {

/// One row of their Table 2. Dashes of the table are 0.
struct PreethamSpectra {
  double mie_k = 0.0;  ///< K of the haze's scattering (A.3), rad
  /// Mean and first two eigenvectors of daylight (Judd, MacAdam & Wyszecki 1964), relative.
  double s0 = 0.0, s1 = 0.0, s2 = 0.0;
  double ozone_per_m = 0.0;         ///< absorption of a column at NTP
  double water_vapour_per_m = 0.0;  ///< of precipitable water
  double mixed_gases = 0.0;         ///< of the air's own column, dimensionless
};

/// Table 2 at a wavelength in nm: 380..780 nm in steps of 10, linear between, the first and the
/// last row beyond (K, S0, S1, S2 are known nowhere else; the absorption of mixed gases and ozone
/// is 0 at both ends). Throws std::invalid_argument unless finite.
PreethamSpectra preetham_spectra(double wavelength_nm);

/// The Sun's spectral radiance above the air, W m^-2 sr^-1 nm^-1 (Table 2): 380..750 nm, linear
/// between the rows. Throws std::invalid_argument outside.
double preetham_sun_radiance(double wavelength_nm);

}  // namespace twilight
