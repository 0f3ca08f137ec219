#include "sim/models/hoffman_preetham.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <tuple>

#include "aerosols/henyey_greenstein.h"
#include "sim/gauss_legendre.h"
#include "sim/models/hoffman_preetham_sky.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kRad = pi / 180.0;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Scene hazy_scene(double sun_elevation_deg, const char* haze) {
  Scene scene;
  scene.solver.method = "hoffman-preetham";
  scene.hoffman_preetham.haze = haze;
  scene.sun.elevation_deg = sun_elevation_deg;
  scene.sun.spectrum = "unit";
  scene.spectrum.wavelengths_nm = {475, 570, 650};
  scene.solver.threads = 1;
  return scene;
}

HoffmanPreethamSky sky_of(const Scene& scene) {
  return HoffmanPreethamSky(build_scene_model(scene));
}

std::vector<ViewDirection> some_views() {
  std::vector<ViewDirection> views;
  for (const double elevation : {0.0, 1.0, 10.0, 45.0, 90.0}) {
    for (const double azimuth : {0.0, 90.0, 180.0}) {
      views.push_back({elevation * kRad, azimuth * kRad});
    }
  }
  return views;
}

template <class F>
double over_sphere(const F& phase) {
  double sum = 0;
  for (const GaussNode& n : gauss_legendre(400, -1, 1)) sum += 2 * pi * n.weight * phase(n.x);
  return sum;
}

// --- Numbers of the text ---

TEST(HoffmanPreethamText, RayleighCoefficientsFollowFromTheirFormula) {
  EXPECT_NEAR(hoffman_preetham_air_per_m(650), 6.95e-6, 0.005e-6);
  EXPECT_NEAR(hoffman_preetham_air_per_m(570), 1.18e-5, 0.005e-5);
  EXPECT_NEAR(hoffman_preetham_air_per_m(475), 2.44e-5, 0.005e-5);
}

TEST(HoffmanPreethamText, TableOneIsTheSkysHaze) {
  // Light fog, R, G, B: 9e-4, 1e-3, 1.1e-3 m^-1, with the air 6.95e-6, 1.18e-5, 2.44e-5.
  const auto seen = sky_of(hazy_scene(30, "light fog")).aerial_light({0, 0}, 1.0).value();
  EXPECT_NEAR(-std::log(seen.transmittance[2]), 1e3 * (9e-4 + 6.95e-6), 1e-5);
  EXPECT_NEAR(-std::log(seen.transmittance[1]), 1e3 * (1e-3 + 1.18e-5), 1e-4);
  EXPECT_NEAR(-std::log(seen.transmittance[0]), 1e3 * (1.1e-3 + 2.44e-5), 1e-4);
  const double g[] = {-1, -3, -10, -30};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(kHazeTable[i].asymmetry, g[i]);
  EXPECT_EQ(haze_row("heavy haze")->scattering_per_m[2], 1.2e-4);
  EXPECT_FALSE(haze_row("drizzle"));
}

// 8.4 and 1.25 km at the zenith; at the horizon Eq. 5 is 1 / (0.15 3.885^-1.253) = 36.5 times that.
TEST(HoffmanPreethamText, OpticalLengths) {
  EXPECT_NEAR(optical_length(kAirLengthKm, 0), 8.4, 0.005);
  EXPECT_NEAR(optical_length(kHazeLengthKm, 0), 1.25, 0.001);
  EXPECT_NEAR(optical_length(1, 90), 36.5, 0.05);
  EXPECT_NEAR(optical_length(1, 60), 2.0, 0.01);
}

// --- The phase function ---

TEST(HoffmanPreethamPhase, PrintedIntegralIsTheStatedOne) {
  for (const double g : {-0.8, -0.3, 0.0, 0.5}) {
    const double sum = over_sphere([&](double x) { return printed_haze_phase_per_sr(x, g); });
    EXPECT_NEAR(sum, std::abs(1 - g) / std::abs(1 + g), 1e-9) << g;
  }
  for (const double g : {-3.0, -10.0, -30.0, 4.0}) {
    const double sum = over_sphere([&](double x) { return printed_haze_phase_per_sr(x, g); });
    EXPECT_NEAR(sum, std::abs(g - 1) / (std::abs(g) * std::abs(g + 1)), 1e-9) << g;
  }
  // 2/3, 0.122 and 0.0356 for heavy haze, light fog and heavy fog.
  EXPECT_NEAR(over_sphere([](double x) { return printed_haze_phase_per_sr(x, -3); }), 2.0 / 3,
              1e-9);
}

