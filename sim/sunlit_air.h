// Direct sunlight tabulated for many look-ups near one solar zenith angle.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/orders.h"

namespace twilight {

/// E/E0 of sunlight (refracted, spread, averaged over the disc as the options say) against
/// altitude and solar zenith angle. Rows of BeamRows are interpolated in altitude at equal
/// distance from the Earth's shadow where the Sun is low, so that its edge stays sharp.
class SunlitAir {
 public:
  /// Covers solar zenith angles from_rad..to_rad. `rows` altitudes, denser below, and five on
  /// either side of each of edges_km (0..top), where the air changes abruptly and level sunlight
  /// with it.
  SunlitAir(const DirectSunlight& sunlight, const OrdersOptions& options,
            std::span<const double> wavelength_nm, double top_km, int rows, double from_rad,
            double to_rad, std::span<const double> edges_km = {});

  /// beam[lane]; false (beam untouched) where all is dark.
  bool beam(double altitude_km, double solar_zenith_rad, float* beam) const;

  /// The rows about an altitude: look-ups of many Suns at one place share them.
  struct Place {
    std::size_t row = 0;  ///< the lower one; the place is at the share `above` of the next
    double above = 0;
    double per_km = 0;      ///< change of `above` with altitude
    double shift_rad[2]{};  ///< of the two rows' shadow edges against the place's own
  };
  Place place(double altitude_km) const;

  /// Logarithms of the beam, [row][zenith angle], at the two points about the place and one beyond
  /// on either side; kNight where it is dark.
  struct Taps {
    const float* logarithm[2][4];  ///< [lane] each
    float share[2];                ///< of the third zenith angle (the rest: second), per row
    double bending_rad;            ///< geometric less apparent zenith angle of the Sun
  };
  Taps taps(const Place& place, double solar_zenith_rad) const;
  /// Zenith angle between neighbouring points.
  static double step_rad();
  static constexpr float kNight = -1e30F;

 private:
  std::size_t lanes_, first_, count_;  // fine points held
  double top_km_;
  std::vector<double> altitude_km_, shadow_rad_;
  std::vector<float> logarithm_;  // [row][fine][lane]
  std::vector<float> bending_;    // [row][fine], rad
};

}  // namespace twilight
