// The half sphere of the sky as a few views with their solid angles.
#pragma once

#include <span>
#include <vector>

#include "sim/sky.h"

namespace twilight {

/// A view and the solid angle it stands for, sr, its mirror image beyond the Sun's vertical plane
/// included.
struct WeightedView {
  ViewDirection direction;
  double solid_angle_sr = 0.0;
};

/// The sky above sin(elevation) = 0.01 (0.57 degrees; 99 % of the hemisphere's solid angle): 12
/// Gauss-Legendre points in sin(elevation), from 1.1 degrees up, times 8 midpoints in azimuth over
/// half a turn from the Sun. Sums of even functions of azimuth; solid angles add to 2 pi 0.99.
std::vector<WeightedView> hemisphere_views();

/// A value at every view, with the share of the sky it has.
struct WeightedValue {
  double value = 0.0, weight = 0.0;
};

/// Weighted mean, the value that 95 % of the weight does not exceed, and the largest. Throws
/// std::invalid_argument unless there are values, all finite, with weights >= 0 that add to more
/// than 0.
struct Spread {
  double mean = 0.0, p95 = 0.0, largest = 0.0;
};
Spread spread_of(std::span<const WeightedValue> values);

}  // namespace twilight
