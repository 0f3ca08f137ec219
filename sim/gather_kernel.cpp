#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/gather_kernel.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include "hwy/contrib/math/math-inl.h"
#include "hwy/highway.h"
#include "sim/field_moments.h"
#include "sim/gather_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class Tag>
void March(Tag d, const GatherMarch& ray, const GatherOptics& o, float* radiance,
           float* transmittance) {
  const std::size_t L = ray.lanes;
  constexpr float kInv4Pi = 0.079577471545947668F;
  const auto one = hn::Set(d, 1.0F);
  for (std::size_t w = 0; w < L; w += hn::Lanes(d)) {
    auto sum = hn::LoadU(d, radiance + w);
    auto t = hn::LoadU(d, transmittance + w);
    // P2(cos) of air: 1 + 5 x2 P2.
    const float p2 = 1.5F * ray.cosine * ray.cosine - 0.5F;
    const auto air_phase = hn::MulAdd(hn::LoadU(d, o.rayleigh_x2 + w), hn::Set(d, 5.0F * p2), one);
    int layer = -1;
    auto scatter = hn::Zero(d), extinction = hn::Zero(d), inverse = hn::Zero(d);
    for (int i = 0; i < ray.steps; ++i) {
      const auto step = static_cast<std::size_t>(i);
      if (ray.layer[step] != layer) {
        layer = ray.layer[step];
        const std::size_t at = static_cast<std::size_t>(layer) * L + w;
        const auto g = hn::LoadU(d, o.asymmetry + at);
        const auto g2 = hn::Mul(g, g);
        // 1 + g^2 - 2 g cos = (1 - g)^2 + 2 g (1 - cos): never 0 in the forward peak.
        const auto back = hn::Sub(one, g);
        const auto base =
            hn::MulAdd(hn::Add(g, g), hn::Set(d, 1.0F - ray.cosine), hn::Mul(back, back));
        const auto hg = hn::Div(hn::Sub(one, g2), hn::Mul(base, hn::Sqrt(base)));
        scatter = hn::MulAdd(hn::LoadU(d, o.aerosol + at), hg,
                             hn::Mul(hn::LoadU(d, o.air + at), air_phase));
        if (o.s0 != nullptr) {
          scatter =
              hn::MulAdd(hn::LoadU(d, o.s1 + at), hn::Set(d, ray.cosine), hn::LoadU(d, o.s0 + at));
          scatter = hn::MulAdd(hn::LoadU(d, o.s2 + at),
                               hn::Set(d, ray.cosine * ray.cosine - 1.0F / 3), scatter);
          scatter = hn::Max(scatter, hn::Zero(d));
        }
        scatter = hn::Mul(scatter, hn::Set(d, kInv4Pi));
        extinction = hn::LoadU(d, o.extinction + at);
        inverse = hn::Div(one, hn::Max(extinction, hn::Set(d, 1e-30F)));
      }
      const auto ds = hn::Set(d, ray.length_km[step]);
      const auto depth = hn::Mul(extinction, ds);
      const auto e = hn::Exp(d, hn::Neg(hn::Min(depth, hn::Set(d, 80.0F))));
      // (1 - e^-x)/x without cancellation for thin steps.
      const auto thin = hn::Mul(ds, hn::NegMulAdd(depth, hn::Set(d, 0.5F), one));
      const auto thick = hn::Mul(hn::Sub(one, e), inverse);
      const auto weight = hn::IfThenElse(hn::Lt(depth, hn::Set(d, 2e-3F)), thin, thick);
      auto source = hn::LoadU(d, ray.multiple.data() + step * L + w);
      if (ray.lit[step]) {
        const auto sun =
            hn::Min(hn::LoadU(d, ray.sun_depth.data() + step * L + w), hn::Set(d, 85.0F));
        source = hn::MulAdd(hn::Exp(d, hn::Neg(sun)), scatter, source);
      }
      sum = hn::MulAdd(hn::Mul(t, weight), source, sum);
      t = hn::Mul(t, e);
    }
    hn::StoreU(sum, d, radiance + w);
    hn::StoreU(t, d, transmittance + w);
  }
}

void MarchAny(const GatherMarch& ray, const GatherOptics& o, float* radiance,
              float* transmittance) {
  if (ray.lanes == 8) {
    March(hn::CappedTag<float, 8>(), ray, o, radiance, transmittance);
  } else {
    March(hn::CappedTag<float, 16>(), ray, o, radiance, transmittance);
  }
}

