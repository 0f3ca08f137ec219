#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/ring_pair_kernel.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include "hwy/contrib/math/math-inl.h"
#include "hwy/highway.h"
#include "sim/ring_pair_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;
using D64 = hn::CappedTag<double, 8>;

// Where a line of sight is cut and what it is worth, [sample], besides its directions in `out`.
// sin_k, sin_half are padded with anything finite; sample k < first and k >= samples are left dark.
// Returns the lowest perigee of an unblocked dipping path (or the lower end's altitude), km.
double SightLines(double earth_radius, const RingPoint& source, const RingPoint& target,
                  const double* HWY_RESTRICT sin_k, const double* HWY_RESTRICT sin_half, int first,
                  bool value, RingPairKernel& out, float* HWY_RESTRICT s_low,
                  float* HWY_RESTRICT s_dip, float* HWY_RESTRICT geometry) {
  const D64 d;
  const hn::Rebind<float, D64> df;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const bool source_low = source.altitude_km <= target.altitude_km;
  const RingPoint& low = source_low ? source : target;
  const RingPoint& high = source_low ? target : source;
  const auto zero = hn::Zero(d), one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
  const double dr = target.rho_km - source.rho_km, dz = target.z_km - source.z_km;
  const auto d2_least = hn::Set(d, dr * dr + dz * dz);
  const auto four_rho = hn::Set(d, 4 * source.rho_km * target.rho_km);
  const double rise = (high.altitude_km - low.altitude_km) *
                      (2 * earth_radius + high.altitude_km + low.altitude_km);
  const double r_low = earth_radius + low.altitude_km;
  const auto rho_s = hn::Set(d, source.rho_km), rho_t = hn::Set(d, target.rho_km);
  const auto dr_v = hn::Set(d, dr), dz_v = hn::Set(d, dz);
  // Of variance_along: the frame of the cell's axes.
  const auto along = [&](const RingPoint& cell, auto r, auto a, auto z) {
    const auto ar = hn::Set(d, cell.axis_r), az = hn::Set(d, cell.axis_z);
    const auto axial = hn::MulAdd(r, ar, hn::Mul(z, az));
    const auto third = hn::NegMulAdd(r, az, hn::Mul(z, ar));
    auto sum = hn::Mul(hn::Set(d, cell.variance_radial_km2), hn::Mul(axial, axial));
    sum = hn::MulAdd(hn::Set(d, cell.variance_azimuthal_km2), hn::Mul(a, a), sum);
    return hn::MulAdd(hn::Set(d, cell.variance_third_km2), hn::Mul(third, third), sum);
  };
  const double variance = source.variance_radial_km2 + source.variance_azimuthal_km2 +
                          source.variance_third_km2 + target.variance_radial_km2 +
                          target.variance_azimuthal_km2 + target.variance_third_km2;
  auto lowest = hn::Set(d, low.altitude_km);
  for (int k = 0; k < out.samples; k += lanes) {
    const auto at = static_cast<std::size_t>(k);
    const auto half = hn::LoadU(d, sin_half + k);
    const auto half2 = hn::Mul(half, half);
    const auto d2 = hn::MulAdd(four_rho, half2, d2_least);
    // Sample numbers tell the samples of the ring from the padding.
    const auto number = hn::Iota(d, static_cast<double>(k));
    auto seen = hn::And(hn::Gt(d2, zero),
                        hn::And(hn::Ge(number, hn::Set(d, static_cast<double>(first))),
                                hn::Lt(number, hn::Set(d, static_cast<double>(out.samples)))));
    const auto distance = hn::Sqrt(hn::Max(d2, hn::Set(d, 1e-300)));
    const auto inverse = hn::Div(one, distance);
    // Signed distance from the perigee to the lower end: below 0 the path dips first.
    const auto s = hn::Mul(hn::Mul(hn::Sub(hn::Set(d, rise), d2), hn::Set(d, 0.5)), inverse);
    const auto s2 = hn::Mul(s, s);
    const auto p2 = hn::Max(hn::Sub(hn::Set(d, r_low * r_low), s2), zero);
    const auto perigee =
        hn::Sub(hn::Set(d, low.altitude_km), hn::Div(s2, hn::Add(hn::Set(d, r_low), hn::Sqrt(p2))));
    const auto dips = hn::Lt(s, zero);
    seen = hn::AndNot(hn::And(dips, hn::Lt(perigee, hn::Set(d, -1e-9))), seen);

    // 1 - cos = 2 sin^2(k/2) keeps near neighbours exact.
    const auto bend = hn::Mul(two, half2);
    const auto sine = hn::Mul(hn::LoadU(d, sin_k + k), inverse);
    const auto wr = hn::Mul(hn::NegMulAdd(rho_t, bend, dr_v), inverse);
    const auto tr = hn::Mul(hn::MulAdd(rho_s, bend, dr_v), inverse);
    const auto wa = hn::Mul(rho_t, sine), ta = hn::Mul(rho_s, sine);
    const auto wz = hn::Mul(dz_v, inverse);
    auto leaving = one, arriving = one;
    if (source.ground) {
      leaving = hn::Mul(hn::Set(d, 4.0), hn::MulAdd(wr, hn::Set(d, source.normal_r),
                                                    hn::Mul(wz, hn::Set(d, source.normal_z))));
      seen = hn::And(seen, hn::Gt(leaving, zero));
    }
    if (target.ground) {
      arriving = hn::Neg(
          hn::MulAdd(tr, hn::Set(d, target.normal_r), hn::Mul(wz, hn::Set(d, target.normal_z))));
      seen = hn::And(seen, hn::Gt(arriving, zero));
    }
    const auto put = [&](std::vector<float>& to, auto v) {
      hn::StoreU(hn::DemoteTo(df, hn::IfThenElseZero(seen, v)), df, to.data() + at);
    };
    put(out.dir_r, wr);
    put(out.dir_a, wa);
    put(out.dir_z, wz);
    put(out.into_r, tr);
    put(out.into_a, ta);
    put(out.leaving, leaving);
    put(out.arriving, arriving);
    if (!value) continue;
    const auto dipping = hn::And(dips, seen);
    lowest = hn::IfThenElse(dipping, hn::Min(lowest, perigee), lowest);
    const auto length = hn::IfThenElseZero(seen, hn::Abs(s));
    hn::StoreU(hn::DemoteTo(df, length), df, s_low + k);
    hn::StoreU(hn::DemoteTo(df, hn::IfThenElseZero(dipping, length)), df, s_dip + k);
    auto near = d2;
    if (variance > 0) {
      // near_field_factor times d^2
      const auto p_along = hn::Add(along(source, wr, wa, wz), along(target, tr, ta, wz));
      const auto across = hn::Div(hn::Max(hn::Sub(hn::Set(d, variance), p_along), zero), d2);
      const auto wide = hn::Div(across, hn::MulAdd(hn::Set(d, 0.5), hn::Sqrt(across), one));
      const auto deep = hn::Min(hn::Div(hn::Mul(hn::Set(d, 3.0), p_along), d2), hn::Set(d, 0.6));
      near = hn::Mul(d2, hn::Sub(hn::Add(one, wide), deep));
    }
    constexpr double kFourPi = 12.566370614359172954;
    const auto area =
        hn::Mul(hn::Set(d, kFourPi), hn::Add(near, hn::Set(d, source.blur_km2 + target.blur_km2)));
    hn::StoreU(hn::DemoteTo(df, hn::IfThenElseZero(seen, hn::Div(one, area))), df, geometry + k);
  }
  return hn::GetLane(hn::MinOfLanes(d, lowest));
}

