#include "atmosphere/two_constituent_air.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "aerosols/cornette_shanks.h"
#include "atmosphere/power_law.h"

namespace twilight {
namespace {

using std::numbers::pi;

// Simpson's rule over the cosine.
template <class F>
double over_sphere(const F& f) {
  constexpr int kSteps = 200000;
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = -1 + 2.0 * i / kSteps;
    sum += (i == 0 || i == kSteps ? 1 : i % 2 == 1 ? 4 : 2) * f(x);
  }
  return 2 * pi * sum * (2.0 / kSteps) / 3;
}

double mean_cosine(double g) { return 0.6 * g * (4 + g * g) / (2 + g * g); }

TEST(CornetteShanks, IntegratesToOneWithItsMeanCosine) {
  for (const double g : {-0.9, -0.3, 0.0, 0.5, 0.76, 0.95}) {
    EXPECT_NEAR(over_sphere([&](double x) { return cornette_shanks(x, g); }), 1.0, 1e-9) << g;
    EXPECT_NEAR(over_sphere([&](double x) { return x * cornette_shanks(x, g); }), mean_cosine(g),
                1e-9)
        << g;
  }
}

TEST(CornetteShanks, IsRayleighsWithoutAsymmetry) {
  for (double x = -1; x <= 1; x += 0.25) {
    EXPECT_NEAR(cornette_shanks(x, 0), 3 / (16 * pi) * (1 + x * x), 1e-15);
  }
}

// Straight ahead: 3/(4 pi) (1 - g^2) / ((2 + g^2) (1 - g)^3); the lesson's g 0.76.
TEST(CornetteShanks, PeaksForward) {
  const double g = 0.76;
  EXPECT_NEAR(cornette_shanks(1, g),
              3 / (4 * pi) * (1 - g * g) / ((2 + g * g) * std::pow(1 - g, 3.0)), 1e-12);
}

TEST(TwoConstituentAir, LessonsCoefficientsFollowRayleighsLaw) {
  const TwoConstituentAir air = published_air("scratchapixel").value();
  EXPECT_NEAR(air.rayleigh_per_km(440), 33.1e-3, 1e-15);
  EXPECT_NEAR(air.rayleigh_per_km(550), 13.5e-3, 1e-15);
  EXPECT_NEAR(air.rayleigh_per_km(680), 5.8e-3, 1e-15);
  // lambda^-4 of 440 nm (1 % is the rounding of three figures): 5.8e-6 it is, not 3.8e-6.
  EXPECT_NEAR(33.1e-3 * std::pow(440.0 / 680, 4.0), air.rayleigh_per_km(680), 0.01e-3);
  EXPECT_NEAR(33.1e-3 * std::pow(440.0 / 550, 4.0), air.rayleigh_per_km(550), 0.07e-3);
  EXPECT_NEAR(published_air("scratchapixel_code")->rayleigh_per_km(680), 3.8e-3, 1e-15);
  EXPECT_EQ(air.mie_per_km(440), 21e-3);
  EXPECT_NEAR(1 / air.mie_single_scattering_albedo, 1.1, 1e-12);
  EXPECT_FALSE(published_air("us_standard"));
}

// Bruneton & Neyret 2008: the same molecules, haze 2e-5 m^-1 and albedo 0.9.
TEST(TwoConstituentAir, BrunetonsAirIsPublished) {
  const TwoConstituentAir air = published_air("bruneton2008").value();
  EXPECT_NEAR(air.rayleigh_per_km(680), 5.8e-3, 1e-15);
  EXPECT_EQ(air.rayleigh_scale_height_km, 8.0);
  EXPECT_EQ(air.mie_per_km(700), 20e-3);
  EXPECT_EQ(air.mie_single_scattering_albedo, 0.9);
}

TEST(TwoConstituentAir, OneWavelengthIsLambdaToTheMinusFour) {
  TwoConstituentAir air;
  air.rayleigh_wavelength_nm = {550};
  air.rayleigh_scattering_per_km = {0.012};
  EXPECT_NEAR(air.rayleigh_per_km(275), 16 * 0.012, 1e-12);
}

TEST(TwoConstituentAir, AngstromLaw) {
  TwoConstituentAir air;
  air.mie_angstrom_exponent = 2;
  EXPECT_NEAR(air.mie_per_km(1100), air.mie_per_km(550) / 4, 1e-15);
}

TEST(PowerLaw, KeepsPowersAndPassesItsPoints) {
  const double at[] = {400, 500, 700};
  const double value[] = {std::pow(400.0, -1.3), std::pow(500.0, -1.3), std::pow(700.0, -1.3)};
  for (const double nm : {300.0, 400.0, 450.0, 500.0, 690.0, 900.0}) {
    EXPECT_NEAR(power_law(at, value, nm) / std::pow(nm, -1.3), 1.0, 1e-12) << nm;
  }
  const double bent[] = {1.0, 3.0, 2.0};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(power_law(at, bent, at[i]), bent[i], 1e-12);
}

// Layers keep the vertical optical depth, beta H (1 - exp(-top / H)), however few.
TEST(TwoConstituentAir, LayersKeepTheOpticalDepth) {
  const TwoConstituentAir air = published_air("scratchapixel").value();
  const double nm[] = {440, 680};
  for (const std::vector<double>& boundaries :
       {std::vector<double>{0, 60}, std::vector<double>{0, 1, 3, 10, 30, 60}}) {
    const Medium m = layered(air, nm, boundaries, true);
    for (std::size_t w = 0; w < 2; ++w) {
      double scattering = 0, extinction = 0;
      for (std::size_t i = 0; i < m.layers(); ++i) {
        const double thick = m.boundary_km[i + 1] - m.boundary_km[i];
        scattering += thick * m.air_scattering_per_km(i, w);
        extinction += thick * m.extinction_per_km(i, w);
      }
      const double molecules = air.rayleigh_per_km(nm[w]) * 7.994 * -std::expm1(-60 / 7.994);
      const double haze = 1.1 * 21e-3 * 1.2 * -std::expm1(-60 / 1.2);
      EXPECT_NEAR(scattering, molecules, 1e-12);
      EXPECT_NEAR(extinction, molecules + haze, 1e-12);
    }
    EXPECT_EQ(m.earth_radius_km, 6360.0);
  }
}

TEST(TwoConstituentAir, TabulatedHazeScattersAsCornetteAndShanks) {
  const TwoConstituentAir air = published_air("bruneton2008").value();
  const double nm[] = {550};
  const Medium m = layered(air, nm, {0, 60}, true);
  ASSERT_EQ(m.aerosol_phase.size(), 1U);
  const PhaseMatrix& phase = m.aerosol_phase[0][0];
  EXPECT_EQ(phase.angle_rad.front(), 0.0);
  EXPECT_EQ(phase.angle_rad.back(), pi);
  for (std::size_t i = 0; i < phase.angle_rad.size(); ++i) {
    EXPECT_NEAR(phase.p11[i] / (4 * pi * cornette_shanks(std::cos(phase.angle_rad[i]), 0.76)), 1.0,
                2e-5);
    EXPECT_EQ(phase.p12[i], 0.0);
  }
  EXPECT_EQ(m.aerosol_kind_scattering_per_km[0](0, 0), m.aerosol_scattering_per_km(0, 0));
  EXPECT_NEAR(m.aerosol_asymmetry(0, 0), mean_cosine(0.76), 1e-12);
  EXPECT_TRUE(layered(air, nm, {0, 60}, false).aerosol_phase.empty());
}

}  // namespace
}  // namespace twilight
