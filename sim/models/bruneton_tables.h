// The tables of Bruneton & Neyret (2008) and their few look-ups.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "sim/models/bruneton_air.h"
#include "sim/models/bruneton_mapping.h"
#include "sim/models/bruneton_options.h"

namespace twilight {

/// Two neighbouring texels and the second one's share.
struct TexelPair {
  std::size_t low = 0;
  double share = 0.0;
};
/// Of a real texel in [0, n - 1]; within [first, first + n) where an axis has parts.
inline TexelPair texel_pair(double texel, std::size_t n, std::size_t first = 0) {
  const double x = std::clamp(texel - static_cast<double>(first), 0.0, static_cast<double>(n - 1));
  const std::size_t low = std::min(static_cast<std::size_t>(x), n - 2);
  return {first + low, x - static_cast<double>(low)};
}
/// Up to four neighbouring texels and their weights, of either sign, which sum to 1; those beyond
/// the axis have weight 0.
struct TexelStencil {
  std::size_t first = 0;
  std::array<double, 4> weight{};
};
/// Linear (two texels), or cubic after Lagrange, one-sided at the ends; linear too where n < 4.
inline TexelStencil texel_stencil(double texel, std::size_t n, bool cubic) {
  const TexelPair pair = texel_pair(texel, n);
  if (!cubic || n < 4) return {pair.low, {1 - pair.share, pair.share, 0, 0}};
  const std::size_t first = std::min(pair.low > 0 ? pair.low - 1 : 0, n - 4);
  const double t = pair.share + static_cast<double>(pair.low - first);
  const double t1 = t - 1, t2 = t - 2, t3 = t - 3;
  return {first, {-t1 * t2 * t3 / 6, t * t2 * t3 / 2, -t * t1 * t3 / 2, t * t1 * t2 / 6}};
}

/// Of the mu axis: never one texel from each half.
TexelPair mu_texel_pair(double texel, std::size_t n, bool ground);

/// Optical depth to the air's top, [r][mu][wavelength]. The paper stores T = exp(-depth) itself;
/// the depth interpolates better, and quotients of two transmittances do not become 0 / 0.
class BrunetonTransmittance {
 public:
  BrunetonTransmittance() = default;
  /// Every texel integrated, on the calling arena's threads.
  BrunetonTransmittance(const BrunetonAir& air, const BrunetonPlaneSize& size);

  /// Optical depth from radius_km along mu to the top, whether or not the ground is in between.
  void depth(double radius_km, double mu, std::span<double> out) const;
  /// Transmittance of sunlight: exp(-depth), 0 where the ground hides the Sun (a point).
  void sunlight(double radius_km, double mu_s, std::span<double> out) const;
  /// T(x, y) = T(x, v) / T(y, v) over a way of distance_km (Sec. 4), turned round for views to the
  /// ground.
  void between(double radius_km, const BrunetonView& view, double distance_km,
               std::span<double> out) const;
  std::span<const float> values() const { return values_; }
  const BrunetonPlaneSize& size() const { return size_; }

 private:
  BrunetonSphere sphere_;
  BrunetonPlaneSize size_;
  std::size_t wavelengths_ = 0;
  std::vector<float> values_;
};

/// A table of floats [texel][wavelength] over the four axes, and its interpolation.
class BrunetonScattering {
 public:
  BrunetonScattering() = default;
  BrunetonScattering(const BrunetonSize& size, std::size_t wavelengths)
      : size_(size), wavelengths_(wavelengths), values_(size.texels() * wavelengths) {}
  float* at(std::size_t texel) { return &values_[texel * wavelengths_]; }
  const float* at(std::size_t texel) const { return &values_[texel * wavelengths_]; }
  std::span<const float> values() const { return values_; }
  const BrunetonSize& size() const { return size_; }
  std::size_t wavelengths() const { return wavelengths_; }

 private:
  BrunetonSize size_;
  std::size_t wavelengths_ = 0;
  std::vector<float> values_;
};

/// Everything the run-time evaluation needs, in units of the solar irradiance at the top: filled by
/// bruneton_precompute(), const afterwards.
struct BrunetonTables {
  BrunetonAir air;
  BrunetonTransmittance transmittance;
  /// E(r, mu_s) of light scattered or reflected before, direct sunlight apart: [r][mu_s][w].
  BrunetonPlaneSize irradiance_size;
  std::vector<float> irradiance;
  /// C_* = S_R[L0] + S[L_*] / P_R and C_M = S_M[L0] (Sec. 4), sr^-1 and dimensionless: phase
  /// functions of the single scattering apart.
  BrunetonScattering rayleigh_and_multiple, single_mie;
  int orders = 1;
  /// Wavelength whose C_M alone is kept; -1: all. single_mie then has one value per texel.
  int mie_wavelength = -1;
  /// How inscatter() interpolates between Suns, see BrunetonOptions::sun_interpolation.
  bool cubic_sun = false;

  /// S(x, v, s), sr^-1: light scattered into the view between x and its end, per unit solar
  /// irradiance. 16 texels of each table, 4-linear (32 with
  /// cubic_sun). Radius within the spheres; >= 0.
  void inscatter(const BrunetonPoint& point, std::span<double> out) const;
  /// E(x, s), the sky's part, dimensionless.
  void sky_irradiance(double radius_km, double mu_s, std::span<double> out) const;
  std::size_t bytes() const;
};

/// The place after distance_km along the view: radius, cosines; nu stays. Distances beyond the
/// view's end are taken at it.
BrunetonPoint bruneton_advanced(const BrunetonSphere& sphere, const BrunetonPoint& point,
                                double distance_km);

}  // namespace twilight
