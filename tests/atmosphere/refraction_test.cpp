#include "atmosphere/refraction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include "atmosphere/air.h"
#include "atmosphere/refractive_index.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180.0;
constexpr double kArcsecond = kDegree / 3600.0;

Medium air(int layers = 100, const char* spacing = "graded", double wavelength_nm = 501.69,
           bool refraction = true, double radius_km = 6371.0, double top_km = 100.0) {
  AirOptions options;
  options.layers = layers;
  options.layer_spacing = spacing;
  options.refraction = refraction;
  options.earth_radius_km = radius_km;
  options.top_km = top_km;
  return make_air(options, std::vector<double>{wavelength_nm});
}

// Same shape of the atmosphere, with this pressure and temperature of dry air at the ground.
void scale_refractivity(Medium& m, double wavelength_nm, double hpa, double kelvin) {
  const double target =
      ciddor_dry_refractivity(wavelength_nm) * (hpa / 1013.25) * (288.15 / kelvin);
  const double now = ciddor_dry_refractivity(wavelength_nm) * (1013.0 / 1013.25) * (288.15 / 288.2);
  for (std::size_t i = 0; i < m.layers(); ++i) m.refractivity(i, 0) *= target / now;
}

double total(const std::vector<double>& path_km) {
  return std::accumulate(path_km.begin(), path_km.end(), 0.0);
}

// Hohenkerk & Sinclair (1985), HM Nautical Almanac Office Technical Note 63: refraction at sea
// level against apparent altitude, 1010 hPa, 283.15 K, dry, 0.50169 um, 6.5 K/km, in arc seconds.
// The model atmosphere keeps its own temperatures (288.2 K at the ground) and its refractivity is
// scaled to the table's conditions; what remains is the shape (and its 0.8 % of vapour).
TEST(Refraction, MatchesHohenkerkAndSinclair) {
  struct Row {
    double altitude_deg, arcsec;
  };
  const std::vector<Row> rows = {{15, 214.21}, {12, 267.70}, {10, 319.43}, {7, 444.25}, {5, 592.09},
                                 {4, 704.78},  {3, 862.54},  {2, 1093.79}, {1, 1451.88}};
  for (const int layers : {50, 100, 200}) {
    Medium m = air(layers);
    scale_refractivity(m, 501.69, 1010.0, 283.15);
    const RefractedRays rays(m, 0);
    for (const Row& r : rows) {
      const double bent =
          rays.trace_outward(0.0, (90.0 - r.altitude_deg) * kDegree, {}).deflection_rad;
      EXPECT_NEAR(bent / kArcsecond / r.arcsec, 1.0, 0.02) << layers << ' ' << r.altitude_deg;
    }
    const double horizon = rays.trace_outward(0.0, 0.5 * kPi, {}).deflection_rad;
    EXPECT_NEAR(horizon / kArcsecond / 2044.24, 1.0, 0.05) << layers;
  }
}

