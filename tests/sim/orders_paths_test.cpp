#include "sim/orders_paths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "atmosphere/straight_path.h"
#include "sim/gauss_legendre.h"
#include "sim/orders_grid.h"
#include "small_scene.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kDegree = pi / 180;
constexpr double kMaxAngle_rad = 0.5 * kDegree;

// Random shells; lane w scatters the share w / lanes of its extinction, air and one kind of aerosol
// half each where there is aerosol (a third of the layers have none).
struct RandomAir {
  Medium medium;
  PathOptics optics;
  RandomAir(std::mt19937& random, double vertical_depth, bool constant_shares = false) {
    std::uniform_real_distribution<double> unit(0, 1);
    const std::size_t layers = 3 + random() % 20, lanes = 8;
    std::vector<double> boundary{0};
    for (std::size_t i = 0; i < layers; ++i) {
      boundary.push_back(boundary.back() + std::pow(10, -1 + 1.9 * unit(random)));
    }
    for (double& z : boundary) z *= 60 / boundary.back();
    medium = layered_air(60, std::vector<double>(layers, 0.0), 0, lanes);
    medium.boundary_km = boundary;
    optics.earth_radius_km = medium.earth_radius_km;
    optics.boundary_km = boundary;
    optics.lanes = lanes;
    optics.kinds = 1;
    optics.extinction_per_km.assign(layers * lanes, 0.0);
    optics.scattering_per_km.assign(layers * 2 * lanes, 0.0);
    for (std::size_t i = 0; i < layers; ++i) {
      const bool aerosol = constant_shares || random() % 3 > 0;
      optics.kind_present.push_back(aerosol);
      for (std::size_t w = 0; w < lanes; ++w) {
        const double extinction = vertical_depth / 60 * 2 * unit(random);
        const double scattering = extinction * static_cast<double>(w) / lanes;
        optics.extinction_per_km[i * lanes + w] = extinction;
        optics.scattering_per_km[i * 2 * lanes + w] = scattering * (aerosol ? 0.5 : 1);
        optics.scattering_per_km[(i * 2 + 1) * lanes + w] = scattering * (aerosol ? 0.5 : 0);
        medium.gas_absorption_per_km(i, w) = extinction;
      }
    }
  }
};

struct Ray {
  double altitude_km, zenith_rad;
};

// From the ground, the middle and the top; up, down, level and grazing.
std::vector<Ray> rays(const Medium& m) {
  std::vector<Ray> all;
  for (const double z : {0.0, 0.37, 11.0, 33.3, m.top_km()}) {
    const double horizon = pi - std::asin(m.earth_radius_km / (m.earth_radius_km + z));
    for (const double zenith : {0.0, 0.5, 1.4, 1.55, pi / 2, horizon - 0.02, horizon - 1e-4,
                                horizon + 1e-4, horizon + 0.02, 2.5, pi}) {
      if (zenith < pi + 1e-12) all.push_back({z, std::min(zenith, pi)});
    }
  }
  return all;
}

// The integral of exp(-depth) scattering source ds of one lane and column by quadrature between
// the shells; source of the distance from the start.
double integral(const PathOptics& o, const Ray& ray, std::size_t lane, std::size_t column,
                const std::function<double(double)>& source) {
  using Real = long double;
  const Real R = o.earth_radius_km, r0 = R + ray.altitude_km;
  const Real foot = -r0 * std::cos(static_cast<Real>(ray.zenith_rad));
  const Real perigee = r0 * std::sin(static_cast<Real>(ray.zenith_rad));
  const auto chord = [&](Real r) {
    return r > perigee ? std::sqrt((r - perigee) * (r + perigee)) : Real(0);
  };
  const bool ground = foot > 0 && perigee < R;
  const Real end =
      std::max(Real(0), ground ? foot - chord(R)
                               : foot + chord(R + static_cast<Real>(o.boundary_km.back())));
  std::vector<Real> cuts{0, end};
  for (const double b : o.boundary_km) {
    for (const Real side : {-1.0L, 1.0L}) {
      const Real s = foot + side * chord(R + static_cast<Real>(b));
      if (s > 0 && s < end) cuts.push_back(s);
    }
  }
  std::ranges::sort(cuts);
  static const auto nodes = gauss_legendre(12, 0, 1);
  double sum = 0, depth = 0;
  for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
    const Real middle = 0.5L * (cuts[k] + cuts[k + 1]);
    const auto z = static_cast<double>(std::hypot(middle - foot, perigee) - R);
    const auto above = std::ranges::upper_bound(o.boundary_km, z);
    const auto layer = static_cast<std::size_t>(
        std::clamp<std::ptrdiff_t>(above - o.boundary_km.begin() - 1, 0,
                                   static_cast<std::ptrdiff_t>(o.boundary_km.size()) - 2));
    const double extinction = o.extinction_per_km[layer * o.lanes + lane];
    const double scattering =
        o.scattering_per_km[(layer * (1 + o.kinds) + column) * o.lanes + lane];
    const auto length = static_cast<double>(cuts[k + 1] - cuts[k]);
    const int parts = 1 + static_cast<int>(extinction * length);
    for (int p = 0; p < parts; ++p) {
      for (const GaussNode& g : nodes) {
        const double s = length * (p + g.x) / parts;
        sum += g.weight * length / parts * std::exp(-depth - extinction * s) * scattering *
               source(static_cast<double>(cuts[k]) + s);
      }
    }
    depth += extinction * length;
  }
  return sum;
}

