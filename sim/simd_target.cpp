#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/simd_target.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include "hwy/highway.h"
#include "sim/simd_target.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {

const char* Target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <fmt/format.h>

#include <cstdint>
#include <stdexcept>
#include <utility>

namespace twilight {

HWY_EXPORT(Target);

std::string simd_target() { return HWY_DYNAMIC_DISPATCH(Target)(); }

void cap_simd_target(std::string_view name) {
  static constexpr std::pair<std::string_view, std::int64_t> kCaps[] = {
      {"best", 1},        {"avx512", HWY_AVX3},          {"avx2", HWY_AVX2},
      {"sse4", HWY_SSE4}, {"scalar", HWY_STATIC_TARGET},
  };
  for (const auto& [cap, target] : kCaps) {
    if (name != cap) continue;
    hwy::DisableTargets(target - 1);  // the lower the bit, the better the target
    return;
  }
  throw std::invalid_argument(
      fmt::format("SIMD target \"{}\": must be best, avx512, avx2, sse4 or scalar", name));
}

}  // namespace twilight
#endif  // HWY_ONCE
