#include "sim/exchange.h"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "sim/aerosol_pass.h"
#include "sim/azimuth_sampling.h"
#include "sim/elapsed_time.h"
#include "sim/emission_fractions.h"
#include "sim/exchange_rings.h"
#include "sim/first_event.h"
#include "sim/kernel_store.h"
#include "sim/passive_shells.h"
#include "sim/ring_pair_schedule.h"
#include "sim/ring_pass.h"

namespace twilight {
namespace {

// Modes kept in azimuth: the field's finest features are as wide as the smoothest kernels
// let through; 24 modes resolve 7.5 degrees.
constexpr int kMaxModes = 24;

std::size_t idx(int i) { return static_cast<std::size_t>(i); }

// The paper's first aerosol event is summed directly: Henyey-Greenstein has modes that fall
// like g^m, and the shadow's edge adds some of its own.
int aerosol_source_modes(const ExchangeOptics& optics, int divisions, double tolerance) {
  if (tolerance <= 0) return 0;
  float largest_g = 0.0F;
  for (std::size_t i = 0; i < optics.aerosol.size(); ++i) {
    if (optics.aerosol[i] > 0) largest_g = std::max(largest_g, std::abs(optics.asymmetry[i]));
  }
  constexpr int kShadowModes = 8;
  const double fall =
      std::log(tolerance) / std::log(std::clamp(static_cast<double>(largest_g), 1e-6, 0.999));
  return std::min(divisions, kShadowModes + static_cast<int>(std::ceil(fall)));
}

std::vector<float> albedo_lanes(const ExchangeOptions& options, std::size_t wavelengths,
                                std::size_t lanes) {
  std::vector<float> albedo(lanes, 0.0F);  // lanes beyond the wavelengths stay dark
  for (std::size_t w = 0; w < std::min(wavelengths, options.ground_albedo.size()); ++w) {
    albedo[w] = static_cast<float>(options.ground_albedo[w]);
  }
  return albedo;
}

class ExchangeSolver {
 public:
  ExchangeSolver(const Medium& medium, const CellGrid& grid, const CellGrid* all_cells,
                 const DirectSunlight& sunlight, const SunGeometry& sun,
                 const ExchangeOptics& optics, const ExchangeOptions& options,
                 const RunControl& control);
  ExchangeResult solve();

 private:
  struct Workspace {
    RingPairKernel kernel;
    std::vector<float> scaled, pair_modes;
    std::vector<double> pair_sum;  // [wavelength]
    std::uint64_t samples = 0;
  };

  void find_first_event();
  void scale_aerosol_power();
  void evaluate_kernels();
  void scatter_aerosol(std::size_t a, std::size_t b, RingPairKernel& kernel);
  void scatter_aerosol_again();
  void balance_rows();
  void add_row_sums(std::vector<double>& air, std::vector<double>& earth);
  void start_sources();
  void start_rescaling();
  void set_rescale(const std::vector<double>& all, const std::vector<double>& active);
  void pass(int number);
  void exchange_scalar(std::size_t a, std::size_t b, Workspace& ws);
  void exchange_moments(std::size_t a, std::size_t b, Workspace& ws);
  void keep_ledger();
  void scatter(std::size_t ring);
  std::vector<double> power_of_sources() const;
  std::vector<double> power_of_passive_shells() const;
  void to_modes(const float* node, float* mode) const;
  void to_nodes(const float* mode, float* node) const;
  void collect_field();

  const Medium& medium_;
  const CellGrid* all_cells_;
  const DirectSunlight& sunlight_;
  const SunGeometry& sun_;
  const ExchangeOptions& options_;
  const RunControl& control_;
  const std::vector<float> albedo_;
  ExchangeRings rings_;
  const int passes_;
  const bool aerosol_first_;  // Henyey-Greenstein once, then isotropic
  const bool need_rows_;
  const int nm_;  // moments: one number per cell where every later event is isotropic
  const AzimuthModes modes_;
  const std::size_t block_;  // floats per ring in mode space
  // Rings that exchange light: the ground also where it takes light and sends none.
  const std::size_t n_pairs_;
  KernelStore store_;
  tbb::enumerable_thread_specific<Workspace> workspaces_;

