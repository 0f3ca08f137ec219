// A shipped component as the table that files hold.
#pragma once

#include <span>

#include "aerosols/components.h"
#include "aerosols/particle_optics.h"

namespace twilight {

/// Optics (component_optics) and scattering matrices (component_phases) of one particle cm^-3 at
/// the component's tabulated humidities and at wavelengths 280..1000 nm, strictly increasing. Takes
/// 0.01 s per matrix, coarse sea salt 0.1 s, on one core. Throws std::invalid_argument for the
/// wavelengths.
ParticleOptics component_table(AerosolComponent component, std::span<const double> wavelength_nm);

}  // namespace twilight
