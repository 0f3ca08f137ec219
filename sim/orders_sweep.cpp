#include "sim/orders_sweep.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numbers>
#include <vector>

#include "sim/aerosol_emission.h"
#include "sim/angular_moments.h"
#include "sim/emission_kernel.h"
#include "sim/orders_kernel.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kRadPerDeg = pi / 180;
// Furthest that two points of a ray lie apart: sunlight has edges.
constexpr double kBeamStep_rad = 0.25 * kRadPerDeg, kScatteredStep_rad = 0.5 * kRadPerDeg;
// Azimuthal modes of a source below this share of its mean are left out: far below the
// quadratures' errors, and most of the work with aerosols.
constexpr double kNegligibleModeShare = 1e-4;
// Nodes of the phase functions of the beam, at equal steps of the cosine.
constexpr std::size_t kPhaseNodes = 1025;
constexpr std::size_t kFine = ZenithGrid::kFineSize;

// p11 and p12 of the truncated kinds, [kind][node][p11, p12][lane].
template <class T>
std::vector<T> tabulate_phases(const OrdersMedium& medium) {
  const std::size_t kinds = medium.kinds.size(), lanes = medium.lanes;
  std::vector<T> table(kinds * kPhaseNodes * 2 * lanes);
  for (std::size_t k = 0; kinds > 0 && k < kPhaseNodes; ++k) {
    const double x = -1 + 2 * static_cast<double>(k) / (kPhaseNodes - 1);
    const AngularBasis basis = angular_basis(medium.degree, std::acos(std::clamp(x, -1.0, 1.0)));
    for (std::size_t q = 0; q < kinds; ++q) {
      const TruncatedPhase& kind = medium.kinds[q];
      for (std::size_t w = 0; w < lanes; ++w) {
        double p11 = 0, p12 = 0;
        for (int l = 0; l <= medium.degree; ++l) {
          const std::size_t at = static_cast<std::size_t>(l) * lanes + w;
          p11 += kind.a1[at] * basis.p[moment_index(l, 0)];
          p12 += kind.b1[at] * basis.r[moment_index(l, 0)];
        }
        T* out = &table[((q * kPhaseNodes + k) * 2) * lanes + w];
        out[0] = static_cast<T>(p11);
        out[lanes] = static_cast<T>(p12);
      }
    }
  }
  return table;
}

// Light gathered at one level, some directions at a time: neighbours meet the same levels, whose
// sources are then read once.
template <class T>
class LevelSweep {
 public:
  LevelSweep(const OrdersGrid<T>& grid, const OrdersMedium& medium, bool ground_light,
             std::size_t level, IncomingLight<T>& light)
      : grid_(grid), medium_(medium), ground_light_(ground_light), level_(level), light_(light) {
    air_weight_.resize(grid.lanes);
    ground_weight_.resize(grid.lanes);
    scratch_.resize(kGatherScratch * padded_pairs(grid.pairs));
    for (auto& out : out_) out.resize(grid.pairs * grid.stokes * grid.lanes);
    moment_scratch_.resize(kEmissionBatch * 3 * (static_cast<std::size_t>(grid.moment_degree) + 1) *
                           grid.lanes);
    set_pairs(0, grid.pairs);
    gather_.lanes = grid.lanes;
    gather_.polarised = grid.polarised;
    gather_.nodes = grid.nodes;
    gather_.fine_position = grid.fine_position.data();
    gather_.fine_per_radian = static_cast<T>(1 / (ZenithGrid::kFineStep_deg * kRadPerDeg));
    gather_.scratch = scratch_.data();
  }

  void run(const BeamSource<T>& source, std::span<const T> phase,
           std::span<const T> anisotropic_share) {
    BeamInput<T> beam;
    beam.phase_nodes = kPhaseNodes;
    beam.phase = phase.data();
    beam.anisotropic_share = anisotropic_share.data();
    kind_weight_.resize(medium_.kinds.size() * grid_.lanes);
    // The Earth's shadow has an edge: rays that come near it have more points.
    const auto add_part = [&](std::size_t from, std::size_t to,
                              std::span<const std::size_t> level) {
      set_pairs(from, to);
      for (std::size_t d = 0; d < count_; ++d) {
        for (std::size_t k = 0; k < path_[d].samples.size(); ++k) {
          const auto at = static_cast<std::size_t>(path_[d].samples[k].level);
          add_beam(source, level.empty() ? at : level[at], beam, d, k,
                   &out_[d][from * grid_.stokes * grid_.lanes]);
        }
      }
      set_pairs(0, grid_.pairs);
    };
    each_batch(source.ground, [&](std::span<const PolarDirection> directions) {
      sample(source.day_level_km, kScatteredStep_rad, SourceShape::kLinear, directions);
      add_part(0, grid_.day_pairs, source.day_level);
      sample(source.level_km, kBeamStep_rad, SourceShape::kLinear, directions);
      add_part(grid_.day_pairs, grid_.pairs, {});
    });
  }

