#include "atmosphere/straight_path.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <sstream>
#include <stdexcept>

namespace twilight {
namespace {

[[noreturn]] void fail(const char* quantity, double value, const char* allowed) {
  std::ostringstream s;
  s << quantity << " " << value << " must be " << allowed;
  throw std::invalid_argument(s.str());
}

}  // namespace

bool straight_path(const Medium& medium, double altitude_km, double zenith_rad, double distance_km,
                   std::span<double> path_km) {
  if (!(altitude_km >= 0.0 && std::isfinite(altitude_km))) {
    fail("altitude_km", altitude_km, "finite and at least 0");
  }
  if (!(zenith_rad >= 0.0 && zenith_rad <= std::numbers::pi)) {
    fail("zenith angle", zenith_rad, "0..pi rad");
  }
  if (!(distance_km >= 0.0)) fail("distance_km", distance_km, "at least 0");
  const std::size_t layers = medium.layers();
  if (path_km.size() != layers) {
    fail("size of path_km", static_cast<double>(path_km.size()), "the number of layers");
  }
  std::fill(path_km.begin(), path_km.end(), 0.0);

  const std::vector<double>& boundary = medium.boundary_km;
  const double r0 = medium.earth_radius_km + altitude_km;
  const double start_x = r0 * std::abs(std::cos(zenith_rad));  // distance from the perigee
  bool up = std::cos(zenith_rad) >= 0.0;
  // Squared distance from the perigee at a height.
  const auto x_squared = [&](double height_km) {
    return start_x * start_x +
           (height_km - altitude_km) * (height_km + altitude_km + 2.0 * medium.earth_radius_km);
  };
  double left_km = distance_km;
  double height_km = altitude_km;
  double x = start_x;
  std::size_t layer = 0;

  if (altitude_km >= boundary.back()) {
    if (up) return true;
    const double entry = x_squared(boundary.back());
    if (entry <= 0.0) return true;
    const double end = std::sqrt(entry);
    // x - end, without cancellation.
    left_km -= (altitude_km - boundary.back()) *
               (altitude_km + boundary.back() + 2.0 * medium.earth_radius_km) / (x + end);
    if (left_km <= 0.0) return true;
    x = end;
    height_km = boundary.back();
    layer = layers - 1;
  } else {
    const auto above = std::upper_bound(boundary.begin() + 1, boundary.end() - 1, altitude_km);
    layer = static_cast<std::size_t>(above - boundary.begin()) - 1;
    if (!up && altitude_km == boundary[layer]) {
      if (layer == 0) return distance_km == 0.0;
      --layer;
    }
  }

  for (;;) {
    const double end_height_km = boundary[up ? layer + 1 : layer];
    const double end_squared = x_squared(end_height_km);
    const bool turning = end_squared <= 0.0 && !up;
    const double end = end_squared > 0.0 ? std::sqrt(end_squared) : 0.0;
    double length_km = std::abs(x - end);
    if (!turning && x + end > 0.0) {
      length_km = std::abs(end_height_km - height_km) *
                  (end_height_km + height_km + 2.0 * medium.earth_radius_km) / (x + end);
    }
    // After the perigee x is 0 and height_km no longer known: the plain difference is exact.
    if (x == 0.0) length_km = end;
    if (length_km >= left_km) {
      path_km[layer] += left_km;
      return true;
    }
    path_km[layer] += length_km;
    left_km -= length_km;
    x = end;
    height_km = end_height_km;
    if (turning) {
      x = 0.0;
      up = true;
    } else if (up) {
      if (++layer == layers) return true;
    } else if (layer-- == 0) {
      return false;
    }
  }
}

}  // namespace twilight
