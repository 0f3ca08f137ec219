#include "sim/models/bruneton_mapping.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

namespace twilight {
namespace {

const BrunetonSphere kEarth;  // 6360..6420 km
constexpr BrunetonSize kSize;
constexpr double kRadPerDeg = std::numbers::pi / 180;

// Sec. 4: d = 100 km to a mountain in a horizontal view near the ground. Seen from the ground the
// view has mu = 0 and d_o = H; on the mountain mu = d / sqrt(r^2 + d^2) and d_o = H - d.
TEST(BrunetonMapping, PapersMountainNeedsTheNewParameter) {
  const double d = 100.0, r = kEarth.ground_radius_km, far = std::hypot(r, d);
  const double mu = d / far;
  EXPECT_NEAR(mu, 0.016, 0.0005);  // "Delta mu = 0.016"
  // "d_H = (R_t^2 - R_g^2)^(1/2) for x and x_s", so 100 / 875 = 0.11 of the ratio d_o / d_H.
  EXPECT_NEAR(d / kEarth.horizon_km(), 0.11, 0.005);  // "Delta u_mu = 0.11"
  EXPECT_NEAR(bruneton_distance_km(kEarth, far, {mu, false}), kEarth.horizon_km() - d, 1e-8);
  // As printed, u_mu is half of d_o / d_H plus 1/2, and d_H is rho + H, on the mountain rho = d:
  // that nearly doubles the difference and halves it again.
  const double at_x = bruneton_u_mu(kEarth, r, {0, false});
  const double at_mountain = bruneton_u_mu(kEarth, far, {mu, false});
  EXPECT_DOUBLE_EQ(at_x, 1.0);
  EXPECT_NEAR(at_x - at_mountain, d / (d + kEarth.horizon_km()), 1e-12);
  EXPECT_NEAR(at_x - at_mountain, 0.11, 0.01);
}

TEST(BrunetonMapping, EndsAreTexels) {
  const double rg = kEarth.ground_radius_km, rt = kEarth.top_radius_km;
  EXPECT_EQ(bruneton_r_texel(kEarth, rg, 32), 0);
  EXPECT_EQ(bruneton_r_texel(kEarth, rt, 32), 31);
  EXPECT_NEAR(bruneton_mu_s_texel(-0.2, 32), 0, 1e-12);
  EXPECT_EQ(bruneton_mu_s_texel(1.0, 32), 31);
  EXPECT_NEAR(std::acos(kBrunetonLowestMuS) / kRadPerDeg, 101.54, 0.005);
  EXPECT_EQ(bruneton_nu_texel(-1, 8), 0);
  EXPECT_EQ(bruneton_nu_texel(1, 8), 7);
  for (const double r : {rg + 0.001, rg + 1, rg + 30, rt}) {
    const double horizon = -kEarth.rho_km(r) / r;
    EXPECT_NEAR(bruneton_mu_texel(kEarth, r, {horizon, true}, 128), 0, 1e-4) << r;
    EXPECT_NEAR(bruneton_mu_texel(kEarth, r, {horizon, false}, 128), 127, 1e-4) << r;
    // Down, the ratio of the ways to the ground is their height over rho.
    EXPECT_NEAR(bruneton_vertical_texel(kEarth, r, true, 128),
                63 * (1 - (r - rg) / kEarth.rho_km(r)), 1e-9);
    EXPECT_NEAR(bruneton_vertical_texel(kEarth, r, false, 128),
                64 + 63 * (rt - r) / (kEarth.rho_km(r) + kEarth.horizon_km()), 1e-9);
  }
  EXPECT_EQ(bruneton_u_mu(kEarth, rg, {-0.5, true}), 0.5);
}

// The formulas as printed, with Delta = r^2 mu^2 - rho^2.
TEST(BrunetonMapping, AgreesWithTheFormulasAsPrinted) {
  const double H = kEarth.horizon_km();
  for (const double height : {0.1, 2.0, 11.0, 59.0}) {
    const double r = kEarth.ground_radius_km + height, rho = kEarth.rho_km(r);
    for (double mu = -0.99; mu < 1; mu += 0.0313) {
      const double delta = r * r * mu * mu - rho * rho;
      const bool ground = r * mu < 0 && delta > 0;
      const double u = ground ? 0.5 + (r * mu + std::sqrt(delta)) / (2 * rho)
                              : 0.5 - (r * mu - std::sqrt(delta + H * H)) / (2 * rho + 2 * H);
      EXPECT_EQ(bruneton_meets_ground(kEarth, r, mu), ground);
      EXPECT_NEAR(bruneton_u_mu(kEarth, r, {mu, ground}), u, 1e-9) << height << ' ' << mu;
    }
  }
  for (double mu_s = -0.2; mu_s <= 1; mu_s += 0.06) {
    EXPECT_NEAR(bruneton_mu_s_texel(mu_s, 32) / 31,
                (1 - std::exp(-3 * mu_s - 0.6)) / (1 - std::exp(-3.6)), 1e-12);
  }
}

TEST(BrunetonMapping, TexelsComeBackWhereAViewReachesThem) {
  for (std::size_t i = 0; i < kSize.r; ++i) {
    for (std::size_t j = 0; j < kSize.mu; ++j) {
      const double r = bruneton_radius_km(kEarth, static_cast<double>(i), kSize.r);
      EXPECT_NEAR(bruneton_r_texel(kEarth, r, kSize.r), static_cast<double>(i), 1e-6);
      const BrunetonView view = bruneton_view(kEarth, r, static_cast<double>(j), kSize.mu);
      EXPECT_EQ(view.ground, j < 64);
      const double back = bruneton_mu_texel(kEarth, r, view, kSize.mu);
      if (i == 0 && view.ground) continue;  // no way at all
      const double vertical = bruneton_vertical_texel(kEarth, r, view.ground, kSize.mu);
      const double reached = view.ground ? std::min(vertical, static_cast<double>(j))
                                         : std::max(vertical, static_cast<double>(j));
      EXPECT_NEAR(back, reached, 1e-5) << i << ' ' << j;
    }
  }
  for (std::size_t k = 0; k < 32; ++k) {
    const auto texel = static_cast<double>(k);
    EXPECT_NEAR(bruneton_mu_s_texel(bruneton_mu_s(texel, 32), 32), texel, 1e-10);
    EXPECT_NEAR(bruneton_nu_texel(bruneton_nu(texel, 32), 32), texel, 1e-10);
  }
}

TEST(BrunetonMapping, TransmittanceTexelsComeBack) {
  for (double i = 0; i < 63; ++i) {
    const double r = bruneton_radius_km(kEarth, i, 64);
    double before = 2;
    for (double j = 0; j < 256; ++j) {
      const double mu = bruneton_transmittance_mu(kEarth, r, j, 256);
      EXPECT_NEAR(bruneton_transmittance_texel(kEarth, r, mu, 256), j, 1e-6);
      EXPECT_LT(mu, before);
      before = mu;
    }
    EXPECT_NEAR(before, -kEarth.rho_km(r) / r, 1e-9);
  }
}

TEST(BrunetonMapping, NuStaysWithinTheAnglesThatMeet) {
  for (const double j : {0.0, 20.0, 63.0, 64.0, 70.0, 127.0}) {
    for (double l = 0; l < 8; ++l) {
      const BrunetonPoint p = bruneton_point(kEarth, {7.0, j, 12.0, l}, kSize);
      const double view = std::acos(p.view.mu), sun = std::acos(p.mu_s), angle = std::acos(p.nu);
      EXPECT_GE(angle, std::abs(view - sun) - 1e-7);
      EXPECT_LE(angle, std::min(view + sun, 2 * std::numbers::pi - view - sun) + 1e-7);
    }
  }
}

TEST(BrunetonMapping, GrowsAlongEveryAxis) {
  const double r = kEarth.ground_radius_km + 5;
  double before = -1;
  for (double height = 0; height <= 60; height += 0.5) {
    const double t = bruneton_r_texel(kEarth, kEarth.ground_radius_km + height, 32);
    EXPECT_GT(t, before);
    before = t;
  }
  before = 1e9;
  for (double mu = 1; mu > -kEarth.rho_km(r) / r; mu -= 0.01) {
    const double t = bruneton_mu_texel(kEarth, r, {mu, false}, 128);
    EXPECT_GT(t, 63.99);
    if (before < 1e9) {
      EXPECT_GT(t, before);
    }
    before = t;
  }
}

}  // namespace
}  // namespace twilight
