// Atmospheric profiles as uvspec (libRadtran) reads them.
#pragma once

#include <filesystem>

#include "atmosphere/profile.h"

namespace twilight {

/// Reads an atmosphere_file of uvspec (libRadtran user's guide, Edition 2.0: atmosphere_file):
/// blank-separated columns, the top level first, the ground last; '#' begins a comment, empty lines
/// are skipped. Columns: height above sea level km, pressure hPa, temperature K, and then number
/// densities in cm^-3 of air, O3, O2, H2O, CO2, NO2, of which any number may be left out at the
/// end. Air that is left out follows from pressure and temperature (p = n k T); other gases left
/// out are not there. O2 and CO2 are checked and not used.
///
/// 2..1000 levels; heights fall strictly from the first line to 0 km, sea level, in the last, to
/// 1..200 km at the top; pressure above 0 and falling with height, temperature 50..2000 K;
/// densities 0 or above, air above 0 and within 5 % of p / (k T) below 80 km (uvspec asks for the
/// same law).
///
/// The profile's name is the file's. Throws std::runtime_error where the file cannot be read and
/// std::invalid_argument "FILE:LINE: column 'NAME': value 'V': must be ..." for what is in it.
Profile read_uvspec_profile(const std::filesystem::path& file);

/// The profile in that format: nine columns with 17 digits (O2 and CO2 as dry air's 20.95 % and
/// 420 ppm), which reads back as the same levels.
std::string uvspec_profile_text(const Profile& profile);

}  // namespace twilight
