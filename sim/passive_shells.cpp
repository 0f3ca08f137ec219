#include "sim/passive_shells.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
std::size_t idx(int i) { return static_cast<std::size_t>(i); }

}  // namespace

std::vector<PassiveRing> passive_rings(const CellGrid& active, const CellGrid& all) {
  const double half_step = kPi / active.azimuth_divisions();
  const auto& shells = active.shells();
  const auto& rings = active.rings();
  // Ring of an active shell at an elevation; npos where the shell has none there. Means of cells
  // that ground or top cut through stand closer than half a step: the nearest.
  constexpr auto npos = static_cast<std::size_t>(-1);
  const auto find = [&](const CellShell& shell, double elevation) {
    std::size_t nearest = npos;
    double least = half_step;
    for (std::size_t i = shell.first_ring; i < shell.first_ring + shell.rings; ++i) {
      const double away = std::abs(rings[i].elevation_rad - elevation);
      if (away >= least) continue;
      nearest = i;
      least = away;
    }
    return nearest;
  };
  std::vector<PassiveRing> result(all.air_rings());
  for (std::size_t i = 0; i < all.air_rings(); ++i) {
    const CellRing& ring = all.rings()[i];
    const double r = all.shells()[idx(ring.shell)].r_km;
    std::size_t hi = 0;
    while (hi < shells.size() && shells[hi].r_km < r) ++hi;
    const std::size_t lo = hi == 0 ? 0 : hi - 1;
    hi = std::min(hi, shells.size() - 1);
    const double span = shells[hi].r_km - shells[lo].r_km;
    const double t = span > 0 ? (r - shells[lo].r_km) / span : 0.0;
    const std::size_t a = find(shells[lo], ring.elevation_rad);
    const std::size_t b = find(shells[hi], ring.elevation_rad);
    PassiveRing& p = result[i];
    if (a != npos && b != npos) {
      p = {{a, b}, {1 - t, t}};
    } else if (a != npos || b != npos) {
      p = {{a != npos ? a : b, a != npos ? a : b}, {1.0, 0.0}};
    }
  }
  return result;
}

}  // namespace twilight
