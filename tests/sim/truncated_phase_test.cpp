#include "sim/truncated_phase.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "aerosols/component_phase.h"
#include "aerosols/henyey_greenstein.h"
#include "aerosols/phase_expansion.h"
#include "sim/phase_table.h"
#include "small_scene.h"
#include "solar/limb_darkening.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kDegree = pi / 180;
constexpr std::size_t kLanes = 8;

// Three layers of haze about one of pure air; two wavelengths.
Medium hazy(double bottom, double middle, double top) {
  Medium m = layered_air(40, {0.01, 0.01, 0.001, 0.001}, 0, 2);
  const double g[4] = {bottom, middle, 0.5, top};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t w = 0; w < 2; ++w) {
      m.aerosol_asymmetry(i, w) = g[i] - 0.02 * static_cast<double>(w);
      m.aerosol_scattering_per_km(i, w) = i == 2 ? 0 : 0.1 / static_cast<double>(1 + i + w);
    }
  }
  return m;
}

Medium with_sulfate() {
  Medium m = hazy(0.7, 0.7, 0.7);
  std::vector<PhaseMatrix> kind;
  for (const ComponentState& state : component_states()) {
    if (state.component != AerosolComponent::kSulfate) continue;
    for (const double nm : {450.0, 650.0}) {
      kind.push_back(integrate_component_phase(state, nm, 100));
    }
    break;
  }
  m.aerosol_phase = {kind};
  m.aerosol_kind_scattering_per_km = {m.aerosol_scattering_per_km};
  return m;
}

TEST(AerosolKinds, LayersOfOneAsymmetryAreOneKindAndAddUp) {
  const Medium m = hazy(0.7, 0.6, 0.7);
  const AerosolKinds kinds = aerosol_kinds(m);
  ASSERT_EQ(kinds.scattering_per_km.size(), 2U);  // not 3: pure air's asymmetry does not count
  ASSERT_EQ(kinds.asymmetry.size(), 2U);
  EXPECT_TRUE(kinds.phase.empty());
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < 2; ++w) {
      double sum = 0;
      for (std::size_t q = 0; q < 2; ++q) {
        const double here = kinds.scattering_per_km[q](i, w);
        if (here > 0) {
          EXPECT_EQ(kinds.asymmetry[q][w], m.aerosol_asymmetry(i, w));
        }
        sum += here;
      }
      EXPECT_EQ(sum, m.aerosol_scattering_per_km(i, w));
    }
  }
  EXPECT_TRUE(aerosol_kinds(layered_air(40, {0.01, 0.01})).scattering_per_km.empty());
}

TEST(TruncatedPhase, HenyeyGreensteinKeepsItsLowerMoments) {
  const Medium m = hazy(0.7, 0.7, 0.7);
  const AerosolKinds kinds = aerosol_kinds(m);
  for (const int degree : {2, 8, 20}) {
    const auto phases = truncate_phases(kinds, degree, kLanes);
    ASSERT_EQ(phases.size(), 1U);
    for (std::size_t w = 0; w < 2; ++w) {
      const double g = m.aerosol_asymmetry(0, w), f = phases[0].peak[w];
      EXPECT_NEAR(f, std::pow(g, degree + 1), 1e-15);
      EXPECT_NEAR(phases[0].a1[w], 1, 1e-14);
      for (int l = 0; l <= degree; ++l) {
        const std::size_t at = static_cast<std::size_t>(l) * kLanes + w;
        EXPECT_NEAR(f * (2 * l + 1) + (1 - f) * phases[0].a1[at], (2 * l + 1) * std::pow(g, l),
                    1e-13);
        EXPECT_EQ(phases[0].b1[at], 0);
        EXPECT_EQ(phases[0].a2[at], 0);
        EXPECT_EQ(phases[0].a3[at], 0);
      }
    }
  }
}

