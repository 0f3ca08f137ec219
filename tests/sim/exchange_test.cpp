#include "sim/exchange.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "sim/cell_grid.h"
#include "sim/direct_sunlight.h"
#include "sim/first_event.h"
#include "small_scene.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180;

// Rayleigh-like air of optical depth 0.3 / (1, 2, 3) in three wavelengths, up to 40 km.
Medium conservative_air(double absorption_per_km = 0, int layers = 16) {
  std::vector<double> scattering;
  for (int i = 0; i < layers; ++i) {
    scattering.push_back(0.0375 * std::exp(-40 * (i + 0.5) / layers / 8));
  }
  return layered_air(40, scattering, absorption_per_km, 3);
}

struct Solved {
  CellGrid grid;
  DirectSunlight sunlight;
  ExchangeOptics optics;
  ExchangeResult result;
};

CellGridOptions grid_options(int divisions = 30, int stride = 2) {
  CellGridOptions o;
  o.azimuth_divisions = divisions;
  o.inner_radius_km = 2;
  o.active_shell_stride = stride;
  return o;
}

Solved solve(const Medium& m, double sun_deg, const ExchangeOptions& options,
             const CellGridOptions& layout = grid_options()) {
  const ExchangeOptics optics = make_exchange_optics(m, options);
  Solved s{CellGrid(m, layout),
           DirectSunlight(beam_medium(m, optics), {.altitude_nodes = 96, .angle_nodes = 96}),
           optics,
           {}};
  s.result =
      solve_exchange(m, s.grid, nullptr, s.sunlight, {sun_deg * kDegree}, s.optics, options, {});
  return s;
}

ExchangeOptions isotropic(int orders) {
  ExchangeOptions o;
  o.scattering_orders = orders;
  o.rayleigh = false;
  return o;
}

// Nothing absorbs but black ground: what the first event takes from the beam leaves, reaches the
// ground, or is still under way in the last event. The rows of the exchange are closed by
// construction; what is left is rounding, dropped azimuthal modes and clipped rows.
TEST(Exchange, ConservesEnergy) {
  for (const double sun : {60.0, 10.0, -4.0}) {
    const Solved s = solve(conservative_air(), sun, isotropic(30));
    const ExchangeReport& r = s.result.report;
    ASSERT_EQ(r.event_power.size(), 30U);
    for (std::size_t w = 0; w < 3; ++w) {
      const double taken = r.event_power.front()[w];
      ASSERT_GT(taken, 0);
      const double left = r.escaped[w] + r.ground_absorbed[w] + r.event_power.back()[w];
      std::printf("sun %5.1f w %zu: balance %.4f last/first %.1e clipped %.3f\n", sun, w,
                  left / taken, r.event_power.back()[w] / taken, r.clipped_row_share);
      EXPECT_NEAR(left / taken, 1, 0.01) << sun << ' ' << w;
      EXPECT_LT(r.event_power.back()[w], 1e-3 * taken);
    }
  }
}

TEST(Exchange, AbsorbingAirLosesEnergy) {
  const Solved s = solve(conservative_air(2e-3), 20, isotropic(30));
  const Solved clear = solve(conservative_air(), 20, isotropic(30));
  const ExchangeReport& r = s.result.report;
  for (std::size_t w = 0; w < 3; ++w) {
    const double left = r.escaped[w] + r.ground_absorbed[w] + r.event_power.back()[w];
    EXPECT_LT(left, 0.98 * r.event_power.front()[w]);
    EXPECT_LT(r.event_power.front()[w], clear.result.report.event_power.front()[w]);
  }
}

// Every event has less power than the one before, by a ratio that settles at less than 1.
TEST(Exchange, EventsDieOut) {
  for (const bool rayleigh : {false, true}) {
    ExchangeOptions o = isotropic(12);
    o.rayleigh = rayleigh;
    const Solved s = solve(conservative_air(), 30, o);
    const auto& p = s.result.report.event_power;
    for (std::size_t w = 0; w < 3; ++w) {
      double last = 1;
      for (std::size_t k = 1; k < p.size(); ++k) {
        const double ratio = p[k][w] / p[k - 1][w];
        EXPECT_GT(ratio, 0);
        EXPECT_LT(ratio, 0.6) << "optical depth 0.3 cannot keep more";
        last = ratio;
      }
      EXPECT_NEAR(p[11][w] / p[10][w], p[10][w] / p[9][w], 0.02 * last);
    }
  }
}