// Distances along the line of sight, from its lower end (or perigee), at which it
// crosses a shell boundary: s(h) = sqrt(s_a^2 + n), t = n / (s + s_a); dips count twice.
void Crossings(const float* HWY_RESTRICT s_low, const float* HWY_RESTRICT s_dip, int n_samples,
               const BoundaryCrossing* crossings, int n_crossings, std::size_t stride,
               float* HWY_RESTRICT t) {
  const D d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto zero = hn::Zero(d), least = hn::Set(d, 1e-20F), two = hn::Set(d, 2.0F);
  for (int b = 0; b < n_crossings; ++b) {
    const auto n = hn::Set(d, crossings[b].n);
    float* HWY_RESTRICT out = t + static_cast<std::size_t>(b) * stride;
    if (crossings[b].dip) {
      for (int k = 0; k < n_samples; k += lanes) {
        const auto s_a = hn::Load(d, s_dip + k);
        const auto q = hn::MulAdd(s_a, s_a, n);
        hn::StoreU(hn::Mul(hn::Sqrt(hn::Max(q, zero)), two), d, out + k);
      }
    } else {
      for (int k = 0; k < n_samples; k += lanes) {
        const auto s_a = hn::Load(d, s_low + k);
        const auto q = hn::MulAdd(s_a, s_a, n);
        const auto s = hn::Sqrt(hn::Max(q, zero));
        hn::StoreU(hn::Div(n, hn::Max(hn::Add(s, s_a), least)), d, out + k);
      }
    }
  }
}

