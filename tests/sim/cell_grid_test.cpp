#include "sim/cell_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;

Medium air(double top_km, int layers, double radius_km = 6371.0) {
  Medium m;
  m.earth_radius_km = radius_km;
  m.wavelength_nm = {550};
  for (int i = 0; i <= layers; ++i) m.boundary_km.push_back(top_km * i / layers);
  return m;
}

// Haber et al. (2005), Sec. 4.1.3: "101 shells for S = 72 and 252 shells for S = 180" with
// Rmax = 670 km: from an innermost radius of 100 m, shells whose centre lies within Rmax.
TEST(ShellCount, MatchesHaber2005) {
  const double outer = outer_radius_km(air(35, 1), 0);
  EXPECT_NEAR(outer, std::sqrt(35.0 * 35.0 + 2 * 6371.0 * 35.0), 1e-9);
  EXPECT_NEAR(outer, 670, 5);
  EXPECT_EQ(shell_count(72, 0.1, outer), 101);
  EXPECT_EQ(shell_count(180, 0.1, outer), 252);
}

// The 10 m of the paper's text, with its rule to the letter, give other counts than its own.
TEST(ShellCount, TenMetresGiveMoreShellsThanThePaperCounts) {
  const double outer = outer_radius_km(air(35, 1), 0);
  EXPECT_EQ(shells_to_cover(72, 0.01, outer), 128);
  EXPECT_EQ(shells_to_cover(180, 0.01, outer), 319);
}

// r_j = r_0 q^j until r_j >= r_max: the last shell reaches r_max, the one before does not.
TEST(ShellCount, LastShellReachesOuterRadius) {
  for (const int divisions : {8, 36, 72, 180, 360}) {
    const double d = 2 * kPi / divisions, q = (1 + d / 2) / (1 - d / 2);
    for (const double outer : {10.0, 668.7, 1200.0}) {
      const int n = shells_to_cover(divisions, 0.1, outer);
      EXPECT_GE(0.1 * std::pow(q, n), outer * (1 - 1e-9));
      EXPECT_LT(0.1 * std::pow(q, n - 1), outer);
      const int counted = shell_count(divisions, 0.1, outer);
      EXPECT_TRUE(counted == n || counted == n - 1);
      EXPECT_LE(0.1 * std::pow(q, counted - 1) * (1 + q) / 2, outer);
    }
  }
}

// From a height the longest straight path runs down to the horizon and up to the top.
TEST(OuterRadius, IsTheLongestPathThatClearsTheGround) {
  const double R = 6371;
  for (const double h : {0.0, 0.5, 3.0, 10.0}) {
    const double down = std::sqrt((R + h) * (R + h) - R * R);
    const double up = std::sqrt((R + 60) * (R + 60) - R * R);
    EXPECT_NEAR(outer_radius_km(air(60, 3), h), down + up, 1e-6);
  }
}

// Volume of the air between two altitudes and two distances from the observer: spherical caps,
// integrated over the distance.
double volume_between(double R, double h0, double r0, double r1, double low, double high) {
  const int n = 20000;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double r = r0 + (r1 - r0) * (i + 0.5) / n;
    const auto sine = [&](double h) {
      return std::clamp(((R + h) * (R + h) - (R + h0) * (R + h0) - r * r) / (2 * (R + h0) * r),
                        -1.0, 1.0);
    };
    sum += 2 * kPi * r * r * (sine(high) - sine(low)) * (r1 - r0) / n;
  }
  return sum;
}

struct Layout {
  int divisions, stride;
  double inner_km, height_km, cell_height_km, top_km;
};

class CellLayout : public testing::TestWithParam<Layout> {
 protected:
  CellGridOptions options() const {
    const Layout& p = GetParam();
    CellGridOptions o;
    o.azimuth_divisions = p.divisions;
    o.inner_radius_km = p.inner_km;
    o.observer_height_km = p.height_km;
    o.active_shell_stride = p.stride;
    o.cell_height_km = p.cell_height_km;
    return o;
  }
};

