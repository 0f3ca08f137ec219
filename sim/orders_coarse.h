// Light scattered often is smooth: a coarser grid for it, and the way back.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/orders_grid.h"

namespace twilight {

/// Every second level, the last, pairs that stand close together at the edge of a layer, and all
/// where the air is so thick that light would lose its way between fewer: without a level the
/// interval is thicker than an optical depth of 0.5.
std::vector<std::size_t> coarse_levels(const std::vector<double>& level_km,
                                       const PathOptics& optics);

/// A grid with fewer levels and directions, and with moments to a lower degree.
struct Coarsening {
  std::vector<std::size_t> kept;  ///< levels
  int polar_count = 16, azimuth_count = 8, moment_degree = 12;
};

/// A grid has no more directions and moments than the one it comes from.
template <class T>
OrdersGrid<T> coarse_grid(const OrdersGrid<T>& fine, const Coarsening& coarsening,
                          const OrdersMedium& medium, double zenith_step_deg);

/// Light at the coarse grid's points.
template <class T>
IncomingLight<T> restrict_light(const OrdersGrid<T>& fine, const OrdersGrid<T>& coarse,
                                const std::vector<std::size_t>& kept,
                                const IncomingLight<T>& light);

/// Adds light of the coarse grid to a total on the fine one. Between levels the logarithm of its
/// ratio to the trace of `like`, light of the fine grid that falls off as steeply, is cubic in the
/// level's number, and stays between its neighbours' values.
template <class T>
void add_prolonged(const OrdersGrid<T>& coarse, const OrdersGrid<T>& fine,
                   const std::vector<std::size_t>& kept, const IncomingLight<T>& light,
                   const IncomingLight<T>& like, IncomingLight<T>& total);

}  // namespace twilight
