// The kernels of the exchange between cells. The argument is the number of wavelengths. Counters:
// the work done per second, to be held against machine_bench.cpp.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/aerosol_pass.h"
#include "sim/cell_grid.h"
#include "sim/direct_sunlight.h"
#include "sim/exchange_optics.h"
#include "sim/first_event.h"
#include "sim/ring_pass.h"
#include "sim/spectral_lanes.h"
#include "tests/bench/bench_scene.h"

namespace twilight {
namespace {

constexpr int kDivisions = 120, kNodes = kDivisions / 2 + 1;
constexpr double kSunRad = -4 * std::numbers::pi / 180;

std::size_t wavelengths_of(const benchmark::State& state) {
  return static_cast<std::size_t>(state.range(0));
}

// Work per iteration as a rate.
void rate(benchmark::State& state, const char* what, double work) {
  state.counters[what] = benchmark::Counter(work * static_cast<double>(state.iterations()),
                                            benchmark::Counter::kIsRate);
}

double size(std::size_t n) { return static_cast<double>(n); }

// Crossings of shell boundaries on one path between the bench's rings, each a multiply-add per
// lane and sample.
double crossings(const BenchPair& pair) { return pair.target.layer - pair.source.layer + 1; }

void RingPairKernelSimd(benchmark::State& state) {
  BenchPair pair(wavelengths_of(state));
  for (auto _ : state) {
    pair.evaluate(false);
    benchmark::DoNotOptimize(pair.kernel.value);
  }
  const double lanes = pair.kernel.samples * size(pair.lanes);
  rate(state, "evaluations/s", static_cast<double>(pair.kernel.samples * state.range(0)));
  rate(state, "exponentials/s", lanes);
  rate(state, "multiply-adds/s", lanes * crossings(pair));
}
BENCHMARK(RingPairKernelSimd)->Arg(1)->Arg(8)->Arg(15);

void RingPairKernelScalar(benchmark::State& state) {
  const BenchPair pair(wavelengths_of(state));
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        ring_pair_kernel_scalar(pair.medium, pair.source, pair.target, kDivisions, false));
  }
  rate(state, "evaluations/s", static_cast<double>(pair.kernel.samples * state.range(0)));
}
BENCHMARK(RingPairKernelScalar)->Arg(1)->Arg(8)->Arg(15);

// The geometry alone, of a pair whose transmittance is known, with the weights of all moments.
void SightLines(benchmark::State& state) {
  BenchPair pair(wavelengths_of(state));
  RingPairKernel known;
  known.resize(kDivisions, pair.lanes, pair.medium.layers);
  for (auto _ : state) {
    ring_pair_kernel(pair.medium, pair.source, pair.target, pair.azimuth, {1, 24}, false, true,
                     known, pair.kernel.value);
    benchmark::ClobberMemory();
  }
  rate(state, "samples/s", pair.kernel.samples);
}
BENCHMARK(SightLines)->Arg(8);

template <auto kPass>
void MomentPass(benchmark::State& state) {
  const BenchPair pair(wavelengths_of(state));
  const std::size_t n =
      static_cast<std::size_t>(pair.azimuth.modes) * std::size_t{kMoments} * pair.lanes;
  const std::vector<float> source(n, 1.0F);
  std::vector<float> field(n, 0.0F);
  for (auto _ : state) {
    kPass(pair.kernel, pair.azimuth, source.data(), field.data());
    benchmark::ClobberMemory();
  }
  // Nine to emit, two for the kernel, four to turn, nine to receive.
  const double lanes = pair.kernel.samples * size(pair.lanes);
  rate(state, "multiply-adds/s", 24 * lanes * pair.azimuth.modes);
  rate(state, "bytes/s", sizeof(float) * (lanes + 3 * size(n)));
}
BENCHMARK(MomentPass<moment_pass>)->Name("MomentPassSimd")->Arg(8)->Arg(15);
BENCHMARK(MomentPass<moment_pass_scalar>)->Name("MomentPassScalar")->Arg(8)->Arg(15);

struct AerosolBench {
  explicit AerosolBench(const benchmark::State& state)
      : pair(wavelengths_of(state)),
        power(kNodes * pair.lanes, 1.0F),
        asymmetry(pair.lanes, 0.7F),
        lit(kNodes, 1),
        field(kNodes * pair.lanes, 0.0F) {}
  // Henyey-Greenstein factors: every azimuth seen from every target of half the ring.
  double factors() const { return (2.0 * pair.kernel.samples - 2) * kNodes * size(pair.lanes); }
  BenchPair pair;
  std::vector<float> power, asymmetry;
  std::vector<unsigned char> lit;
  std::vector<float> field;
};

// A reciprocal root and eight multiplications or multiply-adds a factor.
void FirstEventPassSimd(benchmark::State& state) {
  AerosolBench b(state);
  for (auto _ : state) {
    first_event_pass(b.pair.kernel, b.pair.azimuth, b.power.data(), b.lit.data(),
                     b.asymmetry.data(), kSunRad, b.field.data());
    benchmark::ClobberMemory();
  }
  rate(state, "phase functions/s", b.factors());
  rate(state, "multiply-adds/s", 9 * b.factors());
}
BENCHMARK(FirstEventPassSimd)->Arg(8)->Arg(15);

