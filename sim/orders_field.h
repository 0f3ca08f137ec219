// The solved field of the "orders" method: light in the plane of altitude and solar zenith angle.
#pragma once

#include <cstddef>
#include <vector>

namespace twilight {

/// Moments of the sky light that arrives at every altitude and solar zenith angle after at least
/// one scattering or reflection, summed over all orders, per unit solar irradiance above the
/// atmosphere. It serves every Sun elevation, observer and view of one atmosphere and ground.
///
/// Local frame of a point: z up, x horizontal towards the Sun's azimuth. coherency is
/// the tensor C = integral of the polarisation tensor of the incoming light over its directions
/// (xx, yy, zz, xz; the trace is 4 pi times the mean radiance). aerosol_moments are the moments
/// of I (and, polarised, E and B of Q and U) in generalised spherical functions, see
/// sim/angular_moments.h; only levels below the top of the aerosol have them.
struct OrdersField {
  std::vector<double> wavelength_nm;     ///< [W]
  std::vector<double> altitude_km;       ///< levels, [Z], increasing from 0 to the top
  std::vector<double> solar_zenith_rad;  ///< nodes, [X], increasing from 0 to pi
  double zenith_step_deg = 1.0;          ///< the grid's parameter that makes solar_zenith_rad
  int phase_degree = 0;                  ///< L of aerosol_moments
  bool polarised = true;
  std::size_t aerosol_levels = 0;    ///< Za: levels 0..Za-1 carry aerosol moments
  std::size_t moments_per_node = 0;  ///< K: (L+1)(L+2)/2, three times that when polarised

  std::vector<float> coherency;          ///< [Z][X][4][W], W m^-2 per W m^-2
  std::vector<float> aerosol_moments;    ///< [Za][X][K][W]
  std::vector<float> ground_irradiance;  ///< [X][W], diffuse, on the horizontal ground

  /// Share of every order of incoming light (1 = scattered once) in the mean radiance at the
  /// ground, at the node nearest to a Sun 6 degrees below the horizon, [order][W]; for the summary.
  std::vector<double> order_share;
  int orders = 0;  ///< scattering events in the field, the first included
};

}  // namespace twilight
