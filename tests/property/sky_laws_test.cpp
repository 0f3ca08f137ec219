// What holds for every sky that a scene file can ask for, by each method.
#include "sky_laws.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "property_size.h"
#include "random_layers.h"

namespace twilight {
namespace {

struct Census {
  std::size_t scenes = 0, own_layers = 0, compared = 0, thorough = 0, refused = 0;
  std::map<Law, std::pair<std::size_t, std::string>> broken;  // how often, and an example
};

constexpr double kSimplifyingSeconds = 15;

Depth depth_of(std::size_t scene) {
  return scene % 40 == 0 ? Depth::kThorough : scene % 8 == 0 ? Depth::kCompare : Depth::kGlance;
}

Census take_census(const std::string& method) {
  // More of what takes less: 10,000 in all.
  const std::size_t n = scene_count(method == "cells" ? 9500 : method == "orders" ? 60 : 450);
  const std::vector<DrawnScene> scenes = draw_scenes(n, [&] {
    return random_scene_or_layers(method, nightly() ? SceneSize::kLarge : SceneSize::kSmall);
  });
  Census census;
  std::vector<Verdict> verdicts(scenes.size());
  tbb::parallel_for(std::size_t{0}, scenes.size(),
                    [&](std::size_t i) { verdicts[i] = judge(scenes[i], depth_of(i)); });
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    ++census.scenes;
    census.own_layers += scenes[i].layers.has_value();
    const Depth depth = depth_of(i);
    census.compared += depth != Depth::kGlance;
    census.thorough += depth == Depth::kThorough;
    census.refused += verdicts[i].refused;
    std::set<Law> laws;
    for (const BrokenLaw& b : verdicts[i].broken) {
      if (!laws.insert(b.law).second) continue;
      auto& [count, example] = census.broken[b.law];
      if (count++ > 0) continue;
      const auto what = [&](const DrawnScene& s) -> std::string {
        for (const BrokenLaw& x : judge(s, depth).broken) {
          if (x.law == b.law) return x.what;
        }
        return "";
      };
      const DrawnScene plain = simplest(
          scenes[i], [&](const DrawnScene& s) { return !what(s).empty(); }, kSimplifyingSeconds);
      example = "scene " + std::to_string(i) + ": " + b.what + "\n" + describe(scenes[i]) +
                "made plain: " + what(plain) + "\n" + describe(plain);
    }
  }
  std::printf(
      "%s: %zu scenes (%zu of own layers), %zu compared, %zu thoroughly, %zu refused (ducted "
      "rays)\n",
      method.c_str(), census.scenes, census.own_layers, census.compared, census.thorough,
      census.refused);
  return census;
}

const Census& census(const std::string& method) {
  static std::map<std::string, Census> taken;
  const auto it = taken.find(method);
  return it != taken.end() ? it->second : taken.emplace(method, take_census(method)).first->second;
}

class SkyLaws : public testing::TestWithParam<const char*> {
 protected:
  static void expect(Law law) {
    const Census& c = census(GetParam());
    const auto it = c.broken.find(law);
    if (it == c.broken.end()) return;
    ADD_FAILURE() << name(law) << ": broken in " << it->second.first << " of " << c.scenes
                  << " scenes; " << it->second.second;
  }
};

TEST_P(SkyLaws, EveryValidSceneIsSolved) { expect(Law::kSolved); }
TEST_P(SkyLaws, IsFinite) { expect(Law::kFinite); }
TEST_P(SkyLaws, IsNotNegative) { expect(Law::kPositive); }
TEST_P(SkyLaws, IsMirrorSymmetricAboutTheSunsPlane) { expect(Law::kMirror); }
TEST_P(SkyLaws, IsPolarisedByOneAtMost) { expect(Law::kPolarised); }
TEST_P(SkyLaws, IsMonotoneInTheAlbedo) { expect(Law::kAlbedo); }
TEST_P(SkyLaws, IsLinearInTheSunsIrradiance) { expect(Law::kIrradiance); }
TEST_P(SkyLaws, SendsNoMoreThanTheSun) { expect(Law::kEnergy); }
TEST_P(SkyLaws, IsTheSameForOneAndTwoThreads) { expect(Law::kThreads); }
TEST_P(SkyLaws, RefusesFewScenes) {
  const Census& c = census(GetParam());
  EXPECT_LT(static_cast<double>(c.refused), 0.05 * static_cast<double>(c.scenes));
}

INSTANTIATE_TEST_SUITE_P(Cells, SkyLaws, testing::Values("cells"));
INSTANTIATE_TEST_SUITE_P(Orders, SkyLaws, testing::Values("orders"));
INSTANTIATE_TEST_SUITE_P(MonteCarlo, SkyLaws, testing::Values("monte-carlo"));

// The field in single precision: the mean of up to some thousand directions, each right to some
// 1e-6 (float_kernels_test), is right to 1e-5 an order, and as many orders as there are in thick
// white air may each add theirs; where the sky is dark it keeps 1e-6 of the brightest view.
TEST(OrdersInSinglePrecision, AreTheOrdersInDouble) {
  const auto scenes = draw_scenes(scene_count(24), [] {
    return random_scene_or_layers("orders", nightly() ? SceneSize::kLarge : SceneSize::kSmall);
  });
  std::vector<double> worst(scenes.size()), allowed(scenes.size());
  tbb::parallel_for(std::size_t{0}, scenes.size(), [&](std::size_t i) {
    DrawnScene s = scenes[i];
    s.scene.solver.single_precision = true;
    const auto single = solve_sky(build_scene_model(s))->stokes(law_views());
    s.scene.solver.single_precision = false;
    const FieldSky solved = solve_sky_and_field(build_scene_model(s));
    const auto twin = solved.sky->stokes(law_views());
    allowed[i] = 1e-5 * std::max(10, solved.field->orders);
    const double brightest = *std::max_element(twin.i.begin(), twin.i.end());
    for (std::size_t k = 0; k < twin.i.size(); ++k) {
      double error = std::abs(single.i[k] - twin.i[k]);
      if (!twin.q.empty()) {
        error =
            std::max({error, std::abs(single.q[k] - twin.q[k]), std::abs(single.u[k] - twin.u[k])});
      }
      const double e = error / (twin.i[k] + 0.1 * brightest);
      if (e > worst[i]) worst[i] = e;
    }
  });
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    EXPECT_LE(worst[i], allowed[i]) << describe(scenes[i]);
  }
  std::printf("worst difference, of the radiance or a tenth of the brightest view: %.2g\n",
              *std::max_element(worst.begin(), worst.end()));
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
  scene.spectrum.wavelengths_nm = {400, 700};
  return scene;
}

class ExtremeScene
    : public testing::TestWithParam<std::tuple<double, std::pair<int, int>, const char*>> {};

TEST_P(ExtremeScene, IsLawful) {
  const auto& [sun_deg, grid, aerosol] = GetParam();
  const Scene scene = corner(sun_deg, grid.first, grid.second, aerosol);
  for (const BrokenLaw& b : judge(scene, Depth::kGlance).broken) {
    ADD_FAILURE() << name(b.law) << ": " << b.what << "\n" << describe(scene);
  }
}

// (S, layers): 360 or 180 with 500 layers would take minutes.
INSTANTIATE_TEST_SUITE_P(Corners, ExtremeScene,
                         testing::Combine(testing::Values(-18.0, 0.0, 90.0),
                                          testing::Values(std::pair{4, 1}, std::pair{4, 500},
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
