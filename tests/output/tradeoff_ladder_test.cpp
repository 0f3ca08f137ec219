#include "output/tradeoff_ladder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "output/tradeoff.h"
#include "sim/scene_file.h"

namespace twilight {
namespace {

/// A scene file for as long as a test runs.
class SceneFile {
 public:
  explicit SceneFile(const std::string& text) {
    path_ = std::filesystem::temp_directory_path() /
            ("twilight-ladder-" + std::to_string(::getpid()) + ".toml");
    std::ofstream(path_) << text;
  }
  ~SceneFile() { std::filesystem::remove(path_); }
  SceneFile(const SceneFile&) = delete;
  SceneFile& operator=(const SceneFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

TradeoffOptions options_for(const SceneFile& file) {
  TradeoffOptions options;
  options.scene = file.path();
  options.directory = std::filesystem::temp_directory_path() / "twilight-ladder-never-made";
  return options;
}

TEST(TradeoffLadder, NamesAreUniqueAndBaselinesExist) {
  for (const bool quick : {false, true}) {
    const std::vector<Rung> ladder = tradeoff_ladder(quick);
    std::set<std::string> names;
    for (const Rung& rung : ladder) {
      EXPECT_TRUE(names.insert(rung.name).second) << rung.name;
      EXPECT_EQ(rung.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-."),
                std::string::npos)
          << rung.name;
      EXPECT_EQ(rung.kind == RungKind::kApproximation, !rung.baseline.empty()) << rung.name;
    }
    for (const Rung& rung : ladder) {
      EXPECT_TRUE(rung.baseline.empty() || names.contains(rung.baseline)) << rung.name;
    }
  }
  EXPECT_LT(tradeoff_ladder(true).size(), 25u);
}

TEST(TradeoffLadder, EveryRungOfTheDefaultSceneIsASceneOfItsOwn) {
  const SceneFile file("[sun]\nelevation_deg = -3\n");
  const TradeoffPlan plan = plan_tradeoff(options_for(file));
  EXPECT_EQ(plan.suns_deg, (std::vector<double>{30, 5, 0, -3, -6, -9, -12}));
  std::set<std::string> scenes;
  for (const PlannedRung& p : plan.rungs) {
    if (!p.skipped.empty()) {
      // A value that is the scene's own already; nothing is refused and nothing forgotten.
      EXPECT_TRUE(p.skipped.starts_with("the same settings as")) << p.rung.name << p.skipped;
      EXPECT_EQ(p.rung.kind, RungKind::kSetting) << p.rung.name;
      continue;
    }
    EXPECT_TRUE(scenes.insert(p.scene_toml).second) << p.rung.name;
  }
  EXPECT_GT(scenes.size(), 80u);
  EXPECT_FALSE(std::filesystem::exists(plan.options.directory));
}

TEST(TradeoffLadder, ApproximationsDifferFromTheirBaselineByWhatTheySay) {
  // Every choice of the paper is there alone and all of them in one, where the method knows them.
  const SceneFile file("[sun]\nelevation_deg = -3\n");
  const TradeoffPlan plan = plan_tradeoff(options_for(file));
  std::map<std::string, Scene> scenes;
  for (const PlannedRung& p : plan.rungs) {
    if (p.skipped.empty()) scenes[p.rung.name] = parse_scene(p.scene_toml, p.rung.name);
  }
  const Scene& paper = scenes.at("cells-all");
  EXPECT_EQ(paper.atmosphere.profile, "exponential");
  EXPECT_EQ(paper.atmosphere.ozone, "vertical");
  EXPECT_EQ(paper.atmosphere.top_km, 35);
  EXPECT_EQ(paper.atmosphere.layer_optics, "centre");
  EXPECT_EQ(paper.atmosphere.refractive_index, "haber2005");
  EXPECT_FALSE(paper.atmosphere.refractive_spreading);
  EXPECT_EQ(paper.earth.ground_albedo, 0);
  EXPECT_EQ(paper.solver.air_phase, "isotropic");
  EXPECT_EQ(paper.solver.aerosol_phase, "similarity");
  EXPECT_EQ(paper.solver.cell_optics, "centre");
  EXPECT_EQ(paper.solver.gather, "cells");
  EXPECT_EQ(paper.solver.active_shell_weighting, "rescale");
  EXPECT_EQ(paper.solver.scattering_orders, 5);
  EXPECT_EQ(paper.solver.azimuth_divisions, scenes.at("cells").solver.azimuth_divisions);
  EXPECT_EQ(scenes.at("orders-no-polarisation").solver.polarisation, false);
  EXPECT_EQ(scenes.at("orders-henyey-greenstein").aerosols.phase, "henyey-greenstein");
  EXPECT_FALSE(scenes.at("orders-no-refraction").atmosphere.refraction);
}

TEST(TradeoffLadder, SkipsWhatSaysNothingOfTheScene) {
  const SceneFile file(
      "[sun]\nelevation_deg = -3\n[aerosols]\ntype = \"none\"\n"
      "[earth]\nground_albedo = 0\n");
  const TradeoffPlan plan = plan_tradeoff(options_for(file));
  std::map<std::string, std::string> skipped;
  for (const PlannedRung& p : plan.rungs) skipped[p.rung.name] = p.skipped;
  EXPECT_EQ(skipped.at("orders-henyey-greenstein"), "the scene has no aerosol");
  EXPECT_EQ(skipped.at("orders-phase-degree-8"), "the scene has no aerosol");
  EXPECT_EQ(skipped.at("cells-similarity"), "the scene has no aerosol");
  EXPECT_EQ(skipped.at("orders-black-ground"), "the same settings as 'orders'");
  EXPECT_EQ(skipped.at("cells-azimuths-120"), "the same settings as 'cells'");
  EXPECT_EQ(skipped.at("cells-azimuths-60"), "");
}

TEST(TradeoffLadder, ReferenceIsFinerThanTheSceneInEveryStep) {
  const SceneFile file("[sun]\nelevation_deg = -3\n");
  for (const bool quick : {false, true}) {
    TradeoffOptions options = options_for(file);
    options.quick = quick;
    const TradeoffPlan plan = plan_tradeoff(options);
    const Scene scene = parse_scene(plan.scene_toml, "scene");
    const Scene fine = parse_scene(plan.reference.scene_toml, "reference");
    EXPECT_EQ(fine.solver.method, "orders");
    EXPECT_LT(fine.solver.zenith_step_deg, scene.solver.zenith_step_deg);
    EXPECT_GT(fine.solver.altitude_levels, scene.solver.altitude_levels);
    EXPECT_GT(fine.solver.polar_directions, scene.solver.polar_directions);
    EXPECT_GT(fine.solver.phase_degree, scene.solver.phase_degree);
    EXPECT_LT(fine.solver.order_tolerance, scene.solver.order_tolerance);
    EXPECT_GT(fine.atmosphere.layers, scene.atmosphere.layers);
    EXPECT_GE(fine.atmosphere.top_km, scene.atmosphere.top_km);
    // Wavelengths hold the scene's, so that radiances can be compared.
    const std::vector<double>& there = fine.spectrum.wavelengths_nm;
    for (const double nm : scene.spectrum.wavelengths_nm) {
      EXPECT_NE(std::ranges::find(there, nm), there.end()) << nm;
    }
    EXPECT_EQ(there.size(), quick ? 15u : 29u);
  }
}

TEST(TradeoffSuns, AreReadAndChecked) {
  EXPECT_EQ(parse_suns("30, -4.5", false), (std::vector<double>{30, -4.5}));
  EXPECT_EQ(parse_suns("", true).size(), 3u);
  for (const char* bad : {"30,", "x", "91", "-19", "5,5", "nan"}) {
    EXPECT_THROW(parse_suns(bad, false), std::invalid_argument) << bad;
  }
}

}  // namespace
}  // namespace twilight
