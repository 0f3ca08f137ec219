// Photographs as data: linear images, the camera that took them and what it sees of the sky.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "output/camera_pose.h"
#include "output/linear_image.h"
#include "output/measurement.h"

namespace twilight {

/// How a photograph becomes data.
struct PhotographOptions {
  /// Values are averaged over square blocks of at least one pixel, so that no more than about this
  /// many blocks would cover the picture.
  int samples = 150;
  double relative_error = 0.02;       ///< of every mean (calibration), beside the pixels' scatter
  double lowest_elevation_deg = 1.0;  ///< of sky taken
  double sun_distance_deg = 5.0;      ///< nearer to the Sun nothing is taken
  double saturation = 1e30;           ///< blocks with a value from here on are not taken
  double value_scale = 1.0;           ///< what the file's values are multiplied with
  bool free_exposure = false;
};

/// Means of the blocks of sky: of the pixels that the mask (may be empty) calls sky; blocks of
/// which less than half are sky are left out, and those with a value that is not above 0 (a colour
/// that was cut off) or saturated. Each looks into the centroids of its quarters. The error of a
/// mean is the pixels' standard deviation over the root of their number, together with
/// relative_error. A response per channel of the image, in its order. Throws std::invalid_argument
/// where no block is left.
Measurement photograph_data(const LinearImage& image, const std::vector<char>& mask,
                            const CameraPose& pose, const MeasuredSun& sun,
                            std::vector<SpectralResponse> responses,
                            const PhotographOptions& options);

/// Linear Rec. 709 (R, G, B) or CIE 1931 (X, Y, Z), 1 being 683 cd/m^2, as twilight render writes
/// them: sensitivities are the colour matching functions of those primaries. Throws
/// std::invalid_argument for other channels.
std::vector<SpectralResponse> standard_responses(const std::vector<std::string>& channels);

/// Reads the photograph that a TOML file describes:
///
///   kind = "photograph"
///   file = "evening.exr"                # linear; beside this file, as all others
///   time = "2003-12-08T16:52:00+01:00"  # or sun_elevation_deg and sun_azimuth_deg [the scene's]
///   mask = "sky.png"                    # non-zero where there is sky [everywhere]
///   sensitivities = "camera.csv"        # wavelength_nm, then a column per channel, named as those
///                                       # of the image [Rec. 709 or CIE XYZ by their names]
///   exposure = "free"                   # a common factor is fitted, or "calibrated"
///                                       # [calibrated where the file has whiteLuminance]
///   value_scale = 1.0                   # value times this is the integral of radiance times
///                                       # sensitivity [whiteLuminance / 683]
///   relative_error = 0.02               # and samples, lowest_elevation_deg, sun_distance_deg,
///                                       # saturation: PhotographOptions
///   [camera]                            # the pose [the file's own attributes], or
///   azimuth_deg = 228.0
///   elevation_deg = 20.0
///   roll_deg = 0.0
///   field_of_view_deg = 45.0            # from bottom to top
///   [[star]]                            # two or more, of which pose and field of view are fitted
///   x = 812.3                           # pixels from the left and the top
///   y = 401.0
///   right_ascension_deg = 279.2347      # ICRS, at `star_time` [time]; or azimuth_deg and
///   declination_deg = 38.7837           # elevation_deg as seen
///
/// Throws as read_measurement.
Measurement read_photograph(const std::filesystem::path& toml, const Scene& scene,
                            std::optional<double> relative_error = std::nullopt);

}  // namespace twilight
