// The default method against an independent Monte Carlo, in a medium both know exactly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <vector>

#include "sim/cell_sky.h"
#include "tests/golden/open_cases.h"

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
  for (LayerTable* t : {&m.air_scattering_per_km, &m.aerosol_scattering_per_km,
                        &m.aerosol_absorption_per_km, &m.aerosol_asymmetry,
                        &m.gas_absorption_per_km, &m.refractivity}) {
    *t = LayerTable(kLayers, 1);
  }
  for (int i = 0; i < kLayers; ++i) {
    const double a = kStep_km * i, b = a + kStep_km;
    m.air_scattering_per_km(static_cast<std::size_t>(i), 0) =
        kGround_per_km * kScale_km / kStep_km * (std::exp(-a / kScale_km) - std::exp(-b / kScale_km));
  }
  m.depolarisation = {0};
  model.solar_irradiance = {1};
  model.sun_elevation_rad = sun_elevation_deg * kRad;
  model.scene.earth.ground_albedo = 0;
  model.scene.atmosphere.refraction = false;
  model.scene.aerosols.type = "none";
  return model;
}

struct Comparison {
  OpenCase reference;
  double radiance;
  double single;
  double error() const { return radiance / reference.radiance - 1; }
};

// Every row, from one solve per Sun elevation; computed once.
const std::vector<Comparison>& comparisons() {
  static const std::vector<Comparison> rows = [] {
    std::vector<Comparison> result;
    std::unique_ptr<CellSky> sky;
    double sun = std::nan("");
    for (const OpenCase& c : kOpenCases) {
      if (c.sun_elevation_deg != sun) {
        sun = c.sun_elevation_deg;
        sky = std::make_unique<CellSky>(open_case_model(sun), RunControl{});
      }
      const ViewDirection view{c.view_elevation_deg * kRad, c.relative_azimuth_deg * kRad};
      result.push_back({c, sky->radiance({&view, 1})[0], sky->single_scattering({&view, 1})[0]});
    }
    return result;
  }();
  return rows;
}

double median_error() {
  std::vector<double> errors;
  for (const Comparison& row : comparisons()) errors.push_back(std::abs(row.error()));
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2),
                   errors.end());
  return errors[errors.size() / 2];
}

std::string name_of(const OpenCase& c) {
  return "Sun " + std::to_string(c.sun_elevation_deg) + ", view " +
         std::to_string(c.view_elevation_deg) + " up, azimuth " +
         std::to_string(c.relative_azimuth_deg);
}

TEST(OpenCases, DefaultMethodIsWithinTenPercentEverywhere) {
  for (const Comparison& row : comparisons()) {
    EXPECT_NEAR(row.error(), 0, 0.10) << name_of(row.reference);
  }
}

TEST(OpenCases, DefaultMethodIsWithinThreePercentInTheMedian) { EXPECT_LE(median_error(), 0.03); }

