// Luminance and illuminance.
#pragma once

#include <span>

#include "output/colour.h"

namespace twilight {

/// Luminance, cd/m^2, of a spectral radiance (W m^-2 sr^-1 nm^-1), or
/// illuminance, lux, of a spectral irradiance (W m^-2 nm^-1):
/// 683 lm/W times the integral of the spectrum times V(lambda), with V the y
/// function of the CIE 1931 observer (CIE 15). Sizes and exceptions as in
/// ColourIntegrator::xyz; also throws std::invalid_argument if the integrator
/// holds the 1964 observer, whose y is not V(lambda).
double photometric_value(const ColourIntegrator& integrator, std::span<const double> spectrum,
                         std::span<const double> solar_irradiance);

/// Luminance of the sky in cd/m^2; see photometric_value.
inline double luminance_cd_m2(const ColourIntegrator& integrator, std::span<const double> radiance,
                              std::span<const double> solar_irradiance) {
  return photometric_value(integrator, radiance, solar_irradiance);
}

/// Illuminance in lux; see photometric_value.
inline double illuminance_lux(const ColourIntegrator& integrator,
                              std::span<const double> irradiance,
                              std::span<const double> solar_irradiance) {
  return photometric_value(integrator, irradiance, solar_irradiance);
}

}  // namespace twilight
