#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <vector>

#include "sim/aerosol_pass.h"
#include "sim/cell_grid.h"
#include "sim/ring_pair_kernel.h"
#include "sim/ring_pair_schedule.h"
#include "sim/ring_pass.h"
#include "sim/simd_target.h"
#include "small_scene.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kR = 6371.0;

// Air and haze of a turbid day, kept simple: 24 layers up to 60 km.
Medium hazy_air(std::size_t wavelengths = 3) {
  std::vector<double> scattering;
  for (int i = 0; i < 24; ++i) {
    const double z = 2.5 * i + 1.25;
    scattering.push_back(0.03 * std::exp(-z / 8) + 0.1 * std::exp(-z / 1.5));
  }
  return layered_air(60, scattering, 1e-4, wavelengths);
}

ExchangeMedium kernel_medium(const Medium& m, std::size_t lanes) {
  LayerTable extinction(m.layers(), m.wavelengths());
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      extinction(i, w) = m.extinction_per_km(i, w);
    }
  }
  return make_exchange_medium(m, lanes, extinction);
}

RingPoint point(const Medium& m, double rho_km, double altitude_km) {
  RingPoint p;
  p.rho_km = rho_km;
  p.altitude_km = altitude_km;
  // z of that altitude, without cancellation: (R + z)^2 + rho^2 = (R + h)^2
  const double up = std::sqrt((kR + altitude_km) * (kR + altitude_km) - rho_km * rho_km);
  p.z_km = (altitude_km * (2 * kR + altitude_km) - rho_km * rho_km) / (up + kR);
  p.layer = layer_at(m, altitude_km);
  return p;
}

RingPoint ground_point(const Medium& m, double rho_km) {
  RingPoint p = point(m, rho_km, 0);
  p.ground = true;
  p.normal_r = rho_km / kR;
  p.normal_z = std::sqrt(1 - p.normal_r * p.normal_r);
  return p;
}

struct Pair {
  const char* what;
  RingPoint source, target;
  bool same = false;
};

std::vector<Pair> pairs(const Medium& m) {
  std::vector<Pair> list = {
      {"near", point(m, 5, 1), point(m, 6, 1.4)},
      {"far", point(m, 10, 3), point(m, 500, 20)},
      {"one above the other", point(m, 40, 2), point(m, 40, 50)},
      {"blocked by the Earth", point(m, 600, 0.5), point(m, 640, 1.0)},
      {"dips below both", point(m, 300, 10), point(m, 320, 10.5)},
      {"dips to the ground's edge", point(m, 300, 8), point(m, 310, 8)},
      {"equal altitude", point(m, 100, 5), point(m, 180, 5)},
      {"both in the highest layer", point(m, 700, 58), point(m, 50, 59.5)},
      {"at a boundary", point(m, 20, 2.5), point(m, 90, 5)},
      {"on the axis", point(m, 0, 1), point(m, 30, 12)},
      {"from the ground", ground_point(m, 30), point(m, 60, 8)},
      {"to the ground", point(m, 200, 12), ground_point(m, 150)},
      {"at the ground", point(m, 12, 0), point(m, 15, 0.3)},
  };
  for (const auto& [rho, h] : {std::pair{3.0, 0.5}, {80.0, 4.0}, {500.0, 30.0}}) {
    list.push_back({"same ring", point(m, rho, h), point(m, rho, h), true});
  }
  std::mt19937 random(2005);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int i = 0; i < 150; ++i) {
    const auto any = [&] {
      return point(m, std::pow(10, 3 * unit(random) - 0.2), 60 * std::pow(unit(random), 2));
    };
    Pair p{"random", any(), any()};
    p.source.blur_km2 = unit(random);
    p.source.variance_radial_km2 = 3 * unit(random);
    p.target.variance_third_km2 = 2 * unit(random);
    p.target.variance_azimuthal_km2 = unit(random);
    list.push_back(p);
  }
  return list;
}

constexpr int kDivisions = 36;

struct Evaluation {
  AzimuthModes modes;
  RingPairKernel kernel;
  Evaluation(const ExchangeMedium& m, const Pair& p, AzimuthSampling sampling = {1, 19},
             bool moments = true)
      : modes(kDivisions, kDivisions / 2 + 1) {
    kernel.resize(kDivisions, m.lanes, m.layers);
    ring_pair_kernel(m, p.source, p.target, modes, sampling, p.same, moments, kernel);
  }
};

