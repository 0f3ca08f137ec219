// Loops over the lanes of spectra, once per SIMD target: include it after hwy/highway.h.
#if defined(TWILIGHT_FOR_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TWILIGHT_FOR_LANES_INL_H_
#undef TWILIGHT_FOR_LANES_INL_H_
#else
#define TWILIGHT_FOR_LANES_INL_H_
#endif

#include <cstddef>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {

// Runs f with the widest vectors that divide the lanes (8, or a multiple of 16).
template <class T, class F>
HWY_INLINE void ForLanes(std::size_t lanes, const F& f) {
  if (lanes % 16 == 0) {
    f(hwy::HWY_NAMESPACE::CappedTag<T, 16>());
  } else {
    f(hwy::HWY_NAMESPACE::CappedTag<T, 8>());
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#endif
