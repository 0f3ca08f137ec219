// Sunlight at the ground after Preetham et al. (1999), A.1 (formulas of Iqbal 1983).
#pragma once

namespace twilight {

/// Relative optical mass 1 / (cos z + 0.15 (93.885 - z in degrees)^-1.253) (Kasten 1965) of a
/// zenith angle z, rad: dimensionless, 1 overhead, 36.5 at the horizon. Throws
/// std::invalid_argument unless 0 <= z <= pi/2.
double relative_optical_mass(double zenith_angle_rad);

/// Angstrom's beta of a turbidity, 0.04608 T - 0.04586: the haze's vertical optical depth at 1 um,
/// dimensionless; 0 where that is negative (T < 0.996).
double angstrom_coefficient(double turbidity);

/// Columns of the clear atmosphere; the defaults are their text's.
struct PreethamColumns {
  double turbidity = 2.0;
  double ozone_m = 0.0035;       ///< at NTP: 0.35 cm, 350 Dobson units
  double water_vapour_m = 0.02;  ///< precipitable
  double angstrom_exponent = 1.3;
};

/// Transmittances of the direct beam, each 0..1.
struct PreethamTransmittance {
  double rayleigh = 1.0, aerosol = 1.0, ozone = 1.0, mixed_gases = 1.0, water_vapour = 1.0;
  double total() const { return rayleigh * aerosol * ozone * mixed_gases * water_vapour; }
};

/// At a wavelength (nm, > 0; the absorption of gases is that of Table 2 and, beyond 380..780 nm, of
/// its ends) along `optical_mass` vertical columns (>= 0).
PreethamTransmittance preetham_transmittance(double wavelength_nm, double optical_mass,
                                             const PreethamColumns& columns);

}  // namespace twilight