TEST_P(CellLayout, TilesTheAir) {
  const Medium m = air(GetParam().top_km, 24);
  const CellGrid grid(m, options());
  const double R = m.earth_radius_km, h0 = GetParam().height_km;
  std::vector<double> layer(m.layers(), 0.0);
  double total = 0;
  for (std::size_t i = 0; i < grid.air_rings(); ++i) {
    const CellRing& ring = grid.rings()[i];
    EXPECT_FALSE(ring.ground);
    double parts = 0;
    for (const auto& [l, volume] : ring.layer_volume_km3) {
      EXPECT_GE(volume, 0);
      parts += volume;
      layer[static_cast<std::size_t>(l)] += volume * grid.azimuth_divisions();
    }
    EXPECT_NEAR(parts, ring.volume_km3, 1e-9 * ring.volume_km3);
    total += ring.volume_km3 * grid.azimuth_divisions();
  }
  const double r0 = grid.shells().front().r_min_km, r1 = grid.shells().back().r_max_km;
  EXPECT_GE(r1, grid.outer_radius_km() * (1 - 1e-12));
  EXPECT_NEAR(total / volume_between(R, h0, r0, r1, 0, m.top_km()), 1.0, 0.01);
  // Altitude by altitude too: light is scattered by what is where. The cells' points are at most
  // 1 km apart in height, or an eighth of a cell (up to 7 km) where cells may be of any height.
  const double bound = GetParam().cell_height_km > 0 ? 0.04 : 0.12;
  for (std::size_t i = 0; i + 3 < m.layers(); i += 4) {
    const double have = layer[i] + layer[i + 1] + layer[i + 2] + layer[i + 3];
    const double want = volume_between(R, h0, r0, r1, m.boundary_km[i], m.boundary_km[i + 4]);
    EXPECT_NEAR(have / want, 1.0, bound) << m.boundary_km[i] << " km";
  }
}

TEST_P(CellLayout, ReferencePointsLieInTheAir) {
  const Medium m = air(GetParam().top_km, 24);
  for (const bool means : {true, false}) {
    CellGridOptions o = options();
    o.cell_means = means;
    const CellGrid grid(m, o);
    ASSERT_GT(grid.air_rings(), 0U);
    for (std::size_t i = 0; i < grid.air_rings(); ++i) {
      const CellRing& ring = grid.rings()[i];
      EXPECT_GT(ring.volume_km3, 0);
      EXPECT_GT(ring.half_chord_km, 0);
      EXPECT_GE(ring.altitude_km, 0);
      EXPECT_LE(ring.altitude_km, m.top_km());
      EXPECT_EQ(ring.layer, layer_at(m, ring.altitude_km));
      const double up = m.earth_radius_km + GetParam().height_km + ring.z_km;
      EXPECT_NEAR(std::hypot(ring.rho_km, up) - m.earth_radius_km, ring.altitude_km, 1e-6);
      EXPECT_NEAR(std::hypot(ring.rho_km, ring.z_km), ring.radius_km, 1e-9 * ring.radius_km);
    }
  }
}

TEST_P(CellLayout, GroundRingsTileTheGround) {
  const Medium m = air(GetParam().top_km, 24);
  const double R = m.earth_radius_km, h0 = GetParam().height_km;
  for (const bool group : {true, false}) {
    CellGridOptions o = options();
    o.group_shells = group;
    const CellGrid grid(m, o);
    double area = 0, last = 0;
    ASSERT_GT(grid.rings().size(), grid.air_rings());
    for (std::size_t i = grid.air_rings(); i < grid.rings().size(); ++i) {
      const CellRing& ring = grid.rings()[i];
      EXPECT_TRUE(ring.ground);
      EXPECT_GT(ring.volume_km3, 0);
      EXPECT_GT(ring.rho_km, last);
      last = ring.rho_km;
      // On the sphere, with its normal.
      EXPECT_NEAR(std::hypot(ring.rho_km, R + h0 + ring.z_km), R, 1e-6);
      EXPECT_NEAR(ring.slope_r, ring.rho_km / R, 1e-9);
      EXPECT_NEAR(std::hypot(ring.slope_r, ring.slope_z), 1, 1e-12);
      area += ring.volume_km3 * grid.azimuth_divisions();
    }
    const double outer = grid.outer_radius_km();
    // Archimedes: the cap within a chord c has the area pi (c^2 - h^2) R/(R + h).
    EXPECT_NEAR(area / (kPi * (outer * outer - h0 * h0) * R / (R + h0)), 1.0, 1e-9);
  }
}

