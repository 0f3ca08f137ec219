// The kernels of the successive orders, at the sizes of the default grid: 72 nodes, 16 azimuths.
// Argument 1: wavelengths (8 or 16 lanes), argument 2: degree. "flop" counts a fused multiply-add
// as two; "bytes" what is loaded and stored, caches not thought of.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/angular_moments.h"
#include "sim/emission_kernel.h"
#include "sim/orders_kernel.h"
#include "sim/zenith_grid.h"

namespace twilight {
namespace {

using benchmark::Counter;
constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr std::size_t kNodes = 72, kAzimuths = 16, kStokes = 3;
constexpr double kVectorFloats = sizeof(float);

void count_work(benchmark::State& state, double flop, double floats) {
  const auto rounds = static_cast<double>(state.iterations());
  state.counters["flop"] = Counter(rounds * flop, Counter::kIsRate, Counter::kIs1000);
  state.counters["bytes"] =
      Counter(rounds * floats * kVectorFloats, Counter::kIsRate, Counter::kIs1024);
}

// Starts all over the day and the twilight, one point 0.5 degrees away.
struct BenchPairs {
  ZenithGrid grid{1.0};
  std::vector<float> cos_chi, sin_chi, cos_phi, sin_phi, fine_position, reference, scratch, out;
  GatherInput<float> in;

