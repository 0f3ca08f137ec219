// twilight compare, as a user runs it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/program_run.h"

namespace twilight {
namespace {

using ::testing::HasSubstr;

const std::vector<std::string> kCoarse = {
    "--set", "aerosols.type=none",         "--set", "atmosphere.layers=12",
    "--set", "solver.zenith_step_deg=3",   "--set", "solver.altitude_levels=8",
    "--set", "solver.polar_directions=8",  "--set", "solver.azimuth_directions=4",
    "--set", "solver.azimuth_divisions=12"};

TEST(CliCompare, WritesTableAndPictures) {
  const Workplace place;
  const Finished run = place.run(
      with({"compare", "orders", "cells", "--suns", "10,-4", "-o", "out", "--picture-size", "32"},
           kCoarse));
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto lines = lines_of(run.out);
  ASSERT_EQ(lines.size(), 6u) << run.out;
  EXPECT_EQ(lines[0], "# differences from orders");
  EXPECT_THAT(lines[1], HasSubstr("sun_elevation_deg,sky,undefined"));
  EXPECT_TRUE(lines[3].starts_with("10,cells,,,")) << lines[3];
  EXPECT_THAT(run.err, HasSubstr("| cells |"));
  EXPECT_EQ(place.read("out/comparison.csv"), run.out);
  for (const char* name : {"sun_+10.0.png", "sun_-04.0.png", "comparison.svg"}) {
    EXPECT_TRUE(std::filesystem::exists(place.path("out") / name)) << name;
  }
}

TEST(CliCompare, RefusesBadInputAndLeavesNothing) {
  const Workplace place;
  expect_refused(place.run({"compare", "orders", "nishida", "-o", "out"}),
                 {"solver.method", "\"nishida\"", "must be one of"});
  expect_refused(place.run({"compare", "orders", "sky.exr", "-o", "out"}),
                 {"sky.exr", "no such image"});
  expect_refused(place.run({"compare", "orders", "cells", "--suns", "-30", "-o", "out"}),
                 {"--suns", "-30", "-18..90"});
  expect_refused(place.run({"compare", "orders", "cells", "--scene", "no.toml"}), {"no.toml"});
  EXPECT_NE(place.run({"compare", "orders"}).exit_code, 0);
  EXPECT_TRUE(place.names().empty());
}

}  // namespace
}  // namespace twilight
