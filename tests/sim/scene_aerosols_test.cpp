#include "sim/scene_aerosols.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/scene_file.h"
#include "sim/scene_model.h"
#include "tests/sim/small_scene.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using testing::HasSubstr;

Scene hazy_scene() {
  Scene scene = small_scene(-3);
  scene.aerosols.type = "continental_average";
  scene.atmosphere.layers = 40;
  scene.spectrum.wavelengths_nm = {440, 550, 870};
  scene.solver.method = "orders";
  return scene;
}

double depth(const Medium& m, std::size_t w, double from_km = 0, double to_km = 1e9) {
  double sum = 0;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    const double a = std::max(from_km, m.boundary_km[i]), b = std::min(to_km, m.boundary_km[i + 1]);
    if (b > a) {
      sum += (b - a) * (m.aerosol_scattering_per_km(i, w) + m.aerosol_absorption_per_km(i, w));
    }
  }
  return sum;
}

double angstrom(const Medium& m) {
  return -std::log(depth(m, 2) / depth(m, 0)) / std::log(870.0 / 440.0);
}

void expect_same(const LayerTable& a, const LayerTable& b, const Medium& m, const char* what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      EXPECT_NEAR(a(i, w), b(i, w), 1e-12 * std::abs(a(i, w))) << what << " " << i << " " << w;
    }
  }
}

void expect_same(const Medium& a, const Medium& b) {
  ASSERT_EQ(a.boundary_km, b.boundary_km);
  expect_same(a.aerosol_scattering_per_km, b.aerosol_scattering_per_km, a, "scattering");
  expect_same(a.aerosol_absorption_per_km, b.aerosol_absorption_per_km, a, "absorption");
  expect_same(a.aerosol_asymmetry, b.aerosol_asymmetry, a, "asymmetry");
  ASSERT_EQ(a.aerosol_phase.size(), b.aerosol_phase.size());
  for (std::size_t k = 0; k < a.aerosol_phase.size(); ++k) {
    expect_same(a.aerosol_kind_scattering_per_km[k], b.aerosol_kind_scattering_per_km[k], a,
                "kind");
    for (std::size_t w = 0; w < a.wavelengths(); ++w) {
      const PhaseMatrix &p = a.aerosol_phase[k][w], &q = b.aerosol_phase[k][w];
      ASSERT_EQ(p.angle_rad, q.angle_rad);
      for (std::size_t j = 0; j < p.p11.size(); ++j) {
        ASSERT_NEAR(p.p11[j], q.p11[j], 1e-12 * p.p11[j]);
        ASSERT_NEAR(p.p12[j], q.p12[j], 1e-12 * p.p11[j]);
      }
    }
  }
}

// An OPAC type as a mixture file spells it.
std::string spelled(const std::string& type, double humidity_percent) {
  std::string text;
  for (const MixtureLayer& layer : opac_mixture_layers(type)) {
    text += fmt::format("[[layer]]\nbottom_km = {}\ntop_km = {}\n", layer.profile.bottom_km,
                        layer.profile.top_km);
    if (std::isfinite(layer.profile.scale_height_km)) {
      text += fmt::format("scale_height_km = {}\n", layer.profile.scale_height_km);
    }
    const bool own = layer.humidity.source == LayerHumidity::Source::kPercent;
    text += fmt::format("relative_humidity_percent = {}\nnumber_per_cm3 = {{",
                        own ? layer.humidity.percent : humidity_percent);
    for (std::size_t i = layer.amounts.size(); i-- > 0;) {  // in another order
      text += fmt::format("{} = {}{}", layer.amounts[i].component->name(), layer.amounts[i].amount,
                          i > 0 ? ", " : "}\n");
    }
  }
  return text;
}

class MixtureScene : public testing::Test {
 protected:
  Scene with_mixture(const std::string& text, const std::string& name = "mix.toml") const {
    Scene scene = hazy_scene();
    scene.aerosols.mixture = folder_.write(name, text).string();
    return scene;
  }

  TemporaryFolder folder_;
};

TEST_F(MixtureScene, TypesSpelledOutAreTheTypes) {
  KnownPhases known;
  for (const std::string_view type : aerosol_types()) {
    SCOPED_TRACE(type);
    Scene scene = hazy_scene();
    scene.aerosols.type = type;
    Scene mixed = with_mixture(spelled(std::string(type), 80));
    // Matrices of sea salt take long; of the others the two most different.
    if (type != "urban" && type != "desert") {
      scene.aerosols.phase = mixed.aerosols.phase = "henyey-greenstein";
    }
    expect_same(build_scene_model(scene, &known).medium, build_scene_model(mixed, &known).medium);
    scene.aerosols.optical_depth_550nm = mixed.aerosols.optical_depth_550nm = 0.3;
    expect_same(build_scene_model(scene, &known).medium, build_scene_model(mixed, &known).medium);
  }
}