double weighed(const SampledPath& path, std::size_t lanes, std::size_t lane, std::size_t column,
               const std::function<double(const PathSample&)>& source) {
  double sum = 0;
  for (std::size_t k = 0; k < path.samples.size(); ++k) {
    sum += path.weight[(k * 2 + column) * lanes + lane] * source(path.samples[k]);
  }
  return sum;
}

// Distance along a slant ray at which its central angle is reached.
double distance_at(const Ray& ray, double radius_km, double angle) {
  return (radius_km + ray.altitude_km) * std::sin(angle) / std::sin(ray.zenith_rad - angle);
}

const std::vector<double> kLevel_km = orders_levels(60, 14);

class SampledPaths : public testing::TestWithParam<SourceShape> {};
INSTANTIATE_TEST_SUITE_P(Shapes, SampledPaths,
                         testing::Values(SourceShape::kLinear, SourceShape::kCubic),
                         [](const auto& shape) {
                           return shape.param == SourceShape::kLinear ? "Linear" : "Cubic";
                         });

TEST_P(SampledPaths, ConstantSourceGivesWhatTheDepthTakes) {
  const SourceShape shape = GetParam();
  std::mt19937 random(1);
  SampledPath path;
  for (int trial = 0; trial < 10; ++trial) {
    const RandomAir air(random, trial < 5 ? 0.3 : 3, true);
    std::vector<double> length(air.medium.layers());
    for (const Ray& ray : rays(air.medium)) {
      const bool clear =
          straight_path(air.medium, ray.altitude_km, ray.zenith_rad, HUGE_VAL, length);
      sample_path(air.optics, kLevel_km, ray.altitude_km, ray.zenith_rad, kMaxAngle_rad, shape,
                  path);
      EXPECT_EQ(path.hits_ground, !clear) << ray.altitude_km << " " << ray.zenith_rad;
      for (std::size_t w = 0; w < 8; ++w) {
        double depth = 0;
        for (std::size_t i = 0; i < length.size(); ++i) {
          depth += length[i] * air.medium.extinction_per_km(i, w);
        }
        const double want = static_cast<double>(w) / 8 * -std::expm1(-depth);
        const auto one = [](const PathSample&) { return 1.0; };
        // Levels that share in a sample by less than 1e-6 are left out of it.
        EXPECT_NEAR(weighed(path, 8, w, 0, one), 0.5 * want, 1e-6 * want + 1e-12);
        EXPECT_NEAR(weighed(path, 8, w, 1, one), 0.5 * want, 1e-6 * want + 1e-12);
        EXPECT_NEAR(path.ground_transmittance[w], std::exp(-depth), 1e-9);
      }
    }
  }
}