// The first event is the integral of beta e^-tau over the air of the cells; here by distance and
// altitude, dV = 2 pi r (R + h)/R dr dh, around a Sun overhead. Cells are sampled every
// km, each sample in one layer: layers finer than that, and no divisors of it.
TEST(FirstEvent, IsTheScatteredBeam) {
  const Medium m = conservative_air(0, 137);
  const Solved s = solve(m, 90, isotropic(1), grid_options(60, 1));
  const double R = m.earth_radius_km;
  const double inner = s.grid.shells().front().r_min_km, outer = s.grid.shells().back().r_max_km;
  std::vector<double> sum(3, 0.0);
  std::vector<float> depth(s.sunlight.lanes());
  const double dr = (outer - inner) / 2000, dh = 40.0 / 400;
  for (double r = inner + dr / 2; r < outer; r += dr) {
    for (double h = dh / 2; h < 40; h += dh) {
      const double z = (h * (2 * R + h) - r * r) / (2 * R);
      if (std::abs(z) > r) continue;
      if (!s.sunlight.attenuation(h, std::acos((R + z) / (R + h)), depth.data())) continue;
      for (std::size_t w = 0; w < 3; ++w) {
        sum[w] += 2 * kPi * r * (R + h) / R * dr * dh *
                  m.air_scattering_per_km(static_cast<std::size_t>(layer_at(m, h)), w) *
                  std::exp(-static_cast<double>(depth[w]));
      }
    }
  }
  for (std::size_t w = 0; w < 3; ++w) {
    EXPECT_NEAR(s.result.report.event_power[0][w] / sum[w], 1, 0.01) << w;
  }
}

// Moments of the emission: J carries the power, F vanishes for air, S is traceless about the beam.
TEST(FirstEvent, MomentsPointAlongTheBeam) {
  Scene scene = small_scene(25);
  scene.aerosols.type = "continental_average";
  const Medium m = build_scene_model(scene).medium;
  ExchangeOptions o;
  const Solved s = solve(m, 25, o);
  const std::size_t L = s.optics.lanes;
  const std::vector<float> albedo(L, 0.3F);
  const FirstEvent e = first_event(m, s.grid, s.grid.rings().size(), s.sunlight, {25 * kDegree},
                                   s.optics, false, albedo, kMoments);
  const std::size_t nodes = 16;
  const double ce = std::cos(25 * kDegree), se = std::sin(25 * kDegree);
  for (std::size_t i = 0; i < s.grid.air_rings(); i += 5) {
    for (std::size_t j = 0; j < nodes; j += 3) {
      const float* q = &e.source[(i * nodes + j) * kMoments * L];
      const double phi = 2 * kPi * static_cast<double>(j) / 30;
      const double r = -ce * std::cos(phi), a = ce * std::sin(phi), z = -se;
      EXPECT_GT(q[kJ * L], 0);
      const double f = q[kFz * L] / z;
      EXPECT_NEAR(q[kFr * L], f * r, 1e-4 * std::abs(f));
      EXPECT_NEAR(q[kFa * L], f * a, 1e-4 * std::abs(f));
      const double t = q[kSzz * L] / (z * z - 1.0 / 3);
      EXPECT_NEAR(q[kSrr * L], t * (r * r - 1.0 / 3), 1e-4 * std::abs(t));
      EXPECT_NEAR(q[kSrz * L], t * r * z, 1e-4 * std::abs(t));
      EXPECT_NEAR(q[kSra * L], t * r * a, 1e-4 * std::abs(t));
      EXPECT_NEAR(q[kSaz * L], t * a * z, 1e-4 * std::abs(t));
      // F = 3 g J and S = 7.5 x2 J at the most.
      EXPECT_LE(std::abs(f), 3 * q[kJ * L]);
      EXPECT_LE(std::abs(t), 7.5 * q[kJ * L]);
    }
  }
}

// Sun at -18 under 20 km of air: the Earth's shadow is 300 km high. Exact zeros, nothing undefined.
TEST(Exchange, SunlessAirIsExactlyDark) {
  std::vector<double> scattering(8, 0.01);
  const Medium m = layered_air(20, scattering, 1e-4, 3);
  for (const bool similarity : {false, true}) {
    ExchangeOptions o;
    o.scattering_orders = 5;
    o.similarity = similarity;
    o.ground_albedo.assign(m.wavelengths(), 0.5);
    const Solved s = solve(m, -18, o);
    for (const float v : s.result.field.values) EXPECT_EQ(v, 0);
    for (const float v : s.result.ground_exitance) EXPECT_EQ(v, 0);
    for (const auto& event : s.result.report.event_power) {
      for (const double p : event) EXPECT_EQ(p, 0);
    }
  }
}

// Light arriving in the cells is a sum over orders: it grows with each, and with the ground's
// albedo.
TEST(Exchange, GrowsWithOrdersAndAlbedo) {
  const Medium m = conservative_air();
  const auto total = [&](int orders, double albedo) {
    ExchangeOptions o;
    o.scattering_orders = orders;
    o.ground_albedo.assign(m.wavelengths(), albedo);
    const Solved s = solve(m, 15, o);
    double sum = 0;
    for (std::size_t i = 0; i < s.grid.air_rings(); ++i) {
      for (int j = 0; j < s.result.field.nodes; ++j) sum += s.result.field.at(i, j)[0];
    }
    return sum;
  };
  EXPECT_EQ(total(1, 0), 0);
  EXPECT_GT(total(2, 0), 0);
  EXPECT_GT(total(3, 0), total(2, 0));
  EXPECT_GT(total(6, 0), total(3, 0));
  EXPECT_GT(total(6, 0.3), total(6, 0));
  EXPECT_GT(total(6, 0.9), total(6, 0.3));
}

