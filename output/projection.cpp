#include "output/projection.h"

#include <algorithm>
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

void check_pixel(Projection projection, int size, int x, int y) {
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
  throw std::invalid_argument("projection is \"" + std::string(name) +
                              "\"; it must be \"fisheye\", \"latlong\" or \"octahedral\"");
}

std::string_view projection_name(Projection projection) {
  switch (projection) {
    case Projection::kFisheye:
      return "fisheye";
    case Projection::kLatLong:
      return "latlong";
    case Projection::kOctahedral:
      return "octahedral";
  }
  throw std::invalid_argument("unknown projection");
}

int map_width(Projection projection, int size) {
  check_size(size);
  return projection == Projection::kLatLong ? 2 * size : size;
}

int map_height(Projection, int size) {
  check_size(size);
  return size;
}

std::optional<MapDirection> direction_at(Projection projection, int size, MapPosition position) {
  const double width = map_width(projection, size);
  const double height = map_height(projection, size);
  if (!(position.x >= 0.0 && position.x <= width && position.y >= 0.0 && position.y <= height)) {
    throw std::invalid_argument("position is (" + std::to_string(position.x) + ", " +
                                std::to_string(position.y) + ") pixels; it must be in 0.." +
                                std::to_string(width) + ", 0.." + std::to_string(height));
  }
  if (projection == Projection::kLatLong) {
    return MapDirection{(0.5 - position.y / height) * pi,
                        wrapped_azimuth_rad(2.0 * pi * position.x / width)};
  }
  const double u = 2.0 * position.x / width - 1.0;
  const double v = 2.0 * position.y / height - 1.0;
  if (projection == Projection::kOctahedral) return octahedral_direction(u, v);
  const double r = std::hypot(u, v);
  if (r > 1.0) return std::nullopt;
  return MapDirection{0.5 * pi * (1.0 - r), azimuth_from_zenith_rad(u, v)};
}

std::optional<MapDirection> direction_of_pixel(Projection projection, int size, int x, int y) {
  check_pixel(projection, size, x, y);
  return direction_at(projection, size, {x + 0.5, y + 0.5});
}

std::optional<MapPosition> pixel_of_direction(Projection projection, int size,
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
  if (projection == Projection::kLatLong) {
    return MapPosition{wrapped_azimuth_rad(direction.azimuth_rad) / (2.0 * pi) * width,
                       (0.5 - direction.elevation_rad / pi) * height};
  }
  MapPosition uv;
  if (projection == Projection::kOctahedral) {
    uv = octahedral_square(direction);
  } else {
    if (direction.elevation_rad < 0.0) return std::nullopt;
    const double r = 1.0 - direction.elevation_rad / (0.5 * pi);
    uv = {-r * std::sin(direction.azimuth_rad), -r * std::cos(direction.azimuth_rad)};
  }
  return MapPosition{0.5 * (uv.x + 1.0) * width, 0.5 * (uv.y + 1.0) * height};
}

double pixel_solid_angle_sr(Projection projection, int size, int x, int y) {
  check_pixel(projection, size, x, y);
  const double pixels_down = size;
  switch (projection) {
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
  }
  throw std::invalid_argument("unknown projection");
}

}  // namespace twilight
