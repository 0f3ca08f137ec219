// Sky maps read back from OpenEXR files.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "output/sky_image.h"

namespace twilight {

/// A colour map as a file holds it.
struct StoredMap {
  /// Channels R, G, B or X, Y, Z, whatever others there are; `projection` as the attribute says, or
  /// nothing where there is none of ours.
  SkyImage image;
  double white_luminance_cd_m2 = 683.0;   ///< of the value 1; 683 where the file does not say
  std::map<std::string, double> numbers;  ///< its numeric attributes
};

/// Reads a scan-line or tiled EXR of FLOAT, HALF or UINT channels. Throws std::invalid_argument
/// naming the file where it is no EXR, holds neither R, G, B nor X, Y, Z, or a pixel is
/// not finite. Negative ones are kept: colours outside Rec. 709 have them.
StoredMap read_exr_map(const std::filesystem::path& path);

/// The text attribute of an EXR file of which every pixel of every channel can be read; nothing
/// where the file is missing or damaged or has no such attribute.
std::optional<std::string> text_of_whole_exr(const std::filesystem::path& path,
                                             const std::string& attribute);

}  // namespace twilight
