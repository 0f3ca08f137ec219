#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/exchange_kernel.cpp"
#include "hwy/foreach_target.h"
// After foreach_target.h, once per SIMD target:
#include "hwy/contrib/math/math-inl.h"
#include "hwy/highway.h"
#include "sim/exchange_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace twilight {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<float, 16>;

// Distances along the line of sight, from its lower end (or perigee), at which it
// crosses a shell boundary: s(h) = sqrt(s_a^2 + n), t = n / (s + s_a).
void Crossings(const float* HWY_RESTRICT sa, int n_samples, float n, bool dip,
               float* HWY_RESTRICT t) {
  const D d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto zero = hn::Zero(d);
  for (int k = 0; k < n_samples; k += lanes) {
    const auto s_a = hn::Load(d, sa + k);
    const auto q = hn::MulAdd(s_a, s_a, hn::Set(d, n));
    const auto s = hn::Sqrt(hn::Max(q, zero));
    if (dip) {
      hn::StoreU(s, d, t + k);
    } else {
      const auto sum = hn::Max(hn::Add(s, s_a), hn::Set(d, 1e-20F));
      hn::StoreU(hn::Div(hn::Set(d, n), sum), d, t + k);
    }
  }
}

// value[k][lane] = geometry[k] * exp(-max(0, sum_b coefficient[b][lane] * t[b][k] - shift[lane]))
void Transmit(const float* HWY_RESTRICT t, std::size_t stride, int n_terms,
              const float* const* coefficients, const float* HWY_RESTRICT geometry,
              const float* HWY_RESTRICT shift, int n_samples, std::size_t lanes,
              float* HWY_RESTRICT value) {
  const hn::CappedTag<float, 8> d8;
  const D d16;
  const auto run = [&](auto d) {
    const std::size_t step = hn::Lanes(d);
    for (std::size_t w = 0; w < lanes; w += step) {
      const auto x = hn::LoadU(d, shift + w);
      for (int k = 0; k < n_samples; ++k) {
        if (geometry[k] == 0.0F) {
          hn::StoreU(hn::Zero(d), d, value + static_cast<std::size_t>(k) * lanes + w);
          continue;
        }
        auto depth = hn::Zero(d);
        auto depth2 = hn::Zero(d);
        int b = 0;
        for (; b + 1 < n_terms; b += 2) {
          depth = hn::MulAdd(
              hn::LoadU(d, coefficients[b] + w),
              hn::Set(d, t[static_cast<std::size_t>(b) * stride + static_cast<std::size_t>(k)]),
              depth);
          depth2 = hn::MulAdd(
              hn::LoadU(d, coefficients[b + 1] + w),
              hn::Set(d, t[static_cast<std::size_t>(b + 1) * stride + static_cast<std::size_t>(k)]),
              depth2);
        }
        if (b < n_terms) {
          depth = hn::MulAdd(
              hn::LoadU(d, coefficients[b] + w),
              hn::Set(d, t[static_cast<std::size_t>(b) * stride + static_cast<std::size_t>(k)]),
              depth);
        }
        depth = hn::Max(hn::Sub(hn::Add(depth, depth2), x), hn::Zero(d));
        depth = hn::Min(depth, hn::Set(d, 80.0F));
        const auto e = hn::Exp(d, hn::Neg(depth));
        hn::StoreU(hn::Mul(e, hn::Set(d, geometry[k])), d,
                   value + static_cast<std::size_t>(k) * lanes + w);
      }
    }
  };
  if (lanes == 8) {
    run(d8);
  } else {
    run(d16);
  }
}

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

