// The exchange kernels of all ring pairs, evaluated once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "sim/exchange_kernel.h"

namespace twilight {

/// Kernels depend on the pair, not on its order (Haber et al. 2005, Sec. 5: the path between
/// two cells is the same both ways), so each is stored once. Where they would not fit in
/// kLargestBytes they are evaluated anew whenever asked for; results are the same bytes.
class KernelStore {
 public:
  static constexpr std::size_t kLargestBytes = std::size_t{1200} << 20;

  /// Plans the azimuth sampling of every pair. Everything referred to outlives the store; the
  /// first `air_rings` points are air, the rest ground.
  KernelStore(const ExchangeMedium& medium, const std::vector<RingPoint>& points,
              std::size_t air_rings, const AzimuthModes& azimuth, double tolerance,
              int source_modes);

  /// Evaluates all pairs in parallel; kernel() gives a thread its workspace, progress is called
  /// now and then with the fraction done. Returns the number of kernel samples.
  std::uint64_t evaluate(const std::function<RingPairKernel*()>& kernel,
                         const std::function<void(double)>& progress);

  std::size_t pair(std::size_t a, std::size_t b) const {
    return a >= b ? a * (a + 1) / 2 + b : b * (b + 1) / 2 + a;
  }
  bool lit(std::size_t a, std::size_t b) const { return lit_[pair(a, b)] != 0; }
  int modes(std::size_t a, std::size_t b) const { return sampling_[pair(a, b)].modes; }
  /// Place of a pair's azimuthal modes in an array that holds every pair's own number of them.
  std::size_t mode_offset(std::size_t a, std::size_t b) const { return mode_offset_[pair(a, b)]; }
  std::size_t mode_count() const { return mode_count_; }

  /// The kernel from source to target; false when nothing passes.
  bool fetch(std::size_t source, std::size_t target, bool moments, RingPairKernel& out) const;

 private:
  const ExchangeMedium& medium_;
  const std::vector<RingPoint>& points_;
  const AzimuthModes& azimuth_;
  std::size_t air_rings_;
  std::vector<AzimuthSampling> sampling_;
  std::vector<std::size_t> offset_, mode_offset_;
  std::vector<unsigned char> lit_;
  std::unique_ptr<float[]> values_;
  std::size_t size_ = 0, mode_count_ = 0;
};

}  // namespace twilight
