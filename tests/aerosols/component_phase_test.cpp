#include "aerosols/component_phase.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "aerosols/amplitude_sum.h"
#include "aerosols/component_mie.h"
#include "aerosols/component_optics.h"
#include "aerosols/mie.h"
#include "aerosols/mixtures.h"
#include "tests/aerosols/opac_volume_phase.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

std::string name(std::size_t state) {
  const ComponentState& s = component_states()[state];
  return std::string(component_code(s.component)) + " " +
         std::to_string(static_cast<int>(s.relative_humidity_percent)) + " %";
}

// Every state once, at a wavelength that changes from state to state.
std::vector<StateAtWavelength> all_states() {
  std::vector<StateAtWavelength> wanted;
  const double nm[] = {300.0, 440.0, 550.0, 700.0, 1000.0};
  for (std::size_t i = 0; i < kComponentStates; ++i) wanted.push_back({i, nm[i % 5]});
  return wanted;
}

const std::vector<PhaseMatrix>& phases_of_all_states() {
  static const std::vector<PhaseMatrix> phases = component_phases(all_states());
  return phases;
}

double at(const PhaseMatrix& phase, const std::vector<double>& element, double angle_rad) {
  const auto above =
      std::upper_bound(phase.angle_rad.begin() + 1, phase.angle_rad.end() - 1, angle_rad);
  const auto i = static_cast<std::size_t>(above - phase.angle_rad.begin()) - 1;
  return std::lerp(
      element[i], element[i + 1],
      (angle_rad - phase.angle_rad[i]) / (phase.angle_rad[i + 1] - phase.angle_rad[i]));
}

void expect_scattering_matrix(const PhaseMatrix& p) {
  ASSERT_EQ(p.angle_rad.front(), 0.0);
  ASSERT_EQ(p.angle_rad.back(), std::numbers::pi);
  EXPECT_NEAR(phase_normalisation(p), 1.0, 1e-11);  // rounding of peaks of 1e5
  EXPECT_EQ(p.p12.front(), 0.0);
  EXPECT_EQ(p.p12.back(), 0.0);
  EXPECT_EQ(p.p33.front(), p.p11.front());
  EXPECT_EQ(p.p33.back(), -p.p11.back());
  for (std::size_t i = 0; i < p.angle_rad.size(); ++i) {
    if (i > 0) {
      ASSERT_GT(p.angle_rad[i], p.angle_rad[i - 1]);
    }
    const double polarised = p.p12[i] * p.p12[i] + p.p33[i] * p.p33[i] + p.p34[i] * p.p34[i];
    EXPECT_GT(p.p11[i], 0.0);
    EXPECT_LE(polarised, p.p11[i] * p.p11[i] * (1.0 + 1e-12)) << p.angle_rad[i] / kRadPerDeg;
  }
}

// The sums over many spheres at once are Bohren & Huffman (1983), Eq. 4.74, sphere by sphere.
TEST(PairedAmplitudes, AreTheAmplitudesOfEachSphere) {
  const std::vector<double> cosine = {1.0, 0.99, 0.5, 0.1, 0.0};
  const std::complex<double> m(1.4, -0.01);
  const std::vector<double> x = {0.05, 0.7, 3.0, 11.0, 90.0, 400.0};
  std::vector<MieSeries> series;
  for (const double s : x) series.push_back(mie_series(s, m));
  const AngularFunctions functions(cosine, 500);
  const auto sums = paired_amplitudes(functions, series);
  for (std::size_t j = 0; j < cosine.size(); ++j) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double both[] = {cosine[j], -cosine[j]};
      const auto expected = mie_amplitudes(x[i], m, both);
      for (const int k : {0, 1}) {
        const double sign = k == 0 ? 1.0 : -1.0;
        const std::complex<double> s1(sums[j].s1_even_re[i] + sign * sums[j].s1_odd_re[i],
                                      sums[j].s1_even_im[i] + sign * sums[j].s1_odd_im[i]);
        const std::complex<double> s2(sums[j].s2_even_re[i] + sign * sums[j].s2_odd_re[i],
                                      sums[j].s2_even_im[i] + sign * sums[j].s2_odd_im[i]);
        const auto& e = expected[static_cast<std::size_t>(k)];
        const double scale = std::abs(mie_amplitudes(x[i], m, std::vector{1.0})[0].s1);
        EXPECT_NEAR(std::abs(s1 - e.s1) / scale, 0.0, 1e-11) << x[i] << ' ' << both[k];
        EXPECT_NEAR(std::abs(s2 - e.s2) / scale, 0.0, 1e-11) << x[i] << ' ' << both[k];
      }
    }
  }
}

TEST(PairedAmplitudes, RejectsWhatDoesNotFit) {
  EXPECT_THROW(AngularFunctions(std::vector{-0.1}, 4), std::invalid_argument);
  const AngularFunctions few(std::vector{0.5}, 4);
  const std::vector<MieSeries> large = {mie_series(50.0, {1.5, 0.0})};
  EXPECT_THROW(paired_amplitudes(few, large), std::invalid_argument);
  const std::vector<MieSeries> many(kSpheresTogether + 1, mie_series(0.1, {1.5, 0.0}));
  EXPECT_THROW(paired_amplitudes(few, many), std::invalid_argument);
}

