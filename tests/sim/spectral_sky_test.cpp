// A sky at more wavelengths than were solved, and the difference between two skies.
#include "sim/spectral_sky.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "sim/relative_difference.h"
#include "sim/scene_model.h"

namespace twilight {
namespace {

TEST(SpectralInterpolation, LogarithmsOfCubicsAreExact) {
  const std::vector<double> solved = {380, 450, 500, 620, 700}, wanted = {380, 400, 500, 560, 700};
  const auto law = [](double nm) {
    const double x = (nm - 500) / 100;
    return std::exp(1 - 2 * x + 0.5 * x * x - 0.3 * x * x * x);
  };
  std::vector<double> values, out(wanted.size());
  for (const double nm : solved) values.push_back(law(nm));
  SpectralInterpolation(solved, wanted).logarithmic(values, out);
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    EXPECT_NEAR(out[k] / law(wanted[k]), 1, 1e-12) << wanted[k];
  }
}

TEST(SpectralInterpolation, DarknessIsNotNegative) {
  const std::vector<double> solved = {380, 450, 500}, wanted = {380, 400, 475, 500};
  std::vector<double> out(wanted.size());
  SpectralInterpolation(solved, wanted).logarithmic(std::vector<double>{0, 1, 3}, out);
  EXPECT_EQ(out[0], 0);
  EXPECT_NEAR(out[1], 20.0 / 70, 1e-12);
  EXPECT_NEAR(out[2], 2, 1e-12);
}

TEST(SpectralInterpolation, DoesNotReachBeyondWhatWasSolved) {
  EXPECT_THROW(SpectralInterpolation(std::vector<double>{400, 500}, std::vector<double>{390}),
               std::invalid_argument);
  EXPECT_THROW(SpectralInterpolation({}, std::vector<double>{390}), std::invalid_argument);
}

TEST(SpectralSky, HasTheSolvedSkyAtItsWavelengthsAndASmoothOneBetween) {
  Scene scene;
  scene.sun.elevation_deg = 20;
  scene.aerosols.type = "none";
  scene.solver.method = "orders";
  scene.solver.altitude_levels = 10;
  scene.solver.polar_directions = 8;
  scene.solver.azimuth_directions = 4;
  scene.solver.zenith_step_deg = 3;
  scene.solver.sunlight_nodes = 64;
  scene.spectrum.wavelengths_nm = {400, 420, 440, 460, 480};
  const ViewDirection views[] = {{1.2, 0.3}, {0.3, 2.0}};
  const SceneModel all = build_scene_model(scene);
  const auto truth = solve_sky(all);
  scene.spectrum.solved_nm = {400, 440, 480};
  const auto sky = solve_sky(build_scene_model(scene));
  EXPECT_EQ(sky->wavelength_nm().size(), 5U);
  const StokesRadiance a = truth->stokes(views), b = sky->stokes(views);
  ASSERT_EQ(b.i.size(), a.i.size());
  for (std::size_t k = 0; k < a.i.size(); ++k) {
    EXPECT_NEAR(b.i[k] / a.i[k], 1, k % 5 % 2 == 0 ? 2e-3 : 1e-2) << k;
    EXPECT_NEAR(b.q[k] / a.i[k], a.q[k] / a.i[k], 5e-3) << k;
    EXPECT_LE(std::hypot(b.q[k], b.u[k]), b.i[k] * (1 + 1e-12));
  }
  EXPECT_EQ(sky->radiance(views), b.i);
  EXPECT_EQ(sky->irradiance().diffuse.size(), 5U);
  EXPECT_EQ(sky->sun_transmittance().size(), 5U);
}

TEST(RelativeDifference, WeighsViewsAndTakesTheWorstColour) {
  const WeightedViews views{std::vector<ViewDirection>(4), {0.04, 0.36, 0.3, 0.3}};
  const std::vector<double> sun = {1, 2};
  const std::vector<double> truth = {1, 2, 1, 2, 1, 2, 1, 2};
  std::vector<double> other = truth;
  other[0] = 2;    // 4 % of the sky: beyond the percentile
  other[3] = 2.2;  // 36 % of it, by 10 %
  const RelativeDifference d = relative_difference(views, sun, truth, other);
  EXPECT_NEAR(d.largest, 1, 1e-12);
  EXPECT_NEAR(d.percentile_95, 0.1, 1e-12);
  EXPECT_NEAR(d.mean, std::max(0.04, 0.036), 1e-12);
}

TEST(RelativeDifference, HemisphereHasTheWeightOfOne) {
  const WeightedViews sky = coarse_hemisphere(7, 5);
  double flux = 0;
  for (std::size_t k = 0; k < sky.views.size(); ++k) {
    flux += sky.weight[k] * std::sin(sky.views[k].elevation_rad);
  }
  EXPECT_NEAR(std::accumulate(sky.weight.begin(), sky.weight.end(), 0.0), 1, 1e-12);
  EXPECT_NEAR(flux, 0.5, 1e-12);  // of a uniform sky over 2 pi
}

}  // namespace
}  // namespace twilight