// The same number, written as a mass.
TEST_F(MixtureScene, MassAndNumberLoadsAgree) {
  const double mass = *find_opac_component("WASO")->dry_mass_ug_per_m3();
  const std::string layer = "[[layer]]\nbottom_km = 0\ntop_km = 3\n";
  const Scene number = with_mixture(layer + "number_per_cm3 = {WASO = 5000}\n", "a.toml");
  const Scene load =
      with_mixture(layer + fmt::format("mass_ug_m3 = {{WASO = {}}}\n", 5000 * mass), "b.toml");
  expect_same(build_scene_model(number).medium, build_scene_model(load).medium);
}

TEST_F(MixtureScene, TargetsOfTheColumnAreMet) {
  KnownPhases known;
  std::vector<Scene> scenes;
  for (const char* type : {"continental_average", "desert", "maritime_polluted", "urban"}) {
    scenes.push_back(hazy_scene());
    scenes.back().aerosols.type = type;
    scenes.push_back(scenes.back());
    scenes.back().aerosols.humidity = "profile";
  }
  scenes.push_back(with_mixture(
      "[[layer]]\nbottom_km = 0\ntop_km = 2\nscale_height_km = 1\noptical_depth_550nm = 0.2\n"
      "number_per_cm3 = {WASO = 1}\n"
      "[[layer]]\nprofile = {heights_km = [2, 3, 6], relative_density = [0, 1, 0]}\n"
      "number_per_cm3 = {MITR = 1, SOOT = 100}\n"));
  for (Scene scene : scenes) {
    scene.aerosols.phase = "henyey-greenstein";
    SCOPED_TRACE(scene.aerosols.mixture.value_or(scene.aerosols.type));
    const double own = depth(build_scene_model(scene, &known).medium, 1);
    for (const double exponent : {0.7, 1.0}) {
      scene.aerosols.optical_depth_550nm.reset();
      scene.aerosols.angstrom_exponent = exponent;
      const Medium kept = build_scene_model(scene, &known).medium;
      EXPECT_NEAR(angstrom(kept), exponent, 1e-6);
      EXPECT_NEAR(depth(kept, 1), own, 1e-6 * own);
      scene.aerosols.optical_depth_550nm = 0.25;
      const Medium both = build_scene_model(scene, &known).medium;
      EXPECT_NEAR(angstrom(both), exponent, 1e-6);
      EXPECT_NEAR(depth(both, 1), 0.25, 1e-6);
    }
  }
}

