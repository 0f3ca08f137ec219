#include "output/projection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

using std::numbers::pi;

constexpr int kLargestSize = 16384;

void check_size(int size) {
  if (size < 1 || size > kLargestSize) {
    throw std::invalid_argument("map size is " + std::to_string(size) +
                                " pixels; it must be in 1..16384");
  }
}

void check_camera(const MapProjection& projection) {
  if (projection.kind != Projection::kCamera) return;
  const CameraView& c = projection.camera;
  const auto refuse = [](const char* name, double value, const char* range) {
    throw std::invalid_argument("camera " + std::string(name) + " is " + std::to_string(value) +
                                "; it must be " + range);
  };
  if (!std::isfinite(c.azimuth_rad)) refuse("azimuth_rad", c.azimuth_rad, "finite");
  if (!(std::abs(c.elevation_rad) <= 0.5 * pi)) {
    refuse("elevation_rad", c.elevation_rad, "in -pi/2..pi/2");
  }
  if (!(c.field_of_view_rad > 0.0 && c.field_of_view_rad < pi)) {
    refuse("field_of_view_rad", c.field_of_view_rad, "above 0 and below pi");
  }
  if (!(c.aspect_ratio >= 0.2 && c.aspect_ratio <= 5.0)) {
    refuse("aspect_ratio", c.aspect_ratio, "in 0.2..5");
  }
}

void check_pixel(const MapProjection& projection, int size, int x, int y) {
  const int width = map_width(projection, size);
  const int height = map_height(projection, size);
  if (x < 0 || x >= width || y < 0 || y >= height) {
    throw std::invalid_argument("pixel is (" + std::to_string(x) + ", " + std::to_string(y) +
                                "); it must be in 0.." + std::to_string(width - 1) + ", 0.." +
                                std::to_string(height - 1));
  }
}

double wrapped_azimuth_rad(double azimuth_rad) {
  double wrapped = std::fmod(azimuth_rad, 2.0 * pi);
  if (wrapped < 0.0) wrapped += 2.0 * pi;
  return wrapped < 2.0 * pi ? wrapped : 0.0;
}

/// Azimuth of a point to the right by u and down by v of a zenith that has
/// north above it and east to its left.
double azimuth_from_zenith_rad(double u, double v) {
  return u == 0.0 && v == 0.0 ? 0.0 : wrapped_azimuth_rad(std::atan2(-u, -v));
}

// Clarberg (2008) made of its two equal-area steps. Sphere -> disc (Lambert):
// rho^2 = 1 - |sin e|, so that the hemisphere fills the unit disc. Disc ->
// diamond |u|+|v| <= 1: rho = |u|+|v|, and the angle within a quadrant grows
// evenly along the diamond's side. The lower hemisphere is the same diamond,
// folded outwards over its sides into the corners of the square.

MapDirection octahedral_direction(double u, double v) {
  const double distance = std::abs(u) + std::abs(v);
  const bool lower = distance > 1.0;
  double a = std::abs(u);
  double b = std::abs(v);
  if (lower) {
    const double a_outside = a;
    a = 1.0 - b;
    b = 1.0 - a_outside;
  }
  const double rho = a + b;
  const double quadrant_angle = rho > 0.0 ? 0.5 * pi * b / rho : 0.0;
  // sin e = 1 - rho^2 loses digits near the zenith; 2 asin keeps them.
  const double zenith_angle = 2.0 * std::asin(std::min(1.0, rho * std::sqrt(0.5)));
  const double elevation = 0.5 * pi - zenith_angle;
  const double east_west = std::copysign(std::cos(quadrant_angle), u);
  const double north_south = std::copysign(std::sin(quadrant_angle), v);
  const double azimuth = rho > 0.0 ? azimuth_from_zenith_rad(east_west, north_south) : 0.0;
  return {lower ? -elevation : elevation, azimuth};
}

// A camera's axes: east, north, up.
using Vector = std::array<double, 3>;
struct CameraAxes {
  Vector forward, right, up;
};

CameraAxes axes_of(const CameraView& c) {
  const double ce = std::cos(c.elevation_rad), se = std::sin(c.elevation_rad);
  const double ca = std::cos(c.azimuth_rad), sa = std::sin(c.azimuth_rad);
  return {{ce * sa, ce * ca, se}, {ca, -sa, 0.0}, {-se * sa, -se * ca, ce}};
}

