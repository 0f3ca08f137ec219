#include "atmosphere/refractive_index.h"

#include <cmath>

#include "atmosphere/profile.h"

namespace twilight {
namespace {

// 1333 Pa / (k_B 293.15 K), in cm^-3.
constexpr double kVapourOfWetTermPerCm3 = 1333.0 / (1.380649e-23 * 293.15) * 1e-6;

double inverse_square_um(double wavelength_nm) { return 1e6 / (wavelength_nm * wavelength_nm); }

}  // namespace

double ciddor_dry_refractivity(double wavelength_nm) {
  const double s2 = inverse_square_um(wavelength_nm);
  return 1e-8 * (5792105.0 / (238.0185 - s2) + 167917.0 / (57.362 - s2));
}

double ciddor_wet_refractivity(double wavelength_nm) {
  const double s2 = inverse_square_um(wavelength_nm);
  return 1.022e-8 * (295.235 + s2 * (2.6422 + s2 * (-0.03238 + s2 * 0.004028)));
}

double ciddor_refractivity(double wavelength_nm, double air_per_cm3, double water_vapour_per_cm3) {
  const double dry_per_cm3 = air_per_cm3 - water_vapour_per_cm3;
  return ciddor_dry_refractivity(wavelength_nm) * (dry_per_cm3 / kAirAt15CPerCm3) +
         ciddor_wet_refractivity(wavelength_nm) * (water_vapour_per_cm3 / kVapourOfWetTermPerCm3);
}

double haber2005_refractivity(double wavelength_nm, double height_km, double relative_humidity) {
  return std::exp(-height_km / kHaberScaleHeightKm) *
         ((1.0 - relative_humidity) * ciddor_dry_refractivity(wavelength_nm) +
          relative_humidity * ciddor_wet_refractivity(wavelength_nm));
}

}  // namespace twilight
