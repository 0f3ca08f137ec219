#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/monte_carlo_slant_sum.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include "hwy/highway.h"
#include "sim/monte_carlo_slant_sum.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

double SumWeightedRoots(const double* weight, const double* square, std::size_t count,
                        double impact_squared) {
  const hn::ScalableTag<double> d;
  const std::size_t lanes = hn::Lanes(d);
  const auto b2 = hn::Set(d, impact_squared);
  const auto zero = hn::Zero(d);
  auto even = zero, odd = zero;
  std::size_t k = 0;
  for (; k + 2 * lanes <= count; k += 2 * lanes) {
    const auto a = hn::Sqrt(hn::Max(zero, hn::Sub(hn::LoadU(d, square + k), b2)));
    const auto b = hn::Sqrt(hn::Max(zero, hn::Sub(hn::LoadU(d, square + k + lanes), b2)));
    even = hn::MulAdd(a, hn::LoadU(d, weight + k), even);
    odd = hn::MulAdd(b, hn::LoadU(d, weight + k + lanes), odd);
  }
  for (; k < count; k += lanes) {
    const auto mask = hn::FirstN(d, count - k);
    const auto square_k = hn::MaskedLoad(mask, d, square + k);
    const auto a = hn::Sqrt(hn::Max(zero, hn::Sub(square_k, b2)));
    even = hn::MulAdd(a, hn::MaskedLoad(mask, d, weight + k), even);
  }
  return hn::GetLane(hn::SumOfLanes(d, hn::Add(even, odd)));
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace twilight {

HWY_EXPORT(SumWeightedRoots);

double sum_weighted_roots(const double* weight, const double* square, std::size_t count,
                          double impact_squared) {
  return HWY_DYNAMIC_DISPATCH(SumWeightedRoots)(weight, square, count, impact_squared);
}

}  // namespace twilight
#endif
