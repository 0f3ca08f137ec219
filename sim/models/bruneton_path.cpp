#include "sim/models/bruneton_path.h"

#include <algorithm>
#include <cmath>

namespace twilight {

BrunetonPath bruneton_path(const BrunetonAir& air, double radius_km, const BrunetonRay& ray,
                           const std::vector<GaussNode>& rule) {
  BrunetonPath path;
  if (ray.distance_km <= 0) return path;
  const std::size_t W = air.wavelengths();
  const double r = radius_km, lowest = -r * ray.mu;
  const bool dips = !ray.ground && lowest > 0 && lowest < ray.distance_km;
  BrunetonAir::Columns columns;
  std::vector<double> depth(W, 0.0), rayleigh(W), mie(W);
  double before = 0;
  const auto add_depth = [&](double to) {
    air.columns(r, ray.mu, before, to, columns);
    for (std::size_t w = 0; w < W; ++w) depth[w] += columns.extinction[w];
    before = to;
  };
  const auto add_part = [&](double from, double to) {
    double cell = from;
    for (const GaussNode& g : rule) {
      const double d = from + g.x * (to - from), weight = g.weight * (to - from);
      const double radius = std::clamp(std::sqrt(std::max(0.0, d * d + 2 * r * ray.mu * d + r * r)),
                                       air.sphere().ground_radius_km, air.sphere().top_radius_km);
      add_depth(d);
      if (air.layered()) {
        air.columns(r, ray.mu, cell, cell + weight, columns);
        rayleigh = columns.rayleigh;
        mie = columns.mie;
        cell += weight;
      } else {
        air.scattering(radius, rayleigh, mie);
        for (std::size_t w = 0; w < W; ++w) {
          rayleigh[w] *= weight;
          mie[w] *= weight;
        }
      }
      path.distance_km.push_back(d);
      path.radius_km.push_back(radius);
      for (std::size_t w = 0; w < W; ++w) {
        const double transmittance = std::exp(-depth[w]);
        path.rayleigh.push_back(transmittance * rayleigh[w]);
        path.mie.push_back(transmittance * mie[w]);
      }
    }
  };
  if (dips) {
    add_part(0, lowest);
    add_part(lowest, ray.distance_km);
  } else {
    add_part(0, ray.distance_km);
  }
  return path;
}

}  // namespace twilight