// The peak scatters straight on and leaves polarisation as it is: a1, a2, a3 alike, b1 not at all.
TEST(TruncatedPhase, MatrixKeepsItsLowerMoments) {
  const Medium m = with_sulfate();
  const AerosolKinds kinds = aerosol_kinds(m);
  for (const int degree : {4, 12}) {
    const auto phases = truncate_phases(kinds, degree, kLanes);
    ASSERT_EQ(phases.size(), 1U);
    const TruncatedPhase& p = phases[0];
    for (std::size_t w = 0; w < 2; ++w) {
      const PhaseExpansion full = expand(m.aerosol_phase[0][w], degree + 1);
      const double f = p.peak[w];
      EXPECT_NEAR(f, full.alpha1.back() / (2 * degree + 3), 1e-13);
      EXPECT_NEAR(p.a1[w], 1, 1e-9);
      for (int l = 0; l <= degree; ++l) {
        const auto row = static_cast<std::size_t>(l);
        const std::size_t at = row * kLanes + w;
        EXPECT_NEAR(f * (2 * l + 1) + (1 - f) * p.a1[at], full.alpha1[row], 1e-12);
        if (l < 2) continue;
        EXPECT_NEAR(f * (2 * l + 1) + (1 - f) * p.a2[at], full.alpha2[row], 1e-12);
        EXPECT_NEAR(f * (2 * l + 1) + (1 - f) * p.a3[at], full.alpha3[row], 1e-12);
        EXPECT_NEAR((1 - f) * p.b1[at], -full.beta1[row], 1e-12);
      }
    }
  }
}

// Extinction falls by the peak and by nothing else: what is absorbed stays.
TEST(TruncatedPhase, MediumLosesThePeakAlone) {
  Medium m = hazy(0.8, 0.6, 0.7);
  m.aerosol_absorption_per_km = LayerTable(4, 2, 0.01);
  OrdersOptions options;
  options.phase_degree = 6;
  const std::vector<double> black(2, 0.0);
  const OrdersMedium orders = make_orders_medium(m, black, options);
  EXPECT_EQ(orders.optics.kinds, 3U);
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t w = 0; w < 2; ++w) {
      const double peak = std::pow(m.aerosol_asymmetry(i, w), 7);
      const double kept = m.aerosol_scattering_per_km(i, w) * (1 - peak);
      EXPECT_NEAR(orders.truncated.aerosol_scattering_per_km(i, w), kept, 1e-15);
      EXPECT_NEAR(orders.optics.extinction_per_km[i * orders.lanes + w],
                  m.extinction_per_km(i, w) - m.aerosol_scattering_per_km(i, w) + kept, 1e-15);
      double scattering = 0;
      for (std::size_t q = 0; q <= orders.optics.kinds; ++q) {
        scattering +=
            orders.optics.scattering_per_km[(i * (1 + orders.optics.kinds) + q) * orders.lanes + w];
      }
      EXPECT_NEAR(scattering, m.air_scattering_per_km(i, w) + kept, 1e-15);
    }
  }
}

struct Tables {
  AerosolKinds kinds;
  OrdersMedium medium;
  OrdersOptions options;
  Tables(const Medium& m, bool disc) : kinds(aerosol_kinds(m)) {
    options.phase_degree = 10;
    options.disc_average = disc;
    medium = make_orders_medium(m, std::vector<double>(2, 0.0), options);
  }
  PhaseTable table(bool truncated) const { return {kinds, medium, options, truncated}; }
};

double p11_at(const PhaseTable& table, double angle, std::size_t w, std::size_t kind = 0) {
  std::vector<float> p11(kLanes), p12(kLanes);
  table.at(kind, angle, p11.data(), p12.data());
  return static_cast<double>(p11[w]);
}

