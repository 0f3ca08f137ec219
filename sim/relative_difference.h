// How far one sky is from another: the error that budgets and quality levels speak of.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/sky.h"

namespace twilight {

/// Views and the share of the sky that each stands for.
struct WeightedViews {
  std::vector<ViewDirection> views;
  std::vector<double> weight;  ///< adds up to 1
};

/// The hemisphere: Gauss nodes in the sine of the elevation, azimuths 0..pi (skies are mirror
/// symmetric), weights by solid angle. elevations >= 1, azimuths >= 2.
WeightedViews coarse_hemisphere(int elevations = 8, int azimuths = 6);

/// The given views, of equal weight.
WeightedViews listed_views(std::span<const ViewDirection> views);

struct RelativeDifference {
  double mean = 0, percentile_95 = 0, largest = 0;
};

/// Relative differences |L' - L| / L of radiance over the views: their weighted mean, 95th
/// percentile (the least value that at most 5 % of the weight exceeds) and largest, each at the
/// wavelength where it is largest. Radiances are [view][wavelength]; `solar_irradiance`, per
/// wavelength, is what they are measured in: a wavelength whose share of sunlight in a view is
/// below kFaint of the view's brightest counts as if it had that, for it adds nothing to what is
/// seen.
RelativeDifference relative_difference(const WeightedViews& views,
                                       std::span<const double> solar_irradiance,
                                       std::span<const double> truth,
                                       std::span<const double> radiance);

inline constexpr double kFaintShare = 1e-2;

}  // namespace twilight
