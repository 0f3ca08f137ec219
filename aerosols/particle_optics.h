// Optics of particles from elsewhere than the shipped table: own microphysics, imported files.
#pragma once

#include <string>
#include <vector>

#include "aerosols/component_mie.h"
#include "atmosphere/phase_matrix.h"

namespace twilight {

/// What the coefficients of a table belong to.
enum class OpticsPer {
  kParticlePerCm3,    ///< one particle cm^-3
  kMicrogramPerM3,    ///< one ug m^-3 of dry matter
  kExtinctionAt550nm  ///< a relative shape: extinction 1 km^-1 at 550 nm and the first humidity
};

/// A table of one kind of particle over humidity and wavelength.
struct ParticleOptics {
  std::string name;
  OpticsPer per = OpticsPer::kParticlePerCm3;
  std::vector<double> relative_humidity_percent;  ///< strictly increasing, 0..99; one or more
  std::vector<double> wavelength_nm;              ///< strictly increasing; one or more
  std::vector<ComponentOptics> optics;            ///< [humidity][wavelength]
  /// [humidity][wavelength], normalised as PhaseMatrix says; empty: Henyey-Greenstein.
  std::vector<PhaseMatrix> phase;
  double dry_mass_ug_per_m3 = 0.0;  ///< of one particle cm^-3; 0 = not known

  std::size_t index(std::size_t humidity, std::size_t wavelength) const {
    return humidity * wavelength_nm.size() + wavelength;
  }
};

}  // namespace twilight
