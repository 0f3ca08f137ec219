#include "atmosphere/layers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace twilight {
namespace {

void expect_rises(const std::vector<double>& h, double top_km, int layers) {
  ASSERT_EQ(h.size(), static_cast<std::size_t>(layers) + 1);
  EXPECT_EQ(h.front(), 0.0);
  EXPECT_EQ(h.back(), top_km);
  for (std::size_t i = 0; i + 1 < h.size(); ++i) ASSERT_LT(h[i], h[i + 1]);
}

// Haber et al. (2005), Sec. 4.1.2: each layer holds the same integral of exp(-h/8).
TEST(EqualAirMass, EachLayerHoldsTheSameAirForEveryNumberOfLayers) {
  const Profile profile = Profile::named("us_standard");
  for (const double top_km : {35.0, 100.0}) {
    for (int n = 1; n <= 500; ++n) {
      const auto h = layer_boundaries_km(profile, "equal-air-mass", top_km, n);
      expect_rises(h, top_km, n);
      const double share = -std::expm1(-top_km / 8.0) / n;
      for (std::size_t i = 0; i + 1 < h.size(); ++i) {
        const double air = std::exp(-h[i] / 8.0) - std::exp(-h[i + 1] / 8.0);
        ASSERT_NEAR(air / share, 1.0, 1e-10) << n << ' ' << i;
      }
    }
  }
}

TEST(EqualAirMass, FollowsTheRecursion) {
  const auto h = layer_boundaries_km(Profile::named("exponential"), "equal-air-mass", 35.0, 50);
  const double m = 8.0 * (1.0 - std::exp(-35.0 / 8.0)) / 50;
  for (std::size_t i = 0; i + 2 < h.size(); ++i) {
    EXPECT_NEAR(h[i + 1], -8.0 * std::log(std::exp(-h[i] / 8.0) - m / 8.0), 1e-10);
  }
}

TEST(EvenLayers, AreEven) {
  const auto h = layer_boundaries_km(Profile::named("us_standard"), "even", 50.0, 500);
  expect_rises(h, 50.0, 500);
  for (std::size_t i = 0; i + 1 < h.size(); ++i) EXPECT_NEAR(h[i + 1] - h[i], 0.1, 1e-12);
}

TEST(GradedLayers, ShareTheFourthRootOfDensity) {
  for (const auto name : {"us_standard", "subarctic_winter", "exponential"}) {
    const Profile profile = Profile::named(name);
    for (const int n : {1, 7, 100, 500}) {
      const auto h = layer_boundaries_km(profile, "graded", 100.0, n);
      expect_rises(h, 100.0, n);
      const double whole = profile.power_integral(&ProfileLevel::air_per_cm3, 0.25, 0.0, 100.0);
      for (std::size_t i = 0; i + 1 < h.size(); ++i) {
        EXPECT_NEAR(
            profile.power_integral(&ProfileLevel::air_per_cm3, 0.25, h[i], h[i + 1]) * n / whole,
            1.0, 1e-8);
      }
    }
  }
}

TEST(GradedLayers, GrowWithHeight) {
  const auto h = layer_boundaries_km(Profile::named("exponential"), "graded", 200.0, 300);
  for (std::size_t i = 0; i + 2 < h.size(); ++i) EXPECT_GT(h[i + 2] - h[i + 1], h[i + 1] - h[i]);
}

TEST(Snapping, PutsBoundariesWhereAsked) {
  const Profile profile = Profile::named("us_standard");
  const std::vector<double> wanted = {2.0, 12.0, 35.0};
  for (const char* spacing : {"graded", "even"}) {
    const auto h = layer_boundaries_km(profile, spacing, 100.0, 50, wanted);
    expect_rises(h, 100.0, 50);
    for (const double w : wanted) EXPECT_TRUE(std::find(h.begin(), h.end(), w) != h.end()) << w;
  }
}

TEST(Snapping, KeepsBoundariesRising) {
  const Profile profile = Profile::named("us_standard");
  // More heights than boundaries, outside the range, on the ends, equal.
  const std::vector<double> wanted = {0.0, 10.0, 10.0, 10.0001, 9.9999, 100.0, 101.0, -3.0, 1e9};
  for (const int n : {1, 2, 3, 10, 500}) {
    expect_rises(layer_boundaries_km(profile, "even", 100.0, n, wanted), 100.0, n);
    expect_rises(layer_boundaries_km(profile, "graded", 100.0, n, wanted), 100.0, n);
  }
}

TEST(Snapping, LeavesEqualAirMassAlone) {
  const Profile profile = Profile::named("us_standard");
  const std::vector<double> wanted = {2.0};
  EXPECT_EQ(layer_boundaries_km(profile, "equal-air-mass", 35.0, 20, wanted),
            layer_boundaries_km(profile, "equal-air-mass", 35.0, 20));
}

TEST(Layers, RejectWhatIsOutOfRange) {
  const Profile profile = Profile::named("us_standard");
  EXPECT_THROW(layer_boundaries_km(profile, "even", 100.0, 0), std::invalid_argument);
  EXPECT_THROW(layer_boundaries_km(profile, "even", 100.0, 501), std::invalid_argument);
  EXPECT_THROW(layer_boundaries_km(profile, "even", 0.5, 10), std::invalid_argument);
  EXPECT_THROW(layer_boundaries_km(profile, "even", 120.5, 10), std::invalid_argument);
  EXPECT_THROW(layer_boundaries_km(profile, "even", std::nan(""), 10), std::invalid_argument);
  EXPECT_THROW(layer_boundaries_km(profile, "odd", 100.0, 10), std::invalid_argument);
  const std::vector<double> bad = {std::numeric_limits<double>::infinity()};
  EXPECT_THROW(layer_boundaries_km(profile, "even", 100.0, 10, bad), std::invalid_argument);
  EXPECT_NO_THROW(layer_boundaries_km(Profile::named("exponential"), "even", 200.0, 10));
}

}  // namespace
}  // namespace twilight
