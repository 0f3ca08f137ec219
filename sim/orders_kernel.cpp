#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/orders_kernel.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include <algorithm>
#include <cmath>

#include "hwy/contrib/math/math-inl.h"
#include "hwy/highway.h"
#include "sim/angular_moments.h"
#include "sim/orders_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Runs f with the widest vectors that divide the lanes (8, or a multiple of 16).
template <class T, class F>
HWY_INLINE void ForLanes(std::size_t lanes, const F& f) {
  if (lanes % 16 == 0) {
    f(hn::CappedTag<T, 16>());
  } else {
    f(hn::CappedTag<T, 8>());
  }
}

template <class T>
void SourceModes(const SourceModesInput<T>& in, T* HWY_RESTRICT modes) {
  const std::size_t lanes = in.lanes;
  const auto degree = static_cast<std::size_t>(in.degree);
  const std::size_t block = (degree + 1) * lanes;
  const std::size_t stride = (in.polarised ? 3 : 1) * block;
  const std::size_t count = moment_count(in.stored_phase_degree);
  const T c = in.cos_theta, s = in.sin_theta;
  ForLanes<T>(lanes, [&](auto d) {
    const auto c2p1 = hn::Set(d, c * c + 1), s2 = hn::Set(d, s * s), sc2 = hn::Set(d, -2 * s * c);
    const auto minus_s2 = hn::Set(d, -s * s), two_s = hn::Set(d, 2 * s),
               minus_2c = hn::Set(d, -2 * c), half = hn::Set(d, T(0.5));
    for (std::size_t w = 0; w < lanes; w += hn::Lanes(d)) {
      const auto k = hn::LoadU(d, in.air_weight + w);
      for (std::size_t j = 0; j < in.nodes; ++j) {
        T* HWY_RESTRICT out = modes + j * stride + w;
        const T* HWY_RESTRICT C = in.coherency + j * 4 * lanes + w;
        const auto xx = hn::Mul(k, hn::LoadU(d, C)), yy = hn::Mul(k, hn::LoadU(d, C + lanes));
        const auto zz = hn::Mul(k, hn::LoadU(d, C + 2 * lanes)),
                   xz = hn::Mul(k, hn::LoadU(d, C + 3 * lanes));
        const auto S = hn::Mul(half, hn::Add(xx, yy)), D = hn::Mul(half, hn::Sub(xx, yy));
        hn::StoreU(hn::MulAdd(c2p1, S, hn::Mul(s2, zz)), d, out);
        hn::StoreU(hn::Mul(sc2, xz), d, out + lanes);
        hn::StoreU(hn::Mul(minus_s2, D), d, out + 2 * lanes);
        for (std::size_t m = 3; m <= degree; ++m) hn::StoreU(hn::Zero(d), d, out + m * lanes);
        if (in.polarised) {
          T* HWY_RESTRICT q = out + block;
          T* HWY_RESTRICT u = q + block;
          hn::StoreU(hn::Mul(s2, hn::Sub(zz, S)), d, q);
          hn::StoreU(hn::Mul(sc2, xz), d, q + lanes);
          hn::StoreU(hn::Mul(c2p1, D), d, q + 2 * lanes);
          hn::StoreU(hn::Zero(d), d, u);
          hn::StoreU(hn::Mul(two_s, xz), d, u + lanes);
          hn::StoreU(hn::Mul(minus_2c, D), d, u + 2 * lanes);
          for (std::size_t m = 3; m <= degree; ++m) {
            hn::StoreU(hn::Zero(d), d, q + m * lanes);
            hn::StoreU(hn::Zero(d), d, u + m * lanes);
          }
        }
        if (in.moments == nullptr) continue;
        const std::size_t kinds = in.polarised ? 3 : 1;
        const T* HWY_RESTRICT I = in.moments + j * kinds * count * lanes + w;
        const T* HWY_RESTRICT E = I + count * lanes;
        const T* HWY_RESTRICT B = E + count * lanes;
        for (int m = 0; m <= in.phase_degree; ++m) {
          T* HWY_RESTRICT o = out + static_cast<std::size_t>(m) * lanes;
          auto si = hn::LoadU(d, o);
          auto sq = hn::Zero(d), su = hn::Zero(d);
          for (int l = m; l <= in.phase_degree; ++l) {
            const std::size_t i = moment_index(l, m);
            const std::size_t row = static_cast<std::size_t>(l) * lanes + w;
            const auto incoming = hn::LoadU(d, I + i * lanes);
            auto scattered = hn::Mul(hn::LoadU(d, in.a1 + row), incoming);
            if (in.polarised && l >= 2) {
              const auto e = hn::LoadU(d, E + i * lanes);
              const auto b1 = hn::LoadU(d, in.b1 + row);
              scattered = hn::MulAdd(b1, e, scattered);
              const auto es = hn::MulAdd(hn::LoadU(d, in.a2 + row), e, hn::Mul(b1, incoming));
              const auto bs = hn::Mul(hn::LoadU(d, in.a3 + row), hn::LoadU(d, B + i * lanes));
              const auto r = hn::Set(d, in.r[i]), t = hn::Set(d, in.t[i]);
              sq = hn::MulAdd(r, es, hn::MulAdd(t, bs, sq));
              su = hn::MulAdd(t, es, hn::MulAdd(r, bs, su));
            }
            si = hn::MulAdd(hn::Set(d, in.p[i]), scattered, si);
          }
          hn::StoreU(si, d, o);
          if (in.polarised) {
            hn::StoreU(hn::Add(hn::LoadU(d, o + block), sq), d, o + block);
            hn::StoreU(hn::Add(hn::LoadU(d, o + 2 * block), su), d, o + 2 * block);
          }
        }
      }
    }
  });
}

