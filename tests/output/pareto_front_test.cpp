#include "output/pareto_front.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace twilight {
namespace {

bool dominates(const CostAndError& a, const CostAndError& b) {
  return a.cost <= b.cost && a.error <= b.error && (a.cost < b.cost || a.error < b.error);
}

TEST(ParetoFront, IsExactlyWhatNothingDominates) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> value(0, 30);  // coarse, so that points coincide
  for (int round = 0; round < 50; ++round) {
    std::vector<CostAndError> points;
    for (int k = 0; k < 60; ++k) {
      points.push_back({static_cast<double>(value(random)), static_cast<double>(value(random))});
    }
    const std::vector<std::size_t> front = pareto_front(points);
    for (std::size_t k = 1; k < front.size(); ++k) {
      EXPECT_LT(points[front[k - 1]].cost, points[front[k]].cost);
      EXPECT_GT(points[front[k - 1]].error, points[front[k]].error);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool on_it = std::ranges::find(front, i) != front.end();
      bool dominated = false, twin_on_it = false;
      for (std::size_t j = 0; j < points.size(); ++j) {
        dominated = dominated || dominates(points[j], points[i]);
        twin_on_it = twin_on_it || (j != i && points[j].cost == points[i].cost &&
                                    points[j].error == points[i].error &&
                                    std::ranges::find(front, j) != front.end());
      }
      EXPECT_EQ(on_it || twin_on_it, !dominated);
    }
  }
}

TEST(ParetoFront, LeavesOutWhatIsNotFinite) {
  const double none = std::numeric_limits<double>::infinity();
  EXPECT_EQ(pareto_front({{1, none}, {2, 3}, {none, 0}}), (std::vector<std::size_t>{1}));
  EXPECT_TRUE(pareto_front({}).empty());
}

}  // namespace
}  // namespace twilight
