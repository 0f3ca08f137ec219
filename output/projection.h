// How the sky is laid out on a rectangle of pixels.
#pragma once

#include <optional>
#include <string_view>

namespace twilight {

enum class Projection {
  /// The upper hemisphere in a disc, N x N pixels, equidistant (the distance from
  /// the centre grows evenly with the angle from the zenith; horizon at the rim).
  /// As a camera looking straight up sees it: north at the top, therefore EAST
  /// AT THE LEFT. Pixels whose centre is outside the disc hold nothing.
  kFisheye,
  /// The full sphere, 2N x N pixels, even in azimuth and in elevation. Zenith
  /// along the top, nadir along the bottom; the left edge is north and azimuth
  /// grows to the right: north, east, south (middle), west. Seen from inside.
  kLatLong,
  /// The full sphere on a square, N x N pixels of equal solid angle (Clarberg
  /// 2008). Zenith at the centre, the horizon on the diamond that joins the
  /// middles of the edges, nadir at the corners. Turned like the fisheye: north
  /// at the top, east at the left; in the axes of pbrt-v4's environment light
  /// (x right, y down, z to the centre): x = west, y = south, z = up.
  kOctahedral,
};

/// A direction on the celestial sphere.
struct MapDirection {
  double elevation_rad = 0.0;  ///< -pi/2..pi/2
  double azimuth_rad = 0.0;    ///< clockwise from north, [0, 2 pi)
};

/// A place on the image in pixels: the centre of pixel (0, 0), top left, is (0.5, 0.5).
struct MapPosition {
  double x = 0.0;  ///< to the right
  double y = 0.0;  ///< down
};

/// "fisheye", "latlong" or "octahedral"; throws std::invalid_argument for any other name.
Projection projection_from_name(std::string_view name);
std::string_view projection_name(Projection projection);

/// Pixels across and down of a map of `size` (1..16384, else std::invalid_argument).
int map_width(Projection projection, int size);
int map_height(Projection projection, int size);

/// Direction seen at a place of the image, 0 <= x <= width, 0 <= y <= height;
/// nothing outside the fisheye's disc. Throws std::invalid_argument off the
/// image or for a size outside 1..16384.
std::optional<MapDirection> direction_at(Projection projection, int size, MapPosition position);

/// Direction at the centre of pixel (x, y); as direction_at.
std::optional<MapDirection> direction_of_pixel(Projection projection, int size, int x, int y);

/// Place of a direction on the image, the inverse of direction_at (to 1e-9
/// pixels away from zenith and nadir of the lat-long map, whose rows there are
/// one direction); nothing below the fisheye's horizon. Throws
/// std::invalid_argument if the elevation is outside -pi/2..pi/2, the azimuth
/// is not finite, or the size is outside 1..16384.
std::optional<MapPosition> pixel_of_direction(Projection projection, int size,
                                              MapDirection direction);

/// Solid angle of pixel (x, y), sr: exact for lat-long and octahedral maps
/// (their sums are 4 pi); for the fisheye the value at the pixel's centre times
/// its area, 0 outside the disc (the sum is 2 pi within 0.3 % from N = 64 on,
/// the staircase of the rim).
/// Throws as direction_of_pixel.
double pixel_solid_angle_sr(Projection projection, int size, int x, int y);

}  // namespace twilight