// Half a frame's width and height at unit distance.
MapPosition half_frame(const MapProjection& projection, int size) {
  const double half = std::tan(0.5 * projection.camera.field_of_view_rad);
  return {half * map_width(projection, size) / size, half};
}

// u to the right and v up, at unit distance before the camera.
MapDirection camera_direction(const CameraView& camera, double u, double v) {
  const CameraAxes axes = axes_of(camera);
  Vector d;
  for (std::size_t k = 0; k < 3; ++k) {
    d[k] = axes.forward[k] + u * axes.right[k] + v * axes.up[k];
  }
  return {std::atan2(d[2], std::hypot(d[0], d[1])), wrapped_azimuth_rad(std::atan2(d[0], d[1]))};
}

std::optional<MapPosition> camera_position(const MapProjection& projection, int size,
                                           MapDirection direction) {
  const CameraAxes axes = axes_of(projection.camera);
  const double c = std::cos(direction.elevation_rad);
  const Vector d = {c * std::sin(direction.azimuth_rad), c * std::cos(direction.azimuth_rad),
                    std::sin(direction.elevation_rad)};
  double forward = 0, right = 0, up = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    forward += d[k] * axes.forward[k];
    right += d[k] * axes.right[k];
    up += d[k] * axes.up[k];
  }
  if (!(forward > 0.0)) return std::nullopt;
  const MapPosition half = half_frame(projection, size);
  const double u = right / forward / half.x, v = up / forward / half.y;
  if (std::abs(u) > 1.0 || std::abs(v) > 1.0) return std::nullopt;
  return MapPosition{0.5 * (1.0 + u) * map_width(projection, size), 0.5 * (1.0 - v) * size};
}

// Of the rectangle from the axis to (u, v) at unit distance; odd in both.
double corner_solid_angle_sr(double u, double v) {
  return std::atan(u * v / std::sqrt(1.0 + u * u + v * v));
}

MapPosition octahedral_square(MapDirection direction) {
  const double zenith_angle = 0.5 * pi - std::abs(direction.elevation_rad);
  const double rho = std::numbers::sqrt2 * std::sin(0.5 * zenith_angle);
  const double right = -std::sin(direction.azimuth_rad);
  const double down = -std::cos(direction.azimuth_rad);
  const double share = std::atan2(std::abs(down), std::abs(right)) / (0.5 * pi);
  double a = rho * (1.0 - share);
  double b = rho * share;
  if (direction.elevation_rad < 0.0) {
    const double a_inside = a;
    a = 1.0 - b;
    b = 1.0 - a_inside;
  }
  return {std::copysign(a, right), std::copysign(b, down)};
}

}  // namespace

Projection projection_from_name(std::string_view name) {
  if (name == "fisheye") return Projection::kFisheye;
  if (name == "latlong") return Projection::kLatLong;
  if (name == "octahedral") return Projection::kOctahedral;
  if (name == "camera") return Projection::kCamera;
  throw std::invalid_argument(
      "projection is \"" + std::string(name) +
      "\"; it must be \"fisheye\", \"latlong\", \"octahedral\" or \"camera\"");
}

std::string_view projection_name(Projection projection) {
  switch (projection) {
    case Projection::kFisheye:
      return "fisheye";
    case Projection::kLatLong:
      return "latlong";
    case Projection::kOctahedral:
      return "octahedral";
    case Projection::kCamera:
      return "camera";
  }
  throw std::invalid_argument("unknown projection");
}

int map_width(const MapProjection& projection, int size) {
  check_size(size);
  check_camera(projection);
  if (projection.kind == Projection::kCamera) {
    return std::max(1, static_cast<int>(std::lround(projection.camera.aspect_ratio * size)));
  }
  return projection.kind == Projection::kLatLong ? 2 * size : size;
}

int map_height(const MapProjection&, int size) {
  check_size(size);
  return size;
}