void FirstEventPassScalar(benchmark::State& state) {
  AerosolBench b(state);
  for (auto _ : state) {
    first_event_pass_scalar(b.pair.kernel, kDivisions, b.power.data(), b.lit.data(),
                            b.asymmetry.data(), kSunRad, b.field.data());
    benchmark::ClobberMemory();
  }
  rate(state, "phase functions/s", b.factors());
}
BENCHMARK(FirstEventPassScalar)->Arg(8)->Arg(15);

// Sunlight scattered once in all cells of a coarse grid; exponentials: one per interior point,
// azimuth and wavelength.
void FirstEventSources(benchmark::State& state) {
  const SceneModel model = bench_model(wavelengths_of(state));
  const ExchangeOptics optics = make_exchange_optics(model.medium, {});
  const DirectSunlight sunlight(model.medium, {.altitude_nodes = 64, .angle_nodes = 80});
  CellGridOptions options;
  options.azimuth_divisions = 30;
  const CellGrid grid(model.medium, options);
  const std::vector<float> albedo(optics.lanes, 0.1F);
  double points = 0;
  for (std::size_t i = 0; i < grid.air_rings(); ++i) {
    points += size(grid.samples(grid.rings()[i], model.medium).size()) * 16;
  }
  for (auto _ : state) {
    const FirstEvent event = first_event(model.medium, grid, grid.rings().size(), sunlight,
                                         {kSunRad}, optics, false, albedo, kMoments);
    benchmark::DoNotOptimize(event.power.data());
  }
  rate(state, "exponentials/s", points * static_cast<double>(state.range(0)));
}
BENCHMARK(FirstEventSources)->Arg(8)->Arg(15)->MeasureProcessCPUTime();

// One pass between two rings of isotropic cells, three ways.

void CosineTransform(benchmark::State& state) {
  const BenchPair pair(wavelengths_of(state));
  std::vector<float> modes(static_cast<std::size_t>(pair.azimuth.modes) * pair.lanes);
  for (auto _ : state) {
    cosine_transform(pair.kernel, pair.azimuth, modes.data());
    benchmark::ClobberMemory();
  }
  const double lanes = pair.kernel.samples * size(pair.lanes);
  rate(state, "multiply-adds/s", lanes * pair.azimuth.modes);
  rate(state, "bytes/s", sizeof(float) * (lanes + size(modes.size())));
}
BENCHMARK(CosineTransform)->Name("IsotropicPass/CosineTransformOncePerPair")->Arg(8)->Arg(15);

void PassByModes(benchmark::State& state) {
  const BenchPair pair(wavelengths_of(state));
  const std::size_t n = static_cast<std::size_t>(pair.azimuth.modes) * pair.lanes;
  const std::vector<float> kernel(n, 0.5F), source(n, 1.0F);
  std::vector<float> field(n, 0.0F);
  for (auto _ : state) {
    multiply_add(kernel.data(), source.data(), 1.0F, n, field.data());
    benchmark::ClobberMemory();
  }
  rate(state, "multiply-adds/s", 2 * size(n));
}
BENCHMARK(PassByModes)->Name("IsotropicPass/ByModes")->Arg(8)->Arg(15);

// All pairs of a pass in turn, both directions: kernels come from memory, fields stay in cache.
void PassThroughMemory(benchmark::State& state) {
  const std::size_t n = 16 * padded_lanes(wavelengths_of(state));  // of some 16 modes
  const std::size_t pairs = (std::size_t{16} << 20) / n;
  const std::vector<float> kernels(pairs * n, 1e-9F), a(n, 1.0F), b(n, 1.0F);
  std::vector<float> field_a(n, 0.0F), field_b(n, 0.0F);
  for (auto _ : state) {
    for (std::size_t p = 0; p < pairs; ++p) {
      multiply_add_both(&kernels[p * n], a.data(), 1.0F, b.data(), 1.0F, n, field_a.data(),
                        field_b.data());
    }
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(pairs * n * sizeof(float)));
}
BENCHMARK(PassThroughMemory)->Arg(8)->Threads(1)->Threads(2);

// Target azimuth j gains K(k) (source(j + k) + source(j - k)) of every azimuth difference k, the
// field's mirror symmetry folding both into 0..S/2: what the modes replace.
void PassDirect(benchmark::State& state) {
  const BenchPair pair(wavelengths_of(state));
  const std::size_t lanes = pair.lanes;
  const std::vector<float> source(kNodes * lanes, 1.0F);
  std::vector<float> field(kNodes * lanes, 0.0F);
  const auto fold = [](int j) {
    const int m = ((j % kDivisions) + kDivisions) % kDivisions;
    return static_cast<std::size_t>(m <= kDivisions / 2 ? m : kDivisions - m);
  };
  for (auto _ : state) {
    for (int j = 0; j < kNodes; ++j) {
      float* out = &field[static_cast<std::size_t>(j) * lanes];
      for (int k = 0; k < kNodes; ++k) {
        const float* a = &source[fold(j + k) * lanes];
        const float* b = &source[fold(j - k) * lanes];
        const float* kernel = pair.kernel.value + static_cast<std::size_t>(k) * lanes;
        const float weight = k == 0 || 2 * k == kDivisions ? 0.5F : 1.0F;
        for (std::size_t w = 0; w < lanes; ++w) out[w] += weight * kernel[w] * (a[w] + b[w]);
      }
    }
    benchmark::ClobberMemory();
  }
}
BENCHMARK(PassDirect)->Name("IsotropicPass/Direct")->Arg(8)->Arg(15);

}  // namespace
}  // namespace twilight
