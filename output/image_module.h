// What the module that reads images hands to the program. OpenImageIO brings some 200 libraries
// along, 0.2 s and 115 MB for a program that only starts: it is loaded when a photograph is read.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace twilight {

/// An image as its file holds it.
struct ModuleImage {
  std::string error;  ///< empty: read
  int width = 0, height = 0;
  int bytes_per_value = 0;
  int alpha_channel = -1;  ///< or -1
  std::vector<std::string> channels;
  std::vector<float> pixels;              ///< [y][x][channel]; integers as 0..1
  std::map<std::string, double> numbers;  ///< numeric attributes that were asked for and are there
};

/// The module's one function, by this name: reads `file` and the attributes `names`. Throws
/// nothing.
using ReadModuleImage = void(const char* file, const std::vector<std::string>& names,
                             ModuleImage& image);
inline constexpr const char* kReadModuleImage = "twilight_read_image";

}  // namespace twilight
