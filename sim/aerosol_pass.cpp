#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/aerosol_pass.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include "hwy/highway.h"
#include "sim/aerosol_pass.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Azimuths i = -S/2..S of a source: those a target at 0..S/2 sees at a difference of -S/2..S/2.
struct LitAzimuths {
  int count = 0;
  int first[3], last[3];
};

// Intervals that hold every lit azimuth once; beyond their ends it is dark.
LitAzimuths FindLit(const unsigned char* lit, int half) {
  LitAzimuths a;
  int from = 0, to = half;
  while (from <= half && lit[from] == 0) ++from;
  if (from > half) return a;
  while (lit[to] == 0) --to;
  const int S = 2 * half;
  const auto add = [&](int first, int last) {
    if (a.count > 0 && first <= a.last[a.count - 1] + 1) {
      a.last[a.count - 1] = last;
      return;
    }
    a.first[a.count] = first;
    a.last[a.count++] = last;
  };
  add(-to, -from);
  add(from, to);
  add(S - to, S - from);
  return a;
}

// With Nodes = 2 a vector holds the lanes of two neighbouring azimuths.
template <int Nodes, class Tag>
void AerosolPass(Tag d, const RingPairKernel& kernel, const float* HWY_RESTRICT weight,
                 const AzimuthModes& azimuth, const float* HWY_RESTRICT power,
                 const unsigned char* lit, const float* HWY_RESTRICT asymmetry, float cos_e,
                 float sin_e, float* HWY_RESTRICT field) {
  constexpr int kMostNodes = 182;  // S/2 + 2 for S = 360
  constexpr int kWide = 16;
  alignas(64) float sent[3 * kMostNodes * kWide];  // [azimuth + S/2][lane], 0 where unlit
  alignas(64) float gained[kMostNodes * kWide];    // [target azimuth][lane]
  const int half = azimuth.divisions / 2;
  const LitAzimuths lit_at = FindLit(lit, half);
  if (lit_at.count == 0) return;
  const std::size_t N = hn::Lanes(d);
  const std::size_t width = N / static_cast<std::size_t>(Nodes);  // lanes of one azimuth
  const std::size_t lanes = kernel.lanes;
  const hn::CappedTag<float, 16 / Nodes> d_one;
  const auto at = [&](int i) { return static_cast<std::size_t>(i) * width; };
  for (std::size_t w = 0; w < lanes; w += width) {
    for (int i = -half; i <= 2 * half + 1; ++i) {
      const int around = i < 0 ? -i : (i > 2 * half ? i - 2 * half : i);
      const int mirror = around <= half ? around : 2 * half - around;
      const auto p = lit[mirror] != 0 && i <= 2 * half
                         ? hn::LoadU(d_one, power + static_cast<std::size_t>(mirror) * lanes + w)
                         : hn::Zero(d_one);
      hn::Store(p, d_one, sent + at(i + half));
    }
    for (int j = 0; j <= half + 1; ++j) hn::Store(hn::Zero(d_one), d_one, gained + at(j));

    alignas(64) float g_wide[kWide];
    for (std::size_t k = 0; k < N; ++k) g_wide[k] = asymmetry[w + k % width];
    const auto one = hn::Set(d, 1.0F), three = hn::Set(d, 3.0F);
    const auto g = hn::Load(d, g_wide);
    // 1 + g^2 - 2 g cos = (1 - g)^2 + 2 g (1 - cos): never 0 in the forward peak.
    const auto one_less = hn::Sub(one, g);
    const auto back = hn::Mul(one_less, one_less);
    const auto two_g = hn::Add(g, g);
    // 1/8: the Newton step below gives twice the reciprocal root.
    const auto scale = hn::Mul(hn::NegMulAdd(g, g, one), hn::Set(d, 0.125F));
    for (int k = 0; k < kernel.samples; ++k) {
      const auto sample = static_cast<std::size_t>(k);
      if (weight[sample] == 0.0F) continue;
      alignas(64) float v_wide[kWide];
      bool any = false;
      for (std::size_t x = 0; x < N; ++x) {
        v_wide[x] = kernel.value[sample * lanes + w + x % width] * weight[sample];
        any |= v_wide[x] != 0.0F;
      }
      if (!any) continue;
      const auto factor = hn::Mul(hn::Load(d, v_wide), scale);
      const bool both = k != 0 && k != kernel.samples - 1;
      for (int side = 0; side < (both ? 2 : 1); ++side) {
        const int shift = kernel.every * (side == 0 ? k : -k);
        const float across = side == 0 ? kernel.dir_a[sample] : -kernel.dir_a[sample];
        // Scattering angle between the sunlight's direction of travel and the exchange's:
        // 1 - cos = 1 + along cos(i) - across sin(i) + up.
        const auto up = hn::MulAdd(two_g, hn::Set(d, 1.0F + kernel.dir_z[sample] * sin_e), back);
        const auto a = hn::Mul(two_g, hn::Set(d, kernel.dir_r[sample] * cos_e));
        const auto b = hn::Mul(two_g, hn::Set(d, -across * cos_e));
        for (int part = 0; part < lit_at.count; ++part) {
          const int from = lit_at.first[part] + shift, to = lit_at.last[part] + shift;
          const int last = to < half ? to : half;
          // Even starts keep the target's vectors aligned; the azimuth before is dark.
          for (int j = from > 0 ? from - from % Nodes : 0; j <= last; j += Nodes) {
            const int i = j - shift + half;
            auto cosine = one, sine = one;
            if constexpr (Nodes == 1) {
              cosine = hn::Set(d, azimuth.cos_around[static_cast<std::size_t>(i)]);
              sine = hn::Set(d, azimuth.sin_around[static_cast<std::size_t>(i)]);
            } else {
              cosine = hn::LoadU(d, azimuth.cos_around_8.data() + 8 * static_cast<std::size_t>(i));
              sine = hn::LoadU(d, azimuth.sin_around_8.data() + 8 * static_cast<std::size_t>(i));
            }
            const auto t = hn::MulAdd(a, cosine, hn::MulAdd(b, sine, up));
            const auto r = hn::ApproximateReciprocalSqrt(t);
            const auto twice = hn::Mul(r, hn::NegMulAdd(t, hn::Mul(r, r), three));
            const auto hg = hn::Mul(twice, hn::Mul(twice, twice));
            const auto p = hn::Mul(hn::LoadU(d, sent + at(i)), factor);
            float* f = gained + at(j);
            hn::Store(hn::MulAdd(p, hg, hn::Load(d, f)), d, f);
          }
        }
      }
    }
    for (int j = 0; j <= half; ++j) {
      float* f = field + static_cast<std::size_t>(j) * lanes + w;
      hn::StoreU(hn::Add(hn::LoadU(d_one, f), hn::Load(d_one, gained + at(j))), d_one, f);
    }
  }
}

