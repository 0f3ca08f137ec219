#include "atmosphere/rayleigh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace twilight {
namespace {

// Bodhaine et al. (1999), eq. 29: the authors' fit to their own first-principles values.
TEST(RayleighCrossSection, MatchesBodhaineFit) {
  for (double nm = 280.0; nm <= 850.0; nm += 5.0) {
    const double l2 = 1e-6 * nm * nm;
    const double fit = 1e-28 * (1.0455996 - 341.29061 / l2 - 0.90230850 * l2) /
                       (1.0 + 0.0027059889 / l2 - 85.968563 * l2);
    EXPECT_NEAR(rayleigh_cross_section_cm2(nm, king_factor(nm)) / fit, 1.0, 2e-4) << nm;
  }
}

// Bucholtz (1995), fits of Table 3: independent of Bodhaine; the authors differ by up to 0.3 %.
TEST(RayleighCrossSection, AgreesWithBucholtz) {
  for (const double nm : {300.0, 350.0, 400.0, 450.0, 500.0, 550.0, 600.0, 700.0, 850.0, 1000.0}) {
    const double l = 1e-3 * nm;
    const double fit =
        l <= 0.5 ? 3.01577e-28 * std::pow(l, -(3.55212 + 1.35579 * l + 0.11563 / l))
                 : 4.01061e-28 * std::pow(l, -(3.99668 + 1.10298e-3 * l + 2.71393e-2 / l));
    EXPECT_NEAR(rayleigh_cross_section_cm2(nm, king_factor(nm)) / fit, 1.0, 0.0035) << nm;
  }
}

// Peck & Reeder (1972), J. Opt. Soc. Am. 62, 958, 15 C and 1013.25 hPa, worked out by hand from
// their dispersion formula with 360 ppm CO2.
TEST(PeckReeder, RefractivityOfStandardAir) {
  EXPECT_NEAR(peck_reeder_refractivity(550.0), 2.77832e-4, 2e-9);
  EXPECT_NEAR(peck_reeder_refractivity(400.0), 2.82758e-4, 2e-9);
  EXPECT_NEAR(peck_reeder_refractivity(700.0), 2.75799e-4, 2e-9);
}

// Bodhaine et al. (1999), eqs. 5, 6, 23 by hand at 550 and 400 nm.
TEST(KingFactor, OfAir) {
  EXPECT_NEAR(king_factor(550.0), 1.04882, 1e-5);
  EXPECT_NEAR(king_factor(400.0), 1.05126, 1e-5);
}

TEST(KingFactor, AndDepolarisationAreInverse) {
  for (const double rho : {0.0, 0.01, 0.0279, 0.1, 0.5, 0.8}) {
    EXPECT_NEAR(depolarisation_from_king_factor(king_factor_from_depolarisation(rho)), rho, 1e-14);
  }
  EXPECT_EQ(king_factor_from_depolarisation(0.0), 1.0);
  EXPECT_THROW(king_factor_from_depolarisation(-0.01), std::invalid_argument);
  EXPECT_THROW(king_factor_from_depolarisation(6.0 / 7.0), std::invalid_argument);
  EXPECT_THROW(king_factor_from_depolarisation(std::nan("")), std::invalid_argument);
}

// Bucholtz (1995), Table 1: gamma = rho / (2 - rho) = 1.442e-2 at 550 nm, 1.499e-2 at 400 nm; his
// King factors (Bates 1984) differ from Bodhaine's in the fourth digit.
TEST(KingFactor, GivesBucholtzGamma) {
  const auto gamma = [](double nm) {
    const double rho = depolarisation_from_king_factor(king_factor(nm));
    return rho / (2.0 - rho);
  };
  EXPECT_NEAR(gamma(550.0), 1.442e-2, 0.03e-2);
  EXPECT_NEAR(gamma(400.0), 1.499e-2, 0.03e-2);
  EXPECT_NEAR(gamma(700.0), 1.413e-2, 0.03e-2);
}

TEST(RayleighPhase, IntegratesToOne) {
  for (const double rho : {0.0, 0.0283, 0.3, 0.85}) {
    // Simpson is exact for a quadratic in the cosine.
    const double integral =
        2.0 * std::numbers::pi / 3.0 *
        (rayleigh_phase_per_sr(-1.0, rho) + 4.0 * rayleigh_phase_per_sr(0.0, rho) +
         rayleigh_phase_per_sr(1.0, rho));
    EXPECT_NEAR(integral, 1.0, 1e-14);
  }
}

TEST(RayleighPhase, WithoutDepolarisationIsTheDipole) {
  for (const double c : {-1.0, -0.3, 0.0, 0.7, 1.0}) {
    EXPECT_NEAR(rayleigh_phase_per_sr(c, 0.0), 3.0 * (1.0 + c * c) / (16.0 * std::numbers::pi),
                1e-16);
  }
}

TEST(RayleighPhase, IsSymmetricForwardAndBack) {
  for (const double c : {0.1, 0.5, 0.9}) {
    EXPECT_EQ(rayleigh_phase_per_sr(c, 0.0283), rayleigh_phase_per_sr(-c, 0.0283));
  }
}

// Unpolarised light scattered by 90 degrees: I(0) / I(90) = 2 / (1 + rho).
TEST(RayleighPhase, SidewaysScatteringShowsTheDepolarisation) {
  for (const double rho : {0.0, 0.0283, 0.4}) {
    EXPECT_NEAR(rayleigh_phase_per_sr(1.0, rho) / rayleigh_phase_per_sr(0.0, rho),
                2.0 / (1.0 + rho), 1e-13);
  }
}

TEST(RayleighCrossSection, RejectsWavelengthsOutOfRange) {
  EXPECT_THROW(rayleigh_cross_section_cm2(100.0, 1.05), std::invalid_argument);
  EXPECT_THROW(rayleigh_cross_section_cm2(std::nan(""), 1.05), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
