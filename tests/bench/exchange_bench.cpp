// The kernels of the exchange between cells. The argument is the number of wavelengths.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/bench/bench_scene.h"

namespace twilight {
namespace {

std::size_t wavelengths_of(const benchmark::State& state) {
  return static_cast<std::size_t>(state.range(0));
}

void RingPairKernelSimd(benchmark::State& state) {
  BenchPair pair(wavelengths_of(state));
  for (auto _ : state) {
    pair.evaluate(true);
    benchmark::DoNotOptimize(pair.kernel.value);
  }
  state.SetItemsProcessed(state.iterations() * pair.kernel.samples * state.range(0));
}
BENCHMARK(RingPairKernelSimd)->Arg(1)->Arg(8)->Arg(15);

void RingPairKernelScalar(benchmark::State& state) {
  const BenchPair pair(wavelengths_of(state));
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        ring_pair_kernel_scalar(pair.medium, pair.source, pair.target, 120, false));
  }
  state.SetItemsProcessed(state.iterations() * pair.kernel.samples * state.range(0));
}
BENCHMARK(RingPairKernelScalar)->Arg(1)->Arg(8)->Arg(15);

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
}
BENCHMARK(MomentPass<moment_pass>)->Name("MomentPassSimd")->Arg(8)->Arg(15);
BENCHMARK(MomentPass<moment_pass_scalar>)->Name("MomentPassScalar")->Arg(8)->Arg(15);

template <auto kPass>
void FirstEventPass(benchmark::State& state) {
  const BenchPair pair(wavelengths_of(state));
  const std::size_t n = 61 * pair.lanes;
  const std::vector<float> power(n, 1.0F), asymmetry(pair.lanes, 0.7F);
  const std::vector<unsigned char> lit(61, 1);
  std::vector<float> field(n, 0.0F);
  const double sun_rad = -4 * std::numbers::pi / 180;
  for (auto _ : state) {
    kPass(pair.kernel, 120, power.data(), lit.data(), asymmetry.data(), sun_rad, field.data());
    benchmark::ClobberMemory();
  }
}
BENCHMARK(FirstEventPass<first_event_pass>)->Name("FirstEventPassSimd")->Arg(8)->Arg(15);
BENCHMARK(FirstEventPass<first_event_pass_scalar>)->Name("FirstEventPassScalar")->Arg(8)->Arg(15);

// One pass between two rings of isotropic cells, three ways.

void CosineTransform(benchmark::State& state) {
  const BenchPair pair(wavelengths_of(state));
  std::vector<float> modes(static_cast<std::size_t>(pair.azimuth.modes) * pair.lanes);
  for (auto _ : state) {
    cosine_transform(pair.kernel, pair.azimuth, modes.data());
    benchmark::ClobberMemory();
  }
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
}
BENCHMARK(PassByModes)->Name("IsotropicPass/ByModes")->Arg(8)->Arg(15);

// Target azimuth j gains K(k) (source(j + k) + source(j - k)) of every azimuth difference k, the
// field's mirror symmetry folding both into 0..S/2: what the modes replace.
void PassDirect(benchmark::State& state) {
  const BenchPair pair(wavelengths_of(state));
  constexpr int kDivisions = 120, kNodes = kDivisions / 2 + 1;
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