  void run(const ScatteredSource<T>& source) {
    const int degree = std::max(2, source.phase_degree);
    for (auto& modes : modes_) {
      modes.resize(grid_.nodes * grid_.stokes * mode_rows(degree) * grid_.lanes);
    }
    for (auto& weight : aerosol_weight_) weight.resize(medium_.kinds.size() * grid_.lanes);
    each_batch(source.ground, [&](std::span<const PolarDirection> directions) {
      sample(grid_.level_km, kScatteredStep_rad, SourceShape::kCubic, directions);
      by_level_.clear();
      for (std::size_t d = 0; d < count_; ++d) {
        for (std::size_t k = 0; k < path_[d].samples.size(); ++k) {
          by_level_.push_back({static_cast<std::size_t>(path_[d].samples[k].level), d, k});
        }
      }
      std::ranges::stable_sort(by_level_, {}, &Point::level);
      for (std::size_t from = 0; from < by_level_.size();) {
        std::size_t to = from + 1;
        while (to < by_level_.size() && to - from < kEmissionBatch &&
               by_level_[to].level == by_level_[from].level) {
          ++to;
        }
        add_scattered(source, std::span(by_level_).subspan(from, to - from));
        from = to;
      }
    });
  }

 private:
  // A sample of one of the batch's rays.
  struct Point {
    std::size_t level, direction, sample;
  };

  const double* weight(std::size_t direction, std::size_t sample) const {
    return &path_[direction].weight[sample * (1 + medium_.kinds.size()) * grid_.lanes];
  }

  template <class Gather>
  void each_batch(std::span<const T> ground, const Gather& gather) {
    const auto all = polar_directions(medium_.truncated.earth_radius_km, grid_.level_km[level_],
                                      grid_.polar_count);
    for (std::size_t first = 0; first < all.size(); first += kEmissionBatch) {
      count_ = std::min(kEmissionBatch, all.size() - first);
      const std::span directions = std::span(all).subspan(first, count_);
      for (std::size_t d = 0; d < count_; ++d) std::ranges::fill(out_[d], T(0));
      gather(directions);
      for (std::size_t d = 0; d < count_; ++d) add_ground(ground, d);
      add_to_light(directions);
    }
  }

  void sample(std::span<const double> source_level_km, double max_angle_rad, SourceShape shape,
              std::span<const PolarDirection> directions) {
    for (std::size_t d = 0; d < directions.size(); ++d) {
      sample_path(medium_.optics, source_level_km, grid_.level_km[level_], directions[d].zenith_rad,
                  max_angle_rad, shape, path_[d]);
    }
  }

  void set_pairs(std::size_t from, std::size_t to) {
    gather_.pairs = to - from;
    gather_.cos_chi = &grid_.cos_chi[from];
    gather_.sin_chi = &grid_.sin_chi[from];
    gather_.cos_phi = &grid_.cos_phi[from];
    gather_.sin_phi = &grid_.sin_phi[from];
  }

  void place(const PathSample& sample) {
    gather_.cos_psi = static_cast<T>(std::cos(sample.central_angle_rad));
    gather_.sin_psi = static_cast<T>(std::sin(sample.central_angle_rad));
  }

  void weigh_air(const double* weight) {
    for (std::size_t w = 0; w < grid_.lanes; ++w) {
      air_weight_[w] = static_cast<T>(3 / (8 * pi) * weight[w]);
    }
  }

  // One point of a ray, at a level of the source, for the pairs set.
  void add_beam(const BeamSource<T>& source, std::size_t at, BeamInput<T>& beam, std::size_t d,
                std::size_t k, T* out) {
    const PathSample& sample = path_[d].samples[k];
    if (source.end[at] == 0) return;
    const double* here = weight(d, k);
    weigh_air(here);
    present_.clear();
    for (std::size_t q = 0; q < medium_.kinds.size(); ++q) {
      bool any = false;
      for (std::size_t i = q * grid_.lanes; i < (q + 1) * grid_.lanes; ++i) {
        kind_weight_[i] = static_cast<T>(here[grid_.lanes + i] / (4 * pi));
        any = any || kind_weight_[i] != 0;
      }
      if (any) present_.push_back(q);
    }
    place(sample);
    gather_.reference = &source.irradiance[at * kFine * grid_.lanes];
    gather_.fine_end = std::min(source.end[at], grid_.fine_end);
    beam.gather = gather_;
    beam.cos_theta = static_cast<T>(std::cos(sample.zenith_rad));
    beam.sin_theta = static_cast<T>(std::sin(sample.zenith_rad));
    beam.lift_rad = &source.lift_rad[at * kFine];
    beam.air_weight = air_weight_.data();
    beam.kinds = present_.size();
    beam.kind = present_.data();
    beam.kind_weight = kind_weight_.data();
    gather_beam(beam, out);
  }

