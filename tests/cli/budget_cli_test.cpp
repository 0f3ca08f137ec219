// Quality and budget as users meet them.
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include "sim/cost_model.h"
#include "sim/scene_file.h"
#include "tests/cli/program_run.h"

namespace twilight {
namespace {

constexpr const char* kScene = R"([sun]
elevation_deg = 25
[atmosphere]
layers = 20
[aerosols]
type = "none"
[spectrum]
wavelengths_nm = [450, 500, 550, 600, 650]
[output]
size = 8
)";

void expect_refused(const std::vector<std::string>& settings,
                    const std::vector<std::string>& fragments) {
  const Workplace place;
  place.write("scene.toml", kScene);
  std::vector<std::string> arguments = {"render", "scene.toml"};
  for (const std::string& setting : settings) {
    arguments.emplace_back("--set");
    arguments.push_back(setting);
  }
  const Finished finished = place.run(arguments);
  EXPECT_EQ(finished.exit_code, 2) << finished.err;
  EXPECT_EQ(place.names(), std::set<std::string>{"scene.toml"});
  for (const std::string& fragment : fragments) {
    EXPECT_NE(finished.err.find(fragment), std::string::npos)
        << "'" << fragment << "' is not in: " << finished.err;
  }
}

TEST(QualityCli, UnknownLevelIsRefusedWithTheKnownOnes) {
  expect_refused({"quality=best"}, {"quality", "best", "draft", "standard", "high", "reference"});
}

TEST(BudgetCli, BadBudgetsAreRefused) {
  expect_refused({"budget.max_relative_error=0"}, {"budget.max_relative_error", "0.001..0.5"});
  expect_refused({"budget.max_seconds=0"}, {"budget.max_seconds", "0.1..1000000"});
  expect_refused({"budget.max_error=0.1"}, {"budget.max_error", "unknown key"});
  expect_refused({"budget.max_seconds=1", "quality=draft"}, {"quality", "[budget]"});
  expect_refused({"budget.max_seconds=1", "solver.method=cells"}, {"solver.method", "orders"});
}

TEST(BudgetCli, AccuracyBeyondEveryLevelIsRefused) {
  expect_refused({"budget.max_relative_error=0.001", "sun.elevation_deg=-9", "aerosols.type=urban",
                  "spectrum.wavelengths_nm=[550]"},
                 {"budget.max_relative_error", "0.001"});
}

// What the program tells of itself when it is done, against what was predicted before it began.
// (Seconds are compared by cost_bench --check, nightly: no test of every run measures time.)
TEST(CostCli, PredictedMemoryIsWithinAFactorOfTwo) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const std::vector<std::vector<std::string>> cases = {
      {"quality=draft"},
      {"quality=draft", "aerosols.type=urban"},
      {"quality=fair", "aerosols.type=continental_average", "spectrum.wavelengths_nm=[550]"},
      {"quality=fair", "solver.polarisation=false"},
      {"solver.method=cells", "solver.azimuth_divisions=24"},
      {"solver.method=cells", "solver.azimuth_divisions=60"},
      {"solver.method=cells", "solver.azimuth_divisions=48", "solver.active_shell_stride=1",
       "atmosphere.layers=60"},
  };
  for (const std::vector<std::string>& settings : cases) {
    std::vector<std::string> arguments = {"radiance", "scene.toml", "--view", "90,0"};
    std::string name;
    for (const std::string& setting : settings) {
      arguments.emplace_back("--set");
      arguments.push_back(setting);
      name += setting + " ";
    }
    const Finished finished = place.run(arguments);
    ASSERT_EQ(finished.exit_code, 0) << finished.err;
    const std::string label = "peak memory";
    const std::size_t at = finished.err.find(label);
    ASSERT_NE(at, std::string::npos) << finished.err;
    const double measured = std::stod(finished.err.substr(at + label.size()));
    const double predicted =
        predict_run(load_scene(place.path("scene.toml"), settings).scene, 1).peak_bytes / 1048576;
    EXPECT_GT(predicted, 0.5 * measured) << name;
    EXPECT_LT(predicted, 2 * measured) << name;
  }
}

