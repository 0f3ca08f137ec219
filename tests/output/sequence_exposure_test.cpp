#include "output/sequence_exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace twilight {
namespace {

std::vector<double> values_of(std::size_t count, double (*law)(double)) {
  std::vector<double> values;
  for (std::size_t k = 0; k < count; ++k) values.push_back(law(static_cast<double>(k)));
  return values;
}

double largest_second_difference(const std::vector<double>& v) {
  double largest = 0.0;
  for (std::size_t k = 1; k + 1 < v.size(); ++k) {
    largest = std::max(largest, std::abs(v[k - 1] - 2.0 * v[k] + v[k + 1]));
  }
  return largest;
}

std::vector<std::optional<ToneExposure>> exposures_of(const std::vector<double>& log_grey) {
  std::vector<std::optional<ToneExposure>> own;
  for (const double g : log_grey) own.push_back(ToneExposure{std::exp(g), 4.0 * std::exp(g)});
  return own;
}

TEST(SequenceExposure, ConstantsAndStraightLinesStay) {
  for (const std::size_t count : {1u, 2u, 5u, 24u, 300u}) {
    const double sigma = exposure_kernel_frames(count);
    const auto flat = values_of(count, [](double) { return -3.5; });
    const auto line = values_of(count, [](double k) { return 7.0 - 0.25 * k; });
    const auto smooth_flat = smooth_over_frames(flat, sigma);
    const auto smooth_line = smooth_over_frames(line, sigma);
    for (std::size_t k = 0; k < count; ++k) {
      EXPECT_NEAR(smooth_flat[k], flat[k], 1e-12);
      // One frame has no line to go on with.
      EXPECT_NEAR(smooth_line[k], line[k], 1e-10) << count;
    }
  }
}

TEST(SequenceExposure, WhatFallsThroughoutFallsThroughout) {
  // A sunset's luminance: slow by day, steep in twilight, level at night; and a staircase.
  const auto dusk = values_of(48, [](double k) { return -14.0 / (1.0 + std::exp(-(k - 25) / 3)); });
  const auto stairs = values_of(48, [](double k) { return -std::floor(k / 12.0); });
  for (const auto& fall : {dusk, stairs}) {
    const auto smooth = smooth_over_frames(fall, 1.5);
    EXPECT_TRUE(std::ranges::is_sorted(smooth, [](double a, double b) { return a > b + 1e-12; }));
    EXPECT_NEAR(smooth.front(), fall.front(), 1e-3);
  }
}

// Against the bound that the header gives, for the worst of inputs: frames that alternate, a jump,
// and one that flashes.
TEST(SequenceExposure, SecondDifferencesAreBounded) {
  const std::vector<std::vector<double>> wild = {
      values_of(256, [](double k) { return std::fmod(k, 2.0); }),
      values_of(256, [](double k) { return k < 128 ? 0.0 : 1.0; }),
      values_of(256, [](double k) { return k == 100 ? 1.0 : 0.0; })};
  for (const auto& values : wild) {
    for (const double sigma : {2.0, 4.0, 8.0}) {
      // Values in 0..1, continued by reflection: -1..2 at most.
      constexpr double kHalfRange = 1.5;
      EXPECT_LE(largest_second_difference(smooth_over_frames(values, sigma)),
                0.97 / (sigma * sigma) * kHalfRange)
          << sigma;
    }
  }
  // Alternating frames, the flicker itself, are damped as the Gaussian's transform says:
  // exp(-pi^2 sigma^2/2) of their half range, 2.7e-9 for sigma = 2 (cut off: 1e-4 at most).
  const auto still = smooth_over_frames(wild[0], 2.0);
  for (std::size_t k = 20; k < 236; ++k) EXPECT_NEAR(still[k], 0.5, 1e-4);
}

TEST(SequenceExposure, FollowsASkyThatDarkensAndKeepsItsFactor) {
  const auto fall = values_of(32, [](double k) { return -0.2 * k; });
  auto own = exposures_of(fall);
  const auto followed = follow_exposures(own);
  for (std::size_t k = 0; k < own.size(); ++k) {
    EXPECT_NEAR(followed[k].grey, own[k]->grey, 1e-9 * own[k]->grey);
    EXPECT_NEAR(followed[k].white, own[k]->white, 1e-9 * own[k]->white);
  }
  // k times the light: k times the exposure.
  for (auto& exposure : own) exposure = ToneExposure{3 * exposure->grey, 3 * exposure->white};
  const auto brighter = follow_exposures(own);
  for (std::size_t k = 0; k < own.size(); ++k) {
    EXPECT_NEAR(brighter[k].grey / followed[k].grey, 3.0, 1e-9);
  }
}

TEST(SequenceExposure, DarkFramesTakeTheNearest) {
  const auto own = exposures_of({0.0, 0.0, 0.0, 0.0});
  auto dark = own;
  dark[0].reset();
  dark[2].reset();
  const auto whole = follow_exposures(own), holes = follow_exposures(dark);
  for (std::size_t k = 0; k < own.size(); ++k) EXPECT_EQ(holes[k].grey, whole[k].grey);
  const std::vector<std::optional<ToneExposure>> night(3);
  for (const ToneExposure& exposure : follow_exposures(night)) EXPECT_EQ(exposure.grey, 1.0);
}

// ISO 2720: at ISO 100 a luminance of K/100 2^EV, with K = 12.5: EV 15 is 4096 cd/m^2.
TEST(SequenceExposure, AnExposureValueIsItsLuminance) {
  const auto own = exposures_of({0.0, 1.0});
  const auto fixed = fixed_exposures(own, 15.0, 683.0);
  ASSERT_EQ(fixed.size(), 2u);
  EXPECT_NEAR(fixed[0].grey * 683.0, 4096.0, 1e-9);
  EXPECT_EQ(fixed[0].grey, fixed[1].grey);
  EXPECT_EQ(fixed[0].white, fixed[1].white);
  EXPECT_GE(fixed[0].white, own[1]->white);
  EXPECT_THROW(smooth_over_frames({}, 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
