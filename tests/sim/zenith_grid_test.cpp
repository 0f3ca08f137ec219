#include "sim/zenith_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace twilight {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(ZenithGrid, RisesFromExactly0ToExactlyPi) {
  for (const double step : {0.05, 0.1, 0.5, 1.0, 2.0, 5.0}) {
    const ZenithGrid grid(step);
    EXPECT_EQ(grid.zenith_rad().front(), 0.0);
    EXPECT_EQ(grid.zenith_rad().back(), std::numbers::pi);
    for (std::size_t j = 1; j < grid.size(); ++j) {
      EXPECT_GT(grid.zenith_rad()[j], grid.zenith_rad()[j - 1]);
    }
  }
}

TEST(ZenithGrid, FineAboutTheTerminatorNeverCoarserThanAsked) {
  for (const double step : {0.1, 0.25, 0.5, 1.0, 2.0}) {
    for (const double coarse : {2.0, 4.0}) {
      const ZenithGrid grid(step, coarse);
      for (std::size_t j = 1; j < grid.size(); ++j) {
        const double from = grid.zenith_rad()[j - 1] / kDegree, to = grid.zenith_rad()[j] / kDegree;
        EXPECT_LE(to - from, coarse * (1 + 1e-9));
        if (from > 80 && to < 112) {
          EXPECT_LE(to - from, 1.1 * step);
          EXPECT_GE(to - from, 0.95 * step);
        }
      }
    }
  }
  // A step beyond the coarse one takes its place.
  const ZenithGrid even(5, 1);
  EXPECT_EQ(even.size(), 37U);
}

TEST(ZenithGrid, PositionInvertsTheNodes) {
  for (const double step : {0.1, 0.5, 3.0}) {
    const ZenithGrid grid(step);
    for (std::size_t j = 0; j < grid.size(); ++j) {
      EXPECT_NEAR(grid.position(grid.zenith_rad()[j]), static_cast<double>(j), 1e-9);
    }
    EXPECT_EQ(grid.position(-0.1), 0);
    EXPECT_NEAR(grid.position(4), static_cast<double>(grid.size()) - 1, 1e-9);
  }
}

TEST(ZenithGrid, FineScaleHoldsThePositions) {
  const ZenithGrid grid(0.5);
  ASSERT_EQ(grid.fine_position().size(), ZenithGrid::kFineSize);
  for (std::size_t k = 0; k < ZenithGrid::kFineSize; ++k) {
    const double chi = static_cast<double>(k) * ZenithGrid::kFineStep_deg * kDegree;
    EXPECT_NEAR(static_cast<double>(grid.fine_position()[k]), grid.position(chi), 1e-5);
  }
}

// Cubic Lagrange interpolation is exact for cubics, at the ends too, and clamps beyond them.
TEST(ZenithGrid, StencilsReproduceCubics) {
  constexpr std::size_t kSize = 40;
  const auto cubic = [](double t) { return 2 - t + 0.3 * t * t - 0.01 * t * t * t; };
  for (double t = -1; t <= 40; t += 0.0625) {
    const auto s = ZenithGrid::stencil(t, kSize);
    ASSERT_LE(s.first + 3, kSize - 1);
    double sum = 0, one = 0;
    for (std::size_t q = 0; q < 4; ++q) {
      sum += s.weight[q] * cubic(static_cast<double>(s.first + q));
      one += s.weight[q];
    }
    EXPECT_NEAR(one, 1, 1e-13);
    EXPECT_NEAR(sum, cubic(std::clamp(t, 0.0, 39.0)), 1e-10) << t;
  }
}

// Interpolation of the light's fall, a factor of ten in 1.8 degrees, in its logarithm and without:
// errors shrink with the fourth power of the step.
TEST(ZenithGrid, InterpolationIsOfFourthOrder) {
  const auto worst = [](double step) {
    const ZenithGrid grid(step);
    double error = 0;
    for (double chi = 92; chi < 104; chi += 0.013) {
      const auto value = [](double x_rad) { return std::pow(10, -(x_rad / kDegree - 92) / 1.8); };
      const auto s = ZenithGrid::stencil(grid.position(chi * kDegree), grid.size());
      double sum = 0;
      for (std::size_t q = 0; q < 4; ++q) {
        sum += s.weight[q] * value(grid.zenith_rad()[s.first + q]);
      }
      error = std::max(error, std::abs(sum / value(chi * kDegree) - 1));
    }
    return error;
  };
  EXPECT_NEAR(std::log2(worst(1) / worst(0.5)), 4, 0.4);
  EXPECT_NEAR(std::log2(worst(0.5) / worst(0.25)), 4, 0.4);
}

TEST(ZenithGrid, StepsOutOfRangeThrow) {
  for (const double step : {0.0, 0.049, 5.1, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(ZenithGrid grid(step), std::invalid_argument);
  }
}

}  // namespace
}  // namespace twilight
