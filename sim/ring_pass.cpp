#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/ring_pass.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include "hwy/highway.h"
#include "sim/ring_pass.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;

template <class Tag>
void MomentPass(Tag d, const float* HWY_RESTRICT value, const float* HWY_RESTRICT emit,
                const float* HWY_RESTRICT receive, int n_samples, std::size_t lanes,
                const float* HWY_RESTRICT cosine, const float* HWY_RESTRICT sine, std::size_t row,
                std::size_t every, int modes, const float* HWY_RESTRICT source,
                float* HWY_RESTRICT field) {
  const std::size_t step = hn::Lanes(d);
  for (std::size_t w = 0; w < lanes; w += step) {
    for (int m = 0; m < modes; ++m) {
      const float* q = source + static_cast<std::size_t>(m) * kMoments * lanes + w;
      float* f = field + static_cast<std::size_t>(m) * kMoments * lanes + w;
      const auto q0 = hn::LoadU(d, q), q1 = hn::LoadU(d, q + lanes),
                 q2 = hn::LoadU(d, q + 2 * lanes), q3 = hn::LoadU(d, q + 3 * lanes),
                 q4 = hn::LoadU(d, q + 4 * lanes), q5 = hn::LoadU(d, q + 5 * lanes),
                 q6 = hn::LoadU(d, q + 6 * lanes), q7 = hn::LoadU(d, q + 7 * lanes),
                 q8 = hn::LoadU(d, q + 8 * lanes);
      auto f0 = hn::LoadU(d, f), f1 = hn::LoadU(d, f + lanes), f2 = hn::LoadU(d, f + 2 * lanes),
           f3 = hn::LoadU(d, f + 3 * lanes), f4 = hn::LoadU(d, f + 4 * lanes),
           f5 = hn::LoadU(d, f + 5 * lanes), f6 = hn::LoadU(d, f + 6 * lanes),
           f7 = hn::LoadU(d, f + 7 * lanes), f8 = hn::LoadU(d, f + 8 * lanes);
      const float* c = cosine + static_cast<std::size_t>(m) * row;
      const float* s = sine + static_cast<std::size_t>(m) * row;
      for (int k = 0; k < n_samples; ++k) {
        const float* a = emit + k * kMoments;
        const float* b = receive + k * kMoments;
        auto even = hn::Mul(q0, hn::Set(d, a[0]));
        auto odd = hn::Mul(q6, hn::Set(d, a[6]));
        even = hn::MulAdd(q1, hn::Set(d, a[1]), even);
        odd = hn::MulAdd(q7, hn::Set(d, a[7]), odd);
        auto even2 = hn::Mul(q2, hn::Set(d, a[2]));
        odd = hn::MulAdd(q8, hn::Set(d, a[8]), odd);
        even = hn::MulAdd(q3, hn::Set(d, a[3]), even);
        even2 = hn::MulAdd(q4, hn::Set(d, a[4]), even2);
        even = hn::Add(hn::MulAdd(q5, hn::Set(d, a[5]), even), even2);
        const auto kernel = hn::LoadU(d, value + static_cast<std::size_t>(k) * lanes + w);
        even = hn::Mul(even, kernel);
        odd = hn::Mul(odd, kernel);
        const auto trig = static_cast<std::size_t>(k) * every;
        const auto cm = hn::Set(d, c[trig]), sm = hn::Set(d, s[trig]);
        const auto e = hn::NegMulAdd(sm, odd, hn::Mul(cm, even));
        const auto o = hn::MulAdd(cm, odd, hn::Mul(sm, even));
        f0 = hn::MulAdd(e, hn::Set(d, b[0]), f0);
        f1 = hn::MulAdd(e, hn::Set(d, b[1]), f1);
        f2 = hn::MulAdd(e, hn::Set(d, b[2]), f2);
        f3 = hn::MulAdd(e, hn::Set(d, b[3]), f3);
        f4 = hn::MulAdd(e, hn::Set(d, b[4]), f4);
        f5 = hn::MulAdd(e, hn::Set(d, b[5]), f5);
        f6 = hn::MulAdd(o, hn::Set(d, b[6]), f6);
        f7 = hn::MulAdd(o, hn::Set(d, b[7]), f7);
        f8 = hn::MulAdd(o, hn::Set(d, b[8]), f8);
      }
      hn::StoreU(f0, d, f);
      hn::StoreU(f1, d, f + lanes);
      hn::StoreU(f2, d, f + 2 * lanes);
      hn::StoreU(f3, d, f + 3 * lanes);
      hn::StoreU(f4, d, f + 4 * lanes);
      hn::StoreU(f5, d, f + 5 * lanes);
      hn::StoreU(f6, d, f + 6 * lanes);
      hn::StoreU(f7, d, f + 7 * lanes);
      hn::StoreU(f8, d, f + 8 * lanes);
    }
  }
}

