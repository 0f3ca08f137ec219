// Sunlight into the atmosphere is sunlight out of it, for the "orders" solver.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <numbers>
#include <vector>

#include "atmosphere/straight_path.h"
#include "sim/gauss_legendre.h"
#include "sim/orders.h"
#include "sim/orders_gather.h"
#include "sim/zenith_grid.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kDegree = pi / 180;
constexpr double kTop_km = 60;
constexpr std::size_t kLayers = 30;

// What enters and what becomes of it, in units of the sunlight on a disc of 1 km^2.
struct Balance {
  double in = 0, space = 0, ground = 0, air = 0;
  double error() const { return (space + ground + air) / in - 1; }
};

// Four atmospheres side by side, one a wavelength: white ground under conservative air; black
// ground under denser air; grey ground, absorbing gas; and haze (its forward peak truncated).
Medium four_airs() {
  Medium m;
  for (std::size_t i = 0; i <= kLayers; ++i) {
    m.boundary_km.push_back(kTop_km * static_cast<double>(i) / kLayers);
  }
  m.wavelength_nm = {400, 500, 600, 700};
  m.zero_tables();
  m.depolarisation = {0, 0.03, 0.03, 0};
  const double depth[4] = {0.25, 1, 0.25, 0.1};
  for (std::size_t i = 0; i < kLayers; ++i) {
    const double a = m.boundary_km[i], b = m.boundary_km[i + 1];
    for (std::size_t w = 0; w < 4; ++w) {
      m.air_scattering_per_km(i, w) = depth[w] / (b - a) * (std::exp(-a / 8) - std::exp(-b / 8));
    }
    m.gas_absorption_per_km(i, 2) = a >= 16 && b <= 32 ? 0.2 / 16 : 0.001;
    if (b <= 4) m.aerosol_scattering_per_km(i, 3) = 0.1;
    m.aerosol_asymmetry(i, 3) = 0.6;
  }
  return m;
}

const std::vector<double> kAlbedo = {1, 0, 0.3, 0.5};

// The integral over 0..pi of value(chi) sin(chi), steep about the terminator.
double over_suns(const std::function<double(double)>& value, int nodes) {
  double sum = 0;
  const double edge[4] = {0, 78, 90, 112};
  for (int k = 0; k < 3; ++k) {
    for (const GaussNode& g : gauss_legendre(nodes, edge[k] * kDegree, edge[k + 1] * kDegree)) {
      sum += g.weight * std::sin(g.x) * value(g.x);
    }
  }
  return sum;
}