// The same tables with their own atmosphere (Hohenkerk & Sinclair 1985; also Seidelmann 1992, Sec.
// 3.281): polytropic troposphere to 11 km, isothermal above, earth radius 6378.12 km, g at 50 deg
// latitude, n - 1 = (287.604 + 1.6288 / l^2 + 0.0136 / l^4) 1e-6 (273.15 / 1013.25) P / T.
TEST(Refraction, MatchesHohenkerkAndSinclairInTheirAtmosphere) {
  const double l2 = 0.50169 * 0.50169;
  const double ground =
      (287.604 + 1.6288 / l2 + 0.0136 / (l2 * l2)) * 1e-6 * (273.15 / 1013.25) * (1010.0 / 283.15);
  const double g = 9.784 * (1.0 - 0.0026 * std::cos(100.0 * kDegree));
  const double gamma = g * 28.9644e-3 / (8.31436 * 6.5e-3);
  const double tropopause_k = 283.15 - 6.5 * 11.0;
  const auto n_minus_1 = [&](double h) {
    const double low = std::min(h, 11.0);
    const double in_troposphere = ground * std::pow((283.15 - 6.5 * low) / 283.15, gamma - 1.0);
    return in_troposphere * std::exp(-(h - low) * 1e3 * g * 28.9644e-3 / (8.31436 * tropopause_k));
  };
  const std::vector<std::pair<double, double>> rows = {
      {15, 214.21}, {12, 267.70}, {10, 319.43}, {7, 444.25},  {5, 592.09},
      {4, 704.78},  {3, 862.54},  {2, 1093.79}, {1, 1451.88}, {0, 2044.24}};
  for (const int layers : {50, 100, 200}) {
    Medium m = air(layers, "graded", 501.69, true, 6378.12, 80.0);
    for (std::size_t i = 0; i < m.layers(); ++i) {
      const double bottom = m.boundary_km[i];
      const double step = (m.boundary_km[i + 1] - bottom) / 100.0;
      double mean = 0.0;
      for (int k = 0; k < 100; ++k) mean += n_minus_1(bottom + (k + 0.5) * step) / 100.0;
      m.refractivity(i, 0) = mean;
    }
    const RefractedRays rays(m, 0);
    for (const auto& [altitude_deg, arcsec] : rows) {
      const double bent =
          rays.trace_outward(0.0, (90.0 - altitude_deg) * kDegree, {}).deflection_rad;
      EXPECT_NEAR(bent / kArcsecond / arcsec, 1.0, 0.002) << layers << ' ' << altitude_deg;
    }
  }
}

// SOFA's rigorous ray trace quoted in its notes on iauRefco (2013): 1005 hPa, 7 C, 0.574 um.
TEST(Refraction, MatchesSofaRayTrace) {
  Medium m = air(100, "graded", 574.0);
  scale_refractivity(m, 574.0, 1005.0, 280.15);
  const RefractedRays rays(m, 0);
  const double rows[][2] = {{80, 10.27},  {60, 33.61},  {45, 58.16},
                            {30, 100.51}, {20, 158.63}, {10, 319.13}};
  for (const auto& r : rows) {
    const double bent = rays.trace_outward(0.0, (90.0 - r[0]) * kDegree, {}).deflection_rad;
    EXPECT_NEAR(bent / kArcsecond / r[1], 1.0, 0.01) << r[0];
  }
}

// Laplace: far from the horizon refraction is N tan(z) (1 - H/R) whatever the profile.
TEST(Refraction, FarFromTheHorizonDependsOnTheGroundOnly) {
  AirOptions options;
  options.profile = "exponential";
  options.top_km = 200.0;
  options.layers = 500;
  const Medium m = make_air(options, std::vector<double>{550.0});
  const RefractedRays rays(m, 0);
  const double n = ciddor_refractivity(550.0, 2.546899e19, 0.0);
  for (const double z : {5.0, 20.0, 45.0, 60.0}) {
    const double t = std::tan(z * kDegree);
    const double beta = 8.0 / 6371.0;
    const double laplace = n * (1.0 - beta) * t - n * (beta - 0.5 * n) * t * t * t;
    EXPECT_NEAR(rays.trace_outward(0.0, z * kDegree, {}).deflection_rad / laplace, 1.0, 1e-4) << z;
  }
}

// Thin exponential atmosphere at the horizon: N sqrt(pi R / (2 H)) to first order in N R / H.
TEST(Refraction, HorizonOfAThinExponentialAtmosphere) {
  AirOptions options;
  options.profile = "exponential";
  options.top_km = 150.0;
  options.layers = 500;
  Medium m = make_air(options, std::vector<double>{550.0});
  for (std::size_t i = 0; i < m.layers(); ++i) m.refractivity(i, 0) *= 0.01;
  const double n = 0.01 * ciddor_refractivity(550.0, 2.546899e19, 0.0);
  const double first_order = n * std::sqrt(kPi * 6371.0 / 16.0);
  const double bent = RefractedRays(m, 0).trace_outward(0.0, 0.5 * kPi, {}).deflection_rad;
  // Next terms: N R / H = 0.2 % times 0.4, H / R = 0.1 % times order 1.
  EXPECT_NEAR(bent / first_order, 1.0, 0.003);
}

