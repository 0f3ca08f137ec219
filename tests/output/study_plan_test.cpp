// Plans of studies: what a case depends on, what shares an atmosphere, who computes what.
#include "output/study_plan.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "output/study_case_file.h"
#include "sim/scene_aerosols.h"
#include "sim/scene_model.h"
#include "tests/sim/small_scene.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using testing::HasSubstr;

constexpr const char* kScene = R"(
[sun]
elevation_deg = 3
[aerosols]
type = "none"
[spectrum]
wavelengths_nm = [450, 600]
[solver]
method = "orders"
zenith_step_deg = 3
altitude_levels = 8
polar_directions = 8
azimuth_directions = 4
scattering_orders = 3
sunlight_nodes = 64
)";

std::string axis(const std::string& key, const std::string& values) {
  return "[[axis]]\nkey = \"" + key + "\"\nvalues = " + values + "\n";
}

class StudyPlans : public testing::Test {
 protected:
  StudyPlan plan(const std::string& text) const {
    return plan_study(folder_.write("study.toml", text), {});
  }
  std::string refusal(const std::string& text) const {
    try {
      plan(text);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "accepted";
  }
  TemporaryFolder folder_;
};

TEST_F(StudyPlans, OneAtmosphereServesEverySunObserverAndPicture) {
  const StudyPlan p = plan(
      kScene + axis("earth.ground_albedo", "[0.1, 0.2]") + axis("sun.elevation_deg", "[9, 0, -5]") +
      axis("sun.azimuth_deg", "[90, 180]") + axis("observer.height_m", "[0, 3000]") +
      axis("output.projection", "[\"fisheye\", \"octahedral\"]"));
  EXPECT_EQ(p.cases.size(), 48u);
  EXPECT_EQ(p.groups.size(), 2u);
  EXPECT_EQ(p.saved_solves(), 46u);
  for (const CaseGroup& group : p.groups) EXPECT_TRUE(group.shares);
}

TEST_F(StudyPlans, WhatTheAtmosphereDependsOnPartsIt) {
  for (const auto& [key, values] :
       std::vector<std::pair<std::string, std::string>>{{"atmosphere.ozone_du", "[300, 200]"},
                                                        {"observer.height_m", "[0, -400]"},
                                                        {"sun.disc_average", "[true, false]"},
                                                        {"earth.radius_km", "[6371, 6372]"},
                                                        {"solver.altitude_levels", "[8, 9]"}}) {
    EXPECT_EQ(plan(kScene + axis(key, values)).groups.size(), 2u) << key;
  }
}

// A place's radius of curvature and the Sun's distance change with time; a radius given does not.
TEST_F(StudyPlans, TimesShareAnAtmosphereWhereItsGeometryIsTheSame) {
  const std::string placed = R"(
[observer]
latitude_deg = 49.2
longitude_deg = 7.0
time = "2003-12-08T17:00:00+01:00"
[spectrum]
wavelengths_nm = [500]
[solver]
method = "orders"
)";
  const std::string times =
      axis("observer.time", "[\"2003-12-08T17:00:00+01:00\", \"2003-12-08T17:10:00+01:00\"]");
  EXPECT_EQ(plan(placed + times).groups.size(), 2u);
  EXPECT_EQ(plan(placed + axis("output.sun_disc", "[true, false]")).groups.size(), 1u);
}

TEST_F(StudyPlans, OtherMethodsShareNothing) {
  EXPECT_EQ(plan(kScene + axis("solver.method", "[\"orders\", \"preetham\", \"nishita\"]") +
                 axis("sun.elevation_deg", "[9, 5]"))
                .groups.size(),
            5u);
}

