// `twilight optics --export` and scenes with a profile of their own, as a user meets them.
#include <gtest/gtest.h>

#include <string>

#include "aerosols/component_optics.h"
#include "aerosols/particle_optics_file.h"
#include "atmosphere/netcdf_reader.h"
#include "atmosphere/profile.h"
#include "atmosphere/uvspec_profile.h"
#include "tests/cli/program_run.h"

namespace twilight {
namespace {

constexpr const char* kScene = R"([sun]
elevation_deg = 5
[atmosphere]
layers = 10
[aerosols]
type = "continental_clean"
[spectrum]
wavelengths_nm = [450, 550]
[solver]
method = "orders"
)";

std::string with_profile(const std::string& file, const std::string& more = "") {
  return std::string("[sun]\nelevation_deg = 5\n[atmosphere]\nlayers = 10\nprofile_file = \"") +
         file + "\"\n" + more +
         "[aerosols]\ntype = \"none\"\n[spectrum]\nwavelengths_nm = [450, 550]\n";
}

TEST(OpticsExport, WritesTheLayersAndNothingToStandardOutput) {
  const Workplace place;
  place.write("scene.toml", kScene);
  const Finished finished = place.run({"optics", "scene.toml", "--export", "air.nc"});
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_EQ(finished.out, "");
  const NetcdfReader file(place.path("air.nc"));
  EXPECT_EQ(file.size("height"), 10u);
  // The same figures as on standard output.
  const Finished printed = place.run({"optics", "scene.toml"});
  const auto cells = cells_of(lines_of(printed.out).at(1));
  EXPECT_EQ(std::stod(cells.at(8)), file.numbers("aerosol_scattering")[0]);
  EXPECT_EQ(std::stod(cells.at(7)), file.numbers("air_scattering")[0]);
  EXPECT_EQ(place.run({"optics", "scene.toml", "--export", "air.csv"}).exit_code, 0);
  EXPECT_EQ(place.names(),
            (std::set<std::string>{"scene.toml", "air.nc", "air.csv", "air.phase.csv"}));
}

TEST(OpticsExport, ComponentsAreWrittenOnePerFileAndReadBack) {
  const Workplace place;
  place.write("scene.toml", kScene);
  // One wavelength: coarse salt is slow.
  const Finished finished =
      place.run({"optics", "scene.toml", "--set", "spectrum.wavelengths_nm=[800]", "--export",
                 "c.csv", "--components"});
  EXPECT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_EQ(place.names().size(), 11u);
  const ParticleOptics waso = read_particle_optics(place.path("c_WASO.csv"));
  EXPECT_EQ(waso.relative_humidity_percent.size(), 8u);
  for (std::size_t h = 0; h < 8; ++h) {
    const ComponentOptics wanted =
        component_optics(AerosolComponent::kWaterSoluble, waso.relative_humidity_percent[h], 800.0);
    EXPECT_EQ(waso.optics[h].scattering_per_km, wanted.scattering_per_km);
  }
  EXPECT_EQ(read_particle_optics(place.path("c_SOOT.csv")).phase.size(), 1u);
}

TEST(OpticsExport, RefusesWhatItCannotWrite) {
  const Workplace place;
  place.write("scene.toml", kScene);
  expect_refused(place.run({"optics", "scene.toml", "--export", "air.txt"}),
                 {"--export air.txt", ".nc", ".csv"});
  expect_refused(place.run({"optics", "scene.toml", "--components"}), {"--components", "--export"});
  expect_refused(place.run({"optics", "scene.toml", "--export", "no/air.nc"}), {"no/air.nc"});
  EXPECT_EQ(place.names(), std::set<std::string>{"scene.toml"});
}

TEST(ProfileFile, IsFoundBesideTheSceneAndGivesTheSameAir) {
  const Workplace place;
  place.write("us.dat", uvspec_profile_text(Profile::named("us_standard")));
  place.write("own.toml", with_profile("us.dat"));
  std::string named = with_profile("us.dat");
  named.replace(named.find("profile_file = \"us.dat\""), 23, "profile = \"us_standard\"");
  place.write("named.toml", named);
  const Finished own = place.run({"optics", "own.toml"});
  const Finished standard = place.run({"optics", "named.toml"});
  EXPECT_EQ(own.exit_code, 0) << own.err;
  const auto a = lines_of(own.out), b = lines_of(standard.out);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 1; i < a.size(); ++i) {
    const auto left = cells_of(a[i]), right = cells_of(b[i]);
    for (std::size_t c = 0; c < left.size(); ++c) {
      EXPECT_NEAR(std::stod(left[c]), std::stod(right[c]), 1e-9 * std::abs(std::stod(right[c])));
    }
  }
  const Finished config = place.run({"optics", "own.toml", "--print-config"});
  EXPECT_NE(config.out.find("us.dat\""), std::string::npos);
}

TEST(ProfileFile, MistakesAreNamed) {
  const Workplace place;
  place.write("none.toml", with_profile("none.dat"));
  expect_refused(place.run({"optics", "none.toml"}),
                 {"none.toml:5", "atmosphere.profile_file", "none.dat"});
  place.write("bad.dat", "10 265 223.3\n0 1013 abc\n");
  place.write("bad.toml", with_profile("bad.dat"));
  expect_refused(place.run({"optics", "bad.toml"}), {"bad.dat:2", "column 'T'", "abc"});
  place.write("low.dat", "50 0.8 270\n0 1013 288.2\n");
  place.write("low.toml", with_profile("low.dat"));
  expect_refused(place.run({"optics", "low.toml"}), {"atmosphere.top_km", "= 100", "1..50"});
  place.write("top.toml", with_profile("low.dat", "top_km = 50\n"));
  EXPECT_EQ(place.run({"optics", "top.toml"}).exit_code, 0);
  place.write("two.toml", with_profile("low.dat", "top_km = 50\nprofile = \"bruneton2008\"\n"));
  expect_refused(place.run({"optics", "two.toml"}), {"atmosphere.profile_file", "bruneton2008"});
}

TEST(ProfileFile, AFieldKnowsWhetherTheProfileChanged) {
  const Workplace place;
  const Profile profile = Profile::named("us_standard");
  place.write("us.dat", uvspec_profile_text(profile));
  place.write("own.toml", with_profile("us.dat", "") +
                              "[solver]\nmethod = \"orders\"\nzenith_step_deg = 3\n"
                              "altitude_levels = 8\npolar_directions = 8\nazimuth_directions = 4\n"
                              "phase_degree = 2\n");
  const Finished solved = place.run({"solve", "own.toml", "-o", "field.nc"});
  ASSERT_EQ(solved.exit_code, 0) << solved.err;
  const std::vector<std::string> look = {"irradiance", "own.toml", "--field", "field.nc"};
  EXPECT_EQ(place.run(look).exit_code, 0);
  // The same levels under another name are the same air.
  place.write("same.dat", uvspec_profile_text(profile));
  EXPECT_EQ(place.run(with(look, {"--set", "atmosphere.profile_file=same.dat"})).exit_code, 0);
  place.write("us.dat", uvspec_profile_text(Profile::named("tropical")));
  expect_refused(place.run(look), {"field.nc", "another medium"});
}

}  // namespace
}  // namespace twilight