template <class Tag>
void FirstEvent(Tag d, const float* HWY_RESTRICT value, const float* HWY_RESTRICT receive_j,
                const double* dir_r, const double* dir_a, const double* dir_z, int n_samples,
                int every, std::size_t lanes, int S, const float* cos_az, const float* sin_az,
                const float* HWY_RESTRICT power, const unsigned char* lit,
                const float* HWY_RESTRICT g, float cos_e, float sin_e, float* HWY_RESTRICT field) {
  const std::size_t step = hn::Lanes(d);
  const int half = S / 2;
  for (std::size_t w = 0; w < lanes; w += step) {
    const auto gv = hn::LoadU(d, g + w);
    // 1 + g^2 - 2 g cos = (1 - g)^2 + 2 g (1 - cos): never 0 in the forward peak.
    const auto one_less = hn::Sub(hn::Set(d, 1.0F), gv);
    const auto back = hn::Mul(one_less, one_less);
    const auto one_minus = hn::NegMulAdd(gv, gv, hn::Set(d, 1.0F));
    const auto two_g = hn::Add(gv, gv);
    const auto three_half = hn::Set(d, 1.5F), minus_half = hn::Set(d, -0.5F);
    for (int k = 0; k < n_samples; ++k) {
      const auto kernel =
          hn::Mul(hn::Mul(hn::LoadU(d, value + static_cast<std::size_t>(k) * lanes + w), one_minus),
                  hn::Set(d, receive_j[k]));
      if (receive_j[k] == 0.0F || hn::AllTrue(d, hn::Eq(kernel, hn::Zero(d)))) continue;
      const bool both = k != 0 && k != n_samples - 1;
      for (int side = 0; side < (both ? 2 : 1); ++side) {
        const int shift = every * (side == 0 ? k : -k);
        const auto along = static_cast<float>(dir_r[k]) * cos_e;
        const auto across = static_cast<float>(side == 0 ? dir_a[k] : -dir_a[k]) * cos_e;
        const auto upward = static_cast<float>(dir_z[k]) * sin_e;
        for (int j = 0; j <= half; ++j) {
          int i = j - shift;
          i = i < 0 ? i + S : (i >= S ? i - S : i);
          const int mirror = i <= half ? i : S - i;
          if (!lit[mirror]) continue;
          // Scattering angle between the sunlight's direction of travel and the exchange's.
          const float cosine = -(along * cos_az[i] - across * sin_az[i] + upward);
          const auto t = hn::MulAdd(two_g, hn::Set(d, 1.0F - cosine), back);
          auto r = hn::ApproximateReciprocalSqrt(t);
          r = hn::Mul(r, hn::MulAdd(hn::Mul(hn::Mul(t, minus_half), r), r, three_half));
          const auto hg = hn::Mul(r, hn::Mul(r, r));
          const auto p =
              hn::Mul(hn::LoadU(d, power + static_cast<std::size_t>(mirror) * lanes + w), kernel);
          float* f = field + static_cast<std::size_t>(j) * lanes + w;
          hn::StoreU(hn::MulAdd(p, hg, hn::LoadU(d, f)), d, f);
        }
      }
    }
  }
}

