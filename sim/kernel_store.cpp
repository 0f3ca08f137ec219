#include "sim/kernel_store.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

#include "sim/ring_pass.h"

namespace twilight {

KernelStore::KernelStore(const ExchangeMedium& medium, std::span<const RingPoint> points,
                         std::size_t air_rings, const AzimuthModes& azimuth, double tolerance,
                         int source_modes, KeptKernels kept)
    : medium_(medium), points_(points), azimuth_(azimuth), air_rings_(air_rings), what_(kept) {
  const std::size_t n = points.size();
  plan_.resize(n * (n + 1) / 2);
  row_offset_.assign(n + 1, 0);
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t a) {
    std::uint32_t offset = 0;
    for (std::size_t b = 0; b <= a; ++b) {
      const AzimuthSampling s = azimuth_sampling(medium, points[a], points[b], azimuth.divisions,
                                                 azimuth.modes, tolerance, source_modes);
      Plan& p = plan_[pair(a, b)];
      p.every = static_cast<std::uint8_t>(s.every);
      p.modes = static_cast<std::uint8_t>(s.modes);
      p.offset = offset;
      if (a >= air_rings && b >= air_rings) continue;
      offset += static_cast<std::uint32_t>(
          kept == KeptKernels::kModes ? s.modes : azimuth.divisions / 2 / s.every + 1);
    }
    row_offset_[a + 1] = offset;
  });
  for (std::size_t a = 0; a < n; ++a) row_offset_[a + 1] += row_offset_[a];
  const std::size_t size = row_offset_[n] * medium.lanes;
  if (size * sizeof(float) <= kLargestBytes) {
    kept_ = std::make_unique_for_overwrite<float[]>(size);
  }
}

bool KernelStore::evaluate(std::size_t a, std::size_t b, RingPairKernel& out,
                           std::uint64_t& samples) {
  if (b >= air_rings_) return false;
  Plan& p = plan_[pair(a, b)];
  ring_pair_kernel(medium_, points_[b], points_[a], azimuth_, {p.every, p.modes}, a == b, false,
                   out);
  samples += static_cast<std::uint64_t>(out.samples);
  p.lit = !out.dark;
  if (!p.lit) return false;
  if (!kept_) return true;
  if (what_ == KeptKernels::kModes) {
    cosine_transform(out, azimuth_, kept(a, b));
  } else {
    std::copy_n(out.value, static_cast<std::size_t>(out.samples) * medium_.lanes, kept(a, b));
  }
  return true;
}

bool KernelStore::fetch(std::size_t a, std::size_t b, bool moments, RingPairKernel& out) const {
  const Plan& p = plan_[pair(a, b)];
  if (!p.lit) return false;
  ring_pair_kernel(medium_, points_[b], points_[a], azimuth_, {p.every, p.modes}, a == b, moments,
                   out, kept_ && what_ == KeptKernels::kValues ? kept(a, b) : nullptr);
  return true;
}

const float* KernelStore::cosine_modes(std::size_t a, std::size_t b, RingPairKernel& workspace,
                                       std::vector<float>& modes_workspace) const {
  if (!plan_[pair(a, b)].lit) return nullptr;
  if (kept_ && what_ == KeptKernels::kModes) return kept(a, b);
  fetch(a, b, false, workspace);
  cosine_transform(workspace, azimuth_, modes_workspace.data());
  return modes_workspace.data();
}

}  // namespace twilight
