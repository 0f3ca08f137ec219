#include "aerosols/component_table.h"

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "aerosols/component_optics.h"
#include "aerosols/component_phase.h"
#include "aerosols/mixture_component.h"

namespace twilight {

ParticleOptics component_table(AerosolComponent component, std::span<const double> wavelength_nm,
                               const std::function<void()>& between) {
  if (wavelength_nm.empty() || !std::ranges::is_sorted(wavelength_nm, std::less_equal<>())) {
    throw std::invalid_argument("wavelengths of a component's table must be strictly increasing");
  }
  ParticleOptics table;
  table.name = component_code(component);
  table.dry_mass_ug_per_m3 = opac_component(component)->dry_mass_ug_per_m3().value();
  table.wavelength_nm.assign(wavelength_nm.begin(), wavelength_nm.end());
  const auto states = component_states(component);
  const auto first = static_cast<std::size_t>(states.data() - component_states().data());
  for (std::size_t s = 0; s < states.size(); ++s) {
    if (between) between();
    std::vector<StateAtWavelength> wanted;
    const double humidity = states[s].relative_humidity_percent;
    table.relative_humidity_percent.push_back(humidity);
    for (const double nm : wavelength_nm) {
      table.optics.push_back(component_optics(component, humidity, nm));
      wanted.push_back({first + s, nm});
    }
    for (PhaseMatrix& phase : component_phases(wanted)) table.phase.push_back(std::move(phase));
  }
  return table;
}

}  // namespace twilight