// A mirror plane through the Sun and a Sun overhead: the same light at every azimuth.
TEST(Exchange, OverheadSunLightsAllAzimuthsAlike) {
  ExchangeOptions o;
  const Medium m = conservative_air();
  o.ground_albedo.assign(m.wavelengths(), 0.4);
  const Solved s = solve(m, 90, o);
  const CellField& f = s.result.field;
  for (std::size_t i = 0; i < s.grid.air_rings(); ++i) {
    const float* first = f.at(i, 0);
    for (int j = 1; j < f.nodes; ++j) {
      const float* here = f.at(i, j);
      for (const int c : {kJ, kFr, kFz, kSrr, kSzz, kSrz}) {
        const auto at = static_cast<std::size_t>(c) * f.lanes;
        EXPECT_NEAR(here[at], first[at], 2e-5 * first[0]);
      }
      for (const int c : {kFa, kSra, kSaz}) {
        EXPECT_NEAR(here[static_cast<std::size_t>(c) * f.lanes], 0, 2e-5 * first[0]);
      }
    }
  }
}

// Dropping weak azimuthal modes changes the light by no more than the tolerance's order.
TEST(Exchange, AzimuthToleranceIsKept) {
  ExchangeOptions exact = isotropic(4), thin = exact;
  exact.azimuth_tolerance = 0;
  thin.azimuth_tolerance = 1e-3;
  const Medium m = conservative_air();
  const Solved a = solve(m, 3, exact, grid_options(36, 4)),
               b = solve(m, 3, thin, grid_options(36, 4));
  const auto& x = a.result.field.values;
  const auto& y = b.result.field.values;
  ASSERT_EQ(x.size(), y.size());
  const float brightest = *std::max_element(x.begin(), x.end());
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(x[i], y[i], 5e-3 * brightest);
  EXPECT_LT(b.result.report.kernel_evaluations, a.result.report.kernel_evaluations);
}

// Similarity (Eq. 2): aerosol scattering and its extinction scaled by 1 - g; delta-M takes g^3.
TEST(ExchangeOptics, ScaleTheAerosol) {
  Medium m = conservative_air();
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < 3; ++w) {
      m.aerosol_scattering_per_km(i, w) = 0.01;
      m.aerosol_absorption_per_km(i, w) = 0.001;
      m.aerosol_asymmetry(i, w) = 0.7;
    }
  }
  ExchangeOptions o;
  o.similarity = true;
  const ExchangeOptics paper = make_exchange_optics(m, o);
  o.similarity = false;
  const ExchangeOptics delta = make_exchange_optics(m, o);
  const double air = m.air_scattering_per_km(2, 1);
  EXPECT_NEAR(paper.extinction(2, 1), air + 0.3 * 0.01 + 0.001, 1e-12);
  EXPECT_NEAR(paper.beam_extinction(2, 1), air + 0.01 + 0.001, 1e-12);
  const double f = 0.343;
  EXPECT_NEAR(delta.extinction(2, 1), air + (1 - f) * 0.01 + 0.001, 1e-12);
  EXPECT_NEAR(delta.beam_extinction(2, 1), delta.extinction(2, 1), 1e-12);
  // Transport (1 - g) is kept by delta-M: scaled scattering times one minus its own asymmetry.
  const std::size_t at = 2 * delta.lanes + 1;
  const double scattering = delta.s0[at] - air, first = delta.s1[at] / 3;
  EXPECT_NEAR(scattering - first, 0.01 * (1 - 0.7), 1e-7);
  // Rayleigh's second Legendre coefficient is 1/10 (Chandrasekhar): 1 + 0.5 P2.
  EXPECT_NEAR(delta.rayleigh_x2[0], 0.1, 1e-7);
}

TEST(CosSolarZenith, IsTheAngleToTheLocalVertical) {
  const SunGeometry sun{0.3};
  EXPECT_NEAR(cos_solar_zenith(sun, 6371, 0, 0, 1.0, 0), std::sin(0.3), 1e-12);
  EXPECT_NEAR(cos_solar_zenith(sun, 6371, 2, 0, 1.0, 50), std::sin(0.3), 1e-12);
  // Towards the Sun it stands higher, by the central angle.
  const double angle = 0.05, r = 6371 + 10;
  const double rho = r * std::sin(angle), z = r * std::cos(angle) - 6371;
  EXPECT_NEAR(cos_solar_zenith(sun, 6371, 0, rho, 0, z), std::sin(0.3 + angle), 1e-12);
  EXPECT_NEAR(cos_solar_zenith(sun, 6371, 0, rho, kPi, z), std::sin(0.3 - angle), 1e-12);
}

}  // namespace
}  // namespace twilight
