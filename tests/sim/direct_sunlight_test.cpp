#include "sim/direct_sunlight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <stdexcept>
#include <vector>

#include "atmosphere/refraction.h"
#include "sim/cell_grid.h"
#include "small_scene.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180;

Medium hazy_air(bool refraction = true, const char* ozone = "layered",
                const char* aerosols = "continental_average") {
  Scene scene = small_scene(0);
  scene.atmosphere.layers = 60;
  scene.atmosphere.top_km = 100;
  scene.atmosphere.refraction = refraction;
  scene.atmosphere.ozone = ozone;
  scene.aerosols.type = aerosols;
  scene.spectrum.wavelengths_nm = {400, 450, 550, 700, 780};
  return build_scene_model(scene).medium;
}

// Exact depth of the beam by the ray of this wavelength itself; negative in the shadow.
double traced_depth(const Medium& m, std::size_t w, double altitude_km, double zenith_rad) {
  const RefractedRays rays(m, w);
  const auto apparent = rays.apparent_zenith_rad(altitude_km, zenith_rad);
  if (!apparent) return -1;
  std::vector<double> path(m.layers());
  if (rays.trace_outward(altitude_km, *apparent, path).hits_ground) return -1;
  return slant_optical_depth(m, w, path);
}

struct Errors {
  double worst = 0, mean = 0, above_1_percent = 0;
};

// Errors of the transmittance at random points in the light, half of them in the last 5 % of the
// zenith angle above the shadow.
Errors transmittance_errors(const Medium& m) {
  const DirectSunlight sunlight(m);
  std::vector<float> depth(sunlight.lanes());
  std::mt19937 random(2005);
  std::uniform_real_distribution<double> unit(0, 1);
  Errors e;
  constexpr int kPoints = 1500;
  for (int i = 0; i < kPoints; ++i) {
    const double altitude = 100 * std::pow(unit(random), 2);
    const double horizon = sunlight.shadow_zenith_rad(altitude);
    const double zenith = horizon * (1 - (i % 2 ? unit(random) : 0.05 * unit(random)));
    EXPECT_TRUE(sunlight.optical_depth(altitude, zenith, depth.data()));
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      const double exact = traced_depth(m, w, altitude, zenith);
      const double want = exact < 0 ? 0 : std::exp(-exact);
      const double error = std::abs(std::exp(-static_cast<double>(depth[w])) - want);
      // At the shadow's rim up to a fifth of the light ends abruptly, at each wavelength elsewhere.
      if (zenith < horizon - 0.05 * kDegree) e.worst = std::max(e.worst, error);
      e.mean += error;
      e.above_1_percent += error > 0.01;
    }
  }
  const double n = static_cast<double>(kPoints) * static_cast<double>(m.wavelengths());
  e.mean /= n;
  e.above_1_percent /= n;
  std::printf("transmittance: worst error %.1e, mean %.1e, above 1 %%: %.2f %%\n", e.worst, e.mean,
              100 * e.above_1_percent);
  return e;
}

// Clean air is smooth: within 1 % of the unattenuated beam but for the rim, 0.1 % on average.
TEST(DirectSunlight, AgreesWithTheRaysThemselvesInCleanAir) {
  const Errors e = transmittance_errors(hazy_air(true, "layered", "none"));
  EXPECT_LE(e.worst, 0.01);
  EXPECT_LE(e.above_1_percent, 5e-3);
  EXPECT_LE(e.mean, 1e-3);
}

// Layers of haze have edges, which grazing rays meet between two nodes: that is where the table is
// off by up to a tenth, in less than one point of 200.
TEST(DirectSunlight, AgreesWithTheRaysThemselvesInHaze) {
  const Errors e = transmittance_errors(hazy_air());
  EXPECT_LE(e.worst, 0.1);
  EXPECT_LE(e.above_1_percent, 5e-3);
  EXPECT_LE(e.mean, 1e-3);
}

// Where the Sun is high the depth itself is good, relative (and to 1e-4 where a layer of haze ends
// between nodes of altitude).
TEST(DirectSunlight, DepthIsGoodTo1PercentBelow80DegreesZenith) {
  const Medium m = hazy_air();
  const DirectSunlight sunlight(m);
  std::vector<float> depth(sunlight.lanes());
  double worst = 0;
  for (const double altitude : {0.0, 0.7, 3.1, 11.0, 35.0}) {
    for (double zenith = 0; zenith <= 80; zenith += 3.7) {
      ASSERT_TRUE(sunlight.optical_depth(altitude, zenith * kDegree, depth.data()));
      for (std::size_t w = 0; w < m.wavelengths(); ++w) {
        const double exact = traced_depth(m, w, altitude, zenith * kDegree);
        worst = std::max(worst, std::abs(depth[w] - exact) / (0.01 * exact + 1e-4));
        EXPECT_NEAR(depth[w], exact, 0.01 * exact + 1e-4) << altitude << ' ' << zenith << ' ' << w;
      }
    }
  }
  std::printf("depth: worst error %.2f of the bound\n", worst);
}

// cos(zenith of the shadow) = -sqrt(1 - (R/(R + h))^2) for straight rays.
TEST(DirectSunlight, StraightShadowIsTheEarthsRim) {
  const Medium m = hazy_air(false);
  const DirectSunlight sunlight(m);
  const double R = m.earth_radius_km;
  std::vector<float> depth(sunlight.lanes());
  for (const double altitude : {0.0, 0.05, 1.0, 7.3, 20.0, 60.0, 99.0, 100.0}) {
    const double want = kPi - std::asin(R / (R + altitude));
    EXPECT_NEAR(sunlight.shadow_zenith_rad(altitude), want, 3e-5) << altitude;
    EXPECT_FALSE(sunlight.optical_depth(altitude, want + 1e-4, depth.data()));
    EXPECT_TRUE(sunlight.optical_depth(altitude, want - 1e-4, depth.data()));
  }
}