// n r sin(theta) keeps its value through a layer boundary: independent Runge-Kutta integration of
// the eikonal's d(theta)/ds in the exponential atmosphere.
TEST(Refraction, AgreesWithNumericalIntegration) {
  AirOptions options;
  options.profile = "exponential";
  options.top_km = 150.0;
  options.layers = 500;
  const Medium m = make_air(options, std::vector<double>{550.0});
  const RefractedRays rays(m, 0);
  const double n0 = ciddor_refractivity(550.0, 2.546899e19, 0.0);
  for (const double altitude_km : {0.0, 12.0}) {
    for (const double zenith_deg : {60.0, 85.0, 89.0, 90.0, 91.0, 92.0}) {
      if (altitude_km == 0.0 && zenith_deg > 90.0) continue;
      // State r, theta (local zenith angle), bending; d/ds: cos(theta), -sin(theta) (1/r + n'/n).
      const auto slope = [&](double h) {
        const double f = n0 * std::exp(-h / 8.0);
        return -f / 8.0 / (1.0 + f);
      };
      double h = altitude_km;
      double theta = zenith_deg * kDegree;
      double bent = 0.0;
      const double ds = 0.05;
      const auto dtheta = [&](double hh, double tt) {
        return -std::sin(tt) * (1.0 / (6371.0 + hh) + slope(hh));
      };
      while (h < 140.0) {
        const double h_mid = h + 0.5 * ds * std::cos(theta);
        const double t_mid = theta + 0.5 * ds * dtheta(h, theta);
        h += ds * std::cos(t_mid);
        theta += ds * dtheta(h_mid, t_mid);
        bent -= ds * std::sin(t_mid) * slope(h_mid);
      }
      EXPECT_NEAR(rays.trace_outward(altitude_km, zenith_deg * kDegree, {}).deflection_rad / bent,
                  1.0, 0.002)
          << altitude_km << ' ' << zenith_deg;
    }
  }
}

// An independent law: the true zenith angle grows with the apparent one, whatever the start.
TEST(Refraction, TrueZenithGrowsWithApparentZenith) {
  for (const char* spacing : {"graded", "even", "equal-air-mass"}) {
    for (const double top_km : {1.0, 35.0, 100.0}) {
      for (const int layers : {1, 20, 100}) {
        const Medium m = air(layers, spacing, 400.0, true, 6371.0, top_km);
        const RefractedRays rays(m, 0);
        std::vector<double> starts = {0.0, 1e-9, 0.37, 8.88, 99.999999, 100.0, 300.0};
        for (const std::size_t i : {std::size_t{0}, m.layers() / 3, m.layers() - 1}) {
          const double bottom = m.boundary_km[i];
          const double top = m.boundary_km[i + 1];
          for (const double f : {0.1, 0.5, 0.85, 0.99, 1.0})
            starts.push_back(bottom + f * (top - bottom));
          starts.push_back(std::nextafter(top, 0.0));
        }
        for (const double altitude_km : starts) {
          const double horizon = rays.horizon_apparent_zenith_rad(altitude_km);
          double last = -1.0;
          const auto step = [&](double z) {
            const RayTrace t = rays.trace_outward(altitude_km, z, {});
            ASSERT_FALSE(t.hits_ground) << altitude_km << ' ' << z;
            ASSERT_GT(t.true_zenith_rad, last) << altitude_km << ' ' << z << ' ' << spacing;
            ASSERT_GE(t.deflection_rad, 0.0);
            last = t.true_zenith_rad;
          };
          for (double z = 0.0; z < 1.5; z += 0.05) step(z);
          for (double z = 1.5; z < horizon - 1e-6; z += 2e-4) step(z);
          if (altitude_km > 0.0) {
            EXPECT_TRUE(rays.trace_outward(altitude_km, horizon + 1e-6, {}).hits_ground);
            EXPECT_FALSE(rays.trace_outward(altitude_km, horizon - 1e-6, {}).hits_ground);
          }
        }
      }
    }
  }
}

