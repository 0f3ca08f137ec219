#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/orders_kernel.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "hwy/contrib/math/math-inl.h"
#include "hwy/highway.h"
#include "sim/angular_moments.h"
#include "sim/emission_kernel.h"
#include "sim/for_lanes-inl.h"
#include "sim/orders_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// What a pair sees at the point, one array of the scratch each.
template <class T>
struct PairsAtPoint {
  T *fine, *cos_azimuth, *sin_azimuth;  // fine-scale position of the Sun's zenith angle
  T *cell, *f;                          // of the fine scale, and the place in it
  T *cos_sun, *sin_sun;                 // of that zenith angle
  T *first, *w0, *w1, *w2, *w3;         // cubic taps among the nodes
};

template <class T>
PairsAtPoint<T> Divide(T* scratch, std::size_t pairs) {
  const std::size_t n = padded_pairs(pairs);
  return {scratch,         scratch + n,     scratch + 2 * n,  scratch + 3 * n,
          scratch + 4 * n, scratch + 5 * n, scratch + 6 * n,  scratch + 7 * n,
          scratch + 8 * n, scratch + 9 * n, scratch + 10 * n, scratch + 11 * n};
}

// Fine-scale position of the Sun's zenith angle at the point, and the azimuth of the ray there
// from the Sun's: the spherical triangle of start, point and subsolar point.
template <class T>
PairsAtPoint<T> SunAtPoint(const GatherInput<T>& in) {
  const PairsAtPoint<T> at = Divide(in.scratch, in.pairs);
  const hn::CappedTag<T, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto cp = hn::Set(d, in.cos_psi), sp = hn::Set(d, in.sin_psi);
  const auto one = hn::Set(d, T(1));
  const auto tiny = hn::Set(d, sizeof(T) == 4 ? T(1e-12) : T(1e-24));
  const auto scale = hn::Set(d, in.fine_per_radian);
  for (std::size_t i = 0; i < in.pairs; i += hn::Lanes(d)) {
    const auto cc = hn::LoadU(d, in.cos_chi + i), sc = hn::LoadU(d, in.sin_chi + i);
    const auto cf = hn::LoadU(d, in.cos_phi + i), sf = hn::LoadU(d, in.sin_phi + i);
    auto x = hn::MulAdd(cc, cp, hn::Mul(hn::Mul(sc, sp), cf));
    x = hn::Max(hn::Min(x, one), hn::Neg(one));
    // Components of the ray's azimuth before division by sin: also the square of that sine.
    const auto along = hn::Sub(hn::Mul(hn::Mul(cp, sc), cf), hn::Mul(sp, cc));
    const auto across = hn::Mul(sf, sc);
    const auto s2 = hn::MulAdd(along, along, hn::Mul(across, across));
    const auto inverse = hn::Div(one, hn::Sqrt(hn::Max(s2, tiny)));
    const auto u = hn::Mul(hn::Acos(d, x), scale);
    const auto cell = hn::ConvertTo(d, hn::ConvertTo(di, u));
    hn::StoreU(hn::Mul(along, inverse), d, at.cos_azimuth + i);
    hn::StoreU(hn::Mul(across, inverse), d, at.sin_azimuth + i);
    hn::StoreU(x, d, at.cos_sun + i);
    hn::StoreU(hn::Sqrt(s2), d, at.sin_sun + i);
    hn::StoreU(u, d, at.fine + i);
    hn::StoreU(cell, d, at.cell + i);
    hn::StoreU(hn::Sub(u, cell), d, at.f + i);
  }
  return at;
}

// The steep factor at a pair's Sun, linear between fine points.
template <class T, class D>
HWY_INLINE hn::Vec<D> Reference(D d, const GatherInput<T>& in, const PairsAtPoint<T>& at,
                                std::size_t i, std::size_t w) {
  const T* r = in.reference + static_cast<std::size_t>(at.cell[i]) * in.lanes + w;
  const auto r0 = hn::LoadU(d, r), r1 = hn::LoadU(d, r + in.lanes);
  return hn::MulAdd(hn::Set(d, at.f[i]), hn::Sub(r1, r0), r0);
}