// Cells' positions in space, azimuth index j.
std::array<double, 3> position(const RingPoint& p, double azimuth) {
  return {p.rho_km * std::cos(azimuth), p.rho_km * std::sin(azimuth), p.z_km};
}

// The vectorised kernel is in single precision: lengths are right to 2e-7 of themselves, so depths
// (up to 30 here, beyond which a sample counts as dark) to 1e-5 and so are transmittances.
TEST(RingPairKernel, AgreesWithItsScalarTwin) {
  for (const std::size_t wavelengths : {3U, 12U}) {
    const Medium m = hazy_air(wavelengths);
    const std::size_t lanes = wavelengths <= 8 ? 8 : 16;
    const ExchangeMedium medium = kernel_medium(m, lanes);
    std::vector<float> shift(lanes, 0.02F);
    double worst = 0;
    for (Pair p : pairs(m)) {
      if (p.source.rho_km > 50) p.source.half_depth = shift.data();
      const Evaluation e(medium, p);
      const auto scalar = ring_pair_kernel_scalar(medium, p.source, p.target, kDivisions, p.same);
      ASSERT_EQ(e.kernel.samples, kDivisions / 2 + 1);
      const double brightest = *std::max_element(scalar.begin(), scalar.end());
      for (std::size_t k = 0; k < static_cast<std::size_t>(e.kernel.samples); ++k) {
        const bool faces = e.kernel.emit[k * kMoments] > 0;
        for (std::size_t w = 0; w < wavelengths; ++w) {
          const double a = e.kernel.value[k * lanes + w], b = scalar[k * lanes + w];
          if (!faces) {
            EXPECT_EQ(a, 0) << p.what;
            continue;
          }
          EXPECT_NEAR(a, b, 3e-5 * b + 1e-12 * brightest) << p.what << ' ' << k << ' ' << w;
          if (b > 1e-12 * brightest) worst = std::max(worst, std::abs(a / b - 1));
        }
      }
    }
    RecordProperty("worst", std::to_string(worst));
    std::printf("worst relative difference %.2e\n", worst);
  }
}

// K = exp(-tau)/(4 pi d^2) along the straight line in space, integrated step by step.
TEST(RingPairKernel, IsTransmittanceOverTheSquaredDistance) {
  const Medium m = hazy_air();
  const ExchangeMedium medium = kernel_medium(m, 8);
  for (const Pair& p : pairs(m)) {
    if (std::string(p.what) == "random" || p.same) continue;
    const auto scalar = ring_pair_kernel_scalar(medium, p.source, p.target, kDivisions, p.same);
    for (int k = 0; k <= kDivisions / 2; k += 3) {
      const auto a = position(p.source, 0), b = position(p.target, 2 * kPi * k / kDivisions);
      const double d = std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
      if (d == 0) continue;
      constexpr int kSteps = 20000;
      double depth = 0, lowest = 1e9;
      for (int i = 0; i < kSteps; ++i) {
        const double t = (i + 0.5) / kSteps;
        const double h = std::hypot(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]),
                                    kR + a[2] + t * (b[2] - a[2])) -
                         kR;
        lowest = std::min(lowest, h);
        depth += m.extinction_per_km(static_cast<std::size_t>(layer_at(m, h)), 0) * d / kSteps;
      }
      const double value = scalar[static_cast<std::size_t>(k) * 8];
      if (lowest < -1e-6) {
        EXPECT_EQ(value, 0) << p.what << ' ' << k;
      } else if (lowest > 1e-3 || p.source.ground || p.target.ground) {
        if (value == 0) continue;  // the back of a ground patch
        // Crossings of boundaries are caught to a step: a 20000th of the depth or two.
        EXPECT_NEAR(value * 4 * kPi * d * d / std::exp(-depth), 1.0, 1e-3 * (1 + depth))
            << p.what << ' ' << k;
      }
    }
  }
}

