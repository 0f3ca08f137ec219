// What the machine can do at most: the kernels' figures are fractions of these.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/machine_bench.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include "hwy/contrib/math/math-inl.h"
#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;

// `rounds` fused multiply-adds on each of twelve independent vectors; floats per vector.
std::size_t MultiplyAdds(std::size_t rounds, float* HWY_RESTRICT out) {
  const D d;
  const auto a = hn::Set(d, 0.999F), b = hn::Set(d, 0.001F);
  auto v0 = hn::Set(d, 0.0F), v1 = hn::Set(d, 0.1F), v2 = hn::Set(d, 0.2F), v3 = hn::Set(d, 0.3F),
       v4 = hn::Set(d, 0.4F), v5 = hn::Set(d, 0.5F), v6 = hn::Set(d, 0.6F), v7 = hn::Set(d, 0.7F),
       v8 = hn::Set(d, 0.8F), v9 = hn::Set(d, 0.9F), va = hn::Set(d, 1.0F), vb = hn::Set(d, 1.1F);
  for (std::size_t i = 0; i < rounds; ++i) {
    v0 = hn::MulAdd(v0, a, b);
    v1 = hn::MulAdd(v1, a, b);
    v2 = hn::MulAdd(v2, a, b);
    v3 = hn::MulAdd(v3, a, b);
    v4 = hn::MulAdd(v4, a, b);
    v5 = hn::MulAdd(v5, a, b);
    v6 = hn::MulAdd(v6, a, b);
    v7 = hn::MulAdd(v7, a, b);
    v8 = hn::MulAdd(v8, a, b);
    v9 = hn::MulAdd(v9, a, b);
    va = hn::MulAdd(va, a, b);
    vb = hn::MulAdd(vb, a, b);
  }
  v0 = hn::Add(hn::Add(hn::Add(v0, v1), hn::Add(v2, v3)), hn::Add(hn::Add(v4, v5), v6));
  v0 = hn::Add(v0, hn::Add(hn::Add(hn::Add(v7, v8), hn::Add(v9, va)), vb));
  hn::StoreU(v0, d, out);
  return hn::Lanes(d);
}

// out[i] = exp(in[i]), n a multiple of 16.
void Exponentials(const float* HWY_RESTRICT in, std::size_t n, float* HWY_RESTRICT out) {
  const D d;
  for (std::size_t i = 0; i < n; i += hn::Lanes(d)) {
    hn::StoreU(hn::Exp(d, hn::LoadU(d, in + i)), d, out + i);
  }
}

float Sum(const float* HWY_RESTRICT in, std::size_t n) {
  const D d;
  const std::size_t step = hn::Lanes(d);
  auto a = hn::Zero(d), b = a, c = a, e = a;
  for (std::size_t i = 0; i + 4 * step <= n; i += 4 * step) {
    a = hn::Add(a, hn::LoadU(d, in + i));
    b = hn::Add(b, hn::LoadU(d, in + i + step));
    c = hn::Add(c, hn::LoadU(d, in + i + 2 * step));
    e = hn::Add(e, hn::LoadU(d, in + i + 3 * step));
  }
  return hn::GetLane(hn::SumOfLanes(d, hn::Add(hn::Add(a, b), hn::Add(c, e))));
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <benchmark/benchmark.h>

#include <cstddef>
#include <vector>

namespace twilight {

HWY_EXPORT(MultiplyAdds);
HWY_EXPORT(Exponentials);
HWY_EXPORT(Sum);

namespace {

void MachineMultiplyAdd(benchmark::State& state) {
  constexpr std::size_t kRounds = 4096;
  float out[16];
  std::size_t width = 0;
  for (auto _ : state) {
    width = HWY_DYNAMIC_DISPATCH(MultiplyAdds)(kRounds, out);
    benchmark::DoNotOptimize(out);
  }
  state.counters["multiply-adds/s"] = benchmark::Counter(
      static_cast<double>(state.iterations() * 12 * kRounds * width), benchmark::Counter::kIsRate);
}
BENCHMARK(MachineMultiplyAdd)->Threads(1)->Threads(2);

void MachineExponential(benchmark::State& state) {
  const std::vector<float> in(2048, -1.5F);
  std::vector<float> out(in.size());
  for (auto _ : state) {
    HWY_DYNAMIC_DISPATCH(Exponentials)(in.data(), in.size(), out.data());
    benchmark::ClobberMemory();
  }
  state.counters["exponentials/s"] =
      benchmark::Counter(static_cast<double>(state.iterations()) * static_cast<double>(in.size()),
                         benchmark::Counter::kIsRate);
}
BENCHMARK(MachineExponential)->Threads(1)->Threads(2);

// Reading from memory: 64 MiB a thread, twice the last cache.
void MachineRead(benchmark::State& state) {
  const std::vector<float> in(std::size_t{16} << 20, 1.0F);
  for (auto _ : state) benchmark::DoNotOptimize(HWY_DYNAMIC_DISPATCH(Sum)(in.data(), in.size()));
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(in.size() * sizeof(float)));
}
BENCHMARK(MachineRead)->Threads(1)->Threads(2);

}  // namespace
}  // namespace twilight
#endif  // HWY_ONCE