template <class T>
int SignificantDegree(const SourceModesInput<T>& in, const T* HWY_RESTRICT modes, T share) {
  const auto degree = static_cast<std::size_t>(in.degree);
  const std::size_t block = (degree + 1) * in.lanes, stokes = in.polarised ? 3 : 1;
  std::size_t significant = 2;
  ForLanes<T>(in.lanes, [&](auto d) {
    const auto limit = hn::Set(d, share);
    for (std::size_t j = 0; j < in.nodes && significant < degree; ++j) {
      for (std::size_t w = 0; w < in.lanes; w += hn::Lanes(d)) {
        const T* HWY_RESTRICT at = modes + j * stokes * block + w;
        const auto floor = hn::Mul(limit, hn::Abs(hn::LoadU(d, at)));
        for (std::size_t m = degree; m > significant; --m) {
          auto most = hn::Abs(hn::LoadU(d, at + m * in.lanes));
          for (std::size_t q = 1; q < stokes; ++q) {
            most = hn::Max(most, hn::Abs(hn::LoadU(d, at + q * block + m * in.lanes)));
          }
          if (!hn::AllFalse(d, hn::Gt(most, floor))) significant = m;
        }
      }
    }
  });
  return static_cast<int>(significant);
}

// Fine-scale position of the Sun's zenith angle at the point, and the azimuth of the ray there
// from the Sun's: the spherical triangle of start, point and subsolar point.
template <class T>
void SunAtPoint(const GatherInput<T>& in, T* HWY_RESTRICT fine, T* HWY_RESTRICT cos_azimuth,
                T* HWY_RESTRICT sin_azimuth) {
  const hn::CappedTag<T, 16> d;
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
    hn::StoreU(hn::Mul(along, inverse), d, cos_azimuth + i);
    hn::StoreU(hn::Mul(across, inverse), d, sin_azimuth + i);
    hn::StoreU(hn::Mul(hn::Acos(d, x), scale), d, fine + i);
  }
}

template <class T>
struct Taps {
  std::size_t fine, first;
  T f, w0, w1, w2, w3;
};

template <class T>
HWY_INLINE Taps<T> FindTaps(const GatherInput<T>& in, T u) {
  Taps<T> taps;
  taps.fine = static_cast<std::size_t>(u);
  taps.f = u - static_cast<T>(taps.fine);
  const T at = static_cast<T>(in.fine_position[taps.fine]);
  const T position = at + taps.f * (static_cast<T>(in.fine_position[taps.fine + 1]) - at);
  const auto last = static_cast<std::ptrdiff_t>(in.nodes) - 4;
  const std::ptrdiff_t first =
      std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(position) - 1, 0, last);
  taps.first = static_cast<std::size_t>(first);
  const T g = position - static_cast<T>(first) - 1;
  const T g1 = g - 1, g2 = g - 2, gp = g + 1;
  constexpr T kSixth = T(1) / 6;
  taps.w0 = -g * g1 * g2 * kSixth;
  taps.w1 = gp * g1 * g2 * T(0.5);
  taps.w2 = -gp * g * g2 * T(0.5);
  taps.w3 = gp * g * g1 * kSixth;
  return taps;
}