TEST(RingPairKernel, IsSymmetric) {
  const Medium m = hazy_air();
  const ExchangeMedium medium = kernel_medium(m, 8);
  for (const Pair& p : pairs(m)) {
    if (p.source.ground || p.target.ground) continue;
    const Evaluation there(medium, p), back(medium, {p.what, p.target, p.source, p.same});
    EXPECT_EQ(there.kernel.dark, back.kernel.dark) << p.what;
    for (std::size_t k = 0; k < static_cast<std::size_t>(there.kernel.samples); ++k) {
      const float a = there.kernel.value[k * 8], b = back.kernel.value[k * 8];
      EXPECT_NEAR(a, b, 1e-6 * a) << p.what << ' ' << k;
    }
  }
}

// Ground to air and air to ground: the patch's Lambert cosine weighs both alike, 4 cos against cos.
TEST(RingPairKernel, GroundIsReciprocal) {
  const Medium m = hazy_air();
  const ExchangeMedium medium = kernel_medium(m, 8);
  for (const double rho : {0.5, 30.0, 300.0}) {
    const RingPoint ground = ground_point(m, rho), air = point(m, 90, 9);
    const Evaluation up(medium, {"up", ground, air}), down(medium, {"down", air, ground});
    for (std::size_t k = 0; k < static_cast<std::size_t>(up.kernel.samples); ++k) {
      const auto at = k * kMoments;
      EXPECT_NEAR(up.kernel.emit[at] * up.kernel.receive[at],
                  4 * down.kernel.emit[at] * down.kernel.receive[at], 1e-5 * up.kernel.receive[at]);
      EXPECT_NEAR(up.kernel.value[k * 8], down.kernel.value[k * 8], 1e-6 * up.kernel.value[k * 8]);
    }
  }
}

// The kernel of a pair turned round is the one of the pair in the other order.
TEST(RingPairKernel, TurnedRoundIsTheOtherOrder) {
  const Medium m = hazy_air();
  const ExchangeMedium medium = kernel_medium(m, 8);
  for (const Pair& p : pairs(m)) {
    Evaluation there(medium, p);
    const Evaluation back(medium, {p.what, p.target, p.source, p.same});
    there.kernel.turn_round(p.source, p.target, true);
    for (std::size_t i = 0; i < 19 * kMoments; ++i) {
      EXPECT_NEAR(there.kernel.emit[i], back.kernel.emit[i], 1e-6) << p.what << ' ' << i;
      EXPECT_NEAR(there.kernel.receive[i], back.kernel.receive[i], 1e-6) << p.what << ' ' << i;
    }
    EXPECT_EQ(there.kernel.value, there.kernel.own_value.data());
  }
}

// Every pair once, no ring in two places at once, its partners always in the same order.
TEST(RingPairSchedule, IsATournament) {
  for (const std::size_t n : {0U, 1U, 15U, 16U, 17U, 48U, 100U}) {
    std::vector<std::vector<std::size_t>> order[2];
    for (auto& partners : order) {
      partners.resize(n);
      std::vector<std::atomic<int>> busy(n);
      double last = 0;
      for_each_ring_pair(
          n,
          [&](std::size_t a, std::size_t b) {
            EXPECT_GE(a, b);
            EXPECT_EQ(busy[a]++, 0);
            if (a != b) {
              EXPECT_EQ(busy[b]++, 0);
              partners[b].push_back(a);
            }
            partners[a].push_back(b);
            --busy[a];
            if (a != b) --busy[b];
          },
          [&](double fraction) {
            EXPECT_GE(fraction, last);
            last = fraction;
          });
      if (n > 0) {
        EXPECT_DOUBLE_EQ(last, 1);
      }
    }
    EXPECT_EQ(order[0], order[1]);
    for (std::size_t i = 0; i < n; ++i) {
      std::vector<std::size_t> met = order[0][i];
      std::ranges::sort(met);
      ASSERT_EQ(met.size(), n);
      for (std::size_t k = 0; k < n; ++k) EXPECT_EQ(met[k], k);
    }
  }
}

