// The Sun's disc seen edge on: how its light spreads over solar zenith angles.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/gauss_legendre.h"

namespace twilight {

/// The disc as strips of equal zenith angle: x in solar radii, -1..1, and the share of the disc's
/// light, which sums to 1.
std::vector<GaussNode> disc_strips(double wavelength_nm, int strips);

/// Averages a quantity given for a point Sun over the limb-darkened disc: every value on the fine
/// zenith scale of ZenithGrid becomes the mean over the disc's strips of equal zenith angle,
/// weighted with their light (solar/limb_darkening.h). The curvature of the strips is left out
/// (2e-5).
class DiscAverage {
 public:
  DiscAverage(std::span<const double> wavelength_nm, double sun_distance_au, std::size_t lanes);
  /// value[fine][lane], lit below fine point `end`; beyond 180 degrees it is mirrored.
  void operator()(std::size_t end, std::span<float> value) const;

 private:
  std::size_t lanes_;
  int reach_;                  // fine steps to either side
  std::vector<float> weight_;  // [fine step][lane]
};

}  // namespace twilight
