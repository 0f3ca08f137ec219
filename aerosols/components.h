// What the aerosol is made of: the ten OPAC components and their microphysics.
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <span>
#include <string_view>

#include "aerosols/size_distribution.h"

namespace twilight {

/// The aerosol components of OPAC (Hess, Koepke & Schult 1998, Table 1).
enum class AerosolComponent {
  kInsoluble,
  kWaterSoluble,
  kSoot,
  kSeaSaltAccumulation,
  kSeaSaltCoarse,
  kMineralNucleation,
  kMineralAccumulation,
  kMineralCoarse,
  kMineralTransported,
  kSulfate,
};
inline constexpr std::size_t kAerosolComponents = 10;

/// OPAC's four-letter code of a component, e.g. "WASO".
std::string_view component_code(AerosolComponent component);

/// Wavelengths of the refractive index tables, um.
inline constexpr std::array<double, 14> kRefractiveIndexWavelength_um = {
    0.25, 0.30, 0.35, 0.40, 0.45, 0.50, 0.55, 0.60, 0.65, 0.70, 0.75, 0.80, 0.90, 1.00};

/// One component at one of the humidities OPAC tabulates.
struct ComponentState {
  AerosolComponent component;
  double relative_humidity_percent;  ///< 0, 50, 70, 80, 90, 95, 98 or 99
  LognormalSizeDistribution sizes;   ///< of the particle with its water
  /// n and k of m = n - i k at kRefractiveIndexWavelength_um, dry matter mixed with water.
  std::array<double, kRefractiveIndexWavelength_um.size()> real_index;
  std::array<double, kRefractiveIndexWavelength_um.size()> absorption_index;
};
inline constexpr std::size_t kComponentStates = 38;

/// All tabulated states, a component's states side by side in rising humidity; components
/// that take up no water have one state, at 0 %.
std::span<const ComponentState, kComponentStates> component_states();

/// The states of one component: 8 if it takes up water, else 1.
std::span<const ComponentState> component_states(AerosolComponent component);

/// m = n - i k of a state at a vacuum wavelength in nm, 250..1000, linear in wavelength
/// between tabulated values. Throws std::invalid_argument outside that range.
std::complex<double> refractive_index(const ComponentState& state, double wavelength_nm);

}  // namespace twilight
