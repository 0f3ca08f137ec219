// Successive orders of scattering on the plane of altitude and solar zenith angle.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "atmosphere/medium.h"
#include "sim/direct_sunlight.h"
#include "sim/orders_field.h"
#include "sim/orders_paths.h"
#include "sim/run_control.h"
#include "sim/truncated_phase.h"

namespace twilight {

/// Steps of the grids and what is modelled; see SolverOptions for ranges.
struct OrdersOptions {
  double zenith_step_deg = 1.0;
  int altitude_levels = 50;
  int polar_directions = 32;
  int azimuth_directions = 16;
  int phase_degree = 24;
  double order_tolerance = 1e-3;
  /// Scattering events, the one into the view included; unset: until order_tolerance, at most 500.
  std::optional<int> scattering_orders;
  bool polarised = true;
  bool single_precision = true;
  bool disc_average = true;
  double sun_distance_au = 1.0;
  bool ground_light = true;
};

/// The medium as the orders see it.
struct OrdersMedium {
  Medium truncated;  ///< scattering coefficients of aerosols less their forward peak
  PathOptics optics;
  int degree = 0;  ///< of the aerosol's phase functions, 0 without aerosol
  std::vector<TruncatedPhase> kinds;
  std::vector<double> anisotropic_share;  ///< Delta = (1 - rho) / (1 + rho / 2) of air, [lane]
  std::vector<double> ground_albedo;      ///< [lane]
  double aerosol_top_km = 0;
  std::size_t lanes = 0;
};

/// Throws std::invalid_argument where a kind's coefficients do not add up to the aerosol's.
OrdersMedium make_orders_medium(const Medium& medium, std::span<const double> ground_albedo,
                                const OrdersOptions& options);

/// Irradiance normal to the beam over that above the atmosphere on the fine zenith scale of
/// ZenithGrid, averaged over the Sun's disc where asked: beam[fine][lane].
void beam_row(const DirectSunlight& sunlight, const OrdersOptions& options,
              std::span<const double> wavelength_nm, double altitude_km, std::span<float> beam);

/// Levels of the field: denser towards the ground.
std::vector<double> orders_levels(double top_km, int levels);

/// Solves for the light scattered once or more. Same bytes for any number of threads.
/// Throws Cancelled.
OrdersField solve_orders(const OrdersMedium& medium, const DirectSunlight& sunlight,
                         const OrdersOptions& options, const RunControl& control);

}  // namespace twilight
