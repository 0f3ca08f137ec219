#include "sim/first_event.h"

#include <oneapi/tbb/parallel_for.h>

#include <cmath>
#include <numbers>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
std::size_t idx(int i) { return static_cast<std::size_t>(i); }

}  // namespace

FirstEvent first_event(const Medium& medium, const CellGrid& grid, std::size_t n_rings,
                       const DirectSunlight& sunlight, const SunGeometry& sun,
                       const ExchangeOptics& optics, bool separate_aerosol,
                       std::span<const float> ground_albedo, int nm) {
  const int S = grid.azimuth_divisions();
  const int nodes = S / 2 + 1;
  const std::size_t L = optics.lanes, W = medium.wavelengths();
  const auto& rings = grid.rings();
  const std::size_t n_air = std::min(n_rings, grid.air_rings());
  const bool means = grid.options().cell_means;
  const double R = medium.earth_radius_km, h0 = grid.options().observer_height_km;
  const double cos_e = std::cos(sun.elevation_rad), sin_e = std::sin(sun.elevation_rad);

  FirstEvent result;
  result.source.assign(n_rings * idx(nodes) * idx(nm) * L, 0.0F);
  result.aerosol_power.assign(separate_aerosol ? n_air * idx(nodes) * L : 0, 0.0F);
  result.lit.assign(n_air * idx(nodes), 0);
  result.asymmetry.assign(n_air * L, 0.0F);

  tbb::parallel_for(std::size_t{0}, n_rings, [&](std::size_t i) {
    const CellRing& ring = rings[i];
    std::vector<CellSample> samples;
    if (ring.ground || !means) {
      samples = {{ring.rho_km, ring.z_km, ring.altitude_km, ring.layer, ring.volume_km3}};
    } else {
      samples = grid.samples(ring, medium);
    }
    std::vector<float> depth(L), scattering(L, 0.0F), forward(L, 0.0F);
    if (!ring.ground) {
      for (const auto& [layer, volume] : ring.layer_volume_km3) {
        for (std::size_t w = 0; w < W; ++w) {
          const std::size_t at = idx(layer) * L + w;
          scattering[w] += static_cast<float>(volume) * optics.aerosol[at];
          forward[w] += static_cast<float>(volume) * optics.aerosol[at] * optics.asymmetry[at];
        }
      }
      for (std::size_t w = 0; w < W; ++w) {
        result.asymmetry[i * L + w] = scattering[w] > 0 ? forward[w] / scattering[w] : 0.0F;
      }
    }
    for (int j = 0; j < nodes; ++j) {
      const double phi = 2 * kPi * j / S;
      // Direction of travel of the sunlight in the cell's frame.
      const double sr = -cos_e * std::cos(phi), sa = cos_e * std::sin(phi), sz = -sin_e;
      float* q = &result.source[(i * idx(nodes) + idx(j)) * idx(nm) * L];
      for (const auto& p : samples) {
        const double cos_z = cos_solar_zenith(sun, R, h0, p.rho_km, phi, p.z_km);
        if (!sunlight.attenuation(p.altitude_km, std::acos(cos_z), depth.data())) continue;
        const auto size = static_cast<float>(p.volume_km3);
        if (ring.ground) {
          if (cos_z <= 0) continue;
          for (std::size_t w = 0; w < W; ++w) {
            q[w] += ground_albedo[w] * size * static_cast<float>(cos_z) * std::exp(-depth[w]);
          }
          continue;
        }
        result.lit[i * idx(nodes) + idx(j)] = 1;
        const std::size_t layer = idx(p.layer) * L;
        for (std::size_t w = 0; w < W; ++w) {
          const float e = size * std::exp(-depth[w]);
          float c0 = optics.s0[layer + w], c1 = optics.s1[layer + w], c2 = optics.s2[layer + w];
          if (separate_aerosol) {
            result.aerosol_power[(i * idx(nodes) + idx(j)) * L + w] +=
                e * optics.aerosol[layer + w];
            c0 = optics.air[layer + w];
            c1 = 0;
            c2 = 7.5F * c0 * optics.rayleigh_x2[w];
          }
          q[kJ * L + w] += e * c0;
          if (nm == 1) continue;
          q[kFr * L + w] += e * c1 * static_cast<float>(sr);
          q[kFa * L + w] += e * c1 * static_cast<float>(sa);
          q[kFz * L + w] += e * c1 * static_cast<float>(sz);
          q[kSrr * L + w] += e * c2 * static_cast<float>(sr * sr - 1.0 / 3);
          q[kSzz * L + w] += e * c2 * static_cast<float>(sz * sz - 1.0 / 3);
          q[kSrz * L + w] += e * c2 * static_cast<float>(sr * sz);
          q[kSra * L + w] += e * c2 * static_cast<float>(sr * sa);
          q[kSaz * L + w] += e * c2 * static_cast<float>(sa * sz);
        }
      }
    }
  });

  result.power.assign(W, 0.0);
  for (std::size_t i = 0; i < n_air; ++i) {
    for (int j = 0; j < nodes; ++j) {
      const double twice = j == 0 || 2 * j == S ? 1.0 : 2.0;
      const std::size_t at = i * idx(nodes) + idx(j);
      for (std::size_t w = 0; w < W; ++w) {
        double p = static_cast<double>(result.source[at * idx(nm) * L + w]);
        if (separate_aerosol) p += static_cast<double>(result.aerosol_power[at * L + w]);
        result.power[w] += twice * p;
      }
    }
  }
  return result;
}

}  // namespace twilight
