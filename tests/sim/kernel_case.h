// Random inputs of the kernels, and comparison with their scalar twins.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <tuple>
#include <vector>

namespace twilight {

// lanes, polarised, degree of the aerosol (0: none)
using KernelCase = std::tuple<int, bool, int>;

inline auto kernel_cases() {
  return testing::Combine(testing::Values(8, 16, 32), testing::Bool(), testing::Values(0, 2, 3, 8));
}

template <class T>
struct RandomValues {
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

}  // namespace twilight
