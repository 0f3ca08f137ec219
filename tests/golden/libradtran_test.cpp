// A twilight sky published with a Monte Carlo code in spherical geometry.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/scene_model.h"

namespace twilight {
namespace {

// libRadtran, examples/UVSPEC_MC_SPHERICAL (MYSTIC, 1e6 photons, polarised): US standard air
// without aerosol, black ground, Earth radius 6370 km, Sun at zenith angle 92 deg, zenith seen from
// the ground at 500 nm: radiance over solar irradiance 4.02704e-4 sr^-1. Scalar transfer misses the
// radiance of Rayleigh air by up to 10 % (Mishchenko, Lacis & Travis 1994, JQSRT 51, 491), and
// overestimates it 90 deg from the Sun, where the light scattered once is polarised most.
TEST(LibRadtran, ZenithWithTheSunTwoDegreesDown) {
  constexpr double kPublished = 4.02704e-4, kScalarError = 0.10;
  Scene scene;
  scene.sun.elevation_deg = -2;
  scene.sun.spectrum = "unit";
  scene.earth.radius_km = 6370;
  scene.earth.ground_albedo = 0;
  scene.atmosphere.refraction = false;
  scene.aerosols.type = "none";
  scene.spectrum.wavelengths_nm = {500};
  const SceneModel model = build_scene_model(scene);
  const auto sky = solve_sky(model);
  const ViewDirection zenith{std::numbers::pi / 2, 0};
  const double ratio = sky->radiance({&zenith, 1})[0] / kPublished;
  EXPECT_GT(ratio, 1.0);
  EXPECT_LT(ratio, 1 + kScalarError);
}

}  // namespace
}  // namespace twilight
