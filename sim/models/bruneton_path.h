// Quadrature along one view of the tables of Bruneton & Neyret.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/gauss_legendre.h"
#include "sim/models/bruneton_air.h"

namespace twilight {

/// Nodes along a ray from a texel, split at its lowest point. Scattering is what a node stands for:
/// scattering coefficient times weight times the transmittance back to the start, [node][w].
struct BrunetonPath {
  std::vector<double> distance_km, radius_km;
  std::vector<double> rayleigh, mie;
  std::size_t nodes() const { return distance_km.size(); }
};

/// `rule` on [0, 1]. Layered air: every node stands for the whole of the scattering in its share of
/// the way, so that no layer is missed.
BrunetonPath bruneton_path(const BrunetonAir& air, double radius_km, const BrunetonRay& ray,
                           const std::vector<GaussNode>& rule);

}  // namespace twilight
