// The medium and the ring pairs that the benchmarks work on.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/azimuth_sampling.h"
#include "sim/exchange_medium.h"
#include "sim/ring_pair_kernel.h"
#include "sim/scene_model.h"

namespace twilight {

/// default.toml's air with the Sun at -4 deg, at the first `wavelengths` wavelengths of its list.
SceneModel bench_model(std::size_t wavelengths);

/// Two rings a typical distance apart, tens of kilometres, and their medium.
struct BenchPair {
  explicit BenchPair(std::size_t wavelengths, int divisions = 120);
  ExchangeMedium medium;
  std::size_t lanes;
  AzimuthModes azimuth;
  RingPoint source, target;
  RingPairKernel kernel;  ///< every azimuth difference, all modes
  std::vector<float> half_depth;

  void evaluate(bool moments);
};

}  // namespace twilight
