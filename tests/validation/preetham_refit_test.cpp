// The refit of Preetham's experiment finds Preetham's model in skies that are it.
#include "tests/validation/preetham_refit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace twilight::validation {
namespace {

// Skies of the published model.
std::vector<RefitSky> published_skies() {
  std::vector<RefitSky> skies;
  for (const double turbidity : kRefitTurbidities) {
    for (const double sun : refit_suns_deg()) {
      const double theta = (90 - sun) * std::numbers::pi / 180;
      RefitSky s{turbidity, sun, {}};
      const PreethamZenith zenith = preetham_zenith(turbidity, theta);
      std::vector<double>* const channels[] = {&s.sky.luminance, &s.sky.x, &s.sky.y};
      const double at_zenith[] = {zenith.luminance_cd_m2, zenith.x, zenith.y};
      for (std::size_t c = 0; c < 3; ++c) {
        const PerezCoefficients k = at_turbidity(published_coefficients(c), turbidity);
        *channels[c] = form_over_views(k, theta);
        for (double& value : *channels[c]) value *= at_zenith[c] / perez(k, 1, theta);
      }
      skies.push_back(std::move(s));
    }
  }
  return skies;
}

TEST(PreethamRefit, HasTwelveSunsByDay) {
  const std::vector<double> suns = refit_suns_deg();
  EXPECT_EQ(suns.size(), 12u);
  EXPECT_EQ(suns.front(), 90);
  EXPECT_GT(suns.back(), 0);
}

TEST(PreethamRefit, FindsThePublishedModelInItsOwnSkies) {
  const std::vector<RefitSky> skies = published_skies();
  std::array<LinearCoefficients, 3> linear{};
  for (std::size_t c = 0; c < 3; ++c) {
    bool converged = false;
    linear[c] = fit_linear_in_turbidity(skies, c, converged);
    EXPECT_TRUE(converged);
    const LinearCoefficients known = published_coefficients(c);
    for (std::size_t i = 0; i < 5; ++i) {
      for (std::size_t j = 0; j < 2; ++j) EXPECT_NEAR(linear[c][i][j], known[i][j], 1e-4) << c << i;
    }
  }
  const ZenithFit zenith = fit_zenith(skies, linear);
  for (const double turbidity : {2.0, 4.5}) {
    for (const double theta : {0.1, 0.8, 1.5}) {
      const PreethamZenith known = preetham_zenith(turbidity, theta);
      EXPECT_NEAR(zenith_value(zenith, 0, turbidity, theta) / known.luminance_cd_m2, 1, 1e-4);
      EXPECT_NEAR(zenith_value(zenith, 1, turbidity, theta), known.x, 1e-4);
      EXPECT_NEAR(zenith_value(zenith, 2, turbidity, theta), known.y, 1e-4);
    }
  }
}

// A search that begins at the answer proves little: begin it elsewhere, with other skies.
TEST(PreethamRefit, FindsOtherCoefficientsToo) {
  std::vector<RefitSky> skies = published_skies();
  const LinearCoefficients other = {
      {{0.10, -1.20}, {-0.20, 0.10}, {0.5, 8.0}, {0.05, -3.0}, {-0.05, 0.6}}};
  for (RefitSky& s : skies) {
    s.sky.luminance = form_over_views(at_turbidity(other, s.turbidity),
                                      (90 - s.sun_elevation_deg) * std::numbers::pi / 180);
  }
  bool converged = false;
  const LinearCoefficients found = fit_linear_in_turbidity(skies, 0, converged);
  EXPECT_TRUE(converged);
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t j = 0; j < 2; ++j) EXPECT_NEAR(found[i][j], other[i][j], 1e-4) << i;
  }
}

}  // namespace
}  // namespace twilight::validation
