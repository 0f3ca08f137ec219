// The sky as a renderer reads it from its tables.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "output/sky_tables.h"
#include "output/table_layout.h"
#include "sim/sky.h"

namespace twilight {

/// Run-time evaluation of Bruneton & Neyret (2008), Sec. 4, and of the implementation of 2017 with
/// its single texture or its two: two look-ups of the 3D texture, trilinear in texels, mixed in nu,
/// then the phase functions.
class TableSky {
 public:
  /// Both outlive the object; their sizes agree. half: texels are rounded to 16 bit floats (ties to
  /// even) as a renderer that keeps them so does; those beyond 65504 become that.
  TableSky(const TableLayout& layout, const SkyTables& tables, bool half);

  /// Light scattered towards the viewer, three channels, in the tables' unit; the ground itself is
  /// not in it. A straight view: cosine of its zenith angle mu, of the Sun's mu_s, of the angle
  /// between them nu. Finite and >= 0.
  ChannelTriple radiance(double r_km, double mu, double mu_s, double nu) const;
  /// Transmittance to the top of the air.
  ChannelTriple transmittance(double r_km, double mu) const;
  /// Diffuse irradiance of the horizontal.
  ChannelTriple irradiance(double r_km, double mu_s) const;

 private:
  const TableLayout& layout_;
  const SkyTables& tables_;
  bool half_;
};

/// Three channels of a 2D texture, linear between texel centres, clamped to its edge.
ChannelTriple look_up(const Texture& texture, TexelPoint at, bool half);

/// A 32 bit float as the nearest 16 bit one has it (IEEE 754, ties to even; subnormal ones kept).
float rounded_to_half(float value);

}  // namespace twilight
