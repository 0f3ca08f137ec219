#include "output/sky_sample.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "output/hemisphere.h"
#include "output/scene_colour.h"

namespace twilight {
namespace {

using std::numbers::pi;

// Radiance at every view and wavelength, and colours in proportion to a given X, Y, Z.
SunSample even_sky(double radiance, std::size_t wavelengths) {
  SunSample sky;
  const std::size_t views = hemisphere_views().size();
  sky.radiance.assign(views * wavelengths, radiance);
  for (std::size_t v = 0; v < views; ++v) {
    for (const double c : {0.95, 1.0, 1.09}) sky.xyz.push_back(c * radiance);
  }
  return sky;
}

TEST(Hemisphere, SolidAnglesAndIrradianceOfAnEvenSky) {
  double sum = 0, horizontal = 0, lowest = 1;
  for (const WeightedView& v : hemisphere_views()) {
    sum += v.solid_angle_sr;
    horizontal += v.solid_angle_sr * std::sin(v.direction.elevation_rad);
    lowest = std::min(lowest, v.direction.elevation_rad);
  }
  EXPECT_NEAR(sum, 2 * pi * 0.99, 1e-12);
  EXPECT_NEAR(horizontal, pi * (1 - 1e-4), 1e-12);  // pi sin^2 between 0.01 and 1
  EXPECT_NEAR(lowest * 180 / pi, 1.1, 0.1);
}

TEST(Hemisphere, SumsSmoothSkiesExactly) {
  // (1 + cos azimuth)^2 sin^3: 3/2 on average in azimuth, integral of s^3 in elevation.
  double sum = 0;
  for (const WeightedView& v : hemisphere_views()) {
    sum += v.solid_angle_sr * std::pow(1 + std::cos(v.direction.relative_azimuth_rad), 2) *
           std::pow(std::sin(v.direction.elevation_rad), 3);
  }
  EXPECT_NEAR(sum, 2 * pi * 1.5 * 0.25 * (1 - 1e-8), 1e-12);
}

TEST(Hemisphere, SpreadIsWeighted) {
  // 96 % of the weight is at 1 and below.
  const WeightedValue values[] = {{1, 90}, {5, 4}, {0, 6}};
  const Spread spread = spread_of(values);
  EXPECT_DOUBLE_EQ(spread.mean, 1.1);
  EXPECT_EQ(spread.p95, 1);
  EXPECT_EQ(spread.largest, 5);
  EXPECT_THROW(spread_of({}), std::invalid_argument);
  const WeightedValue bad[] = {{NAN, 1}};
  EXPECT_THROW(spread_of(bad), std::invalid_argument);
}

TEST(SkyDifference, OfASkyAndItselfIsNothing) {
  const SkyDifference d =
      sky_difference(even_sky(2, 3), {400, 500, 600}, even_sky(2, 3), {400, 500, 600});
  EXPECT_EQ(d.radiance->largest, 0);
  EXPECT_EQ(d.luminance->largest, 0);
  EXPECT_EQ(d.ciede2000->largest, 0);
  EXPECT_EQ(d.radiance_bias, 0);
}

TEST(SkyDifference, OfADimmerSkyIsItsShare) {
  const SkyDifference d =
      sky_difference(even_sky(0.9, 2), {400, 500}, even_sky(1, 3), {400, 450, 500});
  for (const Spread& s : {*d.radiance, *d.luminance}) {
    EXPECT_NEAR(s.mean, 0.1, 1e-12);
    EXPECT_NEAR(s.p95, 0.1, 1e-12);
    EXPECT_NEAR(s.largest, 0.1, 1e-12);
  }
  EXPECT_NEAR(d.radiance_bias, -0.1, 1e-12);
  EXPECT_NEAR(d.luminance_bias, -0.1, 1e-12);
  // The reference is white at L* = 100; 90 % of it is at L* 95.997 (116 cbrt(0.9) - 16), and S_L
  // there 1.7125 at the mean lightness 97.998: 2.34.
  const double lower = 116 * std::cbrt(0.9) - 16, from_50 = 0.5 * (100 + lower) - 50;
  const double s_l = 1 + 0.015 * from_50 * from_50 / std::sqrt(20 + from_50 * from_50);
  EXPECT_NEAR(d.ciede2000->mean, (100 - lower) / s_l, 0.02);
}

TEST(SkyDifference, KnowsWavelengthsByTheirValue) {
  SunSample sky = even_sky(1, 2), reference = even_sky(1, 2);
  for (std::size_t v = 0; v < hemisphere_views().size(); ++v) sky.radiance[2 * v] = 7;
  EXPECT_EQ(sky_difference(sky, {400, 500}, reference, {500, 600}).radiance->largest, 0);
  EXPECT_FALSE(sky_difference(sky, {400, 500}, reference, {450, 600}).radiance.has_value());
}

TEST(SkyDifference, LeavesOutWhatIsDarkInTheReference) {
  const SkyDifference d = sky_difference(even_sky(1, 1), {500}, even_sky(0, 1), {500});
  EXPECT_FALSE(d.radiance || d.luminance || d.ciede2000);
  EXPECT_THROW(sky_difference(even_sky(1, 1), {400, 500}, even_sky(1, 1), {500}),
               std::invalid_argument);
}

Scene small_scene(const char* method) {
  Scene scene;
  scene.sun.elevation_deg = 3;
  scene.aerosols.type = "none";
  scene.atmosphere.layers = 10;
  scene.atmosphere.refraction = false;
  scene.spectrum.wavelengths_nm = {450, 600};
  scene.solver.method = method;
  scene.solver.azimuth_divisions = 12;
  scene.solver.active_shell_stride = 8;
  scene.solver.zenith_step_deg = 3;
  scene.solver.altitude_levels = 6;
  scene.solver.polar_directions = 8;
  scene.solver.azimuth_directions = 4;
  scene.solver.photons = 100;
  return scene;
}

TEST(SkySample, IsTheSkyOfEachSunWhateverServedBefore) {
  for (const char* method : {"orders", "cells"}) {
    Scene scene = small_scene(method);
    const SkySample both = sample_sky(build_scene_model(scene), {10, -4});
    scene.sun.elevation_deg = -4;
    const SceneModel model = build_scene_model(scene);
    const auto sky = solve_sky(model);
    ASSERT_EQ(both.suns.size(), 2u);
    EXPECT_EQ(both.wavelength_nm, (std::vector<double>{450, 600}));
    EXPECT_GT(both.peak_mib, 1);
    const auto views = hemisphere_views();
    const ColourIntegrator colour = colour_integrator(model, ColourObserver::kCie1931);
    for (std::size_t v = 0; v < views.size(); v += 13) {
      const auto radiance = sky->radiance({&views[v].direction, 1});
      const Tristimulus xyz = colour.xyz(radiance, sky->solar_irradiance());
      for (std::size_t w = 0; w < 2; ++w) {
        EXPECT_EQ(both.suns[1].radiance[2 * v + w], radiance[w]) << method;
      }
      for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(both.suns[1].xyz[3 * v + c], xyz[c]);
    }
    EXPECT_EQ(mean_relative_noise(both.suns[0]), 0);
  }
}

TEST(SkySample, JsonKeepsEveryBitAndMonteCarloItsNoise) {
  const SkySample sample = sample_sky(build_scene_model(small_scene("monte-carlo")), {5});
  EXPECT_GT(mean_relative_noise(sample.suns[0]), 0.001);
  const SkySample back = sky_sample_from_json(to_json(sample));
  EXPECT_EQ(back.wavelength_nm, sample.wavelength_nm);
  ASSERT_EQ(back.suns.size(), 1u);
  EXPECT_EQ(back.suns[0].radiance, sample.suns[0].radiance);
  EXPECT_EQ(back.suns[0].standard_error, sample.suns[0].standard_error);
  EXPECT_EQ(back.suns[0].xyz, sample.suns[0].xyz);
  EXPECT_EQ(back.suns[0].view_seconds, sample.suns[0].view_seconds);
  EXPECT_THROW(sky_sample_from_json("{}"), std::runtime_error);
  SkySample cut = sample;
  cut.suns[0].xyz.pop_back();
  EXPECT_THROW(sky_sample_from_json(to_json(cut)), std::runtime_error);
}

}  // namespace
}  // namespace twilight
