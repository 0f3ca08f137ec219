#include "sim/field_reference.h"

#include <algorithm>
#include <cmath>

namespace twilight {

template <class In, class Out>
void divide_by_trace(const LevelLight<In, Out>& level) {
  const std::size_t W = level.in_lanes, L = level.out_lanes;
  for (std::size_t j = 0; j < level.nodes; ++j) {
    const In* C = level.coherency + j * 4 * W;
    Out* relative = level.relative_coherency + j * 4 * L;
    double* trace = level.trace + j * W;
    for (std::size_t w = 0; w < W; ++w) {
      const double xx = C[w], yy = C[W + w], zz = C[2 * W + w];
      const double sum = xx + yy + zz;
      // Cubic paths may leave a trace of either sign where it is all but dark.
      const bool dark = !(sum > kDarkTrace) || std::min({xx, yy, zz}) < 0;
      trace[w] = dark ? 0.0 : sum;
      if (dark) continue;
      const double share = level.anisotropic_share[w], mean = (1 - share) / 3;
      relative[w] = static_cast<Out>(share * (xx / sum) + mean);
      relative[L + w] = static_cast<Out>(share * (yy / sum) + mean);
      relative[2 * L + w] = static_cast<Out>(share * (zz / sum) + mean);
      relative[3 * L + w] = static_cast<Out>(share * (static_cast<double>(C[3 * W + w]) / sum));
    }
    for (std::size_t k = 0; k < level.moments; ++k) {
      const In* from = level.moment + (j * level.moments + k) * W;
      Out* to = level.relative_moment + (j * level.moments + k) * L;
      for (std::size_t w = 0; w < W; ++w) {
        if (trace[w] > 0) to[w] = static_cast<Out>(static_cast<double>(from[w]) / trace[w]);
      }
    }
  }
}

template <class T>
void refine_trace(const ZenithGrid& grid, std::span<const double> nodes, std::size_t in_lanes,
                  std::size_t out_lanes, std::size_t first, std::size_t count, T* fine) {
  constexpr double kNoLogarithm = -1e30;
  std::vector<double> logarithm(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    logarithm[i] = nodes[i] > kDarkTrace ? std::log(nodes[i]) : kNoLogarithm;
  }
  for (std::size_t k = 0; k < count; ++k) {
    const ZenithGrid::Stencil s = ZenithGrid::stencil(grid.fine_position()[first + k], grid.size());
    for (std::size_t w = 0; w < in_lanes; ++w) {
      double log_sum = 0, sum = 0;
      bool dark = false;
      for (std::size_t q = 0; q < 4; ++q) {
        const std::size_t at = (s.first + q) * in_lanes + w;
        dark = dark || logarithm[at] == kNoLogarithm;
        log_sum += s.weight[q] * logarithm[at];
        sum += s.weight[q] * nodes[at];
      }
      fine[k * out_lanes + w] = static_cast<T>(dark ? std::max(sum, 0.0) : std::exp(log_sum));
    }
  }
}

template void divide_by_trace(const LevelLight<float, float>&);
template void divide_by_trace(const LevelLight<double, double>&);
template void refine_trace(const ZenithGrid&, std::span<const double>, std::size_t, std::size_t,
                           std::size_t, std::size_t, float*);
template void refine_trace(const ZenithGrid&, std::span<const double>, std::size_t, std::size_t,
                           std::size_t, std::size_t, double*);

}  // namespace twilight
