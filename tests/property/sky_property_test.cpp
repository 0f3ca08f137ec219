// What holds for every sky that a scene file can ask for.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <numbers>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "random_scene.h"
#include "sim/scene_model.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<ViewDirection> views() {
  std::vector<ViewDirection> v;
  for (const double elevation_deg : {90.0, 75.0, 45.0, 20.0, 5.0, 0.5, 0.0, -0.5, -20.0, -90.0}) {
    for (const double azimuth_deg : {0.0, 17.0, 90.0, 171.3, 180.0}) {
      v.push_back({elevation_deg * kPi / 180, azimuth_deg * kPi / 180});
    }
  }
  return v;
}

// The first law that the scene's sky breaks, or nothing.
std::string broken_law(const Scene& scene) {
  const SceneModel model = build_scene_model(scene);
  const auto sky = solve_sky(model);
  const auto right = views();
  auto left = right;
  for (auto& v : left) v.relative_azimuth_rad = -v.relative_azimuth_rad;
  auto round = right;
  for (auto& v : round) v.relative_azimuth_rad = 2 * kPi - v.relative_azimuth_rad;
  const auto a = sky->radiance(right), b = sky->radiance(left), c = sky->radiance(round);
  const std::size_t wavelengths = scene.spectrum.wavelengths_nm.size();
  if (a.size() != right.size() * wavelengths) return "size of the radiance";
  // The exchange keeps account of energy for cell means; the paper's cell centres and its
  // rescaling do not.
  const bool conservative =
      scene.solver.active_shell_weighting == "quadrature" && scene.solver.cell_optics == "mean";
  std::ostringstream what;
  const double brightest = *std::max_element(a.begin(), a.end());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const ViewDirection& v = right[i / wavelengths];
    if (!(std::isfinite(a[i]) && a[i] >= 0)) {
      what << "radiance " << a[i];
    } else if (!(std::max(std::abs(a[i] - b[i]), std::abs(a[i] - c[i])) <= 1e-6 * brightest)) {
      what << "mirror symmetry: " << a[i] << ' ' << b[i] << ' ' << c[i] << " of " << brightest;
    } else if (conservative && !(a[i] < 20 * sky->solar_irradiance()[i % wavelengths])) {
      // No column scatters more than it receives, and no aerosol of ours sends more than 20 times
      // that into a steradian straight on.
      what << "more light than the Sun sends: " << a[i];
    } else {
      continue;
    }
    what << " at elevation " << v.elevation_rad * 180 / kPi << ", azimuth "
         << v.relative_azimuth_rad * 180 / kPi << ", "
         << scene.spectrum.wavelengths_nm[i % wavelengths] << " nm";
    return what.str();
  }
  const Irradiance irradiance = sky->irradiance();
  const auto transmittance = sky->sun_transmittance();
  for (std::size_t w = 0; w < wavelengths; ++w) {
    const double sun = sky->solar_irradiance()[w];
    if (!(irradiance.direct[w] >= 0 && irradiance.direct[w] <= sun)) {
      what << "direct irradiance " << irradiance.direct[w];
    } else if (!(irradiance.diffuse[w] >= 0 && std::isfinite(irradiance.diffuse[w]))) {
      what << "diffuse irradiance " << irradiance.diffuse[w];
    } else if (!(transmittance[w] >= 0 && transmittance[w] <= 1)) {
      what << "transmittance " << transmittance[w];
    }
  }
  if (!std::isfinite(sky->apparent_sun_elevation_rad())) what << "apparent elevation of the Sun";
  return what.str();
}

void expect_lawful(const Scene& scene) { EXPECT_EQ(broken_law(scene), "") << describe(scene); }

// RC_PARAMS overrides, e.g. RC_PARAMS="max_success=2000 seed=7".
void default_parameters() {
  setenv("RC_PARAMS", "max_success=200 seed=20031208 noshrink=1", /*overwrite=*/0);
}

TEST(AnySky, IsFiniteNonNegativeAndMirrorSymmetric) {
  default_parameters();
  const bool lawful = rc::check("every sky is finite, non-negative and mirror symmetric", [] {
    const Scene scene = random_scene();
    std::string broken;
    try {
      broken = broken_law(scene);
    } catch (const std::exception& error) {
      broken = std::string("throws ") + error.what();
    }
    if (!broken.empty()) RC_FAIL(broken + "\n" + describe(scene));
  });
  EXPECT_TRUE(lawful);
}

// The corners of the range, all with all.
Scene corner(double sun_deg, int divisions, int layers, const std::string& aerosol) {
  Scene scene;
  scene.sun.elevation_deg = sun_deg;
  scene.solver.azimuth_divisions = divisions;
  scene.solver.active_shell_stride = divisions > 100 ? 32 : 2;
  scene.solver.inner_radius_m = divisions > 100 ? 5000 : 1000;
  scene.solver.scattering_orders = 4;
  scene.atmosphere.layers = layers;
  scene.aerosols.type = aerosol;
  scene.aerosols.relative_humidity_percent = 95;
  scene.spectrum.wavelengths_nm = {400, 550, 700};
  return scene;
}

class ExtremeScene
    : public testing::TestWithParam<std::tuple<double, std::pair<int, int>, const char*>> {};

TEST_P(ExtremeScene, IsFiniteNonNegativeAndMirrorSymmetric) {
  const auto& [sun_deg, grid, aerosol] = GetParam();
  expect_lawful(corner(sun_deg, grid.first, grid.second, aerosol));
}

// (S, layers): 180 with 500 layers would take minutes.
INSTANTIATE_TEST_SUITE_P(AllCorners, ExtremeScene,
                         testing::Combine(testing::Values(-18.0, 0.0, 90.0),
                                          testing::Values(std::pair{8, 1}, std::pair{8, 500},
                                                          std::pair{180, 1}, std::pair{180, 20}),
                                          testing::Values("none", "urban")),
                         [](const auto& info) {
                           const double sun = std::get<0>(info.param);
                           const auto grid = std::get<1>(info.param);
                           return (sun < 0 ? "SunMinus" : "Sun") +
                                  std::to_string(static_cast<int>(std::abs(sun))) + "S" +
                                  std::to_string(grid.first) + "Layers" +
                                  std::to_string(grid.second) + std::get<2>(info.param);
                         });

}  // namespace
}  // namespace twilight
