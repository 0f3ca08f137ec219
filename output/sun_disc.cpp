#include "output/sun_disc.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

namespace twilight {
namespace {

using std::numbers::pi;
using Vector = std::array<double, 3>;  // east, north, up

Vector unit_vector(MapDirection d) {
  const double c = std::cos(d.elevation_rad);
  return {c * std::sin(d.azimuth_rad), c * std::cos(d.azimuth_rad), std::sin(d.elevation_rad)};
}

// From here on a pixel is at most a third of the disc wide.
constexpr int kSmallPixelSize = 1024;

double distance(const Vector& a, const Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// The pixel a direction falls on. A direction inside the fisheye's disc may
/// fall on a pixel whose centre is outside; it then counts for the next pixel inwards.
std::optional<std::array<int, 2>> pixel_under(const MapProjection& projection, int size,
                                              MapDirection direction) {
  const auto position = pixel_of_direction(projection, size, direction);
  if (!position) return std::nullopt;
  const int width = map_width(projection, size);
  const auto pixel = [&](MapPosition p) {
    return std::array<int, 2>{std::clamp(static_cast<int>(std::floor(p.x)), 0, width - 1),
                              std::clamp(static_cast<int>(std::floor(p.y)), 0, size - 1)};
  };
  auto found = pixel(*position);
  if (projection.kind == Projection::kFisheye &&
      !direction_of_pixel(projection, size, found[0], found[1])) {
    const double centre = 0.5 * size;
    const double dx = position->x - centre;
    const double dy = position->y - centre;
    const double shrink = std::max(0.0, 1.0 - std::numbers::sqrt2 / std::hypot(dx, dy));
    found = pixel({centre + shrink * dx, centre + shrink * dy});
  }
  return found;
}

}  // namespace

double sun_disc_solid_angle_sr() {
  const double s = std::sin(0.5 * kSunAngularRadius_rad);
  return 4.0 * pi * s * s;
}

std::unordered_map<std::size_t, double> sun_disc_coverage(const MapProjection& projection, int size,
                                                          MapDirection sun,
                                                          double horizon_elevation_rad) {
  const Vector axis = unit_vector(sun);
  const double sin_el = std::sin(sun.elevation_rad), cos_el = std::cos(sun.elevation_rad);
  const double sin_az = std::sin(sun.azimuth_rad), cos_az = std::cos(sun.azimuth_rad);
  const Vector right = {cos_az, -sin_az, 0.0};
  const Vector up = {-sin_el * sin_az, -sin_el * cos_az, cos_el};
  const auto width = static_cast<std::size_t>(map_width(projection, size));

  // A spiral of equal solid angles per point: even in every part of the disc.
  constexpr int kPoints = 1 << 18;
  constexpr double kGoldenAngle_rad = pi * (3.0 - 2.2360679774997896964);
  const double point_sr = sun_disc_solid_angle_sr() / kPoints;
  const double sin_half_radius = std::sin(0.5 * kSunAngularRadius_rad);
  std::map<std::size_t, double> covered_sr;  // ordered: sums do not depend on hashing
  double visible_sr = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const double off_axis = 2.0 * std::asin(sin_half_radius * std::sqrt((i + 0.5) / kPoints));
    const double turn = i * kGoldenAngle_rad;
    const double a = std::sin(off_axis) * std::cos(turn);
    const double b = std::sin(off_axis) * std::sin(turn);
    const double c = std::cos(off_axis);
    Vector p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = a * right[k] + b * up[k] + c * axis[k];
    const MapDirection direction = {std::atan2(p[2], std::hypot(p[0], p[1])),
                                    std::atan2(p[0], p[1])};
    if (direction.elevation_rad < horizon_elevation_rad) continue;
    const auto pixel = pixel_under(projection, size, direction);
    if (!pixel) continue;
    visible_sr += point_sr;
    covered_sr[static_cast<std::size_t>((*pixel)[1]) * width +
               static_cast<std::size_t>((*pixel)[0])] += point_sr;
  }

  if (covered_sr.empty()) return {};

  // Counting points is exact for large pixels and grainy for small ones. There,
  // each pixel is asked instead; around the zenith of a lat-long map, where
  // pixels shrink to nothing, also those that no point fell on.
  const bool small_pixels = size >= kSmallPixelSize;
  if (small_pixels && projection.kind == Projection::kLatLong &&
      std::abs(sun.elevation_rad) > 0.5 * pi - 10.0 * kSunAngularRadius_rad) {
    const std::size_t first_row = covered_sr.begin()->first / width;
    const std::size_t last_row = covered_sr.rbegin()->first / width;
    for (std::size_t i = first_row * width; i < (last_row + 1) * width; ++i) covered_sr[i];
  }
  const double chord = 2.0 * sin_half_radius;
  const auto is_sun = [&](double x, double y) {
    const auto direction = direction_at(projection, size, {x, y});
    return direction && direction->elevation_rad >= horizon_elevation_rad &&
           distance(unit_vector(*direction), axis) <= chord;
  };
  std::unordered_map<std::size_t, double> fraction;
  std::map<std::size_t, double> rim_fraction;
  double inside_sr = 0.0;
  double rim_sr = 0.0;
  for (const auto& [index, sr] : covered_sr) {
    const int x = static_cast<int>(index % width);
    const int y = static_cast<int>(index / width);
    const double pixel_sr = pixel_solid_angle_sr(projection, size, x, y);
    if (is_sun(x, y) && is_sun(x + 1, y) && is_sun(x, y + 1) && is_sun(x + 1, y + 1)) {
      inside_sr += pixel_sr;
      fraction[index] = 1.0;
      continue;
    }
    double covered = sr / pixel_sr;
    if (small_pixels) {
      constexpr int kSubdivisions = 8;
      int hits = 0;
      for (int j = 0; j < kSubdivisions; ++j) {
        for (int i = 0; i < kSubdivisions; ++i) {
          hits += is_sun(x + (i + 0.5) / kSubdivisions, y + (j + 0.5) / kSubdivisions) ? 1 : 0;
        }
      }
      covered = static_cast<double>(hits) / (kSubdivisions * kSubdivisions);
    }
    if (covered == 0.0) continue;
    rim_fraction[index] = std::min(1.0, covered);
    rim_sr += rim_fraction[index] * pixel_sr;
  }
  // The rim takes up what the counts leave over: the sum is exact.
  if (rim_sr > 0.0) {
    const double scale = std::max(0.0, (visible_sr - inside_sr) / rim_sr);
    for (const auto& [index, value] : rim_fraction) fraction[index] = scale * value;
  }
  return fraction;
}

}  // namespace twilight
