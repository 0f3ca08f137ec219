// The default method against an independent Monte Carlo, in a medium both know exactly.
#include "tests/golden/open_cases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
// convergence allows. Worst row with S = 60, 90, 120 and 180 (stride 4): 5.2, 4.0, 3.6 and 3.2 %;
// with stride 2: 3.4 %. It is always the row without any single scattering (Sun -6 deg, view 10 deg
// up and away from the Sun); rows with some err by 1.2 % at most, 0.16 % in the median.
TEST(OpenCases, DefaultMethodAgreesWithMonteCarlo) {
  constexpr double kProjectWorst = 0.10, kProjectMedian = 0.03;
  constexpr double kWorst = 0.05, kWorstWithSingle = 0.015, kMedian = 0.004;
  static_assert(kWorst < kProjectWorst && kMedian < kProjectMedian);
  const std::vector<double> errors = relative_errors(SolverOptions{}.scattering_orders);
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

}  // namespace
}  // namespace twilight
