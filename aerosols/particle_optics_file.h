// Files of particle optics: OPAC's, libRadtran's, MOPSMAP's and this program's own.
#pragma once

#include <filesystem>
#include <string_view>

#include "aerosols/particle_optics.h"

namespace twilight {

/// Says in a file that it is a table of ours (global attribute `format`; first line of CSV).
inline constexpr std::string_view kParticleOpticsFormat = "twilight particle optics 1";

/// Words for OpticsPer in our files, and back.
std::string_view optics_per_text(OpticsPer per);

/// Columns of our CSV.
inline constexpr std::string_view kParticleOpticsColumns =
    "relative_humidity_percent,wavelength_nm,scattering_per_km,absorption_per_km,asymmetry,"
    "angle_deg,p11,p12,p33,p34";

/// Reads particle optics; what kind of file it is shows in its content:
///  - a component file of OPAC's optdat (read_opac_optdat), or, where `path` lacks the two digits
///  of
///    the humidity ("optdat/waso"), all of its humidities 00, 50, 70, 80, 90, 95, 98, 99 that are
///    there;
///  - netCDF of libRadtran's mie tool or MOPSMAP (read_libradtran_optics);
///  - netCDF or CSV that this program exported (output/optics_file.h).
/// Everything is checked (require_particle_optics). Throws std::runtime_error or
/// std::invalid_argument that name the file and the line or variable.
ParticleOptics read_particle_optics(const std::filesystem::path& path);

}  // namespace twilight
