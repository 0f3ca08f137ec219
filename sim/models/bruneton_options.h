// Options of solver.method = "bruneton".
#pragma once

#include <string>
#include <vector>

namespace twilight {

/// Sizes of the tables as the paper has them (Sec. 6) and the integration that fills them, which it
/// does not give.
struct BrunetonOptions {
  /// Texels along r, mu, mu_s, nu; mu even. Each 2..512 (mu from 4), 64 million at most.
  std::vector<double> scattering_size = {32, 128, 32, 8};
  std::vector<double> transmittance_size = {64, 256};  ///< along r and mu, 2..4096
  std::vector<double> irradiance_size = {16, 64};      ///< along r and mu_s, 2..4096
  /// Keep the Mie term of one wavelength (that nearest 680 nm, their red) and take the others in
  /// proportion (Sec. 4 "Angular precision"): C_M ~ C_* (C_Mr / C_*r)(bR_r / bM_r)(bM / bR).
  bool proportional_mie = false;
  /// Between the table's Suns at run time: "cubic" (four look-ups), which the light of twilight,
  /// falling like an exponential, wants at 32 texels: within 2 % of "orders" to a Sun of -2
  /// degrees; or "linear", a texture's own filter, the paper's: up to 10 % there.
  std::string sun_interpolation = "cubic";
  /// Nodes of the quadrature along a view, twice as many where it dips and rises again: 8..512.
  /// 80 change no view by more than 0.02 %.
  int view_samples = 40;
  /// Directions of the light that is scattered again, in zenith angle (half of them below the
  /// horizon, even) and over half a turn of azimuth: 4..256. A sharper aerosol wants more.
  int polar_directions = 32;
  int azimuth_directions = 16;
};

}  // namespace twilight
