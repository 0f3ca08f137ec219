// The sky changes without a jump as the Sun crosses the horizon, the Earth's shadow, the zenith.
#include <gtest/gtest.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "atmosphere/refraction.h"
#include "property_size.h"
#include "random_scene.h"
#include "sim/scene_model.h"

namespace twilight {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr int kQuarterings = 3;
constexpr double kWidestStepDeg = 0.8;
// Radiance over the Sun's irradiance, sr^-1, below which nothing is seen: the light of the night
// sky is 1e-12 of daylight's.
constexpr double kDark = 1e-12;
// And of the brightest view, for cells: they keep light in single precision as Fourier series in
// azimuth, whose terms are as large as the brightest azimuth's light.
constexpr double kCellsDark = 1e-5;
// What the grids leave: sunlight's tables are right to some 1e-4 of the beam (sim/README.md), and
// one step of a ray, or one sample of a cell, lights up at once.
constexpr double kGrid = 1e-3;

std::vector<ViewDirection> views() {
  return {{90 * kDeg, 0}, {30 * kDeg, 0}, {30 * kDeg, 2}, {10 * kDeg, 3.1}, {5 * kDeg, 0.3}};
}

// The sky under any elevation of the Sun; beyond the zenith it comes down on the other side.
class SkiesOfTheSun {
 public:
  explicit SkiesOfTheSun(const Scene& scene) : model_(build_scene_model(scene)) {}

  StokesRadiance operator()(double sun_elevation_deg) {
    SceneModel model = model_;
    const bool beyond = sun_elevation_deg > 90;
    model.sun_elevation_rad = (beyond ? 180 - sun_elevation_deg : sun_elevation_deg) * kDeg;
    model.scene.sun.elevation_deg = model.sun_elevation_rad / kDeg;
    std::vector<ViewDirection> directions = views();
    if (beyond) {
      for (ViewDirection& v : directions) v.relative_azimuth_rad += std::numbers::pi;
    }
    if (model.scene.solver.method != "orders") return solve_sky(model)->stokes(directions);
    if (!field_) field_ = solve_field(model).field;
    return sky_from_field(model, field_).sky->stokes(directions);
  }
  const SceneModel& model() const { return model_; }

 private:
  SceneModel model_;
  std::shared_ptr<const OrdersField> field_;
};

// Second difference over the sum of its terms, 0..1, for a step that is quartered again and again,
// and the noise of the last.
struct Bends {
  double bend[kQuarterings + 1] = {};
  double noise = 0;
};

// Of every view and wavelength, about an elevation of the Sun.
std::vector<Bends> bends(SkiesOfTheSun& skies, double crossing_deg) {
  const StokesRadiance middle = skies(crossing_deg);
  const std::size_t W = skies.model().medium.wavelengths();
  std::vector<Bends> out(middle.i.size());
  const bool cells = skies.model().scene.solver.method == "cells";
  const double dark = cells ? kCellsDark * *std::max_element(middle.i.begin(), middle.i.end()) : 0;
  double step = kWidestStepDeg;
  for (int k = 0; k <= kQuarterings; ++k, step /= 4) {
    const StokesRadiance above = skies(crossing_deg + step), below = skies(crossing_deg - step);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double sum = above.i[i] + below.i[i] + 2 * middle.i[i];
      if (!(sum > 4 * std::max(dark, kDark * skies.model().solar_irradiance[i % W]))) continue;
      out[i].bend[k] = std::abs(above.i[i] + below.i[i] - 2 * middle.i[i]) / sum;
      if (!middle.standard_error.empty()) {
        out[i].noise = std::hypot(above.standard_error[i], below.standard_error[i],
                                  2 * middle.standard_error[i]) /
                       sum;
      }
    }
  }
  return out;
}

// The elevation at which the Sun's last ray passes the Earth on its way to the observer.
double shadow_edge_deg(const SceneModel& model) {
  const RefractedRays rays(model.medium, 0);
  const double altitude = observer_altitude_km(model.scene);
  const double grazing = rays.horizon_apparent_zenith_rad(altitude) - 1e-10;
  return 90 - rays.trace_outward(altitude, grazing, {}).true_zenith_rad / kDeg;
}

class SkyIsSmooth : public testing::TestWithParam<const char*> {
 protected:
  // Where light is continuous its bend vanishes with the step: like its square where light is
  // smooth, like the step itself at a kink, like its root where the edge of the shadow rises
  // along a ray that it touches (chords of a sphere). The last of three quarterings leaves at most
  // an eighth of the widest then; a jump stays as it is. Half of the largest of the others, and
  // what the grids leave, is allowed.
  static void expect_smooth_about(const std::function<double(const SceneModel&)>& crossing_deg) {
    const std::string method = GetParam();
    const std::size_t n = scene_count(method == "cells" ? 40 : 4);
    const std::vector<Scene> scenes = draw_scenes(n, [&] {
      Scene s = random_scene(method, nightly() ? SceneSize::kLarge : SceneSize::kSmall);
      // A cell that is its centre lights up at once, as the paper has it.
      s.solver.cell_optics = "mean";
      s.solver.gather = "exact-single";
      if (method == "monte-carlo") s.solver.photons = 2000;
      return s;
    });
    std::vector<std::vector<Bends>> all(scenes.size());
    tbb::parallel_for(std::size_t{0}, scenes.size(), [&](std::size_t i) {
      SkiesOfTheSun skies(scenes[i]);
      all[i] = bends(skies, crossing_deg(skies.model()));
    });
    double largest = 0;
    int broken = 0;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      for (std::size_t k = 0; k < all[i].size(); ++k) {
        const auto& b = all[i][k].bend;
        const double last = b[kQuarterings];
        largest = std::max(largest, last);
        const double most = 0.5 * std::max({b[0], b[1], b[2]}) + kGrid + 6 * all[i][k].noise;
        if (last <= most || ++broken > 3) continue;
        SkiesOfTheSun skies(scenes[i]);
        const double at = crossing_deg(skies.model());
        std::string course;
        for (int q = -4; q <= 4; ++q) {
          const double e = at + q * kWidestStepDeg / 64;
          course += "  " + std::to_string(e) +
                    " deg: " + std::to_string(skies(e).i[k] / skies(at).i[k]) + "\n";
        }
        ADD_FAILURE() << "bends " << b[0] << ' ' << b[1] << ' ' << b[2] << ' ' << b[3] << ", value "
                      << k << " of scene " << i << "\n"
                      << course << describe(scenes[i]);
      }
    }
    EXPECT_EQ(broken, 0);
    std::printf("%s: %zu scenes, largest bend over %.4f degrees %.2g\n", method.c_str(),
                scenes.size(), kWidestStepDeg / 64, largest);
  }
};

TEST_P(SkyIsSmooth, AsTheSunCrossesTheHorizon) {
  expect_smooth_about([](const SceneModel&) { return 0.0; });
}
TEST_P(SkyIsSmooth, AsTheEarthsShadowCrossesTheObserver) { expect_smooth_about(shadow_edge_deg); }
TEST_P(SkyIsSmooth, AsTheSunCrossesTheZenith) {
  expect_smooth_about([](const SceneModel&) { return 90.0; });
}

INSTANTIATE_TEST_SUITE_P(Cells, SkyIsSmooth, testing::Values("cells"));
INSTANTIATE_TEST_SUITE_P(Orders, SkyIsSmooth, testing::Values("orders"));
INSTANTIATE_TEST_SUITE_P(MonteCarlo, SkyIsSmooth, testing::Values("monte-carlo"));

}  // namespace
}  // namespace twilight
