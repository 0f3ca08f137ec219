// Scenes that once broke a law, made as plain as they get. The laws: README.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

#include "sim/scene_model.h"
#include "sky_laws.h"

namespace twilight {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

void expect_lawful(const Scene& scene) {
  for (const BrokenLaw& b : judge(scene, Depth::kThorough).broken) {
    ADD_FAILURE() << name(b.law) << ": " << b.what;
  }
}

Scene coarse_cells(int divisions) {
  Scene s;
  s.sun.elevation_deg = 10;
  s.sun.spectrum = "unit";
  s.atmosphere.profile = "exponential";
  s.atmosphere.refraction = false;
  s.aerosols.type = "none";
  s.spectrum.wavelengths_nm = {550};
  s.solver.azimuth_divisions = divisions;
  s.solver.cell_height_km = 0;
  s.solver.scattering_orders = 5;
  s.solver.threads = 1;
  return s;
}

// The centres of every cell of the active shells stand below ground or above the air: passive
// shells had nothing to be interpolated from and read beyond an empty field (a crash).
TEST(Regression, ActiveShellsWithoutACell) {
  Scene s = coarse_cells(8);
  s.atmosphere.top_km = 7.039;
  s.atmosphere.layers = 5;
  s.solver.active_shell_stride = 6;
  s.solver.active_shell_weighting = "rescale";
  s.solver.inner_radius_m = 3169;
  s.solver.cell_optics = "centre";
  expect_lawful(s);
  // Without a cell there is single scattering alone.
  Scene single = s;
  single.solver.scattering_orders = 1;
  const ViewDirection zenith{90 * kDeg, 0};
  EXPECT_EQ(solve_sky(build_scene_model(s))->radiance({&zenith, 1}),
            solve_sky(build_scene_model(single))->radiance({&zenith, 1}));
}

// Means of cells that the ground cuts through stand closer than half a step of elevation; the
// paper's rescaling took the light of a passive cell from the lowest of them, be it dark, and so
// from less power than the active cells have: the sky came out up to 10^11 times too dark, or not,
// as the Sun moved by 0.01 degrees. Where every shell is active there is nothing to rescale.
TEST(Regression, RescalingFindsItsCells) {
  for (const int divisions : {6, 8, 12, 24}) {
    Scene s = coarse_cells(divisions);
    s.sun.elevation_deg = -2;
    s.observer.height_m = 7827;
    s.atmosphere.top_km = 55;
    s.atmosphere.layers = 8;
    s.solver.inner_radius_m = 1879;
    s.solver.active_shell_stride = 1;
    const std::vector<ViewDirection> views = law_views();
    s.solver.active_shell_weighting = "quadrature";
    const auto plain = solve_sky(build_scene_model(s))->radiance(views);
    s.solver.active_shell_weighting = "rescale";
    const auto rescaled = solve_sky(build_scene_model(s))->radiance(views);
    for (std::size_t k = 0; k < views.size(); ++k) {
      EXPECT_NEAR(rescaled[k], plain[k], 1e-5 * plain[k]) << divisions << ' ' << k;
    }
  }
}

// Ten polar directions left two for the upper half of the sky, which integrate moments of degree 6
// to anything: each order of light in white haze over white ground was 1.2 % brighter than the one
// before, up to order 500. Light that leaves to space makes every order fainter.
TEST(Regression, WhiteHazeOverWhiteGroundFades) {
  for (const int directions : {8, 10, 12}) {
    Scene s = coarse_cells(8);
    s.sun.elevation_deg = 50;
    s.sun.disc_average = false;
    s.earth.ground_albedo = 1;
    s.atmosphere.top_km = 32;
    s.atmosphere.layers = 4;
    s.atmosphere.layer_spacing = "even";
    s.atmosphere.ozone_du = 0;
    s.aerosols.type = "antarctic";
    s.aerosols.optical_depth_550nm = 4.3;
    s.aerosols.phase = "henyey-greenstein";
    s.solver.method = "orders";
    s.solver.polarisation = false;
    s.solver.zenith_step_deg = 3;
    s.solver.altitude_levels = 5;
    s.solver.polar_directions = directions;
    s.solver.azimuth_directions = 6;
    s.solver.phase_degree = 6;
    const SceneModel model = build_scene_model(s);
    double flux[3];
    for (int more = 0; more < 3; ++more) {
      SceneModel m = model;
      m.scene.solver.scattering_orders = 30 + more;
      const auto field = solve_field(m).field;
      double sum = 0;
      for (std::size_t j = 0; j < field->ground_irradiance.size(); ++j) {
        sum += field->ground_irradiance[j] * std::sin(field->solar_zenith_rad[j]);
      }
      flux[more] = sum;
    }
    const double growth = (flux[2] - flux[1]) / (flux[1] - flux[0]);
    EXPECT_LT(growth, 0.99) << directions;
    EXPECT_GT(growth, 0.9) << directions;
  }
}

// The ground lies 430 m below sea level all around and the air goes on down to it: 5 % more air.
TEST(Regression, ObserverBelowSeaLevel) {
  for (const std::string method : {"cells", "orders", "monte-carlo"}) {
    Scene s = coarse_cells(8);
    s.solver.method = method;
    s.solver.altitude_levels = 8;
    s.solver.polar_directions = 8;
    s.solver.azimuth_directions = 4;
    s.solver.zenith_step_deg = 3;
    s.solver.photons = 1000;
    s.solver.target_relative_error = 1;
    s.observer.height_m = -430;
    expect_lawful(s);
  }
}

}  // namespace
}  // namespace twilight