// Cubic taps of every pair.
template <class T>
void FindTaps(const GatherInput<T>& in, const PairsAtPoint<T>& at) {
  const hn::CappedTag<T, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto one = hn::Set(d, T(1)), half = hn::Set(d, T(0.5)), sixth = hn::Set(d, T(1) / 6);
  const auto last = hn::Set(d, static_cast<T>(in.nodes) - 4);
  // Pairs in the dark are not looked at, but must not reach beyond the tables.
  const auto last_cell = hn::Set(d, static_cast<T>(in.fine_end) - 1);
  for (std::size_t i = 0; i < in.pairs; i += hn::Lanes(d)) {
    const auto cell = hn::ConvertTo(di, hn::Min(hn::LoadU(d, at.cell + i), last_cell));
    const auto p0 = hn::GatherIndex(d, in.fine_position, cell);
    const auto p1 = hn::GatherIndex(d, in.fine_position + 1, cell);
    const auto position = hn::MulAdd(hn::LoadU(d, at.f + i), hn::Sub(p1, p0), p0);
    const auto whole = hn::ConvertTo(d, hn::ConvertTo(di, position));
    const auto first = hn::Max(hn::Zero(d), hn::Min(hn::Sub(whole, one), last));
    const auto g = hn::Sub(hn::Sub(position, first), one);
    const auto g1 = hn::Sub(g, one), g2 = hn::Sub(g1, one), gp = hn::Add(g, one);
    const auto outer = hn::Mul(g1, g2), inner = hn::Mul(gp, g);
    hn::StoreU(first, d, at.first + i);
    hn::StoreU(hn::Neg(hn::Mul(hn::Mul(g, outer), sixth)), d, at.w0 + i);
    hn::StoreU(hn::Mul(hn::Mul(gp, outer), half), d, at.w1 + i);
    hn::StoreU(hn::Neg(hn::Mul(hn::Mul(inner, g2), half)), d, at.w2 + i);
    hn::StoreU(hn::Mul(hn::Mul(inner, g1), sixth), d, at.w3 + i);
  }
}

// The first vector of cosines or sines: of mode 0, and of mode 1 where two share a vector.
template <std::size_t kShared, class D, class T = hn::TFromD<D>>
HWY_INLINE hn::Vec<D> FirstModes(D d, T zeroth, T first) {
#if HWY_TARGET != HWY_SCALAR
  if constexpr (kShared == 2) {
    const hn::Half<D> dh;
    return hn::Combine(d, hn::Set(dh, first), hn::Set(dh, zeroth));
  }
#endif
  (void)first;
  return hn::Set(d, zeroth);
}