void FirstEventAny(const float* value, const float* receive_j, const double* dir_r,
                   const double* dir_a, const double* dir_z, int n_samples, int every,
                   std::size_t lanes, int S, const float* cos_az, const float* sin_az,
                   const float* power, const unsigned char* lit, const float* g, float cos_e,
                   float sin_e, float* field) {
  if (lanes == 8) {
    FirstEvent(hn::CappedTag<float, 8>(), value, receive_j, dir_r, dir_a, dir_z, n_samples, every,
               lanes, S, cos_az, sin_az, power, lit, g, cos_e, sin_e, field);
  } else {
    FirstEvent(D(), value, receive_j, dir_r, dir_a, dir_z, n_samples, every, lanes, S, cos_az,
               sin_az, power, lit, g, cos_e, sin_e, field);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace twilight
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace twilight {

HWY_EXPORT(Crossings);
HWY_EXPORT(Transmit);
HWY_EXPORT(MomentPassAny);
HWY_EXPORT(CosineTransformAny);
HWY_EXPORT(MultiplyAdd);
HWY_EXPORT(FirstEventAny);

namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kSampleLanes = 16;
// Bounds of the stack arrays below: samples of a ring (S <= 360 and so S/2 + 1 <= 181, padded;
// all S azimuths in the first event), and crossings of a path (500 layers, up and down).
constexpr std::size_t kMostSamples = 512;
constexpr std::size_t kMostTerms = 1100;

std::size_t padded_samples(int samples) {
  return static_cast<std::size_t>((samples + kSampleLanes - 1) / kSampleLanes * kSampleLanes);
}

// The line of sight between two rings at an azimuth difference.
struct Sight {
  double distance2;  // km^2
  double s_low;      // signed distance from the perigee to the lower end, km: < 0 dips first
  bool blocked;      // by the ground
};

Sight line_of_sight(double earth_radius, const RingPoint& low, const RingPoint& high,
                    double sin_half) {
  const double dr = low.rho_km - high.rho_km, dz = low.z_km - high.z_km;
  const double d2 = dr * dr + dz * dz + 4 * low.rho_km * high.rho_km * sin_half * sin_half;
  Sight s{d2, 0.0, false};
  if (d2 <= 0) return s;
  const double n = (high.altitude_km - low.altitude_km) *
                   (2 * earth_radius + high.altitude_km + low.altitude_km);
  s.s_low = (n - d2) / (2 * std::sqrt(d2));
  if (s.s_low < 0) {
    const double r = earth_radius + low.altitude_km;
    const double p2 = r * r - s.s_low * s.s_low;
    const double perigee = low.altitude_km - s.s_low * s.s_low / (r + std::sqrt(std::max(0.0, p2)));
    s.blocked = perigee < -1e-9;
  }
  return s;
}

// Variance of a cell's positions along the unit vector (r, a, z) of its own frame.
double variance_along(const RingPoint& cell, double r, double a, double z) {
  const double first = r * cell.axis_r + z * cell.axis_z;
  const double third = z * cell.axis_r - r * cell.axis_z;
  return cell.variance_radial_km2 * first * first + cell.variance_azimuthal_km2 * a * a +
         cell.variance_third_km2 * third * third;
}

double variance_sum(const RingPoint& cell) {
  return cell.variance_radial_km2 + cell.variance_azimuthal_km2 + cell.variance_third_km2;
}

// Directions of the line of sight from source to target at azimuth sample k, in both frames.
struct SightDirection {
  double source_r, source_a, z, target_r, target_a;
};

SightDirection sight_direction(const RingPoint& source, const RingPoint& target, double distance,
                               double sin_k, double sin_half) {
  // 1 - cos = 2 sin^2(k/2) keeps near neighbours exact.
  const double dr = target.rho_km - source.rho_km;
  const double bend = 2 * sin_half * sin_half;
  return {(dr - target.rho_km * bend) / distance, target.rho_km * sin_k / distance,
          (target.z_km - source.z_km) / distance, (dr + source.rho_km * bend) / distance,
          source.rho_km * sin_k / distance};
}

double geometry_factor(double d2, const RingPoint& source, const RingPoint& target,
                       const SightDirection& dir) {
  const double along = variance_along(source, dir.source_r, dir.source_a, dir.z) +
                       variance_along(target, dir.target_r, dir.target_a, dir.z);
  const double all = variance_sum(source) + variance_sum(target);
  const double factor = near_field_factor(std::max(0.0, all - along) / d2, along / d2);
  return 1.0 / (4 * kPi * (d2 * factor + source.blur_km2 + target.blur_km2));
}

}  // namespace

double near_field_factor(double across_over_d2, double along_over_d2) {
  return 1 + across_over_d2 / (1 + 0.5 * std::sqrt(across_over_d2)) -
         std::min(3 * along_over_d2, 0.6);
}

ExchangeMedium make_exchange_medium(const Medium& medium, std::size_t lanes,
                                    const LayerTable& extinction_per_km) {
  ExchangeMedium m;
  m.earth_radius_km = medium.earth_radius_km;
  m.layers = static_cast<int>(medium.layers());
  m.lanes = lanes;
  m.boundary_km = medium.boundary_km;
  const std::size_t n = medium.layers(), W = medium.wavelengths();
  m.wavelengths = W;
  m.largest.assign(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t w = 0; w < W; ++w)
      m.largest[i] = std::max(m.largest[i], extinction_per_km(i, w));
  }
  m.extinction.assign(n * lanes, 0.0F);
  m.step.assign((n + 1) * lanes, 0.0F);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t w = 0; w < W; ++w) {
      m.extinction[i * lanes + w] = static_cast<float>(extinction_per_km(i, w));
    }
  }
  for (std::size_t i = 1; i < n; ++i) {
    for (std::size_t w = 0; w < W; ++w) {
      m.step[i * lanes + w] = m.extinction[(i - 1) * lanes + w] - m.extinction[i * lanes + w];
    }
  }
  return m;
}

