#include "aerosols/mixture_component.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "aerosols/component_table.h"
#include "aerosols/height_profile.h"
#include "aerosols/known_phases.h"
#include "aerosols/mixtures.h"

namespace twilight {
namespace {

// Refractive index of OPAC's dry water-soluble component.
RefractiveIndexTable dry_index(AerosolComponent component) {
  RefractiveIndexTable table;
  const ComponentState& dry = component_states(component).front();
  for (std::size_t i = 0; i < kRefractiveIndexWavelength_um.size(); ++i) {
    table.wavelength_nm.push_back(1e3 * kRefractiveIndexWavelength_um[i]);
    table.real.push_back(dry.real_index[i]);
    table.imaginary.push_back(dry.absorption_index[i]);
  }
  return table;
}

// WASO spelled as an own component: OPAC's mode radii over the dry one are the growth.
Microphysics water_soluble() {
  Microphysics m;
  m.name = "mine";
  const auto states = component_states(AerosolComponent::kWaterSoluble);
  m.sizes = states.front().sizes;
  m.sizes_text = "WASO";
  m.index = dry_index(AerosolComponent::kWaterSoluble);
  m.density_g_cm3 = 1.8;
  for (const ComponentState& s : states) {
    m.humidity_percent.push_back(s.relative_humidity_percent);
    m.radius_growth_factor.push_back(s.sizes.mode_radius_um / states.front().sizes.mode_radius_um);
  }
  return m;
}

Mixture of(const std::shared_ptr<const MixtureComponent>& component, double humidity) {
  return {{{component, 1.0}}, humidity};
}

TEST(MixtureComponent, OwnMicrophysicsOfWasoAreItsTable) {
  const auto own = own_component(water_soluble());
  KnownPhases known;
  const std::vector<double> nm = {300, 440, 550, 765, 870};
  const MixtureOptics mine = known.optics(of(own, 0), nm);
  const MixtureOptics table =
      known.optics(of(opac_component(AerosolComponent::kWaterSoluble), 0), nm);
  for (std::size_t w = 0; w < nm.size(); ++w) {
    EXPECT_NEAR(mine.scattering_per_km[w] / table.scattering_per_km[w], 1, 0.001);
    EXPECT_NEAR(mine.absorption_per_km[w] / table.absorption_per_km[w], 1, 0.002);
    EXPECT_NEAR(mine.asymmetry[w], table.asymmetry[w], 0.0005);
  }
  EXPECT_NEAR(*own->dry_mass_ug_per_m3() / 1.34e-3, 1.0, 0.01);  // Hess et al. (1998), Table 1c
}

// Water mixed by volume gives OPAC's humid indices and optics: its table rounds radii to three
// digits (1.5 % of the volume) and cuts the largest particles elsewhere.
TEST(MixtureComponent, WaterMixedByVolumeIsOpacsGrowth) {
  const auto own = own_component(water_soluble());
  const auto opac = opac_component(AerosolComponent::kWaterSoluble);
  for (std::size_t state = 1; state < own->humidities_percent().size(); ++state) {
    for (const double nm : {400.0, 550.0, 800.0}) {
      const auto mine = own->spheres(state, nm).index, theirs = opac->spheres(state, nm).index;
      EXPECT_NEAR(mine.real(), theirs.real(), 0.0025) << state << " " << nm;
      EXPECT_NEAR(mine.imag() / theirs.imag(), 1.0, 0.03) << state << " " << nm;
    }
  }
  KnownPhases known;
  const std::vector<double> nm = {550};
  for (const double humidity : {60.0, 80.0, 95.0}) {
    const MixtureOptics mine = known.optics(of(own, humidity), nm);
    const MixtureOptics theirs = known.optics(of(opac, humidity), nm);
    EXPECT_NEAR(mine.scattering_per_km[0] / theirs.scattering_per_km[0], 1.0, 0.02) << humidity;
    EXPECT_NEAR(mine.asymmetry[0], theirs.asymmetry[0], 0.005) << humidity;
  }
}

TEST(MixtureComponent, GrowthIsMonotoneInHumidity) {
  const auto own = own_component(water_soluble());
  KnownPhases known;
  const std::vector<double> nm = {550};
  double last = 0;
  for (double humidity = 0; humidity <= 99; humidity += 3) {
    const MixtureOptics optics = known.optics(of(own, humidity), nm);
    EXPECT_GT(optics.scattering_per_km[0], last) << humidity;
    last = optics.scattering_per_km[0];
  }
}

TEST(MixtureComponent, CoarseAreThoseWithLargeEffectiveRadius) {
  for (std::size_t i = 0; i < kAerosolComponents; ++i) {
    const auto component = static_cast<AerosolComponent>(i);
    const std::string_view code = component_code(component);
    const bool coarse = code == "INSO" || code == "SSCM" || code == "SSAM" || code == "MIAM" ||
                        code == "MICM" || code == "MITR";
    EXPECT_EQ(opac_component(component)->coarse(), coarse) << code;
  }
  // r_eff = r_mod exp(2.5 ln^2 sigma) of a whole lognormal distribution.
  const LognormalSizeDistribution sizes{0.1, 1.6, 1e-3, 50};
  const double width = std::log(1.6);
  EXPECT_NEAR(effective_radius_um(sizes) / (0.1 * std::exp(2.5 * width * width)), 1, 1e-5);
}

TEST(MixtureComponent, MatricesAreNormalisedWithTheAsymmetry) {
  KnownPhases known;
  const std::vector<double> nm = {450, 700};
  const auto own = own_component(water_soluble());
  Mixture mixed = of(own, 85);
  mixed.amounts.push_back({opac_component(AerosolComponent::kMineralTransported), 1e-4});
  const Mixture all[] = {of(own, 0), of(own, 73), mixed};
  const auto phases = known.phases(all, nm);
  const std::size_t held = known.size();
  for (std::size_t k = 0; k < std::size(all); ++k) {
    const MixtureOptics optics = known.optics(all[k], nm);
    for (std::size_t w = 0; w < nm.size(); ++w) {
      EXPECT_NEAR(phase_normalisation(phases[k][w]), 1, 1e-12);
      EXPECT_NEAR(phase_asymmetry(phases[k][w]), optics.asymmetry[w], 5e-4) << k << " " << w;
    }
  }
  // States are shared: another humidity between the same classes asks for no more.
  known.phases(std::vector{of(own, 74)}, nm);
  EXPECT_EQ(known.size(), held);
}

ParticleOptics imported(bool with_phase) {
  ParticleOptics table;
  table.name = "dust";
  table.relative_humidity_percent = {0};
  table.wavelength_nm = {400, 600, 900};
  for (const double s : {3.0, 2.0, 1.0}) table.optics.push_back({s, 0.1 * s, 0.7});
  if (!with_phase) return table;
  PhaseMatrix isotropic{{0, 1, std::numbers::pi}, {1, 1, 1}, {0, 0, 0}, {1, 1, -1}, {0, 0, 0}};
  table.phase.assign(3, isotropic);
  return table;
}

TEST(MixtureComponent, TablesAreInterpolatedAndKeptToTheirRange) {
  const auto table = table_component(imported(false), "a");
  const auto optics = table->tabulated(80, 500);
  ASSERT_TRUE(optics.has_value());
  EXPECT_DOUBLE_EQ(optics->scattering_per_km, 2.5);
  EXPECT_DOUBLE_EQ(optics->absorption_per_km, 0.25);
  EXPECT_THROW(table->tabulated(80, 399), std::invalid_argument);
  EXPECT_THROW(table->tabulated(80, 901), std::invalid_argument);
  EXPECT_FALSE(table->dry_mass_ug_per_m3());
}

// Without matrices: Henyey and Greenstein's, which polarise nothing.
TEST(MixtureComponent, TablesWithoutMatricesScatterAfterHenyeyAndGreenstein) {
  const PhaseMatrix phase = *table_component(imported(false), "a")->tabulated_phase(0, 500);
  EXPECT_NEAR(phase_normalisation(phase), 1, 1e-4);
  EXPECT_NEAR(phase_asymmetry(phase), 0.7, 1e-3);
  for (const double p12 : phase.p12) EXPECT_EQ(p12, 0);
  const PhaseMatrix own = *table_component(imported(true), "b")->tabulated_phase(0, 500);
  EXPECT_EQ(own.angle_rad.size(), phase_angles_rad().size());
  EXPECT_NEAR(phase_normalisation(own), 1, 1e-12);
  EXPECT_NEAR(own.p11[100], 1, 1e-12);
}

// A component's table taken as if it came from elsewhere is the component: exactly at its
// wavelengths, and at any humidity.
TEST(MixtureComponent, OpacsComponentAsATableIsTheComponent) {
  const std::vector<double> nm = {440, 550, 700};
  const auto opac = opac_component(AerosolComponent::kWaterSoluble);
  const auto table =
      table_component(component_table(AerosolComponent::kWaterSoluble, nm), "as a table");
  KnownPhases known;
  for (const double humidity : {0.0, 30.0, 80.0, 93.0}) {
    const MixtureOptics a = known.optics(of(opac, humidity), nm);
    const MixtureOptics b = known.optics(of(table, humidity), nm);
    const Mixture both[] = {of(opac, humidity), of(table, humidity)};
    const auto phases = known.phases(both, nm);
    for (std::size_t w = 0; w < nm.size(); ++w) {
      EXPECT_NEAR(b.scattering_per_km[w] / a.scattering_per_km[w], 1, 1e-12);
      EXPECT_NEAR(b.absorption_per_km[w] / a.absorption_per_km[w], 1, 1e-12);
      EXPECT_NEAR(b.asymmetry[w], a.asymmetry[w], 1e-12);
      for (std::size_t i = 0; i < phases[0][w].p11.size(); ++i) {
        ASSERT_NEAR(phases[1][w].p11[i], phases[0][w].p11[i], 1e-10 * phases[0][w].p11[i]);
      }
    }
  }
}

TEST(MixtureComponent, RefusesWhatItCannotHold) {
  Microphysics m = water_soluble();
  m.radius_growth_factor[0] = 1.1;
  EXPECT_THROW(own_component(m), std::invalid_argument);
  m = water_soluble();
  m.radius_growth_factor[3] = 1.0;
  EXPECT_THROW(own_component(m), std::invalid_argument);
  m = water_soluble();
  m.humidity_percent.back() = 99.5;
  EXPECT_THROW(own_component(m), std::invalid_argument);
  ParticleOptics table = imported(false);
  table.optics.pop_back();
  EXPECT_THROW(table_component(table, "c"), std::invalid_argument);
  EXPECT_EQ(find_opac_component("SALT"), nullptr);
}

TEST(HeightProfile, TabulatedExponentialIsTheExponentialLayer) {
  HeightProfile exponential;
  exponential.bottom_km = 1;
  exponential.top_km = 11;
  exponential.scale_height_km = 2;
  std::vector<double> heights, density;
  constexpr double kStep = 0.1;
  for (int i = 0; i <= 100; ++i) {
    heights.push_back(1 + kStep * i);
    density.push_back(std::exp(-heights.back() / 2));
  }
  const HeightProfile table = tabulated_profile(heights, density);
  // Trapezoids of a convex function: too high by step^2 / (12 scale^2).
  const double error = kStep * kStep / (12 * 4);
  EXPECT_NEAR(table.integral_km(0, 99) / exponential.integral_km(0, 99), 1 + error, 0.02 * error);
  EXPECT_NEAR(table.mean(3.03, 4.6) / exponential.mean(3.03, 4.6), 1, 2 * error);
  EXPECT_NEAR(table.at(7.0) / exponential.at(7.0), 1, 1e-12);
}

TEST(HeightProfile, TabulatedSlicesAddUp) {
  const HeightProfile profile = tabulated_profile({0.5, 1, 3, 4}, {0, 2, 1, 0});
  EXPECT_NEAR(profile.integral_km(0, 10), 0.5 + 3 + 0.5, 1e-14);
  double sum = 0;
  for (int i = 0; i < 60; ++i) sum += 0.07 * profile.mean(0.07 * i, 0.07 * (i + 1));
  EXPECT_NEAR(sum, 4, 1e-12);
  EXPECT_EQ(profile.at(0.4), 0);
  EXPECT_EQ(profile.at(4.0), 0);
  EXPECT_DOUBLE_EQ(profile.at(2.0), 1.5);
}

TEST(HeightProfile, RefusesBadTables) {
  EXPECT_THROW(tabulated_profile({1}, {1}), std::invalid_argument);
  EXPECT_THROW(tabulated_profile({1, 2}, {1}), std::invalid_argument);
  EXPECT_THROW(tabulated_profile({2, 1}, {1, 1}), std::invalid_argument);
  EXPECT_THROW(tabulated_profile({1, 2}, {1, -1}), std::invalid_argument);
  EXPECT_THROW(tabulated_profile({1, 2}, {0, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