// Fine steps about the horizontal, where steps of n would reflect.
TEST(Refraction, IsSmoothAboutTheHorizontal) {
  const Medium m = air(50, "even");
  const RefractedRays rays(m, 0);
  for (const double altitude_km : {0.5, 1.0, 1.5, 1.9, 1.999, 2.0, 2.001, 3.99}) {
    double last = rays.trace_outward(altitude_km, 0.5 * kPi - 1e-3, {}).true_zenith_rad;
    for (int i = -999; i <= 1000; ++i) {
      const double now = rays.trace_outward(altitude_km, 0.5 * kPi + 1e-6 * i, {}).true_zenith_rad;
      ASSERT_GT(now, last + 0.9e-6);
      ASSERT_LT(now, last + 1.6e-6);
      last = now;
    }
  }
}

// Kasten & Young (1989), Appl. Opt. 28, 4735: relative air mass against apparent elevation.
TEST(AirMass, MatchesKastenAndYoung) {
  const Medium m = air(100, "graded", 700.0);
  const RefractedRays rays(m, 0);
  std::vector<double> path_km(m.layers());
  const auto air_mass = [&](double zenith_rad) {
    rays.trace_outward(0.0, zenith_rad, path_km);
    double slant = 0.0;
    double vertical = 0.0;
    for (std::size_t i = 0; i < m.layers(); ++i) {
      slant += m.air_scattering_per_km(i, 0) * path_km[i];
      vertical += m.air_scattering_per_km(i, 0) * (m.boundary_km[i + 1] - m.boundary_km[i]);
    }
    return slant / vertical;
  };
  for (const double h : {1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 15.0, 30.0, 60.0, 90.0}) {
    const double formula = 1.0 / (std::sin(h * kDegree) + 0.50572 * std::pow(h + 6.07995, -1.6364));
    EXPECT_NEAR(air_mass((90.0 - h) * kDegree) / formula, 1.0, 0.01) << h;
  }
  // Their Table II, ISO standard atmosphere, on the horizon: 38.0868.
  EXPECT_NEAR(air_mass(0.5 * kPi) / 38.0868, 1.0, 0.02);
}

TEST(RayPaths, WithoutRefractionAreStraightLines) {
  for (const double radius_km : {1000.0, 6371.0, 70000.0}) {
    const Medium m = air(100, "graded", 550.0, false, radius_km);
    const RefractedRays rays(m, 0);
    std::vector<double> path_km(m.layers());
    for (const double h : {0.0, 0.001, 10.0, m.boundary_km[40], 99.0, 100.0, 250.0, 500.0}) {
      for (double z = 0.0; z <= 180.0; z += 2.5) {
        const RayTrace t = rays.trace_outward(h, z * kDegree, path_km);
        EXPECT_EQ(t.deflection_rad, 0.0);
        EXPECT_EQ(t.true_zenith_rad, z * kDegree);
        // Chord from the start (or the entry) to the top or the ground, in long double.
        const long double r = static_cast<long double>(radius_km) + h;
        const long double c = r * std::sin(static_cast<long double>(z * kDegree));
        const long double mu = r * std::cos(static_cast<long double>(z * kDegree));
        const long double ground2 = static_cast<long double>(radius_km) * radius_km - c * c;
        const long double top2 = (radius_km + 100.0L) * (radius_km + 100.0L) - c * c;
        long double expected = 0.0L;
        const bool hits = mu < 0.0L && ground2 >= 0.0L;
        const long double top = top2 > 0.0L ? std::sqrt(top2) : 0.0L;
        if (hits) {
          expected = std::min(-mu, top) - std::sqrt(ground2);
        } else if (mu >= 0.0L) {
          expected = h >= 100.0 ? 0.0L : top - mu;
        } else {
          expected = std::min(-mu, top) + top;
        }
        EXPECT_EQ(t.hits_ground, hits) << h << ' ' << z;
        const double e = static_cast<double>(expected);
        EXPECT_NEAR(total(path_km), e, 1e-11 * radius_km * 1e-3 + 1e-11 * e) << h << ' ' << z;
        if (mu < 0.0L) {
          const double perigee = hits ? 0.0 : static_cast<double>(c - radius_km);
          EXPECT_NEAR(t.perigee_km, perigee, 1e-8) << h << ' ' << z;
        } else {
          EXPECT_EQ(t.perigee_km, h);
        }
      }
    }
  }
}

