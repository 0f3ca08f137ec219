#include "sim/view_ray.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "atmosphere/refraction.h"
#include "small_scene.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kDegree = kPi / 180;

Medium air(int layers = 100) {
  Scene scene = small_scene(0);
  scene.atmosphere.layers = layers;
  scene.atmosphere.top_km = 100;
  return build_scene_model(scene).medium;
}

double length(const ViewPath& path) {
  double sum = 0;
  for (const ViewStep& s : path.steps) sum += s.length_km;
  return sum;
}

// Straight ray from height h: to the ground if it meets it, else to the top.
double straight_length(double R, double top, double h, double elevation) {
  const double r = R + h, s = r * std::sin(elevation), p = r * std::cos(elevation);
  if (s < 0 && p < R) return -s - std::sqrt(R * R - p * p);
  return std::sqrt((R + top) * (R + top) - p * p) - s;
}

const std::vector<double> kElevations = {90, 60, 30, 10, 3, 1, 0.1, 0, -0.1, -1, -2, -5, -30, -90};

TEST(ViewRay, StraightLengthIsGeometry) {
  const Medium m = air();
  const double R = m.earth_radius_km;
  for (const double h : {0.0, 0.003, 1.0, 5.5, 10.0}) {
    for (const double e : kElevations) {
      const ViewPath path = trace_view(m, 1, false, h, e * kDegree, 4);
      const double want = straight_length(R, m.top_km(), h, e * kDegree);
      EXPECT_NEAR(length(path), want, 1e-9 * want + 1e-6) << h << ' ' << e;
      const double p = (R + h) * std::cos(e * kDegree);
      EXPECT_EQ(path.hits_ground, e < 0 && p < R) << h << ' ' << e;
    }
  }
}

// Midpoints of a straight ray lie on it: (rho, z) = s (cos e, sin e), tangent (cos e, sin e).
TEST(ViewRay, StraightStepsLieOnTheLine) {
  const Medium m = air();
  const double R = m.earth_radius_km;
  for (const double h : {0.0, 2.0}) {
    for (const double e : kElevations) {
      double s = 0;
      for (const ViewStep& step : trace_view(m, 0, false, h, e * kDegree, 4).steps) {
        const double mid = s + 0.5 * step.length_km;
        s += step.length_km;
        EXPECT_NEAR(step.rho_km, mid * std::cos(e * kDegree), 1e-6);
        EXPECT_NEAR(step.z_km, mid * std::sin(e * kDegree), 1e-6);
        EXPECT_NEAR(step.dir_r, std::cos(e * kDegree), 1e-9);
        EXPECT_NEAR(step.dir_z, std::sin(e * kDegree), 1e-9);
        EXPECT_NEAR(step.altitude_km, std::hypot(step.rho_km, R + h + step.z_km) - R, 1e-6);
      }
    }
  }
}

TEST(ViewRay, StepsStayWithinTheirLayers) {
  for (const int layers : {1, 7, 100}) {
    const Medium m = air(layers);
    for (const bool refraction : {false, true}) {
      for (const double h : {0.0, 1.0, m.boundary_km[1] * 0.999, 8.0}) {
        for (const double e : kElevations) {
          const ViewPath path = trace_view(m, 2, refraction, h, e * kDegree, 3);
          int last = -1;
          for (const ViewStep& step : path.steps) {
            const auto i = static_cast<std::size_t>(step.layer);
            ASSERT_LT(i, m.layers());
            EXPECT_GT(step.length_km, 0);
            EXPECT_LE(step.length_km, 3 * (1 + 1e-12));
            EXPECT_GE(step.altitude_km, m.boundary_km[i]);
            EXPECT_LE(step.altitude_km, m.boundary_km[i + 1]);
            // Within 4.5 m: a step of 3 km is bent by 3^2/(8 R) = 0.2 m only.
            const double there =
                std::hypot(step.rho_km, m.earth_radius_km + h + step.z_km) - m.earth_radius_km;
            EXPECT_NEAR(there, step.altitude_km, 1e-6);
            EXPECT_NEAR(std::hypot(step.dir_r, step.dir_z), 1, 1e-12);
            if (last >= 0) {
              EXPECT_LE(std::abs(step.layer - last), 1);
            }
            last = step.layer;
          }
        }
      }
    }
  }
}

