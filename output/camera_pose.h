// Where a pinhole camera looks: directions of its pixels, and the pose that stars tell.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "output/projection.h"

namespace twilight {

/// A pinhole camera with square pixels, its axis through the picture's middle.
struct CameraPose {
  double azimuth_rad = 0.0;        ///< of the axis, clockwise from north
  double elevation_rad = 0.0;      ///< -pi/2..pi/2
  double roll_rad = 0.0;           ///< the camera turned clockwise about its axis, seen from behind
  double field_of_view_rad = 1.0;  ///< from bottom to top, 0 < ... < pi
};

/// Direction of a place on the picture (projection.h: y grows down); of roll 0 as direction_at().
MapDirection direction_at(const CameraPose& pose, int width, int height, MapPosition position);

/// Place of a direction, also outside the frame; nothing behind the camera.
std::optional<MapPosition> position_of(const CameraPose& pose, int width, int height,
                                       MapDirection direction);

/// A star on the picture, and where it stands as it is seen (refracted).
struct StarPlace {
  MapPosition position;
  MapDirection direction;
};

/// The pose that the stars tell.
struct FittedPose {
  CameraPose pose;
  double rms_pixels = 0.0;              ///< of the distances left
  std::vector<double> residual_pixels;  ///< of each star
};

/// Least squares of the distances on the picture, over azimuth, elevation, roll and field of view
/// (3..160 degrees). Needs no guess: for each of a row of fields of view the rotation that turns
/// the pixels' rays best onto the stars (Kabsch 1976) is found, and the best of them refined. A
/// lens' distortion is not fitted; the residuals show it. Throws std::invalid_argument for less
/// than two stars, or stars in one place.
FittedPose fit_pose(std::span<const StarPlace> stars, int width, int height);

}  // namespace twilight