template <int kDegree, bool kPolarised, class T, class D>
HWY_INLINE void GatherPairs(D d, const GatherInput<T>& in, const T* HWY_RESTRICT fine,
                            const T* HWY_RESTRICT cos_azimuth, const T* HWY_RESTRICT sin_azimuth,
                            T* HWY_RESTRICT out) {
  const std::size_t lanes = in.lanes;
  const int degree = kDegree > 0 ? kDegree : in.degree;
  const std::size_t block = static_cast<std::size_t>(in.stored_degree + 1) * lanes;
  const std::size_t stride = (kPolarised ? 3 : 1) * block;
  for (std::size_t w = 0; w < lanes; w += hn::Lanes(d)) {
    for (std::size_t i = 0; i < in.pairs; ++i) {
      if (fine[i] >= static_cast<T>(in.fine_end)) continue;
      const Taps<T> tap = FindTaps(in, fine[i]);
      const T* HWY_RESTRICT g0 = in.modes + tap.first * stride + w;
      const T* HWY_RESTRICT g1 = g0 + stride;
      const T* HWY_RESTRICT g2 = g1 + stride;
      const T* HWY_RESTRICT g3 = g2 + stride;
      const auto w0 = hn::Set(d, tap.w0), w1 = hn::Set(d, tap.w1), w2 = hn::Set(d, tap.w2),
                 w3 = hn::Set(d, tap.w3);
      const auto mode = [&](std::size_t q) {
        return hn::MulAdd(
            w0, hn::LoadU(d, g0 + q),
            hn::MulAdd(w1, hn::LoadU(d, g1 + q),
                       hn::MulAdd(w2, hn::LoadU(d, g2 + q), hn::Mul(w3, hn::LoadU(d, g3 + q)))));
      };
      auto I = mode(0), Q = hn::Zero(d), U = hn::Zero(d);
      if (kPolarised) Q = mode(block);
      const T c1 = cos_azimuth[i], s1 = sin_azimuth[i];
      T c = c1, s = s1;
      for (int m = 1; m <= degree; ++m) {
        const std::size_t q = static_cast<std::size_t>(m) * lanes;
        const auto cm = hn::Set(d, c);
        I = hn::MulAdd(cm, mode(q), I);
        if (kPolarised) {
          Q = hn::MulAdd(cm, mode(block + q), Q);
          U = hn::MulAdd(hn::Set(d, s), mode(2 * block + q), U);
        }
        const T next = c * c1 - s * s1;
        s = s * c1 + c * s1;
        c = next;
      }
      const T* HWY_RESTRICT r = in.reference + tap.fine * lanes + w;
      const auto r0 = hn::LoadU(d, r), r1 = hn::LoadU(d, r + lanes);
      const auto ref = hn::MulAdd(hn::Set(d, tap.f), hn::Sub(r1, r0), r0);
      T* HWY_RESTRICT o = out + i * (kPolarised ? 3 : 1) * lanes + w;
      hn::StoreU(hn::MulAdd(ref, I, hn::LoadU(d, o)), d, o);
      if (kPolarised) {
        hn::StoreU(hn::MulAdd(ref, Q, hn::LoadU(d, o + lanes)), d, o + lanes);
        hn::StoreU(hn::MulAdd(ref, U, hn::LoadU(d, o + 2 * lanes)), d, o + 2 * lanes);
      }
    }
  }
}

template <class T>
void GatherModes(const GatherInput<T>& in, T* HWY_RESTRICT out) {
  const std::size_t padded = (in.pairs + 15) / 16 * 16;
  T* fine = in.scratch;
  T* cos_azimuth = fine + padded;
  T* sin_azimuth = cos_azimuth + padded;
  SunAtPoint(in, fine, cos_azimuth, sin_azimuth);
  ForLanes<T>(in.lanes, [&](auto d) {
    if (in.polarised) {
      if (in.degree == 2)
        GatherPairs<2, true>(d, in, fine, cos_azimuth, sin_azimuth, out);
      else
        GatherPairs<0, true>(d, in, fine, cos_azimuth, sin_azimuth, out);
    } else {
      if (in.degree == 2)
        GatherPairs<2, false>(d, in, fine, cos_azimuth, sin_azimuth, out);
      else
        GatherPairs<0, false>(d, in, fine, cos_azimuth, sin_azimuth, out);
    }
  });
}

