// The default method against an independent Monte Carlo, in a medium both know exactly.
#include "tests/golden/open_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "sim/cell_sky.h"

namespace twilight {
namespace {

constexpr double kRad = std::numbers::pi / 180;

// The medium of the table: exponential air in 200 layers of 0.5 km.
SceneModel open_case_model(double sun_elevation_deg) {
  SceneModel model;
  Medium& m = model.medium;
  constexpr int kLayers = 200;
  constexpr double kStep_km = 0.5, kScale_km = 8, kGround_per_km = 0.0116;
  m.earth_radius_km = 6371;
  m.wavelength_nm = {550};
  for (int i = 0; i <= kLayers; ++i) m.boundary_km.push_back(kStep_km * i);
  for (LayerTable* t :
       {&m.air_scattering_per_km, &m.aerosol_scattering_per_km, &m.aerosol_absorption_per_km,
        &m.aerosol_asymmetry, &m.gas_absorption_per_km, &m.refractivity}) {
    *t = LayerTable(kLayers, 1);
  }
  for (int i = 0; i < kLayers; ++i) {
    const double a = kStep_km * i, b = a + kStep_km;
    m.air_scattering_per_km(static_cast<std::size_t>(i), 0) =
        kGround_per_km * kScale_km / kStep_km *
        (std::exp(-a / kScale_km) - std::exp(-b / kScale_km));
  }
  m.depolarisation = {0};
  model.solar_irradiance = {1};
  model.sun_elevation_rad = sun_elevation_deg * kRad;
  model.scene.earth.ground_albedo = 0;
  model.scene.atmosphere.refraction = false;
  model.scene.aerosols.type = "none";
  return model;
}

double value_at(const CellSky& sky, const OpenCase& c, bool single_only) {
  const ViewDirection view{c.view_elevation_deg * kRad, c.relative_azimuth_deg * kRad};
  return single_only ? sky.single_scattering({&view, 1})[0] : sky.radiance({&view, 1})[0];
}

// Relative error of every row, from one solve per Sun elevation.
std::vector<double> relative_errors(int scattering_orders) {
  std::vector<double> errors;
  std::unique_ptr<CellSky> sky;
  double sun = std::nan("");
  const bool single_only = scattering_orders == 1;
  for (const OpenCase& c : kOpenCases) {
    if (c.sun_elevation_deg != sun) {
      sun = c.sun_elevation_deg;
      SceneModel model = open_case_model(sun);
      model.scene.solver.scattering_orders = scattering_orders;
      sky = std::make_unique<CellSky>(model, RunControl{});
    }
    const double expected = single_only ? c.single : c.radiance;
    const double value = value_at(*sky, c, single_only);
    // A view into the Earth's shadow scatters nothing once.
    errors.push_back(expected > 0 ? value / expected - 1 : value);
  }
  return errors;
}

double median_of_sizes(std::vector<double> errors) {
  for (double& e : errors) e = std::abs(e);
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

std::string name_of(const OpenCase& c) {
  std::ostringstream text;
  text << "Sun " << c.sun_elevation_deg << " deg, view " << c.view_elevation_deg
       << " deg up, azimuth " << c.relative_azimuth_deg << " deg";
  return text.str();
}

// The project's bar is 10 % for every row and 3 % in the median; the tighter one is what the cells'
// convergence allows: median and worst 0.29 and 2.4 % with S = 60, 0.18 and 1.6 % with S = 60 and
// stride 2, 0.17 and 1.2 % by default, 0.09 and 1.1 % with stride 2, 0.3 % of it the Monte Carlo's.
TEST(OpenCases, DefaultMethodAgreesWithMonteCarlo) {
  constexpr double kProjectWorst = 0.10, kProjectMedian = 0.03;
  constexpr double kWorst = 0.025, kWorstWithSingle = 0.015, kMedian = 0.004;
  static_assert(kWorst < kProjectWorst && kMedian < kProjectMedian);
  const std::vector<double> errors = relative_errors(ExchangeOptions{}.scattering_orders);
  for (std::size_t i = 0; i < kOpenCases.size(); ++i) {
    const OpenCase& c = kOpenCases[i];
    EXPECT_NEAR(errors[i], 0, c.single > 0 ? kWorstWithSingle : kWorst) << name_of(c);
  }
  EXPECT_LE(median_of_sizes(errors), kMedian);
}

// Against 200000 steps with analytic paths to the Sun the march errs by 0.15 % at most, so the rest
// is the noise of the Monte Carlo's first order: up to 0.9 %, where its total has a standard error
// of 0.4 %.
TEST(OpenCases, SingleScatteringAgreesWithMonteCarlo) {
  const std::vector<double> errors = relative_errors(1);
  for (std::size_t i = 0; i < kOpenCases.size(); ++i) {
    EXPECT_NEAR(errors[i], 0, 0.01) << name_of(kOpenCases[i]);
  }
  EXPECT_LE(median_of_sizes(errors), 0.002);
}

// Haber et al. (2005), Sec. 6: "four scattering events ... less than 1% maximum error" and
// multiple over single scattering "up to about 20%". Zenith figures of the same Monte Carlo: what
// the orders after the fourth bring, and what all after the first do.
TEST(HaberClaims, OrdersAfterTheFourthAndMultipleOverSingle) {
  struct Claim {
    double sun_elevation_deg, after_fourth, multiple_over_single;
  };
  constexpr Claim kMonteCarlo[] = {
      {30, 0.00053, 0.164}, {0, 0.00065, 0.2065}, {-3, 0.00077, 0.2074},
      {-6, 0.0022, 0.5216}, {-9, 0.0063, 22.08},
  };
  const ViewDirection zenith{std::numbers::pi / 2, 0.0};
  std::printf("Sun deg  after the fourth  multiple/single\n");
  for (const Claim& claim : kMonteCarlo) {
    SceneModel model = open_case_model(claim.sun_elevation_deg);
    model.scene.solver.scattering_orders = 12;
    const CellSky all(model, RunControl{});
    model.scene.solver.scattering_orders = 4;
    const CellSky four(model, RunControl{});
    const double total = all.radiance({&zenith, 1})[0];
    const double after_fourth = 1 - four.radiance({&zenith, 1})[0] / total;
    const double ratio = total / all.single_scattering({&zenith, 1})[0] - 1;
    std::printf("%7.0f  %15.3f %%  %15.3f\n", claim.sun_elevation_deg, 100 * after_fourth, ratio);
    // The first claim holds in clear air down to -9 degrees, the second ends after -3.
    EXPECT_LT(after_fourth, 0.01) << claim.sun_elevation_deg;
    EXPECT_NEAR(after_fourth, claim.after_fourth, 0.001) << claim.sun_elevation_deg;
    EXPECT_EQ(ratio < 0.22, claim.sun_elevation_deg >= -3) << claim.sun_elevation_deg;
    EXPECT_NEAR(ratio / claim.multiple_over_single, 1, 0.05) << claim.sun_elevation_deg;
  }
}

}  // namespace
}  // namespace twilight
