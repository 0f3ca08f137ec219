#include "aerosols/component_optics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

constexpr std::array<ComponentOptics, kComponentStates* kTableWavelengths> kTable = {{
#include "aerosols/component_optics_table.inc"
}};

ComponentOptics at_wavelength(std::size_t state, double wavelength_nm) {
  const auto& grid = kTableWavelength_nm;
  const auto above = std::upper_bound(grid.begin() + 1, grid.end() - 1, wavelength_nm);
  const auto i = static_cast<std::size_t>(above - grid.begin()) - 1;
  const double t = (wavelength_nm - grid[i]) / (grid[i + 1] - grid[i]);
  const ComponentOptics& low = tabulated_optics(state, i);
  const ComponentOptics& high = tabulated_optics(state, i + 1);
  return {.scattering_per_km = std::lerp(low.scattering_per_km, high.scattering_per_km, t),
          .absorption_per_km = std::lerp(low.absorption_per_km, high.absorption_per_km, t),
          .asymmetry = std::lerp(low.asymmetry, high.asymmetry, t)};
}

// low^(1-t) high^t.
double geometric(double low, double high, double t) {
  if (low <= 0.0 || high <= 0.0) return std::lerp(low, high, t);
  return low * std::pow(high / low, t);
}

}  // namespace

const ComponentOptics& tabulated_optics(std::size_t state, std::size_t wavelength) {
  return kTable[state * kTableWavelengths + wavelength];
}

HumidityClasses humidity_classes(AerosolComponent component, double relative_humidity_percent) {
  const double humidity = relative_humidity_percent;
  if (!(humidity >= 0.0 && humidity <= kTableLargestHumidity_percent)) {
    throw std::invalid_argument("relative humidity " + std::to_string(humidity) +
                                " % of the aerosol is outside 0..99 %");
  }
  const std::span<const ComponentState> states = component_states(component);
  const auto first = static_cast<std::size_t>(states.data() - component_states().data());
  if (states.size() == 1) return {first, first, 0.0};

  std::array<double, 8> percents{};
  for (std::size_t i = 0; i < states.size(); ++i) {
    percents[i] = states[i].relative_humidity_percent;
  }
  HumidityClasses classes = humidity_classes(std::span(percents).first(states.size()), humidity);
  classes.low += first;
  classes.high += first;
  return classes;
}

HumidityClasses humidity_classes(std::span<const double> percents, double humidity) {
  if (percents.size() == 1) return {};
  if (!(humidity >= percents.front() && humidity <= percents.back())) {
    throw std::invalid_argument("relative humidity " + std::to_string(humidity) +
                                " % of the aerosol is outside " + std::to_string(percents.front()) +
                                ".." + std::to_string(percents.back()) + " %");
  }
  std::size_t i = 0;  // the class at or below the humidity, not the last one
  while (i + 2 < percents.size() && percents[i + 1] <= humidity) ++i;
  const double low = percents[i], high = percents[i + 1];
  const double fraction = low == 0.0 ? (humidity - low) / (high - low)
                                     : std::log((100.0 - humidity) / (100.0 - low)) /
                                           std::log((100.0 - high) / (100.0 - low));
  return {i, i + 1, fraction};
}

ComponentOptics between_humidities(const ComponentOptics& low, const ComponentOptics& high,
                                   double fraction, bool from_dry) {
  // A dry particle is no dilute droplet: the power law does not reach down to 0 %.
  const auto between = [&](double from, double to) {
    return from_dry ? std::lerp(from, to, fraction) : geometric(from, to, fraction);
  };
  return {.scattering_per_km = between(low.scattering_per_km, high.scattering_per_km),
          .absorption_per_km = between(low.absorption_per_km, high.absorption_per_km),
          .asymmetry = std::lerp(low.asymmetry, high.asymmetry, fraction)};
}

ComponentOptics component_optics(AerosolComponent component, double relative_humidity_percent,
                                 double wavelength_nm) {
  const auto [low_state, high_state, t] = humidity_classes(component, relative_humidity_percent);
  if (!(wavelength_nm >= kTableWavelength_nm.front() &&
        wavelength_nm <= kTableWavelength_nm.back())) {
    throw std::invalid_argument("wavelength " + std::to_string(wavelength_nm) +
                                " nm of the aerosol optics is outside 280..1000 nm");
  }
  const ComponentOptics low = at_wavelength(low_state, wavelength_nm);
  if (low_state == high_state) return low;
  return between_humidities(low, at_wavelength(high_state, wavelength_nm), t,
                            component_states()[low_state].relative_humidity_percent == 0.0);
}

}  // namespace twilight
