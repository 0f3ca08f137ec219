#include "sim/sun_disc_profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <vector>

#include "sim/gauss_legendre.h"
#include "sim/zenith_grid.h"
#include "solar/limb_darkening.h"

namespace twilight {
namespace {

using std::numbers::pi;

constexpr std::size_t kLanes = 8;
const std::vector<double> kWavelength_nm = {400, 700};

double radius_deg() { return kSunAngularRadiusRad * 180 / pi; }

// Mean of f(offset across the disc, deg) over the disc in polar coordinates.
double mean_over_disc(double wavelength_nm, const std::function<double(double)>& f) {
  const LimbDarkening limb(wavelength_nm);
  double sum = 0;
  for (const GaussNode& g : gauss_legendre(24, 0, 1)) {  // g.x: mu; rho drho = -mu dmu
    const double rho = std::sqrt(1 - g.x * g.x);
    constexpr int kAround = 48;
    for (int k = 0; k < kAround; ++k) {
      const double phi = 2 * pi * (k + 0.5) / kAround;
      sum += 2 * g.weight * g.x * limb(g.x) / kAround * f(radius_deg() * rho * std::cos(phi));
    }
  }
  return sum;
}

// f given for a point Sun at every fine zenith angle (deg), averaged.
std::vector<float> averaged(const std::function<double(double)>& f,
                            std::size_t end = ZenithGrid::kFineSize, double au = 1) {
  std::vector<float> value(ZenithGrid::kFineSize * kLanes, 0.0F);
  for (std::size_t k = 0; k < end; ++k) {
    for (std::size_t w = 0; w < kWavelength_nm.size(); ++w) {
      value[k * kLanes + w] =
          static_cast<float>(f(static_cast<double>(k) * ZenithGrid::kFineStep_deg));
    }
  }
  DiscAverage(kWavelength_nm, au, kLanes)(end, value);
  return value;
}

TEST(SunDisc, StripsCarryTheDiscsLight) {
  for (const double nm : kWavelength_nm) {
    double sum = 0, square = 0, before = -1;
    for (const GaussNode& g : disc_strips(nm, 24)) {
      EXPECT_GT(g.x, before);
      EXPECT_GT(g.weight, 0);
      sum += g.weight;
      square += g.weight * g.x * g.x;
      before = g.x;
    }
    EXPECT_LT(before, 1);
    EXPECT_NEAR(sum, 1, 1e-12);
    const double want = mean_over_disc(nm, [](double x) { return x * x; });
    EXPECT_NEAR(square * radius_deg() * radius_deg() / want, 1, 1e-3);
  }
}

TEST(SunDisc, LeavesConstantsAndStraightLinesAlone) {
  const auto constant = averaged([](double) { return 0.7; });
  const auto line = averaged([](double x) { return 2 - 0.01 * x; });
  for (std::size_t k = 20; k < 3580; ++k) {
    const double x = static_cast<double>(k) * ZenithGrid::kFineStep_deg;
    for (std::size_t w = 0; w < kWavelength_nm.size(); ++w) {
      EXPECT_NEAR(static_cast<double>(constant[k * kLanes + w]), 0.7, 1e-6);
      EXPECT_NEAR(static_cast<double>(line[k * kLanes + w]), 2 - 0.01 * x, 2e-6);
    }
    for (std::size_t w = kWavelength_nm.size(); w < kLanes; ++w) {
      EXPECT_EQ(constant[k * kLanes + w], 0.0F);
    }
  }
  // Mirrored at both ends, a constant stays one there too.
  EXPECT_NEAR(static_cast<double>(constant[0]), 0.7, 1e-6);
  EXPECT_NEAR(static_cast<double>(constant[3600 * kLanes]), 0.7, 1e-6);
}

// A uniform disc's mean square of the offset is R^2/4; the darkened limb takes some of it away,
// more in the blue.
TEST(SunDisc, ParabolaGainsTheMeanSquareOfTheOffset) {
  const auto curve = averaged([](double x) { return (x - 90) * (x - 90); });
  const double uniform = radius_deg() * radius_deg() / 4;
  double before = 0;
  for (std::size_t w = 0; w < 2; ++w) {
    const double want = mean_over_disc(kWavelength_nm[w], [](double x) { return x * x; });
    const double got = static_cast<double>(curve[1800 * kLanes + w]);
    std::printf("mean square offset at %g nm: %.5f deg^2, integral %.5f, uniform %.5f\n",
                kWavelength_nm[w], got, want, uniform);
    EXPECT_NEAR(got / want, 1, 2e-3);
    EXPECT_LT(want, 0.96 * uniform);
    EXPECT_GT(want, 0.80 * uniform);
    EXPECT_GT(want, before);
    before = want;
  }
  // Further away, the disc is smaller.
  const auto far = averaged([](double x) { return (x - 90) * (x - 90); }, ZenithGrid::kFineSize, 2);
  EXPECT_NEAR(static_cast<double>(far[1800 * kLanes] / curve[1800 * kLanes]), 0.25, 0.01);
}

// The fall of twilight, a factor of ten in 1.8 degrees: about a percent brighter.
TEST(SunDisc, SteepFallIsBrightened) {
  const double slope = std::log(10.0) / 1.8;
  const auto fall = [&](double x) { return std::exp(-slope * (x - 96)); };
  const auto value = averaged(fall);
  for (std::size_t w = 0; w < 2; ++w) {
    const double want =
        mean_over_disc(kWavelength_nm[w], [&](double x) { return std::exp(-slope * x); });
    const std::size_t k = 1920;
    const double got = static_cast<double>(value[k * kLanes + w]) /
                       fall(static_cast<double>(k) * ZenithGrid::kFineStep_deg);
    std::printf("brightened at %g nm: %.5f, integral %.5f\n", kWavelength_nm[w], got, want);
    EXPECT_NEAR(got, want, 1e-4);
    EXPECT_GT(want, 1.008);
    EXPECT_LT(want, 1.016);
  }
}

// Light that ends at the shadow's rim ends a disc's radius later, and half of it is left there.
TEST(SunDisc, ShadowsRimBecomesAPenumbra) {
  const std::size_t end = 1900;
  const auto value = averaged([](double) { return 1.0; }, end);
  const auto at = [&](std::size_t k) { return static_cast<double>(value[k * kLanes]); };
  const auto steps = static_cast<std::size_t>(std::ceil(radius_deg() / ZenithGrid::kFineStep_deg));
  EXPECT_NEAR(at(end - steps - 2), 1, 1e-6);
  EXPECT_EQ(at(end + steps + 1), 0);
  EXPECT_NEAR(at(end - 1) + at(end), 1, 1e-5);
  for (std::size_t k = end - 10; k < end + 10; ++k) EXPECT_GE(at(k - 1), at(k) - 1e-6);
}

}  // namespace
}  // namespace twilight