void MomentPassAny(const float* value, const float* emit, const float* receive, int n_samples,
                   std::size_t lanes, const float* cosine, const float* sine, std::size_t row,
                   std::size_t every, int modes, const float* source, float* field) {
  if (lanes == 8) {
    MomentPass(hn::CappedTag<float, 8>(), value, emit, receive, n_samples, lanes, cosine, sine, row,
               every, modes, source, field);
  } else {
    MomentPass(D(), value, emit, receive, n_samples, lanes, cosine, sine, row, every, modes, source,
               field);
  }
}

template <class Tag>
void CosineTransform(Tag d, const float* HWY_RESTRICT value, const float* HWY_RESTRICT weight,
                     int n_samples, std::size_t lanes, const float* HWY_RESTRICT cosine,
                     std::size_t row, std::size_t every, int modes, float* HWY_RESTRICT out) {
  const std::size_t step = hn::Lanes(d);
  const auto n = static_cast<std::size_t>(n_samples);
  for (std::size_t w = 0; w < lanes; w += step) {
    int m = 0;
    for (; m + 4 <= modes; m += 4) {
      auto s0 = hn::Zero(d), s1 = s0, s2 = s0, s3 = s0;
      const float* c = cosine + static_cast<std::size_t>(m) * row;
      for (std::size_t k = 0; k < n; ++k) {
        const auto v = hn::Mul(hn::LoadU(d, value + k * lanes + w), hn::Set(d, weight[k]));
        const std::size_t trig = k * every;
        s0 = hn::MulAdd(v, hn::Set(d, c[trig]), s0);
        s1 = hn::MulAdd(v, hn::Set(d, c[row + trig]), s1);
        s2 = hn::MulAdd(v, hn::Set(d, c[2 * row + trig]), s2);
        s3 = hn::MulAdd(v, hn::Set(d, c[3 * row + trig]), s3);
      }
      float* o = out + static_cast<std::size_t>(m) * lanes + w;
      hn::StoreU(s0, d, o);
      hn::StoreU(s1, d, o + lanes);
      hn::StoreU(s2, d, o + 2 * lanes);
      hn::StoreU(s3, d, o + 3 * lanes);
    }
    for (; m < modes; ++m) {
      auto s0 = hn::Zero(d);
      const float* c = cosine + static_cast<std::size_t>(m) * row;
      for (std::size_t k = 0; k < n; ++k) {
        const auto v = hn::Mul(hn::LoadU(d, value + k * lanes + w), hn::Set(d, weight[k]));
        s0 = hn::MulAdd(v, hn::Set(d, c[k * every]), s0);
      }
      hn::StoreU(s0, d, out + static_cast<std::size_t>(m) * lanes + w);
    }
  }
}