// Law of the whole: what a case in a group gives is what it gives alone.
TEST_F(StudyPlans, ASharedAtmosphereGivesTheBitsOfOneSolvedAlone) {
  Scene first = parse_scene(kScene, "scene"), second = first;
  second.sun.elevation_deg = -4;
  second.sun.azimuth_deg = 20;
  second.sun.spectrum = "unit";
  second.observer.height_m = 2500;
  ASSERT_EQ(atmosphere_inputs(first), atmosphere_inputs(second));
  const auto atmosphere = solve_atmosphere(build_scene_model(first));
  const SceneModel model = build_scene_model(second);
  const auto shared = sky_in_atmosphere(model, atmosphere), alone = solve_sky(model);
  const std::vector<ViewDirection> views = {{1.5, 0}, {0.2, 1}, {0.02, 3}, {-0.01, 0.5}};
  EXPECT_EQ(shared->radiance(views), alone->radiance(views));
  EXPECT_EQ(shared->map_radiance(views), alone->map_radiance(views));
  EXPECT_EQ(shared->irradiance().diffuse, alone->irradiance().diffuse);
  EXPECT_EQ(shared->irradiance().direct, alone->irradiance().direct);
}

TEST_F(StudyPlans, EveryKeyButTheThreadsNamesTheCase) {
  WantedQuantities wanted;
  const Scene scene = parse_scene(kScene, "scene");
  const std::string inputs = case_inputs(scene, wanted);
  for (const SceneKey& key : scene_keys()) {
    Scene other = scene;
    std::visit(
        [](auto* value) {
          using T = std::remove_pointer_t<decltype(value)>;
          if constexpr (std::is_same_v<T, double> || std::is_same_v<T, int>) *value += 1;
          if constexpr (std::is_same_v<T, bool>) *value = !*value;
          if constexpr (std::is_same_v<T, std::string>) *value += "x";
          if constexpr (std::is_same_v<T, std::optional<double>>) *value = value->value_or(0) + 1;
          if constexpr (std::is_same_v<T, std::optional<int>>) *value = value->value_or(0) + 1;
          if constexpr (std::is_same_v<T, std::optional<bool>>) *value = !value->value_or(false);
          if constexpr (std::is_same_v<T, std::optional<std::string>>) *value = "y";
          if constexpr (std::is_same_v<T, std::vector<double>>) value->push_back(999);
        },
        key.field(other));
    EXPECT_EQ(case_inputs(other, wanted) == inputs, key.name == "solver.threads") << key.name;
  }
}

TEST_F(StudyPlans, FilesAreKnownByTheirContentsNotTheirPlace) {
  Scene here = parse_scene(kScene, "scene"), there = here;
  here.atmosphere.optical_layers = folder_.write("a.csv", "layers").string();
  there.atmosphere.optical_layers = folder_.write("b.csv", "layers").string();
  EXPECT_EQ(case_inputs(here, {}), case_inputs(there, {}));
  folder_.write("b.csv", "other layers");
  EXPECT_NE(case_inputs(here, {}), case_inputs(there, {}));
}

TEST_F(StudyPlans, AFileThatAMixtureNamesCountsToo) {
  Scene scene = parse_scene(kScene, "scene");
  scene.atmosphere.optical_layers =
      folder_.write("mixture.toml", "refractive_index = \"soot.csv\"\n").string();
  folder_.write("soot.csv", "1.75");
  const std::string before = case_inputs(scene, {});
  folder_.write("soot.csv", "1.85");
  EXPECT_NE(case_inputs(scene, {}), before);
}

// A humidity's file of a component in OPAC's form, which scatters alike in all directions.
std::string opac_file(int percent, double scattering_per_km) {
  std::string text =
      fmt::format("# water soluble ({}%)", percent) +
      "\n#\n# optical parameters:\n#\n"
      "# wavelength ext.coef  sca.coef  abs.coef  si.sc.alb  asym.par  ext.nor  ref.real  "
      "ref.imag\n"
      "#     [um]     [1/km]    [1/km]    [1/km]\n#\n";
  const char* nm[] = {"3.500E-01", "5.500E-01", "8.000E-01"};
  for (const char* um : nm) {
    text += fmt::format(
        "#  {0} {1:.3E} {1:.3E} 0.000E+00 1.000E+00 0.000E+00 1.000E+00 1.500E+00 "
        "0.000E+00\n",
        um, scattering_per_km);
  }
  text += "#\n# volume phase function [1/km]:\n#\n# sca.ang. | wavelengths --->\n#\n#          |";
  for (const char* um : nm) text += fmt::format(" {}", um);
  text += "\n#\n";
  for (int deg = 0; deg <= 180; deg += 2) {
    text += fmt::format("  {:.5E} ", static_cast<double>(deg));
    for ([[maybe_unused]] const char* um : nm) {
      text += fmt::format(" {:.3E}", scattering_per_km / (4 * std::numbers::pi));
    }
    text += "\n";
  }
  return text;
}