void RingPairKernel::resize(int azimuth_divisions, std::size_t n_lanes, int layers) {
  if (static_cast<std::size_t>(azimuth_divisions) > kMostSamples || n_lanes > kMostSamples ||
      2 * static_cast<std::size_t>(layers) + 8 > kMostTerms) {
    throw std::invalid_argument(
        "RingPairKernel: at most 512 azimuth divisions, 512 wavelengths and "
        "546 layers");
  }
  samples = azimuth_divisions / 2 + 1;
  lanes = n_lanes;
  const std::size_t padded = padded_samples(samples);
  own_value.assign(padded * lanes, 0.0F);
  value = own_value.data();
  emit.assign(padded * kMoments, 0.0F);
  receive.assign(padded * kMoments, 0.0F);
  dir_r.assign(padded, 0.0);
  dir_a.assign(padded, 0.0);
  dir_z.assign(padded, 0.0);
  // Up to one crossing per boundary on the way up and one on the dip, plus both ends.
  crossing.assign(padded * static_cast<std::size_t>(2 * layers + 8), 0.0F);
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
  const bool source_low = source.altitude_km <= target.altitude_km;
  const RingPoint& low = source_low ? source : target;
  const RingPoint& high = source_low ? target : source;

  alignas(64) float s_low[kMostSamples];
  alignas(64) float s_dip[kMostSamples];
  alignas(64) float geometry[kMostSamples];
  std::fill_n(s_low, stride, 0.0F);
  std::fill_n(s_dip, stride, 0.0F);
  std::fill_n(geometry, stride, 0.0F);
  bool any = false;
  double lowest = low.altitude_km;  // lowest perigee of an unblocked dipping path
  for (int k = 0; k < n; ++k) {
    out.emit[static_cast<std::size_t>(k) * kMoments] = 0.0F;
    out.receive[static_cast<std::size_t>(k) * kMoments] = 0.0F;
    if (k == 0 && same_ring) continue;
    const auto division = static_cast<std::size_t>(k * sampling.every);
    const double half = azimuth.sin_half_step[division];
    const double sin_k = azimuth.sin_step[division];
    const Sight sight = line_of_sight(R, low, high, half);
    if (sight.blocked || sight.distance2 <= 0) continue;
    const double d = std::sqrt(sight.distance2);
    const auto i = static_cast<std::size_t>(k);
    const SightDirection dir = sight_direction(source, target, d, sin_k, half);
    const double wr = dir.source_r, wa = dir.source_a, wz = dir.z;
    const double tr = dir.target_r, ta = dir.target_a;
    out.dir_r[i] = wr;
    out.dir_a[i] = wa;
    out.dir_z[i] = wz;
    double leaving = 1.0, arriving = 1.0;
    if (source.ground) {
      leaving = 4 * (wr * source.normal_r + wz * source.normal_z);
      if (leaving <= 0) continue;
    }
    if (target.ground) {
      arriving = -(tr * target.normal_r + wz * target.normal_z);
      if (arriving <= 0) continue;
    }
    any = true;
    s_low[k] = static_cast<float>(std::abs(sight.s_low));
    if (sight.s_low < 0) {
      s_dip[k] = s_low[k];
      const double r = R + low.altitude_km;
      const double p2 = r * r - sight.s_low * sight.s_low;
      lowest = std::min(
          lowest, low.altitude_km - sight.s_low * sight.s_low / (r + std::sqrt(std::max(0.0, p2))));
    }
    const auto weight = static_cast<double>(out.weight(k));
    geometry[k] = static_cast<float>(geometry_factor(sight.distance2, source, target, dir));
    float* a = &out.emit[i * kMoments];
    float* b = &out.receive[i * kMoments];
    a[kJ] = static_cast<float>(leaving);
    b[kJ] = static_cast<float>(weight * arriving);
    if (!moments) continue;
    if (source.ground) {
      std::fill(a + 1, a + kMoments, 0.0F);
    } else {
      a[kFr] = static_cast<float>(wr);
      a[kFz] = static_cast<float>(wz);
      a[kFa] = static_cast<float>(wa);
      a[kSrr] = static_cast<float>(wr * wr - wa * wa);
      a[kSzz] = static_cast<float>(wz * wz - wa * wa);
      a[kSrz] = static_cast<float>(2 * wr * wz);
      a[kSra] = static_cast<float>(2 * wr * wa);
      a[kSaz] = static_cast<float>(2 * wa * wz);
    }
    if (target.ground) {
      std::fill(b + 1, b + kMoments, 0.0F);
    } else {
      b[kFr] = static_cast<float>(weight * tr);
      b[kFz] = static_cast<float>(weight * wz);
      b[kFa] = static_cast<float>(weight * ta);
      b[kSrr] = static_cast<float>(weight * (tr * tr - 1.0 / 3));
      b[kSzz] = static_cast<float>(weight * (wz * wz - 1.0 / 3));
      b[kSrz] = static_cast<float>(weight * tr * wz);
      b[kSra] = static_cast<float>(weight * tr * ta);
      b[kSaz] = static_cast<float>(weight * ta * wz);
    }
  }
  out.dark = !any;
  out.value = known_value;
  if (known_value != nullptr) return;
  out.value = out.own_value.data();
  if (!any) {
    std::fill(out.own_value.begin(), out.own_value.end(), 0.0F);
    return;
  }

  // Abel summation: the depth from the lower end is ext_high t_end + sum over boundaries
  // of (ext below - ext above) t_boundary, and likewise twice over for the dip to the perigee.
  const float* coefficients[kMostTerms];
  int terms = 0;
  float* t = out.crossing.data();
  const auto n_of = [&](double h) {
    return static_cast<float>((h - low.altitude_km) * (2 * R + h + low.altitude_km));
  };
  const auto cross = [&](const float* s, double h, bool dip, const float* coefficient) {
    HWY_DYNAMIC_DISPATCH(Crossings)
    (s, static_cast<int>(stride), n_of(h), dip, t + static_cast<std::size_t>(terms) * stride);
    coefficients[terms++] = coefficient;
  };
  cross(s_low, high.altitude_km, false,
        &medium.extinction[static_cast<std::size_t>(high.layer) * lanes]);
  for (int b = low.layer + 1; b <= high.layer; ++b) {
    cross(s_low, medium.boundary_km[static_cast<std::size_t>(b)], false,
          &medium.step[static_cast<std::size_t>(b) * lanes]);
  }
  if (lowest < low.altitude_km) {
    // The dip counts twice: down to the perigee and up again.
    const int first = terms;
    cross(s_dip, low.altitude_km, true,
          &medium.extinction[static_cast<std::size_t>(low.layer) * lanes]);
    for (int b = low.layer; b >= 1; --b) {
      const double h = medium.boundary_km[static_cast<std::size_t>(b)];
      if (h <= lowest) break;
      cross(s_dip, h, true, &medium.step[static_cast<std::size_t>(b) * lanes]);
    }
    float* dip = t + static_cast<std::size_t>(first) * stride;
    const std::size_t count = static_cast<std::size_t>(terms - first) * stride;
    for (std::size_t i = 0; i < count; ++i) dip[i] *= 2.0F;
  }
  alignas(64) float shift[kMostSamples];
  for (std::size_t w = 0; w < lanes; ++w) {
    shift[w] = (source.half_depth != nullptr ? source.half_depth[w] : 0.0F) +
               (target.half_depth != nullptr ? target.half_depth[w] : 0.0F);
  }
  HWY_DYNAMIC_DISPATCH(Transmit)
  (t, stride, terms, coefficients, geometry, shift, n, lanes, out.own_value.data());
  constexpr float kDark = 1e-13F;
  bool passes = false;
  for (int k = 0; k < n && !passes; ++k) {
    const float* v = &out.value[static_cast<std::size_t>(k) * lanes];
    for (std::size_t w = 0; w < medium.wavelengths; ++w) passes |= v[w] > kDark * geometry[k];
  }
  out.dark = !passes;
}

