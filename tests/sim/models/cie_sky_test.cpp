// The CIE's clear and overcast skies (Preetham et al. 1999, Eq. 1 and 2).
#include "sim/models/cie_sky.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "output/colour_matching.h"
#include "sim/models/daylight_spectrum.h"
#include "sim/models/preetham_sky.h"
#include "tests/sim/small_scene.h"

namespace twilight {
namespace {

using std::numbers::pi;
using ::testing::HasSubstr;

constexpr double kRad = pi / 180;

std::unique_ptr<Sky> cie_sky(const char* method, double elevation_deg,
                             std::optional<double> zenith_cd_m2 = {}, bool clamp = false) {
  Scene scene = small_scene(elevation_deg);
  scene.solver.method = method;
  scene.preetham.turbidity = 3;
  scene.cie.zenith_luminance_cd_m2 = zenith_cd_m2;
  if (clamp) scene.models.out_of_range = "clamp";
  scene.spectrum.wavelengths_nm.clear();
  for (int nm = 380; nm <= 780; nm += 10) scene.spectrum.wavelengths_nm.push_back(nm);
  return solve_sky(build_scene_model(scene));
}

double luminance(const Sky& sky, const ViewDirection& view) {
  const auto l = sky.radiance(std::span(&view, 1));
  double sum = 0;
  for (int nm = 380; nm <= 780; ++nm) {
    const auto i = std::min<std::size_t>(static_cast<std::size_t>(nm - 380) / 10, 39);
    const double value = std::lerp(l[i], l[i + 1], (nm - 380.0) / 10 - static_cast<double>(i));
    sum += (nm == 380 || nm == 780 ? 0.5 : 1.0) * value *
           colour_matching(ColourObserver::kCie1931, nm)[1];
  }
  return 683 * sum;
}

// Eq. 1 by hand for the Sun 60 degrees from the zenith: at the Sun itself 11.36 (1 - e^-0.64) over
// (0.91 + 10 e^-pi + 0.45 / 4)(1 - e^-0.32) = 13.4804; at the zenith 1.
TEST(CieClearSky, NumbersOfItsFormula) {
  EXPECT_NEAR(cie_clear_luminance(0.5, 0, pi / 3), 13.480355, 1e-5);
  for (const double theta : {0.0, 0.5, 1.5}) {
    EXPECT_NEAR(cie_clear_luminance(1, theta, theta), 1, 1e-12);
  }
  // The horizon is the limit of what is above it.
  EXPECT_NEAR(cie_clear_luminance(0, 1, 1), cie_clear_luminance(1e-3, 1, 1), 1e-12);
}

TEST(CieOvercastSky, IsThreeTimesBrighterOverheadAndKnowsNoSun) {
  EXPECT_DOUBLE_EQ(cie_overcast_luminance(1), 1);
  EXPECT_DOUBLE_EQ(cie_overcast_luminance(0), 1.0 / 3);
  const auto sky = cie_sky("cie-overcast", 40);
  const ViewDirection views[] = {{0.4, 0}, {0.4, 2}};
  const auto l = sky->radiance(views);
  for (std::size_t w = 0; w < 41; ++w) {
    EXPECT_DOUBLE_EQ(l[w], l[41 + w]);
    EXPECT_DOUBLE_EQ(l[w], l[0]);  // a flat spectral curve
  }
  for (const double direct : sky->sun_transmittance()) EXPECT_EQ(direct, 0);
}

// The horizontal illuminance is 7 pi / 9 of the zenith's luminance, and Krochmann & Seidl's zenith
// their 300 + 21000 sin(elevation) lux.
TEST(CieOvercastSky, IlluminanceOfKrochmannAndSeidl) {
  for (const double elevation : {0.0, 10.0, 45.0, 90.0}) {
    const double zenith = overcast_zenith_luminance_cd_m2(elevation * kRad);
    const double lux = 300 + 21000 * std::sin(elevation * kRad);
    EXPECT_NEAR(7 * pi / 9 * zenith, lux, 3e-3 * lux);
    const auto sky = cie_sky("cie-overcast", elevation);
    EXPECT_NEAR(luminance(*sky, {pi / 2, 0}), zenith, 1e-9 * zenith);
    const double diffuse = 683 * kFlatTristimulusY * sky->irradiance().diffuse[0];
    EXPECT_NEAR(diffuse, 7 * pi / 9 * zenith, 1e-6 * lux);
  }
}

TEST(CieClearSky, ZenithIsPreethamsUnlessGiven) {
  const double own = preetham_zenith(3, 50 * kRad).luminance_cd_m2;
  const auto sky = cie_sky("cie-clear", 40), given = cie_sky("cie-clear", 40, 1234.5);
  EXPECT_NEAR(luminance(*sky, {pi / 2, 0}), own, 1e-9 * own);
  EXPECT_NEAR(luminance(*given, {pi / 2, 0}), 1234.5, 1e-6);
  EXPECT_NEAR(luminance(*given, {0.3, 0.4}) / 1234.5, luminance(*sky, {0.3, 0.4}) / own, 1e-9);
  EXPECT_NEAR(luminance(*cie_sky("cie-overcast", 40, 777.0), {pi / 2, 0}), 777, 1e-6);
  for (const double black : cie_sky("cie-clear", 40, 0.0)->irradiance().diffuse)
    EXPECT_EQ(black, 0);
}

TEST(CieClearSky, FollowsItsFormulaInOneColour) {
  const auto sky = cie_sky("cie-clear", 25);
  const double zenith = luminance(*sky, {pi / 2, 0});
  const ViewDirection views[] = {{pi / 2, 0}, {0.2, 1.0}, {0.2, -1.0}, {0.9, 3.0}};
  const auto l = sky->radiance(views);
  for (std::size_t v = 0; v < 4; ++v) {
    const double sine = std::sin(views[v].elevation_rad), sun = 25 * kRad;
    const double gamma =
        std::acos(sine * std::sin(sun) + std::cos(views[v].elevation_rad) * std::cos(sun) *
                                             std::cos(views[v].relative_azimuth_rad));
    const double expected = zenith * cie_clear_luminance(sine, gamma, pi / 2 - sun);
    EXPECT_NEAR(luminance(*sky, views[v]), expected, 1e-9 * expected);
    EXPECT_NEAR(l[41 * v + 5] / l[41 * v + 30], l[5] / l[30], 1e-12 * l[5] / l[30]);
  }
  EXPECT_EQ(sky->sun_transmittance(), clear_sun_transmittance(
                                          [&] {
                                            Scene scene = small_scene(25);
                                            scene.spectrum.wavelengths_nm.assign(
                                                sky->wavelength_nm().begin(),
                                                sky->wavelength_nm().end());
                                            return build_scene_model(scene);
                                          }(),
                                          3, 25 * kRad));
}

TEST(CieSkies, RefuseOrClampTheNight) {
  for (const char* method : {"cie-clear", "cie-overcast"}) {
    try {
      cie_sky(method, -2);
      ADD_FAILURE() << method;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr("'sun.elevation_deg' = -2: must be 0..90"));
    }
    const auto clamped = cie_sky(method, -2, {}, true), edge = cie_sky(method, 0);
    const ViewDirection view[] = {{0.4, 1}};
    EXPECT_EQ(clamped->radiance(view), edge->radiance(view));
    ASSERT_FALSE(clamped->summary().clamps.empty());
    EXPECT_EQ(clamped->summary().clamps[0].first, "sun.elevation_deg");
  }
}

}  // namespace
}  // namespace twilight