template <class Tag>
void CellEmission(Tag d, const float* const* fields, const float* weights, int corners, int moments,
                  std::size_t L, const float* s0, const float* s1, const float* s2, float r,
                  float z, float* out) {
  constexpr float kInv4Pi = 0.079577471545947668F;
  const auto zero = hn::Zero(d);
  for (std::size_t w = 0; w < L; w += hn::Lanes(d)) {
    auto m0 = zero, m1 = zero, m2 = zero, m3 = zero, m4 = zero, m5 = zero;
    for (int c = 0; c < corners; ++c) {
      const float* f = fields[c] + w;
      const auto k = hn::Set(d, weights[c]);
      m0 = hn::MulAdd(hn::LoadU(d, f + kJ * L), k, m0);
      if (moments == 1) continue;
      m1 = hn::MulAdd(hn::LoadU(d, f + kFr * L), k, m1);
      m2 = hn::MulAdd(hn::LoadU(d, f + kFz * L), k, m2);
      m3 = hn::MulAdd(hn::LoadU(d, f + kSrr * L), k, m3);
      m4 = hn::MulAdd(hn::LoadU(d, f + kSzz * L), k, m4);
      m5 = hn::MulAdd(hn::LoadU(d, f + kSrz * L), k, m5);
    }
    auto e = hn::Mul(m0, hn::LoadU(d, s0 + w));
    if (moments > 1) {
      const auto flux = hn::MulAdd(m1, hn::Set(d, r), hn::Mul(m2, hn::Set(d, z)));
      auto second = hn::Mul(m3, hn::Set(d, r * r));
      second = hn::MulAdd(m4, hn::Set(d, z * z), second);
      second = hn::MulAdd(m5, hn::Set(d, 2 * r * z), second);
      e = hn::MulAdd(flux, hn::LoadU(d, s1 + w), e);
      e = hn::MulAdd(second, hn::LoadU(d, s2 + w), e);
    }
    hn::StoreU(hn::Mul(hn::Max(e, zero), hn::Set(d, kInv4Pi)), d, out + w);
  }
}

void CellEmissionAny(const float* const* fields, const float* weights, int corners, int moments,
                     std::size_t L, const float* s0, const float* s1, const float* s2, float r,
                     float z, float* out) {
  if (L == 8) {
    CellEmission(hn::CappedTag<float, 8>(), fields, weights, corners, moments, L, s0, s1, s2, r, z,
                 out);
  } else {
    CellEmission(hn::CappedTag<float, 16>(), fields, weights, corners, moments, L, s0, s1, s2, r, z,
                 out);
  }
}

void WeightedSum(const float* const* rows, const float* weights, std::size_t L, float* out) {
  const hn::CappedTag<float, 8> d;
  for (std::size_t w = 0; w < L; w += hn::Lanes(d)) {
    auto sum = hn::Mul(hn::LoadU(d, rows[0] + w), hn::Set(d, weights[0]));
    for (int k = 1; k < 4; ++k) {
      sum = hn::MulAdd(hn::LoadU(d, rows[k] + w), hn::Set(d, weights[k]), sum);
    }
    hn::StoreU(sum, d, out + w);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <cmath>

namespace twilight {

HWY_EXPORT(MarchAny);
HWY_EXPORT(CellEmissionAny);
HWY_EXPORT(WeightedSum);

void march(const GatherMarch& ray, const GatherOptics& optics, float* radiance,
           float* transmittance) {
  HWY_DYNAMIC_DISPATCH(MarchAny)(ray, optics, radiance, transmittance);
}

void march_scalar(const GatherMarch& ray, const GatherOptics& o, float* radiance,
                  float* transmittance) {
  const std::size_t L = ray.lanes;
  for (std::size_t w = 0; w < L; ++w) {
    double sum = radiance[w], t = transmittance[w];
    const double c = ray.cosine;
    for (std::size_t i = 0; i < static_cast<std::size_t>(ray.steps); ++i) {
      const std::size_t at = static_cast<std::size_t>(ray.layer[i]) * L + w;
      const double g = o.asymmetry[at];
      const double hg = (1 - g * g) / std::pow(1 + g * g - 2 * g * c, 1.5);
      const double rayleigh = 1 + 5.0 * o.rayleigh_x2[w] * (1.5 * c * c - 0.5);
      double scatter = (o.aerosol[at] * hg + o.air[at] * rayleigh) * 0.079577471545947668;
      if (o.s0 != nullptr) {
        scatter = std::max(0.0, o.s0[at] + o.s1[at] * c + o.s2[at] * (c * c - 1.0 / 3)) *
                  0.079577471545947668;
      }
      const double depth = static_cast<double>(o.extinction[at]) * ray.length_km[i];
      const double weight =
          depth > 0 ? -std::expm1(-depth) / depth * ray.length_km[i] : ray.length_km[i];
      double source = ray.multiple[i * L + w];
      if (ray.lit[i]) source += std::exp(-static_cast<double>(ray.sun_depth[i * L + w])) * scatter;
      sum += t * weight * source;
      t *= std::exp(-depth);
    }
    radiance[w] = static_cast<float>(sum);
    transmittance[w] = static_cast<float>(t);
  }
}

void cell_emission(const float* const* fields, const float* weights, int corners, int moments,
                   std::size_t lanes, const float* s0, const float* s1, const float* s2,
                   float dir_r, float dir_z, float* out) {
  HWY_DYNAMIC_DISPATCH(CellEmissionAny)
  (fields, weights, corners, moments, lanes, s0, s1, s2, dir_r, dir_z, out);
}

void weighted_sum(const float* const* rows, const float* weights, std::size_t lanes, float* out) {
  HWY_DYNAMIC_DISPATCH(WeightedSum)(rows, weights, lanes, out);
}

}  // namespace twilight
#endif  // HWY_ONCE
