// Rayleigh scattering by molecules of dry air.
#pragma once

namespace twilight {

/// Refractivity n - 1 of dry air at 288.15 K, 1013.25 hPa and 360 ppm CO2: Peck & Reeder (1972) as
/// in Bodhaine et al. (1999), eqs. 18-19. Valid 230..1690 nm.
double peck_reeder_refractivity(double wavelength_nm);

/// King factor F of dry air with 360 ppm CO2 (Bodhaine et al. 1999, eqs. 5, 6, 23): dimensionless,
/// about 1.049 at 550 nm.
double king_factor(double wavelength_nm);

/// Depolarisation ratio of unpolarised light, rho = 6 (F - 1) / (3 + 7 F), for a King factor F
/// >= 1.
double depolarisation_from_king_factor(double king);

/// King factor F = (6 + 3 rho) / (6 - 7 rho). Throws std::invalid_argument unless 0 <= rho < 6/7.
double king_factor_from_depolarisation(double depolarisation);

/// Scattering cross section per molecule, cm^2:
/// 24 pi^3 (n^2 - 1)^2 F / (lambda^4 N_s^2 (n^2 + 2)^2) (Bodhaine et al. 1999, eq. 22), with the
/// refractivity above and a King factor F. Valid 250..1000 nm, within 0.1 %.
/// Throws std::invalid_argument unless wavelength_nm > 200 and finite.
double rayleigh_cross_section_cm2(double wavelength_nm, double king);

/// Phase function of air, sr^-1, at the scattering angle's cosine: Bucholtz (1995), eq. 12,
/// [3 / (4 (1 + 2 gamma))] [(1 + 3 gamma) + (1 - gamma) cos^2] / (4 pi), gamma = rho / (2 - rho).
/// Integrates to 1 over the sphere; rho = 0 gives 3 (1 + cos^2) / (16 pi).
double rayleigh_phase_per_sr(double cos_angle, double depolarisation);

}  // namespace twilight