// Where a straight line from height h at depression e meets the sphere: sine law.
TEST(ViewRay, MeetsTheGroundWhereGeometrySays) {
  const Medium m = air();
  const double R = m.earth_radius_km;
  for (const double h : {0.1, 1.0, 10.0}) {
    const double dip = std::acos(R / (R + h));
    for (const double e : {dip + 1e-4, dip + 0.01, 0.2, 1.0, kPi / 2}) {
      const ViewPath path = trace_view(m, 0, false, h, -e, 4);
      ASSERT_TRUE(path.hits_ground) << h << ' ' << e;
      const double at_ground = std::asin((R + h) * std::cos(e) / R);  // from the vertical there
      EXPECT_NEAR(path.ground_angle_rad, at_ground - (kPi / 2 - e), 1e-9);
      EXPECT_NEAR(path.ground_cosine, std::cos(at_ground), 1e-6);
    }
    EXPECT_FALSE(trace_view(m, 0, false, h, -dip + 1e-5, 4).hits_ground);
  }
}

TEST(ViewRay, StraightDownMeetsTheGroundBelow) {
  const Medium m = air();
  for (const bool refraction : {false, true}) {
    const ViewPath path = trace_view(m, 0, refraction, 3.0, -kPi / 2, 4);
    ASSERT_TRUE(path.hits_ground);
    EXPECT_NEAR(length(path), 3.0, refraction ? 3e-8 : 1e-9);  // RefractedRays: 1e-8
    EXPECT_NEAR(path.ground_angle_rad, 0, 1e-12);
    EXPECT_NEAR(path.ground_cosine, 1, 1e-12);
  }
}

TEST(ViewRay, FromTheGroundDownwardsIsNoPath) {
  const Medium m = air();
  const ViewPath path = trace_view(m, 0, true, 0.0, -0.3, 4);
  EXPECT_TRUE(path.hits_ground);
  EXPECT_NEAR(length(path), 0, 1e-6);
}

TEST(ViewRay, ZenithIsUnbent) {
  const Medium m = air();
  const ViewPath path = trace_view(m, 0, true, 0.0, kPi / 2, 4);
  EXPECT_FALSE(path.hits_ground);
  EXPECT_NEAR(length(path), m.top_km(), 1e-9);
  for (const ViewStep& s : path.steps) EXPECT_NEAR(s.rho_km, 0, 1e-9);
}

// The path is the exact ray's: what bends between the middle of the last step and the end is less
// than an arc second, and the air it passes is the same.
TEST(ViewRay, IsTheExactRay) {
  for (const int layers : {20, 100}) {
    const Medium m = air(layers);
    const RefractedRays rays(m, 1);
    double worst = 0;
    for (const double h : {0.0, 1.7, 3.0}) {
      for (const double e : {0.0, 0.5, 2.0, 5.0, 15.0, 45.0}) {
        std::vector<double> exact(m.layers()), here(m.layers(), 0.0);
        const RayTrace trace = rays.trace_outward(h, kPi / 2 - e * kDegree, exact);
        const ViewPath path = trace_view(m, 1, true, h, e * kDegree, 5);
        const ViewStep& last = path.steps.back();
        const double bent = e * kDegree - std::atan2(last.dir_z, last.dir_r);
        EXPECT_GT(bent, 0);
        EXPECT_NEAR(bent, trace.deflection_rad, kDegree / 3600) << h << ' ' << e;
        worst = std::max(worst, std::abs(bent - trace.deflection_rad));
        for (const ViewStep& s : path.steps) {
          here[static_cast<std::size_t>(s.layer)] += s.length_km;
        }
        EXPECT_NEAR(slant_optical_depth(m, 1, here) / slant_optical_depth(m, 1, exact), 1, 1e-12)
            << h << ' ' << e;
      }
    }
    std::printf("%d layers: bending differs by %.3f arc seconds at most\n", layers,
                worst / kDegree * 3600);
  }
}

