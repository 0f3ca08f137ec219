// The exchange kernels of all ring pairs, evaluated once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sim/azimuth_sampling.h"
#include "sim/exchange_medium.h"
#include "sim/ring_pair_kernel.h"
#include "sim/ring_point.h"

namespace twilight {

/// What a store keeps of every pair.
enum class KeptKernels {
  kValues,  ///< transmittance and geometry at every azimuth sample
  kModes,   ///< cosine modes of the scalar exchange
};

/// Kernels depend on the pair, not on its order (Haber et al. 2005, Sec. 5: the path between
/// two cells is the same both ways), so each is stored once, from b to a where a >= b. Where they
/// would not fit in kLargestBytes they are evaluated anew whenever asked for; results are the same
/// bytes. Different pairs may be worked on by different threads.
class KernelStore {
 public:
  static constexpr std::size_t kLargestBytes = std::size_t{1200} << 20;

  /// Plans the azimuth sampling of every pair. Everything referred to outlives the store; the
  /// first `air_rings` points are air, the rest ground, which is convex: no light goes between two
  /// of its rings.
  KernelStore(const ExchangeMedium& medium, std::span<const RingPoint> points,
              std::size_t air_rings, const AzimuthModes& azimuth, double tolerance,
              int source_modes, KeptKernels kept);

  /// Evaluates the kernel from b to a, a >= b, of J only, keeps it, and leaves it in `out`; false
  /// when nothing passes. Counts its samples.
  bool evaluate(std::size_t a, std::size_t b, RingPairKernel& out, std::uint64_t& samples);

  /// The kernel from b to a, a >= b, of a pair evaluated before; false when nothing passes.
  bool fetch(std::size_t a, std::size_t b, bool moments, RingPairKernel& out) const;

  /// Cosine modes from b to a, a >= b, of a pair evaluated before, [modes(a, b)][lane]; null
  /// when nothing passes. Uses `workspace` where they are not kept.
  const float* cosine_modes(std::size_t a, std::size_t b, RingPairKernel& workspace,
                            std::vector<float>& modes_workspace) const;

  int modes(std::size_t a, std::size_t b) const { return plan_[pair(a, b)].modes; }

 private:
  struct Plan {
    std::uint32_t offset = 0;  // within the pairs of ring a, in spectra
    std::uint8_t every = 1, modes = 1;
    bool lit = false;
  };
  std::size_t pair(std::size_t a, std::size_t b) const { return a * (a + 1) / 2 + b; }
  float* kept(std::size_t a, std::size_t b) {
    return kept_.get() + (row_offset_[a] + plan_[pair(a, b)].offset) * medium_.lanes;
  }
  const float* kept(std::size_t a, std::size_t b) const {
    return const_cast<KernelStore*>(this)->kept(a, b);
  }

  const ExchangeMedium& medium_;
  std::span<const RingPoint> points_;
  const AzimuthModes& azimuth_;
  std::size_t air_rings_;
  KeptKernels what_;
  std::vector<Plan> plan_;
  std::vector<std::size_t> row_offset_;  // of ring a, in spectra
  std::unique_ptr<float[]> kept_;        // null: evaluated anew
};

}  // namespace twilight
