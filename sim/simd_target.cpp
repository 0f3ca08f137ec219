#include "sim/simd_target.h"

#include <fmt/format.h>
#include <hwy/highway.h>
#include <hwy/targets.h>

#include <stdexcept>
#include <utility>

namespace twilight {

std::string simd_target() {
  // The lower the bit, the better the target.
  const auto usable = hwy::SupportedTargets() & HWY_TARGETS;
  return hwy::TargetName(usable & -usable);
}

void cap_simd_target(std::string_view name) {
  using Targets = decltype(hwy::SupportedTargets());
  static constexpr std::pair<std::string_view, Targets> kCaps[] = {
      {"best", 1},        {"avx512", HWY_AVX3},          {"avx2", HWY_AVX2},
      {"sse4", HWY_SSE4}, {"scalar", HWY_STATIC_TARGET},
  };
  for (const auto& [cap, target] : kCaps) {
    if (name != cap) continue;
    hwy::DisableTargets(target - 1);
    return;
  }
  throw std::invalid_argument(
      fmt::format("SIMD target \"{}\": must be best, avx512, avx2, sse4 or scalar", name));
}

}  // namespace twilight