// With a straight ray through one layer: depth = beta (sqrt((R+H)^2 - p^2) - r cos z).
TEST(DirectSunlight, StraightRayThroughOneLayerIsGeometry) {
  const Medium m = layered_air(50, {0.01});
  const DirectSunlight sunlight(m);
  const double R = m.earth_radius_km;
  std::vector<float> depth(sunlight.lanes());
  for (const double altitude : {0.0, 1.0, 10.0, 30.0, 48.0}) {
    for (double zenith = 0; zenith < sunlight.shadow_zenith_rad(altitude); zenith += 0.01) {
      const double r = R + altitude, p = r * std::sin(zenith);
      const double path = std::sqrt((R + 50) * (R + 50) - p * p) - r * std::cos(zenith);
      ASSERT_TRUE(sunlight.optical_depth(altitude, zenith, depth.data()));
      EXPECT_NEAR(depth[0], 0.01 * path, 2e-3 * 0.01 * path + 1e-4) << altitude << ' ' << zenith;
    }
  }
}

TEST(DirectSunlight, ShadowSinksWithAltitude) {
  const Medium m = hazy_air();
  const DirectSunlight sunlight(m);
  const DirectSunlight straight(hazy_air(false));
  double last = kPi / 2;
  for (double altitude = 0.5; altitude <= 100; altitude += 0.5) {
    const double zenith = sunlight.shadow_zenith_rad(altitude);
    EXPECT_GT(zenith, last);
    last = zenith;
    // Refraction lets light into the geometric shadow: twice the horizontal refraction (34') at
    // most, seen from above all air.
    EXPECT_GT(zenith, straight.shadow_zenith_rad(altitude));
    EXPECT_LT(zenith, straight.shadow_zenith_rad(altitude) + 1.25 * kDegree);
  }
}

TEST(DirectSunlight, DarkBeyondTheShadow) {
  const Medium m = hazy_air();
  const DirectSunlight sunlight(m);
  std::vector<float> depth(sunlight.lanes(), -3.0F);
  for (const double altitude : {0.0, 5.0, 50.0, 100.0}) {
    for (double zenith = sunlight.shadow_zenith_rad(altitude) + 1e-6; zenith < kPi;
         zenith += 0.05) {
      EXPECT_FALSE(sunlight.optical_depth(altitude, zenith, depth.data()));
    }
    EXPECT_FALSE(sunlight.optical_depth(altitude, kPi, depth.data()));
    for (const float d : depth) EXPECT_EQ(d, -3.0F);  // left alone
  }
}

// A Sun overhead shines straight down: the vertical column, ozone's vertical filter included once.
TEST(DirectSunlight, OverheadIsTheVerticalColumn) {
  for (const char* ozone : {"layered", "vertical"}) {
    const Medium m = hazy_air(true, ozone);
    EXPECT_EQ(m.vertical_filter_optical_depth.empty(), std::string(ozone) == "layered");
    const DirectSunlight sunlight(m);
    std::vector<float> depth(sunlight.lanes());
    ASSERT_TRUE(sunlight.optical_depth(0, 0, depth.data()));
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      double column = 0;
      for (std::size_t i = 0; i < m.layers(); ++i) {
        column += m.extinction_per_km(i, w) * (m.boundary_km[i + 1] - m.boundary_km[i]);
      }
      if (!m.vertical_filter_optical_depth.empty()) {
        EXPECT_GT(m.vertical_filter_optical_depth[2], 0);
        column += m.vertical_filter_optical_depth[w];
      }
      EXPECT_NEAR(depth[w], column, 1e-5 * column + 1e-7) << ozone;
    }
    // At the top nothing but the filter is left.
    ASSERT_TRUE(sunlight.optical_depth(m.top_km(), 0, depth.data()));
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      const double filter =
          m.vertical_filter_optical_depth.empty() ? 0 : m.vertical_filter_optical_depth[w];
      EXPECT_NEAR(depth[w], filter, 1e-5);
    }
  }
}

TEST(DirectSunlight, DepthGrowsTowardsTheHorizonAndTheGround) {
  const Medium m = hazy_air();
  const DirectSunlight sunlight(m);
  std::vector<float> depth(sunlight.lanes()), before(sunlight.lanes());
  for (const double altitude : {0.0, 2.0, 20.0}) {
    ASSERT_TRUE(sunlight.optical_depth(altitude, 0, before.data()));
    for (double zenith = 0.02; zenith < 1.5; zenith += 0.02) {
      ASSERT_TRUE(sunlight.optical_depth(altitude, zenith, depth.data()));
      for (std::size_t w = 0; w < m.wavelengths(); ++w) EXPECT_GT(depth[w], before[w]);
      before = depth;
    }
  }
}

TEST(DirectSunlight, PaddingLanesAreOpaque) {
  const Medium m = hazy_air();
  const DirectSunlight sunlight(m);
  ASSERT_EQ(sunlight.lanes(), 8U);
  std::vector<float> depth(8);
  ASSERT_TRUE(sunlight.optical_depth(3, 1, depth.data()));
  for (std::size_t w = m.wavelengths(); w < 8; ++w) {
    EXPECT_FLOAT_EQ(depth[w], DirectSunlight::kOpaque);
  }
}

TEST(DirectSunlight, TooFewNodesThrow) {
  const Medium m = layered_air(50, {0.01});
  EXPECT_THROW(DirectSunlight(m, 1, 10), std::invalid_argument);
  EXPECT_THROW(DirectSunlight(m, 10, 1), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