TEST(RayPaths, VerticalRaysHaveTheLayersThickness) {
  const Medium m = air();
  const RefractedRays rays(m, 0);
  std::vector<double> path_km(m.layers());
  rays.trace_outward(0.0, 0.0, path_km);
  for (std::size_t i = 0; i < m.layers(); ++i) {
    EXPECT_NEAR(path_km[i] / (m.boundary_km[i + 1] - m.boundary_km[i]), 1.0, 1e-8);
  }
  const RayTrace down = rays.trace_outward(500.0, kPi, path_km);
  EXPECT_TRUE(down.hits_ground);
  EXPECT_EQ(down.perigee_km, 0.0);
  EXPECT_NEAR(total(path_km), 100.0, 1e-6);
}

// Light goes the same way back: a ray through its perigee is symmetric about it.
TEST(RayPaths, AreReversible) {
  const Medium m = air();
  const RefractedRays rays(m, 0);
  std::vector<double> path_km(m.layers());
  // From where the index has faded out, so that both halves see the same air.
  const RayTrace down = rays.trace_outward(150.0, 101.5 * kDegree, path_km);
  ASSERT_FALSE(down.hits_ground);
  std::vector<double> half_km(m.layers());
  const RayTrace up = rays.trace_outward(down.perigee_km, 0.5 * kPi, half_km);
  EXPECT_NEAR(2.0 * up.deflection_rad / down.deflection_rad, 1.0, 1e-6);
  EXPECT_NEAR(2.0 * total(half_km) / total(path_km), 1.0, 1e-6);
}

// Followed piece by piece a ray is trace_outward's: lengths per layer, deflection, fate; pieces
// join, keep n r sin(theta), stay in their layer, and turn at the perigee.
TEST(FollowedRays, AddUpToTheTrace) {
  for (const bool refraction : {true, false}) {
    const Medium m = air(60, "graded", 400.0, refraction);
    const RefractedRays rays(m, 0);
    std::vector<double> path_km(m.layers());
    for (const double h : {0.0, 0.37, 10.0, m.boundary_km[30], 99.0, 100.0, 420.0, 36000.0}) {
      const double horizon = rays.horizon_apparent_zenith_rad(h);
      for (const double z : {0.0, 0.8, 1.5, 0.5 * kPi, horizon - 1e-3, horizon - 1e-6,
                             horizon - 0.1, horizon + 1e-3, 3.0, kPi}) {
        const RayTrace trace = rays.trace_outward(h, z, path_km);
        const RayPath path = rays.follow(h, z);
        EXPECT_EQ(path.hits_ground, trace.hits_ground) << h << ' ' << z;
        EXPECT_EQ(path.deflection_rad, trace.deflection_rad);
        std::vector<double> sum(m.layers(), 0.0);
        double lowest = h;
        for (std::size_t i = 0; i < path.pieces.size(); ++i) {
          const PathPiece& p = path.pieces[i];
          sum[p.layer] += p.length_km;
          lowest = std::min(lowest, p.end_altitude_km);
          for (const double altitude : {p.start_altitude_km, p.end_altitude_km}) {
            EXPECT_GE(altitude, m.boundary_km[p.layer] - 1e-9);
            EXPECT_LE(altitude, m.boundary_km[p.layer + 1] + 1e-9);
          }
          // Bouguer's law, against the start's.
          const double b = (6371.0 + p.end_altitude_km) * std::sin(p.end_zenith_rad) *
                           rays.refractive_index(p.end_altitude_km);
          EXPECT_NEAR(b, (6371.0 + h) * std::sin(z) * rays.refractive_index(h), 1e-4);
          EXPECT_GE(std::cos(p.start_zenith_rad) * std::cos(p.end_zenith_rad), -1e-9);
          if (i == 0) continue;
          const PathPiece& before = path.pieces[i - 1];
          EXPECT_EQ(p.start_altitude_km, before.end_altitude_km);
          EXPECT_EQ(p.start_angle_rad, before.end_angle_rad);
          EXPECT_EQ(p.start_zenith_rad, before.end_zenith_rad);
        }
        for (std::size_t i = 0; i < m.layers(); ++i) EXPECT_DOUBLE_EQ(sum[i], path_km[i]);
        if (path.pieces.empty()) continue;
        EXPECT_NEAR(lowest, trace.perigee_km, 1e-9) << h << ' ' << z;
        const PathPiece& last = path.pieces.back();
        EXPECT_NEAR(last.end_altitude_km, trace.hits_ground ? 0.0 : 100.0, 1e-12);
        // What bends above the model (kFaintRefractivity): 1e-6 rad.
        EXPECT_NEAR(last.end_zenith_rad + last.end_angle_rad, z + trace.deflection_rad, 2e-6);
      }
    }
  }
}

