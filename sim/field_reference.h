// Light on solar zenith nodes relative to the steep factor it is interpolated with.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/zenith_grid.h"

namespace twilight {

/// Below this a value is night without a sky: keeps floats out of the denormals.
constexpr double kDarkTrace = 1e-30;

/// Light that arrives at one level of the field, per solar zenith node.
template <class In, class Out>
struct LevelLight {
  std::size_t nodes = 0;
  std::size_t moments = 0;  ///< per node; 0 at a level that has none
  /// Values per row of the arrays: of `coherency` and `moment` as they are, of the results as they
  /// are wanted (at least as many; the rest is left alone).
  std::size_t in_lanes = 0, out_lanes = 0;
  const In* coherency = nullptr;              ///< [node][xx, yy, zz, xz][in lane]
  const In* moment = nullptr;                 ///< [node][moment][in lane]
  const double* anisotropic_share = nullptr;  ///< Delta of air, [in lane]
  Out* relative_coherency = nullptr;          ///< [node][4][out lane], zero where dark
  Out* relative_moment = nullptr;             ///< [node][moment][out lane]
  double* trace = nullptr;                    ///< [node][in lane]
};

/// Sets the trace of the coherency tensor (0 where it is dark, or where rounding has left a
/// diagonal element negative), the tensor that scatters in depolarising air as the given one does,
/// Delta C + (1 - Delta) (tr C / 3) 1, and the moments, both over the trace. Results at dark nodes
/// are left alone: zero them beforehand.
template <class In, class Out>
void divide_by_trace(const LevelLight<In, Out>& level);

/// From nodes to points first..first + count - 1 of ZenithGrid's fine scale, cubic in the logarithm
/// (linearly and not below 0 where one of the four nodes is below kDarkTrace).
/// nodes[node][in_lanes] to fine[point][out_lanes].
template <class T>
void refine_trace(const ZenithGrid& grid, std::span<const double> nodes, std::size_t in_lanes,
                  std::size_t out_lanes, std::size_t first, std::size_t count, T* fine);

}  // namespace twilight