template <bool kPolarised, class T, class D>
HWY_INLINE void BeamPairs(D d, const BeamInput<T>& in, const T* HWY_RESTRICT fine,
                          const T* HWY_RESTRICT cos_azimuth, const T* HWY_RESTRICT sin_azimuth,
                          T* HWY_RESTRICT out) {
  const GatherInput<T>& g = in.gather;
  const std::size_t lanes = g.lanes;
  const T last = static_cast<T>(in.phase_nodes) - T(1.001);
  const T scale = static_cast<T>(in.phase_nodes - 1) / 2;
  for (std::size_t w = 0; w < lanes; w += hn::Lanes(d)) {
    const auto air = hn::Mul(hn::Set(d, T(2) / 3), hn::LoadU(d, in.air_weight + w));
    const auto share = hn::LoadU(d, in.anisotropic_share + w);
    const auto isotropic = hn::Mul(air, hn::Sub(hn::Set(d, T(1)), share));
    const auto anisotropic = hn::Mul(hn::Set(d, T(0.75)), hn::Mul(air, share));
    for (std::size_t i = 0; i < g.pairs; ++i) {
      if (fine[i] >= static_cast<T>(g.fine_end)) continue;
      const auto at = static_cast<std::size_t>(fine[i]);
      const T f = fine[i] - static_cast<T>(at);
      const T ca = in.cos_sun[at] + f * (in.cos_sun[at + 1] - in.cos_sun[at]);
      const T sa = in.sin_sun[at] + f * (in.sin_sun[at + 1] - in.sin_sun[at]);
      const T along = sa * cos_azimuth[i];
      const T c = std::clamp(in.cos_theta * ca + in.sin_theta * along, T(-1), T(1));
      const auto c2 = hn::Set(d, c * c);
      auto I = hn::MulAdd(anisotropic, hn::Add(hn::Set(d, T(1)), c2), isotropic);
      auto Q = hn::Mul(anisotropic, hn::Sub(c2, hn::Set(d, T(1))));
      if (in.kinds > 0) {
        const T x = std::min((c + 1) * scale, last);
        const auto node = static_cast<std::size_t>(x);
        const auto fx = hn::Set(d, x - static_cast<T>(node));
        for (std::size_t q = 0; q < in.kinds; ++q) {
          const T* HWY_RESTRICT p = in.phase + (q * in.phase_nodes + node) * 2 * lanes + w;
          const auto weight = hn::LoadU(d, in.kind_weight + q * lanes + w);
          const auto p0 = hn::LoadU(d, p), p1 = hn::LoadU(d, p + 2 * lanes);
          I = hn::MulAdd(weight, hn::MulAdd(fx, hn::Sub(p1, p0), p0), I);
          if (kPolarised) {
            const auto q0 = hn::LoadU(d, p + lanes), q1 = hn::LoadU(d, p + 3 * lanes);
            Q = hn::MulAdd(weight, hn::MulAdd(fx, hn::Sub(q1, q0), q0), Q);
          }
        }
      }
      const T* HWY_RESTRICT r = g.reference + at * lanes + w;
      const auto r0 = hn::LoadU(d, r), r1 = hn::LoadU(d, r + lanes);
      const auto beam = hn::MulAdd(hn::Set(d, f), hn::Sub(r1, r0), r0);
      T* HWY_RESTRICT o = out + i * (kPolarised ? 3 : 1) * lanes + w;
      hn::StoreU(hn::MulAdd(beam, I, hn::LoadU(d, o)), d, o);
      if (kPolarised) {
        // From the scattering plane to the ray's vertical plane.
        const T on_theta = along * in.cos_theta - ca * in.sin_theta;
        const T on_phi = -sa * sin_azimuth[i];
        const T n2 = on_theta * on_theta + on_phi * on_phi;
        const T inverse = n2 > T(1e-12) ? 1 / n2 : T(0);
        const auto linear = hn::Mul(beam, Q);
        const auto cos_2a = hn::Set(d, (on_theta * on_theta - on_phi * on_phi) * inverse);
        const auto sin_2a = hn::Set(d, 2 * on_theta * on_phi * inverse);
        hn::StoreU(hn::MulAdd(linear, cos_2a, hn::LoadU(d, o + lanes)), d, o + lanes);
        hn::StoreU(hn::MulAdd(linear, sin_2a, hn::LoadU(d, o + 2 * lanes)), d, o + 2 * lanes);
      }
    }
  }
}

