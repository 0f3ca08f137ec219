// Fields solved once and looked up afterwards, and the columns that the other methods fill.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>

#include "tests/cli/program_run.h"

namespace twilight {
namespace {

// Coarse, but everything takes part: aerosol, ground, refraction, polarisation.
constexpr const char* kOrdersScene = R"([sun]
elevation_deg = -2
azimuth_deg = 250
[atmosphere]
layers = 12
[aerosols]
type = "continental_clean"
[spectrum]
wavelengths_nm = [450, 650]
[solver]
method = "orders"
zenith_step_deg = 3
altitude_levels = 8
polar_directions = 8
azimuth_directions = 4
phase_degree = 2
scattering_orders = 3
[output]
size = 16
)";

const std::vector<std::string> kViews = {"--view", "90,0", "--view", "10,45", "--view", "10,180"};

TEST(CliField, AnswersAsTheSolverDoes) {
  const Workplace place;
  place.write("scene.toml", kOrdersScene);
  const Finished solved = place.run({"solve", "scene.toml", "-o", "sky.nc"});
  ASSERT_EQ(solved.exit_code, 0) << solved.err;
  EXPECT_EQ(solved.out, "");
  EXPECT_NE(solved.err.find("sky.nc"), std::string::npos) << solved.err;
  EXPECT_EQ(place.names(), (std::set<std::string>{"scene.toml", "sky.nc"}));

  // Sun and observer are free.
  for (const char* change :
       {"sun.elevation_deg=12", "sun.elevation_deg=-9", "observer.height_m=400000"}) {
    SCOPED_TRACE(change);
    const std::vector<std::string> radiance =
        with(with({"radiance", "scene.toml", "--set", change}, kViews), {"--quiet"});
    const Finished direct = place.run(radiance);
    const Finished looked_up = place.run(with(radiance, {"--field", "sky.nc"}));
    ASSERT_EQ(direct.exit_code, 0) << direct.err;
    ASSERT_EQ(looked_up.exit_code, 0) << looked_up.err;
    EXPECT_EQ(looked_up.out, direct.out);
    EXPECT_EQ(lines_of(direct.out).size(), 7u);
  }
  EXPECT_EQ(place.run({"irradiance", "scene.toml", "--field", "sky.nc"}).out,
            place.run({"irradiance", "scene.toml"}).out);
  const Finished render = place.run({"render", "scene.toml", "--field", "sky.nc", "-o", "a.exr"});
  ASSERT_EQ(render.exit_code, 0) << render.err;
  ASSERT_EQ(place.run({"render", "scene.toml", "-o", "b.exr"}).exit_code, 0);
  EXPECT_TRUE(place.read("a.exr") == place.read("b.exr"));
}

TEST(CliField, BytesDoNotDependOnThreads) {
  const Workplace place;
  place.write("scene.toml", kOrdersScene);
  for (const char* threads : {"1", "2"}) {
    const Finished finished = place.run({"solve", "scene.toml", "--threads", threads, "-o",
                                         std::string(threads) + ".nc", "--quiet"});
    ASSERT_EQ(finished.exit_code, 0) << finished.err;
    EXPECT_EQ(finished.err, "");
  }
  EXPECT_TRUE(place.read("1.nc") == place.read("2.nc"));
}

TEST(CliField, AnotherSceneIsRefusedBeforeAnythingIsWritten) {
  const Workplace place;
  place.write("scene.toml", kOrdersScene);
  ASSERT_EQ(place.run({"solve", "scene.toml", "-o", "sky.nc"}).exit_code, 0);
  place.write("cut.nc", place.read("sky.nc").substr(0, place.read("sky.nc").size() - 1000));
  const std::set<std::string> before = place.names();
  // Every command asks the same reader: the first case goes through all of them.
  const std::pair<std::vector<std::string>, std::vector<std::string>> cases[] = {
      {{"--field", "sky.nc", "--set", "earth.ground_albedo=0.3"},
       {"sky.nc", "'earth.ground_albedo'", "0.1", "0.3"}},
      {{"--field", "sky.nc", "--set", "atmosphere.ozone_du=400"},
       {"sky.nc", "'atmosphere.ozone_du'", "auto", "400"}},
      {{"--field", "sky.nc", "--set", "solver.zenith_step_deg=2"},
       {"sky.nc", "'solver.zenith_step_deg'", "3", "2"}},
      {{"--field", "sky.nc", "--set", "earth.radius_km=6400"},
       {"sky.nc", "'earth.radius_km'", "6371", "6400"}},
      {{"--field", "sky.nc", "--set", "solver.method=cells"},
       {"sky.nc", "'solver.method'", "\"cells\"", "\"orders\""}},
      {{"--field", "cut.nc"}, {"cut.nc", "variable '"}},
  };
  std::vector<std::vector<std::string>> commands = {{"render", "scene.toml"},
                                                    {"irradiance", "scene.toml"},
                                                    {"radiance", "scene.toml", "--view", "90,0"}};
  for (const auto& [arguments, fragments] : cases) {
    for (const std::vector<std::string>& command : commands) {
      const Finished finished = place.run(with(command, arguments));
      expect_refused(finished, fragments);
      EXPECT_EQ(place.names(), before);
    }
    commands.resize(1);
  }
}

TEST(CliField, InterruptLeavesNothing) {
  const Workplace place;
  place.write("scene.toml", kOrdersScene);
  const Finished finished = place.run_and_signal(
      {"solve", "scene.toml", "-o", "sky.nc", "--set", "solver.zenith_step_deg=0.2", "--set",
       "solver.altitude_levels=200", "--set", "solver.polar_directions=64"},
      SIGINT);
  EXPECT_EQ(finished.exit_code, 130) << finished.err;
  EXPECT_EQ(place.names(), (std::set<std::string>{"scene.toml"}));
}

// Columns I, standard error, degree, Q, U of every row.
struct Light {
  std::vector<std::string> cells;
  double number(std::size_t column) const { return std::stod(cells.at(column)); }
};

std::vector<Light> light_of(const Finished& finished) {
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  std::vector<Light> rows;
  const std::vector<std::string> lines = lines_of(finished.out);
  for (std::size_t i = 1; i < lines.size(); ++i) rows.push_back({cells_of(lines[i])});
  return rows;
}

TEST(CliRadiance, PolarisedMethodsFillTheStokesColumns) {
  const Workplace place;
  place.write("scene.toml", kOrdersScene);
  for (const char* method : {"solver.method=orders", "solver.method=monte-carlo"}) {
    SCOPED_TRACE(method);
    const std::vector<std::string> command =
        with({"radiance", "scene.toml", "--set", method, "--set", "solver.photons=300"}, kViews);
    const std::vector<Light> rows = light_of(place.run(command));
    ASSERT_EQ(rows.size(), 6u);
    const bool noisy = std::string(method) == "solver.method=monte-carlo";
    for (const Light& row : rows) {
      ASSERT_EQ(row.cells.size(), 8u);
      const double i = row.number(3), degree = row.number(5), q = row.number(6), u = row.number(7);
      EXPECT_GT(i, 0);
      if (noisy)
        EXPECT_GT(row.number(4), 0);
      else
        EXPECT_EQ(row.cells[4], "");
      EXPECT_NEAR(degree, std::hypot(q, u) / i, 1e-12);
      EXPECT_LE(degree, 1 + 1e-12);
    }
    // At the zenith the Sun stands some 92 degrees away: strongly polarised.
    EXPECT_GT(rows[0].number(5), 0.3);

    const std::vector<Light> scalar =
        light_of(place.run(with(command, {"--set", "solver.polarisation=false"})));
    ASSERT_EQ(scalar.size(), 6u);
    for (const Light& row : scalar) {
      for (std::size_t empty = 5; empty < 8; ++empty) EXPECT_EQ(row.cells[empty], "");
    }
  }
}

TEST(CliRadiance, MonteCarloRepeatsItself) {
  const Workplace place;
  place.write("scene.toml", kOrdersScene);
  const auto run = [&](const char* threads, const char* seed) {
    return place
        .run(with({"radiance", "scene.toml", "--set", "solver.method=monte-carlo", "--set",
                   "solver.photons=200", "--threads", threads, "--set", seed},
                  kViews))
        .out;
  };
  const std::string once = run("1", "solver.seed=5");
  EXPECT_EQ(lines_of(once).size(), 7u);
  EXPECT_EQ(run("2", "solver.seed=5"), once);
  EXPECT_NE(run("1", "solver.seed=6"), once);
}

}  // namespace
}  // namespace twilight
