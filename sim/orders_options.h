// What the successive orders model, and how finely.
#pragma once

#include <optional>

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
  /// Light scattered three times or more on half the levels and coarser directions.
  bool coarse_orders = true;
  /// Nodes beyond this solar zenith angle are night.
  double darkest_zenith_deg = 126.0;
  /// Angles of the exact sunlight, and half as many altitudes of the observer's sunlit air.
  int sunlight_nodes = 512;
};

}  // namespace twilight