std::optional<MapDirection> direction_at(const MapProjection& projection, int size,
                                         MapPosition position) {
  const double width = map_width(projection, size);
  const double height = map_height(projection, size);
  if (!(position.x >= 0.0 && position.x <= width && position.y >= 0.0 && position.y <= height)) {
    throw std::invalid_argument("position is (" + std::to_string(position.x) + ", " +
                                std::to_string(position.y) + ") pixels; it must be in 0.." +
                                std::to_string(width) + ", 0.." + std::to_string(height));
  }
  if (projection.kind == Projection::kLatLong) {
    return MapDirection{(0.5 - position.y / height) * pi,
                        wrapped_azimuth_rad(2.0 * pi * position.x / width)};
  }
  const double u = 2.0 * position.x / width - 1.0;
  const double v = 2.0 * position.y / height - 1.0;
  if (projection.kind == Projection::kOctahedral) return octahedral_direction(u, v);
  if (projection.kind == Projection::kCamera) {
    const MapPosition half = half_frame(projection, size);
    return camera_direction(projection.camera, u * half.x, -v * half.y);
  }
  const double r = std::hypot(u, v);
  if (r > 1.0) return std::nullopt;
  return MapDirection{0.5 * pi * (1.0 - r), azimuth_from_zenith_rad(u, v)};
}

std::optional<MapDirection> direction_of_pixel(const MapProjection& projection, int size, int x,
                                               int y) {
  check_pixel(projection, size, x, y);
  return direction_at(projection, size, {x + 0.5, y + 0.5});
}

std::optional<MapPosition> pixel_of_direction(const MapProjection& projection, int size,
                                              MapDirection direction) {
  const double width = map_width(projection, size);
  const double height = map_height(projection, size);
  if (!(std::abs(direction.elevation_rad) <= 0.5 * pi)) {
    throw std::invalid_argument("elevation_rad is " + std::to_string(direction.elevation_rad) +
                                "; it must be in -pi/2..pi/2");
  }
  if (!std::isfinite(direction.azimuth_rad)) {
    throw std::invalid_argument("azimuth_rad is " + std::to_string(direction.azimuth_rad) +
                                "; it must be finite");
  }
  if (projection.kind == Projection::kLatLong) {
    return MapPosition{wrapped_azimuth_rad(direction.azimuth_rad) / (2.0 * pi) * width,
                       (0.5 - direction.elevation_rad / pi) * height};
  }
  if (projection.kind == Projection::kCamera) return camera_position(projection, size, direction);
  MapPosition uv;
  if (projection.kind == Projection::kOctahedral) {
    uv = octahedral_square(direction);
  } else {
    if (direction.elevation_rad < 0.0) return std::nullopt;
    const double r = 1.0 - direction.elevation_rad / (0.5 * pi);
    uv = {-r * std::sin(direction.azimuth_rad), -r * std::cos(direction.azimuth_rad)};
  }
  return MapPosition{0.5 * (uv.x + 1.0) * width, 0.5 * (uv.y + 1.0) * height};
}

double pixel_solid_angle_sr(const MapProjection& projection, int size, int x, int y) {
  check_pixel(projection, size, x, y);
  const double pixels_down = size;
  switch (projection.kind) {
    case Projection::kLatLong: {
      // sin a - sin b as a product: no cancellation near the poles.
      const double middle_rad = (0.5 - (y + 0.5) / pixels_down) * pi;
      const double band = 2.0 * std::cos(middle_rad) * std::sin(0.5 * pi / pixels_down);
      return band * pi / pixels_down;
    }
    case Projection::kOctahedral:
      return 4.0 * pi / (pixels_down * pixels_down);
    case Projection::kFisheye: {
      const double u = 2.0 * (x + 0.5) / pixels_down - 1.0;
      const double v = 2.0 * (y + 0.5) / pixels_down - 1.0;
      const double r = std::hypot(u, v);
      if (r > 1.0) return 0.0;
      const double zenith_angle = 0.5 * pi * r;
      const double density =
          0.25 * pi * pi * (zenith_angle > 0.0 ? std::sin(zenith_angle) / zenith_angle : 1.0);
      return density * 4.0 / (pixels_down * pixels_down);
    }
    case Projection::kCamera: {
      const MapPosition half = half_frame(projection, size);
      const double pixel = 2.0 * half.y / pixels_down;
      const double u0 = x * pixel - half.x, u1 = (x + 1) * pixel - half.x;
      const double v0 = y * pixel - half.y, v1 = (y + 1) * pixel - half.y;
      return corner_solid_angle_sr(u1, v1) - corner_solid_angle_sr(u0, v1) -
             corner_solid_angle_sr(u1, v0) + corner_solid_angle_sr(u0, v0);
    }
  }
  throw std::invalid_argument("unknown projection");
}

}  // namespace twilight
