#include "sim/exchange_rings.h"

#include <algorithm>
#include <cmath>

namespace twilight {
namespace {

std::size_t idx(int i) { return static_cast<std::size_t>(i); }

}  // namespace

ExchangeRings::ExchangeRings(const Medium& medium, const CellGrid& cells,
                             const ExchangeOptics& cell_optics,
                             std::span<const float> ground_albedo)
    : grid(cells),
      optics(cell_optics),
      all(cells.rings()),
      ground(std::ranges::any_of(ground_albedo, [](float a) { return a > 0; })),
      means(cells.options().cell_means),
      S(cells.azimuth_divisions()),
      nodes(S / 2 + 1),
      L(cell_optics.lanes),
      W(medium.wavelengths()),
      n_air(cells.air_rings()),
      n_all(ground ? all.size() : n_air),
      transport(make_exchange_medium(medium, L, cell_optics.extinction)) {
  integrate_optics();
  place_points();
}

// Optical properties of every ring's cell.
void ExchangeRings::integrate_optics() {
  for (auto* v : {&ro.s0, &ro.s1, &ro.s2, &ro.extinction, &ro.half_depth, &ro.self}) {
    v->assign(all.size() * L, 0.0F);
  }
  ro.own_share.assign(all.size() * L, 1.0F);
  ro.ground_scale.assign(all.size() * L, 1.0F);
  ro.escape.assign(all.size() * W, 0.0);
  ro.ground.assign(all.size() * W, 0.0);
  for (std::size_t i = 0; i < n_air; ++i) {
    for (const auto& [layer, volume] : all[i].layer_volume_km3) {
      for (std::size_t w = 0; w < W; ++w) {
        const std::size_t at = idx(layer) * L + w;
        const auto v = static_cast<float>(volume);
        ro.s0[i * L + w] += v * optics.s0[at];
        ro.s1[i * L + w] += v * optics.s1[at];
        ro.s2[i * L + w] += v * optics.s2[at];
        ro.extinction[i * L + w] += v * static_cast<float>(optics.extinction(idx(layer), w));
      }
    }
    for (std::size_t w = 0; w < W; ++w) {
      const double mean = ro.extinction[i * L + w] / all[i].volume_km3;
      const double x = mean * all[i].half_chord_km;
      ro.half_depth[i * L + w] = static_cast<float>(x);
      ro.own_share[i * L + w] =
          static_cast<float>(x > 1e-6 ? -std::expm1(-2 * x) / (2 * x) : 1.0 - x);
    }
  }
}

void ExchangeRings::place_points() {
  points.resize(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const CellRing& ring = all[i];
    RingPoint& p = points[i];
    p.rho_km = ring.rho_km;
    p.z_km = ring.z_km;
    p.altitude_km = ring.altitude_km;
    p.layer = ring.layer;
    p.ground = ring.ground;
    p.normal_r = ring.slope_r;
    p.normal_z = ring.slope_z;
    p.half_depth = &ro.half_depth[i * L];
    if (means) {
      p.axis_r = ring.ground ? ring.slope_z : std::cos(ring.elevation_rad);
      p.axis_z = ring.ground ? -ring.slope_r : std::sin(ring.elevation_rad);
      p.variance_radial_km2 = ring.radial_km * ring.radial_km / 12;
      p.variance_azimuthal_km2 = ring.azimuthal_km * ring.azimuthal_km / 12;
      p.variance_third_km2 = ring.third_km * ring.third_km / 12;
    } else if (!ring.ground) {
      // The paper's solid angle of a disc of area V^(2/3), (1 - cos atan(a/d))/2, saturates
      // like a^2/(4 d^2 + 3 a^2); half of it from either cell.
      p.blur_km2 = 0.12 * std::pow(ring.volume_km3, 2.0 / 3);
    }
  }
}

}  // namespace twilight