std::string refusal(const std::function<void()>& act) {
  try {
    act();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  ADD_FAILURE() << "was taken";
  return {};
}

TEST_F(MixtureScene, TargetsOutOfReachAreRefusedWithTheReach) {
  Scene scene = hazy_scene();
  scene.aerosols.phase = "henyey-greenstein";
  scene.aerosols.angstrom_exponent = 3;
  const std::string message = refusal([&] { build_scene_model(scene); });
  EXPECT_THAT(message, HasSubstr("'aerosols.angstrom_exponent' = 3: must be "));
  // Its ends themselves are in reach, to the digits printed.
  double low = 0, high = 0;
  ASSERT_EQ(
      std::sscanf(message.substr(message.find("must be")).c_str(), "must be %lf..%lf", &low, &high),
      2);
  for (const double exponent : {low + 1e-4, high - 1e-4}) {
    scene.aerosols.angstrom_exponent = exponent;
    EXPECT_NEAR(angstrom(build_scene_model(scene).medium), exponent, 1e-6);
  }
  for (const double exponent : {low - 1e-3, high + 1e-3}) {
    scene.aerosols.angstrom_exponent = exponent;
    EXPECT_THROW(build_scene_model(scene), std::invalid_argument);
  }
  // One mode alone cannot be turned.
  Scene fine = with_mixture("[[layer]]\nbottom_km = 0\ntop_km = 2\nnumber_per_cm3 = {WASO = 1}\n");
  fine.aerosols.angstrom_exponent = 1;
  EXPECT_THAT(refusal([&] { build_scene_model(fine); }), HasSubstr("all particles are fine"));
  // Particles above the model's top cannot have a depth.
  Scene high_up = with_mixture(
      "[[layer]]\nbottom_km = 70\ntop_km = 80\nnumber_per_cm3 = {SUSO = 1}\n"
      "optical_depth_550nm = 0.1\n");
  EXPECT_THAT(refusal([&] { build_scene_model(high_up); }), HasSubstr("below the top"));
}

TEST_F(MixtureScene, LayersWithoutHumidityTakeTheScenes) {
  Scene scene = with_mixture("[[layer]]\nbottom_km=0\ntop_km=2\nnumber_per_cm3 = {WASO = 1000}\n");
  scene.aerosols.phase = "henyey-greenstein";
  double last = 0;
  for (double humidity = 0; humidity <= 99; humidity += 11) {
    scene.aerosols.relative_humidity_percent = humidity;
    const double now = depth(build_scene_model(scene).medium, 1);
    EXPECT_GT(now, last) << humidity;
    last = now;
  }
}

// An added layer has exactly its depth between its heights, and nothing else changes.
TEST(AddedLayers, AddTheirOpticalDepthBetweenTheirHeights) {
  for (const char* type : {"none", "continental_average"}) {
    for (const bool volcanic : {false, true}) {
      SCOPED_TRACE(fmt::format("{} {}", type, volcanic));
      Scene without = hazy_scene();
      without.aerosols.type = type;
      if (without.aerosols.type != "none") without.aerosols.optical_depth_550nm = 0.1;
      Scene with = without;
      AddedLayerOptions& layer =
          volcanic ? static_cast<AddedLayerOptions&>(with.volcanic_sulfate) : with.dust_layer;
      layer.optical_depth_550nm = 0.07;
      layer.bottom_km += 0.3;
      const Medium a = build_scene_model(without).medium, b = build_scene_model(with).medium;
      // Its ends are boundaries of the air.
      for (const double z : {layer.bottom_km, layer.top_km}) {
        EXPECT_NE(std::ranges::find(b.boundary_km, z), b.boundary_km.end()) << z;
      }
      const double own = without.aerosols.type == "none" ? 0.0 : 0.1;
      EXPECT_NEAR(depth(b, 1), own + 0.07, 1e-9);
      EXPECT_NEAR(depth(b, 1) - depth(a, 1), 0.07, 1e-9);
      if (own == 0) {
        EXPECT_NEAR(depth(b, 1, layer.bottom_km, layer.top_km), 0.07, 1e-12);
      }
      EXPECT_FALSE(b.aerosol_phase.empty());
    }
  }
}

// Droplets of the background stratosphere and of the volcano are one kind of matrix.
TEST(AddedLayers, MixturesThatDifferInAmountAreOneKind) {
  Scene scene = hazy_scene();
  const std::size_t before = build_scene_model(scene).medium.aerosol_phase.size();
  EXPECT_EQ(before, 3u);
  scene.volcanic_sulfate.optical_depth_550nm = 0.1;
  EXPECT_EQ(build_scene_model(scene).medium.aerosol_phase.size(), before);
  scene.dust_layer.optical_depth_550nm = 0.1;
  EXPECT_EQ(build_scene_model(scene).medium.aerosol_phase.size(), before + 1);
}

TEST(AddedLayers, RefusedWhereTheyCannotBe) {
  Scene scene = hazy_scene();
  scene.volcanic_sulfate.optical_depth_550nm = 0.1;
  scene.volcanic_sulfate.top_km = 61;  // the model ends at 60
  EXPECT_EQ(validate(scene)->key, "volcanic_sulfate.top_km");
  scene = hazy_scene();
  scene.dust_layer.bottom_km = 5;
  EXPECT_EQ(validate(scene)->key, "dust_layer.top_km");
  scene = hazy_scene();
  scene.dust_layer.optical_depth_550nm = 0.1;
  scene.atmosphere.optical_layers = "layers.csv";
  EXPECT_EQ(validate(scene)->key, "dust_layer.optical_depth_550nm");
}

// The particles of every layer of air have the humidity of that air: extinction to the digit,
// matrices by classes.
TEST(ProfileHumidity, IsThatOfTheAirAtEveryHeight) {
  Scene scene = hazy_scene();
  scene.atmosphere.profile = "midlatitude_summer";
  scene.atmosphere.layers = 60;
  scene.aerosols.humidity = "profile";
  const Medium m = build_scene_model(scene).medium;
  KnownPhases known;
  const auto layers = opac_mixture_layers("continental_average");
  const double nm[] = {550};
  for (std::size_t i = 0; i < m.layers(); ++i) {
    if (m.boundary_km[i + 1] > 2.0) break;
    const double percent = std::min(99.0, 100 * m.relative_humidity[i]);
    const MixtureOptics optics = known.optics({layers[0].amounts, percent}, nm);
    const double p = layers[0].profile.mean(m.boundary_km[i], m.boundary_km[i + 1]);
    EXPECT_NEAR(m.aerosol_scattering_per_km(i, 1), p * optics.scattering_per_km[0], 1e-12) << i;
  }
  // Kinds are few, add up to the whole, and their mean cosine is near the coefficient's.
  EXPECT_LE(m.aerosol_phase.size(), 8u);
  double worst = 0;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    double sum = 0, cosine = 0;
    for (std::size_t k = 0; k < m.aerosol_phase.size(); ++k) {
      const double part = m.aerosol_kind_scattering_per_km[k](i, 1);
      sum += part;
      cosine += part * phase_asymmetry(m.aerosol_phase[k][1]);
    }
    EXPECT_NEAR(sum, m.aerosol_scattering_per_km(i, 1), 1e-12);
    if (sum > 0) worst = std::max(worst, std::abs(cosine / sum - m.aerosol_asymmetry(i, 1)));
  }
  EXPECT_LT(worst, 0.02);  // g rises by 0.05 from dry to 50 %, halved by 25 %
  RecordProperty("worst", fmt::format("{}", worst));
}

