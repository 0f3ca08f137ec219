#include "sim/models/preetham_sunlight.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/models/preetham_spectra.h"

namespace twilight {

double relative_optical_mass(double zenith_angle_rad) {
  constexpr double kRounding = 1e-9;
  if (!(zenith_angle_rad >= 0 && zenith_angle_rad <= std::numbers::pi / 2 + kRounding)) {
    throw std::invalid_argument(
        fmt::format("zenith_angle_rad is {}; it must be 0..pi/2", zenith_angle_rad));
  }
  const double degrees = zenith_angle_rad * 180 / std::numbers::pi;
  return 1 / (std::cos(zenith_angle_rad) + 0.15 * std::pow(93.885 - degrees, -1.253));
}

double angstrom_coefficient(double turbidity) {
  return std::max(0.0, 0.04608 * turbidity - 0.04586);
}

PreethamTransmittance preetham_transmittance(double wavelength_nm, double optical_mass,
                                             const PreethamColumns& columns) {
  const double um = 1e-3 * wavelength_nm, m = optical_mass;
  const PreethamSpectra gas = preetham_spectra(wavelength_nm);
  const double water = gas.water_vapour_per_m * columns.water_vapour_m * m;
  PreethamTransmittance t;
  t.rayleigh = std::exp(-0.008735 * std::pow(um, -4.08) * m);
  t.aerosol = std::exp(-angstrom_coefficient(columns.turbidity) *
                       std::pow(um, -columns.angstrom_exponent) * m);
  t.ozone = std::exp(-gas.ozone_per_m * columns.ozone_m * m);
  t.mixed_gases =
      std::exp(-1.41 * gas.mixed_gases * m / std::pow(1 + 118.93 * gas.mixed_gases * m, 0.45));
  t.water_vapour = std::exp(-0.2385 * water / std::pow(1 + 20.07 * water, 0.45));
  return t;
}

}  // namespace twilight
