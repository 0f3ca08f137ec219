// Optical tables and scattering matrices as netCDF (CF) and CSV.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "aerosols/particle_optics.h"
#include "sim/scene_model.h"

namespace twilight {

/// Writes a table of particles, whole or not at all: netCDF (CF-1.10) where the name ends in ".nc",
/// CSV where it ends in ".csv". read_particle_optics() reads both back: the same numbers (angles to
/// rounding). Matrices of different angles are put on all of them together, which changes none of
/// their linear interpolants. `history` says where it comes from. Throws std::invalid_argument for
/// another ending, std::runtime_error naming the file.
void write_particle_optics(const ParticleOptics& optics, const std::filesystem::path& path,
                           std::string_view history);

/// Writes what a scene's air is made of, at the wavelengths that are solved: per layer and
/// wavelength extinction, scattering and absorption, single-scattering albedo and asymmetry,
/// optical depths, and the scattering matrix of every kind of aerosol. netCDF (CF-1.10) or, for
/// ".csv", two tables: the layers, and beside them "NAME.phase.csv" with the matrices where there
/// are any. Returns the files written; throws as above.
std::vector<std::filesystem::path> write_scene_optics(const SceneModel& model,
                                                      const std::filesystem::path& path,
                                                      std::string_view history);

}  // namespace twilight
