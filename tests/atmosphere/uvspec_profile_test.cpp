#include "atmosphere/uvspec_profile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "atmosphere/air.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using testing::HasSubstr;

constexpr double kBoltzmannHpaCm3PerK = 1.380649e-19;
const std::vector<double> kWavelengths_nm = {320, 450, 550, 800};

void expect_same(const LayerTable& a, const LayerTable& b, const Medium& m, double tolerance) {
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      EXPECT_NEAR(a(i, w), b(i, w), tolerance * std::abs(b(i, w))) << i << ' ' << w;
    }
  }
}

TEST(UvspecProfile, RoundTripOfEveryShippedProfileIsTheSameMedium) {
  const TemporaryFolder folder;
  for (const std::string_view name : Profile::names()) {
    AirOptions named;
    named.profile = name;
    const Profile profile = Profile::named(name);
    AirOptions from_file;
    // The exponential atmosphere is far from hydrostatic balance, not from p = n k T.
    from_file.profile_file =
        folder.write(std::string(name) + ".dat", uvspec_profile_text(profile)).string();
    const Medium a = make_air(from_file, kWavelengths_nm), b = make_air(named, kWavelengths_nm);
    ASSERT_EQ(a.layers(), b.layers());
    for (std::size_t i = 0; i <= a.layers(); ++i) {
      EXPECT_NEAR(a.boundary_km[i], b.boundary_km[i], 1e-9);
    }
    expect_same(a.air_scattering_per_km, b.air_scattering_per_km, b, 1e-9);
    expect_same(a.gas_absorption_per_km, b.gas_absorption_per_km, b, 1e-9);
    expect_same(a.refractivity, b.refractivity, b, 1e-9);
    for (std::size_t i = 0; i < a.layers(); ++i) {
      EXPECT_NEAR(a.temperature_k[i], b.temperature_k[i], 1e-9 * b.temperature_k[i]);
      EXPECT_NEAR(a.pressure_hpa[i], b.pressure_hpa[i], 1e-9 * b.pressure_hpa[i]);
    }
  }
}

TEST(UvspecProfile, LevelsAreReadAsTheyStand) {
  const TemporaryFolder folder;
  const Profile profile = read_uvspec_profile(folder.write(
      "own.dat",
      "# z p T air o3 o2 h2o co2 no2\n\n"
      " 10.000 265.0 223.3 8.595E+18 1.13E+12 1.797E+18 6.02E+14 2.84E+15 2.05E+08  # tropopause\n"
      "\t0.000 1013.0 288.2 2.546E+19 6.78E+11 5.32E+18 1.97E+17 8.4E+15 5.86E+08\r\n"));
  EXPECT_EQ(profile.name(), "own.dat");
  ASSERT_EQ(profile.levels().size(), 2u);
  const ProfileLevel ground = profile.levels()[0], top = profile.levels()[1];
  EXPECT_EQ(ground.height_km, 0.0);
  EXPECT_EQ(ground.pressure_hpa, 1013.0);
  EXPECT_EQ(ground.ozone_per_cm3, 6.78e11);
  EXPECT_EQ(ground.water_vapour_per_cm3, 1.97e17);
  EXPECT_EQ(ground.nitrogen_dioxide_per_cm3, 5.86e8);
  EXPECT_EQ(top.height_km, 10.0);
  EXPECT_EQ(top.temperature_k, 223.3);
  EXPECT_EQ(top.air_per_cm3, 8.595e18);
}

TEST(UvspecProfile, LeftOutAirFollowsFromPressureAndTemperatureAndOtherGasesAreNotThere) {
  const TemporaryFolder folder;
  const auto file = folder.write("three.dat", "60 0.22 247\n10 265 223.3\n0 1013 288.2\n");
  const Profile profile = read_uvspec_profile(file);
  for (const ProfileLevel& level : profile.levels()) {
    EXPECT_NEAR(level.air_per_cm3,
                level.pressure_hpa / (kBoltzmannHpaCm3PerK * level.temperature_k),
                1e-12 * level.air_per_cm3);
    EXPECT_EQ(level.ozone_per_cm3, 0.0);
    EXPECT_EQ(level.water_vapour_per_cm3, 0.0);
    EXPECT_EQ(level.nitrogen_dioxide_per_cm3, 0.0);
  }
  AirOptions options;
  options.profile_file = file.string();
  options.top_km = 60.0;
  const Medium bare = make_air(options, kWavelengths_nm);
  for (std::size_t i = 0; i < bare.layers(); ++i) EXPECT_EQ(bare.gas_absorption_per_km(i, 1), 0.0);
}

TEST(UvspecProfile, AWantedColumnOfAGasTheFileLacksHasTheShapeOfTheUsStandard) {
  const TemporaryFolder folder;
  AirOptions own, standard;
  own.profile_file =
      folder.write("three.dat", "60 0.22 247\n10 265 223.3\n0 1013 288.2\n").string();
  own.layer_spacing = standard.layer_spacing = "even";
  own.top_km = standard.top_km = 60.0;
  own.layers = standard.layers = 60;
  own.ozone_du = standard.ozone_du = 300.0;
  own.nitrogen_dioxide_du = standard.nitrogen_dioxide_du = 0.3;
  for (const char* optics : {"mean", "centre"}) {
    own.layer_optics = standard.layer_optics = optics;
    const Medium a = make_air(own, kWavelengths_nm), b = make_air(standard, kWavelengths_nm);
    expect_same(a.gas_absorption_per_km, b.gas_absorption_per_km, b, 1e-12);
  }
}

