#include "output/ubvri.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "output/spectral_shares.h"

namespace twilight {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Bessell (1990), Table 2. R's last three rows are 50 nm apart.
constexpr double kU[] = {0,     0.016, 0.068, 0.167, 0.287, 0.423, 0.560, 0.673, 0.772,
                         0.841, 0.905, 0.943, 0.981, 0.993, 1.000, 0.989, 0.916, 0.804,
                         0.625, 0.423, 0.238, 0.114, 0.051, 0.019, 0};
constexpr double kB[] = {0,     0.030, 0.134, 0.567, 0.920, 0.978, 1.000,
                         0.978, 0.935, 0.853, 0.740, 0.640, 0.536, 0.424,
                         0.325, 0.235, 0.150, 0.095, 0.043, 0.009, 0};
constexpr double kV[] = {0,     0.030, 0.163, 0.458, 0.780, 0.967, 1.000, 0.973,
                         0.898, 0.792, 0.684, 0.574, 0.461, 0.359, 0.270, 0.197,
                         0.135, 0.081, 0.045, 0.025, 0.017, 0.013, 0.009, 0};
constexpr double kR[] = {0,    0.23, 0.74, 0.91, 0.98, 1.00, 0.98, 0.96, 0.93, 0.90, 0.86, 0.81,
                         0.78, 0.72, 0.67, 0.61, 0.56, 0.51, 0.46, 0.40, 0.35, 0.14, 0.03, 0};
constexpr double kI[] = {0,     0.024, 0.232, 0.555, 0.785, 0.910, 0.965, 0.985,
                         0.990, 0.995, 1.000, 1.000, 0.990, 0.980, 0.950, 0.910,
                         0.860, 0.750, 0.560, 0.330, 0.150, 0.030, 0};

struct Band {
  std::span<const double> response;
  double first_nm, step_nm;
  std::size_t even;     ///< rows that are step_nm apart
  double wide_step_nm;  ///< between the others
  double zero_w_m2_nm;

  double wavelength_nm(std::size_t row) const {
    if (row < even) return first_nm + step_nm * static_cast<double>(row);
    return first_nm + step_nm * static_cast<double>(even - 1) +
           wide_step_nm * static_cast<double>(row + 1 - even);
  }
};

// Zero points of Table A2 are in 1e-11 erg cm^-2 s^-1 A^-1 = 1e-13 W m^-2 nm^-1.
constexpr std::array<Band, 5> kBands = {{
    {kU, 300, 5, std::size(kU), 0, 417.5e-13},
    {kB, 360, 10, std::size(kB), 0, 632.0e-13},
    {kV, 470, 10, std::size(kV), 0, 363.1e-13},
    {kR, 550, 10, std::size(kR) - 3, 50, 217.7e-13},
    {kI, 700, 10, std::size(kI), 0, 112.6e-13},
}};

double solar_at(const std::function<double(double)>& solar, double wavelength_nm) {
  const double e0 = solar(wavelength_nm);
  if (std::isfinite(e0) && e0 >= 0) return e0;
  throw std::invalid_argument(fmt::format(
      "solar irradiance at {} nm is {} W m^-2 nm^-1; it must be >= 0", wavelength_nm, e0));
}

}  // namespace

std::array<double, 2> ubvri_range_nm(std::size_t band) {
  const Band& b = kBands.at(band);
  return {b.first_nm, b.wavelength_nm(b.response.size() - 1)};
}

double ubvri_response(std::size_t band, double wavelength_nm) {
  const Band& b = kBands.at(band);
  if (!(wavelength_nm > b.first_nm)) return 0;
  for (std::size_t row = 1; row < b.response.size(); ++row) {
    const double right = b.wavelength_nm(row);
    if (wavelength_nm > right) continue;
    const double left = b.wavelength_nm(row - 1);
    return std::lerp(b.response[row - 1], b.response[row], (wavelength_nm - left) / (right - left));
  }
  return 0;
}

double ubvri_zero_w_m2_nm(std::size_t band) { return kBands.at(band).zero_w_m2_nm; }

double ubvri_magnitude(std::size_t band, double mean_irradiance_w_m2_nm) {
  if (!(mean_irradiance_w_m2_nm > 0)) return kNone;
  return -2.5 * std::log10(mean_irradiance_w_m2_nm / ubvri_zero_w_m2_nm(band));
}

UbvriIntegrator::UbvriIntegrator(std::span<const double> wavelength_nm,
                                 const std::function<double(double)>& solar_irradiance_w_m2_nm)
    : wavelengths_(wavelength_nm.size()) {
  const bool rising =
      std::ranges::adjacent_find(wavelength_nm, std::greater_equal<>()) == wavelength_nm.end();
  if (wavelength_nm.empty() || !rising || !(wavelength_nm.front() > 0) ||
      !std::isfinite(wavelength_nm.back())) {
    throw std::invalid_argument(
        "wavelengths must be at least one, finite, > 0 and strictly increasing");
  }
  for (std::size_t band = 0; band < kBands.size(); ++band) {
    const auto [first, last] = ubvri_range_nm(band);
    double whole = 0, held = 0;
    for (double nm = first; nm <= last; ++nm) {
      const double response = ubvri_response(band, nm);
      whole += response;
      if (nm >= wavelength_nm.front() && nm <= wavelength_nm.back()) held += response;
    }
    if (held < kUbvriCoverage * whole) continue;
    std::vector<double>& weights = weights_[band];
    weights.assign(wavelength_nm.size(), 0.0);
    for (double nm = first; nm <= last; ++nm) {
      const double share = ubvri_response(band, nm) / whole;
      if (share == 0) continue;
      const double energy = share * solar_at(solar_irradiance_w_m2_nm, nm);
      add_spectral_shares(wavelength_nm, nm,
                          [&](std::size_t i, double part) { weights[i] += part * energy; });
    }
  }
}

UbvriValues UbvriIntegrator::means(std::span<const double> spectrum,
                                   std::span<const double> solar_irradiance) const {
  if (spectrum.size() != wavelengths_ || solar_irradiance.size() != wavelengths_) {
    throw std::invalid_argument(
        fmt::format("spectrum has {} values and {} solar irradiances; both must be {}",
                    spectrum.size(), solar_irradiance.size(), wavelengths_));
  }
  UbvriValues result;
  result.fill(kNone);
  for (std::size_t band = 0; band < result.size(); ++band) {
    if (!measures(band)) continue;
    double sum = 0;
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      sum += weights_[band][w] * (spectrum[w] / solar_irradiance[w]);
    }
    result[band] = sum;
  }
  return result;
}

UbvriValues UbvriIntegrator::surface_brightness(std::span<const double> radiance,
                                                std::span<const double> solar_irradiance) const {
  UbvriValues result = means(radiance, solar_irradiance);
  for (std::size_t band = 0; band < result.size(); ++band) {
    result[band] = ubvri_magnitude(band, result[band] * kSquareArcsecond_sr);
  }
  return result;
}

}  // namespace twilight