// Bohren & Huffman (1983), Sec. 5.2: spheres far smaller than the wavelength scatter as
// p11 = 3/4 (1 + cos^2), p12 = -3/4 sin^2, p33 = 3/2 cos, p34 = 0.
TEST(ComponentPhase, TinySpheresAreRayleighs) {
  ComponentState tiny = component_states(AerosolComponent::kInsoluble)[0];
  tiny.sizes = {0.0005, 1.2, 0.0002, 0.001};
  const PhaseMatrix p = integrate_component_phase(tiny, 1000.0, 20);
  for (std::size_t i = 0; i < p.angle_rad.size(); ++i) {
    const double c = std::cos(p.angle_rad[i]);
    EXPECT_NEAR(p.p11[i], 0.75 * (1.0 + c * c), 2e-4);
    EXPECT_NEAR(p.p12[i] / p.p11[i], -(1.0 - c * c) / (1.0 + c * c), 1e-4);
    EXPECT_NEAR(p.p33[i] / p.p11[i], 2.0 * c / (1.0 + c * c), 1e-4);
    EXPECT_NEAR(p.p34[i], 0.0, 1e-4);
  }
}

TEST(ComponentPhase, IsAScatteringMatrixForEveryState) {
  const auto wanted = all_states();
  const auto& phases = phases_of_all_states();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    SCOPED_TRACE(name(i));
    expect_scattering_matrix(phases[i]);
  }
}

// Linear interpolation in angle of a curved peak raises the mean cosine by up to 1.2e-4.
TEST(ComponentPhase, MeanCosineIsTheAsymmetryOfTheTable) {
  const auto wanted = all_states();
  const auto& phases = phases_of_all_states();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const ComponentState& state = component_states()[i];
    const double expected =
        component_optics(state.component, state.relative_humidity_percent, wanted[i].wavelength_nm)
            .asymmetry;
    EXPECT_NEAR(phase_asymmetry(phases[i]), expected, 2e-4) << name(i);
  }
}

// One size by the plain route: mie_phase_function() weighted with scattering cross sections, whose
// normalisation is exact. What is left is the correction that makes the interpolant's integral 1.
TEST(ComponentPhase, IsTheAveragedMiePhaseFunction) {
  for (const auto component : {AerosolComponent::kWaterSoluble, AerosolComponent::kMineralCoarse}) {
    const ComponentState& state = component_states(component)[0];
    constexpr double kWavelength_nm = 550.0;
    constexpr int kRadii = 40;
    const PhaseMatrix phase = integrate_component_phase(state, kWavelength_nm, kRadii);
    std::vector<double> cosine, sum(phase.angle_rad.size(), 0.0);
    for (const double a : phase.angle_rad) cosine.push_back(std::cos(a));
    double scattering = 0.0;
    const double span = std::log(state.sizes.largest_radius_um / state.sizes.smallest_radius_um);
    const int n = static_cast<int>(std::ceil(span * kRadii));
    for (int i = 0; i < n; ++i) {
      const double r = state.sizes.smallest_radius_um * std::exp(span * (i + 0.5) / n);
      const double x = 2.0 * std::numbers::pi * r / (1e-3 * kWavelength_nm);
      const std::complex<double> m = refractive_index(state, kWavelength_nm);
      const double weight =
          mie_efficiencies(x, m).scattering * r * r * state.sizes.per_log_radius(r);
      const auto p = mie_phase_function(x, m, cosine);
      for (std::size_t j = 0; j < sum.size(); ++j) sum[j] += 4.0 * std::numbers::pi * weight * p[j];
      scattering += weight;
    }
    const double correction = phase.p11[50] * scattering / sum[50];
    EXPECT_NEAR(correction, 1.0, 1e-3) << component_code(component);
    for (std::size_t j = 0; j < sum.size(); ++j) {
      EXPECT_NEAR(phase.p11[j] * scattering / sum[j], correction, 1e-9);
    }
  }
}

TEST(ComponentPhase, AsPublishedByOpac) {
  for (const auto& row : opac::kPublishedPhase) {
    const std::span<const ComponentState> states = component_states(row.component);
    const auto first = static_cast<std::size_t>(states.data() - component_states().data());
    std::size_t i = 0;
    while (states[i].relative_humidity_percent != row.humidity_percent) ++i;
    const StateAtWavelength wanted{first + i, 550.0};
    const PhaseMatrix phase = component_phases({&wanted, 1})[0];
    const double per_km_sr =
        component_optics(row.component, row.humidity_percent, 550.0).scattering_per_km /
        (4.0 * std::numbers::pi);
    for (std::size_t k = 0; k < row.per_km_sr.size(); ++k) {
      const double ours = per_km_sr * at(phase, phase.p11, opac::kPhaseAngle_deg[k] * kRadPerDeg);
      EXPECT_NEAR(ours / row.per_km_sr[k], 1.0, row.noise)
          << name(first + i) << " at " << opac::kPhaseAngle_deg[k];
    }
  }
}

