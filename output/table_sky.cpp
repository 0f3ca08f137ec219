#include "output/table_sky.h"

#include <OpenEXR/ImfPixelType.h>
#include <half.h>

#include <algorithm>
#include <cmath>

#include "aerosols/cornette_shanks.h"
#include "atmosphere/rayleigh.h"

namespace twilight {
namespace {

using Texel = std::array<double, 4>;

// Linear between texel centres, clamped to the edge.
Texel read(const Texture& t, double x, double y, double z, bool half) {
  struct Axis {
    std::size_t low, high;
    double share;
  };
  const auto axis = [](double at, std::size_t size) {
    const double u = std::clamp(at, 0.0, static_cast<double>(size - 1));
    const auto low = static_cast<std::size_t>(u);
    return Axis{low, std::min(low + 1, size - 1), u - static_cast<double>(low)};
  };
  const Axis ax = axis(x, t.width), ay = axis(y, t.height), az = axis(z, t.depth);
  Texel out{};
  const auto add = [&](std::size_t i, std::size_t j, std::size_t k, double weight) {
    if (weight == 0) return;
    const float* texel = t.at(i, j, k);
    for (std::size_t c = 0; c < 4; ++c) {
      out[c] += weight * static_cast<double>(half ? rounded_to_half(texel[c]) : texel[c]);
    }
  };
  for (const auto& [k, wz] : {std::pair(az.low, 1 - az.share), std::pair(az.high, az.share)}) {
    for (const auto& [j, wy] : {std::pair(ay.low, 1 - ay.share), std::pair(ay.high, ay.share)}) {
      add(ax.low, j, k, wz * wy * (1 - ax.share));
      add(ax.high, j, k, wz * wy * ax.share);
    }
  }
  return out;
}

}  // namespace

ChannelTriple look_up(const Texture& texture, TexelPoint at, bool half) {
  const Texel t = read(texture, at.x, at.y, 0, half);
  return {t[0], t[1], t[2]};
}

float rounded_to_half(float value) {
  constexpr float kMost = 65504.0F;
  return static_cast<float>(half(std::clamp(value, -kMost, kMost)));
}

TableSky::TableSky(const TableLayout& layout, const SkyTables& tables, bool half)
    : layout_(layout), tables_(tables), half_(half) {}

ChannelTriple TableSky::radiance(double r_km, double mu, double mu_s, double nu) const {
  const LayoutSizes& n = layout_.sizes();
  const bool ground = layout_.meets_ground(r_km, mu);
  const double z = layout_.scattering_r_texel(r_km);
  double y = layout_.scattering_mu_texel(r_km, mu, ground);
  // The halves of the mu axis do not mix.
  const double half = 0.5 * static_cast<double>(n.mu);
  y = ground ? std::clamp(y, 0.0, half - 1) : std::clamp(y, half, 2 * half - 1);
  const double sun =
      std::clamp(layout_.scattering_mu_s_texel(mu_s), 0.0, static_cast<double>(n.mu_s - 1));
  const double l = std::clamp(layout_.scattering_nu_texel(nu), 0.0, static_cast<double>(n.nu - 1));
  const double low = std::min(std::floor(l), static_cast<double>(n.nu - 2)), share = l - low;
  const auto suns = static_cast<double>(n.mu_s);
  const auto both = [&](const Texture& texture) {
    const Texel a = read(texture, low * suns + sun, y, z, half_);
    const Texel b = read(texture, (low + 1) * suns + sun, y, z, half_);
    Texel mixed{};
    for (std::size_t c = 0; c < 4; ++c) mixed[c] = std::lerp(a[c], b[c], share);
    return mixed;
  };
  const Texel star = both(tables_.scattering);
  const TableConstants& k = tables_.constants;
  ChannelTriple mie{};
  if (tables_.single_mie) {
    const Texel own = both(*tables_.single_mie);
    for (std::size_t c = 0; c < 3; ++c) mie[c] = own[c];
  } else if (star[0] > 0) {
    mie[0] = star[3];
    for (std::size_t c = 1; c < 3; ++c) {
      const double down = k.mie_per_km[0] * k.rayleigh_per_km[c];
      if (!(down > 0)) continue;
      mie[c] = star[c] * star[3] / star[0] * k.rayleigh_per_km[0] * k.mie_per_km[c] / down;
    }
  }
  Texel scale{};
  if (tables_.sun_scale) {
    const double at = sun / (suns - 1) * static_cast<double>(tables_.sun_scale->width - 1);
    scale = read(*tables_.sun_scale, at, 0, 0, half_);
  }
  const double rayleigh_phase = rayleigh_phase_per_sr(nu, 0.0);
  const double mie_phase = cornette_shanks(nu, k.mie_g);
  ChannelTriple out{};
  for (std::size_t c = 0; c < 3; ++c) {
    out[c] = (star[c] * rayleigh_phase + mie[c] * mie_phase) *
             (tables_.sun_scale ? std::exp(scale[c]) : 1.0);
  }
  return out;
}

ChannelTriple TableSky::transmittance(double r_km, double mu) const {
  return look_up(tables_.transmittance, layout_.transmittance_texel({r_km, mu}), half_);
}

ChannelTriple TableSky::irradiance(double r_km, double mu_s) const {
  return look_up(tables_.irradiance, layout_.irradiance_texel({r_km, mu_s}), half_);
}

}  // namespace twilight
