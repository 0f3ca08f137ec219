#include "output/colour.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "output/spectral_shares.h"

namespace twilight {
namespace {

ColourMatrix inverse(const ColourMatrix& m) {
  ColourMatrix cofactor_transposed;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
      cofactor_transposed[c][r] = m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1];
    }
  }
  const double determinant = m[0][0] * cofactor_transposed[0][0] +
                             m[0][1] * cofactor_transposed[1][0] +
                             m[0][2] * cofactor_transposed[2][0];
  for (auto& row : cofactor_transposed) {
    for (double& value : row) value /= determinant;
  }
  return cofactor_transposed;
}

std::array<double, 3> multiply(const ColourMatrix& m, const std::array<double, 3>& v) {
  std::array<double, 3> result;
  for (std::size_t r = 0; r < 3; ++r) result[r] = m[r][0] * v[0] + m[r][1] * v[1] + m[r][2] * v[2];
  return result;
}

Tristimulus xyz_of_chromaticity(const std::array<double, 2>& xy) {
  return {xy[0] / xy[1], 1.0, (1.0 - xy[0] - xy[1]) / xy[1]};
}

ColourMatrix derive_xyz_from_rec709() {
  const std::array<Tristimulus, 3> primary = {xyz_of_chromaticity(Rec709::kRed),
                                              xyz_of_chromaticity(Rec709::kGreen),
                                              xyz_of_chromaticity(Rec709::kBlue)};
  ColourMatrix columns;
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) columns[r][c] = primary[c][r];
  }
  // The luminances of the primaries follow from (1,1,1) being the white.
  const auto luminance = multiply(inverse(columns), xyz_of_chromaticity(Rec709::kWhite));
  for (auto& row : columns) {
    for (std::size_t c = 0; c < 3; ++c) row[c] *= luminance[c];
  }
  return columns;
}

}  // namespace

ColourIntegrator::ColourIntegrator(std::span<const double> wavelength_nm,
                                   const std::function<double(double)>& solar_irradiance_w_m2_nm,
                                   ColourObserver observer)
    : observer_(observer), weights_(wavelength_nm.size(), Tristimulus{0.0, 0.0, 0.0}) {
  if (wavelength_nm.empty()) {
    throw std::invalid_argument("wavelengths are 0 in number; at least 1 is needed");
  }
  for (std::size_t i = 0; i < wavelength_nm.size(); ++i) {
    if (!std::isfinite(wavelength_nm[i]) || wavelength_nm[i] <= 0.0 ||
        (i > 0 && wavelength_nm[i] <= wavelength_nm[i - 1])) {
      throw std::invalid_argument("wavelength_nm[" + std::to_string(i) + "] is " +
                                  std::to_string(wavelength_nm[i]) +
                                  "; wavelengths must be finite, > 0 and strictly increasing");
    }
  }
  const auto table = colour_matching_table(observer);
  for (std::size_t row = 0; row < kObserverRows; ++row) {
    const double lambda_nm = kFirstObserverWavelength_nm + static_cast<double>(row);
    const double solar = solar_irradiance_w_m2_nm(lambda_nm);
    if (!std::isfinite(solar) || solar < 0.0) {
      throw std::invalid_argument("solar irradiance at " + std::to_string(lambda_nm) + " nm is " +
                                  std::to_string(solar) + " W m^-2 nm^-1; it must be >= 0");
    }
    add_spectral_shares(wavelength_nm, lambda_nm, [&](std::size_t i, double share) {
      for (std::size_t c = 0; c < 3; ++c) weights_[i][c] += share * solar * table[row][c];
    });
  }
}

Tristimulus ColourIntegrator::xyz(std::span<const double> radiance,
                                  std::span<const double> solar_irradiance) const {
  if (radiance.size() != weights_.size() || solar_irradiance.size() != weights_.size()) {
    throw std::invalid_argument("spectrum has " + std::to_string(radiance.size()) + " values and " +
                                std::to_string(solar_irradiance.size()) +
                                " solar irradiances; both must be " +
                                std::to_string(weights_.size()));
  }
  Tristimulus sum = {0.0, 0.0, 0.0};
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    if (!(solar_irradiance[i] > 0.0)) {
      throw std::invalid_argument("solar irradiance[" + std::to_string(i) + "] is " +
                                  std::to_string(solar_irradiance[i]) +
                                  " W m^-2 nm^-1; it must be > 0");
    }
    const double ratio = radiance[i] / solar_irradiance[i];
    for (std::size_t c = 0; c < 3; ++c) sum[c] += weights_[i][c] * ratio;
  }
  return sum;
}

const ColourMatrix& xyz_from_rec709() {
  static const ColourMatrix matrix = derive_xyz_from_rec709();
  return matrix;
}

const ColourMatrix& rec709_from_xyz() {
  static const ColourMatrix matrix = inverse(xyz_from_rec709());
  return matrix;
}

LinearRgb linear_rec709(const Tristimulus& xyz) { return multiply(rec709_from_xyz(), xyz); }

double rec709_luminance(const LinearRgb& rgb) {
  const auto& y = xyz_from_rec709()[1];
  return y[0] * rgb[0] + y[1] * rgb[1] + y[2] * rgb[2];
}

GamutMapped into_gamut(const LinearRgb& rgb) {
  for (double component : rgb) {
    if (!std::isfinite(component)) {
      throw std::invalid_argument("a colour component is " + std::to_string(component) +
                                  "; it must be finite");
    }
  }
  const auto smallest =
      static_cast<std::size_t>(std::min_element(rgb.begin(), rgb.end()) - rgb.begin());
  if (rgb[smallest] >= 0.0) return {rgb, false};
  const double grey = rec709_luminance(rgb);
  if (grey <= 0.0) return {{0.0, 0.0, 0.0}, true};
  const double kept = grey / (grey - rgb[smallest]);
  LinearRgb mapped;
  for (std::size_t c = 0; c < 3; ++c) mapped[c] = std::max(0.0, grey + kept * (rgb[c] - grey));
  mapped[smallest] = 0.0;
  return {mapped, true};
}

std::array<double, 2> chromaticity(const Tristimulus& xyz) {
  const double sum = xyz[0] + xyz[1] + xyz[2];
  if (!(sum > 0.0)) {
    throw std::invalid_argument("X+Y+Z is " + std::to_string(sum) + "; it must be > 0");
  }
  return {xyz[0] / sum, xyz[1] / sum};
}

}  // namespace twilight