// Twice the radii change the matrix by less than the bounds of the documentation.
TEST(ComponentPhase, ConvergedInTheNumberOfRadii) {
  const auto compare = [](AerosolComponent component, std::size_t humidity, double tolerance) {
    const ComponentState& state = component_states(component)[humidity];
    const int radii = phase_radii_per_efold(component);
    const PhaseMatrix p = integrate_component_phase(state, 550.0, radii);
    const PhaseMatrix fine = integrate_component_phase(state, 550.0, 2 * radii);
    for (std::size_t i = 0; i < p.angle_rad.size(); ++i) {
      if (p.angle_rad[i] < 3.0 * kRadPerDeg) continue;
      EXPECT_NEAR(p.p11[i] / fine.p11[i], 1.0, tolerance) << p.angle_rad[i] / kRadPerDeg;
      EXPECT_NEAR((p.p12[i] - fine.p12[i]) / fine.p11[i], 0.0, tolerance);
      EXPECT_NEAR((p.p33[i] - fine.p33[i]) / fine.p11[i], 0.0, tolerance);
      EXPECT_NEAR((p.p34[i] - fine.p34[i]) / fine.p11[i], 0.0, tolerance);
    }
  };
  compare(AerosolComponent::kInsoluble, 0, 1e-4);
  compare(AerosolComponent::kWaterSoluble, 3, 1e-4);
  compare(AerosolComponent::kMineralCoarse, 0, 5e-4);
  compare(AerosolComponent::kSulfate, 3, 1e-3);
  compare(AerosolComponent::kSeaSaltAccumulation, 3, 1e-3);
  compare(AerosolComponent::kSeaSaltCoarse, 3, 3e-3);
}

TEST(ComponentPhase, RejectsValuesOutOfRange) {
  const ComponentState& state = component_states()[0];
  EXPECT_THROW(integrate_component_phase(state, 249.0, 10), std::invalid_argument);
  EXPECT_THROW(integrate_component_phase(state, 550.0, 0), std::invalid_argument);
  const StateAtWavelength unknown{kComponentStates, 550.0};
  EXPECT_THROW(component_phases({&unknown, 1}), std::invalid_argument);
}

TEST(MixturePhase, IsAScatteringMatrixWithTheLayersAsymmetry) {
  const std::vector<double> nm = {380.0, 780.0};
  const std::pair<const char*, double> cases[] = {{"continental_average", 0.0},
                                                  {"continental_average", 30.0},
                                                  {"continental_polluted", 93.0},
                                                  {"urban", 99.0},
                                                  {"desert", 80.0},
                                                  {"antarctic", 85.0}};
  for (const auto& [type, humidity] : cases) {
    SCOPED_TRACE(std::string(type) + " " + std::to_string(humidity));
    const auto phases = opac_aerosol_phases(type, humidity, nm);
    const auto layers = opac_aerosol_layers(type, humidity, nm);
    ASSERT_EQ(phases.size(), layers.size());
    for (std::size_t i = 0; i < layers.size(); ++i) {
      ASSERT_EQ(phases[i].size(), nm.size());
      for (std::size_t w = 0; w < nm.size(); ++w) {
        expect_scattering_matrix(phases[i][w]);
        EXPECT_NEAR(phase_asymmetry(phases[i][w]), layers[i].asymmetry[w], 3e-4);
      }
    }
  }
}

// The stratosphere of every type is dry sulfate alone.
TEST(MixturePhase, OfOneComponentIsThatComponents) {
  const std::vector<double> nm = {550.0};
  const auto phases = opac_aerosol_phases("continental_clean", 70.0, nm);
  const auto states = component_states(AerosolComponent::kSulfate);
  const StateAtWavelength sulfate{
      static_cast<std::size_t>(states.data() - component_states().data()), 550.0};
  const PhaseMatrix alone = component_phases({&sulfate, 1})[0];
  for (std::size_t i = 0; i < alone.p11.size(); ++i) {
    EXPECT_NEAR(phases[2][0].p11[i] / alone.p11[i], 1.0, 1e-14);
    EXPECT_NEAR(phases[2][0].p34[i] - alone.p34[i], 0.0, 1e-14);
  }
}

TEST(MixturePhase, NoneIsEmptyAndNonsenseThrows) {
  const std::vector<double> nm = {550.0};
  EXPECT_TRUE(opac_aerosol_phases("none", 80.0, nm).empty());
  EXPECT_THROW(opac_aerosol_phases("fog", 80.0, nm), std::invalid_argument);
  EXPECT_THROW(opac_aerosol_phases("urban", 99.5, nm), std::invalid_argument);
  EXPECT_THROW(opac_aerosol_phases("urban", 80.0, std::vector{1001.0}), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
