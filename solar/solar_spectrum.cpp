#include "solar/solar_spectrum.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>

namespace twilight {
namespace {

#include "solar/solar_spectrum_table.inc"

constexpr std::array<double, 2> kUnit = {1.0, 1.0};

// Irradiances at first_nm, first_nm + step_nm, ...
struct Spectrum {
  std::string_view name;
  double first_nm;
  double step_nm;
  std::span<const double> irradiance_w_m2_nm;

  double last_nm() const {
    return first_nm + step_nm * static_cast<double>(irradiance_w_m2_nm.size() - 1);
  }

  // The step that holds the wavelength; the last step holds its end.
  std::size_t step_of(double wavelength_nm) const {
    const auto step = static_cast<std::size_t>((wavelength_nm - first_nm) / step_nm);
    return std::min(step, irradiance_w_m2_nm.size() - 2);
  }

  double at(double wavelength_nm) const {
    const std::size_t i = step_of(wavelength_nm);
    const double weight = (wavelength_nm - first_nm) / step_nm - static_cast<double>(i);
    return (1.0 - weight) * irradiance_w_m2_nm[i] + weight * irradiance_w_m2_nm[i + 1];
  }
};

constexpr std::array<Spectrum, 5> kSpectra = {{
    {"gueymard2004", kGueymard2004FirstNm, 1.0, kGueymard2004},
    {"kurucz1992", kKurucz1992FirstNm, 1.0, kKurucz1992},
    {"astm_g173", kAstmG173FirstNm, 1.0, kAstmG173},
    {"tsis1_hsrs", kTsis1HsrsFirstNm, 1.0, kTsis1Hsrs},
    {"unit", 280.0, 720.0, kUnit},
}};

const Spectrum& find_spectrum(std::string_view name) {
  for (const Spectrum& spectrum : kSpectra) {
    if (spectrum.name == name) return spectrum;
  }
  throw std::invalid_argument(fmt::format("solar spectrum \"{}\" is unknown; known are: {}", name,
                                          fmt::join(solar_spectra(), ", ")));
}

void check_wavelength(const Spectrum& spectrum, double wavelength_nm) {
  if (!(wavelength_nm >= spectrum.first_nm && wavelength_nm <= spectrum.last_nm())) {
    throw std::invalid_argument(
        fmt::format("wavelength {} nm is outside {}..{} nm of the solar spectrum {}", wavelength_nm,
                    spectrum.first_nm, spectrum.last_nm(), spectrum.name));
  }
}

}  // namespace

std::vector<std::string_view> solar_spectra() {
  std::vector<std::string_view> names;
  for (const Spectrum& spectrum : kSpectra) names.push_back(spectrum.name);
  return names;
}

std::pair<double, double> solar_spectrum_range_nm(std::string_view spectrum) {
  const Spectrum& table = find_spectrum(spectrum);
  return {table.first_nm, table.last_nm()};
}

double solar_irradiance_w_m2_nm(std::string_view spectrum, double wavelength_nm) {
  const Spectrum& table = find_spectrum(spectrum);
  check_wavelength(table, wavelength_nm);
  return table.at(wavelength_nm);
}

double mean_solar_irradiance_w_m2_nm(std::string_view spectrum, double from_nm, double to_nm) {
  const Spectrum& table = find_spectrum(spectrum);
  check_wavelength(table, from_nm);
  check_wavelength(table, to_nm);
  if (from_nm > to_nm) {
    throw std::invalid_argument(
        fmt::format("wavelength interval {}..{} nm ends before it begins", from_nm, to_nm));
  }
  if (from_nm == to_nm) return table.at(from_nm);
  // The trapezium of each step cut to the interval is exact for a linear piece.
  double integral = 0.0;
  for (std::size_t i = table.step_of(from_nm); i <= table.step_of(to_nm); ++i) {
    const double start_nm = table.first_nm + table.step_nm * static_cast<double>(i);
    const double low_nm = std::max(from_nm, start_nm);
    const double high_nm = std::min(to_nm, start_nm + table.step_nm);
    integral += 0.5 * (high_nm - low_nm) * (table.at(low_nm) + table.at(high_nm));
  }
  return integral / (to_nm - from_nm);
}

}  // namespace twilight