// kShared modes stand side by side in one vector: two where 8 lanes fill half of it.
template <std::size_t kShared, bool kPolarised, class T, class D>
HWY_INLINE void GatherPairs(D d, const GatherInput<T>& in, const PairsAtPoint<T>& at,
                            T* HWY_RESTRICT out) {
  const std::size_t lanes = in.lanes, step = kShared * lanes;
  const std::size_t vectors = (static_cast<std::size_t>(in.degree) + kShared) / kShared;
  const std::size_t block = mode_rows(in.stored_degree) * lanes;
  const std::size_t stride = (kPolarised ? 3 : 1) * block;
  const T end = static_cast<T>(in.fine_end);
  const std::size_t width = kShared == 1 ? hn::Lanes(d) : lanes;
  for (std::size_t w = 0; w < lanes; w += width) {
    for (std::size_t i = 0; i < in.pairs; ++i) {
      if (at.fine[i] >= end) continue;
      const T* HWY_RESTRICT g0 = in.modes + static_cast<std::size_t>(at.first[i]) * stride + w;
      const T* HWY_RESTRICT g1 = g0 + stride;
      const T* HWY_RESTRICT g2 = g1 + stride;
      const T* HWY_RESTRICT g3 = g2 + stride;
      const auto w0 = hn::Set(d, at.w0[i]), w1 = hn::Set(d, at.w1[i]), w2 = hn::Set(d, at.w2[i]),
                 w3 = hn::Set(d, at.w3[i]);
      const auto mode = [&](std::size_t q) HWY_ATTR {
        return hn::MulAdd(
            w0, hn::LoadU(d, g0 + q),
            hn::MulAdd(w1, hn::LoadU(d, g1 + q),
                       hn::MulAdd(w2, hn::LoadU(d, g2 + q), hn::Mul(w3, hn::LoadU(d, g3 + q)))));
      };
      const T c1 = at.cos_azimuth[i], s1 = at.sin_azimuth[i];
      auto c = FirstModes<kShared>(d, T(1), c1), s = FirstModes<kShared>(d, T(0), s1);
      // By which the next vector of modes is turned.
      const T cs = kShared == 2 ? c1 * c1 - s1 * s1 : c1, ss = kShared == 2 ? 2 * c1 * s1 : s1;
      const auto ct = hn::Set(d, cs), st = hn::Set(d, ss);
      auto I = hn::Zero(d), Q = hn::Zero(d), U = hn::Zero(d);
      for (std::size_t v = 0; v < vectors; ++v) {
        const std::size_t q = v * step;
        I = hn::MulAdd(c, mode(q), I);
        if constexpr (kPolarised) {
          Q = hn::MulAdd(c, mode(block + q), Q);
          U = hn::MulAdd(s, mode(2 * block + q), U);
        }
        const auto next = hn::NegMulAdd(s, st, hn::Mul(c, ct));
        s = hn::MulAdd(c, st, hn::Mul(s, ct));
        c = next;
      }
      const auto add = [&](auto dl, auto i0, auto q0, auto u0) HWY_ATTR {
        const auto ref = Reference(dl, in, at, i, w);
        T* HWY_RESTRICT o = out + i * (kPolarised ? 3 : 1) * lanes + w;
        hn::StoreU(hn::MulAdd(ref, i0, hn::LoadU(dl, o)), dl, o);
        if constexpr (kPolarised) {
          hn::StoreU(hn::MulAdd(ref, q0, hn::LoadU(dl, o + lanes)), dl, o + lanes);
          hn::StoreU(hn::MulAdd(ref, u0, hn::LoadU(dl, o + 2 * lanes)), dl, o + 2 * lanes);
        }
      };
#if HWY_TARGET != HWY_SCALAR
      if constexpr (kShared == 2) {
        const hn::Half<D> dh;
        const auto fold = [&](auto x) HWY_ATTR {
          return hn::Add(hn::LowerHalf(dh, x), hn::UpperHalf(dh, x));
        };
        add(dh, fold(I), fold(Q), fold(U));
        continue;
      }
#endif
      add(d, I, Q, U);
    }
  }
}

template <class T>
void GatherModes(const GatherInput<T>& in, T* HWY_RESTRICT out) {
  if (in.fine_end == 0) return;
  const PairsAtPoint<T> at = SunAtPoint(in);
  FindTaps(in, at);
  const auto run = [&](auto shared, auto d) HWY_ATTR {
    if (in.polarised) {
      GatherPairs<shared(), true>(d, in, at, out);
    } else {
      GatherPairs<shared(), false>(d, in, at, out);
    }
  };
  using One = std::integral_constant<std::size_t, 1>;
  if constexpr (hn::MaxLanes(hn::CappedTag<T, 16>()) == 16) {
    if (in.lanes == 8) {
      return run(std::integral_constant<std::size_t, 2>(), hn::CappedTag<T, 16>());
    }
  }
  ForLanes<T>(in.lanes, [&](auto d) HWY_ATTR { run(One(), d); });
}

// Direction of the Sun and of the look at the point, one array of the scratch each.
template <class T>
struct BeamAtPoint {
  T *cosine, *cos_2a, *sin_2a;  // of scattering; from the scattering plane to the vertical one
  T *node, *fraction;           // in the tables of the phase functions
};

