#include "sim/kernel_store.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

namespace twilight {

KernelStore::KernelStore(const ExchangeMedium& medium, const std::vector<RingPoint>& points,
                         std::size_t air_rings, const AzimuthModes& azimuth, double tolerance,
                         int source_modes)
    : medium_(medium), points_(points), azimuth_(azimuth), air_rings_(air_rings) {
  const std::size_t n = points.size();
  const std::size_t count = n * (n + 1) / 2;
  sampling_.resize(count);
  offset_.resize(count);
  mode_offset_.resize(count);
  lit_.assign(count, 0);
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t a) {
    for (std::size_t b = 0; b <= a; ++b) {
      sampling_[pair(a, b)] = azimuth_sampling(medium, points[a], points[b], azimuth.divisions,
                                               azimuth.modes, tolerance, source_modes);
    }
  });
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      const std::size_t p = pair(a, b);
      offset_[p] = size_;
      mode_offset_[p] = mode_count_;
      if (a >= air_rings && b >= air_rings) continue;  // the ground is convex
      size_ +=
          static_cast<std::size_t>(azimuth.divisions / 2 / sampling_[p].every + 1) * medium.lanes;
      mode_count_ += static_cast<std::size_t>(sampling_[p].modes);
    }
  }
}

std::uint64_t KernelStore::evaluate(const std::function<RingPairKernel*()>& kernel,
                                    const std::function<void(double)>& progress) {
  const bool keep = size_ * sizeof(float) <= kLargestBytes;
  if (keep) values_ = std::make_unique_for_overwrite<float[]>(size_);
  const std::size_t n = points_.size();
  std::atomic<std::uint64_t> samples{0};
  std::atomic<std::size_t> done{0};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 4), [&](const auto& range) {
    RingPairKernel& k = *kernel();
    std::uint64_t count = 0;
    for (std::size_t a = range.begin(); a != range.end(); ++a) {
      for (std::size_t b = 0; b <= a; ++b) {
        if (a >= air_rings_ && b >= air_rings_) continue;
        const std::size_t p = pair(a, b);
        ring_pair_kernel(medium_, points_[b], points_[a], azimuth_, sampling_[p], a == b, false, k);
        count += static_cast<std::uint64_t>(k.samples);
        lit_[p] = k.dark ? 0 : 1;
        if (keep && !k.dark) {
          std::copy_n(k.value, static_cast<std::size_t>(k.samples) * medium_.lanes,
                      values_.get() + offset_[p]);
        }
      }
    }
    samples += count;
    progress(static_cast<double>(done += range.size()) / static_cast<double>(n));
  });
  return samples;
}

bool KernelStore::fetch(std::size_t source, std::size_t target, bool moments,
                        RingPairKernel& out) const {
  const std::size_t p = pair(source, target);
  if (lit_[p] == 0) return false;
  ring_pair_kernel(medium_, points_[source], points_[target], azimuth_, sampling_[p],
                   source == target, moments, out, values_ ? values_.get() + offset_[p] : nullptr);
  return true;
}

}  // namespace twilight
