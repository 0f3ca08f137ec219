#include "sim/orders_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <tuple>
#include <vector>

#include "sim/angular_moments.h"
#include "sim/zenith_grid.h"

namespace twilight {
namespace {

using std::numbers::pi;

// lanes, polarised, degree of the aerosol (0: none)
using Case = std::tuple<int, bool, int>;

template <class T>
struct Random {
  std::mt19937 engine{11};
  std::vector<T> values(std::size_t n, double from = -1, double to = 1) {
    std::uniform_real_distribution<double> uniform(from, to);
    std::vector<T> v(n);
    for (T& x : v) x = static_cast<T>(uniform(engine));
    return v;
  }
};

template <class T>
constexpr double kRounding = sizeof(T) == 4 ? 2e-6 : 1e-14;

template <class T>
void expect_same(const std::vector<T>& got, const std::vector<T>& want, double tolerance) {
  ASSERT_EQ(got.size(), want.size());
  double scale = 0, worst = 0;
  for (const T x : want) scale = std::max(scale, std::abs(static_cast<double>(x)));
  for (std::size_t i = 0; i < got.size(); ++i) {
    worst = std::max(worst, std::abs(static_cast<double>(got[i]) - static_cast<double>(want[i])));
  }
  EXPECT_GT(scale, 0);
  EXPECT_LE(worst, tolerance * scale);
}

template <class T>
void source_modes_agree(const Case& c) {
  const auto [lane_count, polarised, phase_degree] = c;
  const auto lanes = static_cast<std::size_t>(lane_count);
  Random<T> random;
  SourceModesInput<T> in;
  in.nodes = 7;
  in.lanes = lanes;
  in.polarised = polarised;
  in.cos_theta = static_cast<T>(std::cos(2.0));
  in.sin_theta = static_cast<T>(std::sin(2.0));
  const auto coherency = random.values(in.nodes * 4 * lanes), air = random.values(lanes, 0, 1);
  in.coherency = coherency.data();
  in.air_weight = air.data();
  in.degree = std::max(2, phase_degree);
  const std::size_t count = moment_count(phase_degree);
  const auto rows = static_cast<std::size_t>(phase_degree) + 1;
  const auto moments = random.values(in.nodes * (polarised ? 3 : 1) * count * lanes);
  const auto p = random.values(count), r = random.values(count), t = random.values(count);
  const auto a1 = random.values(rows * lanes), b1 = random.values(rows * lanes),
             a2 = random.values(rows * lanes), a3 = random.values(rows * lanes);
  if (phase_degree > 0) {
    in.phase_degree = phase_degree;
    in.stored_phase_degree = phase_degree;
    in.moments = moments.data();
    in.p = p.data();
    in.r = r.data();
    in.t = t.data();
    in.a1 = a1.data();
    in.b1 = b1.data();
    in.a2 = a2.data();
    in.a3 = a3.data();
  }
  std::vector<T> simd(
      in.nodes * (polarised ? 3 : 1) * static_cast<std::size_t>(in.degree + 1) * lanes, T(99));
  std::vector<T> scalar = simd;
  source_modes(in, simd.data());
  source_modes_scalar(in, scalar.data());
  expect_same(simd, scalar, 10 * kRounding<T>);
}

// Start points all over the Earth; a reference that is smooth, so that rounding of the Sun's zenith
// angle (a cosine in float has 3e-4 rad of it near 0 and 180 degrees) does no harm.
template <class T>
struct Gather {
  std::size_t pairs = 101, lanes;
  ZenithGrid grid{1.0};
  std::vector<T> cos_chi, sin_chi, cos_phi, sin_phi, modes, reference, scratch;
  GatherInput<T> in;

