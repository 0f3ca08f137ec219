// The medium as the successive orders see it.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "atmosphere/medium.h"
#include "sim/orders_options.h"
#include "sim/orders_paths.h"
#include "sim/truncated_phase.h"

namespace twilight {

struct OrdersMedium {
  Medium truncated;  ///< scattering coefficients of aerosols less their forward peak
  PathOptics optics;
  int degree = 0;  ///< of the aerosol's phase functions, 0 without aerosol
  std::vector<TruncatedPhase> kinds;
  std::vector<double> anisotropic_share;  ///< Delta = (1 - rho) / (1 + rho / 2) of air, [lane]
  std::vector<double> ground_albedo;      ///< [lane]
  double aerosol_top_km = 0;
  /// Nodes beyond this solar zenith angle are night; at 126 degrees what light is scattered is
  /// below 1e-12 of the day's.
  double darkest_zenith_deg = 126;
  std::size_t lanes = 0;
};

/// ground_albedo: per wavelength; of the options, phase_degree (at which aerosols are truncated)
/// and darkest_zenith_deg.
/// Throws std::invalid_argument where a kind's coefficients do not add up to the aerosol's.
OrdersMedium make_orders_medium(const Medium& medium, std::span<const double> ground_albedo,
                                const OrdersOptions& options);

}  // namespace twilight