  FirstEvent first_;
  std::vector<unsigned char> lit_ring_;
  std::vector<float> aerosol_field_;                  // [ring][node][lane], first aerosol event
  std::vector<float> source_, field_, total_, sent_;  // [ring][mode][moment][lane]
  std::vector<float> rescale_;                        // [lane]
  std::vector<PassiveRing> passive_;
  ExchangeResult result_;
};

bool has_aerosol(const ExchangeOptics& optics) {
  return std::ranges::any_of(optics.aerosol, [](float a) { return a > 0; });
}

ExchangeSolver::ExchangeSolver(const Medium& medium, const CellGrid& grid,
                               const CellGrid* all_cells, const DirectSunlight& sunlight,
                               const SunGeometry& sun, const ExchangeOptics& optics,
                               const ExchangeOptions& options, const RunControl& control)
    : medium_(medium),
      all_cells_(all_cells),
      sunlight_(sunlight),
      sun_(sun),
      options_(options),
      control_(control),
      albedo_(albedo_lanes(options, medium.wavelengths(), optics.lanes)),
      rings_(medium, grid, optics, albedo_),
      passes_(std::max(0, options.scattering_orders - 1)),
      aerosol_first_(options.similarity && has_aerosol(optics)),
      need_rows_(rings_.means && passes_ > 0),
      nm_(options.rayleigh || !options.similarity ? kMoments : 1),
      modes_(rings_.S, std::min(kMaxModes, rings_.nodes)),
      block_(idx(modes_.modes) * idx(nm_) * rings_.L),
      n_pairs_(need_rows_ ? rings_.all.size() : rings_.n_all),
      store_(rings_.transport, std::span(rings_.points).first(passes_ > 0 ? n_pairs_ : 0),
             rings_.n_air, modes_, options.azimuth_tolerance,
             aerosol_first_ ? aerosol_source_modes(optics, rings_.S, options.azimuth_tolerance) : 0,
             nm_ == 1 ? KeptKernels::kModes : KeptKernels::kValues),
      workspaces_([this] {
        Workspace w;
        w.kernel.resize(rings_.S, rings_.L, static_cast<int>(medium_.layers()));
        w.scaled.assign((idx(rings_.nodes) + 16) * rings_.L, 0.0F);
        w.pair_modes.assign(idx(modes_.modes) * rings_.L, 0.0F);
        return w;
      }) {}

// Power scattered out of the direct beam in every cell.
void ExchangeSolver::find_first_event() {
  first_ = first_event(medium_, rings_.grid, rings_.n_all, sunlight_, sun_, rings_.optics,
                       aerosol_first_, albedo_, nm_);
  if (!aerosol_first_) return;
  lit_ring_.assign(n_pairs_, 0);
  for (std::size_t i = 0; i < rings_.n_air; ++i) {
    const auto* lit = &first_.lit[i * idx(rings_.nodes)];
    lit_ring_[i] = std::any_of(lit, lit + rings_.nodes, [](auto l) { return l != 0; });
  }
}

// What leaves a cell: its emission less what its own air takes.
void ExchangeSolver::scale_aerosol_power() {
  const std::size_t row = idx(rings_.nodes) * rings_.L;
  for (std::size_t k = 0; k < first_.aerosol_power.size(); ++k) {
    first_.aerosol_power[k] *= rings_.ro.own_share[k / row * rings_.L + k % rings_.L];
  }
}

// Light of the first aerosol event between two rings, both ways; the kernel goes from b to a.
void ExchangeSolver::scatter_aerosol(std::size_t a, std::size_t b, RingPairKernel& kernel) {
  const std::size_t row = idx(rings_.nodes) * rings_.L;
  const auto send = [&](std::size_t from, std::size_t to) {
    first_event_pass(kernel, modes_, &first_.aerosol_power[from * row],
                     &first_.lit[from * idx(rings_.nodes)], &first_.asymmetry[from * rings_.L],
                     sun_.elevation_rad, &aerosol_field_[to * row]);
  };
  if (lit_ring_[b] != 0) send(b, a);
  if (a == b || lit_ring_[a] == 0) return;
  kernel.turn_round(rings_.points[b], rings_.points[a], false);
  send(a, b);
}

// Kernels are symmetric in the pair: evaluated once, for both directions and all passes. Where the
// sources of the first aerosol event are known by now they take the same turn.
void ExchangeSolver::evaluate_kernels() {
  const bool with_aerosol = aerosol_first_ && !need_rows_;
  if (aerosol_first_) aerosol_field_.assign(n_pairs_ * idx(rings_.nodes) * rings_.L, 0.0F);
  if (with_aerosol) scale_aerosol_power();
  for_each_ring_pair(
      n_pairs_,
      [&](std::size_t a, std::size_t b) {
        control_.check();
        Workspace& ws = workspaces_.local();
        if (store_.evaluate(a, b, ws.kernel, ws.samples) && with_aerosol) {
          scatter_aerosol(a, b, ws.kernel);
        }
      },
      [&](double fraction) { control_.report("exchange: kernels", fraction); });
  std::uint64_t samples = 0;
  for (const Workspace& ws : workspaces_) samples += ws.samples;
  result_.report.kernel_evaluations = samples * rings_.W;
  if (!need_rows_) return;
  balance_rows();
  if (aerosol_first_) scatter_aerosol_again();
}

void ExchangeSolver::scatter_aerosol_again() {
  scale_aerosol_power();
  for_each_ring_pair(
      n_pairs_,
      [&](std::size_t a, std::size_t b) {
        control_.check();
        Workspace& ws = workspaces_.local();
        if (store_.fetch(a, b, false, ws.kernel)) scatter_aerosol(a, b, ws.kernel);
      },
      [](double) {});
}

// Light of every air ring that the kernels bring to all other cells, and to the ground,
// [ring][lane].
void ExchangeSolver::add_row_sums(std::vector<double>& air, std::vector<double>& earth) {
  const std::size_t L = rings_.L;
  const auto add = [&](const std::vector<double>& pair, std::size_t from, std::size_t to) {
    const bool to_air = to < rings_.n_air;
    double* sum = to_air ? &air[from * L] : &earth[from * L];
    for (std::size_t w = 0; w < rings_.W; ++w) {
      const double size = to_air ? static_cast<double>(rings_.ro.extinction[to * L + w]) *
                                       static_cast<double>(rings_.ro.own_share[to * L + w])
                                 : rings_.all[to].volume_km3;
      sum[w] += pair[w] * size;
    }
  };
  for_each_ring_pair(
      n_pairs_,
      [&](std::size_t a, std::size_t b) {
        control_.check();
        Workspace& ws = workspaces_.local();
        if (!store_.fetch(a, b, false, ws.kernel)) return;
        std::vector<double>& pair = ws.pair_sum;
        pair.assign(rings_.W, 0.0);
        for (std::size_t k = 0; k < idx(ws.kernel.samples); ++k) {
          const double weight = static_cast<double>(ws.kernel.receive[k * kMoments]) *
                                static_cast<double>(ws.kernel.emit[k * kMoments]);
          for (std::size_t w = 0; w < rings_.W; ++w) {
            pair[w] += weight * static_cast<double>(ws.kernel.value[k * L + w]);
          }
        }
        add(pair, b, a);
        if (a != b && a < rings_.n_air) add(pair, a, b);
      },
      [](double) {});
}

// Rows of the exchange: what a cell emits must arrive, reach the ground or leave. The
// part that point-to-point kernels miss is what the cell's neighbourhood takes itself. Rows that
// would bring more than what interacts at all are shortened, both ways.
void ExchangeSolver::balance_rows() {
  RingOptics& ro = rings_.ro;
  const std::size_t L = rings_.L, W = rings_.W, n_air = rings_.n_air;
  tbb::parallel_for(std::size_t{0}, n_air, [&](std::size_t s) {
    control_.check();
    emission_fractions(rings_.transport, rings_.grid, rings_.all[s], W, &ro.escape[s * W],
                       &ro.ground[s * W]);
  });
  std::size_t clipped = 0;
  std::vector<double> air(n_air * L, 0.0), earth(n_air * L, 0.0);
  add_row_sums(air, earth);
  std::vector<float> fit(rings_.all.size() * L, 1.0F);
  for (std::size_t s = 0; s < n_air; ++s) {
    for (std::size_t w = 0; w < W; ++w) {
      const double interacting = 1 - ro.escape[s * W + w] - ro.ground[s * W + w];
      const double brought = static_cast<double>(ro.own_share[s * L + w]) * air[s * L + w];
      if (brought <= interacting) continue;
      ++clipped;
      fit[s * L + w] = static_cast<float>(std::max(0.0, interacting) / brought);
    }
  }
  for (std::size_t k = 0; k < fit.size(); ++k) ro.own_share[k] *= fit[k];
  std::ranges::fill(air, 0.0);
  std::ranges::fill(earth, 0.0);
  add_row_sums(air, earth);
  for (std::size_t s = 0; s < n_air; ++s) {
    for (std::size_t w = 0; w < W; ++w) {
      const double own = static_cast<double>(ro.own_share[s * L + w]);
      const double interacting = 1 - ro.escape[s * W + w] - ro.ground[s * W + w];
      const double rest = interacting - own * air[s * L + w];
      const double lit_ground = earth[s * L + w] * own;
      ro.self[s * L + w] = static_cast<float>(
          std::max(0.0, rest) / std::max(1e-30, static_cast<double>(ro.extinction[s * L + w])));
      ro.ground_scale[s * L + w] = static_cast<float>(
          lit_ground > 1e-12 ? std::min(10.0, ro.ground[s * W + w] / lit_ground) : 1.0);
    }
  }
  result_.report.clipped_row_share =
      static_cast<double>(clipped) / std::max(1.0, static_cast<double>(n_air * W));
}

// Node values to modes: cosine series for even moments, sine series for odd ones.
void ExchangeSolver::to_modes(const float* node, float* mode) const {
  const std::size_t L = rings_.L;
  const int S = rings_.S;
  std::fill(mode, mode + block_, 0.0F);
  for (int m = 0; m < modes_.modes; ++m) {
    const double norm = (m == 0 || 2 * m == S) ? 1.0 / S : 2.0 / S;
    for (int j = 0; j < rings_.nodes; ++j) {
      const double twice = (j == 0 || 2 * j == S) ? 1.0 : 2.0;
      const auto at = idx(m) * idx(rings_.nodes) + idx(j);
      const auto c = static_cast<float>(norm * twice) * modes_.cosine[at];
      const auto s = static_cast<float>(norm * twice) * modes_.sine[at];
      for (int q = 0; q < nm_; ++q) {
        const float f = q < kEvenMoments ? c : s;
        const float* src = node + (idx(j) * idx(nm_) + idx(q)) * L;
        float* dst = mode + (idx(m) * idx(nm_) + idx(q)) * L;
        for (std::size_t w = 0; w < L; ++w) dst[w] += f * src[w];
      }
    }
  }
}

void ExchangeSolver::to_nodes(const float* mode, float* node) const {
  const std::size_t L = rings_.L;
  for (int j = 0; j < rings_.nodes; ++j) {
    for (int q = 0; q < nm_; ++q) {
      float* dst = node + (idx(j) * idx(nm_) + idx(q)) * L;
      for (int m = 0; m < modes_.modes; ++m) {
        const auto at = idx(m) * idx(rings_.nodes) + idx(j);
        const float f = q < kEvenMoments ? modes_.cosine[at] : modes_.sine[at];
        const float* src = mode + (idx(m) * idx(nm_) + idx(q)) * L;
        for (std::size_t w = 0; w < L; ++w) dst[w] += f * src[w];
      }
    }
  }
}

void ExchangeSolver::start_sources() {
  const std::size_t n = rings_.n_all * block_;
  source_.resize(n);
  field_.resize(n);
  sent_.resize(n);
  total_.assign(n, 0.0F);
  tbb::parallel_for(std::size_t{0}, rings_.n_all, [&](std::size_t i) {
    to_modes(&first_.source[i * idx(rings_.nodes) * idx(nm_) * rings_.L], &source_[i * block_]);
  });
  result_.report.escaped.assign(rings_.W, 0.0);
  result_.report.ground_absorbed.assign(rings_.W, 0.0);
  result_.report.event_power.push_back(first_.power);
}

// The paper's ratio: what all shells emit over what the active ones do.
void ExchangeSolver::start_rescaling() {
  rescale_.assign(rings_.L, 1.0F);
  if (!options_.rescale || all_cells_ == nullptr) return;
  const FirstEvent every = first_event(medium_, *all_cells_, all_cells_->air_rings(), sunlight_,
                                       sun_, rings_.optics, aerosol_first_, albedo_, 1);
  set_rescale(every.power, first_.power);
  for (std::size_t w = 0; w < rings_.W; ++w) result_.report.rescale_factor.push_back(rescale_[w]);
  // Where every active shell's cells have their centres outside the air none is interpolated.
  if (rings_.n_air > 0) passive_ = passive_rings(rings_.grid, *all_cells_);
}

void ExchangeSolver::set_rescale(const std::vector<double>& all,
                                 const std::vector<double>& active) {
  for (std::size_t w = 0; w < rings_.W; ++w) {
    // Where no active cell emits there is nothing to rescale.
    rescale_[w] = active[w] > 0 ? static_cast<float>(std::min(all[w] / active[w], 1e6)) : 1.0F;
  }
}

// One number per cell: a product of cosine modes.
void ExchangeSolver::exchange_scalar(std::size_t a, std::size_t b, Workspace& ws) {
  const std::size_t L = rings_.L;
  const float* k = store_.cosine_modes(a, b, ws.kernel, ws.pair_modes);
  if (k == nullptr) return;
  const std::size_t used = idx(store_.modes(a, b)) * L;
  if (a == b) {
    multiply_add(k, &sent_[b * block_], 1.0F, used, &field_[a * block_]);
    return;
  }
  const bool from_ground = a >= rings_.n_air;
  if (from_ground) {
    // The same correction both ways keeps a pair with the ground reciprocal.
    for (std::size_t i = 0; i < used; ++i) {
      ws.scaled[i] = k[i] * rings_.ro.ground_scale[b * L + i % L];
    }
    k = ws.scaled.data();
  }
  // From air to ground; the ground's Lambertian emission is four cosines.
  multiply_add_both(k, &sent_[a * block_], from_ground ? 4.0F : 1.0F, &sent_[b * block_], 1.0F,
                    used, &field_[a * block_], &field_[b * block_]);
}

void ExchangeSolver::exchange_moments(std::size_t a, std::size_t b, Workspace& ws) {
  const std::size_t L = rings_.L;
  if (!store_.fetch(a, b, true, ws.kernel)) return;
  if (a >= rings_.n_air) {
    for (std::size_t i = 0; i < idx(ws.kernel.samples) * L; ++i) {
      ws.scaled[i] = ws.kernel.value[i] * rings_.ro.ground_scale[b * L + i % L];
    }
    ws.kernel.value = ws.scaled.data();
  }
  moment_pass(ws.kernel, modes_, &sent_[b * block_], &field_[a * block_]);
  if (a == b) return;
  ws.kernel.turn_round(rings_.points[b], rings_.points[a], true);
  moment_pass(ws.kernel, modes_, &sent_[a * block_], &field_[b * block_]);
}

void ExchangeSolver::keep_ledger() {
  const double S = rings_.S;
  for (std::size_t i = 0; i < rings_.n_air; ++i) {
    for (std::size_t w = 0; w < rings_.W; ++w) {
      const double emitted = S * static_cast<double>(source_[i * block_ + w]);
      result_.report.escaped[w] += emitted * rings_.ro.escape[i * rings_.W + w];
      result_.report.ground_absorbed[w] +=
          (1.0 - static_cast<double>(albedo_[w])) * emitted * rings_.ro.ground[i * rings_.W + w];
    }
  }
}

// Own light, own attenuation, and the next event's source of a ring.
void ExchangeSolver::scatter(std::size_t ring) {
  const std::size_t L = rings_.L;
  const RingOptics& ro = rings_.ro;
  const bool air = ring < rings_.n_air;
  float* f = &field_[ring * block_];
  float* q = &source_[ring * block_];
  float* sum = &total_[ring * block_];
  for (int m = 0; m < modes_.modes; ++m) {
    for (int c = 0; c < nm_; ++c) {
      const bool first = c == kFr || c == kFz || c == kFa;
      // Moments that a uniform neighbourhood sends itself: the mean of (w.F)w is F/3,
      // of (w.S.w)(ww - 1/3) it is 2S/15; off-diagonal sources carry S once.
      const float gain = c == kJ ? 1.0F : (first ? 1.0F / 3 : 2.0F / 15);
      const float* s = c == kJ ? &ro.s0[ring * L] : (first ? &ro.s1[ring * L] : &ro.s2[ring * L]);
      for (std::size_t w = 0; w < L; ++w) {
        const std::size_t at = (idx(m) * idx(nm_) + idx(c)) * L + w;
        float value = f[at] * ro.own_share[ring * L + w] * rescale_[w];
        if (air) value += gain * ro.self[ring * L + w] * q[at];
        f[at] = value;
        sum[at] += value;
        if (air) {
          // (emission is spread over the cell as its own light is: source side share)
          q[at] = value * s[w];
        } else {
          q[at] =
              c == kJ ? value * albedo_[w] * static_cast<float>(rings_.all[ring].volume_km3) : 0.0F;
        }
      }
    }
  }
}

std::vector<double> ExchangeSolver::power_of_sources() const {
  std::vector<double> p(rings_.W, 0.0);
  for (std::size_t i = 0; i < rings_.n_air; ++i) {
    for (std::size_t w = 0; w < rings_.W; ++w) {
      p[w] += static_cast<double>(rings_.S) * static_cast<double>(source_[i * block_ + w]);
    }
  }
  return p;
}

// Passive shells by linear interpolation of the arriving light between active ones.
std::vector<double> ExchangeSolver::power_of_passive_shells() const {
  std::vector<double> all(rings_.W, 0.0);
  for (std::size_t i = 0; i < passive_.size(); ++i) {
    const PassiveRing& p = passive_[i];
    for (const auto& [layer, volume] : all_cells_->rings()[i].layer_volume_km3) {
      for (std::size_t w = 0; w < rings_.W; ++w) {
        const double light = p.weight[0] * static_cast<double>(field_[p.ring[0] * block_ + w]) +
                             p.weight[1] * static_cast<double>(field_[p.ring[1] * block_ + w]);
        all[w] += rings_.S * light * volume *
                  static_cast<double>(rings_.optics.s0[idx(layer) * rings_.L + w]);
      }
    }
  }
  return all;
}

// One scattering event to the next.
void ExchangeSolver::pass(int number) {
  const std::size_t L = rings_.L;
  tbb::parallel_for(std::size_t{0}, rings_.n_all, [&](std::size_t i) {
    // What leaves a cell: its emission less what its own air takes.
    for (std::size_t k = 0; k < block_; ++k) {
      sent_[i * block_ + k] = source_[i * block_ + k] * rings_.ro.own_share[i * L + k % L];
    }
    float* out = &field_[i * block_];
    if (number > 0 || !aerosol_first_) {
      std::fill_n(out, block_, 0.0F);
      return;
    }
    std::vector<float> node(idx(rings_.nodes) * idx(nm_) * L, 0.0F);
    for (std::size_t j = 0; j < idx(rings_.nodes); ++j) {
      std::copy_n(&aerosol_field_[(i * idx(rings_.nodes) + j) * L], L, &node[j * idx(nm_) * L]);
    }
    to_modes(node.data(), out);
  });
  for_each_ring_pair(
      rings_.n_all,
      [&](std::size_t a, std::size_t b) {
        control_.check();
        Workspace& ws = workspaces_.local();
        if (nm_ == 1) {
          exchange_scalar(a, b, ws);
        } else {
          exchange_moments(a, b, ws);
        }
      },
      [&](double fraction) { control_.report("exchange", (number + fraction) / passes_); });
  keep_ledger();
  tbb::parallel_for(std::size_t{0}, rings_.n_all, [&](std::size_t i) { scatter(i); });
  result_.report.event_power.push_back(power_of_sources());
  if (!passive_.empty()) {
    set_rescale(power_of_passive_shells(), result_.report.event_power.back());
  }
}

// The sum over all events at the azimuth nodes.
void ExchangeSolver::collect_field() {
  const std::size_t L = rings_.L, nodes = idx(rings_.nodes), nm = idx(nm_);
  CellField& cells = result_.field;
  cells.lanes = L;
  cells.nodes = rings_.nodes;
  cells.moments = nm_;
  cells.values.assign(rings_.n_air * nodes * nm * L, 0.0F);
  tbb::parallel_for(std::size_t{0}, rings_.n_air, [&](std::size_t i) {
    float* v = &cells.values[i * nodes * nm * L];
    to_nodes(&total_[i * block_], v);
    for (std::size_t j = 0; j < nodes; ++j) {
      for (std::size_t w = 0; w < L; ++w) {
        float& mean = v[j * nm * L + kJ * L + w];
        mean = std::max(mean, 0.0F);  // truncated series may ring below zero in the dark
      }
    }
  });
  if (!rings_.ground) return;
  // By diffuse light; the direct part is exact elsewhere.
  result_.ground_exitance.assign((rings_.n_all - rings_.n_air) * nodes * L, 0.0F);
  std::vector<float> node(nodes * nm * L);
  for (std::size_t i = rings_.n_air; i < rings_.n_all; ++i) {
    std::ranges::fill(node, 0.0F);
    to_nodes(&total_[i * block_], node.data());
    for (std::size_t j = 0; j < nodes; ++j) {
      for (std::size_t w = 0; w < L; ++w) {
        result_.ground_exitance[((i - rings_.n_air) * nodes + j) * L + w] =
            albedo_[w] * std::max(0.0F, node[j * nm * L + w]);
      }
    }
  }
}

ExchangeResult ExchangeSolver::solve() {
  ExchangeReport& report = result_.report;
  report.shells = rings_.grid.all_shells();
  report.active_shells = static_cast<int>(rings_.grid.shells().size());
  report.active_rings = rings_.n_air;
  report.ground_rings = rings_.all.size() - rings_.n_air;
  report.active_cells = rings_.n_air * idx(rings_.S);
  report.azimuth_modes = modes_.modes;
  if (all_cells_ != nullptr) {
    report.rings = all_cells_->air_rings();
    report.cells = report.rings * idx(rings_.S);
  }
  control_.report("exchange: first event", 0.0);
  auto stage = Clock::now();
  find_first_event();
  start_sources();
  start_rescaling();
  report.first_event_seconds = seconds_since(stage);

  stage = Clock::now();
  if (passes_ > 0) evaluate_kernels();
  report.kernels_seconds = seconds_since(stage);

  stage = Clock::now();
  for (int number = 0; number < passes_; ++number) pass(number);
  report.passes_seconds = seconds_since(stage);
  collect_field();
  return std::move(result_);
}

}  // namespace

double cos_solar_zenith(const SunGeometry& sun, double earth_radius_km, double observer_height_km,
                        double rho_km, double azimuth_rad, double z_km) {
  const double up = earth_radius_km + observer_height_km + z_km;
  const double radius = std::hypot(rho_km, up);
  return std::clamp((std::cos(sun.elevation_rad) * rho_km * std::cos(azimuth_rad) +
                     std::sin(sun.elevation_rad) * up) /
                        radius,
                    -1.0, 1.0);
}

ExchangeResult solve_exchange(const Medium& medium, const CellGrid& grid, const CellGrid* all_cells,
                              const DirectSunlight& sunlight, const SunGeometry& sun,
                              const ExchangeOptics& optics, const ExchangeOptions& options,
                              const RunControl& control) {
  return ExchangeSolver(medium, grid, all_cells, sunlight, sun, optics, options, control).solve();
}

}  // namespace twilight
