// The plane of altitude and solar zenith angle on which the orders are solved.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/orders_medium.h"
#include "sim/zenith_grid.h"

namespace twilight {

/// Up to this solar zenith angle no ray from the node comes near the Earth's shadow.
inline constexpr double kDayZenith_deg = 60;

/// A direction of incoming light: zenith angle, and the weight of its cosine.
struct PolarDirection {
  double zenith_rad, weight;
};

/// Incoming directions at an altitude, `count` of them, from the zenith to the nadir: above the
/// horizontal, between it and the ground's horizon (the limb, a thin bright belt), and the ground;
/// Gauss nodes crowd at the horizontal. Weights add up to 2.
std::vector<PolarDirection> polar_directions(double radius_km, double altitude_km, int count);

/// Levels of the field: denser towards the ground.
std::vector<double> orders_levels(double top_km, int levels);

/// orders_levels(), and more at every sharp top or bottom of a layer, on it and inside, ever nearer
/// to it: grazing light that is bright above a haze is gone some metres below its top.
std::vector<double> orders_levels(const OrdersMedium& medium, int levels);

/// Grids of one solution: moments are kept on the levels within the aerosol and on levels_above of
/// those above it.
template <class T>
struct OrdersGrid {
  OrdersGrid(const OrdersMedium& medium, double zenith_step_deg, std::vector<double> levels,
             int polar_count, int azimuth_count, int moment_degree, bool polarised,
             std::size_t levels_above);

  ZenithGrid zenith;
  std::size_t nodes = 0;  ///< of the zenith grid that are not night
  std::vector<double> level_km;
  std::size_t levels_above = 4;    ///< levels above the aerosol that carry moments
  std::size_t aerosol_levels = 0;  ///< levels that carry moments
  int polar_count = 0;             ///< of incoming directions
  int moment_degree = 0;           ///< of the moments that are kept, 0 without aerosol
  bool polarised = true;
  std::size_t stokes = 3, lanes = 8;
  std::size_t moments = 0;                  ///< kept per node
  std::vector<T> cos_azimuth, sin_azimuth;  ///< of half a turn
  /// Pairs of node and azimuth, padded for the kernels to run from any of them.
  std::size_t pairs = 0;
  std::size_t day_pairs = 0;  ///< the first of them, with the Sun above kDayZenith_deg
  std::vector<T> cos_chi, sin_chi, cos_phi, sin_phi;
  std::vector<T> fine_position;  ///< of the zenith grid
  std::size_t fine_end = 0;      ///< fine points from which it is night

  std::size_t azimuths() const { return cos_azimuth.size(); }
};

/// Light that arrives, on all nodes of the zenith grid.
template <class T>
struct IncomingLight {
  IncomingLight() = default;
  explicit IncomingLight(const OrdersGrid<T>& grid);

  /// Trace of the coherency tensor, 4 pi times the mean radiance, at a point (level times the
  /// zenith grid's nodes plus node) in one of `lanes`.
  double trace(std::size_t point, std::size_t lanes, std::size_t w) const;

  std::vector<T> coherency;  ///< [level][node][xx, yy, zz, xz][lane]
  std::vector<T> moments;    ///< [aerosol level][node][I, E, B][moment_index][lane]
  std::vector<T> ground;     ///< irradiance, [node][lane]
};

}  // namespace twilight
