// `twilight retrieve` as a user meets it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "tests/cli/program_run.h"

namespace twilight {
namespace {

using testing::HasSubstr;

const char* const kScene = R"(
[sun]
elevation_deg = -4
disc_average = false
[atmosphere]
layers = 20
ozone_du = 350
[aerosols]
type = "none"
[spectrum]
wavelengths_nm = [520, 600]
[solver]
method = "orders"
polarisation = false
zenith_step_deg = 3
altitude_levels = 10
polar_directions = 12
azimuth_directions = 4
phase_degree = 8
order_tolerance = 1e-2
sunlight_nodes = 64
darkest_zenith_deg = 104
)";

std::vector<std::string> retrieval(const std::string& free) {
  return {"retrieve",
          "sky.csv",
          "--scene",
          "scene.toml",
          "--free",
          free,
          "-o",
          "air",
          "--search",
          "scene",
          "--relative-error",
          "0.02",
          "--set",
          "atmosphere.ozone_du=250"};
}

// The program reads what it printed.
TEST(CliRetrieve, FindsTheOzoneOfItsOwnRadiances) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const Finished sky = place.run({"radiance", "scene.toml", "--view", "90,0", "--view", "15,0"});
  ASSERT_EQ(sky.exit_code, 0) << sky.err;
  place.write("sky.csv", sky.out);
  const Finished found = place.run(retrieval("atmosphere.ozone_du"));
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const std::vector<std::string> lines = lines_of(found.out);
  ASSERT_EQ(lines.size(), 2u) << found.out;
  EXPECT_EQ(lines[0], "key,value,standard_error,low_95,high_95,claimed,remark");
  const std::vector<std::string> cells = cells_of(lines[1]);
  EXPECT_EQ(cells[0], "atmosphere.ozone_du");
  EXPECT_NEAR(std::stod(cells[1]), 350, 1);
  EXPECT_EQ(cells[5], "yes");
  const auto json = nlohmann::json::parse(place.read("air/retrieval.json"));
  EXPECT_EQ(json["converged"], true);
  EXPECT_EQ(json["degrees_of_freedom"], 3);
  EXPECT_NEAR(json["parameters"][0]["value"].get<double>(), 350, 1);
  EXPECT_THAT(place.read("air/retrieved.toml"), HasSubstr("ozone_du = 3"));
  EXPECT_THAT(found.err, HasSubstr("start 1"));
  // The scene that it wrote is one.
  EXPECT_EQ(place.run({"sun", "air/retrieved.toml"}).exit_code, 0);

  // The same bytes again, with another number of threads.
  std::vector<std::string> again = with(retrieval("atmosphere.ozone_du"), {"--threads", "1"});
  again[7] = "again";
  ASSERT_EQ(place.run(again).exit_code, 0);
  EXPECT_EQ(place.read("again/residuals.csv"), place.read("air/residuals.csv"));

  // A search that may not take its steps has not converged, and its file says so.
  const Finished short_search =
      place.run(with(retrieval("atmosphere.ozone_du"), {"--iterations", "1", "--starts", "1"}));
  EXPECT_EQ(short_search.exit_code, 1);
  EXPECT_THAT(short_search.err, HasSubstr("did not converge"));
  EXPECT_EQ(nlohmann::json::parse(place.read("air/retrieval.json"))["converged"], false);
}

TEST(CliRetrieve, RefusesBadInputBeforeTheSearch) {
  const Workplace place;
  place.write("scene.toml", kScene);
  place.write("sky.csv",
              "view_elevation_deg,relative_azimuth_deg,wavelength_nm,radiance_w_m2_sr_nm\n"
              "90,0,550,0.01\n95,0,550,0.01\n");
  expect_refused(place.run(retrieval("atmosphere.ozone_du")), {"sky.csv:3", "view_elevation_deg"});
  expect_refused(place.run(retrieval("atmosphere.ozon_du")),
                 {"atmosphere.ozon_du", "did you mean 'atmosphere.ozone_du'"});
  EXPECT_EQ(place.names(), (std::set<std::string>{"scene.toml", "sky.csv"}));
}

TEST(CliRetrieve, CtrlCLeavesNothing) {
  const Workplace place;
  place.write("scene.toml", kScene);
  place.write("sky.csv",
              "view_elevation_deg,relative_azimuth_deg,wavelength_nm,radiance_w_m2_sr_nm\n"
              "90,0,550,0.01\n15,0,550,0.01\n");
  const Finished stopped = place.run_and_signal(retrieval("atmosphere.ozone_du"), SIGINT, "step 0");
  EXPECT_EQ(stopped.exit_code, 130);
  EXPECT_THAT(stopped.err, HasSubstr("nothing was written"));
  EXPECT_FALSE(std::filesystem::exists(place.path("air/retrieval.json")));
}

}  // namespace
}  // namespace twilight
