#include "atmosphere/rayleigh.h"

#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include "atmosphere/profile.h"

namespace twilight {
namespace {

constexpr double kCo2VolumeFraction = 360e-6;

double inverse_square_um(double wavelength_nm) {
  if (!(wavelength_nm > 200.0 && std::isfinite(wavelength_nm))) {
    std::ostringstream s;
    s << "wavelength " << wavelength_nm << " nm must be above 200 nm";
    throw std::invalid_argument(s.str());
  }
  return 1e6 / (wavelength_nm * wavelength_nm);
}

}  // namespace

double peck_reeder_refractivity(double wavelength_nm) {
  const double s2 = inverse_square_um(wavelength_nm);
  const double at_300_ppm =
      1e-8 * (8060.51 + 2480990.0 / (132.274 - s2) + 17455.7 / (39.32957 - s2));
  return at_300_ppm * (1.0 + 0.54 * (kCo2VolumeFraction - 300e-6));
}

double king_factor(double wavelength_nm) {
  const double s2 = inverse_square_um(wavelength_nm);
  const double nitrogen = 1.034 + 3.17e-4 * s2;
  const double oxygen = 1.096 + 1.385e-3 * s2 + 1.448e-4 * s2 * s2;
  const double co2_percent = 100.0 * kCo2VolumeFraction;
  return (78.084 * nitrogen + 20.946 * oxygen + 0.934 + co2_percent * 1.15) /
         (78.084 + 20.946 + 0.934 + co2_percent);
}

double depolarisation_from_king_factor(double king) {
  return 6.0 * (king - 1.0) / (3.0 + 7.0 * king);
}

double king_factor_from_depolarisation(double depolarisation) {
  if (!(depolarisation >= 0.0 && depolarisation < 6.0 / 7.0)) {
    std::ostringstream s;
    s << "depolarisation " << depolarisation << " must be within [0, 6/7)";
    throw std::invalid_argument(s.str());
  }
  return (6.0 + 3.0 * depolarisation) / (6.0 - 7.0 * depolarisation);
}

double rayleigh_cross_section_cm2(double wavelength_nm, double king) {
  const double refractivity = peck_reeder_refractivity(wavelength_nm);
  const double n2_minus_1 = refractivity * (2.0 + refractivity);
  const double lorentz = n2_minus_1 / (n2_minus_1 + 3.0) / kAirAt15CPerCm3;
  const double wavelength_cm = 1e-7 * wavelength_nm;
  const double pi3 = std::numbers::pi * std::numbers::pi * std::numbers::pi;
  return 24.0 * pi3 * lorentz * lorentz * king / std::pow(wavelength_cm, 4);
}

double rayleigh_phase_per_sr(double cos_angle, double depolarisation) {
  const double gamma = depolarisation / (2.0 - depolarisation);
  return 3.0 / (16.0 * std::numbers::pi * (1.0 + 2.0 * gamma)) *
         (1.0 + 3.0 * gamma + (1.0 - gamma) * cos_angle * cos_angle);
}

}  // namespace twilight