void CosineTransformAny(const float* value, const float* weight, int n_samples, std::size_t lanes,
                        const float* cosine, std::size_t row, std::size_t every, int modes,
                        float* out) {
  if (lanes == 8) {
    CosineTransform(hn::CappedTag<float, 8>(), value, weight, n_samples, lanes, cosine, row, every,
                    modes, out);
  } else {
    CosineTransform(D(), value, weight, n_samples, lanes, cosine, row, every, modes, out);
  }
}

void MultiplyAdd(const float* HWY_RESTRICT a, const float* HWY_RESTRICT b, float scale,
                 std::size_t n, float* HWY_RESTRICT field) {
  const hn::CappedTag<float, 8> d;
  const std::size_t step = hn::Lanes(d);
  const auto s = hn::Set(d, scale);
  for (std::size_t i = 0; i < n; i += step) {
    const auto x = hn::Mul(hn::LoadU(d, a + i), s);
    hn::StoreU(hn::MulAdd(x, hn::LoadU(d, b + i), hn::LoadU(d, field + i)), d, field + i);
  }
}

// The same kernel both ways: field_a += k b scale_b, field_b += k a scale_a.
void MultiplyAddBoth(const float* HWY_RESTRICT k, const float* HWY_RESTRICT a, float scale_a,
                     const float* HWY_RESTRICT b, float scale_b, std::size_t n,
                     float* HWY_RESTRICT field_a, float* HWY_RESTRICT field_b) {
  const hn::CappedTag<float, 8> d;
  const std::size_t step = hn::Lanes(d);
  const auto sa = hn::Set(d, scale_a), sb = hn::Set(d, scale_b);
  for (std::size_t i = 0; i < n; i += step) {
    const auto x = hn::LoadU(d, k + i);
    hn::StoreU(hn::MulAdd(hn::Mul(x, sb), hn::LoadU(d, b + i), hn::LoadU(d, field_a + i)), d,
               field_a + i);
    hn::StoreU(hn::MulAdd(hn::Mul(x, sa), hn::LoadU(d, a + i), hn::LoadU(d, field_b + i)), d,
               field_b + i);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>

namespace twilight {

HWY_EXPORT(MomentPassAny);
HWY_EXPORT(CosineTransformAny);
HWY_EXPORT(MultiplyAdd);
HWY_EXPORT(MultiplyAddBoth);

void moment_pass(const RingPairKernel& kernel, const AzimuthModes& modes, const float* source,
                 float* field) {
  HWY_DYNAMIC_DISPATCH(MomentPassAny)
  (kernel.value, kernel.emit.data(), kernel.receive.data(), kernel.samples, kernel.lanes,
   modes.cosine.data(), modes.sine.data(), static_cast<std::size_t>(modes.samples),
   static_cast<std::size_t>(kernel.every), std::min(modes.modes, kernel.modes), source, field);
}

void cosine_transform(const RingPairKernel& kernel, const AzimuthModes& modes, float* mode_kernel) {
  alignas(64) float weight[RingPairKernel::kMostSamples];
  for (int k = 0; k < kernel.samples; ++k) {
    const auto row = static_cast<std::size_t>(k) * kMoments;
    weight[k] = kernel.receive[row] * kernel.emit[row];
  }
  HWY_DYNAMIC_DISPATCH(CosineTransformAny)
  (kernel.value, weight, kernel.samples, kernel.lanes, modes.cosine.data(),
   static_cast<std::size_t>(modes.samples), static_cast<std::size_t>(kernel.every),
   std::min(modes.modes, kernel.modes), mode_kernel);
}

void multiply_add(const float* a, const float* b, float scale, std::size_t n, float* field) {
  HWY_DYNAMIC_DISPATCH(MultiplyAdd)(a, b, scale, n, field);
}

void multiply_add_both(const float* k, const float* a, float scale_a, const float* b, float scale_b,
                       std::size_t n, float* field_a, float* field_b) {
  HWY_DYNAMIC_DISPATCH(MultiplyAddBoth)(k, a, scale_a, b, scale_b, n, field_a, field_b);
}

}  // namespace twilight
#endif  // HWY_ONCE