// value[k][lane] = geometry[k] * exp(-max(0, sum_b coefficient[b][lane] * t[b][k] - shift[lane]))
template <class Tag>
void Transmit(Tag d, const float* HWY_RESTRICT t, std::size_t stride,
              const BoundaryCrossing* crossings, int n_terms, const float* HWY_RESTRICT geometry,
              const float* HWY_RESTRICT shift, int n_samples, std::size_t lanes,
              float* HWY_RESTRICT value) {
  const std::size_t step = hn::Lanes(d);
  const auto most = hn::Set(d, 80.0F);
  for (std::size_t w = 0; w < lanes; w += step) {
    const auto x = hn::Neg(hn::LoadU(d, shift + w));
    // Four samples share the coefficients; the arrays are padded to whole fours with geometry 0.
    for (std::size_t k = 0; k < static_cast<std::size_t>(n_samples); k += 4) {
      auto depth0 = x, depth1 = x, depth2 = x, depth3 = x;
      for (int b = 0; b < n_terms; ++b) {
        const auto c = hn::LoadU(d, crossings[b].coefficient + w);
        const float* HWY_RESTRICT at = t + static_cast<std::size_t>(b) * stride + k;
        depth0 = hn::MulAdd(c, hn::Set(d, at[0]), depth0);
        depth1 = hn::MulAdd(c, hn::Set(d, at[1]), depth1);
        depth2 = hn::MulAdd(c, hn::Set(d, at[2]), depth2);
        depth3 = hn::MulAdd(c, hn::Set(d, at[3]), depth3);
      }
      const auto put = [&](std::size_t sample, auto depth) HWY_ATTR {
        depth = hn::Min(hn::Max(depth, hn::Zero(d)), most);
        hn::StoreU(hn::Mul(hn::Exp(d, hn::Neg(depth)), hn::Set(d, geometry[sample])), d,
                   value + sample * lanes + w);
      };
      put(k, depth0);
      put(k + 1, depth1);
      put(k + 2, depth2);
      put(k + 3, depth3);
    }
  }
}

