#include "sim/models/preetham_spectra.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <stdexcept>

namespace twilight {
namespace {

constexpr double kFirstNm = 380.0, kStepNm = 10.0, kLastSunNm = 750.0;

struct Row {
  double mie_k, s0, s1, s2, sun, ozone, water_vapour, mixed_gases;
};

constexpr Row kRows[] = {
    {0.650, 63.4, 38.5, 3, 16559, 0, 0, 0},  // 380 nm
    {0.653, 65.8, 35, 1.2, 16233.7, 0, 0, 0},
    {0.656, 94.8, 43.4, -1.1, 21127.5, 0, 0, 0},  // 400 nm
    {0.658, 104.8, 46.3, -0.5, 25888.2, 0, 0, 0},
    {0.661, 105.9, 43.9, -0.7, 25829.1, 0, 0, 0},
    {0.662, 96.8, 37.1, -1.2, 24232.3, 0, 0, 0},
    {0.663, 113.9, 36.7, -2.6, 26760.5, 0, 0, 0},
    {0.666, 125.6, 35.9, -2.9, 29658.3, 0.3, 0, 0},  // 450 nm
    {0.667, 125.5, 32.6, -2.8, 30545.4, 0.6, 0, 0},
    {0.669, 121.3, 27.9, -2.6, 30057.5, 0.9, 0, 0},
    {0.670, 121.3, 24.3, -2.6, 30663.7, 1.4, 0, 0},
    {0.671, 113.5, 20.1, -1.8, 28830.4, 2.1, 0, 0},
    {0.672, 113.1, 16.2, -1.5, 28712.1, 3, 0, 0},  // 500 nm
    {0.673, 110.8, 13.2, -1.3, 27825, 4, 0, 0},
    {0.674, 106.5, 8.6, -1.2, 27100.6, 4.8, 0, 0},
    {0.676, 108.8, 6.1, -1, 27233.6, 6.3, 0, 0},
    {0.677, 105.3, 4.2, -0.5, 26361.3, 7.5, 0, 0},
    {0.678, 104.4, 1.9, -0.3, 25503.8, 8.5, 0, 0},  // 550 nm
    {0.679, 100, 0, 0, 25060.2, 10.3, 0, 0},
    {0.679, 96, -1.6, 0.2, 25311.6, 12, 0, 0},
    {0.680, 95.1, -3.5, 0.5, 25355.9, 12, 0, 0},
    {0.681, 89.1, -3.5, 2.1, 25134.2, 11.5, 0, 0},
    {0.682, 90.5, -5.8, 3.2, 24631.5, 12.5, 0, 0},  // 600 nm
    {0.682, 90.3, -7.2, 4.1, 24173.2, 12, 0, 0},
    {0.683, 88.4, -8.6, 4.7, 23685.3, 10.5, 0, 0},
    {0.684, 84, -9.5, 5.1, 23212.1, 9, 0, 0},
    {0.684, 85.1, -10.9, 6.7, 22827.7, 7.9, 0, 0},
    {0.685, 81.9, -10.7, 7.3, 22339.8, 6.7, 0, 0},  // 650 nm
    {0.685, 82.6, -12, 8.6, 21970.2, 5.7, 0, 0},
    {0.685, 84.9, -14, 9.8, 21526.7, 4.8, 0, 0},
    {0.686, 81.3, -13.6, 10.2, 21097.9, 3.6, 0, 0},
    {0.686, 71.9, -12, 8.3, 20728.3, 2.8, 1.6, 0},
    {0.687, 74.3, -13.3, 9.6, 20240.4, 2.3, 2.4, 0},  // 700 nm
    {0.687, 76.4, -12.9, 8.5, 19870.8, 1.8, 1.25, 0},
    {0.688, 63.3, -10.6, 7, 19427.2, 1.4, 100, 0},
    {0.688, 71.7, -11.6, 7.6, 19072.4, 1.1, 87, 0},
    {0.689, 77, -12.2, 8, 18628.9, 1, 6.1, 0},
    {0.689, 65.2, -10.2, 6.7, 18259.2, 0.9, 0.1, 0},  // 750 nm
    {0.689, 47.7, -7.8, 5.2, 0, 0.7, 1e-03, 3},
    {0.689, 68.6, -11.2, 7.4, 0, 0.4, 1e-03, 0.21},
    {0.689, 65, -10.4, 6.8, 0, 0, 0.06, 0},  // 780 nm
};

// The row below a wavelength and the share of the next.
struct Between {
  std::size_t below;
  double share;
};

Between rows_at(double wavelength_nm) {
  if (!std::isfinite(wavelength_nm)) {
    throw std::invalid_argument(
        fmt::format("wavelength_nm is {}; it must be finite", wavelength_nm));
  }
  constexpr double kLast = static_cast<double>(std::size(kRows) - 1);
  const double position = std::clamp((wavelength_nm - kFirstNm) / kStepNm, 0.0, kLast);
  const double below = std::min(std::floor(position), kLast - 1);
  return {static_cast<std::size_t>(below), position - below};
}

}  // namespace

PreethamSpectra preetham_spectra(double wavelength_nm) {
  const Between at = rows_at(wavelength_nm);
  const Row &a = kRows[at.below], &b = kRows[at.below + 1];
  const auto mixed = [&](double Row::*column) { return std::lerp(a.*column, b.*column, at.share); };
  return {mixed(&Row::mie_k), mixed(&Row::s0),           mixed(&Row::s1),         mixed(&Row::s2),
          mixed(&Row::ozone), mixed(&Row::water_vapour), mixed(&Row::mixed_gases)};
}

double preetham_sun_radiance(double wavelength_nm) {
  if (!(wavelength_nm >= kFirstNm && wavelength_nm <= kLastSunNm)) {
    throw std::invalid_argument(
        fmt::format("wavelength_nm is {}; the Sun's radiance is known {}..{}", wavelength_nm,
                    kFirstNm, kLastSunNm));
  }
  const Between at = rows_at(wavelength_nm);
  // At the last wavelength the next row is empty and has no share.
  return at.share == 0 ? kRows[at.below].sun
                       : std::lerp(kRows[at.below].sun, kRows[at.below + 1].sun, at.share);
}

}  // namespace twilight