template <class T>
BeamAtPoint<T> ScatterAtPoint(const BeamInput<T>& in, const PairsAtPoint<T>& at) {
  const std::size_t n = padded_pairs(in.gather.pairs);
  T* scratch = in.gather.scratch + 7 * n;  // the taps are not needed
  const BeamAtPoint<T> beam{scratch, scratch + n, scratch + 2 * n, scratch + 3 * n,
                            scratch + 4 * n};
  const hn::CappedTag<T, 16> d;
  const hn::RebindToSigned<decltype(d)> di;
  const auto one = hn::Set(d, T(1)), zero = hn::Zero(d), tiny = hn::Set(d, T(1e-12));
  const auto minus_half = hn::Set(d, T(-0.5)), minus_sixth = hn::Set(d, T(-1) / 6);
  const auto c24 = hn::Set(d, T(1) / 24), c120 = hn::Set(d, T(1) / 120);
  const auto ct = hn::Set(d, in.cos_theta), st = hn::Set(d, in.sin_theta);
  const auto scale = hn::Set(d, static_cast<T>(in.phase_nodes - 1) / 2);
  const auto last = hn::Set(d, static_cast<T>(in.phase_nodes) - T(1.001));
  const auto last_cell = hn::Set(d, static_cast<T>(in.gather.fine_end) - 1);
  const auto end = hn::Set(d, static_cast<T>(in.gather.fine_end));
  for (std::size_t i = 0; i < in.gather.pairs; i += hn::Lanes(d)) {
    if (hn::AllFalse(d, hn::Lt(hn::LoadU(d, at.fine + i), end))) continue;
    const auto cell = hn::ConvertTo(di, hn::Min(hn::LoadU(d, at.cell + i), last_cell));
    const auto f = hn::LoadU(d, at.f + i);
    // The Sun's zenith angle less a small lift, by the first terms of its cosine and sine.
    const auto l0 = hn::GatherIndex(d, in.lift_rad, cell);
    const auto l1 = hn::GatherIndex(d, in.lift_rad + 1, cell);
    const auto lift = hn::MulAdd(f, hn::Sub(l1, l0), l0), l2 = hn::Mul(lift, lift);
    const auto cl = hn::MulAdd(l2, hn::MulAdd(l2, c24, minus_half), one);
    const auto sl = hn::Mul(lift, hn::MulAdd(l2, hn::MulAdd(l2, c120, minus_sixth), one));
    const auto cx = hn::LoadU(d, at.cos_sun + i), sx = hn::LoadU(d, at.sin_sun + i);
    const auto ca = hn::MulAdd(cx, cl, hn::Mul(sx, sl));
    const auto sa = hn::NegMulAdd(cx, sl, hn::Mul(sx, cl));
    const auto along = hn::Mul(sa, hn::LoadU(d, at.cos_azimuth + i));
    auto c = hn::MulAdd(ct, ca, hn::Mul(st, along));
    c = hn::Max(hn::Min(c, one), hn::Neg(one));
    const auto on_theta = hn::Sub(hn::Mul(along, ct), hn::Mul(ca, st));
    const auto on_phi = hn::Neg(hn::Mul(sa, hn::LoadU(d, at.sin_azimuth + i)));
    const auto t2 = hn::Mul(on_theta, on_theta), p2 = hn::Mul(on_phi, on_phi);
    const auto n2 = hn::Add(t2, p2);
    const auto inverse = hn::IfThenElse(hn::Gt(n2, tiny), hn::Div(one, hn::Max(n2, tiny)), zero);
    const auto x = hn::Min(hn::Mul(hn::Add(c, one), scale), last);
    const auto node = hn::ConvertTo(d, hn::ConvertTo(di, x));
    hn::StoreU(c, d, beam.cosine + i);
    hn::StoreU(hn::Mul(hn::Sub(t2, p2), inverse), d, beam.cos_2a + i);
    hn::StoreU(hn::Mul(hn::Add(on_theta, on_theta), hn::Mul(on_phi, inverse)), d, beam.sin_2a + i);
    hn::StoreU(node, d, beam.node + i);
    hn::StoreU(hn::Sub(x, node), d, beam.fraction + i);
  }
  return beam;
}

