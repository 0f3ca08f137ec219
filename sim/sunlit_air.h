// Direct sunlight tabulated for many look-ups near one solar zenith angle.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/orders.h"

namespace twilight {

/// E/E0 of sunlight (refracted, spread, averaged over the disc as the options say) against
/// altitude and solar zenith angle. Rows of beam_row() are interpolated in altitude at equal
/// distance from the Earth's shadow where the Sun is low, so that its edge stays sharp.
class SunlitAir {
 public:
  /// Covers solar zenith angles from_rad..to_rad. `rows` altitudes, denser below.
  SunlitAir(const DirectSunlight& sunlight, const OrdersOptions& options,
            std::span<const double> wavelength_nm, double top_km, int rows, double from_rad,
            double to_rad);

  /// beam[lane]; false (beam untouched) where all is dark.
  bool beam(double altitude_km, double solar_zenith_rad, float* beam) const;

 private:
  std::size_t lanes_, first_, count_;  // fine points held
  double top_km_;
  std::vector<double> altitude_km_, shadow_rad_;
  std::vector<float> logarithm_;  // [row][fine][lane]
};

}  // namespace twilight