// Lane w sees layer w alone: its depth is the length there.
TEST_P(SampledPaths, LengthsAreThoseOfStraightPath) {
  const SourceShape shape = GetParam();
  Medium m = layered_air(60, std::vector<double>(8, 0.0));
  m.boundary_km = {0, 0.4, 1, 3, 8, 15, 25, 40, 60};
  PathOptics o;
  o.earth_radius_km = m.earth_radius_km;
  o.boundary_km = m.boundary_km;
  o.lanes = 8;
  o.extinction_per_km.assign(64, 0.0);
  o.scattering_per_km.assign(64, 0.0);
  for (std::size_t i = 0; i < 8; ++i) o.extinction_per_km[i * 8 + i] = 1e-2;
  std::vector<double> length(8);
  SampledPath path;
  for (const Ray& ray : rays(m)) {
    straight_path(m, ray.altitude_km, ray.zenith_rad, HUGE_VAL, length);
    sample_path(o, kLevel_km, ray.altitude_km, ray.zenith_rad, kMaxAngle_rad, shape, path);
    for (std::size_t i = 0; i < 8; ++i) {
      EXPECT_NEAR(-std::log(path.ground_transmittance[i]) * 100, length[i], 1e-5 + 1e-9 * length[i])
          << ray.altitude_km << " " << ray.zenith_rad << " " << i;
    }
  }
}

TEST_P(SampledPaths, SourceLinearAlongTheRayIsExact) {
  const SourceShape shape = GetParam();
  std::mt19937 random(2);
  SampledPath path;
  for (int trial = 0; trial < 4; ++trial) {
    const RandomAir air(random, trial < 2 ? 0.2 : 4);
    const double R = air.medium.earth_radius_km;
    for (const Ray& ray : rays(air.medium)) {
      sample_path(air.optics, kLevel_km, ray.altitude_km, ray.zenith_rad, kMaxAngle_rad, shape,
                  path);
      const bool vertical = ray.zenith_rad < 1e-9 || ray.zenith_rad > pi - 1e-9;
      const auto at_sample = [&](const PathSample& s) {
        const double distance =
            vertical ? (kLevel_km[static_cast<std::size_t>(s.level)] - ray.altitude_km) *
                           std::cos(ray.zenith_rad)
                     : distance_at(ray, R, s.central_angle_rad);
        return 1 + 0.01 * distance;
      };
      for (const std::size_t w : {std::size_t{1}, std::size_t{7}}) {
        for (const std::size_t column : {std::size_t{0}, std::size_t{1}}) {
          const double want =
              integral(air.optics, ray, w, column, [](double s) { return 1 + 0.01 * s; });
          EXPECT_NEAR(weighed(path, 8, w, column, at_sample), want, 1e-8 + 1e-6 * want)
              << ray.altitude_km << " " << ray.zenith_rad;
        }
      }
    }
  }
}

// Samples: on levels, in order, close to each other, under the angles of a straight line.
TEST_P(SampledPaths, SamplesFollowTheLine) {
  const SourceShape shape = GetParam();
  std::mt19937 random(3);
  const RandomAir air(random, 0.1);
  SampledPath path;
  for (const Ray& ray : rays(air.medium)) {
    sample_path(air.optics, kLevel_km, ray.altitude_km, ray.zenith_rad, kMaxAngle_rad, shape, path);
    double before = 0;
    for (const PathSample& s : path.samples) {
      EXPECT_GE(s.level, 0);
      EXPECT_LT(s.level, static_cast<int>(kLevel_km.size()));
      EXPECT_GE(s.central_angle_rad, before);
      EXPECT_LE(s.central_angle_rad, before + kMaxAngle_rad * (1 + 1e-6));
      EXPECT_NEAR(s.zenith_rad, ray.zenith_rad - s.central_angle_rad, 1e-12);
      before = s.central_angle_rad;
    }
  }
}

// A source that is a smooth function of altitude between its levels: linear interpolation there.
TEST_P(SampledPaths, FinerLevelsConverge) {
  const SourceShape shape = GetParam();
  std::mt19937 random(4);
  const RandomAir air(random, 0.3, true);
  const double R = air.medium.earth_radius_km;
  const Ray ray{0.37, 1.4};
  const auto error = [&](int levels) {
    const std::vector<double> level_km = orders_levels(60, levels);
    SampledPath path;
    sample_path(air.optics, level_km, ray.altitude_km, ray.zenith_rad, kMaxAngle_rad, shape, path);
    const double sum = weighed(path, 8, 7, 0, [&](const PathSample& s) {
      return std::exp(-level_km[static_cast<std::size_t>(s.level)] / 8);
    });
    const double want = integral(air.optics, ray, 7, 0, [&](double s) {
      const double r0 = R + ray.altitude_km;
      const double z = std::sqrt(r0 * r0 + s * s + 2 * s * r0 * std::cos(ray.zenith_rad)) - R;
      return std::exp(-z / 8);
    });
    return std::abs(sum / want - 1);
  };
  const double coarse = error(20), fine = error(40);
  std::printf("error of an exponential source: 20 levels %.1e, 40 levels %.1e\n", coarse, fine);
  EXPECT_LT(fine, (shape == SourceShape::kLinear ? 0.4 : 0.15) * coarse);
  EXPECT_LT(fine, shape == SourceShape::kLinear ? 2e-3 : 2e-4);
}