template <bool kPolarised, class T, class D>
HWY_INLINE void BeamPairs(D d, const BeamInput<T>& in, const PairsAtPoint<T>& at,
                          const BeamAtPoint<T>& scatter, T* HWY_RESTRICT out) {
  const GatherInput<T>& g = in.gather;
  const std::size_t lanes = g.lanes;
  const T end = static_cast<T>(g.fine_end);
  const auto one = hn::Set(d, T(1));
  for (std::size_t w = 0; w < lanes; w += hn::Lanes(d)) {
    const auto air = hn::Mul(hn::Set(d, T(2) / 3), hn::LoadU(d, in.air_weight + w));
    const auto share = hn::LoadU(d, in.anisotropic_share + w);
    const auto isotropic = hn::Mul(air, hn::Sub(one, share));
    const auto anisotropic = hn::Mul(hn::Set(d, T(0.75)), hn::Mul(air, share));
    for (std::size_t i = 0; i < g.pairs; ++i) {
      if (at.fine[i] >= end) continue;
      const auto c2 = hn::Set(d, scatter.cosine[i] * scatter.cosine[i]);
      auto I = hn::MulAdd(anisotropic, hn::Add(one, c2), isotropic);
      auto Q = hn::Mul(anisotropic, hn::Sub(c2, one));
      if (in.kinds > 0) {
        const auto node = static_cast<std::size_t>(scatter.node[i]);
        const auto fx = hn::Set(d, scatter.fraction[i]);
        for (std::size_t q = 0; q < in.kinds; ++q) {
          const std::size_t kind = in.kind[q];
          const T* HWY_RESTRICT p = in.phase + (kind * in.phase_nodes + node) * 2 * lanes + w;
          const auto weight = hn::LoadU(d, in.kind_weight + kind * lanes + w);
          const auto p0 = hn::LoadU(d, p), p1 = hn::LoadU(d, p + 2 * lanes);
          I = hn::MulAdd(weight, hn::MulAdd(fx, hn::Sub(p1, p0), p0), I);
          if constexpr (kPolarised) {
            const auto q0 = hn::LoadU(d, p + lanes), q1 = hn::LoadU(d, p + 3 * lanes);
            Q = hn::MulAdd(weight, hn::MulAdd(fx, hn::Sub(q1, q0), q0), Q);
          }
        }
      }
      const auto beam = Reference(d, g, at, i, w);
      T* HWY_RESTRICT o = out + i * (kPolarised ? 3 : 1) * lanes + w;
      hn::StoreU(hn::MulAdd(beam, I, hn::LoadU(d, o)), d, o);
      if constexpr (kPolarised) {
        const auto linear = hn::Mul(beam, Q);
        const auto cos_2a = hn::Set(d, scatter.cos_2a[i]), sin_2a = hn::Set(d, scatter.sin_2a[i]);
        hn::StoreU(hn::MulAdd(linear, cos_2a, hn::LoadU(d, o + lanes)), d, o + lanes);
        hn::StoreU(hn::MulAdd(linear, sin_2a, hn::LoadU(d, o + 2 * lanes)), d, o + 2 * lanes);
      }
    }
  }
}

template <class T>
void GatherBeam(const BeamInput<T>& in, T* HWY_RESTRICT out) {
  if (in.gather.fine_end == 0) return;
  const PairsAtPoint<T> at = SunAtPoint(in.gather);
  const BeamAtPoint<T> scatter = ScatterAtPoint(in, at);
  ForLanes<T>(in.gather.lanes, [&](auto d) HWY_ATTR {
    if (in.gather.polarised) {
      BeamPairs<true>(d, in, at, scatter, out);
    } else {
      BeamPairs<false>(d, in, at, scatter, out);
    }
  });
}

template <class T>
void GatherGround(const GatherInput<T>& in, const T* HWY_RESTRICT weight, std::size_t stride,
                  T* HWY_RESTRICT out) {
  const PairsAtPoint<T> at = SunAtPoint(in);
  ForLanes<T>(in.lanes, [&](auto d) HWY_ATTR {
    for (std::size_t w = 0; w < in.lanes; w += hn::Lanes(d)) {
      const auto k = hn::LoadU(d, weight + w);
      for (std::size_t i = 0; i < in.pairs; ++i) {
        if (at.fine[i] >= static_cast<T>(in.fine_end)) continue;
        const auto value = Reference(d, in, at, i, w);
        T* o = out + i * stride + w;
        hn::StoreU(hn::MulAdd(k, value, hn::LoadU(d, o)), d, o);
      }
    }
  });
}