template <class T>
void GatherBeam(const BeamInput<T>& in, T* HWY_RESTRICT out) {
  const std::size_t padded = (in.gather.pairs + 15) / 16 * 16;
  T* fine = in.gather.scratch;
  T* cos_azimuth = fine + padded;
  T* sin_azimuth = cos_azimuth + padded;
  SunAtPoint(in.gather, fine, cos_azimuth, sin_azimuth);
  ForLanes<T>(in.gather.lanes, [&](auto d) {
    if (in.gather.polarised)
      BeamPairs<true>(d, in, fine, cos_azimuth, sin_azimuth, out);
    else
      BeamPairs<false>(d, in, fine, cos_azimuth, sin_azimuth, out);
  });
}

template <class T>
void GatherGround(const GatherInput<T>& in, const T* HWY_RESTRICT weight, std::size_t stride,
                  T* HWY_RESTRICT out) {
  const std::size_t padded = (in.pairs + 15) / 16 * 16;
  T* fine = in.scratch;
  SunAtPoint(in, fine, fine + padded, fine + 2 * padded);
  ForLanes<T>(in.lanes, [&](auto d) {
    for (std::size_t w = 0; w < in.lanes; w += hn::Lanes(d)) {
      const auto k = hn::LoadU(d, weight + w);
      for (std::size_t i = 0; i < in.pairs; ++i) {
        if (fine[i] >= static_cast<T>(in.fine_end)) continue;
        const auto at = static_cast<std::size_t>(fine[i]);
        const T* HWY_RESTRICT r = in.reference + at * in.lanes + w;
        const auto r0 = hn::LoadU(d, r), r1 = hn::LoadU(d, r + in.lanes);
        const auto f = hn::Set(d, fine[i] - static_cast<T>(at));
        const auto value = hn::MulAdd(f, hn::Sub(r1, r0), r0);
        T* o = out + i * stride + w;
        hn::StoreU(hn::MulAdd(k, value, hn::LoadU(d, o)), d, o);
      }
    }
  });
}