// Without refraction: the chord's ends by the sine and cosine laws.
TEST(FollowedRays, WithoutRefractionAreChords) {
  const Medium m = air(60);
  const RefractedRays rays(m, 0, false);
  EXPECT_EQ(rays.refractive_index(0.0), 1.0);
  for (const double h : {0.0, 5.0, 100.0, 700.0}) {
    for (const double z : {0.0, 1.0, 0.5 * kPi, 1.6, 1.95, 2.5, kPi}) {
      double along = -1.0;
      for (const PathPiece& p : rays.follow(h, z).pieces) {
        if (along < 0.0) {  // distance to the first piece
          const double r = 6371.0 + p.start_altitude_km;
          along = h == p.start_altitude_km
                      ? 0.0
                      : -(6371.0 + h) * std::cos(z) -
                            std::sqrt(r * r - std::pow((6371.0 + h) * std::sin(z), 2));
        }
        along += p.length_km;
        const double x = along * std::sin(z);
        const double y = 6371.0 + h + along * std::cos(z);
        EXPECT_NEAR(std::hypot(x, y) - 6371.0, p.end_altitude_km, 1e-7) << h << ' ' << z;
        EXPECT_NEAR(std::atan2(x, y), p.end_angle_rad, 1e-10) << h << ' ' << z;
        EXPECT_NEAR(p.end_zenith_rad + p.end_angle_rad, z, 1e-12);
      }
    }
  }
}

// Turned round at its end, a ray comes back to where it began. Starts stand on boundaries, where
// pieces end.
TEST(FollowedRays, AreReversible) {
  const Medium m = air(100, "graded", 550.0);
  const RefractedRays rays(m, 0);
  for (const double h : {0.0, m.boundary_km[10], m.boundary_km[50]}) {
    const double horizon = rays.horizon_apparent_zenith_rad(h);
    for (const double z : {0.3, 1.4, 1.55, horizon - 1e-4}) {
      const std::vector<PathPiece> out = rays.follow(h, z).pieces;
      const double angle = out.back().end_angle_rad;
      double length_out = 0.0, length = 0.0;
      for (const PathPiece& p : out) length_out += p.length_km;
      bool found = false;
      for (const PathPiece& p : rays.follow(100.0, kPi - out.back().end_zenith_rad).pieces) {
        length += p.length_km;
        if (std::abs(p.end_altitude_km - h) > 1e-12 || std::abs(p.end_angle_rad - angle) > 1e-6) {
          continue;
        }
        found = true;
        EXPECT_NEAR(p.end_zenith_rad, kPi - z, 1e-8);
        EXPECT_NEAR(length / length_out, 1.0, 1e-7);
        break;
      }
      EXPECT_TRUE(found) << h << ' ' << z;
    }
  }
}

// Refraction's derivative is smooth, though layers and shells have edges: sunlight's spreading
// depends on it. US standard but for the tropopause, through perigees of 1..8 km.
TEST(Refraction, SlopeOfBendingIsSmooth) {
  const Medium m = air(100, "graded", 550.0);
  const RefractedRays rays(m, 0);
  const double h = 60.0;
  const double step = 0.02 / 900.0;  // perigees 20 m apart
  std::vector<double> slope;
  for (double z = rays.horizon_apparent_zenith_rad(h) - 0.0085; slope.size() < 330; z += step) {
    const double bent = rays.trace_outward(h, z + step, {}).deflection_rad -
                        rays.trace_outward(h, z, {}).deflection_rad;
    slope.push_back(bent / step);
  }
  double worst = 0.0;
  for (std::size_t i = 20; i + 20 < slope.size(); ++i) {
    // Against the straight line through points 0.4 km away.
    const double line = 0.5 * (slope[i - 20] + slope[i + 20]);
    worst = std::max(worst, std::abs(slope[i] / line - 1.0));
  }
  std::printf("slope of bending: %.2e off a line of 0.8 km\n", worst);
  EXPECT_LT(worst, 0.01);
}

