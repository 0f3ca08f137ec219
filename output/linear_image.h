// Photographs of any format as linear floating-point images.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "output/camera_pose.h"

namespace twilight {

/// A linear image, [y][x][channel]; row 0 is the top. Alpha is left out.
struct LinearImage {
  int width = 0, height = 0;
  std::vector<std::string> channels;
  std::vector<float> pixels;
  std::optional<double> white_luminance_cd_m2;  ///< attribute whiteLuminance, of the value 1
  std::optional<CameraPose> pose;  ///< attributes cameraAzimuth, cameraElevation (deg) and
                                   ///< cameraFieldOfView, as write_exr() leaves them
};

/// Reads any format that OpenImageIO knows and that holds HALF, FLOAT, DOUBLE or 16 bit integers
/// (as 0..1); those of 8 bit are no linear response. Throws std::invalid_argument naming the file.
LinearImage read_linear_image(const std::filesystem::path& file);

/// Non-zero (first channel) where the mask shows sky, [y][x]; 8 bits will do. Throws
/// std::invalid_argument naming the file where it cannot be read or is of another size.
std::vector<char> read_mask(const std::filesystem::path& file, int width, int height);

}  // namespace twilight
