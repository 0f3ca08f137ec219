#include "sim/models/bruneton_tables.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace twilight {

TexelPair mu_texel_pair(double texel, std::size_t n, bool ground) {
  return texel_pair(texel, n / 2, ground ? 0 : n / 2);
}

BrunetonTransmittance::BrunetonTransmittance(const BrunetonAir& air, const BrunetonPlaneSize& size)
    : sphere_(air.sphere()),
      size_(size),
      wavelengths_(air.wavelengths()),
      values_(size.texels() * air.wavelengths()) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size.r), [&](const auto& range) {
    BrunetonAir::Columns columns;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const double r = bruneton_radius_km(sphere_, static_cast<double>(i), size.r);
      for (std::size_t j = 0; j < size.cosine; ++j) {
        const double mu =
            bruneton_transmittance_mu(sphere_, r, static_cast<double>(j), size.cosine);
        air.columns(r, mu, 0.0, bruneton_distance_km(sphere_, r, {mu, false}), columns);
        for (std::size_t w = 0; w < wavelengths_; ++w) {
          values_[size.index(i, j) * wavelengths_ + w] = static_cast<float>(columns.extinction[w]);
        }
      }
    }
  });
}

void BrunetonTransmittance::depth(double radius_km, double mu, std::span<double> out) const {
  const TexelPair r = texel_pair(bruneton_r_texel(sphere_, radius_km, size_.r), size_.r);
  const TexelPair m =
      texel_pair(bruneton_transmittance_texel(sphere_, radius_km, mu, size_.cosine), size_.cosine);
  const float* low = &values_[size_.index(r.low, m.low) * wavelengths_];
  const float* high = low + size_.cosine * wavelengths_;
  const double a = (1 - r.share) * (1 - m.share), b = (1 - r.share) * m.share;
  const double c = r.share * (1 - m.share), d = r.share * m.share;
  for (std::size_t w = 0; w < wavelengths_; ++w) {
    const std::size_t next = w + wavelengths_;
    out[w] = a * low[w] + b * low[next] + c * high[w] + d * high[next];
  }
}

void BrunetonTransmittance::sunlight(double radius_km, double mu_s, std::span<double> out) const {
  if (radius_km * mu_s < -sphere_.rho_km(radius_km)) {
    std::ranges::fill(out, 0.0);
    return;
  }
  depth(radius_km, mu_s, out);
  for (double& value : out) value = std::exp(-value);
}

void BrunetonTransmittance::between(double radius_km, const BrunetonView& view, double distance_km,
                                    std::span<double> out) const {
  const double r = radius_km, d = distance_km;
  const double end = std::clamp(std::sqrt(std::max(0.0, d * d + 2 * r * view.mu * d + r * r)),
                                sphere_.ground_radius_km, sphere_.top_radius_km);
  const double end_mu = std::clamp((r * view.mu + d) / end, -1.0, 1.0);
  std::vector<double> other(wavelengths_);
  if (view.ground) {
    depth(end, -end_mu, out);
    depth(r, -view.mu, other);
  } else {
    depth(r, view.mu, out);
    depth(end, end_mu, other);
  }
  for (std::size_t w = 0; w < wavelengths_; ++w) {
    out[w] = std::exp(-std::max(0.0, out[w] - other[w]));
  }
}