  Gather(std::size_t lane_count, bool polarised, int degree) : lanes(lane_count) {
    Random<T> random;
    std::uniform_real_distribution<double> unit(0, 1);
    const std::size_t padded = (pairs + 15) / 16 * 16;
    for (auto* v : {&cos_chi, &sin_chi, &cos_phi, &sin_phi}) v->assign(padded, T(0));
    for (std::size_t i = 0; i < pairs; ++i) {
      const double chi = i == 0 ? 0 : i == 1 ? pi : pi * unit(random.engine);
      const double phi = pi * unit(random.engine);
      cos_chi[i] = static_cast<T>(std::cos(chi));
      sin_chi[i] = static_cast<T>(std::sin(chi));
      cos_phi[i] = static_cast<T>(std::cos(phi));
      sin_phi[i] = static_cast<T>(std::sin(phi));
    }
    const std::size_t stokes = polarised ? 3 : 1,
                      row = static_cast<std::size_t>(degree + 1) * lanes;
    const auto amplitude = random.values(stokes * row), phase = random.values(stokes * row, 0, 6);
    for (std::size_t j = 0; j < grid.size(); ++j) {
      for (std::size_t k = 0; k < stokes * row; ++k) {
        const double chi = grid.zenith_rad()[j];
        modes.push_back(static_cast<T>(static_cast<double>(amplitude[k]) *
                                       std::cos(chi + static_cast<double>(phase[k]))));
      }
    }
    for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
      for (std::size_t w = 0; w < lanes; ++w) {
        reference.push_back(static_cast<T>(
            1 + 0.3 * std::cos(static_cast<double>(k) * 1e-3 + static_cast<double>(w))));
      }
    }
    scratch.assign(3 * padded, T(0));
    in.pairs = pairs;
    in.cos_chi = cos_chi.data();
    in.sin_chi = sin_chi.data();
    in.cos_phi = cos_phi.data();
    in.sin_phi = sin_phi.data();
    in.lanes = lanes;
    in.polarised = polarised;
    in.degree = degree;
    in.stored_degree = degree;
    in.nodes = grid.size();
    in.modes = modes.data();
    in.fine_position = grid.fine_position().data();
    in.fine_per_radian = static_cast<T>(180 / pi / ZenithGrid::kFineStep_deg);
    in.reference = reference.data();
    in.fine_end = ZenithGrid::kFineSize - 1;
    in.scratch = scratch.data();
  }
  void move(double psi) {
    in.cos_psi = static_cast<T>(std::cos(psi));
    in.sin_psi = static_cast<T>(std::sin(psi));
  }
};

template <class T>
void gather_modes_agree(const Case& c) {
  const auto [lanes, polarised, phase_degree] = c;
  Gather<T> gather(static_cast<std::size_t>(lanes), polarised, std::max(2, phase_degree));
  for (const double psi : {1e-3, 0.05, 0.3}) {
    gather.move(psi);
    std::vector<T> simd(gather.pairs * (polarised ? 3 : 1) * gather.lanes, T(0.25));
    std::vector<T> scalar = simd;
    gather_modes(gather.in, simd.data());
    gather_modes_scalar(gather.in, scalar.data());
    // The azimuth turns fast where the Sun is near the zenith: m / sin(chi) times rounding.
    expect_same(simd, scalar, sizeof(T) == 4 ? 1e-3 : 1e-7);
  }
}

// Single scattering of the beam by air and two kinds of aerosol.
template <class T>
void gather_beam_agrees(const Case& c) {
  const auto [lane_count, polarised, phase_degree] = c;
  const auto lanes = static_cast<std::size_t>(lane_count);
  Gather<T> gather(lanes, polarised, 2);
  Random<T> random;
  BeamInput<T> in;
  in.kinds = phase_degree > 0 ? 2 : 0;
  in.phase_nodes = 201;
  std::vector<T> cos_sun, sin_sun, phase;
  for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
    const double chi = static_cast<double>(k) * ZenithGrid::kFineStep_deg * pi / 180;
    const double apparent = chi - 0.01 * std::sin(chi);
    cos_sun.push_back(static_cast<T>(std::cos(apparent)));
    sin_sun.push_back(static_cast<T>(std::sin(apparent)));
  }
  const auto amplitude = random.values(2 * 2 * lanes);
  for (std::size_t q = 0; q < 2; ++q) {
    for (std::size_t k = 0; k < in.phase_nodes; ++k) {
      const double x = 2 * static_cast<double>(k) / static_cast<double>(in.phase_nodes - 1) - 1;
      for (std::size_t i = 0; i < 2 * lanes; ++i) {
        phase.push_back(static_cast<T>(static_cast<double>(amplitude[q * 2 * lanes + i]) *
                                       (i < lanes ? std::exp(x) : 1 - x * x)));
      }
    }
  }
  const auto air = random.values(lanes, 0, 1), share = random.values(lanes, 0.9, 1),
             kind_weight = random.values(2 * lanes, 0, 1);
  in.cos_theta = static_cast<T>(std::cos(1.9));
  in.sin_theta = static_cast<T>(std::sin(1.9));
  in.cos_sun = cos_sun.data();
  in.sin_sun = sin_sun.data();
  in.air_weight = air.data();
  in.anisotropic_share = share.data();
  in.kind_weight = kind_weight.data();
  in.phase = phase.data();
  for (const double psi : {1e-3, 0.05, 0.3}) {
    gather.move(psi);
    in.gather = gather.in;
    std::vector<T> simd(gather.pairs * (polarised ? 3 : 1) * lanes, T(0.25));
    std::vector<T> scalar = simd;
    gather_beam(in, simd.data());
    gather_beam_scalar(in, scalar.data());
    expect_same(simd, scalar, sizeof(T) == 4 ? 1e-3 : 1e-7);
  }
}