  // Points of one level.
  void add_scattered(const ScatteredSource<T>& source, std::span<const Point> points) {
    const std::size_t lanes = grid_.lanes, all = grid_.zenith.size(), level = points[0].level;
    const bool aerosol = level < grid_.aerosol_levels && source.phase_degree > 0 &&
                         std::ranges::any_of(points, [&](const Point& p) {
                           const double* here = weight(p.direction, p.sample) + lanes;
                           return std::any_of(here, here + medium_.kinds.size() * lanes,
                                              [](double x) { return x != 0; });
                         });
    AirEmission<T> air;
    air.nodes = grid_.nodes;
    air.lanes = lanes;
    air.polarised = grid_.polarised;
    air.degree = aerosol ? std::max(2, source.phase_degree) : 2;
    air.coherency = &source.coherency[level * all * 4 * lanes];
    air.air_weight = air_weight_.data();
    for (std::size_t n = 0; n < points.size(); ++n) {
      const PathSample& sample = path_[points[n].direction].samples[points[n].sample];
      weigh_air(weight(points[n].direction, points[n].sample));
      air.cos_theta = static_cast<T>(std::cos(sample.zenith_rad));
      air.sin_theta = static_cast<T>(std::sin(sample.zenith_rad));
      air_modes(air, modes_[n].data());
    }
    if (aerosol) add_aerosol(source, points, air.degree);
    gather_.reference = &source.reference[level * kFine * lanes];
    gather_.fine_end = grid_.fine_end;
    gather_.stored_degree = air.degree;
    for (std::size_t n = 0; n < points.size(); ++n) {
      place(path_[points[n].direction].samples[points[n].sample]);
      gather_.modes = modes_[n].data();
      gather_.degree =
          aerosol ? significant_degree(air, gather_.modes, static_cast<T>(kNegligibleModeShare))
                  : air.degree;
      gather_modes(gather_, out_[points[n].direction].data());
    }
  }

  void add_aerosol(const ScatteredSource<T>& source, std::span<const Point> points, int degree) {
    const std::size_t lanes = grid_.lanes, kinds = medium_.kinds.size();
    AerosolPoints<T> in;
    in.nodes = grid_.nodes;
    in.lanes = lanes;
    in.polarised = grid_.polarised;
    in.degree = degree;
    in.phase_degree = source.phase_degree;
    in.points = points.size();
    for (std::size_t n = 0; n < points.size(); ++n) {
      const Point& point = points[n];
      const double* here = weight(point.direction, point.sample) + lanes;
      for (std::size_t i = 0; i < kinds * lanes; ++i) {
        aerosol_weight_[n][i] = static_cast<T>(here[i]);
      }
      fill_mode_basis(source.phase_degree, path_[point.direction].samples[point.sample].zenith_rad,
                      true, basis_[n]);
      in.basis[n] = basis_[n].data();
      in.modes[n] = modes_[n].data();
    }
    for (std::size_t q = 0; q < kinds; ++q) {
      const std::size_t at = source.scattered_at[points[0].level * kinds + q];
      if (at == ScatteredSource<T>::kAbsent) continue;
      in.scattered = &source.scattered[at];
      bool any = false;
      for (std::size_t n = 0; n < points.size(); ++n) {
        in.weight[n] = &aerosol_weight_[n][q * lanes];
        any = any || std::any_of(in.weight[n], in.weight[n] + lanes, [](T x) { return x != 0; });
      }
      if (any) add_aerosol_modes(in);
    }
  }

  void add_ground(std::span<const T> ground, std::size_t d) {
    if (!path_[d].hits_ground || !ground_light_) return;
    for (std::size_t w = 0; w < grid_.lanes; ++w) {
      ground_weight_[w] =
          static_cast<T>(path_[d].ground_transmittance[w] * medium_.ground_albedo[w] / pi);
    }
    gather_.cos_psi = static_cast<T>(std::cos(path_[d].ground_angle_rad));
    gather_.sin_psi = static_cast<T>(std::sin(path_[d].ground_angle_rad));
    gather_.reference = ground.data();
    gather_.fine_end = grid_.fine_end;
    gather_ground(gather_, ground_weight_.data(), grid_.stokes * grid_.lanes, out_[d].data());
  }

