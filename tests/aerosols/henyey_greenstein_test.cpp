#include "aerosols/henyey_greenstein.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace twilight {
namespace {

// Midpoint rule in the scattering angle of p(theta) * weight over the sphere.
template <typename Weight>
double over_sphere(double asymmetry, Weight weight) {
  const int steps = 200000;
  const double step = std::numbers::pi / steps;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double theta = (i + 0.5) * step;
    const double cosine = std::cos(theta);
    sum += henyey_greenstein(cosine, asymmetry) * weight(cosine) * std::sin(theta);
  }
  return 2.0 * std::numbers::pi * step * sum;
}

constexpr double kAsymmetries[] = {-0.9, -0.3, 0.0, 0.2, 0.7, 0.85, 0.95};

TEST(HenyeyGreenstein, Normalized) {
  for (const double g : kAsymmetries) {
    EXPECT_NEAR(over_sphere(g, [](double) { return 1.0; }), 1.0, 1e-6) << g;
  }
}

TEST(HenyeyGreenstein, MeanCosineIsAsymmetry) {
  for (const double g : kAsymmetries) {
    EXPECT_NEAR(over_sphere(g, [](double cosine) { return cosine; }), g, 1e-6) << g;
  }
}

// The n-th Legendre moment of the function is g^n.
TEST(HenyeyGreenstein, SecondLegendreMomentIsAsymmetrySquared) {
  for (const double g : kAsymmetries) {
    EXPECT_NEAR(over_sphere(g, [](double c) { return 1.5 * c * c - 0.5; }), g * g, 1e-6) << g;
  }
}

TEST(HenyeyGreenstein, IsotropicWithoutAsymmetry) {
  for (const double cosine : {-1.0, 0.0, 0.4, 1.0}) {
    EXPECT_DOUBLE_EQ(henyey_greenstein(cosine, 0.0), 0.25 / std::numbers::pi);
  }
}

TEST(HenyeyGreenstein, ReversedAsymmetryReversesDirection) {
  for (const double cosine : {-1.0, -0.3, 0.0, 0.6, 1.0}) {
    EXPECT_DOUBLE_EQ(henyey_greenstein(cosine, 0.7), henyey_greenstein(-cosine, -0.7));
  }
}

}  // namespace
}  // namespace twilight
