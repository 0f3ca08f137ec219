// A renderer's sky tables, filled from the solved sky.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "output/scattering_fit.h"
#include "output/table_channels.h"
#include "output/table_layout.h"
#include "sim/orders_sky.h"
#include "sim/run_control.h"

namespace twilight {

/// Texels of four floats, x fastest, then y, then z.
struct Texture {
  std::size_t width = 0, height = 0, depth = 1;
  std::vector<float> rgba;

  Texture() = default;
  Texture(std::size_t w, std::size_t h, std::size_t d = 1)
      : width(w), height(h), depth(d), rgba(4 * w * h * d, 0.0F) {}
  float* at(std::size_t x, std::size_t y, std::size_t z = 0) {
    return &rgba[4 * ((z * height + y) * width + x)];
  }
  const float* at(std::size_t x, std::size_t y, std::size_t z = 0) const {
    return &rgba[4 * ((z * height + y) * width + x)];
  }
};

struct SkyTableOptions {
  MieStorage storage = MieStorage::kCombined;
  TableFilling filling = TableFilling::kFitted;
  /// Of the renderer's Mie phase function, -0.99..0.99; unset: the one that fits the sky from the
  /// ground best, of 0.60..0.90 in steps of 0.02.
  std::optional<double> mie_g;
  /// Scattering is stored over a reference that falls with the Sun (SkyTables::sun_scale).
  bool sun_scale = false;
};

/// What a renderer has to know beside the textures.
struct TableConstants {
  double mie_g = 0.8;
  ChannelTriple solar_irradiance{};
  /// At the ground, per channel, km^-1. The ratios that the proportionality rule takes of them:
  /// with kCombined and kFitted mie_per_km is, but for its red, the one that fits the sky best.
  ChannelTriple rayleigh_per_km{}, mie_per_km{}, mie_extinction_per_km{}, ground_albedo{};
};

struct SkyTables {
  Texture transmittance, irradiance, scattering;
  std::optional<Texture> single_mie;  ///< kSeparate
  /// With options.sun_scale: natural logarithms of the factors of R, G, B (alpha: as R) that the
  /// scattering texture has to be multiplied with, at even steps of u_mu_s from 0 to 1.
  std::optional<Texture> sun_scale;
  TableConstants constants;
  std::size_t negative_star = 0;   ///< single Mie by the renderer's phase function exceeded light
  std::size_t outside_rec709 = 0;  ///< negative components of colours, set to 0
  double seconds = 0.0;
};

/// Everything that tables are filled from. `sky` is of the model, which it outlives.
struct TableSource {
  const SceneModel& model;
  const OrdersSky& sky;
  const TableChannels& channels;
};

/// Apparent elevation, rad, of a renderer's straight view: the same above the horizontal; below it
/// stretched so that the refracted horizon lies at the straight one. On the ground the same.
double apparent_elevation_rad(double geometric_rad, double geometric_horizon_rad,
                              double apparent_horizon_rad);
/// And back.
double straight_elevation_rad(double apparent_rad, double geometric_horizon_rad,
                              double apparent_horizon_rad);

/// Sunlight, ground albedo and the ground's air of the channels; g 0.8 unless the options have one.
TableConstants table_constants(const TableSource& source, const SkyTableOptions& options);

/// Transmittance to the top, 0 for views that meet the ground; refracted rays. `at` says where
/// texels stand. Runs on the current oneTBB arena.
Texture fill_transmittance(const TableSource& source, std::size_t width, std::size_t height,
                           const std::function<RadiusCosine(TexelPoint)>& at);
/// Diffuse irradiance of the horizontal, from above; direct sunlight is the renderer's to add.
Texture fill_irradiance(const TableSource& source, const TableLayout& layout,
                        const RunControl& control);

/// All tables. `slices`: of r, those to fill (the others stay 0), empty: all. Irradiance is filled
/// with all slices only. Throws Cancelled when stopped.
SkyTables fill_sky_tables(const TableSource& source, const TableLayout& layout,
                          const SkyTableOptions& options, const RunControl& control,
                          const std::vector<std::size_t>& slices = {});

}  // namespace twilight