// Leaving modes out is the same as their being 0.
template <class T>
void fewer_modes_agree(const Case& c) {
  const auto [lanes, polarised, phase_degree] = c;
  if (phase_degree < 3) return;
  Gather<T> gather(static_cast<std::size_t>(lanes), polarised, phase_degree);
  gather.move(0.1);
  const int kept = phase_degree - 1;
  const std::size_t row = gather.lanes, stored = static_cast<std::size_t>(phase_degree) + 1;
  for (std::size_t k = 0; k < gather.modes.size(); ++k) {
    if (k / row % stored > static_cast<std::size_t>(kept)) gather.modes[k] = 0;
  }
  std::vector<T> all(gather.pairs * (polarised ? 3 : 1) * gather.lanes, T(0)), some = all;
  gather_modes(gather.in, all.data());
  gather.in.degree = kept;
  gather_modes(gather.in, some.data());
  expect_same(some, all, 10 * kRounding<T>);
}

// Moments above the degree that scatters are stored but not looked at.
template <class T>
void moments_above_the_degree_are_skipped(const Case& c) {
  const auto [lane_count, polarised, phase_degree] = c;
  if (phase_degree < 3) return;
  const auto lanes = static_cast<std::size_t>(lane_count);
  Random<T> random;
  SourceModesInput<T> in;
  in.nodes = 4;
  in.lanes = lanes;
  in.polarised = polarised;
  in.cos_theta = static_cast<T>(std::cos(2.0));
  in.sin_theta = static_cast<T>(std::sin(2.0));
  const std::size_t stored = moment_count(phase_degree), used = moment_count(phase_degree - 1);
  const auto coherency = random.values(in.nodes * 4 * lanes), air = random.values(lanes, 0, 1);
  const auto p = random.values(stored), r = random.values(stored), t = random.values(stored);
  const std::size_t rows = static_cast<std::size_t>(phase_degree) + 1, fields = polarised ? 3 : 1;
  const auto a1 = random.values(rows * lanes), b1 = random.values(rows * lanes),
             a2 = random.values(rows * lanes), a3 = random.values(rows * lanes);
  const auto all = random.values(in.nodes * fields * stored * lanes);
  std::vector<T> few;
  for (std::size_t block = 0; block < in.nodes * fields; ++block) {
    const auto from = all.begin() + static_cast<std::ptrdiff_t>(block * stored * lanes);
    few.insert(few.end(), from, from + static_cast<std::ptrdiff_t>(used * lanes));
  }
  in.coherency = coherency.data();
  in.air_weight = air.data();
  in.p = p.data();
  in.r = r.data();
  in.t = t.data();
  in.a1 = a1.data();
  in.b1 = b1.data();
  in.a2 = a2.data();
  in.a3 = a3.data();
  in.degree = in.phase_degree = phase_degree - 1;
  std::vector<T> long_rows(in.nodes * fields * static_cast<std::size_t>(in.degree + 1) * lanes);
  std::vector<T> short_rows = long_rows, scalar = long_rows;
  in.moments = all.data();
  in.stored_phase_degree = phase_degree;
  source_modes(in, long_rows.data());
  source_modes_scalar(in, scalar.data());
  in.moments = few.data();
  in.stored_phase_degree = phase_degree - 1;
  source_modes(in, short_rows.data());
  EXPECT_EQ(long_rows, short_rows);
  expect_same(scalar, short_rows, 10 * kRounding<T>);
}

