#include "atmosphere/straight_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "atmosphere/air.h"
#include "atmosphere/refraction.h"

namespace twilight {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Medium shells(double radius_km = 6371.0) {
  AirOptions options;
  options.earth_radius_km = radius_km;
  options.refraction = false;
  return make_air(options, std::vector<double>{550.0});
}

double total(const std::vector<double>& path_km) {
  return std::accumulate(path_km.begin(), path_km.end(), 0.0);
}

TEST(StraightPath, SumsToTheDistanceInsideTheAtmosphere) {
  const Medium m = shells();
  std::vector<double> path_km(m.layers());
  for (const double h : {0.0, 1.234, 30.0, m.boundary_km[50]}) {
    for (double z = 0.0; z < 1.55; z += 0.05) {
      for (const double d : {0.0, 1e-6, 0.01, 3.0, 60.0}) {
        EXPECT_TRUE(straight_path(m, h, z, d, path_km));
        EXPECT_NEAR(total(path_km), d, 1e-12 * d + 1e-13);
      }
    }
  }
}

TEST(StraightPath, WithoutEndEqualsTheUnrefractedRay) {
  for (const double radius_km : {1000.0, 6371.0, 70000.0}) {
    const Medium m = shells(radius_km);
    const RefractedRays rays(m, 0);
    std::vector<double> a(m.layers());
    std::vector<double> b(m.layers());
    for (const double h : {0.0, 0.5, 42.0, 100.0, 333.0}) {
      for (double z = 0.0; z <= std::numbers::pi; z += 0.013) {
        const bool clear = straight_path(m, h, z, kInfinity, a);
        EXPECT_EQ(clear, !rays.trace_outward(h, z, b).hits_ground);
        for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-9 + 1e-11 * b[i]);
      }
    }
  }
}

TEST(StraightPath, IsAdditive) {
  const Medium m = shells();
  std::vector<double> whole(m.layers());
  std::vector<double> first(m.layers());
  std::vector<double> second(m.layers());
  for (const double z : {0.4, 1.5, 1.6, 1.63}) {
    const double h = 20.0;
    ASSERT_TRUE(straight_path(m, h, z, 700.0, whole));
    ASSERT_TRUE(straight_path(m, h, z, 250.0, first));
    // State after 250 km.
    const double r = 6391.0;
    const double x = r * std::cos(z) + 250.0;
    const double y = r * std::sin(z);
    ASSERT_TRUE(straight_path(m, std::hypot(x, y) - 6371.0, std::atan2(y, x), 450.0, second));
    for (std::size_t i = 0; i < whole.size(); ++i) {
      EXPECT_NEAR(first[i] + second[i], whole[i], 1e-7) << z;
    }
  }
}

TEST(StraightPath, ReversedSegmentIsTheSame) {
  const Medium m = shells();
  std::vector<double> there(m.layers());
  std::vector<double> back(m.layers());
  for (const double z : {0.3, 1.2, 1.57, 1.62}) {
    const double d = 300.0;
    const double x = 6381.0 * std::cos(z) + d;
    const double y = 6381.0 * std::sin(z);
    ASSERT_TRUE(straight_path(m, 10.0, z, d, there));
    ASSERT_TRUE(
        straight_path(m, std::hypot(x, y) - 6371.0, std::numbers::pi - std::atan2(y, x), d, back));
    for (std::size_t i = 0; i < there.size(); ++i) EXPECT_NEAR(there[i], back[i], 1e-7) << z;
  }
}

TEST(StraightPath, StopsAtTheGround) {
  const Medium m = shells();
  std::vector<double> path_km(m.layers());
  EXPECT_FALSE(straight_path(m, 10.0, std::numbers::pi, 20.0, path_km));
  EXPECT_NEAR(total(path_km), 10.0, 1e-12);
  EXPECT_TRUE(straight_path(m, 10.0, std::numbers::pi, 9.0, path_km));
  EXPECT_NEAR(total(path_km), 9.0, 1e-12);
  EXPECT_FALSE(straight_path(m, 0.0, 2.0, 1.0, path_km));
  EXPECT_EQ(total(path_km), 0.0);
}

TEST(StraightPath, FromAboveTheTop) {
  const Medium m = shells();
  std::vector<double> path_km(m.layers());
  EXPECT_TRUE(straight_path(m, 300.0, 0.5, 1e4, path_km));
  EXPECT_EQ(total(path_km), 0.0);
  EXPECT_TRUE(straight_path(m, 300.0, std::numbers::pi, 150.0, path_km));
  EXPECT_EQ(total(path_km), 0.0);
  EXPECT_TRUE(straight_path(m, 300.0, std::numbers::pi, 260.0, path_km));
  EXPECT_NEAR(total(path_km), 60.0, 1e-10);
}

TEST(StraightPath, RejectsWhatIsOutOfRange) {
  const Medium m = shells();
  std::vector<double> path_km(m.layers());
  std::vector<double> wrong(3);
  EXPECT_THROW(straight_path(m, -1.0, 0.0, 1.0, path_km), std::invalid_argument);
  EXPECT_THROW(straight_path(m, 1.0, 4.0, 1.0, path_km), std::invalid_argument);
  EXPECT_THROW(straight_path(m, 1.0, 0.0, -1.0, path_km), std::invalid_argument);
  EXPECT_THROW(straight_path(m, 1.0, 0.0, std::nan(""), path_km), std::invalid_argument);
  EXPECT_THROW(straight_path(m, 1.0, 0.0, 1.0, wrong), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
