#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/sky_table_kernel.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include <algorithm>

#include "hwy/contrib/math/math-inl.h"
#include "hwy/highway.h"
#include "sim/phase_table.h"
#include "sim/sky_table_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
// Lanes come in eights.
using D = hn::CappedTag<float, 8>;

void EmissionModes(const EmissionInput& in, float* modes) {
  const D d;
  const std::size_t L = in.lanes, rows = static_cast<std::size_t>(std::max(2, in.degree)) + 1;
  const float c = in.cos_theta, s = in.sin_theta;
  std::fill(modes, modes + in.nodes * rows * L, 0.0F);
  for (std::size_t j = 0; j < in.nodes; ++j) {
    for (std::size_t w = 0; w < L; w += hn::Lanes(d)) {
      float* out = modes + j * rows * L + w;
      const float* C = in.coherency + j * 4 * L + w;
      const auto weight = hn::LoadU(d, in.air_weight + w);
      const auto xx = hn::LoadU(d, C), yy = hn::LoadU(d, C + L), zz = hn::LoadU(d, C + 2 * L);
      const auto half = hn::Set(d, 0.5F);
      const auto mean = hn::Mul(half, hn::Add(xx, yy)), diff = hn::Mul(half, hn::Sub(xx, yy));
      const auto m0 = hn::MulAdd(hn::Set(d, c * c + 1), mean, hn::Mul(hn::Set(d, s * s), zz));
      const auto m1 = hn::Mul(hn::Set(d, -2 * s * c), hn::LoadU(d, C + 3 * L));
      const auto m2 = hn::Mul(hn::Set(d, -s * s), diff);
      hn::StoreU(hn::Mul(weight, m0), d, out);
      hn::StoreU(hn::Mul(weight, m1), d, out + L);
      hn::StoreU(hn::Mul(weight, m2), d, out + 2 * L);
      if (in.moments == nullptr) continue;
      const float* I = in.moments + j * in.moments_per_node * L + w;
      const float* E = I + in.e_offset * L;
      std::size_t k = 0;
      for (std::size_t l = 0; l <= static_cast<std::size_t>(in.degree); ++l) {
        const auto a1 = hn::LoadU(d, in.a1 + l * L + w), b1 = hn::LoadU(d, in.b1 + l * L + w);
        const bool vector = in.e_offset > 0 && l >= 2;
        for (std::size_t m = 0; m <= l; ++m, ++k) {
          auto light = hn::Mul(a1, hn::LoadU(d, I + k * L));
          if (vector) light = hn::MulAdd(b1, hn::LoadU(d, E + k * L), light);
          hn::StoreU(hn::MulAdd(hn::Set(d, in.p[k]), light, hn::LoadU(d, out + m * L)), d,
                     out + m * L);
        }
      }
    }
  }
}

void AddEmission(const EmissionTaps* taps, std::size_t azimuths, std::size_t modes, std::size_t L,
                 const float* shift, float* light) {
  const D d;
  for (std::size_t a = 0; a < azimuths; ++a) {
    const EmissionTaps& t = taps[a];
    for (std::size_t w = 0; w < L; w += hn::Lanes(d)) {
      auto sum = hn::Zero(d);
      for (std::size_t q = 0; q < 4; ++q) {
        const float* row = t.modes + q * modes * L + w;
        auto even = hn::Zero(d), odd = hn::Zero(d);
        std::size_t m = 0;
        for (; m + 1 < modes; m += 2) {
          even = hn::MulAdd(hn::Set(d, t.cosines[m]), hn::LoadU(d, row + m * L), even);
          odd = hn::MulAdd(hn::Set(d, t.cosines[m + 1]), hn::LoadU(d, row + (m + 1) * L), odd);
        }
        if (m < modes) {
          even = hn::MulAdd(hn::Set(d, t.cosines[m]), hn::LoadU(d, row + m * L), even);
        }
        sum = hn::MulAdd(hn::Set(d, t.weight[q]), hn::Add(even, odd), sum);
      }
      const auto low = hn::LoadU(d, t.reference + w), high = hn::LoadU(d, t.reference + L + w);
      const auto share =
          hn::MulAdd(hn::Set(d, t.share_per_rad), hn::LoadU(d, shift + w), hn::Set(d, t.share));
      const auto steep = hn::MulAdd(share, hn::Sub(high, low), low);
      float* out = light + a * L + w;
      hn::StoreU(hn::MulAdd(steep, sum, hn::LoadU(d, out)), d, out);
    }
  }
}