TEST_P(CellLayout, SamplesShareTheVolume) {
  const Medium m = air(GetParam().top_km, 24);
  const CellGrid grid(m, options());
  for (std::size_t i = 0; i < grid.air_rings(); i += 7) {
    const CellRing& ring = grid.rings()[i];
    double sum = 0;
    for (const CellSample& p : grid.samples(ring, m)) {
      EXPECT_GE(p.altitude_km, 0);
      EXPECT_LE(p.altitude_km, m.top_km());
      EXPECT_EQ(p.layer, layer_at(m, p.altitude_km));
      sum += p.volume_km3;
    }
    EXPECT_NEAR(sum, ring.volume_km3, 1e-9 * ring.volume_km3);
  }
}

INSTANTIATE_TEST_SUITE_P(Layouts, CellLayout,
                         testing::Values(Layout{36, 1, 1, 0, 4, 60}, Layout{36, 4, 1, 0, 4, 60},
                                         Layout{72, 4, 1, 0, 4, 100}, Layout{120, 4, 1, 0, 4, 100},
                                         Layout{120, 8, 0.1, 0, 4, 35},
                                         Layout{72, 1, 0.1, 0, 0, 35}, Layout{180, 1, 1, 0, 0, 35},
                                         Layout{24, 32, 2, 0, 4, 60}, Layout{72, 4, 1, 3, 4, 100},
                                         Layout{72, 4, 1, 10, 4, 100},
                                         Layout{36, 3, 2, 0.02, 2, 60}),
                         [](const auto& info) {
                           const Layout& p = info.param;
                           return "S" + std::to_string(p.divisions) + "Stride" +
                                  std::to_string(p.stride) + "Height" +
                                  std::to_string(static_cast<int>(p.height_km * 1000)) + "Bands" +
                                  std::to_string(static_cast<int>(p.cell_height_km)) + "Top" +
                                  std::to_string(static_cast<int>(p.top_km));
                         });

// Shells follow one another without gaps where groups are spanned; the active ones alone otherwise.
TEST(CellGrid, GroupedShellsFollowWithoutGaps) {
  const Medium m = air(60, 10);
  CellGridOptions o;
  o.azimuth_divisions = 72;
  o.active_shell_stride = 4;
  const CellGrid grouped(m, o);
  for (std::size_t i = 1; i < grouped.shells().size(); ++i) {
    EXPECT_DOUBLE_EQ(grouped.shells()[i].r_min_km, grouped.shells()[i - 1].r_max_km);
  }
  o.group_shells = false;
  const CellGrid active(m, o);
  EXPECT_EQ(active.shells().size(), grouped.shells().size());
  EXPECT_EQ(active.all_shells(), grouped.all_shells());
  const double q = (1 + kPi / 72) / (1 - kPi / 72);
  for (const CellShell& shell : active.shells()) {
    EXPECT_NEAR(shell.r_max_km / shell.r_min_km, q, 1e-9);
  }
}

// The paper's rule: each cell as long radially as high, r_max - r_min = d r.
TEST(CellGrid, CellsAreAsLongAsHigh) {
  const Medium m = air(35, 10);
  CellGridOptions o;
  o.azimuth_divisions = 72;
  o.cell_height_km = 0;
  o.group_shells = false;
  const CellGrid grid(m, o);
  for (const CellShell& shell : grid.shells()) {
    EXPECT_NEAR((shell.r_max_km - shell.r_min_km) / shell.r_km, 2 * kPi / 72, 1e-9);
  }
}

TEST(CellGrid, OddOrTooFewDivisionsThrow) {
  const Medium m = air(35, 2);
  for (const int divisions : {2, 0, 71, -4}) {
    CellGridOptions o;
    o.azimuth_divisions = divisions;
    EXPECT_THROW(CellGrid(m, o), std::invalid_argument) << divisions;
  }
}

TEST(LayerAt, CountsLowerBoundariesIn) {
  const Medium m = air(10, 10);
  EXPECT_EQ(layer_at(m, 0), 0);
  EXPECT_EQ(layer_at(m, 1), 1);
  EXPECT_EQ(layer_at(m, 1.5), 1);
  EXPECT_EQ(layer_at(m, 10), 9);
  EXPECT_EQ(layer_at(m, 99), 9);
  EXPECT_EQ(layer_at(m, -1), 0);
}

}  // namespace
}  // namespace twilight
