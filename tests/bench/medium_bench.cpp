// Rays, sunlight, view march and Mie series.
#include <benchmark/benchmark.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "aerosols/mie.h"
#include "atmosphere/refraction.h"
#include "sim/direct_sunlight.h"
#include "sim/gather_kernel.h"
#include "sim/spectral_lanes.h"
#include "tests/bench/bench_scene.h"

namespace twilight {
namespace {

template <auto kMarch>
void March(benchmark::State& state) {
  const auto wavelengths = static_cast<std::size_t>(state.range(0));
  constexpr std::size_t kLayers = 100, kSteps = 150;
  const std::size_t lanes = padded_lanes(wavelengths);
  const std::vector<float> extinction(kLayers * lanes, 0.01F), air(kLayers * lanes, 0.008F),
      aerosol(kLayers * lanes, 0.002F), asymmetry(kLayers * lanes, 0.7F), x2(lanes, 0.1F);
  GatherMarch ray;
  ray.lanes = lanes;
  ray.steps = static_cast<int>(kSteps);
  ray.length_km.assign(kSteps, 1.0F);
  for (std::size_t i = 0; i < kSteps; ++i)
    ray.layer.push_back(static_cast<int>(i * kLayers / kSteps));
  ray.sun_depth.assign(kSteps * lanes, 0.5F);
  ray.multiple.assign(kSteps * lanes, 1e-4F);
  ray.lit.assign(kSteps, 1);
  ray.cosine = 0.3F;
  const GatherOptics optics{extinction.data(), air.data(), aerosol.data(), asymmetry.data(),
                            x2.data()};
  std::vector<float> radiance(lanes), transmittance(lanes);
  for (auto _ : state) {
    radiance.assign(lanes, 0.0F);
    transmittance.assign(lanes, 1.0F);
    kMarch(ray, optics, radiance.data(), transmittance.data());
    benchmark::ClobberMemory();
  }
  // A step: its own transmittance and the Sun's.
  state.counters["exponentials/s"] = benchmark::Counter(
      static_cast<double>(state.iterations() * 2 * kSteps * lanes), benchmark::Counter::kIsRate);
  state.counters["steps/s"] = benchmark::Counter(static_cast<double>(state.iterations() * kSteps),
                                                 benchmark::Counter::kIsRate);
}
BENCHMARK(March<march>)->Name("MarchSimd")->Arg(8)->Arg(15);
BENCHMARK(March<march_scalar>)->Name("MarchScalar")->Arg(8)->Arg(15);

void DirectSunlightLookup(benchmark::State& state) {
  const SceneModel model = bench_model(static_cast<std::size_t>(state.range(0)));
  const DirectSunlight sunlight(model.medium, {.altitude_nodes = 64, .angle_nodes = 80});
  std::vector<float> depth(sunlight.lanes());
  double altitude_km = 0;
  for (auto _ : state) {
    altitude_km = altitude_km < 90 ? altitude_km + 0.37 : 0;
    benchmark::DoNotOptimize(sunlight.attenuation(altitude_km, 1.5, depth.data()));
    benchmark::ClobberMemory();
  }
}
BENCHMARK(DirectSunlightLookup)->Arg(8)->Arg(15);

void DirectSunlightTable(benchmark::State& state) {
  const SceneModel model = bench_model(15);
  for (auto _ : state) {
    const DirectSunlight sunlight(model.medium);
    benchmark::DoNotOptimize(sunlight.lanes());
  }
}
BENCHMARK(DirectSunlightTable)->Unit(benchmark::kMillisecond);

void RefractedRayTrace(benchmark::State& state) {
  const SceneModel model = bench_model(1);
  const RefractedRays rays(model.medium, 0);
  std::vector<double> path(model.medium.layers());
  for (auto _ : state) {
    benchmark::DoNotOptimize(rays.trace_outward(0, std::numbers::pi / 2, path));
  }
}
BENCHMARK(RefractedRayTrace);

void RefractedRaySearch(benchmark::State& state) {
  const SceneModel model = bench_model(1);
  const RefractedRays rays(model.medium, 0);
  for (auto _ : state) {
    benchmark::DoNotOptimize(rays.apparent_zenith_rad(10, std::numbers::pi / 2 + 0.05));
  }
}
BENCHMARK(RefractedRaySearch);

void MieEfficiencies(benchmark::State& state) {
  const auto size_parameter = static_cast<double>(state.range(0));
  for (auto _ : state) {
    benchmark::DoNotOptimize(mie_efficiencies(size_parameter, std::complex<double>(1.5, -0.01)));
  }
}
BENCHMARK(MieEfficiencies)->Arg(1)->Arg(10)->Arg(100)->Arg(1000);

}  // namespace
}  // namespace twilight
