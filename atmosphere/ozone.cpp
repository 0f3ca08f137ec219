#include "atmosphere/ozone.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <sstream>
#include <stdexcept>

namespace twilight {
namespace {

#include "atmosphere/ozone_cross_section.inc"

constexpr double kFirstNm = 280.0;
constexpr double kLastNm = 830.0;
constexpr double kEndNm = 1000.0;
constexpr double kTableUnitCm2 = 1e-24;

}  // namespace

double ozone_cross_section_cm2(double wavelength_nm) {
  if (!(wavelength_nm >= kFirstNm && wavelength_nm <= kEndNm)) {
    std::ostringstream s;
    s << "wavelength " << wavelength_nm << " nm must be within 280..1000 nm";
    throw std::invalid_argument(s.str());
  }
  if (wavelength_nm >= kLastNm) {
    return kTableUnitCm2 * kOzone223K.back() * (kEndNm - wavelength_nm) / (kEndNm - kLastNm);
  }
  const double position = wavelength_nm - kFirstNm;
  const auto i = static_cast<std::size_t>(position);
  const double t = position - static_cast<double>(i);
  return kTableUnitCm2 * ((1.0 - t) * kOzone223K[i] + t * kOzone223K[i + 1]);
}

}  // namespace twilight
