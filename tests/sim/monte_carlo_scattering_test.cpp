#include "sim/monte_carlo_scattering.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "sim/monte_carlo_random.h"
#include "sim/monte_carlo_stokes.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;

Medium one_layer(double air, double aerosol, double asymmetry) {
  Medium m;
  m.wavelength_nm = {550};
  m.boundary_km = {0, 1};
  for (LayerTable* t :
       {&m.air_scattering_per_km, &m.aerosol_scattering_per_km, &m.aerosol_absorption_per_km,
        &m.aerosol_asymmetry, &m.gas_absorption_per_km, &m.refractivity}) {
    *t = LayerTable(1, 1);
  }
  m.air_scattering_per_km(0, 0) = air;
  m.aerosol_scattering_per_km(0, 0) = aerosol;
  m.aerosol_asymmetry(0, 0) = asymmetry;
  m.depolarisation = {0.03};
  return m;
}

// A normalised table with the forward peak of Henyey-Greenstein, g = 0.7.
PhaseMatrix peaked_table() {
  PhaseMatrix p;
  constexpr int kAngles = 721;
  double sum = 0;
  for (int i = 0; i < kAngles; ++i) {
    const double t = kPi * i / (kAngles - 1);
    p.angle_rad.push_back(t);
    p.p11.push_back(0.51 / std::pow(1.49 - 1.4 * std::cos(t), 1.5));
  }
  for (int i = 0; i + 1 < kAngles; ++i) {  // the linear interpolant's integral, finely
    for (int k = 0; k < 20; ++k) {
      const double f = (k + 0.5) / 20;
      const auto a = static_cast<std::size_t>(i);
      const double t = p.angle_rad[a] + f * kPi / (kAngles - 1);
      sum +=
          0.5 * (p.p11[a] + f * (p.p11[a + 1] - p.p11[a])) * std::sin(t) * kPi / (kAngles - 1) / 20;
    }
  }
  for (double& v : p.p11) v /= sum;
  for (std::size_t i = 0; i < p.p11.size(); ++i) {
    p.p12.push_back(-0.3 * p.p11[i] * std::pow(std::sin(p.angle_rad[i]), 2));
    p.p33.push_back(0.8 * p.p11[i] * std::cos(p.angle_rad[i]));
    p.p34.push_back(0.1 * p.p11[i] * std::sin(p.angle_rad[i]));
  }
  return p;
}

Medium tabulated() {
  Medium m = one_layer(0, 1, 0.7);
  m.aerosol_phase = {{peaked_table()}};
  m.aerosol_kind_scattering_per_km = {m.aerosol_scattering_per_km};
  return m;
}

const std::vector<std::size_t> kReference = {0};

double phase(const MonteCarloScattering& s, double cosine) {
  std::array<double, 6> v{};
  s.matrices(0, cosine, 0, 1, true, {&v[0], &v[1], &v[2], &v[3], &v[4], &v[5]});
  return v[0];
}

TEST(MonteCarloScattering, DensitiesIntegrateToOneAndFollowThePhaseFunction) {
  for (const Medium& m :
       {one_layer(1, 0, 0), one_layer(0, 1, 0.75), one_layer(0.4, 0.6, -0.3), tabulated()}) {
    const MonteCarloScattering s(m, kReference);
    double density = 0, light = 0;
    constexpr int kSteps = 200000;
    for (int i = 0; i < kSteps; ++i) {
      const double c = -1 + 2 * (i + 0.5) / kSteps;
      density += 2 * kPi * s.density_per_sr(0, 0, c) * 2 / kSteps;
      light += 2 * kPi * phase(s, c) * 2 / kSteps;
      EXPECT_NEAR(phase(s, c) / s.density_per_sr(0, 0, c), 1, 0.05);
      if (HasFailure()) return;
    }
    EXPECT_NEAR(density, 1, 1e-3);
    EXPECT_NEAR(light, 1, 1e-3);  // coefficients add up to 1 per km
  }
}

TEST(MonteCarloScattering, SampledAnglesFollowTheDensity) {
  for (const Medium& m :
       {one_layer(1, 0, 0), one_layer(0, 1, 0.75), one_layer(0.4, 0.6, 0.6), tabulated()}) {
    const MonteCarloScattering s(m, kReference);
    constexpr int kBins = 20, kSamples = 200000;
    std::array<double, kBins> count{}, expected{};
    CounterRandom random(7);
    for (int i = 0; i < kSamples; ++i) {
      const double u = random.next(), v = random.next();
      const double c = s.sample_cosine(0, 0, u, v);
      const auto bin = static_cast<std::size_t>((c + 1) / 2 * kBins);
      ++count[std::min<std::size_t>(kBins - 1, bin)];
    }
    double chi_squared = 0;
    for (std::size_t b = 0; b < kBins; ++b) {
      constexpr int kFine = 2000;
      for (int i = 0; i < kFine; ++i) {
        const double c = -1 + 2 * (static_cast<double>(b) + (i + 0.5) / kFine) / kBins;
        expected[b] += kSamples * 2 * kPi * s.density_per_sr(0, 0, c) * 2 / kBins / kFine;
      }
      chi_squared += std::pow(count[b] - expected[b], 2) / expected[b];
    }
    EXPECT_LT(chi_squared, 45);  // 19 degrees of freedom: 1 in 1000
  }
}

TEST(MonteCarloScattering, MeanCosineOfHenyeyGreensteinIsG) {
  for (const double g : {-0.5, 0.0, 0.3, 0.85}) {
    const MonteCarloScattering s(one_layer(0, 1, g), kReference);
    CounterRandom random(3);
    double sum = 0;
    constexpr int kSamples = 200000;
    for (int i = 0; i < kSamples; ++i) {
      const double u = random.next(), v = random.next();
      sum += s.sample_cosine(0, 0, u, v) / kSamples;
    }
    EXPECT_NEAR(sum, g, 0.005);
  }
}

// Hansen & Travis (1974), eq. 2.15-2.16: at 90 degrees the polarisation of air is (1 - d) / (1 + d)
// with the depolarisation d.
TEST(MonteCarloScattering, AirPolarisesUpToItsDepolarisation) {
  const MonteCarloScattering s(one_layer(1, 0, 0), kReference);
  std::array<double, 6> v{};
  s.matrices(0, 0, 0, 1, false, {&v[0], &v[1], &v[2], &v[3], &v[4], &v[5]});
  EXPECT_NEAR(-v[4] / v[0], (1 - 0.03) / (1 + 0.03), 1e-12);
}

// The frame of light scattered across: electric field across the scattering plane.
TEST(MonteCarloStokes, RotationFollowsTheFieldOfADipole) {
  CounterRandom random(11);
  for (int i = 0; i < 200; ++i) {
    const auto any = [&] {
      return unit({random.next() - 0.5, random.next() - 0.5, random.next() - 0.5});
    };
    const Vec3 d = any(), in = any();
    const Vec3 axis = any_normal(d), second = cross(d, axis);
    const ScatteringFrame f = scattering_frame(d, axis, in);
    // Rayleigh at b1 = -a1: full polarisation across; U = -(axis . across) ...
    const Vec3 across = unit(cross(d, in));
    const double c = dot(across, axis), t = dot(across, second);
    EXPECT_NEAR(-f.cos2, c * c - t * t, 1e-9);
    EXPECT_NEAR(-f.sin2, 2 * c * t, 1e-9);
    EXPECT_NEAR(dot(f.axis_in, in), 0, 1e-12);
    EXPECT_NEAR(dot(f.axis_in, across), 0, 1e-9);
  }
}

}  // namespace
}  // namespace twilight