void TransmitAny(const float* s_low, const float* s_dip, const BoundaryCrossing* crossings,
                 int n_crossings, std::size_t stride, const float* geometry, const float* shift,
                 RingPairKernel& out) {
  float* t = out.crossing.data();
  Crossings(s_low, s_dip, static_cast<int>(stride), crossings, n_crossings, stride, t);
  if (out.lanes == 8) {
    Transmit(hn::CappedTag<float, 8>(), t, stride, crossings, n_crossings, geometry, shift,
             out.samples, out.lanes, out.own_value.data());
  } else {
    Transmit(D(), t, stride, crossings, n_crossings, geometry, shift, out.samples, out.lanes,
             out.own_value.data());
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <stdexcept>

namespace twilight {

HWY_EXPORT(SightLines);
HWY_EXPORT(TransmitAny);

namespace {

constexpr int kSampleLanes = 16;
constexpr std::size_t kMostLanes = 512;
constexpr std::size_t kMostCrossings = 1100;  // of a path: 500 layers, up and down
constexpr std::size_t kMostSamples = RingPairKernel::kMostSamples;

std::size_t padded_samples(int samples) {
  return static_cast<std::size_t>((samples + kSampleLanes - 1) / kSampleLanes * kSampleLanes);
}

}  // namespace

void RingPairKernel::resize(int azimuth_divisions, std::size_t n_lanes, int layers) {
  if (azimuth_divisions > kMostDivisions || n_lanes > kMostLanes ||
      2 * static_cast<std::size_t>(layers) + 8 > kMostCrossings) {
    throw std::invalid_argument(
        "RingPairKernel: at most 360 azimuth divisions, 512 wavelengths and "
        "546 layers");
  }
  samples = azimuth_divisions / 2 + 1;
  lanes = n_lanes;
  const std::size_t padded = padded_samples(samples);
  own_value.assign(padded * lanes, 0.0F);
  value = own_value.data();
  emit.assign(padded * kMoments, 0.0F);
  receive.assign(padded * kMoments, 0.0F);
  for (auto* v : {&dir_r, &dir_a, &dir_z, &into_r, &into_a, &leaving, &arriving}) {
    v->assign(padded, 0.0F);
  }
  // Up to one crossing per boundary on the way up and one on the dip, plus both ends.
  crossing.assign(padded * static_cast<std::size_t>(2 * layers + 8), 0.0F);
}

void RingPairKernel::weigh(bool source_ground, bool target_ground, bool moments) {
  for (int k = 0; k < samples; ++k) {
    const auto i = static_cast<std::size_t>(k);
    float* a = &emit[i * kMoments];
    float* b = &receive[i * kMoments];
    const bool seen = leaving[i] > 0;
    const float w = seen ? weight(k) : 0.0F;
    a[kJ] = leaving[i];
    b[kJ] = w * arriving[i];
    if (!moments) continue;
    const float wr = dir_r[i], wa = dir_a[i], wz = dir_z[i], tr = into_r[i], ta = into_a[i];
    if (source_ground) {
      std::fill(a + 1, a + kMoments, 0.0F);
    } else {
      a[kFr] = wr;
      a[kFz] = wz;
      a[kFa] = wa;
      a[kSrr] = wr * wr - wa * wa;
      a[kSzz] = wz * wz - wa * wa;
      a[kSrz] = 2 * wr * wz;
      a[kSra] = 2 * wr * wa;
      a[kSaz] = 2 * wa * wz;
    }
    if (target_ground) {
      std::fill(b + 1, b + kMoments, 0.0F);
    } else {
      b[kFr] = w * tr;
      b[kFz] = w * wz;
      b[kFa] = w * ta;
      b[kSrr] = w * (tr * tr - 1.0F / 3);
      b[kSzz] = w * (wz * wz - 1.0F / 3);
      b[kSrz] = w * tr * wz;
      b[kSra] = w * tr * ta;
      b[kSaz] = w * ta * wz;
    }
  }
}

void RingPairKernel::turn_round(const RingPoint& source, const RingPoint& target, bool moments) {
  std::swap(dir_r, into_r);
  std::swap(dir_a, into_a);
  std::swap(leaving, arriving);
  const float leave = target.ground ? 4.0F : 1.0F, arrive = source.ground ? 0.25F : 1.0F;
  for (std::size_t i = 0; i < static_cast<std::size_t>(samples); ++i) {
    dir_r[i] = -dir_r[i];
    into_r[i] = -into_r[i];
    dir_z[i] = -dir_z[i];
    leaving[i] *= leave;
    arriving[i] *= arrive;
  }
  weigh(target.ground, source.ground, moments);
}

void ring_pair_kernel(const ExchangeMedium& medium, const RingPoint& source,
                      const RingPoint& target, const AzimuthModes& azimuth,
                      const AzimuthSampling& sampling, bool same_ring, bool moments,
                      RingPairKernel& out, const float* known_value) {
  const double R = medium.earth_radius_km;
  const int n = azimuth.divisions / 2 / sampling.every + 1;
  out.samples = n;
  out.every = sampling.every;
  out.modes = sampling.modes;
  const std::size_t stride = padded_samples(n);
  const std::size_t lanes = medium.lanes;
  const RingPoint& low = source.altitude_km <= target.altitude_km ? source : target;
  const RingPoint& high = source.altitude_km <= target.altitude_km ? target : source;

  alignas(64) double sin_k[kMostSamples];
  alignas(64) double sin_half[kMostSamples];
  for (std::size_t k = 0; k < stride; ++k) {
    const std::size_t division = k * static_cast<std::size_t>(sampling.every);
    const bool inside = k < static_cast<std::size_t>(n);
    sin_k[k] = inside ? azimuth.sin_step[division] : 0.0;
    sin_half[k] = inside ? azimuth.sin_half_step[division] : 0.0;
  }
  alignas(64) float s_low[kMostSamples];
  alignas(64) float s_dip[kMostSamples];
  alignas(64) float geometry[kMostSamples];
  std::fill_n(s_low, stride, 0.0F);
  std::fill_n(s_dip, stride, 0.0F);
  std::fill_n(geometry, stride, 0.0F);
  const double lowest =
      HWY_DYNAMIC_DISPATCH(SightLines)(R, source, target, sin_k, sin_half, same_ring ? 1 : 0,
                                       known_value == nullptr, out, s_low, s_dip, geometry);
  out.weigh(source.ground, target.ground, moments);
  const auto in_sight = [](float leaving) { return leaving > 0; };
  out.dark = std::none_of(out.leaving.begin(), out.leaving.begin() + n, in_sight);
  out.value = known_value;
  if (known_value != nullptr) return;
  out.value = out.own_value.data();
  if (out.dark) {
    std::fill(out.own_value.begin(), out.own_value.end(), 0.0F);
    return;
  }

  // Abel summation: the depth from the lower end is ext_high t_end + sum over boundaries
  // of (ext below - ext above) t_boundary, and likewise twice over for the dip to the perigee.
  BoundaryCrossing crossings[kMostCrossings];
  int count = 0;
  const auto cross = [&](double h, bool dip, const float* coefficient) {
    crossings[count++] = {static_cast<float>((h - low.altitude_km) * (2 * R + h + low.altitude_km)),
                          dip, coefficient};
  };
  cross(high.altitude_km, false, &medium.extinction[static_cast<std::size_t>(high.layer) * lanes]);
  for (int b = low.layer + 1; b <= high.layer; ++b) {
    cross(medium.boundary_km[static_cast<std::size_t>(b)], false,
          &medium.step[static_cast<std::size_t>(b) * lanes]);
  }
  if (lowest < low.altitude_km) {
    // The dip counts twice: down to the perigee and up again.
    cross(low.altitude_km, true, &medium.extinction[static_cast<std::size_t>(low.layer) * lanes]);
    for (int b = low.layer; b >= 1; --b) {
      const double h = medium.boundary_km[static_cast<std::size_t>(b)];
      if (h <= lowest) break;
      cross(h, true, &medium.step[static_cast<std::size_t>(b) * lanes]);
    }
  }
  alignas(64) float shift[kMostLanes];
  for (std::size_t w = 0; w < lanes; ++w) {
    shift[w] = (source.half_depth != nullptr ? source.half_depth[w] : 0.0F) +
               (target.half_depth != nullptr ? target.half_depth[w] : 0.0F);
  }
  HWY_DYNAMIC_DISPATCH(TransmitAny)
  (s_low, s_dip, crossings, count, stride, geometry, shift, out);
  constexpr float kDark = 1e-13F;
  bool passes = false;
  for (int k = 0; k < n && !passes; ++k) {
    const float* v = &out.value[static_cast<std::size_t>(k) * lanes];
    for (std::size_t w = 0; w < medium.wavelengths; ++w) passes |= v[w] > kDark * geometry[k];
  }
  out.dark = !passes;
}

}  // namespace twilight
#endif  // HWY_ONCE