TEST(RingPairKernel, KnownValuesServeBothDirections) {
  const Medium m = hazy_air();
  const ExchangeMedium medium = kernel_medium(m, 8);
  for (const Pair& p : pairs(m)) {
    const Evaluation there(medium, p);
    if (there.kernel.dark) continue;
    const Pair other{p.what, p.target, p.source, p.same};
    Evaluation back(medium, other);
    RingPairKernel given;
    given.resize(kDivisions, 8, medium.layers);
    ring_pair_kernel(medium, p.target, p.source, back.modes, {1, 19}, p.same, true, given,
                     there.kernel.value);
    EXPECT_EQ(given.value, there.kernel.value);
    EXPECT_EQ(given.emit, back.kernel.emit);
    EXPECT_EQ(given.receive, back.kernel.receive);
  }
}

// Far away, the near field vanishes; nothing is brighter than the point's own 1/d^2 by more than
// the docstring's 2.5 (two cells end to end), and crossing extents only dim.
TEST(NearField, TendsToThePointAndDimsAcross) {
  EXPECT_DOUBLE_EQ(near_field_factor(0, 0), 1);
  double previous = 1;
  for (double p = 1e-4; p < 100; p *= 2) {
    EXPECT_GT(near_field_factor(p, 0), previous);
    previous = near_field_factor(p, 0);
    EXPECT_GE(near_field_factor(0, p), 0.4 - 1e-12);
    EXPECT_LE(near_field_factor(0, p), 1);
  }
  // To first order: <1/d^2> = (1 - P + 3 p)/d^2 for variances P across in both directions
  // together and p along, from the expansion of 1/|d + x|^2.
  const double p = 1e-6;
  EXPECT_NEAR((near_field_factor(p, 0) - 1) / p, 1, 1e-2);
  EXPECT_NEAR((near_field_factor(0, p) - 1) / p, -3, 1e-2);
}

std::vector<float> random_spectra(std::size_t n, unsigned seed, float lowest = -1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> value(lowest, 1);
  std::vector<float> v(n);
  for (float& x : v) x = value(random);
  return v;
}

TEST(MomentPass, AgreesWithItsScalarTwin) {
  for (const std::size_t lanes : {8U, 16U, 32U}) {
    const Medium m = hazy_air(lanes - 2);
    const ExchangeMedium medium = kernel_medium(m, lanes);
    for (const Pair& p : pairs(m)) {
      for (const AzimuthSampling sampling : {AzimuthSampling{1, 19}, {2, 9}, {6, 3}}) {
        const Evaluation e(medium, p, sampling);
        const auto source = random_spectra(19 * kMoments * lanes, 7);
        const auto start = random_spectra(source.size(), 8);
        auto simd = start, scalar = start;
        std::fill(simd.begin(), simd.end(), 0.0F);
        scalar = simd;
        moment_pass(e.kernel, e.modes, source.data(), simd.data());
        moment_pass_scalar(e.kernel, e.modes, source.data(), scalar.data());
        float scale = 0;
        for (const float v : scalar) scale = std::max(scale, std::abs(v));
        for (std::size_t i = 0; i < simd.size(); ++i) {
          ASSERT_NEAR(simd[i], scalar[i], 1e-5 * scale) << p.what << ' ' << lanes;
        }
      }
    }
  }
}

TEST(MomentPass, AddsToTheField) {
  const Medium m = hazy_air();
  const ExchangeMedium medium = kernel_medium(m, 8);
  const Evaluation e(medium, pairs(m)[0]);
  const auto source = random_spectra(19 * kMoments * 8, 7);
  std::vector<float> once(source.size(), 0.0F), more(source.size(), 1.0F);
  moment_pass(e.kernel, e.modes, source.data(), once.data());
  moment_pass(e.kernel, e.modes, source.data(), more.data());
  for (std::size_t i = 0; i < once.size(); ++i) EXPECT_NEAR(more[i], 1 + once[i], 1e-6);
}

