#include "sim/models/preetham_scattering.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numbers>
#include <stdexcept>

#include "sim/models/preetham_spectra.h"

namespace twilight {
namespace {

using std::numbers::pi;

// Table 1: eta at scattering angles and wavelengths.
constexpr double kEtaNm[] = {400, 450, 550, 650, 850};
constexpr double kEtaDeg[] = {1, 4, 7, 10, 30, 60, 80, 90, 110, 120, 130, 150, 180};
constexpr double kEta[std::size(kEtaDeg)][std::size(kEtaNm)] = {
    {4.192, 4.193, 4.177, 4.147, 4.072},           {3.311, 3.319, 3.329, 3.335, 3.339},
    {2.860, 2.868, 2.878, 2.883, 2.888},           {2.518, 2.527, 2.536, 2.542, 2.547},
    {1.122, 1.129, 1.138, 1.142, 1.147},           {0.3324, 0.3373, 0.3433, 0.3467, 0.3502},
    {0.1644, 0.1682, 0.1730, 0.1757, 0.1785},      {0.1239, 0.1275, 0.1320, 0.1346, 0.1373},
    {0.08734, 0.09111, 0.09591, 0.09871, 0.10167}, {0.08242, 0.08652, 0.09179, 0.09488, 0.09816},
    {0.08313, 0.08767, 0.09352, 0.09697, 0.10065}, {0.09701, 0.1024, 0.1095, 0.1137, 0.1182},
    {0.1307, 0.1368, 0.1447, 0.1495, 0.1566}};

}  // namespace

PreethamScattering::PreethamScattering(double wavelength_nm, double turbidity) {
  if (!(wavelength_nm > 0 && std::isfinite(wavelength_nm))) {
    throw std::invalid_argument(fmt::format("wavelength_nm is {}; it must be > 0", wavelength_nm));
  }
  if (!(turbidity >= 1 && std::isfinite(turbidity))) {
    throw std::invalid_argument(fmt::format("turbidity is {}; it must be at least 1", turbidity));
  }
  constexpr double kIndex = 1.0003, kPerCubicMetre = 2.545e25, kDepolarisation = 0.035;
  constexpr double kKmPerM = 1e-3, kMPerCm = 1e-2, kMPerNm = 1e-9;
  const double m = wavelength_nm * kMPerNm;
  const double polarisability = kIndex * kIndex - 1;
  molecules_per_km_ = 8 * pi * pi * pi * polarisability * polarisability /
                      (3 * kPerCubicMetre * m * m * m * m) * (6 + 3 * kDepolarisation) /
                      (6 - 7 * kDepolarisation) / kKmPerM;

  const double concentration_m = (0.6544 * turbidity - 0.6510) * 1e-16 * kMPerCm;
  const double per_km = 0.434 * concentration_m * (2 * pi / m) * (2 * pi / m) / kKmPerM;
  haze_per_km_ = per_km * pi * preetham_spectra(wavelength_nm).mie_k;
  angular_haze_per_km_ = 0.5 * per_km;

  const double nm = std::clamp(wavelength_nm, kEtaNm[0], kEtaNm[std::size(kEtaNm) - 1]);
  std::size_t below = 0;
  while (below + 2 < std::size(kEtaNm) && nm >= kEtaNm[below + 1]) ++below;
  const double share = (nm - kEtaNm[below]) / (kEtaNm[below + 1] - kEtaNm[below]);
  for (std::size_t i = 0; i < log_eta_.size(); ++i) {
    log_eta_[i] = std::log(std::lerp(kEta[i][below], kEta[i][below + 1], share));
  }
}

double PreethamScattering::molecules_per_km_sr(double scattering_angle_rad) const {
  const double cosine = std::cos(scattering_angle_rad);
  return molecules_per_km_ * 3 / (16 * pi) * (1 + cosine * cosine);
}

double PreethamScattering::haze_per_km_sr(double scattering_angle_rad) const {
  const double degrees = std::clamp(scattering_angle_rad * 180 / pi, kEtaDeg[0], 180.0);
  std::size_t below = 0;
  while (below + 2 < std::size(kEtaDeg) && degrees >= kEtaDeg[below + 1]) ++below;
  const double share = (degrees - kEtaDeg[below]) / (kEtaDeg[below + 1] - kEtaDeg[below]);
  return angular_haze_per_km_ * std::exp(std::lerp(log_eta_[below], log_eta_[below + 1], share));
}

double meteorological_range_km(double turbidity) {
  const PreethamScattering air(550.0, turbidity);
  return std::log(1 / 0.02) / (air.molecules_per_km() + air.haze_per_km());
}

}  // namespace twilight
