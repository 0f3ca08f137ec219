// Refractive index of moist air.
#pragma once

namespace twilight {

/// Refractivity n - 1 of dry air at 15 C, 1013.25 hPa, 450 ppm CO2: Ciddor (1996), Appl. Opt. 35,
/// 1566, eq. 1 (the dry term of Haber et al. 2005, Sec. 4.4). 230..1690 nm.
double ciddor_dry_refractivity(double wavelength_nm);

/// Refractivity of water vapour at 20 C, 1333 Pa: Ciddor (1996), eq. 3 (the wet term of Haber et
/// al. 2005, Sec. 4.4). 350..1200 nm.
double ciddor_wet_refractivity(double wavelength_nm);

/// Refractivity of air holding water_vapour_per_cm3 of its air_per_cm3 molecules: each term above
/// times the density of its gas over that of the term's own conditions (Ciddor 1996, eq. 5).
/// Compressibility is taken as 1, which costs less than 0.05 % near the ground.
double ciddor_refractivity(double wavelength_nm, double air_per_cm3, double water_vapour_per_cm3);

/// Refractivity by the formula printed in Haber et al. (2005), Sec. 4.4:
/// exp(-h / 8 km) ((1 - w) dry + w wet), w the relative humidity, 0..1. As printed it treats
/// saturated air as pure vapour of 1333 Pa: a relative humidity of 80 % takes 79 % off the
/// refractivity (2.8e-4 to 5.8e-5 at 550 nm), where the true effect of that humidity at 20 C is
/// -0.26 %. For comparison only.
double haber2005_refractivity(double wavelength_nm, double height_km, double relative_humidity);

}  // namespace twilight