  // From radiances in the batch's directions to moments of the light that arrives.
  void add_to_light(std::span<const PolarDirection> directions) {
    const std::size_t lanes = grid_.lanes, all = grid_.zenith.size(), azimuths = grid_.azimuths();
    MomentInput<T> in;
    in.nodes = grid_.nodes;
    in.azimuths = azimuths;
    in.lanes = lanes;
    in.polarised = grid_.polarised;
    in.directions = directions.size();
    in.cos_phi = grid_.cos_azimuth.data();
    in.sin_phi = grid_.sin_azimuth.data();
    in.scratch = moment_scratch_.data();
    const bool aerosol = level_ < grid_.aerosol_levels;
    in.phase_degree = aerosol ? grid_.moment_degree : 0;
    for (std::size_t d = 0; d < directions.size(); ++d) {
      in.cos_theta[d] = static_cast<T>(std::cos(directions[d].zenith_rad));
      in.sin_theta[d] = static_cast<T>(std::sin(directions[d].zenith_rad));
      in.weight[d] = static_cast<T>(2 * directions[d].weight * pi / static_cast<double>(azimuths));
      in.light[d] = out_[d].data();
      if (!aerosol) continue;
      fill_mode_basis(grid_.moment_degree, directions[d].zenith_rad, false, basis_[d]);
      in.basis[d] = basis_[d].data();
    }
    add_moments(in, &light_.coherency[level_ * all * 4 * lanes],
                aerosol ? &light_.moments[level_ * all * grid_.moments * lanes] : nullptr);
    if (level_ > 0) return;
    for (std::size_t d = 0; d < directions.size(); ++d) {
      if (directions[d].zenith_rad >= pi / 2) continue;
      const T flux = in.weight[d] * in.cos_theta[d];
      for (std::size_t i = 0; i < grid_.pairs; ++i) {
        const T* I = &out_[d][i * grid_.stokes * lanes];
        T* ground = &light_.ground[i / azimuths * lanes];
        for (std::size_t w = 0; w < lanes; ++w) ground[w] += flux * I[w];
      }
    }
  }

  const OrdersGrid<T>& grid_;
  const OrdersMedium& medium_;
  bool ground_light_;
  std::size_t level_;
  IncomingLight<T>& light_;

  std::size_t count_ = 0;  // directions of the batch
  std::array<SampledPath, kEmissionBatch> path_;
  std::array<std::vector<T>, kEmissionBatch> out_;  // [pair][stokes][lane]
  std::array<std::vector<T>, kEmissionBatch> modes_, basis_, aerosol_weight_;
  std::vector<Point> by_level_;
  std::vector<std::size_t> present_;  // kinds of aerosol at a point
  GatherInput<T> gather_;
  std::vector<T> air_weight_, ground_weight_, kind_weight_, scratch_, moment_scratch_;
};

// Runs one level after another, in parallel.
template <class T, class Level>
IncomingLight<T> sweep_levels(const OrdersGrid<T>& grid, const OrdersMedium& medium,
                              bool ground_light, const RunControl& control, const Level& level) {
  IncomingLight<T> light(grid);
  std::atomic<bool> stopped = false;
  const auto one = [&](std::size_t i) {
    if (stopped) return;
    try {
      control.check();
    } catch (const Cancelled&) {
      stopped = true;
      return;
    }
    LevelSweep<T> here(grid, medium, ground_light, i, light);
    level(here);
  };
  // One by one: levels differ in work by far.
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, grid.level_km.size(), 1),
      [&](const tbb::blocked_range<std::size_t>& r) {
        for (std::size_t i = r.begin(); i < r.end(); ++i) one(i);
      },
      tbb::simple_partitioner());
  control.check();
  return light;
}

}  // namespace

template <class T>
IncomingLight<T> sweep(const OrdersGrid<T>& grid, const OrdersMedium& medium,
                       const BeamSource<T>& source, bool ground_light, const RunControl& control) {
  const std::vector<T> phase = tabulate_phases<T>(medium);
  const std::vector<T> share(medium.anisotropic_share.begin(), medium.anisotropic_share.end());
  return sweep_levels(grid, medium, ground_light, control,
                      [&](LevelSweep<T>& level) { level.run(source, phase, share); });
}

template <class T>
IncomingLight<T> sweep(const OrdersGrid<T>& grid, const OrdersMedium& medium,
                       const ScatteredSource<T>& source, bool ground_light,
                       const RunControl& control) {
  return sweep_levels(grid, medium, ground_light, control,
                      [&](LevelSweep<T>& level) { level.run(source); });
}

template IncomingLight<float> sweep(const OrdersGrid<float>&, const OrdersMedium&,
                                    const BeamSource<float>&, bool, const RunControl&);
template IncomingLight<double> sweep(const OrdersGrid<double>&, const OrdersMedium&,
                                     const BeamSource<double>&, bool, const RunControl&);
template IncomingLight<float> sweep(const OrdersGrid<float>&, const OrdersMedium&,
                                    const ScatteredSource<float>&, bool, const RunControl&);
template IncomingLight<double> sweep(const OrdersGrid<double>&, const OrdersMedium&,
                                     const ScatteredSource<double>&, bool, const RunControl&);

}  // namespace twilight