class OrdersEnergy : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    medium_ = new Medium(four_airs());
    options_ = new OrdersOptions;
    options_->zenith_step_deg = 2;
    options_->altitude_levels = 40;
    options_->polar_directions = 32;
    options_->azimuth_directions = 6;
    options_->phase_degree = 6;
    options_->order_tolerance = 1e-5;
    options_->disc_average = false;
    optics_ = new OrdersMedium(make_orders_medium(*medium_, kAlbedo, *options_));
    DirectSunlightOptions exact;
    exact.exact = true;
    exact.altitude_nodes = 96;
    exact.angle_nodes = 128;
    sunlight_ = new DirectSunlight(optics_->truncated, exact);
    field_ = new OrdersField(solve_orders(*optics_, *sunlight_, *options_, {}));
    std::printf("%d orders\n", field_->orders);
    for (std::size_t w = 0; w < 4; ++w) balance_[w].in = intercepted(w);
    find_space();
    find_ground();
    find_air();
    for (std::size_t w = 0; w < 4; ++w) {
      const Balance& b = balance_[w];
      std::printf("%g nm: in %.0f, to space %.5f, ground %.5f, gas %.5f, error %+.5f\n",
                  medium_->wavelength_nm[w], b.in, b.space / b.in, b.ground / b.in, b.air / b.in,
                  b.error());
    }
  }
  static void TearDownTestSuite() {
    delete field_;
    delete sunlight_;
    delete optics_;
    delete options_;
    delete medium_;
  }

  static double depth(double altitude_km, double zenith_rad, std::size_t w, bool* clear = nullptr) {
    std::vector<double> length(kLayers);
    const bool free = straight_path(optics_->truncated, altitude_km, zenith_rad, HUGE_VAL, length);
    if (clear != nullptr) *clear = free;
    double sum = 0;
    for (std::size_t i = 0; i < kLayers; ++i) {
      sum += length[i] * optics_->truncated.extinction_per_km(i, w);
    }
    return sum;
  }
  static double direct(double altitude_km, double chi, std::size_t w) {
    bool clear = false;
    const double x = depth(altitude_km, chi, w, &clear);
    return clear ? std::exp(-x) : 0;
  }

  // pi [R^2 + integral of 2 b (1 - exp(-depth(b))) db]
  static double intercepted(std::size_t w) {
    const double R = medium_->earth_radius_km;
    double sum = R * R;
    constexpr int kSteps = 3000;
    for (int k = 0; k < kSteps; ++k) {
      const double b = R + kTop_km * (k + 0.5) / kSteps;
      const double zenith = pi - std::asin(b / (R + kTop_km));
      sum += 2 * b * -std::expm1(-depth(kTop_km, zenith, w)) * kTop_km / kSteps;
    }
    return pi * sum;
  }

  // Light that leaves through the top, by an observer there who looks down under every Sun.
  static void find_space() {
    const double R = medium_->earth_radius_km, top = R + kTop_km;
    SceneModel model;
    model.medium = *medium_;
    model.ground_albedo = kAlbedo;
    Scene& scene = model.scene;
    scene.atmosphere.refractive_spreading = false;
    scene.sun.disc_average = options_->disc_average;
    scene.solver.method = "orders";
    scene.solver.zenith_step_deg = options_->zenith_step_deg;
    scene.solver.altitude_levels = options_->altitude_levels;
    scene.solver.phase_degree = options_->phase_degree;
    RunSummary summary;
    const OrdersAtmosphere atmosphere(model, std::make_shared<OrdersField>(*field_), {}, summary);
    const double dip = std::acos(R / top), edge = std::sin(dip);
    struct View {
      double elevation, weight;
    };
    std::vector<View> views;  // sine of the depression: to the ground, then the limb
    for (const GaussNode& g : gauss_legendre(8, 0, 1)) {
      const double sine = edge + (1 - edge) * g.x * g.x;
      views.push_back({-std::asin(sine), 2 * g.x * (1 - edge) * g.weight * sine});
    }
    for (const GaussNode& g : gauss_legendre(10, 0, dip)) {
      views.push_back({-g.x, std::cos(g.x) * g.weight * std::sin(g.x)});
    }
    constexpr int kAzimuths = 6;
    double flux[4] = {};
    const double edges[5] = {0, 75, 88, 98, 108};
    const int nodes[4] = {6, 5, 5, 3};
    for (int k = 0; k < 4; ++k) {
      for (const GaussNode& g :
           gauss_legendre(nodes[k], edges[k] * kDegree, edges[k + 1] * kDegree)) {
        const OrdersGather gather(atmosphere, g.x, kTop_km);
        for (const View& view : views) {
          for (int a = 0; a < kAzimuths; ++a) {
            const auto light = gather.view(view.elevation, (a + 0.5) * pi / kAzimuths,
                                           OrdersGather::Light::kTruncated);
            for (std::size_t w = 0; w < 4; ++w) {
              flux[w] += g.weight * std::sin(g.x) * view.weight * 2 * pi / kAzimuths * light.i[w];
            }
          }
        }
      }
    }
    for (std::size_t w = 0; w < 4; ++w) balance_[w].space = 2 * pi * top * top * flux[w];
  }

  // A row of the field's nodes at any zenith angle.
  static double at(const std::function<double(std::size_t)>& node, double chi) {
    static const ZenithGrid grid(options_->zenith_step_deg);
    const auto s = ZenithGrid::stencil(grid.position(chi), grid.size());
    double sum = 0;
    for (std::size_t q = 0; q < 4; ++q) sum += s.weight[q] * node(s.first + q);
    return sum;
  }

  static void find_ground() {
    const double R = medium_->earth_radius_km;
    for (std::size_t w = 0; w < 4; ++w) {
      const double flux = over_suns(
          [&](double chi) {
            const double diffuse =
                at([&](std::size_t j) { return field_->ground_irradiance[j * 4 + w]; }, chi);
            return diffuse + direct(0, chi, w) * std::max(0.0, std::cos(chi));
          },
          24);
      balance_[w].ground = (1 - kAlbedo[w]) * 2 * pi * R * R * flux;
    }
  }

  // The absorption coefficient times 4 pi times the mean radiance: the trace, and the beam.
  static void find_air() {
    const double R = medium_->earth_radius_km;
    const std::size_t nodes = field_->solar_zenith_rad.size();
    for (std::size_t w = 0; w < 4; ++w) {
      std::vector<double> diffuse;  // of every level, integrated over the Suns
      for (std::size_t i = 0; i < field_->altitude_km.size(); ++i) {
        diffuse.push_back(over_suns(
            [&](double chi) {
              return at(
                  [&](std::size_t j) {
                    const float* C = &field_->coherency[(i * nodes + j) * 16 + w];
                    return static_cast<double>(C[0] + C[4] + C[8]);
                  },
                  chi);
            },
            24));
      }
      for (std::size_t i = 0; i < kLayers; ++i) {
        const double k = medium_->gas_absorption_per_km(i, w);
        if (k == 0) continue;
        for (const GaussNode& g :
             gauss_legendre(3, medium_->boundary_km[i], medium_->boundary_km[i + 1])) {
          const auto up = std::ranges::upper_bound(field_->altitude_km, g.x);
          const auto hi = static_cast<std::size_t>(up - field_->altitude_km.begin());
          const double f = (g.x - field_->altitude_km[hi - 1]) /
                           (field_->altitude_km[hi] - field_->altitude_km[hi - 1]);
          const double light = std::lerp(diffuse[hi - 1], diffuse[hi], f) +
                               over_suns([&](double chi) { return direct(g.x, chi, w); }, 24);
          balance_[w].air += g.weight * k * 2 * pi * (R + g.x) * (R + g.x) * light;
        }
      }
    }
  }

  static Medium* medium_;
  static OrdersOptions* options_;
  static OrdersMedium* optics_;
  static DirectSunlight* sunlight_;
  static OrdersField* field_;
  static Balance balance_[4];
};
Medium* OrdersEnergy::medium_;
OrdersOptions* OrdersEnergy::options_;
OrdersMedium* OrdersEnergy::optics_;
DirectSunlight* OrdersEnergy::sunlight_;
OrdersField* OrdersEnergy::field_;
Balance OrdersEnergy::balance_[4];

TEST_F(OrdersEnergy, WhiteGroundUnderConservativeAirReturnsAll) {
  EXPECT_EQ(balance_[0].ground, 0);
  EXPECT_EQ(balance_[0].air, 0);
  EXPECT_NEAR(balance_[0].error(), 0, 1e-3);
}

TEST_F(OrdersEnergy, BlackGroundTakesTheRest) { EXPECT_NEAR(balance_[1].error(), 0, 1e-3); }

TEST_F(OrdersEnergy, GasAndGreyGroundTakeTheRest) {
  EXPECT_GT(balance_[2].air / balance_[2].in, 0.1);
  EXPECT_NEAR(balance_[2].error(), 0, 1e-3);
}

TEST_F(OrdersEnergy, HazeWithoutItsPeakBalances) { EXPECT_NEAR(balance_[3].error(), 0, 1e-3); }

}  // namespace
}  // namespace twilight
