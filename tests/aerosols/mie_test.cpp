#include "aerosols/mie.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace twilight {
namespace {

using Index = std::complex<double>;  // n - i k

// C. F. Bohren & D. R. Huffman (1983), Absorption and Scattering of Light by Small Particles,
// Appendix A, sample output: sphere of m = 1.55, radius 0.525 um at 0.6328 um.
TEST(Mie, BohrenHuffmanSample) {
  const double x = 2.0 * std::numbers::pi * 0.525 / 0.6328;
  const MieEfficiencies q = mie_efficiencies(x, Index(1.55, 0.0));
  EXPECT_NEAR(q.extinction, 3.10543, 5e-6);
  EXPECT_NEAR(q.scattering, 3.10543, 5e-6);
  EXPECT_NEAR(q.backscatter, 2.92534, 5e-6);
}

// W. J. Wiscombe (1979), Mie Scattering Calculations, NCAR Tech. Note TN-140+STR: test cases
// over all sizes, absorbing and not, m above and below 1. Figures as printed there.
TEST(Mie, WiscombeTestCases) {
  struct Case {
    double x;
    Index m;
    double extinction, scattering, asymmetry;
  };
  const std::vector<Case> cases = {
      {0.099, {0.75, 0.0}, 7.417859e-6, 7.417859e-6, 0.001448},
      {10.0, {0.75, 0.0}, 2.232265, 2.232265, 0.896473},
      {1000.0, {0.75, 0.0}, 1.997908, 1.997908, 0.844944},
      {1.0, {1.33, -1e-5}, 0.0939520, 0.0939233, 0.184517},
      {100.0, {1.33, -1e-5}, 2.101321, 2.096594, 0.868959},
      {10000.0, {1.33, -1e-5}, 2.004089, 1.723857, 0.907840},
      {0.055, {1.5, -1.0}, 0.1014910, 1.131687e-5, 0.000491},
      {1.0, {1.5, -1.0}, 2.336321, 0.6634538, 0.192136},
      {100.0, {1.5, -1.0}, 2.097502, 1.283697, 0.850252},
      {10000.0, {1.5, -1.0}, 2.004368, 1.236574, 0.846310},
      {1.0, {10.0, -10.0}, 2.532993, 2.049405, -0.110664},
      {100.0, {10.0, -10.0}, 2.071124, 1.836785, 0.556215},
      {10000.0, {10.0, -10.0}, 2.005914, 1.795393, 0.548194},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.x);
    const MieEfficiencies q = mie_efficiencies(c.x, c.m);
    EXPECT_NEAR(q.extinction, c.extinction, 1e-6 * c.extinction);
    EXPECT_NEAR(q.scattering, c.scattering, 1e-6 * c.scattering);
    EXPECT_NEAR(q.asymmetry, c.asymmetry, 6e-7);
  }
}

// Bohren & Huffman (1983), Eqs. 5.8 and 5.9: with a = (m^2 - 1) / (m^2 + 2), a small sphere
// has Qsca = 8/3 x^4 |a|^2 and Qabs = 4 x Im a (m = n + i k), up to relative order x^2.
TEST(Mie, RayleighLimit) {
  for (const Index m : {Index(1.33, 0.0), Index(1.53, -0.008), Index(1.75, -0.44)}) {
    for (const double x : {1e-4, 1e-3, 1e-2}) {
      SCOPED_TRACE(std::to_string(m.real()) + " at x = " + std::to_string(x));
      const Index n_plus_ik = std::conj(m);
      const Index a = (n_plus_ik * n_plus_ik - 1.0) / (n_plus_ik * n_plus_ik + 2.0);
      const MieEfficiencies q = mie_efficiencies(x, m);
      const double tolerance = 5.0 * x * x + 1e-9;
      EXPECT_NEAR(q.scattering / (8.0 / 3.0 * std::pow(x, 4) * std::norm(a)), 1.0, tolerance);
      if (m.imag() != 0.0) {
        EXPECT_NEAR(q.absorption / (4.0 * x * a.imag()), 1.0, tolerance);
      }
      EXPECT_NEAR(q.asymmetry, 0.0, x * x);
    }
  }
}

// A sphere far larger than the wavelength removes twice the light that falls on it; the
// excess over 2 is the edge term 1.9924 x^(-2/3) (Nussenzveig & Wiscombe 1980, Phys. Rev.
// Lett. 45, 1490) where absorption kills the light that went through.
TEST(Mie, ExtinctionParadox) {
  for (const double x : {1000.0, 3000.0, 5000.0, 10000.0}) {
    const double edge = 1.9923861 * std::pow(x, -2.0 / 3.0);
    EXPECT_NEAR(mie_efficiencies(x, Index(1.5, -0.1)).extinction, 2.0 + edge, 0.02 * edge);
    EXPECT_NEAR(mie_efficiencies(x, Index(1.33, 0.0)).extinction, 2.0, 0.05);
  }
}