template <class T>
void significant_degree_finds_the_last_mode(const Case& c) {
  const auto [lane_count, polarised, phase_degree] = c;
  const auto lanes = static_cast<std::size_t>(lane_count);
  SourceModesInput<T> in;
  in.nodes = 5;
  in.lanes = lanes;
  in.polarised = polarised;
  in.degree = std::max(2, phase_degree);
  in.phase_degree = phase_degree;
  const std::size_t rows = static_cast<std::size_t>(in.degree) + 1, stokes = polarised ? 3 : 1;
  for (std::size_t last = 0; last < rows; ++last) {
    std::vector<T> modes(in.nodes * stokes * rows * lanes, T(0));
    for (std::size_t j = 0; j < in.nodes; ++j) {
      for (std::size_t w = 0; w < lanes; ++w) modes[j * stokes * rows * lanes + w] = T(2);
    }
    // One node, one lane, the last of the Stokes parameters.
    modes[((3 * stokes + stokes - 1) * rows + last) * lanes + lanes - 1] = T(0.5);
    EXPECT_EQ(significant_degree(in, modes.data(), T(0.1)),
              std::max<int>(2, static_cast<int>(last)))
        << "last mode " << last;
    EXPECT_EQ(significant_degree(in, modes.data(), T(0.3)), 2) << "last mode " << last;
  }
}

template <class T>
void gather_ground_is_its_definition(const Case& c) {
  const auto lanes = static_cast<std::size_t>(std::get<0>(c));
  Gather<T> gather(lanes, false, 2);
  gather.move(0.1);
  Random<T> random;
  const auto weight = random.values(lanes);
  const std::size_t stride = 3 * lanes;
  std::vector<T> got(gather.pairs * stride, T(0.5)), want = got;
  gather_ground(gather.in, weight.data(), stride, got.data());
  for (std::size_t i = 0; i < gather.pairs; ++i) {
    const double x = static_cast<double>(gather.cos_chi[i]) * std::cos(0.1) +
                     static_cast<double>(gather.sin_chi[i]) * std::sin(0.1) *
                         static_cast<double>(gather.cos_phi[i]);
    const double fine = std::acos(std::clamp(x, -1.0, 1.0)) * 180 / pi / ZenithGrid::kFineStep_deg;
    for (std::size_t w = 0; w < lanes; ++w) {
      const double value = 1 + 0.3 * std::cos(fine * 1e-3 + static_cast<double>(w));
      want[i * stride + w] += static_cast<T>(static_cast<double>(weight[w]) * value);
    }
  }
  expect_same(got, want, sizeof(T) == 4 ? 2e-4 : 1e-6);
}