AzimuthSampling azimuth_sampling(const ExchangeMedium& medium, const RingPoint& source,
                                 const RingPoint& target, int azimuth_divisions, int max_modes,
                                 double tolerance, int source_modes) {
  const int half = azimuth_divisions / 2;
  AzimuthSampling all{1, std::min(max_modes, half + 1)};
  if (tolerance <= 0) return all;
  const double folds = -std::log(tolerance);
  const double product = source.rho_km * target.rho_km;
  const double dr = source.rho_km - target.rho_km, dz = source.z_km - target.z_km;
  const double d2 = dr * dr + dz * dz;
  if (d2 <= 0) return all;
  // cosh(eta) - 1 = d0^2 / (2 rho_s rho_t)
  const double x = d2 / (2 * std::max(product, 1e-12));
  const double eta = std::log1p(x + std::sqrt(x * (x + 2)));
  double modes = folds / eta;
  const RingPoint& low = source.altitude_km <= target.altitude_km ? source : target;
  const double beta = medium.largest[static_cast<std::size_t>(low.layer)];
  const double d = std::sqrt(d2);
  modes = std::max(modes, std::sqrt(2 * folds * std::min(beta, 8 / d) * product / d));
  AzimuthSampling s;
  s.modes = std::min(all.modes, 1 + static_cast<int>(std::min(1e6, std::ceil(modes))));
  const double needed = std::max(8.0, std::max(s.modes, source_modes) + modes);
  for (int every = half; every > 1; --every) {
    if (half % every == 0 && azimuth_divisions / every >= needed) {
      s.every = every;
      break;
    }
  }
  return s;
}

