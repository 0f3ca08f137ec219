#include "sim/orders_coarse.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "sim/angular_moments.h"
#include "sim/field_reference.h"

namespace twilight {
namespace {

// A level of the fine grid among those of the coarse one.
struct LevelStencil {
  std::size_t count = 0;
  std::size_t coarse[4] = {};
  double weight[4] = {};
};

LevelStencil level_stencil(const std::vector<std::size_t>& kept, std::size_t level) {
  const auto above = std::ranges::lower_bound(kept, level) - kept.begin();
  LevelStencil s;
  if (kept[static_cast<std::size_t>(above)] == level) {
    s.count = 1;
    s.coarse[0] = static_cast<std::size_t>(above);
    s.weight[0] = 1;
    return s;
  }
  const auto size = static_cast<std::ptrdiff_t>(kept.size());
  s.count = std::min<std::size_t>(4, kept.size());
  const std::ptrdiff_t first =
      std::clamp<std::ptrdiff_t>(above - 2, 0, size - static_cast<std::ptrdiff_t>(s.count));
  for (std::size_t k = 0; k < s.count; ++k) {
    s.coarse[k] = static_cast<std::size_t>(first) + k;
    s.weight[k] = 1;
    for (std::size_t n = 0; n < s.count; ++n) {
      if (n == k) continue;
      const auto own = static_cast<double>(kept[s.coarse[k]]);
      const auto other = static_cast<double>(kept[static_cast<std::size_t>(first) + n]);
      s.weight[k] *= (static_cast<double>(level) - other) / (own - other);
    }
  }
  return s;
}

// Moments I, E, B to the lower of two degrees are the first of each field's.
template <class T>
void copy_moments(const OrdersGrid<T>& from_grid, const OrdersGrid<T>& to_grid, const T* from,
                  T* to) {
  const std::size_t lanes = from_grid.lanes;
  const std::size_t count =
      moment_count(std::min(from_grid.moment_degree, to_grid.moment_degree)) * lanes;
  for (std::size_t field = 0; field < from_grid.stokes; ++field) {
    const T* source = from + field * moment_count(from_grid.moment_degree) * lanes;
    std::copy(source, source + count, to + field * moment_count(to_grid.moment_degree) * lanes);
  }
}

// The largest of all wavelengths.
double vertical_depth(const PathOptics& optics, double from_km, double to_km) {
  double most = 0;
  for (std::size_t w = 0; w < optics.lanes; ++w) {
    double depth = 0;
    for (std::size_t i = 0; i + 1 < optics.boundary_km.size(); ++i) {
      const double inside =
          std::min(to_km, optics.boundary_km[i + 1]) - std::max(from_km, optics.boundary_km[i]);
      if (inside > 0) depth += inside * optics.extinction_per_km[i * optics.lanes + w];
    }
    most = std::max(most, depth);
  }
  return most;
}

}  // namespace

std::vector<std::size_t> coarse_levels(const std::vector<double>& level_km,
                                       const PathOptics& optics) {
  constexpr double kClose = 0.2;  // of the distance to the next level on the other side
  constexpr double kThick = 0.5;
  const std::size_t count = level_km.size();
  const auto gap = [&](std::size_t i) { return level_km[i + 1] - level_km[i]; };
  std::vector<char> close(count, 0);
  for (std::size_t i = 1; i + 2 < count; ++i) {
    if (gap(i) < kClose * std::max(gap(i - 1), gap(i + 1))) close[i] = close[i + 1] = 1;
  }
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < count; ++i) {
    if (i % 2 == 0 || i + 1 == count || close[i] != 0 ||
        vertical_depth(optics, level_km[i - 1], level_km[i + 1]) > kThick) {
      kept.push_back(i);
    }
  }
  return kept;
}

template <class T>
OrdersGrid<T> coarse_grid(const OrdersGrid<T>& fine, const Coarsening& coarsening,
                          const OrdersMedium& medium, double zenith_step_deg) {
  std::vector<double> levels;
  for (const std::size_t i : coarsening.kept) levels.push_back(fine.level_km[i]);
  return OrdersGrid<T>(medium, zenith_step_deg, std::move(levels),
                       std::min(fine.polar_count, coarsening.polar_count),
                       std::min(static_cast<int>(fine.azimuths()), coarsening.azimuth_count),
                       std::min(fine.moment_degree, coarsening.moment_degree), fine.polarised,
                       (fine.levels_above * coarsening.kept.size() + fine.level_km.size() - 1) /
                           fine.level_km.size());
}