// Fourier sums over the azimuths of one direction and node, and the coherency tensor.
template <bool kPolarised, class T, class D>
HWY_INLINE void SumAzimuths(D d, const MomentInput<T>& in, std::size_t k, std::size_t j,
                            std::size_t w, T* HWY_RESTRICT coherency, T* HWY_RESTRICT sums) {
  const std::size_t lanes = in.lanes;
  const T c = in.cos_theta[k], s = in.sin_theta[k], weight = in.weight[k], half = T(0.5) * weight;
  const T* HWY_RESTRICT light = in.light[k] + j * in.azimuths * (kPolarised ? 3 : 1) * lanes + w;
  const std::size_t modes =
      in.phase_degree > 0 ? static_cast<std::size_t>(in.phase_degree) + 1 : std::size_t{0};
  for (std::size_t n = 0; n < 3 * modes; ++n) hn::StoreU(hn::Zero(d), d, sums + n * lanes);
  auto xx = hn::Zero(d), yy = hn::Zero(d), zz = hn::Zero(d), xz = hn::Zero(d);
  for (std::size_t q = 0; q < in.azimuths; ++q) {
    const T* HWY_RESTRICT here = light + q * (kPolarised ? 3 : 1) * lanes;
    const T cf = in.cos_phi[q], sf = in.sin_phi[q];
    const auto I = hn::LoadU(d, here);
    auto Q = hn::Zero(d), U = hn::Zero(d);
    if constexpr (kPolarised) {
      Q = hn::LoadU(d, here + lanes);
      U = hn::LoadU(d, here + 2 * lanes);
    }
    const auto vertical = hn::Add(I, Q), horizontal = hn::Sub(I, Q);
    xx = hn::MulAdd(hn::Set(d, half * c * c * cf * cf), vertical, xx);
    xx = hn::MulAdd(hn::Set(d, half * sf * sf), horizontal, xx);
    xx = hn::MulAdd(hn::Set(d, -weight * c * cf * sf), U, xx);
    yy = hn::MulAdd(hn::Set(d, half * c * c * sf * sf), vertical, yy);
    yy = hn::MulAdd(hn::Set(d, half * cf * cf), horizontal, yy);
    yy = hn::MulAdd(hn::Set(d, weight * c * cf * sf), U, yy);
    zz = hn::MulAdd(hn::Set(d, half * s * s), vertical, zz);
    xz = hn::MulAdd(hn::Set(d, -half * s * c * cf), vertical, xz);
    xz = hn::MulAdd(hn::Set(d, half * s * sf), U, xz);
    T cm = weight, sm = 0;
    for (std::size_t m = 0; m < modes; ++m) {
      T* HWY_RESTRICT at = sums + 3 * m * lanes;
      hn::StoreU(hn::MulAdd(hn::Set(d, cm), I, hn::LoadU(d, at)), d, at);
      if constexpr (kPolarised) {
        hn::StoreU(hn::MulAdd(hn::Set(d, cm), Q, hn::LoadU(d, at + lanes)), d, at + lanes);
        hn::StoreU(hn::MulAdd(hn::Set(d, sm), U, hn::LoadU(d, at + 2 * lanes)), d, at + 2 * lanes);
      }
      const T next = cm * cf - sm * sf;
      sm = sm * cf + cm * sf;
      cm = next;
    }
  }
  T* HWY_RESTRICT C = coherency + j * 4 * lanes + w;
  const auto add = [&](T* at, auto value)
                       HWY_ATTR { hn::StoreU(hn::Add(hn::LoadU(d, at), value), d, at); };
  add(C, xx);
  add(C + lanes, yy);
  add(C + 2 * lanes, zz);
  add(C + 3 * lanes, xz);
}

// The directions share every access to a moment.
template <bool kPolarised, class T>
void AddMomentsOf(const MomentInput<T>& in, T* HWY_RESTRICT coherency, T* HWY_RESTRICT moments) {
  const std::size_t lanes = in.lanes, count = moment_count(in.phase_degree);
  const std::size_t sums = 3 * static_cast<std::size_t>(in.phase_degree + 1) * lanes;
  ForLanes<T>(lanes, [&](auto d) HWY_ATTR {
    for (std::size_t w = 0; w < lanes; w += hn::Lanes(d)) {
      for (std::size_t j = 0; j < in.nodes; ++j) {
        for (std::size_t k = 0; k < in.directions; ++k) {
          SumAzimuths<kPolarised>(d, in, k, j, w, coherency, in.scratch + k * sums + w);
        }
        if (in.phase_degree == 0) continue;
        T* HWY_RESTRICT I_lm = moments + j * (kPolarised ? 3 : 1) * count * lanes + w;
        T* HWY_RESTRICT E_lm = I_lm + count * lanes;
        T* HWY_RESTRICT B_lm = E_lm + count * lanes;
        for (int l = 0; l <= in.phase_degree; ++l) {
          for (int m = 0; m <= l; ++m) {
            const std::size_t i = moment_index(l, m) * lanes;
            const std::size_t b = 3 * mode_major_index(in.phase_degree, l, m);
            auto si = hn::LoadU(d, I_lm + i), se = hn::Zero(d), sb = hn::Zero(d);
            const bool vector = kPolarised && l >= 2;
            if (vector) {
              se = hn::LoadU(d, E_lm + i);
              sb = hn::LoadU(d, B_lm + i);
            }
            for (std::size_t k = 0; k < in.directions; ++k) {
              const T* HWY_RESTRICT at =
                  in.scratch + k * sums + 3 * static_cast<std::size_t>(m) * lanes + w;
              const T* HWY_RESTRICT basis = in.basis[k] + b;
              si = hn::MulAdd(hn::Set(d, basis[0]), hn::LoadU(d, at), si);
              if (!vector) continue;
              const auto r = hn::Set(d, basis[1]), t = hn::Set(d, basis[2]);
              const auto Q = hn::LoadU(d, at + lanes), U = hn::LoadU(d, at + 2 * lanes);
              se = hn::MulAdd(r, Q, hn::MulAdd(t, U, se));
              sb = hn::MulAdd(t, Q, hn::MulAdd(r, U, sb));
            }
            hn::StoreU(si, d, I_lm + i);
            if (!vector) continue;
            hn::StoreU(se, d, E_lm + i);
            hn::StoreU(sb, d, B_lm + i);
          }
        }
      }
    }
  });
}