// Hohenkerk & Sinclair (1985), 2044.24 arc seconds at 283.15 K, 1010 hPa and 501.69 nm, scaled to
// the density of 288.2 K and 1013 hPa and the refractivity at 550 nm (0.4 % less), within 2 %
// (the profile's shape; see tests/atmosphere), whatever the layers.
TEST(ViewRay, HorizonBendingDoesNotDependOnTheLayers) {
  const auto bending = [&](int layers) {
    const ViewStep last = trace_view(air(layers), 1, true, 0, 0, 2).steps.back();
    return -std::atan2(last.dir_z, last.dir_r) / kDegree * 60;
  };
  const double fine = bending(500);
  std::printf("horizon bending: 20 layers %.2f', 50 %.2f', 100 %.2f', 500 %.2f'\n", bending(20),
              bending(50), bending(100), fine);
  const double tabulated = 2044.24 / 60 * (1013.0 / 1010.0) * (283.15 / 288.2) * 0.996;
  EXPECT_NEAR(fine, tabulated, 0.02 * tabulated);
  EXPECT_NEAR(bending(100), fine, 0.005 * fine);
  EXPECT_NEAR(bending(50), fine, 0.005 * fine);
  EXPECT_NEAR(bending(20), fine, 0.02 * fine);
}

// Light goes the same way back: steps seen from a point of the path back to the observer. The
// observer stands at a boundary so that both see the same layers.
TEST(ViewRay, FromOrbitIsTheGroundsRayReversed) {
  const Medium m = air();
  const RefractedRays rays(m, 1);
  for (const double e : {0.3, 2.0, 20.0, 70.0}) {
    const RayPath up = rays.follow(0, kPi / 2 - e * kDegree);
    const PathPiece& out = up.pieces.back();
    // On, straight, to 800 km: the same impact parameter.
    const double R = m.earth_radius_km;
    const double sine = (R + 100) * std::sin(out.end_zenith_rad) / (R + 800);
    const ViewPath down = trace_view(m, rays, 800, std::asin(sine) - kPi / 2, 4);
    ASSERT_TRUE(down.hits_ground) << e;
    EXPECT_NEAR(down.ground_cosine, std::sin(e * kDegree), 2e-6) << e;
    double length_up = 0;
    for (const PathPiece& p : up.pieces) length_up += p.length_km;
    EXPECT_NEAR(length(down), length_up, 1e-5 * length_up) << e;
    // Central angle: the straight piece and the air's.
    const double straight = out.end_zenith_rad - std::asin(sine);
    EXPECT_NEAR(down.ground_angle_rad, straight + out.end_angle_rad, 1e-6) << e;
  }
  // Past the limb: no path.
  EXPECT_TRUE(trace_view(m, rays, 800, 0, 4).steps.empty());
  EXPECT_FALSE(trace_view(m, rays, 800, 0, 4).hits_ground);
  EXPECT_TRUE(trace_view(m, rays, 800, 1, 4).steps.empty());
}

// From above, a ray below the horizontal clears the ground if it is above the dip; refraction
// raises the visible horizon, so the dip is smaller than the straight one.
TEST(ViewRay, RefractionRaisesTheHorizon) {
  const Medium m = air();
  const double R = m.earth_radius_km;
  for (const double h : {1.0, 5.0, 10.0}) {
    const double straight_dip = std::acos(R / (R + h));
    const double dip = RefractedRays(m, 1).horizon_apparent_zenith_rad(h) - kPi / 2;
    EXPECT_LT(dip, straight_dip);
    EXPECT_FALSE(trace_view(m, 1, true, h, -0.95 * dip, 4).hits_ground);
    EXPECT_TRUE(trace_view(m, 1, true, h, -straight_dip, 4).hits_ground);
  }
}

}  // namespace
}  // namespace twilight