TEST(CostCli, WhatTheMachineCannotHoldIsRefusedBeforeItBegins) {
  expect_refused(
      {"solver.method=orders", "solver.altitude_levels=400", "solver.phase_degree=64",
       "solver.zenith_step_deg=0.1", "aerosols.type=urban",
       "spectrum.wavelengths_nm=[400,405,410,415,420,425,430,435,440,445,450,455,460,465,"
       "470,475,480,485,490,495,500,505,510,515,520,525,530,535,540,545,550,555,560,565,"
       "570,575,580,585,590,595,600,605,610,615,620,625,630,635,640,645,650,655,660]"},
      {"MiB", "would fit", "solver.altitude_levels = "});
}

TEST(QualityCli, StepsNamedByTheFileWinOverItsQualityAndTheLineOverBoth) {
  const Workplace place;
  place.write("scene.toml",
              "quality = \"draft\"\n" + std::string(kScene) + "[solver]\naltitude_levels = 33\n");
  const std::string own = place.run({"render", "scene.toml", "--print-config"}).out;
  EXPECT_NE(own.find("method = \"orders\""), std::string::npos) << own;
  EXPECT_NE(own.find("altitude_levels = 33"), std::string::npos);
  EXPECT_NE(own.find("zenith_step_deg = 3\n"), std::string::npos);
  const std::string set =
      place.run({"render", "scene.toml", "--print-config", "--set", "quality=standard"}).out;
  EXPECT_NE(set.find("altitude_levels = 50"), std::string::npos);
  EXPECT_NE(set.find("zenith_step_deg = 1\n"), std::string::npos);
  const std::string both = place
                               .run({"render", "scene.toml", "--print-config", "--set",
                                     "quality=standard", "--set", "solver.altitude_levels=9"})
                               .out;
  EXPECT_NE(both.find("altitude_levels = 9\n"), std::string::npos);
}

TEST(QualityCli, HelpShowsWhatTheLevelsCost) {
  const Workplace place;
  const std::string help = place.run({"render", "--help"}).out;
  for (const char* word : {"draft", "standard", "high", "reference", "-12 deg"}) {
    EXPECT_NE(help.find(word), std::string::npos) << word;
  }
}

TEST(BudgetCli, PlanIsInSummaryAttributesAndConfig) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const std::vector<std::string> budget = {"--set", "budget.max_relative_error=0.1"};
  std::vector<std::string> arguments = {"render", "scene.toml", "-o", "sky.exr"};
  arguments.insert(arguments.end(), budget.begin(), budget.end());
  const Finished finished = place.run(arguments);
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_NE(finished.err.find("budget: left out"), std::string::npos) << finished.err;
  EXPECT_NE(finished.err.find("the Sun's disc"), std::string::npos) << finished.err;
  const auto attribute = [](const std::string& file, const char* name) {
    const Imf::InputFile image(file.c_str());
    const auto* text = image.header().findTypedAttribute<Imf::StringAttribute>(name);
    return text == nullptr ? std::string() : text->value();
  };
  const std::string image = place.path("sky.exr").string();
  EXPECT_NE(attribute(image, "budget.left_out").find("the Sun's disc"), std::string::npos);
  EXPECT_NE(attribute(image, "budget.estimated_error").find("%"), std::string::npos);
  EXPECT_EQ(attribute(image, "sun.disc_average"), "false");

  // The printed scene is the one that ran.
  arguments = {"render", "scene.toml", "--print-config"};
  arguments.insert(arguments.end(), budget.begin(), budget.end());
  place.write("plan.toml", place.run(arguments).out);
  const Finished again = place.run({"render", "plan.toml", "-o", "again.exr", "--quiet"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  for (const char* name : {"sun.disc_average", "solver.altitude_levels", "spectrum.solved_nm",
                           "solver.darkest_zenith_deg", "atmosphere.top_km"}) {
    EXPECT_EQ(attribute(place.path("again.exr").string(), name), attribute(image, name)) << name;
  }
  const auto radiance = [&](const std::string& scene) {
    return place.run({"radiance", scene, "--view", "60,90", "--quiet", "--set", "solver.threads=1"})
        .out;
  };
  EXPECT_EQ(radiance("plan.toml"), radiance("plan.toml"));
}

}  // namespace
}  // namespace twilight
