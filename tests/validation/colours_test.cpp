// Laws of twilight's colours that hold on coarse grids.
#include "tests/validation/colours.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

namespace twilight::validation {
namespace {

Scene coarse_scene() {
  Scene scene;
  scene.spectrum.wavelengths_nm = {390, 430, 470, 510, 550, 590, 630, 670};
  scene.sun.disc_average = false;
  scene.solver.zenith_step_deg = 2;
  scene.solver.altitude_levels = 30;
  scene.solver.polar_directions = 20;
  scene.solver.azimuth_directions = 8;
  scene.solver.phase_degree = 8;
  scene.solver.order_tolerance = 2e-2;
  return scene;
}

// Clear air, by column of ozone; solved once for all tests.
ColourSkies& clear_air(double ozone_du) {
  static std::map<double, ColourSkies> skies;
  const auto found = skies.find(ozone_du);
  if (found != skies.end()) return found->second;
  return skies.try_emplace(ozone_du, coarse_scene(), ColourAir{"clear", "none", ozone_du})
      .first->second;
}

Chromaticity zenith(double ozone_du, double sun_deg) {
  static std::map<std::pair<double, double>, Chromaticity> colours;
  const auto [found, fresh] = colours.try_emplace({ozone_du, sun_deg});
  if (fresh) found->second = clear_air(ozone_du).zenith(sun_deg).xy;
  return found->second;
}

// Hulburt (1953), J. Opt. Soc. Am. 43, 113: at sunset two thirds of the zenith's blue is ozone's.
// Lange, Rozanov & von Savigny (2023), Atmos. Chem. Phys. 23, 14829, with SCIATRAN, zenith, solar
// zenith angle 90 deg: 60, 66 and 76 % at 240, 300 and 500 DU.
TEST(ZenithColour, OzonesShareAtSunset) {
  const Chromaticity without = zenith(0, 0);
  double before = 0;
  for (const auto& [ozone_du, published] : {std::pair{240., 0.60}, {300., 0.66}, {500., 0.76}}) {
    const double share = ozone_share(without, zenith(ozone_du, 0), kEqualEnergyWhite);
    std::printf("%g DU: ozone's share of the blue %.3f, SCIATRAN %.2f\n", ozone_du, share,
                published);
    EXPECT_NEAR(share, published, 0.08) << ozone_du << " DU";
    EXPECT_GT(share, before) << ozone_du << " DU";
    before = share;
  }
}

// Hulburt (1953): in deeper twilight the zenith's blue is wholly ozone's; without ozone it would be
// yellowish. Ours is yellowish at -4 deg and on its way back to the faint blue (0.03 from white at
// -8 deg) of light scattered many times.
TEST(ZenithColour, BlueBelowMinusFourOnlyWithOzone) {
  for (const double sun : {-4., -6., -8.}) {
    const Chromaticity without = zenith(0, sun), with = zenith(300, sun);
    const double share = ozone_share(without, with, kEqualEnergyWhite);
    std::printf("Sun %g: without ozone x %.4f y %.4f, with 300 DU x %.4f y %.4f, share %.3f\n", sun,
                without[0], without[1], with[0], with[1], share);
    EXPECT_GT(share, 0.8) << sun;
    EXPECT_LT(blueness(without, kEqualEnergyWhite), 0.04) << sun;
    EXPECT_LT(with[0], 0.28) << sun;
    EXPECT_LT(with[1], 0.28) << sun;
  }
  const Chromaticity yellowish = zenith(0, -4);
  EXPECT_GT(yellowish[0], 1.0 / 3);
  EXPECT_GT(yellowish[1], 1.0 / 3);
}

TEST(ZenithColour, MoreOzoneIsBluerBelowMinusFour) {
  double before = -1;
  for (const double ozone_du : {0., 300., 500.}) {
    const double blue = blueness(zenith(ozone_du, -4), kEqualEnergyWhite);
    EXPECT_GT(blue, before) << ozone_du << " DU";
    before = blue;
  }
}

// The Earth's shadow rises opposite the Sun as the Sun sinks, faster than the Sun; the Belt of
// Venus lies above it (M. Minnaert, The Nature of Light and Colour in the Open Air, on twilight).
TEST(BeltOfVenus, LiesAboveTheShadowAndClimbs) {
  const std::vector<double> elevations = steps(1, 60, 1);
  const std::vector<ViewAngles> views = vertical(elevations, 180);
  double belt_before = 0, shadow_before = 0;
  for (const double sun : {-1., -2., -3., -4.}) {
    const BeltOfVenus belt = find_belt(elevations, clear_air(300).look(sun, views));
    std::printf("Sun %g: belt at %g deg (x %.3f), bluest below x %.3f, shadow's edge %g deg\n", sun,
                belt.belt_deg, belt.belt_x, belt.below_x, belt.shadow_deg);
    EXPECT_TRUE(belt.exists) << sun;
    EXPECT_GT(belt.belt_deg, belt_before) << sun;
    EXPECT_GT(belt.belt_deg, belt.shadow_deg) << sun;
    EXPECT_GE(belt.shadow_deg, shadow_before) << sun;
    EXPECT_GT(belt.belt_x, belt.below_x + 0.002) << sun;
    belt_before = belt.belt_deg;
    shadow_before = belt.shadow_deg;
  }
}

TEST(OzoneShare, IsTheShareAlongTheDisplacement) {
  const Chromaticity white = {0.33, 0.33}, with = {0.23, 0.25};
  EXPECT_NEAR(ozone_share(with, with, white), 0, 1e-12);
  EXPECT_NEAR(ozone_share(white, with, white), 1, 1e-12);
  EXPECT_NEAR(ozone_share({0.28, 0.29}, with, white), 0.5, 1e-12);
  EXPECT_GT(ozone_share({0.36, 0.36}, with, white), 1);
  EXPECT_THROW(ozone_share(with, white, white), std::invalid_argument);
}

TEST(PurpleIndex, AboveOneOnlyWhereRedAndBlueOutweighGreen) {
  const auto index = [](const LinearRgb& rgb) {
    SkyColour c;
    c.rgb = rgb;
    return purple_index(c);
  };
  EXPECT_DOUBLE_EQ(index({1, 1, 1}), 1);
  EXPECT_DOUBLE_EQ(index({1, 0.5, 1}), 2);
  EXPECT_LT(index({0.3, 0.6, 1}), 1);
  EXPECT_LT(index({1, 0.6, 0.2}), 1);
  EXPECT_LT(index({0.5, 1, 0.5}), 1);
}

// A horizon redder than the belt is no belt; a ratio that only falls has none.
TEST(FindBelt, IsTheMostProminentMaximum) {
  const auto sky = [](std::initializer_list<double> ratios) {
    std::vector<SkyColour> colours;
    for (const double r : ratios) {
      SkyColour c;
      c.red_over_blue = r;
      colours.push_back(c);
    }
    return colours;
  };
  const std::vector<double> elevations = {1, 2, 3, 4, 5, 6};
  const BeltOfVenus belt = find_belt(elevations, sky({3, 1, 1.2, 2, 1.8, 1.5}));
  EXPECT_TRUE(belt.exists);
  EXPECT_EQ(belt.belt_deg, 4);
  EXPECT_EQ(belt.shadow_deg, 3.5);
  EXPECT_EQ(belt.below_red_over_blue, 1);
  EXPECT_FALSE(find_belt(elevations, sky({6, 5, 4, 3, 2, 1})).exists);
  EXPECT_FALSE(find_belt(elevations, sky({1, 2, 3, 4, 5, 6})).exists);
  EXPECT_THROW(find_belt(elevations, sky({1, 2})), std::invalid_argument);
}

TEST(StratosphericAerosol, IsScaledAndSeparated) {
  const ColourSkies whole(coarse_scene(), {"clean", "continental_clean"});
  const ColourSkies tenfold(coarse_scene(), {"x10", "continental_clean", 300, 10});
  const ColourSkies alone(coarse_scene(), {"alone", "continental_clean", 300, 1, false});
  const double above = whole.aerosol_optical_depth(12);
  EXPECT_NEAR(tenfold.aerosol_optical_depth() - whole.aerosol_optical_depth(), 9 * above,
              0.05 * above);
  EXPECT_NEAR(alone.aerosol_optical_depth(), above, 0.05 * above);
  EXPECT_NEAR(above, 0.005, 0.002);  // OPAC's stratosphere at 550 nm
  EXPECT_THROW(ColourSkies(coarse_scene(), {"none", "none", 300, 10}), std::invalid_argument);
}

}  // namespace
}  // namespace twilight::validation
