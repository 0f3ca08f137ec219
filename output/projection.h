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
  /// What a pinhole camera sees: straight lines stay straight, square pixels, the horizon level in
  /// the middle column. Where it looks, and the frame, are CameraView's.
  kCamera,
};

/// Where a camera looks. Azimuth grows to the right.
struct CameraView {
  double azimuth_rad = 0.0;                  ///< of the picture's centre, clockwise from north
  double elevation_rad = 0.0;                ///< -pi/2..pi/2
  double field_of_view_rad = 1.13446401380;  ///< from bottom to top, 0 < ... < pi; 65 degrees
  double aspect_ratio = 1.5;                 ///< width over height, 0.2..5
};

/// A projection, and the camera where it is one.
struct MapProjection {
  Projection kind = Projection::kFisheye;
  CameraView camera = {};

  MapProjection() = default;
  MapProjection(Projection map) : kind(map) {}  // NOLINT: a kind is all there is to most maps
  MapProjection(const CameraView& view) : kind(Projection::kCamera), camera(view) {}  // NOLINT
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

/// "fisheye", "latlong", "octahedral" or "camera"; throws std::invalid_argument for any other name.
Projection projection_from_name(std::string_view name);
std::string_view projection_name(Projection projection);

/// Pixels across and down of a map of `size` (1..16384, else std::invalid_argument). A camera's
/// width is aspect_ratio times the height, rounded; its frame is as wide as its pixels. Throws
/// std::invalid_argument for a camera out of range, as all below.
int map_width(const MapProjection& projection, int size);
int map_height(const MapProjection& projection, int size);

/// Direction seen at a place of the image, 0 <= x <= width, 0 <= y <= height;
/// nothing outside the fisheye's disc. Throws std::invalid_argument off the
/// image or for a size outside 1..16384.
std::optional<MapDirection> direction_at(const MapProjection& projection, int size,
                                         MapPosition position);

/// Direction at the centre of pixel (x, y); as direction_at.
std::optional<MapDirection> direction_of_pixel(const MapProjection& projection, int size, int x,
                                               int y);

/// Place of a direction on the image, the inverse of direction_at (to 1e-9
/// pixels away from zenith and nadir of the lat-long map, whose rows there are
/// one direction); nothing below the fisheye's horizon, outside a camera's frame. Throws
/// std::invalid_argument if the elevation is outside -pi/2..pi/2, the azimuth
/// is not finite, or the size is outside 1..16384.
std::optional<MapPosition> pixel_of_direction(const MapProjection& projection, int size,
                                              MapDirection direction);

/// Solid angle of pixel (x, y), sr: exact for lat-long and octahedral maps
/// (their sums are 4 pi) and cameras (1e-8); for the fisheye the value at the pixel's centre times
/// its area, 0 outside the disc (the sum is 2 pi within 0.3 % from N = 64 on,
/// the staircase of the rim).
/// Throws as direction_of_pixel.
double pixel_solid_angle_sr(const MapProjection& projection, int size, int x, int y);

}  // namespace twilight