// A table of humidity that is constant is that humidity.
TEST_F(MixtureScene, ConstantTableOfHumidityIsThatHumidity) {
  const std::string layer =
      "[[layer]]\nbottom_km = 0\ntop_km = 3.3\nscale_height_km = 2\nnumber_per_cm3 = {WASO = 1000, "
      "INSO = 0.4}\nrelative_humidity_percent = ";
  const Medium a = build_scene_model(with_mixture(layer + "85\n", "a.toml")).medium;
  const Medium b =
      build_scene_model(
          with_mixture(layer + "{heights_km = [0, 5], percent = [85, 85]}\n", "b.toml"))
          .medium;
  expect_same(a, b);
}

TEST_F(MixtureScene, SceneFilesResolveAndCheckTheMixture) {
  folder_.write("mix.toml", "[[layer]]\nbottom_km=0\ntop_km=2\nnumber_per_cm3 = {WASO = 10}\n");
  const std::string sun = "[sun]\nelevation_deg = -3\n[aerosols]\n";
  const auto load = [&](const std::string& text, std::vector<std::string> overrides = {}) {
    return load_scene(folder_.write("scene.toml", sun + text), overrides).scene;
  };
  const Scene scene = load("mixture = \"mix.toml\"\n");
  EXPECT_EQ(scene.aerosols.mixture, (folder_.path / "mix.toml").string());
  EXPECT_EQ(load("mixture = \"none\"\n").aerosols.mixture, std::nullopt);
  // The printed scene is the scene, whatever type it names.
  folder_.write("printed.toml", to_toml(scene));
  EXPECT_EQ(to_toml(load_scene(folder_.path / "printed.toml").scene), to_toml(scene));
  EXPECT_THAT(refusal([&] { load("mixture = \"absent.toml\"\n"); }),
              testing::AllOf(HasSubstr("scene.toml:4"), HasSubstr("absent.toml")));
  EXPECT_THAT(refusal([&] { load("mixture = \"mix.toml\"\n", {"aerosols.type=urban"}); }),
              testing::AllOf(HasSubstr("aerosols.type"), HasSubstr("mixture=none")));
  EXPECT_EQ(load("mixture = \"mix.toml\"\n", {"aerosols.type=urban", "aerosols.mixture=none"})
                .aerosols.mixture,
            std::nullopt);
  EXPECT_THAT(refusal([&] { load("mixture = \"mix.toml\"\nstratosphere = false\n"); }),
              HasSubstr("aerosols.stratosphere"));
  folder_.write("bad.toml", "[[layer]]\nbottom_km=0\ntop_km=2\nnumber_per_cm3 = {X = 10}\n");
  EXPECT_THAT(refusal([&] { load("mixture = \"bad.toml\"\n"); }), HasSubstr("bad.toml:4"));
}

// Radiances towards the Sun at some elevations, [view][wavelength].
std::vector<double> towards_the_sun(const Scene& scene, const std::vector<double>& elevation_deg,
                                    KnownPhases& known) {
  std::vector<ViewDirection> views;
  for (const double e : elevation_deg) {
    views.push_back({e * std::numbers::pi / 180, 0.0});
  }
  return solve_sky(build_scene_model(scene, &known))->radiance(views);
}

