// Optics of the aerosol components, read from the shipped table.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "aerosols/component_mie.h"
#include "aerosols/components.h"

namespace twilight {

/// Wavelengths of the shipped table in nm: 280, 282.5, ... 300, 310, ... 1000. The grid holds
/// every wavelength at which a refractive index bends, so only curvature is lost between its
/// points; it is dense below 300 nm, where k of the dusts rises steeply.
inline constexpr std::size_t kTableWavelengths = 79;
inline constexpr std::array<double, kTableWavelengths> kTableWavelength_nm = [] {
  std::array<double, kTableWavelengths> grid{};
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const double position = static_cast<double>(i);
    grid[i] = i <= 8 ? 280.0 + 2.5 * position : 300.0 + 10.0 * (position - 8.0);
  }
  return grid;
}();
static_assert(kTableWavelength_nm.back() == 1000.0);

/// Largest relative humidity of the table, percent.
inline constexpr double kTableLargestHumidity_percent = 99.0;

/// The table's row for a state (index into component_states()) and a wavelength index
/// below kTableWavelengths; both unchecked.
const ComponentOptics& tabulated_optics(std::size_t state, std::size_t wavelength);

/// Between which two tabulated states of a component a humidity lies: states `low` and `high`
/// (indices into component_states(); the same for components that take up no water) and how far
/// it is from low to high, 0..1: linear in RH below 50 %, in ln(1 - RH) above.
struct HumidityClasses {
  std::size_t low = 0;
  std::size_t high = 0;
  double fraction = 0.0;
};

/// The classes of a relative humidity in percent, 0..99, else throws std::invalid_argument.
HumidityClasses humidity_classes(AerosolComponent component, double relative_humidity_percent);

/// The same for states at any humidities, strictly increasing: `low` and `high` index them. One
/// state serves every humidity; else one outside theirs throws std::invalid_argument.
HumidityClasses humidity_classes(std::span<const double> state_humidity_percent,
                                 double relative_humidity_percent);

/// Optics between two states, `fraction` of the way in the sense of HumidityClasses: as
/// component_optics() says. `from_dry`: the lower state is at 0 %.
ComponentOptics between_humidities(const ComponentOptics& low, const ComponentOptics& high,
                                   double fraction, bool from_dry);

/// Optics of a component per particle cm^-3 (Haber et al. 2005, Sec. 4.1.1) at a relative
/// humidity in percent, 0..99, and a wavelength in nm, 280..1000.
/// Wavelength: scattering, absorption and asymmetry linear between table points; against the
/// Mie integral at all midpoints extinction and scattering err by < 0.1 %, absorption by < 0.2 %
/// or 1e-4 of extinction, asymmetry by < 0.0005.
/// Humidity: above 50 % scattering and absorption follow a power law in 1 - RH between OPAC's
/// classes (growth law of Kasten 1969, its exponent set by the two neighbouring classes) and
/// asymmetry is linear in ln(1 - RH); below 50 %, between the dry class and the first wet one,
/// all three are linear in RH. Exact at the classes; scattering and extinction grow
/// monotonically. A class left out is predicted to 3.1 % (70..98 %) and 6.4 % (50 %).
/// Components that take up no water ignore the humidity.
/// Throws std::invalid_argument for a humidity or wavelength out of range.
ComponentOptics component_optics(AerosolComponent component, double relative_humidity_percent,
                                 double wavelength_nm);

}  // namespace twilight
