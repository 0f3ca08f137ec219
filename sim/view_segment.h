// The far end of a straight view over a spherical Earth.
#pragma once

#include "sim/sky.h"

namespace twilight {

/// What an observer at the end of a view's path would say of the same line and the same Sun.
struct ViewSegment {
  double length_km = 0.0;          ///< the distance, or less where the ground is nearer
  double altitude_km = 0.0;        ///< of the end, >= 0
  double sun_elevation_rad = 0.0;  ///< geometric, there
  ViewDirection view;              ///< onwards along the line, in the end's own frame
};

/// From altitude_km (>= 0) under a Sun of sun_elevation_rad along `view` over distance_km (>= 0,
/// finite). Exact but for rounding. Throws std::invalid_argument for a distance out of range.
ViewSegment view_segment(double earth_radius_km, double altitude_km, double sun_elevation_rad,
                         const ViewDirection& view, double distance_km);

}  // namespace twilight