TEST(ApparentZenith, InvertsTheTrace) {
  const Medium m = air();
  const RefractedRays rays(m, 0);
  for (const double h : {0.0, 0.5, 7.3, 25.0, m.boundary_km[30], 90.0, 100.0, 400.0}) {
    const double horizon = rays.horizon_apparent_zenith_rad(h);
    const double lowest = horizon + rays.trace_outward(h, horizon - 1e-10, {}).deflection_rad;
    for (int i = 1; i <= 200; ++i) {
      const double truth = (lowest - 1e-6) * i / 200;
      const auto apparent = rays.apparent_zenith_rad(h, truth);
      ASSERT_TRUE(apparent.has_value()) << h << ' ' << truth;
      EXPECT_NEAR(rays.trace_outward(h, *apparent, {}).true_zenith_rad, truth, 2e-7);
      EXPECT_LE(*apparent, truth + 1e-7);
    }
    EXPECT_FALSE(rays.apparent_zenith_rad(h, lowest + 1e-5).has_value());
  }
}

// The printed formula of Haber et al. (2005) lets the index grow with height where the air dries:
// rays bent upwards there must be found too.
TEST(ApparentZenith, InvertsTheTraceOfThePrintedIndex) {
  for (const char* profile : {"us_standard", "tropical", "subarctic_winter"}) {
    AirOptions options;
    options.profile = profile;
    options.refractive_index = "haber2005";
    const Medium m = make_air(options, std::vector<double>{550.0});
    const RefractedRays rays(m, 0);
    for (const double h : {0.0, 2.0, 10.0, 11.5, 14.0, 30.0}) {
      const double horizon = rays.horizon_apparent_zenith_rad(h);
      for (int i = 1; i <= 100; ++i) {
        const double z = (horizon - 1e-6) * i / 100;
        const RayTrace t = rays.trace_outward(h, z, {});
        if (t.hits_ground) continue;
        const auto apparent = rays.apparent_zenith_rad(h, t.true_zenith_rad);
        ASSERT_TRUE(apparent.has_value()) << profile << ' ' << h << ' ' << z;
        EXPECT_NEAR(rays.trace_outward(h, *apparent, {}).true_zenith_rad, t.true_zenith_rad, 2e-7)
            << profile << ' ' << h << ' ' << z;
      }
    }
  }
}

TEST(ApparentZenith, OfZenithAndNadir) {
  for (const bool refraction : {true, false}) {
    const Medium m = air(100, "graded", 550.0, refraction);
    EXPECT_EQ(apparent_zenith_rad(m, 0, 3.0, 0.0), 0.0);
    EXPECT_FALSE(apparent_zenith_rad(m, 0, 3.0, kPi).has_value());
    EXPECT_FALSE(apparent_zenith_rad(m, 0, 500.0, kPi).has_value());
  }
}

// Without refraction the horizon dips by acos(R / (R + h)).
TEST(Horizon, DipsGeometricallyWithoutRefraction) {
  const Medium m = air(100, "graded", 550.0, false);
  for (const double h : {0.0, 0.002, 1.0, 10.0, 100.0, 500.0}) {
    EXPECT_NEAR(horizon_apparent_zenith_rad(m, 0, h) - 0.5 * kPi, std::acos(6371.0 / (6371.0 + h)),
                1e-9);
    EXPECT_FALSE(apparent_zenith_rad(m, 0, h, horizon_apparent_zenith_rad(m, 0, h) + 1e-6));
    EXPECT_TRUE(apparent_zenith_rad(m, 0, h, horizon_apparent_zenith_rad(m, 0, h) - 1e-6));
  }
}