struct Malformed {
  const char* what;
  std::string text;
  const char* complaint;
};

TEST(UvspecProfile, RefusesWhatIsWrongNamingLineColumnAndValue) {
  const std::string ground = "0 1013 288.2\n";
  const Malformed cases[] = {
      {"empty", "", "fewer than 2 levels"},
      {"comments alone", "# z p T\n", "fewer than 2 levels"},
      {"one level", ground, "fewer than 2 levels"},
      {"two columns", "10 265\n" + ground, ":1: row has 2 columns"},
      {"ten columns", "10 265 223 1 1 1 1 1 1 1\n" + ground, ":1: row has 10 columns"},
      {"ragged", "10 265 223 8.595e18\n" + ground, ":2: row has 3 columns: must have 4"},
      {"a word", "10 abc 223\n" + ground, ":1: column 'p': value 'abc': must be a finite number"},
      {"not a number", "10 nan 223\n" + ground, ":1: column 'p': value 'nan'"},
      {"infinite", "10 265 inf\n" + ground, ":1: column 'T': value 'inf'"},
      {"comma as point", "10 265,1 223\n" + ground, ":1: column 'p': value '265,1'"},
      {"bottom first", ground + "10 265 223\n", ":2: column 'z': value '10': must be below"},
      {"height twice", "10 265 223\n10 266 223\n" + ground, ":2: column 'z': value '10'"},
      {"pressure rises", "10 265 223\n5 200 255\n" + ground, ":2: column 'p': value '200'"},
      {"zero pressure", "10 0 223\n" + ground, ":1: column 'p': value '0': must be above 0"},
      {"cold", "10 265 20\n" + ground, ":1: column 'T': value '20': must be 50..2000 K"},
      {"celsius", "10 265 -50\n" + ground, ":1: column 'T': value '-50'"},
      {"metres", "10000 265 223\n" + ground, ":1: column 'z': value '10000': must be 0..200"},
      {"below the sea", "10 265 223\n-0.1 1020 288\n", ":2: column 'z': value '-0.1'"},
      {"no ground", "10 265 223\n1 900 282\n", ":2: the last level, column 'z': value '1'"},
      {"low top", "0.5 955 285\n" + ground, "the first level, 0.5 km: must be 1..200 km"},
      {"not p = n k T", "10 265 223.3 8.0e18\n0 1013 288.2 2.546e19\n",
       ":1: column 'air': value '8.0e18': must be within 5 %"},
      {"no air", "10 265 223.3 0\n0 1013 288.2 2.546e19\n", ":1: column 'air': value '0'"},
      {"negative ozone", "10 265 223.3 8.595e18 -1\n0 1013 288.2 2.546e19 1\n",
       ":1: column 'O3': value '-1': must be 0"},
      {"more vapour than air", "10 265 223.3 8.595e18 0 0 9e18\n0 1013 288.2 2.546e19 0 0 0\n",
       ":1: column 'H2O': value '9e18': must be at most"},
  };
  const TemporaryFolder folder;
  for (const Malformed& c : cases) {
    const auto file = folder.write("bad.dat", c.text);
    try {
      read_uvspec_profile(file);
      ADD_FAILURE() << c.what << " was accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.string() + (c.complaint[0] == ':' ? "" : ":")))
          << c.what;
      EXPECT_THAT(error.what(), HasSubstr(c.complaint)) << c.what;
    }
  }
  EXPECT_THROW(read_uvspec_profile(folder.path / "none.dat"), std::runtime_error);
  EXPECT_THROW(read_uvspec_profile(folder.path), std::runtime_error);
}

TEST(UvspecProfile, AColumnThatFindsNoGasBelowTheTopIsRefused) {
  const TemporaryFolder folder;
  AirOptions options;
  options.profile_file = folder
                             .write("high.dat",
                                    "60 0.22 247 6.45e15 1e10\n30 12 226.5 3.837e17 0\n"
                                    "0 1013 288.2 2.546e19 0\n")
                             .string();
  options.top_km = 20.0;
  options.ozone_du = 300.0;
  EXPECT_THROW(make_air(options, kWavelengths_nm), std::invalid_argument);
  options.top_km = 60.0;
  EXPECT_NO_THROW(make_air(options, kWavelengths_nm));
}

TEST(ProfileOfLevels, RefusesLevelsThatAreNoAtmosphere) {
  const ProfileLevel ground{0, 1013, 288, 2.5e19, 0, 0, 0}, top{10, 265, 223, 8.6e18, 0, 0, 0};
  const auto with = [&](auto change) {
    ProfileLevel level = top;
    change(level);
    return std::vector<ProfileLevel>{ground, level};
  };
  EXPECT_NO_THROW(Profile::of_levels("x", {ground, top}));
  EXPECT_THROW(Profile::of_levels("x", {ground}), std::invalid_argument);
  EXPECT_THROW(Profile::of_levels("x", {top, ground}), std::invalid_argument);
  EXPECT_THROW(Profile::of_levels("x", {ground, ground}), std::invalid_argument);
  EXPECT_THROW(Profile::of_levels("x", with([](auto& l) { l.pressure_hpa = 0; })),
               std::invalid_argument);
  EXPECT_THROW(Profile::of_levels("x", with([](auto& l) { l.ozone_per_cm3 = -1; })),
               std::invalid_argument);
  EXPECT_THROW(Profile::of_levels("x", with([](auto& l) { l.temperature_k = INFINITY; })),
               std::invalid_argument);
}

}  // namespace
}  // namespace twilight
