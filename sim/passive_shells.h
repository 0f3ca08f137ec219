// Shells that exchange no light: what active ones say about them (Haber et al. 2005, Sec. 5).
#pragma once

#include <cstddef>
#include <vector>

#include "sim/cell_grid.h"

namespace twilight {

/// The active rings between which a ring of any shell is interpolated.
struct PassiveRing {
  std::size_t ring[2] = {0, 0};
  double weight[2] = {0, 0};
};

/// One for each air ring of `all`, the grid with every shell active: linear in the distance from
/// the observer between active rings of its own elevation.
std::vector<PassiveRing> passive_rings(const CellGrid& active, const CellGrid& all);

}  // namespace twilight