std::vector<double> sizes() {
  return {1e-4, 0.01, 0.3, 0.9999, 1.0, 3.2, 17.0, 140.0, 1900.0, 5000.0};
}

TEST(Mie, TransparentSphereConservesEnergy) {
  // Extinction from the forward amplitude (optical theorem), scattering from the sum of
  // squares: two series that agree only if no energy is lost.
  const double forward[] = {1.0};
  for (const double x : sizes()) {
    for (const double n : {0.75, 1.33, 1.55}) {
      SCOPED_TRACE(x);
      const MieEfficiencies q = mie_efficiencies(x, Index(n, 0.0));
      const MieAmplitudes s = mie_amplitudes(x, Index(n, 0.0), forward).front();
      EXPECT_EQ(q.absorption, 0.0);
      EXPECT_EQ(q.extinction, q.scattering);
      EXPECT_NEAR(4.0 / (x * x) * s.s1.real() / q.scattering, 1.0, 1e-10);
    }
  }
}

TEST(Mie, OpticalTheorem) {
  const double forward[] = {1.0};
  for (const double x : sizes()) {
    for (const Index m : {Index(1.33, -1e-5), Index(1.53, -0.008), Index(1.75, -0.44)}) {
      SCOPED_TRACE(x);
      const MieEfficiencies q = mie_efficiencies(x, m);
      const MieAmplitudes s = mie_amplitudes(x, m, forward).front();
      EXPECT_NEAR(4.0 / (x * x) * s.s1.real() / q.extinction, 1.0, 1e-10);
      EXPECT_NEAR(std::abs(s.s1 - s.s2) / std::abs(s.s1), 0.0, 1e-10);
      EXPECT_GT(q.absorption, 0.0);
      EXPECT_GE(q.scattering, 0.0);
    }
  }
}

TEST(Mie, BackscatterIsTheBackwardAmplitude) {
  const double backward[] = {-1.0};
  for (const double x : {0.3, 3.2, 17.0, 140.0}) {
    const Index m(1.45, -0.003);
    const MieAmplitudes s = mie_amplitudes(x, m, backward).front();
    const double q_back = 4.0 / (x * x) * std::norm(s.s1);
    EXPECT_NEAR(mie_efficiencies(x, m).backscatter / q_back, 1.0, 1e-9);
  }
}

// Unit normalisation and mean cosine of the phase function, by integration over angle.
TEST(Mie, PhaseFunctionNormalizedWithItsAsymmetry) {
  for (const double x : {0.01, 0.8, 5.0, 60.0}) {
    const Index m(1.53, -0.008);
    const int steps = 100000;
    std::vector<double> cosine;
    for (int i = 0; i < steps; ++i)
      cosine.push_back(std::cos(std::numbers::pi * (i + 0.5) / steps));
    const std::vector<double> p = mie_phase_function(x, m, cosine);
    double norm = 0.0, mean = 0.0;
    for (int i = 0; i < steps; ++i) {
      const double solid_angle = 2.0 * std::numbers::pi * std::numbers::pi / steps *
                                 std::sin(std::numbers::pi * (i + 0.5) / steps);
      norm += p[static_cast<std::size_t>(i)] * solid_angle;
      mean += p[static_cast<std::size_t>(i)] * cosine[static_cast<std::size_t>(i)] * solid_angle;
    }
    EXPECT_NEAR(norm, 1.0, 1e-6);
    EXPECT_NEAR(mean, mie_efficiencies(x, m).asymmetry, 1e-6);
  }
}

// The two ways to the Riccati-Bessel functions meet at x = 1.
TEST(Mie, ContinuousWhereTheRecurrenceChanges) {
  for (const Index m : {Index(1.33, 0.0), Index(1.75, -0.44)}) {
    const MieEfficiencies below = mie_efficiencies(std::nextafter(1.0, 0.0), m);
    const MieEfficiencies above = mie_efficiencies(1.0, m);
    EXPECT_NEAR(below.scattering / above.scattering, 1.0, 1e-12);
    EXPECT_NEAR(below.extinction / above.extinction, 1.0, 1e-12);
    EXPECT_NEAR(below.asymmetry, above.asymmetry, 1e-12);
  }
}

TEST(Mie, RejectsValuesOutOfRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(mie_efficiencies(0.0, Index(1.5, 0.0)), std::invalid_argument);
  EXPECT_THROW(mie_efficiencies(2e4, Index(1.5, 0.0)), std::invalid_argument);
  EXPECT_THROW(mie_efficiencies(nan, Index(1.5, 0.0)), std::invalid_argument);
  EXPECT_THROW(mie_efficiencies(1.0, Index(0.0, 0.0)), std::invalid_argument);
  EXPECT_THROW(mie_efficiencies(1.0, Index(1.5, 0.01)), std::invalid_argument);  // gain
  const double bad_cosine[] = {1.5};
  EXPECT_THROW(mie_amplitudes(1.0, Index(1.5, 0.0), bad_cosine), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
