// Algorithm 4.1 of Bruneton & Neyret (2008).
#pragma once

#include <memory>

#include "sim/models/bruneton_tables.h"
#include "sim/run_control.h"

namespace twilight {

/// Fills the tables order by order: single scattering, then for each further order the source dJ of
/// the light and ground light before (Eq. 7), its irradiance dE (Eq. 15) and its in-scattering dS
/// (Eq. 11). `ground_albedo` per wavelength. On the calling arena's threads; the same bytes for any
/// number of them. Throws std::invalid_argument for sizes out of range, Cancelled when stopped.
std::shared_ptr<const BrunetonTables> bruneton_precompute(const SceneModel& model,
                                                          const BrunetonOptions& options,
                                                          int orders, const RunControl& control);

/// How many orders the scene asks for: solver.scattering_orders, or 5, with which the paper gives
/// its times (Sec. 6).
int bruneton_orders(const SceneModel& model);

}  // namespace twilight