void AddBeam(const BeamPath& in, float* light, float* place) {
  const D d;
  const std::size_t L = in.lanes, S = in.scatterers;
  const auto night = hn::Set(d, SunlitAir::kNight), least = hn::Set(d, -85.0F);
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0F);
  const auto bright = [&](auto x) HWY_ATTR {
    return hn::IfThenElse(hn::Gt(x, night), hn::Exp(d, hn::Max(x, least)), zero);
  };
  for (std::size_t k = 0; k < in.windows; ++k) {
    const BeamTaps& t = in.taps[k];
    for (std::size_t w = 0; w < L; w += hn::Lanes(d)) {
      const auto move =
          hn::Mul(hn::Set(d, t.share_per_rad), hn::LoadU(d, in.angle_shift + k * L + w));
      const auto f = hn::Add(hn::Set(d, t.above), hn::LoadU(d, in.above_shift + k * L + w));
      auto a = zero, b = zero, c = zero, e = zero, g0 = zero, g1 = zero;
      // Lanes whose own place has moved past a point take the next pair of points.
      const auto row = [&](std::size_t r, auto& from, auto& to, auto& g) HWY_ATTR {
        g = hn::Add(hn::Set(d, t.sun.share[r]), move);
        const auto p1 = hn::LoadU(d, t.sun.logarithm[r][1] + w);
        const auto p2 = hn::LoadU(d, t.sun.logarithm[r][2] + w);
        const auto below = hn::Lt(g, zero), beyond = hn::Gt(g, one);
        from = hn::IfThenElse(below, hn::LoadU(d, t.sun.logarithm[r][0] + w),
                              hn::IfThenElse(beyond, p2, p1));
        to = hn::IfThenElse(below, p1,
                            hn::IfThenElse(beyond, hn::LoadU(d, t.sun.logarithm[r][3] + w), p2));
        g = hn::IfThenElse(below, hn::Add(g, one), hn::IfThenElse(beyond, hn::Sub(g, one), g));
      };
      row(0, a, b, g0);
      row(1, c, e, g1);
      const auto dark = hn::Le(hn::Min(hn::Min(a, b), hn::Min(c, e)), night);
      const auto low = hn::MulAdd(g0, hn::Sub(b, a), a), high = hn::MulAdd(g1, hn::Sub(e, c), c);
      auto beam = hn::Exp(d, hn::Max(hn::MulAdd(f, hn::Sub(high, low), low), least));
      if (!hn::AllFalse(d, dark)) {
        // Linear across the edge of the shadow.
        const auto A = bright(a), B = bright(b), C = bright(c), E = bright(e);
        const auto lower = hn::MulAdd(g0, hn::Sub(B, A), A);
        const auto upper = hn::MulAdd(g1, hn::Sub(E, C), C);
        const auto linear = hn::MulAdd(f, hn::Sub(upper, lower), lower);
        beam = hn::IfThenElse(dark, hn::Max(linear, zero), beam);
      }
      const auto known = hn::Add(beam, hn::Set(d, kNightBeam));
      const auto along = hn::Mul(hn::Set(d, t.along), known);
      const auto below = hn::Mul(hn::Set(d, t.below), known);
      for (std::size_t s = 0; s < S; ++s) {
        const auto scatter = hn::LoadU(d, in.scatter + (k * S + s) * L + w);
        const auto grow = [&](float* sum, auto value) HWY_ATTR {
          hn::StoreU(hn::MulAdd(scatter, value, hn::LoadU(d, sum)), d, sum);
        };
        grow(light + s * L + w, beam);
        grow(place + s * L + w, along);
        grow(place + (S + s) * L + w, below);
      }
    }
  }
}

