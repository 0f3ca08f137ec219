#include "sim/field_reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "sim/aerosol_emission.h"
#include "sim/angular_moments.h"

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

TEST(AerosolEmission, CoefficientsAreWeightedSums) {
  constexpr int kDegree = 3;
  constexpr std::size_t kLanes = 2, kSize = (kDegree + 1) * kLanes;
  std::vector<TruncatedPhase> kinds(2);
  for (std::size_t q = 0; q < 2; ++q) {
    const double x = static_cast<double>(q);
    kinds[q] = {std::vector<double>(kSize, 1 + x), std::vector<double>(kSize, 2 + x),
                std::vector<double>(kSize, 3 + x), std::vector<double>(kSize, 4 + x),
                std::vector<double>(kLanes, 0.0)};
  }
  AerosolEmission<float> emission(kinds, kDegree, kLanes);
  const std::vector<double> none(4, 0.0), some = {0.5, 0, 0.25, 1};
  EXPECT_FALSE(emission.weigh(none.data()));
  ASSERT_TRUE(emission.weigh(some.data()));
  SourceModesInput<float> in;
  const float moment = 0;
  emission.emit(0.7, 1, &moment, in);
  EXPECT_EQ(in.degree, 2);
  EXPECT_EQ(in.phase_degree, 1);
  EXPECT_EQ(in.stored_phase_degree, kDegree);
  for (std::size_t l = 0; l <= kDegree; ++l) {
    EXPECT_FLOAT_EQ(in.a1[l * kLanes], 0.5F * 1 + 0.25F * 2);
    EXPECT_FLOAT_EQ(in.a3[l * kLanes + 1], 1.0F * 5);
  }
  const AngularBasis basis = angular_basis(kDegree, 0.7);
  EXPECT_FLOAT_EQ(in.p[moment_index(3, 0)],
                  static_cast<float>(basis.p[moment_index(3, 0)] / (4 * std::numbers::pi)));
  EXPECT_FLOAT_EQ(in.r[moment_index(3, 2)],
                  static_cast<float>(basis.r[moment_index(3, 2)] / (2 * std::numbers::pi)));
}

}  // namespace
}  // namespace twilight