// Refraction raises the horizon: the dip shrinks to about 0.92 of the geometric one (terrestrial
// refraction coefficient k = 0.13..0.17, dip factor sqrt(1 - k)).
TEST(Horizon, RefractionShrinksTheDip) {
  const Medium m = air(200);
  for (const double h : {0.01, 0.1, 0.5}) {
    const double dip = horizon_apparent_zenith_rad(m, 0, h) - 0.5 * kPi;
    EXPECT_NEAR(dip / std::acos(6371.0 / (6371.0 + h)), 0.92, 0.015);
  }
}

// Above R = 25000 km the standard atmosphere ducts; nothing may hang or turn into NaN.
TEST(Refraction, SurvivesLargeAndSmallPlanets) {
  for (const double radius_km : {1000.0, 20000.0, 26000.0, 30000.0, 40000.0, 70000.0}) {
    for (const int layers : {1, 30, 300}) {
      const Medium m = air(layers, "graded", 300.0, true, radius_km);
      const RefractedRays rays(m, 0);
      std::vector<double> path_km(m.layers());
      for (const double h : {0.0, 0.01, 1.0, 5.0, 20.0, 99.0, 100.0, 450.0}) {
        const double horizon = rays.horizon_apparent_zenith_rad(h);
        EXPECT_TRUE(std::isfinite(horizon));
        for (double z = 0.0; z <= kPi; z += 0.01) {
          const RayTrace t = rays.trace_outward(h, z, path_km);
          ASSERT_TRUE(std::isfinite(t.deflection_rad) && std::isfinite(t.perigee_km));
          ASSERT_EQ(t.hits_ground, z > horizon) << radius_km << ' ' << h << ' ' << z;
          for (const double p : path_km) ASSERT_TRUE(p >= 0.0 && std::isfinite(p));
          const auto apparent = rays.apparent_zenith_rad(h, z);
          if (apparent) {
            ASSERT_TRUE(*apparent >= 0.0 && *apparent <= horizon + 1e-12);
          }
        }
      }
    }
  }
}

TEST(Refraction, LayersNeedNotBeFine) {
  const Medium fine = air(500);
  const Medium coarse = air(20);
  const double a = RefractedRays(fine, 0).trace_outward(0.0, 0.5 * kPi, {}).deflection_rad;
  const double b = RefractedRays(coarse, 0).trace_outward(0.0, 0.5 * kPi, {}).deflection_rad;
  EXPECT_NEAR(b / a, 1.0, 0.02);
}

TEST(SlantOpticalDepth, SumsExtinction) {
  const Medium m = air(10);
  std::vector<double> path_km(10, 0.0);
  path_km[2] = 3.0;
  path_km[7] = 5.0;
  EXPECT_DOUBLE_EQ(slant_optical_depth(m, 0, path_km),
                   3.0 * m.extinction_per_km(2, 0) + 5.0 * m.extinction_per_km(7, 0));
  EXPECT_THROW(slant_optical_depth(m, 0, std::vector<double>(9)), std::invalid_argument);
}

TEST(Refraction, RejectsWhatIsOutOfRange) {
  Medium m = air(10);
  const RefractedRays rays(m, 0);
  std::vector<double> short_path(9);
  EXPECT_THROW(rays.trace_outward(-0.1, 0.0, {}), std::invalid_argument);
  EXPECT_THROW(rays.trace_outward(std::nan(""), 0.0, {}), std::invalid_argument);
  EXPECT_THROW(rays.trace_outward(0.0, -0.1, {}), std::invalid_argument);
  EXPECT_THROW(rays.trace_outward(0.0, 3.2, {}), std::invalid_argument);
  EXPECT_THROW(rays.trace_outward(0.0, 0.0, short_path), std::invalid_argument);
  EXPECT_THROW(rays.apparent_zenith_rad(0.0, std::nan("")), std::invalid_argument);
  EXPECT_THROW(RefractedRays(m, 1), std::invalid_argument);
  m.refractivity(3, 0) = -1e-5;
  EXPECT_THROW(RefractedRays(m, 0), std::invalid_argument);
  EXPECT_THROW(RefractedRays(Medium{}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