template <class T>
void AddMoments(const MomentInput<T>& in, T* HWY_RESTRICT coherency, T* HWY_RESTRICT moments) {
  if (in.polarised) {
    AddMomentsOf<true>(in, coherency, moments);
  } else {
    AddMomentsOf<false>(in, coherency, moments);
  }
}

// Dispatch tables hold plain functions.
void GatherModesF(const GatherInput<float>& in, float* out) { GatherModes(in, out); }
void GatherModesD(const GatherInput<double>& in, double* out) { GatherModes(in, out); }
void GatherBeamF(const BeamInput<float>& in, float* out) { GatherBeam(in, out); }
void GatherBeamD(const BeamInput<double>& in, double* out) { GatherBeam(in, out); }
void GatherGroundF(const GatherInput<float>& in, const float* weight, std::size_t stride,
                   float* out) {
  GatherGround(in, weight, stride, out);
}
void GatherGroundD(const GatherInput<double>& in, const double* weight, std::size_t stride,
                   double* out) {
  GatherGround(in, weight, stride, out);
}
void AddMomentsF(const MomentInput<float>& in, float* coherency, float* moments) {
  AddMoments(in, coherency, moments);
}
void AddMomentsD(const MomentInput<double>& in, double* coherency, double* moments) {
  AddMoments(in, coherency, moments);
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace twilight {

HWY_EXPORT(GatherModesF);
HWY_EXPORT(GatherModesD);
HWY_EXPORT(GatherBeamF);
HWY_EXPORT(GatherBeamD);
HWY_EXPORT(GatherGroundF);
HWY_EXPORT(GatherGroundD);
HWY_EXPORT(AddMomentsF);
HWY_EXPORT(AddMomentsD);

template <>
void gather_modes(const GatherInput<float>& in, float* out) {
  HWY_DYNAMIC_DISPATCH(GatherModesF)(in, out);
}
template <>
void gather_modes(const GatherInput<double>& in, double* out) {
  HWY_DYNAMIC_DISPATCH(GatherModesD)(in, out);
}
template <>
void gather_beam(const BeamInput<float>& in, float* out) {
  HWY_DYNAMIC_DISPATCH(GatherBeamF)(in, out);
}
template <>
void gather_beam(const BeamInput<double>& in, double* out) {
  HWY_DYNAMIC_DISPATCH(GatherBeamD)(in, out);
}
template <>
void gather_ground(const GatherInput<float>& in, const float* weight, std::size_t stride,
                   float* out) {
  HWY_DYNAMIC_DISPATCH(GatherGroundF)(in, weight, stride, out);
}
template <>
void gather_ground(const GatherInput<double>& in, const double* weight, std::size_t stride,
                   double* out) {
  HWY_DYNAMIC_DISPATCH(GatherGroundD)(in, weight, stride, out);
}
template <>
void add_moments(const MomentInput<float>& in, float* coherency, float* moments) {
  HWY_DYNAMIC_DISPATCH(AddMomentsF)(in, coherency, moments);
}
template <>
void add_moments(const MomentInput<double>& in, double* coherency, double* moments) {
  HWY_DYNAMIC_DISPATCH(AddMomentsD)(in, coherency, moments);
}

}  // namespace twilight
#endif
