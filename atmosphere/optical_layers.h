// A user's own layers of the atmosphere, from a CSV file.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "atmosphere/medium.h"

namespace twilight {

/// Reads a medium from a CSV file with the header
/// `bottom_km,top_km,wavelength_nm,air_scattering_per_km,aerosol_scattering_per_km,
/// aerosol_asymmetry,absorption_per_km` (one line, no blanks). Lines that start with '#' and blank
/// lines are skipped. One block of rows per wavelength; in each the same 1..500 layers from 0 km
/// upwards without gaps, to 500 km at most. Coefficients are 0..1000 per km, asymmetry
/// -0.999..0.999.
///
/// The medium holds wavelength_nm_wanted (strictly increasing; each in the file to 1e-6 nm), or
/// every wavelength of the file in increasing order when that is empty. Absorption goes to
/// gas_absorption_per_km; refractivity and aerosol absorption are 0; air has the given
/// depolarisation, [0, 6/7).
///
/// Throws std::runtime_error when the file cannot be read; std::invalid_argument for what is in it,
/// as "file:line: column 'x': value 'y': must be ...", and for parameters out of range.
Medium read_optical_layers(const std::filesystem::path& file, double earth_radius_km,
                           std::span<const double> wavelength_nm_wanted, double depolarisation);

/// The wavelengths of such a file, nm, in increasing order. Throws as above; the whole file is
/// checked.
std::vector<double> optical_layer_wavelengths(const std::filesystem::path& file);

}  // namespace twilight