  explicit BenchPairs(std::size_t lanes) {
    for (std::size_t j = 0; j < kNodes; ++j) {
      for (std::size_t q = 0; q < kAzimuths; ++q) {
        const double chi = grid.zenith_rad()[j];
        const double phi = (static_cast<double>(q) + 0.5) * std::numbers::pi / kAzimuths;
        cos_chi.push_back(static_cast<float>(std::cos(chi)));
        sin_chi.push_back(static_cast<float>(std::sin(chi)));
        cos_phi.push_back(static_cast<float>(std::cos(phi)));
        sin_phi.push_back(static_cast<float>(std::sin(phi)));
      }
    }
    fine_position.assign(grid.fine_position().begin(), grid.fine_position().end());
    reference.assign(ZenithGrid::kFineSize * lanes, 0.5F);
    in.pairs = kNodes * kAzimuths;
    scratch.resize(kGatherScratch * padded_pairs(in.pairs));
    out.assign(in.pairs * kStokes * lanes, 0.0F);
    in.cos_chi = cos_chi.data();
    in.sin_chi = sin_chi.data();
    in.cos_phi = cos_phi.data();
    in.sin_phi = sin_phi.data();
    in.cos_psi = static_cast<float>(std::cos(0.5 * kRadPerDeg));
    in.sin_psi = static_cast<float>(std::sin(0.5 * kRadPerDeg));
    in.lanes = lanes;
    in.nodes = kNodes;
    in.fine_position = fine_position.data();
    in.fine_per_radian = static_cast<float>(1 / (ZenithGrid::kFineStep_deg * kRadPerDeg));
    in.reference = reference.data();
    in.fine_end = static_cast<std::size_t>(126 / ZenithGrid::kFineStep_deg);
    in.scratch = scratch.data();
  }
};

template <auto kGather>
void GatherModes(benchmark::State& state) {
  const auto lanes = static_cast<std::size_t>(state.range(0));
  const auto degree = static_cast<int>(state.range(1));
  BenchPairs pairs(lanes);
  const std::vector<float> modes(kNodes * kStokes * mode_rows(degree) * lanes, 0.1F);
  pairs.in.degree = pairs.in.stored_degree = degree;
  pairs.in.modes = modes.data();
  for (auto _ : state) {
    kGather(pairs.in, pairs.out.data());
    benchmark::ClobberMemory();
  }
  // Four taps and one wave per mode and Stokes parameter.
  const double values = static_cast<double>(pairs.in.pairs * kStokes * lanes) * (degree + 1);
  count_work(state, values * (4 + 1) * 2, values * 4);
}
BENCHMARK(GatherModes<gather_modes<float>>)
    ->Name("GatherModesSimd")
    ->ArgsProduct({{8, 16}, {2, 8, 16}});
BENCHMARK(GatherModes<gather_modes_scalar<float>>)
    ->Name("GatherModesScalar")
    ->ArgsProduct({{8}, {2, 8}});

template <auto kGather>
void GatherBeam(benchmark::State& state) {
  const auto lanes = static_cast<std::size_t>(state.range(0));
  const auto kinds = static_cast<std::size_t>(state.range(1));
  BenchPairs pairs(lanes);
  BeamInput<float> in;
  in.phase_nodes = 1025;
  const std::vector<float> lift(ZenithGrid::kFineSize, 0.001F), weight(lanes, 0.1F),
      share(lanes, 0.95F), kind_weight(std::max<std::size_t>(kinds, 1) * lanes, 0.1F),
      phase(std::max<std::size_t>(kinds, 1) * in.phase_nodes * 2 * lanes, 1.0F);
  std::vector<std::size_t> kind;
  for (std::size_t q = 0; q < kinds; ++q) kind.push_back(q);
  in.gather = pairs.in;
  in.cos_theta = 0.3F;
  in.sin_theta = 0.954F;
  in.lift_rad = lift.data();
  in.air_weight = weight.data();
  in.anisotropic_share = share.data();
  in.kinds = kinds;
  in.kind = kind.data();
  in.kind_weight = kind_weight.data();
  in.phase = phase.data();
  for (auto _ : state) {
    kGather(in, pairs.out.data());
    benchmark::ClobberMemory();
  }
  const auto values = static_cast<double>(pairs.in.pairs * lanes);
  count_work(state, values * (12 + 8 * static_cast<double>(kinds)),
             values * (8 + 5 * static_cast<double>(kinds)));
}
BENCHMARK(GatherBeam<gather_beam<float>>)
    ->Name("GatherBeamSimd")
    ->ArgsProduct({{8, 16}, {0, 1, 2}});
BENCHMARK(GatherBeam<gather_beam_scalar<float>>)
    ->Name("GatherBeamScalar")
    ->ArgsProduct({{8}, {0, 1}});

template <auto kModes>
void AerosolModes(benchmark::State& state) {
  const auto lanes = static_cast<std::size_t>(state.range(0));
  const auto degree = static_cast<int>(state.range(1));
  const std::size_t count = moment_count(degree);
  const std::vector<float> scattered(kNodes * count * kStokes * lanes, 0.1F),
      basis(3 * count, 0.1F), weight(lanes, 0.1F);
  std::vector<std::vector<float>> modes(
      kEmissionBatch, std::vector<float>(kNodes * kStokes * mode_rows(degree) * lanes));
  AerosolPoints<float> in;
  in.nodes = kNodes;
  in.lanes = lanes;
  in.degree = in.phase_degree = degree;
  in.scattered = scattered.data();
  in.points = kEmissionBatch;
  for (std::size_t k = 0; k < kEmissionBatch; ++k) {
    in.basis[k] = basis.data();
    in.weight[k] = weight.data();
    in.modes[k] = modes[k].data();
  }
  for (auto _ : state) {
    kModes(in);
    benchmark::ClobberMemory();
  }
  const auto moments = static_cast<double>(kNodes * count * lanes);
  count_work(state, moments * kEmissionBatch * 5 * 2, moments * kStokes);
}
BENCHMARK(AerosolModes<add_aerosol_modes<float>>)
    ->Name("AerosolModesSimd")
    ->ArgsProduct({{8, 16}, {8, 16}});
BENCHMARK(AerosolModes<add_aerosol_modes_scalar<float>>)
    ->Name("AerosolModesScalar")
    ->ArgsProduct({{8}, {8}});

template <auto kAdd>
void AddMoments(benchmark::State& state) {
  const auto lanes = static_cast<std::size_t>(state.range(0));
  const auto degree = static_cast<int>(state.range(1));
  const std::size_t count = moment_count(degree);
  const std::vector<float> light(kNodes * kAzimuths * kStokes * lanes, 0.1F), wave(kAzimuths, 0.7F),
      basis(3 * count, 0.1F);
  std::vector<float> coherency(kNodes * 4 * lanes), moments(kNodes * kStokes * count * lanes),
      scratch(kEmissionBatch * 3 * static_cast<std::size_t>(degree + 1) * lanes);
  MomentInput<float> in;
  in.nodes = kNodes;
  in.azimuths = kAzimuths;
  in.lanes = lanes;
  in.directions = kEmissionBatch;
  for (std::size_t k = 0; k < kEmissionBatch; ++k) {
    in.cos_theta[k] = 0.5F;
    in.sin_theta[k] = 0.86F;
    in.weight[k] = 0.01F;
    in.light[k] = light.data();
    in.basis[k] = basis.data();
  }
  in.cos_phi = in.sin_phi = wave.data();
  in.phase_degree = degree;
  in.scratch = scratch.data();
  for (auto _ : state) {
    kAdd(in, coherency.data(), moments.data());
    benchmark::ClobberMemory();
  }
  const double sums = static_cast<double>(kNodes * kAzimuths * lanes) * kStokes * (degree + 1);
  const auto stored = static_cast<double>(kNodes * count * lanes);
  count_work(state, kEmissionBatch * 2 * (sums + 5 * stored),
             kEmissionBatch * (2 * sums + 3 * stored) + 2 * kStokes * stored);
}
BENCHMARK(AddMoments<add_moments<float>>)->Name("AddMomentsSimd")->ArgsProduct({{8, 16}, {12, 24}});
BENCHMARK(AddMoments<add_moments_scalar<float>>)
    ->Name("AddMomentsScalar")
    ->ArgsProduct({{8}, {12}});

}  // namespace
}  // namespace twilight
