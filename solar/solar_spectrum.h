// The Sun's spectral irradiance outside the atmosphere at 1 au.
#pragma once

#include <string_view>
#include <utility>
#include <vector>

namespace twilight {

/// Names of the spectra: "gueymard2004", "kurucz1992", "astm_g173", "tsis1_hsrs" (sources in
/// solar_spectrum_table.inc) and "unit" (1 W m^-2 nm^-1 everywhere).
std::vector<std::string_view> solar_spectra();

/// First and last wavelength of a spectrum, nm: 280..1000, "tsis1_hsrs" 350..1000. Throws
/// std::invalid_argument, listing the known names, for an unknown one.
std::pair<double, double> solar_spectrum_range_nm(std::string_view spectrum);

/// Spectral irradiance normal to the beam at 1 au, W m^-2 nm^-1, at a wavelength in nm: linear
/// between the tabulated 1 nm means (lines narrower than 1 nm are smoothed); divide by
/// distance_au^2 for another distance. Haber et al. 2005, Sec. 4.2.
/// Error: against "tsis1_hsrs" (itself good to 0.3 %, below 460 nm 1.3 %) 10 nm means from 350 nm
/// on differ by at most 2.5 % for "gueymard2004", 3.3 % for "astm_g173" and, for the computed
/// "kurucz1992", 6 % below 450 nm and 1.4 % above; in 300..350 nm "kurucz1992" departs from
/// "gueymard2004" by up to 18 %. Throws std::invalid_argument for an unknown name or a wavelength
/// outside solar_spectrum_range_nm.
double solar_irradiance_w_m2_nm(std::string_view spectrum, double wavelength_nm);

/// Mean of the same over [from_nm, to_nm], W m^-2 nm^-1: the exact integral of the piecewise linear
/// table divided by the width (Haber et al. 2005, Sec. 4.2, integrates likewise); the value at
/// from_nm where both are equal. Throws std::invalid_argument as above, and where from_nm > to_nm.
double mean_solar_irradiance_w_m2_nm(std::string_view spectrum, double from_nm, double to_nm);

}  // namespace twilight