Scene coarse_orders(double sun_deg) {
  Scene scene = small_scene(sun_deg);
  scene.sun.spectrum = "gueymard2004";
  scene.aerosols.type = "continental_clean";
  scene.atmosphere.layers = 40;
  scene.spectrum.wavelengths_nm = {450, 550, 650};
  scene.solver.method = "orders";
  scene.solver.scattering_orders.reset();
  scene.solver.zenith_step_deg = 2;
  scene.solver.altitude_levels = 24;
  scene.solver.polar_directions = 16;
  scene.solver.azimuth_directions = 8;
  scene.solver.phase_degree = 8;
  scene.solver.order_tolerance = 0.01;
  scene.sun.disc_average = false;
  scene.solver.polarisation = false;
  return scene;
}

// What one scene computed serves another without changing a bit.
TEST_F(MixtureScene, KnownPhasesChangeNothing) {
  KnownPhases known;
  Scene other = hazy_scene();
  other.aerosols.relative_humidity_percent = 75;
  build_scene_model(other, &known);
  const std::size_t held = known.size();
  Scene scene = hazy_scene();
  scene.aerosols.relative_humidity_percent = 72;  // between the same classes
  const Medium shared = build_scene_model(scene, &known).medium;
  EXPECT_EQ(known.size(), held);
  const Medium own = build_scene_model(scene).medium;
  ASSERT_EQ(shared.aerosol_phase.size(), own.aerosol_phase.size());
  for (std::size_t k = 0; k < own.aerosol_phase.size(); ++k) {
    for (std::size_t w = 0; w < own.wavelengths(); ++w) {
      EXPECT_EQ(shared.aerosol_phase[k][w].p11, own.aerosol_phase[k][w].p11);
      EXPECT_EQ(shared.aerosol_phase[k][w].p34, own.aerosol_phase[k][w].p34);
    }
  }
}

// The shipped example, own component and all, by three methods.
TEST(ExampleMixture, GivesASkyByEveryMethod) {
  KnownPhases known;
  for (const char* method : {"orders", "cells", "monte-carlo"}) {
    Scene scene = coarse_orders(4);
    scene.solver.method = method;
    if (scene.solver.method == "cells") scene.solver.scattering_orders = 3;
    scene.solver.photons = 200;
    scene.aerosols.mixture = TWILIGHT_CONFIGS "/mixture_smoke.toml";
    const Medium m = build_scene_model(scene, &known).medium;
    EXPECT_NEAR(depth(m, 1, 2.5, 5.5), 0.25, 0.02);  // the plume, and some background
    for (const double radiance : towards_the_sun(scene, {10, 40}, known)) {
      EXPECT_TRUE(std::isfinite(radiance) && radiance > 0) << method;
    }
  }
}

// Droplets above the shadow still see the red Sun when the air below them is dark: the sky some 20
// degrees above it turns red against blue (Lee & Hernandez-Andres 2003, Appl. Opt. 42, 445).
TEST(AddedLayers, VolcanicDropletsMakeThePurpleLight) {
  KnownPhases known;
  for (const double sun : {-4.0, -5.0}) {
    Scene scene = coarse_orders(sun);
    const std::vector<double> elevations = {15, 20, 25};
    const std::vector<double> clear = towards_the_sun(scene, elevations, known);
    scene.volcanic_sulfate.optical_depth_550nm = 0.1;
    const std::vector<double> after = towards_the_sun(scene, elevations, known);
    for (std::size_t v = 0; v < elevations.size(); ++v) {
      for (std::size_t w = 0; w < 3; ++w) {
        ASSERT_TRUE(std::isfinite(after[3 * v + w]) && after[3 * v + w] > 0);
      }
      const double before = clear[3 * v + 2] / clear[3 * v], now = after[3 * v + 2] / after[3 * v];
      EXPECT_GT(now, 1.5 * before) << "Sun " << sun << ", view " << elevations[v];
      // The light is brighter in the red than without droplets, not only less blue.
      EXPECT_GT(after[3 * v + 2], clear[3 * v + 2]);
    }
  }
}

// Dust before a low Sun takes blue light more than red, and dims the sky away from the aureole.
TEST(AddedLayers, DustReddensAndDimsTheLowSun) {
  KnownPhases known;
  Scene scene = coarse_orders(5);
  const std::vector<double> elevations = {15, 60};
  const std::vector<double> clear = towards_the_sun(scene, elevations, known);
  scene.dust_layer.optical_depth_550nm = 0.5;
  const std::vector<double> dusty = towards_the_sun(scene, elevations, known);
  for (std::size_t v = 0; v < elevations.size(); ++v) {
    EXPECT_GT(dusty[3 * v + 2] / dusty[3 * v], clear[3 * v + 2] / clear[3 * v]) << elevations[v];
  }
  EXPECT_LT(dusty[3], clear[3]);  // blue, 60 degrees up
}

}  // namespace
}  // namespace twilight