// All moments in azimuthal modes against the plain sum over cells in space: emission
// J + F.w + w.S.w towards the target, which gains J, F = w, S = ww - 1/3, each in its own frame.
TEST(MomentPass, IsTheDirectSumOverCells) {
  const Medium m = hazy_air();
  const ExchangeMedium medium = kernel_medium(m, 8);
  const int S = kDivisions, M = S / 2 + 1;
  const auto q = random_spectra(static_cast<std::size_t>(M) * kMoments * 8, 11);
  const auto series = [&](const std::vector<float>& modes, int c, double azimuth) {
    double sum = 0;
    for (int k = 0; k < M; ++k) {
      const double a = c < kEvenMoments ? std::cos(k * azimuth) : std::sin(k * azimuth);
      sum += a * modes[(static_cast<std::size_t>(k) * kMoments + static_cast<std::size_t>(c)) * 8];
    }
    return sum;
  };
  for (const Pair& p : pairs(m)) {
    if (p.source.ground || p.target.ground) continue;
    const Evaluation e(medium, p);
    if (e.kernel.dark) continue;
    std::vector<float> field(q.size(), 0.0F);
    moment_pass(e.kernel, e.modes, q.data(), field.data());
    const auto value = ring_pair_kernel_scalar(medium, p.source, p.target, S, p.same);
    double scale = 0, worst = 0;
    for (int j = 0; j <= S / 2; j += 3) {
      const double at = 2 * kPi * j / S;
      std::array<double, kMoments> sum{};
      for (int i = 0; i < S; ++i) {
        const int k = std::min((i - j + S) % S, (j - i + S) % S);
        if (p.same && k == 0) continue;
        const double from = 2 * kPi * i / S;
        const auto a = position(p.source, from), b = position(p.target, at);
        const std::array<double, 3> w0{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
        const double d = std::hypot(w0[0], w0[1], w0[2]);
        const auto in_frame = [&](double azimuth) {
          return std::array<double, 3>{(w0[0] * std::cos(azimuth) + w0[1] * std::sin(azimuth)) / d,
                                       (-w0[0] * std::sin(azimuth) + w0[1] * std::cos(azimuth)) / d,
                                       w0[2] / d};
        };
        const auto [r, t, z] = in_frame(from);
        const auto s = [&](int c) { return series(q, c, from); };
        const double emitted = s(kJ) + s(kFr) * r + s(kFa) * t + s(kFz) * z + s(kSrr) * r * r +
                               s(kSzz) * z * z - (s(kSrr) + s(kSzz)) * t * t +
                               2 * (s(kSrz) * r * z + s(kSra) * r * t + s(kSaz) * t * z);
        const double arriving = emitted * value[static_cast<std::size_t>(k) * 8];
        const auto [R, T, Z] = in_frame(at);
        sum[kJ] += arriving;
        sum[kFr] += arriving * R;
        sum[kFz] += arriving * Z;
        sum[kFa] += arriving * T;
        sum[kSrr] += arriving * (R * R - 1.0 / 3);
        sum[kSzz] += arriving * (Z * Z - 1.0 / 3);
        sum[kSrz] += arriving * R * Z;
        sum[kSra] += arriving * R * T;
        sum[kSaz] += arriving * T * Z;
      }
      for (int c = 0; c < kMoments; ++c) {
        scale = std::max(scale, std::abs(sum[static_cast<std::size_t>(c)]));
        worst = std::max(worst, std::abs(series(field, c, at) - sum[static_cast<std::size_t>(c)]));
      }
    }
    EXPECT_LE(worst, 1e-4 * scale) << p.what;
  }
}

TEST(CosineTransform, IsTheDirectSum) {
  for (const std::size_t lanes : {8U, 16U}) {
    const Medium m = hazy_air(lanes - 1);
    const ExchangeMedium medium = kernel_medium(m, lanes);
    for (const Pair& p : pairs(m)) {
      for (const AzimuthSampling sampling : {AzimuthSampling{1, 19}, {3, 6}}) {
        const Evaluation e(medium, p, sampling, false);
        std::vector<float> modes(19 * lanes, -7.0F);
        cosine_transform(e.kernel, e.modes, modes.data());
        const auto& k = e.kernel;
        for (std::size_t w = 0; w < lanes; ++w) {
          for (int order = 0; order < sampling.modes; ++order) {
            double sum = 0, scale = 0;
            for (int i = 0; i < k.samples; ++i) {
              const auto at = static_cast<std::size_t>(i);
              const double term = static_cast<double>(k.value[at * lanes + w]) *
                                  k.emit[at * kMoments] * k.receive[at * kMoments];
              sum += term * std::cos(order * 2 * kPi * i * k.every / kDivisions);
              scale += term;
            }
            ASSERT_NEAR(modes[static_cast<std::size_t>(order) * lanes + w], sum, 2e-6 * scale)
                << p.what;
          }
        }
      }
    }
  }
}

TEST(MultiplyAdd, IsAProductAddedPerElement) {
  const auto a = random_spectra(48, 1), b = random_spectra(48, 2);
  auto f = random_spectra(48, 3);
  const auto before = f;
  multiply_add(a.data(), b.data(), 4.0F, f.size(), f.data());
  for (std::size_t i = 0; i < f.size(); ++i) EXPECT_NEAR(f[i], before[i] + 4 * a[i] * b[i], 1e-6);
}

TEST(MultiplyAdd, BothDirectionsAtOnce) {
  const auto k = random_spectra(48, 1), a = random_spectra(48, 2), b = random_spectra(48, 3);
  auto fa = random_spectra(48, 4), fb = random_spectra(48, 5);
  const auto before_a = fa, before_b = fb;
  multiply_add_both(k.data(), a.data(), 4.0F, b.data(), 1.0F, k.size(), fa.data(), fb.data());
  for (std::size_t i = 0; i < k.size(); ++i) {
    EXPECT_NEAR(fa[i], before_a[i] + k[i] * b[i], 1e-6);
    EXPECT_NEAR(fb[i], before_b[i] + 4 * k[i] * a[i], 1e-6);
  }
}

// Whatever vectors the processor has: the same kernels within their rounding.
TEST(SimdTarget, EveryInstructionSetAgrees) {
  EXPECT_THROW(cap_simd_target("mmx"), std::invalid_argument);
  const std::string best_target = simd_target();
  for (const std::size_t lanes : {8U, 16U, 32U}) {
    const Medium m = hazy_air(lanes - 2);
    const ExchangeMedium medium = kernel_medium(m, lanes);
    const auto source = random_spectra(19 * kMoments * lanes, 7);
    const auto power = random_spectra(19 * lanes, 21, 0.1F);
    const std::vector<float> asymmetry(lanes, 0.7F);
    std::vector<unsigned char> lit(19, 1);
    std::fill_n(lit.begin(), 4, 0);
    const auto all = [&](const Pair& p) {
      std::vector<std::vector<float>> out(4);
      const Evaluation e(medium, p);
      out[0].assign(e.kernel.value, e.kernel.value + 19 * lanes);
      out[1].assign(19 * kMoments * lanes, 0.0F);
      moment_pass(e.kernel, e.modes, source.data(), out[1].data());
      out[2].assign(19 * lanes, 0.0F);
      cosine_transform(e.kernel, e.modes, out[2].data());
      out[3].assign(19 * lanes, 0.0F);
      first_event_pass(e.kernel, e.modes, power.data(), lit.data(), asymmetry.data(), -0.1,
                       out[3].data());
      return out;
    };
    for (const Pair& p : pairs(m)) {
      cap_simd_target("best");
      const auto best = all(p);
      for (const char* cap : {"avx2", "sse4", "scalar"}) {
        cap_simd_target(cap);
        const auto capped = all(p);
        for (std::size_t i = 0; i < best.size(); ++i) {
          float largest = 0;
          for (const float v : best[i]) largest = std::max(largest, std::abs(v));
          for (std::size_t k = 0; k < best[i].size(); ++k) {
            ASSERT_NEAR(best[i][k], capped[i][k], 3e-5F * largest) << cap << ' ' << p.what << i;
          }
        }
      }
    }
  }
  // The cap is on what runs, not only on what is reported.
  for (const char* cap : {"avx2", "sse4"}) {
    cap_simd_target(cap);
    EXPECT_NE(simd_target(), "AVX3") << cap;
  }
  cap_simd_target("best");
  EXPECT_EQ(simd_target(), best_target);
}

TEST(AzimuthSampling, ZeroToleranceKeepsEverything) {
  const Medium m = hazy_air();
  const ExchangeMedium medium = kernel_medium(m, 8);
  for (const Pair& p : pairs(m)) {
    const auto s = azimuth_sampling(medium, p.source, p.target, kDivisions, 24, 0);
    EXPECT_EQ(s.every, 1);
    EXPECT_EQ(s.modes, 19);
  }
}

// What is dropped and thinned away changes no mode by more than ten times the tolerance of the
// light that the pair would exchange through clear air, nor, where less than e^-1 is lost on the
// way, of what it does exchange. (Blocking by the Earth cuts kernels off sharply, which no
// tolerance can follow with few samples; such pairs are not asked here.)
TEST(AzimuthSampling, KeepsWhatTheToleranceAsks) {
  const Medium m = hazy_air();
  const ExchangeMedium medium = kernel_medium(m, 8);
  const Medium nothing = layered_air(60, std::vector<double>(24, 0.0), 0, 3);
  const ExchangeMedium clear = kernel_medium(nothing, 8);
  const int S = 120, half = S / 2;
  const AzimuthModes modes(S, 24);
  double worst = 0, worst_bright = 0, thinned = 0, all = 0;
  for (const double tolerance : {1e-2, 1e-3, 1e-4}) {
    for (const Pair& p : pairs(m)) {
      if (p.same || p.source.ground || p.target.ground) continue;
      const auto sampling = azimuth_sampling(medium, p.source, p.target, S, 24, tolerance);
      EXPECT_EQ(half % sampling.every, 0);
      EXPECT_GE(sampling.modes, 1);
      EXPECT_LE(sampling.modes, 24);
      const auto full = ring_pair_kernel_scalar(medium, p.source, p.target, S, false);
      const auto unattenuated = ring_pair_kernel_scalar(clear, p.source, p.target, S, false);
      bool cut = false;
      for (int k = 0; k <= half; ++k) cut |= full[static_cast<std::size_t>(k) * 8] == 0;
      if (cut) continue;
      RingPairKernel few;
      few.resize(S, 8, medium.layers);
      ring_pair_kernel(medium, p.source, p.target, modes, sampling, false, false, few);
      std::vector<float> got(24 * 8, 0.0F);
      cosine_transform(few, modes, got.data());
      const auto mode_of = [&](const std::vector<double>& kernel, int order) {
        double sum = 0;
        for (int k = 0; k <= half; ++k) {
          sum += kernel[static_cast<std::size_t>(k) * 8] * (k == 0 || k == half ? 1 : 2) *
                 std::cos(2 * kPi * order * k / S);
        }
        return sum;
      };
      const double whole = mode_of(full, 0), through_clear_air = mode_of(unattenuated, 0);
      for (int order = 0; order < 24; ++order) {
        const double error =
            std::abs(got[static_cast<std::size_t>(order) * 8] - mode_of(full, order));
        worst = std::max(worst, error / through_clear_air / tolerance);
        EXPECT_LE(error / through_clear_air, 10 * tolerance)
            << p.what << ", mode " << order << " of " << sampling.modes << ", every "
            << sampling.every << ", rho " << p.source.rho_km << ' ' << p.target.rho_km;
        if (whole < std::exp(-1) * through_clear_air) continue;
        worst_bright = std::max(worst_bright, error / whole / tolerance);
        EXPECT_LE(error / whole, 10 * tolerance)
            << p.what << ", mode " << order << " of " << sampling.modes << ", every "
            << sampling.every << ", rho " << p.source.rho_km << ' ' << p.target.rho_km << " h "
            << p.source.altitude_km << ' ' << p.target.altitude_km;
      }
      thinned += few.samples;
      all += half + 1;
    }
  }
  std::printf("worst error %.2f tolerances (clear air), %.2f (bright pairs), %.0f %% of samples\n",
              worst, worst_bright, 100 * thinned / all);
  EXPECT_LT(thinned, 0.8 * all);
}

class FirstEventPass : public testing::Test {
 protected:
  Medium m = hazy_air();
  ExchangeMedium medium = kernel_medium(m, 8);
  std::vector<float> power = random_spectra(19 * 8, 21, 0.1F);
  std::vector<unsigned char> lit = std::vector<unsigned char>(19, 1);
};

TEST_F(FirstEventPass, AgreesWithItsScalarTwin) {
  lit[18] = lit[17] = 0;
  double worst = 0;
  for (const float g : {0.0F, 0.5F, 0.85F, -0.3F}) {
    const std::vector<float> asymmetry(8, g);
    for (const double sun : {-0.1, 0.0, 0.7}) {
      for (const Pair& p : pairs(m)) {
        for (const AzimuthSampling sampling : {AzimuthSampling{1, 19}, {3, 6}}) {
          const Evaluation e(medium, p, sampling);
          std::vector<float> simd(19 * 8, 0.0F), scalar(19 * 8, 0.0F);
          first_event_pass(e.kernel, e.modes, power.data(), lit.data(), asymmetry.data(), sun,
                           simd.data());
          first_event_pass_scalar(e.kernel, kDivisions, power.data(), lit.data(), asymmetry.data(),
                                  sun, scalar.data());
          for (std::size_t i = 0; i < simd.size(); ++i) {
            // 1/sqrt is a 12-bit guess and one Newton step; near the forward peak of g = 0.85 the
            // base loses three bits.
            ASSERT_NEAR(simd[i], scalar[i], 1e-4 * scalar[i] + 1e-30) << p.what << " g " << g;
            if (scalar[i] > 1e-25F) {
              worst = std::max(worst, std::abs(static_cast<double>(simd[i]) / scalar[i] - 1));
            }
          }
        }
      }
    }
  }
  std::printf("worst relative difference %.2e\n", worst);
}

// With g = 0 and even light around the ring every cell sends its power everywhere alike.
TEST_F(FirstEventPass, IsotropicIsTheMeanMode) {
  const std::vector<float> even(19 * 8, 0.5F), zero(8, 0.0F);
  for (const Pair& p : pairs(m)) {
    if (p.source.ground) continue;
    const Evaluation e(medium, p);
    std::vector<float> field(19 * 8, 0.0F), modes(19 * 8);
    first_event_pass(e.kernel, e.modes, even.data(), lit.data(), zero.data(), 0.3, field.data());
    cosine_transform(e.kernel, e.modes, modes.data());
    for (std::size_t j = 0; j < 19; ++j) {
      EXPECT_NEAR(field[j * 8], 0.5 * modes[0], 1e-5 * modes[0]) << p.what;
    }
  }
}

// Henyey-Greenstein about the sunlight's direction, in space: (1 - g^2)/(1 + g^2 - 2 g cos)^1.5.
TEST_F(FirstEventPass, IsHenyeyGreensteinAboutTheSunsDirection) {
  const float g = 0.7F;
  const std::vector<float> asymmetry(8, g);
  const double e = 0.2;
  const std::array<double, 3> sunlight{-std::cos(e), 0, -std::sin(e)};
  for (const Pair& p : pairs(m)) {
    if (p.source.ground || p.target.ground) continue;
    const Evaluation kernel(medium, p);
    const auto value = ring_pair_kernel_scalar(medium, p.source, p.target, kDivisions, p.same);
    std::vector<float> field(19 * 8, 0.0F);
    first_event_pass(kernel.kernel, kernel.modes, power.data(), lit.data(), asymmetry.data(), e,
                     field.data());
    for (int j = 0; j <= kDivisions / 2; j += 2) {
      double sum = 0;
      for (int i = 0; i < kDivisions; ++i) {
        const int k =
            std::min((i - j + kDivisions) % kDivisions, (j - i + kDivisions) % kDivisions);
        if (p.same && k == 0) continue;
        const auto a = position(p.source, 2 * kPi * i / kDivisions);
        const auto b = position(p.target, 2 * kPi * j / kDivisions);
        double along = 0, d = 0;
        for (std::size_t c = 0; c < 3; ++c) {
          along += (b[c] - a[c]) * sunlight[c];
          d += (b[c] - a[c]) * (b[c] - a[c]);
        }
        const double base = 1 + g * g - 2 * g * along / std::sqrt(d);
        const auto mirror = static_cast<std::size_t>(std::min(i, kDivisions - i));
        sum += power[mirror * 8] * value[static_cast<std::size_t>(k) * 8] * (1 - g * g) /
               (base * std::sqrt(base));
      }
      EXPECT_NEAR(field[static_cast<std::size_t>(j) * 8], sum, 2e-4 * sum + 1e-25) << p.what;
    }
  }
}

}  // namespace
}  // namespace twilight
