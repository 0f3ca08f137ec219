// twilight fit: coefficients from a scene or a study, and a sky rendered from them.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/cli/program_run.h"

namespace twilight {
namespace {

constexpr const char* kScene = R"([sun]
elevation_deg = 10
[atmosphere]
layers = 10
[aerosols]
type = "none"
[spectrum]
wavelengths_nm = [450, 600]
[solver]
zenith_step_deg = 3
altitude_levels = 8
polar_directions = 8
azimuth_directions = 4
scattering_orders = 2
sunlight_nodes = 64
)";

const std::vector<std::string> kFit = {"fit",     "perez", "scene.toml", "--suns",
                                       "-3,20,5", "-o",    "fit.json"};

TEST(CliFit, WritesCoefficientsAndTheirGoodness) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const Finished fit = place.run(with(kFit, {"--quiet"}));
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_EQ(fit.err, "");
  EXPECT_EQ(place.names(), (std::set<std::string>{"scene.toml", "fit.json"}));
  const std::vector<std::string> lines = lines_of(fit.out);
  ASSERT_EQ(lines.size(), 1u + 3 * 3);  // three Suns of two wavelengths and luminance
  EXPECT_EQ(lines[0],
            "sun.elevation_deg,channel,rms_relative_error,p95_relative_error,"
            "largest_relative_error,relative_bias,converged,iterations,gradient_norm,bounds_hit");
  const auto json = nlohmann::json::parse(place.read("fit.json"));
  EXPECT_EQ(json["form"], "perez");
  EXPECT_EQ(json["axes"][0]["values"], (std::vector<double>{-3, 5, 20}));
  EXPECT_EQ(json["coefficients"].size(), 3u);
  EXPECT_EQ(json["coefficients"][2][1].size(), 5u);
  for (std::size_t n = 0; n < 3; ++n) {
    for (std::size_t w = 0; w < 2; ++w) {
      EXPECT_EQ(cells_of(lines[1 + 3 * n + w])[2],
                json["goodness"][n][w]["relative_error"]["rms"].dump());
    }
  }

  // The zenith of the rendered sky is the file's normalisation.
  place.write("fitted.toml", "[sun]\nelevation_deg = -3\n[solver]\nmethod = \"fit:fit.json\"\n");
  const Finished radiance = place.run({"radiance", "fitted.toml", "--view", "90,0", "--quiet"});
  ASSERT_EQ(radiance.exit_code, 0) << radiance.err;
  const double zenith = std::stod(cells_of(lines_of(radiance.out).at(1)).at(3));
  const double normalisation = json["normalisation"][0][0];
  EXPECT_NEAR(zenith / normalisation, 1, 1e-12);
  const Finished image =
      place.run({"render", "fitted.toml", "--set", "output.size=16", "-o", "sky.exr"});
  EXPECT_EQ(image.exit_code, 0) << image.err;
}

TEST(CliFit, TheFileDoesNotDependOnThreads) {
  const Workplace place;
  place.write("scene.toml", kScene);
  std::vector<std::string> files;
  for (const char* threads : {"1", "3"}) {
    const Finished fit = place.run(with(kFit, {"--threads", threads}));
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    files.push_back(place.read("fit.json"));
  }
  EXPECT_EQ(files[0], files[1]);
}

TEST(CliFit, StudiesHaveAxes) {
  const Workplace place;
  place.write("scene.toml", kScene);
  place.write("study.toml", R"(scene = "scene.toml"
[[axis]]
key = "earth.ground_albedo"
values = [0.8, 0.1]
[[axis]]
key = "sun.elevation_deg"
values = [20, -3]
)");
  const Finished fit = place.run({"fit", "hosek", "study.toml", "-o", "fit.json", "--quiet"});
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  const auto json = nlohmann::json::parse(place.read("fit.json"));
  EXPECT_EQ(json["nodes"], nlohmann::json({{0.1, -3}, {0.1, 20}, {0.8, -3}, {0.8, 20}}));
  EXPECT_EQ(json["coefficients"][0][0].size(), 9u);
  // A brighter ground makes a brighter sky.
  EXPECT_GT(json["normalisation"][3][0], json["normalisation"][1][0]);
}

TEST(CliFit, ASearchThatDidNotConvergeIsFlaggedAndFails) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const Finished fit = place.run(with(kFit, {"--iterations", "1", "--quiet"}));
  EXPECT_EQ(fit.exit_code, 1);
  EXPECT_NE(fit.err.find("did not converge; fit.json flags them"), std::string::npos) << fit.err;
  EXPECT_NE(fit.out.find(",false,"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(place.read("fit.json"))["converged"][0], false);
}

TEST(CliFit, BadInputIsRefusedBeforeTheRun) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const auto study = [&](const std::string& axis) {
    place.write("study.toml", "scene = \"scene.toml\"\n[[axis]]\n" + axis);
    return place.run({"fit", "perez", "study.toml", "-o", "fit.json", "--quiet"});
  };
  expect_refused(study("key = \"earth.albdo\"\nvalues = [1]\n"),
                 {"study.toml:3: key 'axis.key' = ", "earth.albdo"});
  expect_refused(study("key = \"earth.ground_albedo\"\nvalues = [2]\n"),
                 {"study.toml:3:", "earth.ground_albedo", "= 2: must be 0..1"});
  expect_refused(study("key = \"solver.phase_degree\"\nvalues = [8]\n"),
                 {"study.toml:3:", "must be sun.elevation_deg or a number in [earth]"});
  expect_refused(place.run({"fit", "perez", "scene.toml", "-o", "no/folder/fit.json"}),
                 {"cannot write no/folder/fit.json"});
  expect_refused(place.run({"fit", "perez", "scene.toml", "-o", "fit.txt"}), {"must end in .json"});
  expect_refused(place.run({"fit", "perez", "none.toml", "-o", "fit.json", "--quiet"}),
                 {"none.toml"});
  const Finished suns = place.run({"fit", "perez", "scene.toml", "-o", "f.json", "--suns", "95"});
  EXPECT_EQ(suns.exit_code, 2);
  EXPECT_NE(suns.err.find("-90..90"), std::string::npos) << suns.err;
  EXPECT_EQ(place.run({"fit", "cie", "scene.toml", "-o", "f.json"}).exit_code, 2);
  EXPECT_EQ(place.names(), (std::set<std::string>{"scene.toml", "study.toml"}));
}

TEST(CliFit, AMalformedFileIsRefused) {
  const Workplace place;
  place.write("bad.json", "{\"format\": \"twilight sky fit\", \"format_version\": 3}");
  place.write("fitted.toml", "[sun]\nelevation_deg = 3\n[solver]\nmethod = \"fit:bad.json\"\n");
  expect_refused(place.run({"irradiance", "fitted.toml", "--quiet"}),
                 {"bad.json: /format_version = 3: must be 1"});
  place.write("fitted.toml", "[sun]\nelevation_deg = 3\n[solver]\nmethod = \"fit:none.json\"\n");
  expect_refused(place.run({"irradiance", "fitted.toml", "--quiet"}),
                 {"fitted.toml:4: key 'solver.method'", "none.json"});
}

}  // namespace
}  // namespace twilight
