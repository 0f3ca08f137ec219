// The published models, as a user runs them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/cli/program_run.h"

namespace twilight {
namespace {

using ::testing::HasSubstr;

constexpr const char* kScene = R"([sun]
elevation_deg = 20
[atmosphere]
layers = 20
[spectrum]
wavelengths_nm = [400, 550, 700]
[bruneton]
scattering_size = [4, 16, 8, 4]
polar_directions = 8
azimuth_directions = 4
[output]
size = 16
)";

class CliModels : public ::testing::TestWithParam<const char*> {
 protected:
  CliModels() { place_.write("scene.toml", kScene); }
  std::vector<std::string> of(const std::string& command,
                              const std::vector<std::string>& more = {}) {
    return with({command, "scene.toml", "--set", std::string("solver.method=") + GetParam()}, more);
  }
  const Workplace place_;
};

TEST_P(CliModels, AnswersEveryCommand) {
  const Finished render = place_.run(of("render", {"-o", "sky.exr", "--preview", "sky.png"}));
  ASSERT_EQ(render.exit_code, 0) << render.err;
  EXPECT_EQ(place_.names(), (std::set<std::string>{"scene.toml", "sky.exr", "sky.png"}));

  const Finished radiance = place_.run(of("radiance", {"--view", "90,0", "--view", "-30,10"}));
  ASSERT_EQ(radiance.exit_code, 0) << radiance.err;
  const auto lines = lines_of(radiance.out);
  ASSERT_EQ(lines.size(), 7u);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    EXPECT_GT(std::stod(cells_of(lines[i])[3]), 0.0) << lines[i];  // sky and ground shine
  }

  const Finished irradiance = place_.run(of("irradiance"));
  ASSERT_EQ(irradiance.exit_code, 0) << irradiance.err;
  for (const std::string& line : lines_of(irradiance.out)) {
    const auto cells = cells_of(line);
    if (cells[0] == "wavelength_nm") continue;
    EXPECT_NEAR(std::stod(cells[1]) + std::stod(cells[2]), std::stod(cells[3]), 1e-12);
    EXPECT_GT(std::stod(cells[2]), 0.0);
  }
}

TEST_P(CliModels, AerialPerspectiveOrAClearWord) {
  const Finished run =
      place_.run(of("aerial", {"--view", "2,90", "--distance", "0", "--distance", "10"}));
  if (std::string(GetParam()).starts_with("cie")) {
    expect_refused(run, {"scene.toml", "solver.method", GetParam(), "aerial perspective"});
    return;
  }
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto lines = lines_of(run.out);
  ASSERT_EQ(lines.size(), 7u);
  for (std::size_t i = 1; i < 4; ++i) {  // no air between
    EXPECT_NEAR(std::stod(cells_of(lines[i])[4]), 1.0, 1e-12);
    EXPECT_NEAR(std::stod(cells_of(lines[i])[5]), 0.0, 1e-12);
    EXPECT_LT(std::stod(cells_of(lines[i + 3])[4]), 1.0);
    EXPECT_GT(std::stod(cells_of(lines[i + 3])[5]), 0.0);
  }
}

TEST_P(CliModels, AnUndefinedSunIsRefusedOrClampedAndRecorded) {
  const std::string method = GetParam();
  const std::vector<std::string> low = {"--set", "sun.elevation_deg=-15", "-o", "low.exr"};
  const Finished run = place_.run(of("render", low));
  if (method == "nishita") {  // knows every Sun
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return;
  }
  expect_refused(run, {"scene.toml", "sun.elevation_deg", "-15", "models.out_of_range"});
  EXPECT_EQ(place_.names(), (std::set<std::string>{"scene.toml"}));
  const Finished clamped =
      place_.run(of("render", with(low, {"--set", "models.out_of_range=clamp"})));
  ASSERT_EQ(clamped.exit_code, 0) << clamped.err;
  EXPECT_THAT(clamped.err, HasSubstr("sun.elevation_deg"));
  EXPECT_THAT(place_.read("low.exr"), HasSubstr("clamped.sun.elevation_deg"));
}

// Polarisation, fields and budgets are the solvers'.
TEST_P(CliModels, RefusesWhatOnlySolversKnow) {
  expect_refused(place_.run(of("render", {"--set", "solver.polarisation=true"})),
                 {"solver.polarisation", GetParam(), "scalar"});
  expect_refused(place_.run(of("render", {"--set", "budget.max_seconds=2"})),
                 {"solver.method", GetParam(), "budget.max_seconds"});
  expect_refused(place_.run(of("solve")), {"solver.method", GetParam(), "no field"});
}

INSTANTIATE_TEST_SUITE_P(Cli, CliModels,
                         ::testing::Values("preetham", "cie-clear", "cie-overcast", "nishita",
                                           "hoffman-preetham", "bruneton"),
                         [](const auto& named) {
                           std::string name = named.param;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace twilight