template <class T>
void add_moments_agree(const Case& c) {
  const auto [lane_count, polarised, phase_degree] = c;
  const auto lanes = static_cast<std::size_t>(lane_count);
  Random<T> random;
  MomentInput<T> in;
  in.nodes = 5;
  in.azimuths = 9;
  in.lanes = lanes;
  in.polarised = polarised;
  in.cos_theta = static_cast<T>(std::cos(1.3));
  in.sin_theta = static_cast<T>(std::sin(1.3));
  in.weight = T(0.37);
  std::vector<T> cosine, sine;
  for (std::size_t q = 0; q < in.azimuths; ++q) {
    const double phi = pi * (static_cast<double>(q) + 0.5) / static_cast<double>(in.azimuths);
    cosine.push_back(static_cast<T>(std::cos(phi)));
    sine.push_back(static_cast<T>(std::sin(phi)));
  }
  in.cos_phi = cosine.data();
  in.sin_phi = sine.data();
  const std::size_t stokes = polarised ? 3 : 1, count = moment_count(phase_degree);
  const auto light = random.values(in.nodes * in.azimuths * stokes * lanes);
  in.light = light.data();
  const auto p = random.values(count), r = random.values(count), t = random.values(count);
  std::vector<T> scratch(3 * static_cast<std::size_t>(phase_degree + 1) * lanes);
  in.scratch = scratch.data();
  in.phase_degree = phase_degree;
  in.p = p.data();
  in.r = r.data();
  in.t = t.data();
  auto coherency = random.values(in.nodes * 4 * lanes);
  auto moments = random.values(in.nodes * stokes * count * lanes);
  auto coherency_scalar = coherency, moments_scalar = moments;
  add_moments(in, coherency.data(), phase_degree > 0 ? moments.data() : nullptr);
  add_moments_scalar(in, coherency_scalar.data(),
                     phase_degree > 0 ? moments_scalar.data() : nullptr);
  expect_same(coherency, coherency_scalar, 10 * kRounding<T>);
  expect_same(moments, moments_scalar, 10 * kRounding<T>);
}

class OrdersKernels : public testing::TestWithParam<Case> {};

TEST_P(OrdersKernels, SourceModesAreTheScalarOnes) {
  source_modes_agree<float>(GetParam());
  source_modes_agree<double>(GetParam());
}

TEST_P(OrdersKernels, GatherModesIsTheScalarOne) {
  gather_modes_agree<float>(GetParam());
  gather_modes_agree<double>(GetParam());
}

TEST_P(OrdersKernels, GatherBeamIsTheScalarOne) {
  gather_beam_agrees<float>(GetParam());
  gather_beam_agrees<double>(GetParam());
}

TEST_P(OrdersKernels, ModesLeftOutAreZeros) {
  fewer_modes_agree<float>(GetParam());
  fewer_modes_agree<double>(GetParam());
}

TEST_P(OrdersKernels, MomentsAboveTheDegreeAreSkipped) {
  moments_above_the_degree_are_skipped<float>(GetParam());
  moments_above_the_degree_are_skipped<double>(GetParam());
}

TEST_P(OrdersKernels, SignificantDegreeFindsTheLastMode) {
  significant_degree_finds_the_last_mode<float>(GetParam());
  significant_degree_finds_the_last_mode<double>(GetParam());
}

TEST_P(OrdersKernels, GatherGroundIsItsDefinition) {
  gather_ground_is_its_definition<float>(GetParam());
  gather_ground_is_its_definition<double>(GetParam());
}

TEST_P(OrdersKernels, AddMomentsIsTheScalarOne) {
  add_moments_agree<float>(GetParam());
  add_moments_agree<double>(GetParam());
}

INSTANTIATE_TEST_SUITE_P(LanesPolarisationAerosol, OrdersKernels,
                         testing::Combine(testing::Values(8, 16, 32), testing::Bool(),
                                          testing::Values(0, 2, 3, 8)));

// What lies beyond fine_end is dark, to the last of the fine points before it.
TEST(OrdersKernels, NothingComesFromBeyondTheShadow) {
  Gather<double> gather(8, true, 2);
  gather.move(0.02);
  gather.in.fine_end = 1900;
  std::vector<double> out(gather.pairs * 24, 0.0), ground(gather.pairs * 8, 0.0);
  const std::vector<double> weight(8, 1.0);
  gather_modes(gather.in, out.data());
  gather_ground(gather.in, weight.data(), 8, ground.data());
  for (std::size_t i = 0; i < gather.pairs; ++i) {
    const double x =
        gather.cos_chi[i] * std::cos(0.02) + gather.sin_chi[i] * std::sin(0.02) * gather.cos_phi[i];
    const bool dark = std::acos(std::clamp(x, -1.0, 1.0)) * 180 / pi >= 95;
    EXPECT_EQ(out[i * 24] == 0, dark);
    EXPECT_EQ(ground[i * 8] == 0, dark);
  }
}

}  // namespace
}  // namespace twilight