void BrunetonTables::inscatter(const BrunetonPoint& point, std::span<double> out) const {
  const BrunetonSize& size = rayleigh_and_multiple.size();
  const std::array<double, 4> texel = bruneton_texel(air.sphere(), point, size);
  const TexelPair r = texel_pair(texel[0], size.r);
  const TexelPair m = mu_texel_pair(texel[1], size.mu, point.view.ground);
  const TexelPair n = texel_pair(texel[3], size.nu);
  const TexelStencil s = texel_stencil(texel[2], size.mu_s, cubic_sun);
  const std::size_t W = rayleigh_and_multiple.wavelengths(), mie_values = single_mie.wavelengths();
  std::vector<double> mie(mie_values, 0.0);
  std::ranges::fill(out, 0.0);
  for (std::size_t corner = 0; corner < 32; ++corner) {
    const std::size_t a = corner & 1, b = corner >> 1 & 1, d = corner >> 2 & 1, c = corner >> 3;
    const double weight = (a ? r.share : 1 - r.share) * (b ? m.share : 1 - m.share) * s.weight[c] *
                          (d ? n.share : 1 - n.share);
    if (weight == 0) continue;
    const std::size_t at = size.index(r.low + a, m.low + b, s.first + c, n.low + d);
    const float* star = rayleigh_and_multiple.at(at);
    const float* single = single_mie.at(at);
    for (std::size_t w = 0; w < W; ++w) out[w] += weight * star[w];
    for (std::size_t w = 0; w < mie_values; ++w) mie[w] += weight * single[w];
  }
  const double rayleigh = bruneton_rayleigh_phase(point.nu);
  const auto kept = static_cast<std::size_t>(std::max(0, mie_wavelength));
  // C_* of the wavelength kept, before the loop below overwrites it.
  const double star_kept = out[kept];
  for (std::size_t w = 0; w < W; ++w) {
    double haze = mie_wavelength < 0 ? mie[w] : 0.0;
    if (mie_wavelength >= 0 && star_kept > 0 && air.ground_mie()[kept] > 0) {
      const auto red = air.ground_rayleigh(), red_mie = air.ground_mie();
      haze = std::max(0.0, out[w]) * mie[0] / star_kept * (red[kept] / red_mie[kept]) *
             (red_mie[w] / red[w]);
    }
    out[w] = std::max(0.0, rayleigh * out[w] + air.mie_phase(w, point.nu) * std::max(0.0, haze));
  }
}

void BrunetonTables::sky_irradiance(double radius_km, double mu_s, std::span<double> out) const {
  const std::size_t W = air.wavelengths();
  const BrunetonPlaneSize& size = irradiance_size;
  const TexelPair r = texel_pair(bruneton_r_texel(air.sphere(), radius_km, size.r), size.r);
  const TexelPair s = texel_pair(bruneton_mu_s_texel(mu_s, size.cosine), size.cosine);
  for (std::size_t w = 0; w < W; ++w) {
    const auto value = [&](std::size_t i, std::size_t j) -> double {
      return irradiance[size.index(r.low + i, s.low + j) * W + w];
    };
    out[w] = (1 - r.share) * ((1 - s.share) * value(0, 0) + s.share * value(0, 1)) +
             r.share * ((1 - s.share) * value(1, 0) + s.share * value(1, 1));
  }
}

std::size_t BrunetonTables::bytes() const {
  return sizeof(float) * (transmittance.values().size() + irradiance.size() +
                          rayleigh_and_multiple.values().size() + single_mie.values().size());
}

BrunetonPoint bruneton_advanced(const BrunetonSphere& sphere, const BrunetonPoint& point,
                                double distance_km) {
  const double r = point.radius_km;
  const double end = bruneton_distance_km(sphere, r, point.view);
  const double d = std::clamp(distance_km, 0.0, end);
  BrunetonPoint next = point;
  next.radius_km = std::clamp(std::sqrt(std::max(0.0, d * d + 2 * r * point.view.mu * d + r * r)),
                              sphere.ground_radius_km, sphere.top_radius_km);
  if (d == end) {
    next.radius_km = point.view.ground ? sphere.ground_radius_km : sphere.top_radius_km;
  }
  next.view.mu = std::clamp((r * point.view.mu + d) / next.radius_km, -1.0, 1.0);
  next.mu_s = std::clamp((r * point.mu_s + d * point.nu) / next.radius_km, -1.0, 1.0);
  return next;
}

}  // namespace twilight
