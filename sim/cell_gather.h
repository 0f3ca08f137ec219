// The paper's gather: radiance summed over the cells of each direction (Sec. 4.7).
#pragma once

#include <cstddef>
#include <vector>

#include "sim/cell_grid.h"
#include "sim/exchange.h"
#include "sim/view_ray.h"

namespace twilight {

/// Sums, for every direction of the cells, the radiance scattered by all shells
/// (active ones and the passive ones between) towards the observer, attenuated
/// on the way (Eq. 4); other directions are interpolated linearly, as the paper does.
class CellGather {
 public:
  /// Evaluates every direction of the grid at once on the current oneTBB arena. all_cells
  /// is the grid with every shell active.
  CellGather(const GatherInputs& inputs, const CellGrid& all_cells);

  /// Radiance per unit solar irradiance, sr^-1, [lane]; linear in elevation and azimuth between
  /// the cells' directions, constant beyond the first and last elevation.
  void radiance(double elevation_rad, double relative_azimuth_rad, float* out) const;

 private:
  std::size_t lanes_;
  int divisions_, rows_;
  double first_elevation_rad_, step_rad_;
  std::vector<float> table_;  // [row][node][lane]
};

}  // namespace twilight