// Without refractivity the bent ray is the straight one, though cut elsewhere; thick layers are
// whole pieces then, in which altitude is not linear along the ray.
TEST_P(SampledPaths, RefractedRayOfNoRefractivityIsTheStraightOne) {
  const SourceShape shape = GetParam();
  std::mt19937 random(5);
  SampledPath path, straight;
  double worst = 0, worst_smooth = 0;
  for (int trial = 0; trial < 3; ++trial) {
    const RandomAir air(random, trial < 2 ? 0.2 : 4);
    const RefractedRays lines(air.medium, 0);
    for (const Ray& ray : rays(air.medium)) {
      sample_path(air.optics, kLevel_km, ray.altitude_km, ray.zenith_rad, kMaxAngle_rad, shape,
                  straight);
      const RayPath pieces = lines.follow(ray.altitude_km, ray.zenith_rad);
      sample_path(air.optics, kLevel_km, pieces, kMaxAngle_rad, shape, path);
      EXPECT_EQ(path.hits_ground, straight.hits_ground);
      // The source: falls with height, changes with the Sun's zenith angle.
      const auto source = [&](const PathSample& s) {
        return std::exp(-kLevel_km[static_cast<std::size_t>(s.level)] / 20 +
                        s.central_angle_rad * 10);
      };
      for (std::size_t w = 0; w < 8; ++w) {
        EXPECT_NEAR(path.ground_transmittance[w], straight.ground_transmittance[w], 1e-5);
        const auto one = [](const PathSample&) { return 1.0; };
        for (const std::size_t column : {std::size_t{0}, std::size_t{1}}) {
          const double a = weighed(path, 8, w, column, one),
                       b = weighed(straight, 8, w, column, one);
          worst = std::max(worst, std::abs(a - b));
          const double c = weighed(path, 8, w, column, source),
                       d = weighed(straight, 8, w, column, source);
          if (d > 1e-3) worst_smooth = std::max(worst_smooth, std::abs(c / d - 1));
        }
      }
      if (path.hits_ground) {
        EXPECT_NEAR(path.ground_angle_rad, straight.ground_angle_rad, 1e-7);
      }
    }
  }
  std::printf("refracted path without refractivity: constant source %.1e, smooth source %.1e\n",
              worst, worst_smooth);
  EXPECT_LE(worst, 1e-5);
  EXPECT_LE(worst_smooth, 1e-2);  // of 14 levels, wherever the samples are
}

TEST_P(SampledPaths, NoAirAndDepth50) {
  const SourceShape shape = GetParam();
  PathOptics o;
  o.earth_radius_km = 6371;
  o.boundary_km = {0, 60};
  o.lanes = 8;
  o.extinction_per_km.assign(8, 0.0);
  o.scattering_per_km.assign(8, 0.0);
  SampledPath path;
  sample_path(o, kLevel_km, 0, 0.3, kMaxAngle_rad, shape, path);
  EXPECT_TRUE(path.samples.empty());
  for (const double t : path.ground_transmittance) EXPECT_EQ(t, 1);
  for (const double depth : {1e-12, 1e-6, 50.0, 1000.0}) {
    o.extinction_per_km.assign(8, depth / 60);
    o.scattering_per_km.assign(8, depth / 60);
    sample_path(o, kLevel_km, 60, pi, kMaxAngle_rad, shape, path);
    double sum = 0;
    for (std::size_t k = 0; k < path.samples.size(); ++k) sum += path.weight[k * 8];
    EXPECT_NEAR(sum / -std::expm1(-depth), 1, 1e-11) << depth;
    EXPECT_NEAR(path.ground_transmittance[0], std::exp(-depth), 1e-12);
    EXPECT_TRUE(path.hits_ground);
  }
}

}  // namespace
}  // namespace twilight
