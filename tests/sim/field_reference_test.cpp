#include "sim/field_reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/aerosol_emission.h"
#include "sim/angular_moments.h"
#include "sim/emission_kernel.h"

namespace twilight {
namespace {

// A cubic in the grid's coordinate is what cubic interpolation returns.
TEST(FieldReference, LogarithmIsInterpolatedCubically) {
  const ZenithGrid grid(2.0);
  const auto law = [&](double t) {
    const double x = t / static_cast<double>(grid.size());
    return std::exp(-3 + 4 * x - 20 * x * x + 5 * x * x * x);
  };
  std::vector<double> nodes(2 * grid.size(), 0.0);
  for (std::size_t j = 0; j < grid.size(); ++j) nodes[2 * j] = law(static_cast<double>(j));
  constexpr std::size_t kFirst = 100, kCount = 3000, kLanes = 8;
  std::vector<double> fine(kCount * kLanes, -1.0);
  refine_trace(grid, nodes, 2, kLanes, kFirst, kCount, fine.data());
  for (std::size_t k = 0; k < kCount; k += 7) {
    const double wanted = law(static_cast<double>(grid.fine_position()[kFirst + k]));
    EXPECT_NEAR(fine[k * kLanes] / wanted, 1, 1e-5) << k;
    EXPECT_EQ(fine[k * kLanes + 1], 0);   // dark
    EXPECT_EQ(fine[k * kLanes + 2], -1);  // not asked for
  }
}

// Scattering air sees a tensor of unit trace, all alike from every side where it depolarises fully.
TEST(FieldReference, TensorsAreRelativeToTheirTrace) {
  const std::vector<float> coherency = {1, 2, 3, 4, 5, 6, 0.5F, -0.25F};  // [4][2 lanes]
  const std::vector<float> moment = {12, 24, 6, 3};                       // [2][2 lanes]
  const std::vector<double> share = {1.0, 0.0};
  std::vector<float> relative(4 * 8, 0.0F), moments(2 * 8, 0.0F);
  std::vector<double> trace(2);
  LevelLight<float, float> level;
  level.nodes = 1;
  level.moments = 2;
  level.in_lanes = 2;
  level.out_lanes = 8;
  level.coherency = coherency.data();
  level.moment = moment.data();
  level.anisotropic_share = share.data();
  level.relative_coherency = relative.data();
  level.relative_moment = moments.data();
  level.trace = trace.data();
  divide_by_trace(level);
  EXPECT_EQ(trace, (std::vector<double>{9, 12}));
  const float first[4] = {1.0F / 9, 3.0F / 9, 5.0F / 9, 0.5F / 9};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_FLOAT_EQ(relative[8 * k], first[k]);
    EXPECT_FLOAT_EQ(relative[8 * k + 1], k < 3 ? 1.0F / 3 : 0.0F);
  }
  EXPECT_FLOAT_EQ(moments[0], 12.0F / 9);
  EXPECT_FLOAT_EQ(moments[1], 2.0F);
  EXPECT_FLOAT_EQ(moments[8], 6.0F / 9);
}

// An impossible tensor, and night, are dark.
TEST(FieldReference, DarkTensorsStayZero) {
  const std::vector<double> coherency = {-1, 0, 3, 0, 5, 1e-31, 0, 0};
  const std::vector<double> share = {1.0, 1.0};
  std::vector<double> relative(8, 0.0), trace(2, -1.0);
  LevelLight<double, double> level;
  level.nodes = 1;
  level.in_lanes = level.out_lanes = 2;
  level.coherency = coherency.data();
  level.anisotropic_share = share.data();
  level.relative_coherency = relative.data();
  level.trace = trace.data();
  divide_by_trace(level);
  EXPECT_EQ(trace, std::vector<double>(2, 0.0));
  EXPECT_EQ(relative, std::vector<double>(8, 0.0));
}

// Siewert's diagonal in (l, m), over the trace, in the order of the emission kernels.
TEST(AerosolEmission, MomentsAreScatteredByExpansionCoefficients) {
  constexpr int kDegree = 2, kStored = 3;
  constexpr std::size_t kLanes = 2;
  TruncatedPhase kind;
  for (int l = 0; l <= kStored; ++l) {
    for (std::size_t w = 0; w < kLanes; ++w) {
      const double x = l + 10.0 * static_cast<double>(w);
      kind.a1.push_back(1 + x);
      kind.a2.push_back(2 + x);
      kind.a3.push_back(3 + x);
      kind.b1.push_back(4 + x);
    }
  }
  std::vector<double> moments;
  for (std::size_t i = 0; i < 3 * moment_count(kStored) * kLanes; ++i) {
    moments.push_back(0.1 * static_cast<double>(i));
  }
  const std::vector<double> trace = {2.0, 0.0};
  ArrivingMoments<double> arriving{1, kLanes, true, kStored, moments.data(), trace.data()};
  std::vector<double> scattered(3 * moment_count(kDegree) * kLanes, -7.0);
  scatter_moments(arriving, kind, kDegree, scattered.data());
  const std::size_t from = moment_index(2, 1), to = mode_major_index(kDegree, 2, 1);
  const auto moment = [&](std::size_t field) {
    return moments[(field * moment_count(kStored) + from) * kLanes] / 2;
  };
  EXPECT_DOUBLE_EQ(scattered[to * 3 * kLanes], 3 * moment(0) + 6 * moment(1));
  EXPECT_DOUBLE_EQ(scattered[(to * 3 + 1) * kLanes], 6 * moment(0) + 4 * moment(1));
  EXPECT_DOUBLE_EQ(scattered[(to * 3 + 2) * kLanes], 5 * moment(2));
  EXPECT_EQ(scattered[to * 3 * kLanes + 1], -7.0) << "night is left alone";
}

TEST(AerosolEmission, BasisCountsBothSignsOfAMode) {
  std::vector<double> emitted, arriving;
  fill_mode_basis(3, 0.7, true, emitted);
  fill_mode_basis(3, 0.7, false, arriving);
  const AngularBasis basis = angular_basis(3, 0.7);
  const std::size_t mean = 3 * mode_major_index(3, 3, 0), wave = 3 * mode_major_index(3, 3, 2);
  EXPECT_DOUBLE_EQ(arriving[mean], basis.p[moment_index(3, 0)]);
  EXPECT_DOUBLE_EQ(arriving[wave + 1], basis.r[moment_index(3, 2)]);
  EXPECT_DOUBLE_EQ(emitted[mean], basis.p[moment_index(3, 0)] / (4 * std::numbers::pi));
  EXPECT_DOUBLE_EQ(emitted[wave + 2], basis.t[moment_index(3, 2)] / (2 * std::numbers::pi));
}

}  // namespace
}  // namespace twilight