TEST(PhaseTable, HenyeyGreensteinIsItsClosedForm) {
  const Medium m = hazy(0.75, 0.75, 0.75);
  const PhaseTable table = Tables(m, false).table(false);
  for (double angle = 0; angle <= 180; angle += 0.073) {
    for (std::size_t w = 0; w < 2; ++w) {
      const double want =
          4 * pi * henyey_greenstein(std::cos(angle * kDegree), m.aerosol_asymmetry(0, w));
      EXPECT_NEAR(p11_at(table, angle * kDegree, w) / want, 1, 2e-6) << angle;
    }
  }
}

TEST(PhaseTable, MatrixIsItsTable) {
  const Medium m = with_sulfate();
  const PhaseTable table = Tables(m, false).table(false);
  std::vector<float> p11(kLanes), p12(kLanes);
  for (std::size_t w = 0; w < 2; ++w) {
    const PhaseMatrix& phase = m.aerosol_phase[0][w];
    for (std::size_t k = 0; k < phase.angle_rad.size(); ++k) {
      table.at(0, phase.angle_rad[k], p11.data(), p12.data());
      EXPECT_NEAR(static_cast<double>(p11[w]), phase.p11[k], 2e-4 * phase.p11[k]);
      EXPECT_NEAR(static_cast<double>(p12[w]), phase.p12[k], 2e-4 * phase.p11[k]);
    }
  }
}

TEST(PhaseTable, TruncatedIsTheLegendreSeriesWithoutThePeak) {
  const Medium m = hazy(0.75, 0.75, 0.75);
  const Tables tables(m, true);
  const PhaseTable table = tables.table(true);
  for (std::size_t w = 0; w < 2; ++w) {
    const double g = m.aerosol_asymmetry(0, w), f = std::pow(g, 11);
    for (double angle = 0; angle <= 180; angle += 0.5) {
      double want = 0;
      for (unsigned l = 0; l <= 10; ++l) {
        want += (2 * l + 1) * (std::pow(g, l) - f) * std::legendre(l, std::cos(angle * kDegree));
      }
      EXPECT_NEAR(p11_at(table, angle * kDegree, w), want, 2e-5) << angle;
    }
  }
}

// The Sun's disc blunts the forward peak and nothing else. Next to the Sun: a 2-D integral.
TEST(PhaseTable, DiscMattersNearTheSunAlone) {
  const Medium m = hazy(0.95, 0.95, 0.95);
  const PhaseTable point = Tables(m, false).table(false), disc = Tables(m, true).table(false);
  const LimbDarkening limb(m.wavelength_nm[0]);
  for (const double angle : {0.0, 0.2, 1.0, 5.0}) {
    double want = 0;
    constexpr int kRings = 200, kAround = 60;
    for (int i = 0; i < kRings; ++i) {
      const double rho2 = (i + 0.5) / kRings;
      for (int k = 0; k < kAround; ++k) {
        const double rho = kSunAngularRadiusRad * std::sqrt(rho2), a = angle * kDegree;
        const double phi = 2 * pi * (k + 0.5) / kAround;
        const double c = std::cos(a) * std::cos(rho) + std::sin(a) * std::sin(rho) * std::cos(phi);
        want += limb(std::sqrt(1 - rho2)) * 4 * pi * henyey_greenstein(c, 0.95) / kRings / kAround;
      }
    }
    EXPECT_NEAR(p11_at(disc, angle * kDegree, 0) / want, 1, 1e-4) << angle;
  }
  EXPECT_LT(p11_at(disc, 0, 0), 0.997 * p11_at(point, 0, 0));
  for (double angle = 10.05; angle <= 180; angle += 1) {
    EXPECT_EQ(p11_at(disc, angle * kDegree, 0), p11_at(point, angle * kDegree, 0)) << angle;
  }
  // Hardly a step where the average begins: of this power law, theta^-3, R^2 / 8 * 9 / theta^2.
  EXPECT_NEAR(p11_at(disc, 9.9 * kDegree, 0) / p11_at(point, 9.9 * kDegree, 0), 1, 8e-4);
}

}  // namespace
}  // namespace twilight
