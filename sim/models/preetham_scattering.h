// Scattering coefficients of Preetham et al. (1999), A.3.
#pragma once

#include <array>

namespace twilight {

/// Total and angular scattering of their air at the ground at one wavelength: molecules
/// (Rayleigh, n = 1.0003, N = 2.545e25 m^-3, depolarisation 0.035) and haze (Mie after Bullrich
/// 1964, Junge exponent v = 4).
///
/// The haze's concentration c = (0.6544 T - 0.6510) 1e-16 is taken in cm: beta_p = 0.434 c pi
/// (2 pi / lambda)^2 K is per cm, then, with lambda in cm. Read as metres (as the table's "SI
/// units" suggests) a turbidity of 2 would leave 500 m of visibility; in cm it is 42 km, and (tau_m
/// + tau_h) / tau_m of the vertical with the scale heights of A.4 is 1.8 (at 3: 2.6).
class PreethamScattering {
 public:
  /// wavelength_nm > 0; K beyond 380..780 nm and eta beyond 400..850 nm are those of the ends.
  /// turbidity >= 1. Throws std::invalid_argument otherwise.
  PreethamScattering(double wavelength_nm, double turbidity);

  double molecules_per_km() const { return molecules_per_km_; }
  double haze_per_km() const { return haze_per_km_; }
  /// Angular coefficients, km^-1 sr^-1, at a scattering angle, rad, 0..pi (0 = forward). The
  /// molecules' integral over the sphere is the total to rounding; the haze's (Table 1, whose
  /// logarithm is taken as linear in angle between its rows, constant below 1 degree) within 0.6 %,
  /// 0.9 % at 850 nm.
  double molecules_per_km_sr(double scattering_angle_rad) const;
  double haze_per_km_sr(double scattering_angle_rad) const;

 private:
  double molecules_per_km_, haze_per_km_, angular_haze_per_km_;
  std::array<double, 13> log_eta_;
};

/// Meteorological range, km: where the contrast of a black target against the horizon falls to
/// 0.02 (their Sec. 2.1), ln(50) over the scattering coefficient of A.3 at 550 nm (Koschmieder).
/// turbidity >= 1. Their Fig. 3, from McCartney's tables, is a picture and is not reproduced.
double meteorological_range_km(double turbidity);

}  // namespace twilight