std::vector<double> ring_pair_kernel_scalar(const ExchangeMedium& medium, const RingPoint& source,
                                            const RingPoint& target, int azimuth_divisions,
                                            bool same_ring) {
  const double R = medium.earth_radius_km;
  const double step = 2 * kPi / azimuth_divisions;
  const int n = azimuth_divisions / 2 + 1;
  std::vector<double> value(static_cast<std::size_t>(n) * medium.lanes, 0.0);
  const bool source_low = source.altitude_km <= target.altitude_km;
  const RingPoint& low = source_low ? source : target;
  const RingPoint& high = source_low ? target : source;
  for (int k = 0; k < n; ++k) {
    if (k == 0 && same_ring) continue;
    const Sight sight = line_of_sight(R, low, high, std::sin(0.5 * step * k));
    if (sight.blocked || sight.distance2 <= 0) continue;
    // Walk along the path: lengths inside every shell from the two crossings of its boundaries.
    const double r_low = R + low.altitude_km;
    const double p2 = r_low * r_low - sight.s_low * sight.s_low;
    const auto s_at = [&](double h) { return std::sqrt(std::max(0.0, (R + h) * (R + h) - p2)); };
    for (std::size_t w = 0; w < medium.lanes; ++w) {
      double depth = 0;
      for (int layer = 0; layer < medium.layers; ++layer) {
        const double b0 = medium.boundary_km[static_cast<std::size_t>(layer)];
        const double b1 = medium.boundary_km[static_cast<std::size_t>(layer) + 1];
        const double ext = medium.extinction[static_cast<std::size_t>(layer) * medium.lanes + w];
        const double lo = std::clamp(b0, low.altitude_km, high.altitude_km);
        const double hi = std::clamp(b1, low.altitude_km, high.altitude_km);
        depth += ext * (s_at(hi) - s_at(lo));
        if (sight.s_low < 0) {
          depth +=
              2 * ext * (s_at(std::min(b1, low.altitude_km)) - s_at(std::min(b0, low.altitude_km)));
        }
      }
      if (source.half_depth != nullptr) depth -= source.half_depth[w];
      if (target.half_depth != nullptr) depth -= target.half_depth[w];
      const SightDirection dir = sight_direction(source, target, std::sqrt(sight.distance2),
                                                 std::sin(step * k), std::sin(0.5 * step * k));
      value[static_cast<std::size_t>(k) * medium.lanes + w] =
          geometry_factor(sight.distance2, source, target, dir) *
          std::exp(-std::clamp(depth, 0.0, 80.0));
    }
  }
  return value;
}

