// Mixture files: the aerosol layers of a scene, and own components, in TOML.
#pragma once

#include <filesystem>
#include <vector>

#include "aerosols/mixtures.h"

namespace twilight {

/// What a mixture file holds.
struct MixtureFile {
  std::vector<MixtureLayer> layers;  ///< one or more; those at one height add up
  /// The file itself and every file it names, in order: a change of any changes the mixture.
  std::vector<std::filesystem::path> files;
};

/// Reads a mixture file:
///
///   [[component]]                  # any number, beside OPAC's ten codes (INSO, WASO, ...)
///   name = "smoke"                 # letters, digits, _ and -; none of OPAC's
///   lognormal = { mode_radius_um = 0.08, geometric_deviation = 1.6,
///                 smallest_radius_um = 0.005, largest_radius_um = 5 }  # dry radii
///   size_distribution = "sizes.csv"      # in place of lognormal (read_size_distribution); or
///                                        # { file = "dubovik.siz", row = "average" }
///   refractive_index = "smoke.csv"       # wavelength_nm,n,k; or { wavelength_nm = [], n = [],
///                                        # k = [] }: of the dry matter, linear between
///   density_g_cm3 = 1.3                  # of the dry matter, for mass loads
///   growth = { humidity_percent = [0, 80, 99], radius_growth_factor = [1, 1.4, 2.5] }
///   optics = "smoke.nc"            # in place of all but name (read_particle_optics); OPAC's files
///                                  # of all humidities without their digits, "optdat/waso"
///
///   [[layer]]                      # one or more
///   bottom_km = 0                  # bottom and top, 0..200 ...
///   top_km = 2
///   scale_height_km = 8            # exp(-z/8 km), amounts are those at z = 0; left out: constant
///   profile = { heights_km = [], relative_density = [] }  # ... in place of all three
///   relative_humidity_percent = 80 # 0..99; "profile": the atmosphere's; a table { heights_km =
///   [],
///                                  # percent = [] }; left out: aerosols.relative_humidity_percent
///   number_per_cm3 = { WASO = 7000, smoke = 100 }
///   mass_ug_m3 = { SOOT = 2 }      # dry; adds to the numbers
///   extinction_550nm_per_km = { x = 0.1 }  # of imported tables without absolute scale
///   optical_depth_550nm = 0.2      # scales the layer to this depth
///
/// A relative path starts at the mixture file's folder. Throws std::invalid_argument with one
/// message `FILE:LINE: key 'x' = VALUE: must be RANGE` for all that is wrong in it or in the files
/// it names, std::runtime_error where a file cannot be read.
MixtureFile read_mixture_file(const std::filesystem::path& path);

}  // namespace twilight
