// Component files of OPAC.
#pragma once

#include <filesystem>

#include "aerosols/particle_optics.h"

namespace twilight {

/// Reads one file of OPAC's folder optdat ("waso80": OPAC 3.1 and 4.0, Hess, Koepke & Schult 1998),
/// the optics of 1 particle cm^-3 at one humidity: comment lines '#' with the component's name and
/// humidity, a table of wavelength um, extinction, scattering, absorption km^-1, single-scattering
/// albedo, asymmetry, normalised extinction and refractive index, and below it the volume phase
/// function, km^-1 sr^-1, whose integral over the sphere is the scattering coefficient. Without
/// polarisation: p12 = p33 = p34 = 0. All wavelengths of the file (0.25..40 um) are kept.
///
/// The humidity is that of the title "# sulfate (99%)", else the last two digits of the file's
/// name, else 0. Throws std::runtime_error where the file cannot be read, std::invalid_argument
/// "FILE:LINE: column 'NAME': value 'V': must be ..." for what is in it.
ParticleOptics read_opac_optdat(const std::filesystem::path& file);

}  // namespace twilight