// OPAC's files are named by their stem, and a folder's name may hold quotes.
TEST_F(StudyPlans, FilesThatAMixtureNamesByTheirStemCount) {
  std::filesystem::create_directory(folder_.path / "isn't");
  folder_.write("isn't/waso00", opac_file(0, 1e-6));
  folder_.write("isn't/waso80", opac_file(80, 2e-6));
  Scene scene = parse_scene(kScene, "scene");
  scene.aerosols.mixture =
      folder_
          .write("mixture.toml",
                 "[[component]]\nname = \"own\"\noptics = \"isn't/waso\"\n[[layer]]\n"
                 "bottom_km = 0\ntop_km = 2\nnumber_per_cm3 = { own = 1000 }\n")
          .string();
  ASSERT_EQ(aerosol_files(scene).size(), 3u);
  const std::string before = case_inputs(scene, {}), air = atmosphere_inputs(scene);
  folder_.write("isn't/waso80", opac_file(80, 3e-6));
  const std::string changed = case_inputs(scene, {});
  EXPECT_NE(changed, before);
  EXPECT_NE(atmosphere_inputs(scene), air);
  folder_.write("isn't/waso90", opac_file(90, 4e-6));
  EXPECT_NE(case_inputs(scene, {}), changed);
  folder_.write("isn't/waso80", opac_file(80, 2e-6));
  std::filesystem::remove(folder_.path / "isn't/waso90");
  EXPECT_EQ(case_inputs(scene, {}), before);
}

TEST_F(StudyPlans, OneAxisValueMoreNamesOnlyNewCases) {
  const auto hashes = [&](const std::string& values) {
    std::set<std::string> names;
    for (const PlannedCase& c :
         plan(kScene + axis("sun.elevation_deg", "[9, 0]") + axis("atmosphere.ozone_du", values))
             .cases) {
      names.insert(c.hash);
    }
    return names;
  };
  const auto two = hashes("[200, 300]"), three = hashes("[250, 200, 300]");
  EXPECT_EQ(two.size(), 4u);
  EXPECT_EQ(three.size(), 6u);
  EXPECT_TRUE(std::ranges::includes(three, two));
}

TEST_F(StudyPlans, ShardsAreDisjointCompleteAndBalanced) {
  const StudyPlan p =
      plan(kScene + axis("atmosphere.ozone_du", "[100, 200, 250, 300, 350, 400, 450]") +
           axis("sun.elevation_deg", "[9, 0, -5]"));
  ASSERT_EQ(p.groups.size(), 7u);
  for (const std::size_t count : {1u, 2u, 3u, 4u, 7u, 8u, 21u, 40u}) {
    std::multiset<std::size_t> all;
    std::set<std::pair<std::size_t, std::size_t>> solved;  // group, shard
    std::size_t most = 0, least = p.cases.size();
    for (std::size_t index = 1; index <= count; ++index) {
      const std::vector<std::size_t> mine = shard_cases(p, index, count);
      EXPECT_TRUE(std::ranges::is_sorted(mine));
      all.insert(mine.begin(), mine.end());
      for (const std::size_t c : mine) solved.emplace(p.cases[c].group, index);
      most = std::max(most, mine.size());
      least = std::min(least, mine.size());
    }
    EXPECT_EQ(all.size(), 21u) << count;
    EXPECT_EQ(std::set<std::size_t>(all.begin(), all.end()).size(), 21u) << count;
    if (count <= p.groups.size()) {
      EXPECT_EQ(solved.size(), 7u) << count;
      EXPECT_LE(most - least, 3u) << count;  // a group
    } else {
      EXPECT_LE(most - least, 1u) << count;
    }
  }
}

