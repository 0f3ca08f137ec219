// Straight lines through spherical layers.
#pragma once

#include <span>

#include "atmosphere/medium.h"

namespace twilight {

/// Lengths in each layer of the straight segment that starts at altitude_km (>= 0) under zenith_rad
/// (0..pi) and is distance_km long (>= 0, infinity allowed): path_km, size medium.layers().
/// Returns whether the segment stays clear of the ground; otherwise path_km holds the part before
/// it. Exact but for rounding (relative 1e-13), altitudes to 500 km and radii to 70000 km included.
/// Throws std::invalid_argument for values out of range.
bool straight_path(const Medium& medium, double altitude_km, double zenith_rad, double distance_km,
                   std::span<double> path_km);

}  // namespace twilight