AzimuthModes::AzimuthModes(int azimuth_divisions, int n_modes)
    : divisions(azimuth_divisions),
      samples(azimuth_divisions / 2 + 1),
      modes(std::min(n_modes, azimuth_divisions / 2 + 1)) {
  const auto size = static_cast<std::size_t>(modes) * static_cast<std::size_t>(samples);
  cosine.resize(size);
  sine.resize(size);
  for (int k = 0; k < samples; ++k) {
    const double angle = 2 * kPi * k / divisions;
    sin_step.push_back(2 * k == divisions ? 0.0 : std::sin(angle));
    sin_half_step.push_back(std::sin(angle / 2));
  }
  for (int m = 0; m < modes; ++m) {
    for (int k = 0; k < samples; ++k) {
      // Reduced modulo the circle first: exact symmetry whatever m k is.
      const double angle = 2 * kPi * ((m * k) % divisions) / divisions;
      const auto i = static_cast<std::size_t>(m) * static_cast<std::size_t>(samples) +
                     static_cast<std::size_t>(k);
      cosine[i] = static_cast<float>(std::cos(angle));
      sine[i] = static_cast<float>(std::sin(angle));
    }
  }
}

void moment_pass(const RingPairKernel& kernel, const AzimuthModes& modes, const float* source,
                 float* field) {
  HWY_DYNAMIC_DISPATCH(MomentPassAny)
  (kernel.value, kernel.emit.data(), kernel.receive.data(), kernel.samples, kernel.lanes,
   modes.cosine.data(), modes.sine.data(), static_cast<std::size_t>(modes.samples),
   static_cast<std::size_t>(kernel.every), std::min(modes.modes, kernel.modes), source, field);
}

void moment_pass_scalar(const RingPairKernel& kernel, const AzimuthModes& modes,
                        const float* source, float* field) {
  const std::size_t lanes = kernel.lanes;
  for (int m = 0; m < std::min(modes.modes, kernel.modes); ++m) {
    for (int k = 0; k < kernel.samples; ++k) {
      const std::size_t row = static_cast<std::size_t>(k) * kMoments;
      const auto trig = static_cast<std::size_t>(m) * static_cast<std::size_t>(modes.samples) +
                        static_cast<std::size_t>(k * kernel.every);
      for (std::size_t w = 0; w < lanes; ++w) {
        const std::size_t base = static_cast<std::size_t>(m) * kMoments * lanes + w;
        double even = 0, odd = 0;
        for (std::size_t c = 0; c < kMoments; ++c) {
          const double term = static_cast<double>(kernel.emit[row + c]) * source[base + c * lanes];
          (c < kEvenMoments ? even : odd) += term;
        }
        const double value = kernel.value[static_cast<std::size_t>(k) * lanes + w];
        const double e = value * (modes.cosine[trig] * even - modes.sine[trig] * odd);
        const double o = value * (modes.sine[trig] * even + modes.cosine[trig] * odd);
        for (std::size_t c = 0; c < kMoments; ++c) {
          field[base + c * lanes] += static_cast<float>(
              static_cast<double>(kernel.receive[row + c]) * (c < kEvenMoments ? e : o));
        }
      }
    }
  }
}

