// Tables for real-time renderers, as a user asks for them.
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "tests/cli/program_run.h"

namespace twilight {
namespace {

constexpr const char* kScene = R"([sun]
elevation_deg = 10
[atmosphere]
layers = 12
[aerosols]
type = "continental_clean"
[spectrum]
wavelengths_nm = [440, 550, 680]
[solver]
method = "orders"
zenith_step_deg = 3
altitude_levels = 8
polar_directions = 8
azimuth_directions = 4
phase_degree = 2
scattering_orders = 3
sunlight_nodes = 64
)";

std::vector<std::string> tables(const std::vector<std::string>& more) {
  return with({"tables", "scene.toml", "-o", "tables", "--scale", "0.12"}, more);
}

TEST(CliTables, WritesEveryTextureAndItsManifest) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const Finished run =
      place.run(tables({"--layout", "bruneton2017", "--half", "--check", "--suns", "30,0"}));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  // Scaled: nu 5, mu_s 4, mu 14, r 4; transmittance 31 x 8, irradiance 8 x 4.
  EXPECT_EQ(place.read("tables/scattering.dat").size(), 5U * 4 * 14 * 4 * 16);
  EXPECT_EQ(place.read("tables/transmittance.dat").size(), 31U * 8 * 16);
  EXPECT_EQ(place.read("tables/irradiance.dat").size(), 8U * 4 * 16);
  EXPECT_EQ(place.read("tables/scattering.half.exr").substr(0, 4), "\x76\x2f\x31\x01");
  const auto manifest = nlohmann::json::parse(place.read("tables/manifest.json"));
  EXPECT_EQ(manifest.at("layout"), "bruneton2017");
  EXPECT_EQ(manifest.at("textures").size(), 3U);
  EXPECT_GT(manifest.at("mie_phase_function_g"), 0.3);
  EXPECT_EQ(manifest.at("relative_errors").size(), 4U);
  EXPECT_EQ(lines_of(run.out).size(), 5U);
  EXPECT_EQ(place.read("tables/errors.csv"), run.out);
}

TEST(CliTables, HillaireHasItsOwnTables) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const Finished run = place.run(
      tables({"--layout", "hillaire2020", "--spectrum", "wavelengths", "--suns", "5,-6"}));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto manifest = nlohmann::json::parse(place.read("tables/manifest.json"));
  EXPECT_EQ(manifest.at("channel_wavelengths_nm"), (std::vector<double>{680, 550, 440}));
  EXPECT_EQ(place.read("tables/multiple_scattering.dat").size(), 4U * 4 * 16);
  EXPECT_EQ(place.read("tables/sky_view_-6.dat").size(), 23U * 13 * 16);
}

TEST(CliTables, RefuseBadInput) {
  const Workplace place;
  place.write("scene.toml", kScene);
  place.write("file", "");
  expect_refused(place.run(tables({"--layout", "hosek"})), {"--layout hosek", "bruneton2017"});
  expect_refused(place.run(tables({"--layout", "bruneton2017", "--suns", "95"})),
                 {"--suns 95", "-90..90"});
  expect_refused(place.run(tables({"--layout", "bruneton2017", "--spectrum", "cmyk"})),
                 {"--spectrum cmyk", "wavelengths"});
  expect_refused(place.run(tables({"--layout", "bruneton2008", "--mu-s-min-deg", "108"})),
                 {"--mu-s-min-deg"});
  expect_refused(
      place.run(tables({"--layout", "bruneton2017", "--set", "solver.method=\"cells\""})),
      {"solver.method", "orders"});
  expect_refused(place.run({"tables", "scene.toml", "--layout", "bruneton2017", "-o", "file/in"}),
                 {"file/in"});
  EXPECT_EQ(place.names(), (std::set<std::string>{"file", "scene.toml"}));
}

TEST(CliTables, StoppedLeavesNothing) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const Finished run =
      place.run_and_signal({"tables", "scene.toml", "-o", "tables", "--layout", "bruneton2017"},
                           SIGINT, "scattering table");
  EXPECT_EQ(run.exit_code, 130);
  EXPECT_EQ(place.names(), (std::set<std::string>{"scene.toml"}));
}

}  // namespace
}  // namespace twilight
