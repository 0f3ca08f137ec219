#include "sim/view_segment.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace twilight {

ViewSegment view_segment(double earth_radius_km, double altitude_km, double sun_elevation_rad,
                         const ViewDirection& view, double distance_km) {
  if (!(distance_km >= 0) || !std::isfinite(distance_km)) {
    throw std::invalid_argument("the distance along a view must be finite and at least 0 km");
  }
  const double r = earth_radius_km + altitude_km;
  const double sine = std::sin(view.elevation_rad), cosine = std::cos(view.elevation_rad);
  ViewSegment end;
  end.length_km = distance_km;
  // Where the line meets the ground: d = -r sin - sqrt(R^2 - r^2 cos^2), written without
  // cancellation for an observer close to it.
  const double root = earth_radius_km * earth_radius_km - r * r * cosine * cosine;
  if (sine < 0 && root >= 0) {
    const double ground_km = altitude_km * (r + earth_radius_km) / (-r * sine + std::sqrt(root));
    end.length_km = std::min(distance_km, ground_km);
  }
  const double d = end.length_km;
  const double up = d * (2 * r * sine + d);  // r1^2 - r^2
  end.altitude_km = std::max(0.0, altitude_km + up / (std::sqrt(std::max(0.0, r * r + up)) + r));
  const double angle = std::atan2(d * cosine, r + d * sine);  // at the Earth's centre
  const double sun_sine = std::sin(sun_elevation_rad), sun_cosine = std::cos(sun_elevation_rad);
  const double towards = std::cos(view.relative_azimuth_rad);
  const double sun_up =
      std::clamp(std::cos(angle) * sun_sine + std::sin(angle) * towards * sun_cosine, -1.0, 1.0);
  end.sun_elevation_rad = std::asin(sun_up);
  end.view.elevation_rad = view.elevation_rad + angle;
  // The Sun's horizontal direction there, along the line's own and across it.
  const double along = std::cos(angle) * towards * sun_cosine - std::sin(angle) * sun_sine;
  const double across = std::sin(view.relative_azimuth_rad) * sun_cosine;
  end.view.relative_azimuth_rad =
      along == 0 && across == 0 ? view.relative_azimuth_rad : std::atan2(across, along);
  return end;
}

}  // namespace twilight