template <class T>
IncomingLight<T> restrict_light(const OrdersGrid<T>& fine, const OrdersGrid<T>& coarse,
                                const std::vector<std::size_t>& kept,
                                const IncomingLight<T>& light) {
  IncomingLight<T> result(coarse);
  const std::size_t all = fine.zenith.size(), lanes = fine.lanes;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const T* C = &light.coherency[kept[i] * all * 4 * lanes];
    std::copy(C, C + all * 4 * lanes, &result.coherency[i * all * 4 * lanes]);
    if (i >= coarse.aerosol_levels || kept[i] >= fine.aerosol_levels) continue;
    for (std::size_t j = 0; j < all; ++j) {
      copy_moments(fine, coarse, &light.moments[(kept[i] * all + j) * fine.moments * lanes],
                   &result.moments[(i * all + j) * coarse.moments * lanes]);
    }
  }
  result.ground = light.ground;
  return result;
}

template <class T>
void add_prolonged(const OrdersGrid<T>& coarse, const OrdersGrid<T>& fine,
                   const std::vector<std::size_t>& kept, const IncomingLight<T>& light,
                   const IncomingLight<T>& like, IncomingLight<T>& total) {
  const std::size_t all = fine.zenith.size(), lanes = fine.lanes;
  const std::size_t stored = moment_count(fine.moment_degree);
  const std::size_t kept_moments = moment_count(coarse.moment_degree);
  tbb::parallel_for(std::size_t{0}, fine.level_km.size(), [&](std::size_t level) {
    const LevelStencil s = level_stencil(kept, level);
    for (std::size_t j = 0; j < fine.nodes; ++j) {
      const std::size_t point = level * all + j;
      for (std::size_t w = 0; w < lanes; ++w) {
        double trace[4] = {}, steep[4] = {}, here = like.trace(point, lanes, w);
        bool lit = here > kDarkTrace;
        for (std::size_t k = 0; k < s.count; ++k) {
          trace[k] = light.trace(s.coarse[k] * all + j, lanes, w);
          steep[k] = like.trace(kept[s.coarse[k]] * all + j, lanes, w);
          lit = lit && steep[k] > kDarkTrace;
        }
        // Where the light of few scatterings does not get to, light is compared with itself.
        if (!lit) here = 1;
        // The ratio in its logarithm: in thick air it spans decades from level to level.
        double log_ratio = 0, weights = 0, least = HUGE_VAL, most = -HUGE_VAL;
        for (std::size_t k = 0; k < s.count; ++k) {
          if (!(trace[k] > kDarkTrace)) {
            trace[k] = 0;
            continue;
          }
          const double logarithm = std::log(trace[k] / (lit ? steep[k] : 1.0));
          log_ratio += s.weight[k] * logarithm;
          weights += s.weight[k];
          least = std::min(least, logarithm);
          most = std::max(most, logarithm);
        }
        if (!(weights > 0.1)) continue;  // night on one side
        const double sum = here * std::exp(std::clamp(log_ratio / weights, least, most));
        for (std::size_t k = 0; k < s.count; ++k) {
          if (!(trace[k] > 0)) continue;
          const double factor = s.weight[k] / weights * sum / trace[k];
          const std::size_t from = s.coarse[k] * all + j;
          for (std::size_t n = 0; n < 4; ++n) {
            total.coherency[(point * 4 + n) * lanes + w] += static_cast<T>(
                factor * static_cast<double>(light.coherency[(from * 4 + n) * lanes + w]));
          }
          if (level >= fine.aerosol_levels || s.coarse[k] >= coarse.aerosol_levels) continue;
          for (std::size_t q = 0; q < fine.stokes; ++q) {
            const T* M = &light.moments[(from * coarse.moments + q * kept_moments) * lanes + w];
            T* out = &total.moments[(point * fine.moments + q * stored) * lanes + w];
            for (std::size_t n = 0; n < kept_moments; ++n) {
              out[n * lanes] += static_cast<T>(factor * static_cast<double>(M[n * lanes]));
            }
          }
        }
      }
    }
  });
  for (std::size_t i = 0; i < light.ground.size(); ++i) total.ground[i] += light.ground[i];
}

template OrdersGrid<float> coarse_grid(const OrdersGrid<float>&, const Coarsening&,
                                       const OrdersMedium&, double);
template OrdersGrid<double> coarse_grid(const OrdersGrid<double>&, const Coarsening&,
                                        const OrdersMedium&, double);
template IncomingLight<float> restrict_light(const OrdersGrid<float>&, const OrdersGrid<float>&,
                                             const std::vector<std::size_t>&,
                                             const IncomingLight<float>&);
template IncomingLight<double> restrict_light(const OrdersGrid<double>&, const OrdersGrid<double>&,
                                              const std::vector<std::size_t>&,
                                              const IncomingLight<double>&);
template void add_prolonged(const OrdersGrid<float>&, const OrdersGrid<float>&,
                            const std::vector<std::size_t>&, const IncomingLight<float>&,
                            const IncomingLight<float>&, IncomingLight<float>&);
template void add_prolonged(const OrdersGrid<double>&, const OrdersGrid<double>&,
                            const std::vector<std::size_t>&, const IncomingLight<double>&,
                            const IncomingLight<double>&, IncomingLight<double>&);

}  // namespace twilight
