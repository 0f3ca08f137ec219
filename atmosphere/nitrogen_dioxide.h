// Absorption of light by nitrogen dioxide.
#pragma once

namespace twilight {

/// Absorption cross section of nitrogen dioxide per molecule, cm^2, wavelength 280..1000 nm: means
/// over 5 nm, linear between them, at 233 K after Davidson et al. (1988) to 420 nm and Bogumil et
/// al. (2003) to 630 nm, at 298 K after Schneider et al. (1987) to 695 nm. Measurements differ by
/// some 5 % (Harder et al. 1997: 3..7 % above, Schneider 4 % below in the blue). The bands within 5
/// nm are smoothed out: at one wavelength the cross section is up to 40 % off its mean. Above 695
/// nm, where it is below 0.3 % of its maximum (an optical depth below 1e-5 over clean air), it
/// falls linearly to 7e-22 cm^2 at 790 nm (Burrows et al. 1998) and to 0 at 1000 nm. Throws
/// std::invalid_argument outside 280..1000 nm.
double nitrogen_dioxide_cross_section_cm2(double wavelength_nm);

}  // namespace twilight