void AerosolPassAny(const RingPairKernel& kernel, const float* weight, const AzimuthModes& azimuth,
                    const float* power, const unsigned char* lit, const float* asymmetry,
                    float cos_e, float sin_e, float* field) {
  const hn::CappedTag<float, 16> d;
  const hn::CappedTag<float, 8> d8;
  if (kernel.lanes > 8) {
    AerosolPass<1>(d, kernel, weight, azimuth, power, lit, asymmetry, cos_e, sin_e, field);
  } else if (hn::Lanes(d) == 16) {
    AerosolPass<2>(d, kernel, weight, azimuth, power, lit, asymmetry, cos_e, sin_e, field);
  } else {
    AerosolPass<1>(d8, kernel, weight, azimuth, power, lit, asymmetry, cos_e, sin_e, field);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <cmath>

namespace twilight {

HWY_EXPORT(AerosolPassAny);

void first_event_pass(const RingPairKernel& kernel, const AzimuthModes& azimuth, const float* power,
                      const unsigned char* lit, const float* asymmetry, double sun_elevation_rad,
                      float* field) {
  float weight[RingPairKernel::kMostSamples];
  for (int k = 0; k < kernel.samples; ++k) {
    const auto sample = static_cast<std::size_t>(k);
    weight[sample] = kernel.leaving[sample] > 0
                         ? static_cast<float>(kernel.every) * kernel.arriving[sample]
                         : 0.0F;
  }
  HWY_DYNAMIC_DISPATCH(AerosolPassAny)
  (kernel, weight, azimuth, power, lit, asymmetry, static_cast<float>(std::cos(sun_elevation_rad)),
   static_cast<float>(std::sin(sun_elevation_rad)), field);
}

}  // namespace twilight
#endif  // HWY_ONCE
