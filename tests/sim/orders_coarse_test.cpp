#include "sim/orders_coarse.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/sim/orders_model.h"

namespace twilight {
namespace {

struct Grids {
  OrdersMedium medium = make_orders_medium(exponential_air(0.2), std::vector<double>{0.0}, {});
  std::vector<std::size_t> kept = coarse_levels(orders_levels(60, 12), medium.optics);
  OrdersGrid<double> fine{medium, 3.0, orders_levels(60, 12), 12, 8, 0, true, 4};
  OrdersGrid<double> coarse = coarse_grid(fine, {kept, 8, 4, 0}, medium, 3.0);
};

// Light that falls off as `like` does, times the exponential of a cubic in the level's number.
IncomingLight<double> light_on(const OrdersGrid<double>& grid, bool cubic) {
  IncomingLight<double> light(grid);
  for (std::size_t i = 0; i < grid.level_km.size(); ++i) {
    for (std::size_t j = 0; j < grid.nodes; ++j) {
      for (std::size_t w = 0; w < grid.lanes; ++w) {
        const double x = static_cast<double>(i);
        const double steep = std::exp(-2 * x - static_cast<double>(j));
        const double value =
            steep * (cubic ? std::exp(0.2 * x + 0.003 * x * x + 0.001 * x * x * x) : 1);
        double* C = &light.coherency[(i * grid.zenith.size() + j) * 4 * grid.lanes + w];
        C[0] = value;
        C[grid.lanes] = 2 * value;
        C[2 * grid.lanes] = 3 * value;
        C[3 * grid.lanes] = -0.5 * value;
      }
    }
  }
  return light;
}

TEST(CoarseOrders, KeepGroundTopEdgesAndThickAir) {
  const auto thin = make_orders_medium(exponential_air(0.2), std::vector<double>{0.0}, {});
  const auto thick = make_orders_medium(exponential_air(50), std::vector<double>{0.0}, {});
  for (const int count : {4, 5, 12, 51}) {
    const std::vector<std::size_t> kept = coarse_levels(orders_levels(60, count), thin.optics);
    EXPECT_EQ(kept.front(), 0U);
    EXPECT_EQ(kept.back() + 1, static_cast<std::size_t>(count));
    EXPECT_LE(kept.size(), static_cast<std::size_t>(count) / 2 + 1);
  }
  EXPECT_THAT(coarse_levels({0, 1, 2, 3, 3.01, 4, 5, 6}, thin.optics),
              testing::ElementsAre(0, 2, 3, 4, 6, 7));
  EXPECT_THAT(coarse_levels({0, 1, 2, 3, 4, 50, 55, 60}, thick.optics),
              testing::ElementsAre(0, 1, 2, 3, 4, 5, 6, 7));
}

// Levels crowd at the top of a haze, none at the steps of a smooth profile.
TEST(OrdersLevels, StandAtTheEdgesOfLayers) {
  Medium medium = exponential_air(0.3);
  const auto none = make_orders_medium(medium, std::vector<double>{0.0}, {});
  EXPECT_EQ(orders_levels(none, 40), orders_levels(60, 40));
  const std::size_t top = 3;  // layers of haze, 0.2 per km
  for (std::size_t i = 0; i < top; ++i) medium.gas_absorption_per_km(i, 0) = 0.2;
  const auto haze = make_orders_medium(medium, std::vector<double>{0.0}, {});
  const double edge_km = medium.boundary_km[top];
  const std::vector<double> levels = orders_levels(haze, 40);
  EXPECT_GT(levels.size(), 42U);
  EXPECT_LT(levels.size(), 48U);
  EXPECT_TRUE(std::ranges::is_sorted(levels));
  const auto at = std::ranges::find(levels, edge_km);
  ASSERT_NE(at, levels.end());
  const double inside_km = edge_km - *(at - 1);
  EXPECT_GT(0.3 * std::sqrt(2 * 6371 * inside_km), 2 * 0.9);
  EXPECT_LT(inside_km, 0.05);
}

// What is, in the logarithm, cubic relative to light that is known everywhere comes back as it was.
TEST(CoarseOrders, RestrictedLightComesBack) {
  const Grids g;
  const IncomingLight<double> like = light_on(g.fine, false), wanted = light_on(g.fine, true);
  const IncomingLight<double> light = restrict_light(g.fine, g.coarse, g.kept, wanted);
  IncomingLight<double> total(g.fine);
  add_prolonged(g.coarse, g.fine, g.kept, light, like, total);
  for (std::size_t i = 0; i < wanted.coherency.size(); ++i) {
    EXPECT_NEAR(total.coherency[i], wanted.coherency[i], 1e-12 * std::abs(wanted.coherency[i]));
  }
}

// Light scattered often reaches where light scattered once does not: it comes back there too.
TEST(CoarseOrders, LightComesBackInTheDark) {
  const Grids g;
  const IncomingLight<double> wanted = light_on(g.fine, false), dark(g.fine);
  IncomingLight<double> total(g.fine);
  add_prolonged(g.coarse, g.fine, g.kept, restrict_light(g.fine, g.coarse, g.kept, wanted), dark,
                total);
  for (std::size_t i = 0; i < wanted.coherency.size(); ++i) {
    EXPECT_NEAR(total.coherency[i], wanted.coherency[i], 1e-12 * std::abs(wanted.coherency[i]));
  }
}

// The coarse grid for light scattered often moves the sky by less than the solver's own error.
TEST(CoarseOrders, AgreeWithOneGrid) {
  SceneModel model = orders_model(exponential_air(0.3), 0, 0.5);
  model.scene.solver.altitude_levels = 40;
  const OrdersSky coarse(model, RunControl{});
  model.scene.solver.coarse_orders = false;
  const OrdersSky one(model, RunControl{});
  std::vector<ViewDirection> views;
  for (const double elevation : {5.0, 30.0, 90.0}) {
    for (const double azimuth : {0.0, 90.0, 180.0}) views.push_back(view_deg(elevation, azimuth));
  }
  for (const double sun_deg : {30.0, 0.0, -6.0, -10.0}) {
    const double sun_rad = sun_deg * std::numbers::pi / 180;
    const auto got = coarse.under(sun_rad)->radiance(views);
    const auto wanted = one.under(sun_rad)->radiance(views);
    for (std::size_t i = 0; i < views.size(); ++i) {
      EXPECT_NEAR(got[i], wanted[i], 2e-3 * wanted[i]) << "Sun " << sun_deg << ", view " << i;
    }
  }
}

}  // namespace
}  // namespace twilight
