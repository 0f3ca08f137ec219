// A folder of a renderer's sky tables: raw textures, the same as OpenEXR, and a manifest.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "output/hillaire2020_layout.h"
#include "output/sky_tables.h"
#include "output/table_check.h"
#include "output/table_layout.h"

namespace twilight {

/// A texture and the name of its files, without extension.
struct NamedTexture {
  std::string name;
  const Texture* texture;
  std::string channels;  ///< what its four channels hold
};

/// What the manifest tells beside the textures.
struct TableManifest {
  std::string layout, version, scene_file;
  std::vector<std::pair<std::string, std::string>> mappings, settings, physics;
  std::string spectrum, unit;
  std::vector<std::string> channel_names;
  ChannelTriple wavelength_nm{};  ///< 0 for rgb
  std::vector<double> solved_wavelength_nm;
  double bottom_radius_km = 0.0, top_radius_km = 0.0;
  std::vector<double> sun_elevation_deg;  ///< hillaire2020: of the sky views
  TableConstants constants;               ///< hillaire2020: the other layouts' are their tables'
  /// The air itself, for a renderer's own march, per channel and layer, from the ground up.
  struct Layer {
    double bottom_km = 0.0, top_km = 0.0;
    ChannelTriple rayleigh_scattering_per_km{}, mie_scattering_per_km{}, mie_absorption_per_km{},
        gas_absorption_per_km{};
  };
  std::vector<Layer> air;
  std::vector<TableError> errors;
};

/// Textures of a set and what is in them.
std::vector<NamedTexture> textures_of(const SkyTables& tables);
std::vector<NamedTexture> textures_of(const HillaireTables& tables);

/// Writes NAME.dat (32 bit floats, little-endian, RGBA, x fastest, then y, z), NAME.exr (FLOAT;
/// slices of z below each other), with `half` NAME.half.exr (HALF), manifest.json and, where errors
/// were measured, errors.csv. Throws std::runtime_error if a value is above HALF's 65504 and `half`
/// is asked for. All files appear or none; makes the folder if it is missing. Throws
/// std::runtime_error naming the path where that fails. tables and layout: of the
/// precomputed-scattering kind, for their sizes and constants, or null.
std::vector<std::string> write_table_set(const std::filesystem::path& folder,
                                         const std::vector<NamedTexture>& textures,
                                         const TableManifest& manifest, const SkyTables* tables,
                                         const TableLayout* layout, bool half);

/// Throws std::runtime_error naming the folder unless files can be made in it (which it makes, and
/// removes again).
void require_table_folder(const std::filesystem::path& folder);

/// A set of the precomputed-scattering kind as it stands in a folder.
struct TableSet {
  std::unique_ptr<TableLayout> layout;
  SkyTables tables;
};

/// Reads manifest.json and the .dat files. Throws std::runtime_error naming the file that is
/// missing, has another size than the manifest says, or holds a value that is not finite.
TableSet read_table_set(const std::filesystem::path& folder);

}  // namespace twilight
