#include "sim/models/hoffman_preetham.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace twilight {
namespace {

using std::numbers::pi;

}  // namespace

std::optional<HazeRow> haze_row(std::string_view name) {
  const auto row = std::ranges::find(kHazeTable, name, &HazeRow::name);
  return row == kHazeTable.end() ? std::nullopt : std::optional(*row);
}

double hoffman_preetham_air_per_m(double wavelength_nm) {
  constexpr double kIndex = 1.0003, kMolecules_m3 = 2.545e25, kDepolarisation = 0.035;
  const double lambda_m = 1e-9 * wavelength_nm;
  const double refraction = kIndex * kIndex - 1.0;
  return 8.0 * pi * pi * pi * refraction * refraction /
         (3.0 * kMolecules_m3 * std::pow(lambda_m, 4.0)) * (6.0 + 3.0 * kDepolarisation) /
         (6.0 - 7.0 * kDepolarisation);
}

double printed_haze_phase_per_sr(double cos_angle, double g) {
  const double s = std::max(1.0 + g * g - 2.0 * g * cos_angle, 1e-4);
  return (1.0 - g) * (1.0 - g) / (4.0 * pi * s * std::sqrt(s));
}

double physical_asymmetry(double g) {
  constexpr double kHaze = 0.8, kSingular = 0.99;
  const double shape = std::abs(g) > 1.0 ? 1.0 / g : g;
  return std::abs(shape) > kSingular ? -std::copysign(kHaze, g) : -shape;
}

double optical_length(double zenith_length, double zenith_deg) {
  return zenith_length /
         (std::cos(zenith_deg * pi / 180.0) + 0.15 * std::pow(93.885 - zenith_deg, -1.253));
}

double extinction_factor(double extinction_per_km, double distance_km) {
  return extinction_per_km > 0.0 ? std::exp(-extinction_per_km * distance_km) : 1.0;
}

double inscattering(double extinction_per_km, double scattering_per_km_sr, double distance_km) {
  if (extinction_per_km == 0.0) {
    return scattering_per_km_sr == 0.0 ? 0.0 : scattering_per_km_sr * distance_km;
  }
  return scattering_per_km_sr / extinction_per_km * -std::expm1(-extinction_per_km * distance_km);
}

double two_shell_inscattering(const TwoShellOptics& optics, double air_length_km,
                              double haze_length_km) {
  const double inner = optics.air_extinction_per_km + optics.haze_extinction_per_km;
  return inscattering(inner, optics.air_scattering_per_km_sr + optics.haze_scattering_per_km_sr,
                      haze_length_km) +
         inscattering(optics.air_extinction_per_km, optics.air_scattering_per_km_sr,
                      air_length_km - haze_length_km) *
             extinction_factor(inner, haze_length_km);
}

}  // namespace twilight
