#include "atmosphere/nitrogen_dioxide.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <sstream>
#include <stdexcept>

namespace twilight {
namespace {

#include "atmosphere/nitrogen_dioxide_cross_section.inc"

constexpr double kFirstNm = 280.0;
constexpr double kStepNm = 5.0;
constexpr double kLastNm = kFirstNm + kStepNm * static_cast<double>(kNitrogenDioxide.size() - 1);
constexpr double kTableUnitCm2 = 1e-20;
// Mean of the GOME flight model's measurements from 785 to 794 nm (Burrows et al. 1998).
constexpr double kFaintNm = 790.0;
constexpr double kFaint = 0.07;
constexpr double kEndNm = 1000.0;

}  // namespace

double nitrogen_dioxide_cross_section_cm2(double wavelength_nm) {
  if (!(wavelength_nm >= kFirstNm && wavelength_nm <= kEndNm)) {
    std::ostringstream s;
    s << "wavelength " << wavelength_nm << " nm must be within 280..1000 nm";
    throw std::invalid_argument(s.str());
  }
  if (wavelength_nm >= kFaintNm) {
    return kTableUnitCm2 * kFaint * (kEndNm - wavelength_nm) / (kEndNm - kFaintNm);
  }
  if (wavelength_nm >= kLastNm) {
    return kTableUnitCm2 * std::lerp(kNitrogenDioxide.back(), kFaint,
                                     (wavelength_nm - kLastNm) / (kFaintNm - kLastNm));
  }
  const double position = (wavelength_nm - kFirstNm) / kStepNm;
  const auto i = static_cast<std::size_t>(position);
  return kTableUnitCm2 *
         std::lerp(kNitrogenDioxide[i], kNitrogenDioxide[i + 1], position - static_cast<double>(i));
}

}  // namespace twilight
