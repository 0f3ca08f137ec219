#include "sim/gauss_legendre.h"

#include <gtest/gtest.h>

#include <cmath>

namespace twilight {
namespace {

TEST(GaussLegendre, ExactToDegree2nMinus1AndNoFurther) {
  for (const int n : {1, 2, 3, 5, 8, 24, 64, 101}) {
    const auto nodes = gauss_legendre(n, -1, 1);
    ASSERT_EQ(nodes.size(), static_cast<std::size_t>(n));
    // Legendre polynomials integrate to 0 but for the first.
    for (int l = 0; l <= 2 * n; ++l) {
      double sum = 0;
      for (const GaussNode& g : nodes) {
        sum += g.weight * std::legendre(static_cast<unsigned>(l), g.x);
      }
      if (l < 2 * n) {
        EXPECT_NEAR(sum, l == 0 ? 2 : 0, 2e-13) << n << " " << l;
      } else {
        EXPECT_GT(std::abs(sum), 1e-3 / n) << n;
      }
    }
  }
}

TEST(GaussLegendre, NodesRiseInsideTheIntervalAndWeightsSumToIt) {
  for (int n = 1; n <= 80; ++n) {
    const auto nodes = gauss_legendre(n, 2, 5);
    double sum = 0, before = 2;
    for (const GaussNode& g : nodes) {
      EXPECT_GT(g.x, before);
      EXPECT_GT(g.weight, 0);
      before = g.x;
      sum += g.weight;
    }
    EXPECT_LT(before, 5);
    EXPECT_NEAR(sum, 3, 1e-12);
  }
}

// Textbook nodes: n = 2, +-1/sqrt 3; n = 3, 0 and +-sqrt(3/5) with 8/9 and 5/9.
TEST(GaussLegendre, TextbookRules) {
  const auto two = gauss_legendre(2, -1, 1), three = gauss_legendre(3, -1, 1);
  EXPECT_NEAR(two[1].x, 1 / std::sqrt(3.0), 1e-15);
  EXPECT_NEAR(two[1].weight, 1, 1e-14);
  EXPECT_NEAR(three[0].x, -std::sqrt(0.6), 1e-15);
  EXPECT_NEAR(three[1].x, 0, 1e-15);
  EXPECT_NEAR(three[0].weight, 5.0 / 9, 1e-14);
  EXPECT_NEAR(three[1].weight, 8.0 / 9, 1e-15);
}

}  // namespace
}  // namespace twilight