TEST(HoffmanPreethamPhase, ShapeIsTheSameForGAndItsInverse) {
  for (const double g : {-3.0, -10.0, -30.0}) {
    const double ratio = printed_haze_phase_per_sr(1, g) / henyey_greenstein(1, 1 / g);
    for (double x = -1; x <= 1; x += 0.125) {
      EXPECT_NEAR(printed_haze_phase_per_sr(x, g) / henyey_greenstein(x, 1 / g) / ratio, 1.0,
                  1e-12);
    }
  }
}

TEST(HoffmanPreethamPhase, NormalisedIsNormalisedAndForward) {
  for (const HazeRow& row : kHazeTable) {
    const double g = physical_asymmetry(row.asymmetry);
    EXPECT_GT(g, 0.0) << row.name;
    EXPECT_LT(g, 1.0) << row.name;
    EXPECT_NEAR(over_sphere([&](double x) { return henyey_greenstein(x, g); }), 1.0, 1e-9);
  }
  EXPECT_DOUBLE_EQ(physical_asymmetry(-3), 1.0 / 3);
  EXPECT_DOUBLE_EQ(physical_asymmetry(0.5), -0.5);
  EXPECT_EQ(physical_asymmetry(-1), 0.8);
}

TEST(HoffmanPreethamPhase, PrintedIsDarkTowardsTheSun) {
  for (const HazeRow& row : kHazeTable) {
    EXPECT_LT(printed_haze_phase_per_sr(1, row.asymmetry),
              printed_haze_phase_per_sr(-0.9, row.asymmetry));
  }
  EXPECT_TRUE(std::isfinite(printed_haze_phase_per_sr(-1, -1)));
}

// --- Closed forms ---

TEST(HoffmanPreetham, LimitsOfDistance) {
  EXPECT_EQ(extinction_factor(0.3, 0), 1.0);
  EXPECT_EQ(inscattering(0.3, 0.1, 0), 0.0);
  EXPECT_NEAR(inscattering(0.3, 0.1, 1e-9) / 1e-10, 1.0, 1e-8);  // beta(theta) s
  EXPECT_EQ(extinction_factor(0.3, kInfinity), 0.0);
  EXPECT_NEAR(inscattering(0.3, 0.1, kInfinity), 0.1 / 0.3, 1e-15);
  EXPECT_EQ(inscattering(0, 0.1, 5), 0.5);
  EXPECT_EQ(inscattering(0, 0, kInfinity), 0.0);
  EXPECT_NEAR(inscattering(1e-12, 0.1, 5), 0.5, 1e-11);  // continuous there
}

// Eqs. 1 and 4 over s, then over t, are those over s + t.
TEST(HoffmanPreetham, DistancesAddUp) {
  const double s = 3, t = 5, ex = 0.2, sc = 0.07;
  EXPECT_NEAR(inscattering(ex, sc, s + t),
              inscattering(ex, sc, s) + extinction_factor(ex, s) * inscattering(ex, sc, t), 1e-15);
}

TEST(HoffmanPreetham, TwoShellsAreTheirIntegral) {
  const TwoShellOptics o = {0.0118, 0.03, 0.0011, 0.004};
  for (const double scale : {1.0, 5.0, 36.0}) {
    const double air = 8.4 * scale, haze = 1.25 * scale;
    constexpr int kSteps = 100000;
    double sum = 0, depth = 0;
    for (const auto& [from, to, ex, sc] :
         {std::tuple{0.0, haze, o.air_extinction_per_km + o.haze_extinction_per_km,
                     o.air_scattering_per_km_sr + o.haze_scattering_per_km_sr},
          std::tuple{haze, air, o.air_extinction_per_km, o.air_scattering_per_km_sr}}) {
      const double ds = (to - from) / kSteps;
      for (int i = 0; i < kSteps; ++i) sum += sc * ds * std::exp(-depth - ex * (i + 0.5) * ds);
      depth += ex * (to - from);
    }
    EXPECT_NEAR(two_shell_inscattering(o, air, haze) / sum, 1.0, 1e-8) << scale;
  }
}

TEST(HoffmanPreetham, WithoutHazeTheShellsAreOne) {
  const TwoShellOptics o = {0.0118, 0, 0.0011, 0};
  EXPECT_NEAR(two_shell_inscattering(o, 8.4, 1.25), inscattering(0.0118, 0.0011, 8.4), 1e-15);
}

// --- The sky ---

TEST(HoffmanPreethamSky, SunlightIsExtinguishedAlongItsOpticalLengths) {
  const std::vector<double> t = sky_of(hazy_scene(90, "heavy haze")).sun_transmittance();
  EXPECT_NEAR(-std::log(t[2]), 8.4 * 6.95e-3 + 1.25 * 8e-2, 2e-4);
  const std::vector<double> low = sky_of(hazy_scene(0, "light haze")).sun_transmittance();
  EXPECT_GT(low[2], 10 * low[0]);  // red
}