void cosine_transform(const RingPairKernel& kernel, const AzimuthModes& modes, float* mode_kernel) {
  alignas(64) float weight[kMostSamples];
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

void first_event_pass(const RingPairKernel& kernel, int azimuth_divisions, const float* power,
                      const unsigned char* lit, const float* asymmetry, double sun_elevation_rad,
                      float* field) {
  alignas(64) float receive_j[kMostSamples];
  float cos_az[kMostSamples], sin_az[kMostSamples];
  for (int k = 0; k < kernel.samples; ++k) {
    const auto row = static_cast<std::size_t>(k) * kMoments;
    const float both_sides = k == 0 || k == kernel.samples - 1 ? 1.0F : 2.0F;
    receive_j[k] = kernel.receive[row] / both_sides;
  }
  for (int i = 0; i < azimuth_divisions; ++i) {
    const double phi = 2 * kPi * i / azimuth_divisions;
    cos_az[i] = static_cast<float>(std::cos(phi));
    sin_az[i] = static_cast<float>(std::sin(phi));
  }
  HWY_DYNAMIC_DISPATCH(FirstEventAny)
  (kernel.value, receive_j, kernel.dir_r.data(), kernel.dir_a.data(), kernel.dir_z.data(),
   kernel.samples, kernel.every, kernel.lanes, azimuth_divisions, cos_az, sin_az, power, lit,
   asymmetry, static_cast<float>(std::cos(sun_elevation_rad)),
   static_cast<float>(std::sin(sun_elevation_rad)), field);
}

void first_event_pass_scalar(const RingPairKernel& kernel, int azimuth_divisions,
                             const float* power, const unsigned char* lit, const float* asymmetry,
                             double sun_elevation_rad, float* field) {
  const int S = azimuth_divisions, half = S / 2;
  const std::size_t lanes = kernel.lanes;
  for (int j = 0; j <= half; ++j) {
    for (int i = 0; i < S; ++i) {
      int shift = j - i;
      if (shift > half) shift -= S;
      if (shift <= -half) shift += S;
      if (shift % kernel.every != 0) continue;
      const auto k = static_cast<std::size_t>(std::abs(shift) / kernel.every);
      const int mirror = i <= half ? i : S - i;
      if (!lit[mirror]) continue;
      const double both_sides = std::abs(shift) == 0 || std::abs(shift) == half ? 1.0 : 2.0;
      const double received = kernel.receive[k * kMoments] / both_sides;
      const double phi = 2 * kPi * i / S;
      const double wa = shift < 0 ? -kernel.dir_a[k] : kernel.dir_a[k];
      const double cosine =
          -(std::cos(sun_elevation_rad) * (kernel.dir_r[k] * std::cos(phi) - wa * std::sin(phi)) +
            std::sin(sun_elevation_rad) * kernel.dir_z[k]);
      for (std::size_t w = 0; w < lanes; ++w) {
        const double g = asymmetry[w];
        const double hg = (1 - g * g) / std::pow(1 + g * g - 2 * g * cosine, 1.5);
        field[static_cast<std::size_t>(j) * lanes + w] +=
            static_cast<float>(hg * kernel.value[k * lanes + w] * received *
                               power[static_cast<std::size_t>(mirror) * lanes + w]);
      }
    }
  }
}

}  // namespace twilight
#endif  // HWY_ONCE