template <class T>
void AddMoments(const MomentInput<T>& in, T* HWY_RESTRICT coherency, T* HWY_RESTRICT moments) {
  const std::size_t lanes = in.lanes, stokes = in.polarised ? 3 : 1;
  const auto modes = static_cast<std::size_t>(in.phase_degree) + 1;
  const std::size_t count = moment_count(in.phase_degree);
  const T c = in.cos_theta, s = in.sin_theta;
  ForLanes<T>(lanes, [&](auto d) {
    for (std::size_t w = 0; w < lanes; w += hn::Lanes(d)) {
      for (std::size_t j = 0; j < in.nodes; ++j) {
        const T* HWY_RESTRICT light = in.light + j * in.azimuths * stokes * lanes + w;
        auto xx = hn::Zero(d), yy = hn::Zero(d), zz = hn::Zero(d), xz = hn::Zero(d);
        if (in.phase_degree > 0) {
          for (std::size_t k = 0; k < 3 * modes; ++k) {
            hn::StoreU(hn::Zero(d), d, in.scratch + k * lanes + w);
          }
        }
        for (std::size_t q = 0; q < in.azimuths; ++q) {
          const T* HWY_RESTRICT here = light + q * stokes * lanes;
          const T cf = in.cos_phi[q], sf = in.sin_phi[q], half = T(0.5) * in.weight;
          const auto I = hn::LoadU(d, here);
          auto Q = hn::Zero(d), U = hn::Zero(d);
          if (in.polarised) {
            Q = hn::LoadU(d, here + lanes);
            U = hn::LoadU(d, here + 2 * lanes);
          }
          const auto vertical = hn::Add(I, Q), horizontal = hn::Sub(I, Q);
          xx = hn::MulAdd(hn::Set(d, half * c * c * cf * cf), vertical, xx);
          xx = hn::MulAdd(hn::Set(d, half * sf * sf), horizontal, xx);
          xx = hn::MulAdd(hn::Set(d, -in.weight * c * cf * sf), U, xx);
          yy = hn::MulAdd(hn::Set(d, half * c * c * sf * sf), vertical, yy);
          yy = hn::MulAdd(hn::Set(d, half * cf * cf), horizontal, yy);
          yy = hn::MulAdd(hn::Set(d, in.weight * c * cf * sf), U, yy);
          zz = hn::MulAdd(hn::Set(d, half * s * s), vertical, zz);
          xz = hn::MulAdd(hn::Set(d, -half * s * c * cf), vertical, xz);
          xz = hn::MulAdd(hn::Set(d, half * s * sf), U, xz);
          if (in.phase_degree == 0) continue;
          T cm = in.weight, sm = 0;
          for (std::size_t m = 0; m < modes; ++m) {
            T* HWY_RESTRICT at = in.scratch + 3 * m * lanes + w;
            hn::StoreU(hn::MulAdd(hn::Set(d, cm), I, hn::LoadU(d, at)), d, at);
            if (in.polarised) {
              hn::StoreU(hn::MulAdd(hn::Set(d, cm), Q, hn::LoadU(d, at + lanes)), d, at + lanes);
              hn::StoreU(hn::MulAdd(hn::Set(d, sm), U, hn::LoadU(d, at + 2 * lanes)), d,
                         at + 2 * lanes);
            }
            const T next = cm * cf - sm * sf;
            sm = sm * cf + cm * sf;
            cm = next;
          }
        }
        T* HWY_RESTRICT C = coherency + j * 4 * lanes + w;
        const auto add = [&](T* at, auto value) {
          hn::StoreU(hn::Add(hn::LoadU(d, at), value), d, at);
        };
        add(C, xx);
        add(C + lanes, yy);
        add(C + 2 * lanes, zz);
        add(C + 3 * lanes, xz);
        if (in.phase_degree == 0) continue;
        T* HWY_RESTRICT I_lm = moments + j * stokes * count * lanes + w;
        T* HWY_RESTRICT E_lm = I_lm + count * lanes;
        T* HWY_RESTRICT B_lm = E_lm + count * lanes;
        for (int m = 0; m <= in.phase_degree; ++m) {
          const T* at = in.scratch + 3 * static_cast<std::size_t>(m) * lanes + w;
          const auto I = hn::LoadU(d, at);
          const auto Q = hn::LoadU(d, at + lanes), U = hn::LoadU(d, at + 2 * lanes);
          for (int l = m; l <= in.phase_degree; ++l) {
            const std::size_t i = moment_index(l, m);
            add(I_lm + i * lanes, hn::Mul(hn::Set(d, in.p[i]), I));
            if (in.polarised && l >= 2) {
              const auto r = hn::Set(d, in.r[i]), t = hn::Set(d, in.t[i]);
              add(E_lm + i * lanes, hn::MulAdd(r, Q, hn::Mul(t, U)));
              add(B_lm + i * lanes, hn::MulAdd(t, Q, hn::Mul(r, U)));
            }
          }
        }
      }
    }
  });
}

// Dispatch tables hold plain functions.
int SignificantDegreeF(const SourceModesInput<float>& in, const float* modes, float share) {
  return SignificantDegree(in, modes, share);
}
int SignificantDegreeD(const SourceModesInput<double>& in, const double* modes, double share) {
  return SignificantDegree(in, modes, share);
}
void SourceModesF(const SourceModesInput<float>& in, float* modes) { SourceModes(in, modes); }
void SourceModesD(const SourceModesInput<double>& in, double* modes) { SourceModes(in, modes); }
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

HWY_EXPORT(SignificantDegreeF);
HWY_EXPORT(SignificantDegreeD);
HWY_EXPORT(SourceModesF);
HWY_EXPORT(SourceModesD);
HWY_EXPORT(GatherModesF);
HWY_EXPORT(GatherModesD);
HWY_EXPORT(GatherBeamF);
HWY_EXPORT(GatherBeamD);
HWY_EXPORT(GatherGroundF);
HWY_EXPORT(GatherGroundD);
HWY_EXPORT(AddMomentsF);
HWY_EXPORT(AddMomentsD);

template <>
int significant_degree(const SourceModesInput<float>& in, const float* modes, float share) {
  return HWY_DYNAMIC_DISPATCH(SignificantDegreeF)(in, modes, share);
}
template <>
int significant_degree(const SourceModesInput<double>& in, const double* modes, double share) {
  return HWY_DYNAMIC_DISPATCH(SignificantDegreeD)(in, modes, share);
}
template <>
void source_modes(const SourceModesInput<float>& in, float* modes) {
  HWY_DYNAMIC_DISPATCH(SourceModesF)(in, modes);
}
template <>
void source_modes(const SourceModesInput<double>& in, double* modes) {
  HWY_DYNAMIC_DISPATCH(SourceModesD)(in, modes);
}
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