TEST(HoffmanPreethamSky, EveryHazeIsFinite) {
  for (const char* phase : {"normalised", "printed"}) {
    for (const char* haze : {"none", "light haze", "heavy haze", "light fog", "heavy fog"}) {
      for (const double sun : {0.0, 5.0, 90.0}) {
        Scene scene = hazy_scene(sun, haze);
        scene.hoffman_preetham.phase = phase;
        scene.spectrum.wavelengths_nm = {300, 475, 570, 650, 1000};
        const HoffmanPreethamSky sky = sky_of(scene);
        for (const double v : sky.radiance(some_views())) EXPECT_TRUE(std::isfinite(v) && v >= 0);
        for (const double v : sky.irradiance().diffuse) EXPECT_TRUE(std::isfinite(v) && v >= 0);
      }
    }
  }
}

// In thick fog the horizon is Eq. 4's limit, whatever lies behind.
TEST(HoffmanPreethamSky, FogSaturates) {
  const HoffmanPreethamSky sky = sky_of(hazy_scene(60, "heavy fog"));
  const ViewDirection view{0.2, 2.0};
  const auto far = sky.aerial_light(view, kInfinity).value();
  const std::vector<double> seen = sky.radiance(std::vector{view});
  for (std::size_t w = 0; w < 3; ++w) EXPECT_NEAR(seen[w] / far.inscattered[w], 1.0, 1e-6);
  // Grey in the light it gets, as fog is; a blue coefficient of 1e-5 m^-1 would not be.
  const std::vector<double> sun = sky.sun_transmittance();
  EXPECT_NEAR(seen[0] / sun[0] / (seen[2] / sun[2]), 1.0, 0.02);
}

// Power law of the haze between their wavelengths: a haze of lambda^-4 stays one.
TEST(HoffmanPreethamSky, HazeIsAPowerLawBetweenTheirWavelengths) {
  Scene scene = hazy_scene(30, "none");
  const auto law = [](double nm) { return 0.5 * std::pow(550 / nm, 4.0); };
  scene.hoffman_preetham.haze_scattering_per_km = {law(650), law(570), law(475)};
  scene.spectrum.wavelengths_nm = {400, 520, 700};
  const auto seen = sky_of(scene).aerial_light({0, 0}, 1.0).value();
  for (std::size_t w = 0; w < 3; ++w) {
    const double nm = scene.spectrum.wavelengths_nm[w];
    EXPECT_NEAR(-std::log(seen.transmittance[w]), law(nm) + 1e3 * hoffman_preetham_air_per_m(nm),
                1e-9);
  }
}

TEST(HoffmanPreethamSky, PhaseDecidesWhereItIsBright) {
  Scene scene = hazy_scene(10, "heavy haze");
  const std::vector<ViewDirection> views = {{10 * kRad, 0}, {10 * kRad, pi}};
  const std::vector<double> forward = sky_of(scene).radiance(views);
  scene.hoffman_preetham.phase = "printed";
  const std::vector<double> printed = sky_of(scene).radiance(views);
  EXPECT_GT(forward[2], 2 * forward[5]);
  EXPECT_LT(printed[2], printed[5]);
}

TEST(HoffmanPreethamSky, SunBelowTheHorizonIsRefusedOrClamped) {
  Scene scene = hazy_scene(-1, "light haze");
  EXPECT_THROW(sky_of(scene), std::invalid_argument);
  scene.models.out_of_range = "clamp";
  const HoffmanPreethamSky sky = sky_of(scene);
  ASSERT_EQ(sky.summary().clamps.size(), 1U);
  EXPECT_EQ(sky.summary().clamps[0].first, "sun.elevation_deg");
  EXPECT_EQ(sky.radiance(some_views()), sky_of(hazy_scene(0, "light haze")).radiance(some_views()));
  Scene high = hazy_scene(10, "light haze");
  high.observer.height_m = 100;
  EXPECT_THROW(sky_of(high), std::invalid_argument);
  EXPECT_THROW(sky_of(hazy_scene(10, "none")).aerial_light({0, 0}, -1), std::invalid_argument);
}

// Below the horizon: albedo / pi times the model's own irradiance.
TEST(HoffmanPreethamSky, GroundReflectsTheModelsIrradiance) {
  const HoffmanPreethamSky sky = sky_of(hazy_scene(40, "light haze"));
  const Irradiance light = sky.irradiance();
  const std::vector<double> ground = sky.radiance(std::vector<ViewDirection>{{-0.5, 1}});
  for (std::size_t w = 0; w < 3; ++w) {
    EXPECT_NEAR(ground[w], 0.1 / pi * (light.direct[w] + light.diffuse[w]), 1e-12);
  }
}

}  // namespace
}  // namespace twilight
