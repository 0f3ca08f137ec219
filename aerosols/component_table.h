// A shipped component as the table that files hold.
#pragma once

#include <functional>
#include <span>

#include "aerosols/components.h"
#include "aerosols/particle_optics.h"

namespace twilight {

/// Optics (component_optics) and scattering matrices (component_phases) of one particle cm^-3 at
/// the component's tabulated humidities and at wavelengths 280..1000 nm, strictly increasing. All
/// ten components at three wavelengths take 11 s on one core, sea salt the most of it; `between` is
/// called before each humidity and may throw to end the work. Throws std::invalid_argument for the
/// wavelengths.
ParticleOptics component_table(AerosolComponent component, std::span<const double> wavelength_nm,
                               const std::function<void()>& between = {});

}  // namespace twilight
