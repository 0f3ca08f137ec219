#include "aerosols/phase_expansion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "aerosols/component_phase.h"
#include "aerosols/henyey_greenstein.h"

namespace twilight {
namespace {

// A matrix sampled at even steps of angle.
template <typename Elements>
PhaseMatrix sampled(int steps, Elements elements) {
  PhaseMatrix phase;
  for (int i = 0; i <= steps; ++i) {
    const double angle = std::numbers::pi * i / steps;
    const MatrixElements e = elements(std::cos(angle));
    phase.angle_rad.push_back(angle);
    phase.p11.push_back(e.a1);
    phase.p12.push_back(e.b1);
    phase.p33.push_back(e.a3);
    phase.p34.push_back(e.b2);
  }
  return phase;
}

// Closed forms (Hovenier, van der Mee & Domke 2004, App. B): P^3_02 = -sqrt(30)/4 x (1 - x^2),
// P^3_22 = (1 + x)^2 (3x - 2) / 4, P^3_2,-2 = (1 - x)^2 (3x + 2) / 4.
TEST(SphericalFunctions, ClosedForms) {
  for (const double x : {-1.0, -0.7, 0.0, 0.2, 0.9, 1.0}) {
    const SphericalFunctions p = spherical_functions(x, 3);
    EXPECT_NEAR(p.p00[3], 0.5 * (5.0 * x * x * x - 3.0 * x), 1e-14);
    EXPECT_NEAR(p.p02[2], -0.25 * std::sqrt(6.0) * (1.0 - x * x), 1e-14);
    EXPECT_NEAR(p.p02[3], -0.25 * std::sqrt(30.0) * x * (1.0 - x * x), 1e-14);
    EXPECT_NEAR(p.p22[3], 0.25 * (1.0 + x) * (1.0 + x) * (3.0 * x - 2.0), 1e-14);
    EXPECT_NEAR(p.p2m2[3], 0.25 * (1.0 - x) * (1.0 - x) * (3.0 * x + 2.0), 1e-14);
  }
}

// P^l_22 and P^l_2,-2 mirror each other: P^l_22(-x) = (-1)^l P^l_2,-2(x); forward all but P_02 = 1.
TEST(SphericalFunctions, SymmetryAndForwardValue) {
  const int degree = 500;
  const SphericalFunctions p = spherical_functions(0.3, degree);
  const SphericalFunctions mirrored = spherical_functions(-0.3, degree);
  const SphericalFunctions forward = spherical_functions(1.0, degree);
  for (std::size_t l = 2; l <= degree; ++l) {
    const double sign = l % 2 == 0 ? 1.0 : -1.0;
    EXPECT_NEAR(mirrored.p22[l], sign * p.p2m2[l], 1e-12);
    EXPECT_NEAR(mirrored.p02[l], sign * p.p02[l], 1e-12);
    EXPECT_NEAR(forward.p00[l], 1.0, 1e-12);
    EXPECT_NEAR(forward.p22[l], 1.0, 1e-12);
    EXPECT_NEAR(forward.p2m2[l], 0.0, 1e-12);
    EXPECT_NEAR(forward.p02[l], 0.0, 1e-12);
  }
}

// de Rooij & van der Stap (1984), Sec. 3.3: the coefficients of Rayleigh scattering.
TEST(PhaseExpansion, Rayleigh) {
  const PhaseMatrix phase = sampled(4000, [](double c) {
    return MatrixElements{0.75 * (1.0 + c * c), 0.0, 1.5 * c, 0.0, -0.75 * (1.0 - c * c), 0.0};
  });
  const PhaseExpansion e = expand(phase, 6);
  constexpr double kInterpolation = 1e-6;  // of 4000 linear pieces
  for (std::size_t l = 0; l <= 6; ++l) {
    EXPECT_NEAR(e.alpha1[l], l == 0 ? 1.0 : l == 2 ? 0.5 : 0.0, kInterpolation) << l;
    EXPECT_NEAR(e.alpha2[l], l == 2 ? 3.0 : 0.0, 2 * kInterpolation) << l;
    EXPECT_NEAR(e.alpha3[l], 0.0, 2 * kInterpolation) << l;
    EXPECT_NEAR(e.alpha4[l], l == 1 ? 1.5 : 0.0, kInterpolation) << l;
    EXPECT_NEAR(e.beta1[l], l == 2 ? 0.5 * std::sqrt(6.0) : 0.0, kInterpolation) << l;
    EXPECT_EQ(e.beta2[l], 0.0);
  }
}

// Legendre moments of Henyey and Greenstein are g^l.
TEST(PhaseExpansion, HenyeyGreensteinMoments) {
  constexpr double kG = 0.6;
  const PhaseMatrix phase = sampled(20000, [](double c) {
    return MatrixElements{4.0 * std::numbers::pi * henyey_greenstein(c, kG), 0, 0, 0, 0, 0};
  });
  const PhaseExpansion e = expand(phase, 40);
  for (std::size_t l = 0; l <= 40; ++l) {
    const double order = static_cast<double>(l);
    EXPECT_NEAR(e.alpha1[l] / (2.0 * order + 1.0), std::pow(kG, order), 1e-7) << l;
  }
}

// The first moments are exact integrals of the interpolant, whatever its grid.
TEST(PhaseExpansion, FirstMomentsOfAMieMatrix) {
  const PhaseMatrix phase =
      integrate_component_phase(component_states(AerosolComponent::kMineralCoarse)[0], 550.0, 40);
  const PhaseExpansion e = expand(phase, 3);
  EXPECT_NEAR(e.alpha1[0], 1.0, 1e-10);
  EXPECT_NEAR(e.alpha1[1] / 3.0, phase_asymmetry(phase), 1e-10);
}

// A fine mode needs few terms: the series gives the matrix back, and a2 = a1, a4 = a3 as spheres
// demand, though they come from different coefficients.
TEST(PhaseExpansion, RoundTripOfAMieMatrix) {
  const PhaseMatrix phase =
      integrate_component_phase(component_states(AerosolComponent::kSoot)[0], 550.0, 50);
  const PhaseExpansion e = expand(phase, 300);
  double largest = 0.0;
  for (std::size_t i = 0; i < phase.angle_rad.size(); ++i) {
    const MatrixElements back = evaluate(e, std::cos(phase.angle_rad[i]));
    for (const double difference :
         {back.a1 - phase.p11[i], back.a2 - phase.p11[i], back.a3 - phase.p33[i],
          back.a4 - phase.p33[i], back.b1 - phase.p12[i], back.b2 - phase.p34[i]}) {
      largest = std::max(largest, std::abs(difference));
    }
  }
  EXPECT_LT(largest, 2e-3);  // the interpolant's kinks at 1 degree steps
}

// Doubling the quadrature's parts through the degree leaves low coefficients alone.
TEST(PhaseExpansion, LowCoefficientsDoNotDependOnTheDegree) {
  const PhaseMatrix phase =
      integrate_component_phase(component_states(AerosolComponent::kMineralCoarse)[0], 550.0, 40);
  const PhaseExpansion low = expand(phase, 16);
  const PhaseExpansion high = expand(phase, 200);
  for (std::size_t l = 0; l <= 16; ++l) {
    EXPECT_NEAR(low.alpha1[l], high.alpha1[l], 1e-9);
    EXPECT_NEAR(low.alpha2[l], high.alpha2[l], 1e-9);
    EXPECT_NEAR(low.alpha3[l], high.alpha3[l], 1e-9);
    EXPECT_NEAR(low.beta1[l], high.beta1[l], 1e-9);
    EXPECT_NEAR(low.beta2[l], high.beta2[l], 1e-9);
  }
}

TEST(PhaseExpansion, RejectsNonsense) {
  PhaseMatrix phase = sampled(4, [](double) { return MatrixElements{1, 1, 0, 0, 0, 0}; });
  EXPECT_THROW(expand(phase, -1), std::invalid_argument);
  EXPECT_THROW(spherical_functions(1.5, 3), std::invalid_argument);
  EXPECT_THROW(spherical_functions(0.5, 5001), std::invalid_argument);
  phase.p34.pop_back();
  EXPECT_THROW(expand(phase, 4), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