TEST_F(StudyPlans, CasesThatDifferInTheirWavelengthsAreRefused) {
  const auto layers = [](const std::string& nm) {
    return "bottom_km,top_km,wavelength_nm,air_scattering_per_km,aerosol_scattering_per_km,"
           "aerosol_asymmetry,absorption_per_km\n0,10," +
           nm + ",0.01,0,0,0\n";
  };
  folder_.write("a.csv", layers("500"));
  folder_.write("b.csv", layers("600"));
  EXPECT_THAT(refusal("[sun]\nelevation_deg = 3\n" +
                      axis("atmosphere.optical_layers", "[\"a.csv\", \"b.csv\"]")),
              HasSubstr("case 2 (atmosphere.optical_layers = b.csv): its wavelengths"));
}

TEST_F(StudyPlans, ABudgetIsRefused) {
  EXPECT_THAT(refusal("[sun]\nelevation_deg = 3\n[budget]\nmax_seconds = 3\n"),
              HasSubstr("study.toml:4: key 'budget.max_seconds' must not be given"));
}

TEST_F(StudyPlans, ACombinationThatIsNoSceneIsNamed) {
  EXPECT_THAT(
      refusal("sampling = \"zipped\"\n" + std::string(kScene) +
              axis("earth.ground_albedo", "[0.1, 1.5]") + axis("sun.elevation_deg", "[9, 5]")),
      HasSubstr("case 2 (earth.ground_albedo = 1.5, sun.elevation_deg = 5): key "
                "'earth.ground_albedo' = 1.5: must be 0..1"));
}

class CaseFiles : public testing::Test {
 protected:
  CaseFiles() {
    result_.hash = "00112233445566778899aabbccddeeff";
    result_.inputs = "[sun]\nelevation_deg = 3\n";
    result_.quantities = {{"illuminance", {"lux", "x", ""}, {}, {3.25}, false},
                          {"texture", {"1", "y", ""}, {"band", "x"}, {1, 2, 3, 4, 5, 6}, true}};
    coordinates_ = {{"band", {}, {}, {"U", "B"}}, {"x", {"1", "", ""}, {0, 1, 2}, {}}};
  }
  CaseResult result_;
  std::vector<StudyCoordinate> coordinates_;
  TemporaryFolder folder_;
};

TEST_F(CaseFiles, GiveBackWhatWasWritten) {
  write_case(folder_.path, result_, coordinates_);
  const auto read = read_case(folder_.path, result_.hash);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->inputs, result_.inputs);
  ASSERT_EQ(read->quantities.size(), 2u);
  EXPECT_EQ(read->quantities[0].values, result_.quantities[0].values);
  EXPECT_EQ(read->quantities[0].meaning.units, "lux");
  EXPECT_EQ(read->quantities[1].values, result_.quantities[1].values);
  EXPECT_EQ(read->quantities[1].dimensions, result_.quantities[1].dimensions);
  EXPECT_TRUE(read->quantities[1].single_precision);
}

TEST_F(CaseFiles, ADamagedByteAnywhereIsNoticed) {
  write_case(folder_.path, result_, coordinates_);
  const auto path = case_file(folder_.path, result_.hash);
  std::ifstream stream(path, std::ios::binary);
  const std::string whole{std::istreambuf_iterator<char>(stream), {}};
  for (std::size_t at = 0; at < whole.size(); at += 7) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    std::ofstream(path, std::ios::binary) << damaged;
    EXPECT_FALSE(read_case(folder_.path, result_.hash)) << at;
  }
  for (const std::size_t size : {std::size_t{0}, whole.size() / 2, whole.size() - 1}) {
    std::ofstream(path, std::ios::binary) << whole.substr(0, size);
    EXPECT_FALSE(read_case(folder_.path, result_.hash)) << size;
  }
  std::ofstream(path, std::ios::binary) << whole;
  EXPECT_TRUE(read_case(folder_.path, result_.hash));
}

TEST_F(CaseFiles, ALostPictureMakesTheCaseUndone) {
  result_.picture = result_.hash + ".png";
  folder_.write(result_.picture, "picture");
  write_case(folder_.path, result_, coordinates_);
  EXPECT_TRUE(read_case(folder_.path, result_.hash));
  std::filesystem::remove(folder_.path / result_.picture);
  EXPECT_FALSE(read_case(folder_.path, result_.hash));
}

}  // namespace
}  // namespace twilight