void SkyRadiance(const SkyPoint& in, float* radiance) {
  const D d;
  const hn::RebindToSigned<D> di;
  const std::size_t L = in.lanes, S = in.scatterers;
  const auto one = hn::Set(d, 1.0F), zero = hn::Zero(d);
  for (std::size_t w = 0; w < L; w += hn::Lanes(d)) {
    const auto interpolate = [&](std::size_t quantity) HWY_ATTR {
      const std::size_t at = quantity * L + w;
      auto even = zero, odd = zero;
      for (std::size_t n = 0; n < in.nodes; n += 2) {
        even = hn::MulAdd(hn::Set(d, in.weight[n]), hn::LoadU(d, in.node[n] + at), even);
        odd = hn::MulAdd(hn::Set(d, in.weight[n + 1]), hn::LoadU(d, in.node[n + 1] + at), odd);
      }
      return hn::Add(even, odd);
    };
    auto sum = hn::Exp(d, interpolate(0));
    for (std::size_t s = 0; s < S; ++s) {
      const auto light = hn::Exp(d, interpolate(1 + s));
      const auto c = hn::Add(hn::Set(d, in.along), interpolate(1 + S + s));
      if (s == 0) {
        const auto share = hn::LoadU(d, in.anisotropic_share + w);
        const auto rayleigh = hn::MulAdd(hn::Mul(share, hn::Set(d, 0.75F)), hn::MulAdd(c, c, one),
                                         hn::Sub(one, share));
        sum = hn::MulAdd(light, rayleigh, sum);
        continue;
      }
      // sin^2 of half the scattering angle, exact in the forward peak.
      const auto t = hn::Add(hn::Set(d, in.below), interpolate(1 + 2 * S + s));
      const auto back = hn::Sub(one, c);
      const auto side = hn::MulAdd(t, t, hn::Set(d, in.across * in.across));
      const auto square = hn::Mul(hn::Set(d, 0.25F), hn::MulAdd(back, back, side));
      const auto angle = hn::Asin(d, hn::Min(hn::Sqrt(square), one));  // half of it
      constexpr float kLast = static_cast<float>(PhaseTable::kNodes - 1);
      const auto place =
          hn::Min(hn::Mul(hn::Sqrt(hn::Mul(angle, hn::Set(d, 0.636619772F))), hn::Set(d, kLast)),
                  hn::Set(d, kLast - 0.001F));
      const auto node = hn::ConvertTo(di, place);
      const auto f = hn::Sub(place, hn::ConvertTo(d, node));
      const float* table = in.phase + (s - 1) * PhaseTable::kNodes * 2 * L + w;
      const auto at = hn::Add(hn::Mul(node, hn::Set(di, static_cast<int>(2 * L))), hn::Iota(di, 0));
      const auto p0 = hn::GatherIndex(d, table, at);
      const auto p1 = hn::GatherIndex(d, table + 2 * L, at);
      sum = hn::MulAdd(light, hn::MulAdd(f, hn::Sub(p1, p0), p0), sum);
    }
    hn::StoreU(sum, d, radiance + w);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <cmath>
#include <numbers>

namespace twilight {

HWY_EXPORT(EmissionModes);
HWY_EXPORT(AddEmission);
HWY_EXPORT(AddBeam);
HWY_EXPORT(SkyRadiance);

void emission_modes(const EmissionInput& in, float* modes) {
  HWY_DYNAMIC_DISPATCH(EmissionModes)(in, modes);
}

void add_emission(const EmissionTaps* taps, std::size_t azimuths, std::size_t modes,
                  std::size_t lanes, const float* angle_shift_rad, float* light) {
  HWY_DYNAMIC_DISPATCH(AddEmission)(taps, azimuths, modes, lanes, angle_shift_rad, light);
}

void add_beam(const BeamPath& in, float* light, float* place) {
  HWY_DYNAMIC_DISPATCH(AddBeam)(in, light, place);
}

void sky_radiance(const SkyPoint& in, float* radiance) {
  HWY_DYNAMIC_DISPATCH(SkyRadiance)(in, radiance);
}

namespace {
double wide(float x) { return static_cast<double>(x); }
}  // namespace

void emission_modes_scalar(const EmissionInput& in, float* modes) {
  const std::size_t L = in.lanes, rows = static_cast<std::size_t>(std::max(2, in.degree)) + 1;
  const double c = wide(in.cos_theta), s = wide(in.sin_theta);
  for (std::size_t j = 0; j < in.nodes; ++j) {
    for (std::size_t w = 0; w < L; ++w) {
      const auto C = [&](std::size_t k) {
        return wide(in.air_weight[w]) * wide(in.coherency[(j * 4 + k) * L + w]);
      };
      std::vector<double> sum(rows, 0.0);
      sum[0] = (c * c + 1) * (C(0) + C(1)) / 2 + s * s * C(2);
      sum[1] = -2 * s * c * C(3);
      sum[2] = -s * s * (C(0) - C(1)) / 2;
      const auto moment = [&](std::size_t k) {
        return wide(in.moments[(j * in.moments_per_node + k) * L + w]);
      };
      for (int l = 0; in.moments != nullptr && l <= in.degree; ++l) {
        const auto at = static_cast<std::size_t>(l);
        for (std::size_t m = 0; m <= at; ++m) {
          const std::size_t k = at * (at + 1) / 2 + m;
          double light = wide(in.a1[at * L + w]) * moment(k);
          if (in.e_offset > 0 && l >= 2) light += wide(in.b1[at * L + w]) * moment(in.e_offset + k);
          sum[m] += wide(in.p[k]) * light;
        }
      }
      for (std::size_t m = 0; m < rows; ++m) {
        modes[(j * rows + m) * L + w] = static_cast<float>(sum[m]);
      }
    }
  }
}

void add_emission_scalar(const EmissionTaps* taps, std::size_t azimuths, std::size_t modes,
                         std::size_t lanes, const float* angle_shift_rad, float* light) {
  for (std::size_t a = 0; a < azimuths; ++a) {
    const EmissionTaps& t = taps[a];
    for (std::size_t w = 0; w < lanes; ++w) {
      double sum = 0;
      for (std::size_t q = 0; q < 4; ++q) {
        for (std::size_t m = 0; m < modes; ++m) {
          sum +=
              wide(t.weight[q]) * wide(t.cosines[m]) * wide(t.modes[(q * modes + m) * lanes + w]);
        }
      }
      const double share = wide(t.share) + wide(t.share_per_rad) * wide(angle_shift_rad[w]);
      const double steep = std::lerp(wide(t.reference[w]), wide(t.reference[lanes + w]), share);
      light[a * lanes + w] += static_cast<float>(steep * sum);
    }
  }
}

void add_beam_scalar(const BeamPath& in, float* light, float* place) {
  const std::size_t L = in.lanes, S = in.scatterers;
  for (std::size_t k = 0; k < in.windows; ++k) {
    const BeamTaps& t = in.taps[k];
    for (std::size_t w = 0; w < L; ++w) {
      const double move = wide(t.share_per_rad) * wide(in.angle_shift[k * L + w]);
      const double f = wide(t.above) + wide(in.above_shift[k * L + w]);
      float pair[2][2];
      double g[2], row[2];
      for (std::size_t r = 0; r < 2; ++r) {
        g[r] = wide(t.sun.share[r]) + move;
        const std::size_t first = g[r] < 0 ? 0 : g[r] > 1 ? 2 : 1;
        g[r] += 1 - static_cast<double>(first);
        for (std::size_t q = 0; q < 2; ++q) pair[r][q] = t.sun.logarithm[r][first + q][w];
      }
      const bool dark =
          std::min({pair[0][0], pair[0][1], pair[1][0], pair[1][1]}) <= SunlitAir::kNight;
      for (std::size_t r = 0; r < 2; ++r) {
        const auto value = [&](float x) {
          return !dark ? wide(x) : x > SunlitAir::kNight ? std::exp(wide(x)) : 0.0;
        };
        row[r] = value(pair[r][0]) + g[r] * (value(pair[r][1]) - value(pair[r][0]));
      }
      const double mixed = row[0] + f * (row[1] - row[0]);
      const double beam = dark ? std::max(mixed, 0.0) : std::exp(std::max(mixed, -85.0));
      for (std::size_t s = 0; s < S; ++s) {
        const double scatter = wide(in.scatter[(k * S + s) * L + w]);
        light[s * L + w] += static_cast<float>(scatter * beam);
        const double known = scatter * (beam + wide(kNightBeam));
        place[s * L + w] += static_cast<float>(known * wide(t.along));
        place[(S + s) * L + w] += static_cast<float>(known * wide(t.below));
      }
    }
  }
}

void sky_radiance_scalar(const SkyPoint& in, float* radiance) {
  const std::size_t L = in.lanes, S = in.scatterers;
  for (std::size_t w = 0; w < L; ++w) {
    const auto interpolate = [&](std::size_t quantity) {
      double sum = 0;
      for (std::size_t n = 0; n < in.nodes; ++n) {
        sum += wide(in.weight[n]) * wide(in.node[n][quantity * L + w]);
      }
      return sum;
    };
    double sum = std::exp(interpolate(0));
    for (std::size_t s = 0; s < S; ++s) {
      const double light = std::exp(interpolate(1 + s));
      const double c = wide(in.along) + interpolate(1 + S + s);
      const double t = wide(in.below) + interpolate(1 + 2 * S + s);
      if (s == 0) {
        const double share = wide(in.anisotropic_share[w]);
        sum += light * (share * 0.75 * (1 + c * c) + 1 - share);
        continue;
      }
      const double angle = std::atan2(std::hypot(t, wide(in.across)), c);
      const double place =
          std::sqrt(angle / std::numbers::pi) * static_cast<double>(PhaseTable::kNodes - 1);
      const auto node = std::min(static_cast<std::size_t>(place), PhaseTable::kNodes - 2);
      const float* p = in.phase + ((s - 1) * PhaseTable::kNodes + node) * 2 * L + w;
      sum += light * std::lerp(wide(p[0]), wide(p[2 * L]), place - static_cast<double>(node));
    }
    radiance[w] = static_cast<float>(sum);
  }
}

}  // namespace twilight
#endif  // HWY_ONCE
