#include "sim/models/daylight_spectrum.h"

#include <fmt/format.h>

#include <cstddef>
#include <stdexcept>

#include "sim/models/preetham_spectra.h"

namespace twilight {

DaylightWeights daylight_weights(double x, double y) {
  const double denominator = 0.0241 + 0.2562 * x - 0.7341 * y;
  if (!(denominator < 0)) {
    throw std::invalid_argument(
        fmt::format("chromaticity x = {:.4g}, y = {:.4g} is not that of any daylight", x, y));
  }
  return {(-1.3515 - 1.7703 * x + 5.9114 * y) / denominator,
          (0.0300 - 31.4424 * x + 30.0717 * y) / denominator};
}

DaylightSpectrum::DaylightSpectrum(std::span<const double> wavelength_nm) {
  for (const double nm : wavelength_nm) {
    const PreethamSpectra row = preetham_spectra(nm);
    basis_.push_back({row.s0, row.s1, row.s2});
  }
}

bool DaylightSpectrum::radiance(double luminance_cd_m2, double x, double y,
                                std::span<double> out) const {
  const DaylightWeights m = daylight_weights(x, y);
  const double own =
      kDaylightEfficacy_lm_w * (kDaylightTristimulus[0][1] + m.m1 * kDaylightTristimulus[1][1] +
                                m.m2 * kDaylightTristimulus[2][1]);
  if (!(own > 0)) {
    throw std::invalid_argument(
        fmt::format("chromaticity x = {:.4g}, y = {:.4g} is not that of any daylight", x, y));
  }
  const double scale = luminance_cd_m2 / own;
  bool clipped = false;
  for (std::size_t w = 0; w < basis_.size(); ++w) {
    const double value = scale * (basis_[w].s0 + m.m1 * basis_[w].s1 + m.m2 * basis_[w].s2);
    clipped = clipped || value < 0;
    out[w] = value > 0 ? value : 0.0;
  }
  return clipped;
}

}  // namespace twilight
