// Scene files: what is written is what is read; every mistake is named with its place.
#include "sim/scene_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <set>

namespace twilight {
namespace {

namespace fs = std::filesystem;

// A folder of its own per test, so that tests may run side by side.
class SceneFile : public ::testing::Test {
 protected:
  void SetUp() override {
    static std::atomic<int> count{0};
    folder_ = fs::temp_directory_path() /
              ("twilight-scene-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& text, const std::string& name = "scene.toml") const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }

  LoadedScene load(const std::string& text, const std::vector<std::string>& set = {}) const {
    return load_scene(write(text), set);
  }

  // The complaint about a bad scene must hold every fragment.
  void expect_refused(const std::string& text, const std::vector<std::string>& fragments,
                      const std::vector<std::string>& set = {}) const {
    try {
      load(text, set);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const std::invalid_argument& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      for (const std::string& fragment : fragments)
        EXPECT_NE(message.find(fragment), std::string::npos)
            << "'" << fragment << "' is not in: " << message;
    }
  }

  fs::path folder_;
};

// Two layers at two wavelengths.
constexpr const char* kLayers =
    "bottom_km,top_km,wavelength_nm,air_scattering_per_km,aerosol_scattering_per_km,"
    "aerosol_asymmetry,absorption_per_km\n"
    "0,10,450,0.02,0,0,0\n10,60,450,0.002,0,0,0\n"
    "0,10,550,0.01,0,0,0\n10,60,550,0.001,0,0,0\n";
constexpr const char* kSun = "[sun]\nelevation_deg = -4\n";

TEST_F(SceneFile, PlaceTimeAndEveryTypeAreRead) {
  const Scene scene = load(R"(
[observer]
latitude_deg = 49.25
longitude_deg = 7          # an integer where a real number is meant
time = 2003-12-08T17:00:00+01:00
[atmosphere]
layers = 50
refraction = false
ozone_du = "auto"
depolarisation = "king"
[spectrum]
wavelengths_nm = [400, 550.5, 700]
[output]
projection = "latlong"
)")
                          .scene;
  EXPECT_EQ(scene.observer.latitude_deg, 49.25);
  EXPECT_EQ(scene.observer.longitude_deg, 7.0);
  EXPECT_EQ(scene.observer.time, "2003-12-08T17:00:00+01:00");
  EXPECT_EQ(scene.atmosphere.layers, 50);
  EXPECT_FALSE(scene.atmosphere.refraction);
  EXPECT_FALSE(scene.atmosphere.ozone_du.has_value());
  EXPECT_FALSE(scene.atmosphere.depolarisation.has_value());
  EXPECT_EQ(scene.spectrum.wavelengths_nm, (std::vector<double>{400, 550.5, 700}));
  EXPECT_EQ(scene.output.projection, "latlong");
}

TEST_F(SceneFile, TimeMayBeAString) {
  const std::string place = "[observer]\nlatitude_deg = 1\nlongitude_deg = 2\n";
  EXPECT_EQ(load(place + "time = \"2003-12-08T17:00:00+01:00\"\n").scene.observer.time,
            load(place + "time = 2003-12-08T17:00:00+01:00\n").scene.observer.time);
}

TEST_F(SceneFile, PrintedSceneReadsBackTheSame) {
  const std::string texts[] = {
      kSun,
      "[observer]\nlatitude_deg = 49.25\nlongitude_deg = 6.97\n"
      "time = 2003-12-08T17:00:00.25+01:00\n",
      "[sun]\nelevation_deg = 0.1\nazimuth_deg = 271.3\nspectrum = \"unit\"\n"
      "[earth]\nradius_km = 6371\n[atmosphere]\nozone_du = 312.7\ndepolarisation = 0\n"
      "[aerosols]\noptical_depth_550nm = 0.30000000000000004\n"
      "[solver]\nthreads = 2\ncell_height_km = 1e-5\n",
      "[sun]\nelevation_deg = -6\ndisc_average = false\n"
      "[earth]\nalbedo_wavelengths_nm = [400, 700.5]\nalbedo_spectrum = [0, 0.1]\n"
      "[atmosphere]\nnitrogen_dioxide_du = 0.2\nrefractive_spreading = false\n"
      "[aerosols]\nphase = \"mie\"\n"
      "[solver]\nmethod = \"orders\"\nscattering_orders = 200\npolarisation = true\n"
      "zenith_step_deg = 0.1\naltitude_levels = 4\npolar_directions = 8\n"
      "azimuth_directions = 64\nphase_degree = 64\norder_tolerance = 1e-8\n"
      "single_precision = false\nview_interpolation = false\n",
      "[observer]\nheight_m = 4e7\n[sun]\nelevation_deg = -6\ndisc_average = \"auto\"\n"
      "[atmosphere]\nnitrogen_dioxide_du = \"auto\"\n[aerosols]\nphase = \"auto\"\n"
      "[solver]\nmethod = \"monte-carlo\"\nscattering_orders = \"auto\"\n"
      "polarisation = \"auto\"\nphotons = 1e10\nseed = 2147483647\n"
      "target_relative_error = 1e-5\n",
  };
  for (const std::string& text : texts) {
    const LoadedScene first = load(text);
    const std::string printed = to_toml(first.scene);
    const LoadedScene second = load(printed);
    EXPECT_EQ(to_toml(second.scene), printed);
    EXPECT_EQ(scene_settings(second.scene), scene_settings(first.scene));
  }
}

// "auto" takes back what the file says, whatever the key's type.
TEST_F(SceneFile, AutoLeavesAKeyUnset) {
  const std::string text =
      "[sun]\nelevation_deg = -6\ndisc_average = false\n[atmosphere]\n"
      "nitrogen_dioxide_du = 0.2\n[aerosols]\nphase = \"henyey-greenstein\"\n"
      "[solver]\nmethod = \"orders\"\nscattering_orders = 3\npolarisation = false\n"
      "photons = 1000\n";
  const Scene given = load(text).scene;
  EXPECT_EQ(given.sun.disc_average, false);
  EXPECT_EQ(given.atmosphere.nitrogen_dioxide_du, 0.2);
  EXPECT_EQ(given.aerosols.phase, "henyey-greenstein");
  EXPECT_EQ(given.solver.scattering_orders, 3);
  EXPECT_EQ(given.solver.polarisation, false);
  EXPECT_EQ(given.solver.photons, 1000);
  const Scene unset = load(text, {"sun.disc_average=auto", "atmosphere.nitrogen_dioxide_du=auto",
                                  "aerosols.phase=auto", "solver.scattering_orders=auto",
                                  "solver.polarisation=\"auto\"", "solver.photons=auto"})
                          .scene;
  EXPECT_FALSE(unset.sun.disc_average || unset.atmosphere.nitrogen_dioxide_du ||
               unset.aerosols.phase || unset.solver.scattering_orders ||
               unset.solver.polarisation || unset.solver.photons);
  expect_refused(text, {"--set", "solver.scattering_orders", "= 2.5", "an integer or \"auto\""},
                 {"solver.scattering_orders=2.5"});
  expect_refused(text, {"--set", "solver.polarisation", "yes", "true or false or \"auto\""},
                 {"solver.polarisation=yes"});
}

TEST_F(SceneFile, PathsWithQuotesAndBackslashesReadBackTheSame) {
  write(kLayers, "a\"b\\c.csv");
  const LoadedScene first =
      load(std::string(kSun) + "[atmosphere]\noptical_layers = 'a\"b\\c.csv'\n");
  const LoadedScene second = load(to_toml(first.scene));
  EXPECT_EQ(first.scene.atmosphere.optical_layers, (folder_ / "a\"b\\c.csv").string());
  EXPECT_EQ(second.scene.atmosphere.optical_layers, first.scene.atmosphere.optical_layers);
}

// Catches a key listed twice or pointing at another key's member.
TEST_F(SceneFile, EveryKeyHasItsOwnMember) {
  Scene scene;
  std::set<std::string_view> names;
  std::set<const void*> members;
  for (const SceneKey& key : scene_keys()) {
    EXPECT_TRUE(names.insert(key.name).second) << key.name;
    const void* member = std::visit([](auto* pointer) { return static_cast<const void*>(pointer); },
                                    key.field(scene));
    EXPECT_TRUE(members.insert(member).second) << key.name;
    EXPECT_FALSE(key.doc.empty()) << key.name;
  }
}

TEST_F(SceneFile, UnknownKeyIsNamedWithItsLineAndTheNearestKnownOne) {
  expect_refused(std::string(kSun) + "[solver]\nazimut_divisions = 72\n",
                 {"scene.toml:4: key 'solver.azimut_divisions' = 72", "unknown key",
                  "did you mean 'solver.azimuth_divisions'?"});
  expect_refused(std::string(kSun) + "[observer]\nground_albedo = 0.1\n",
                 {"scene.toml:4", "did you mean 'earth.ground_albedo'?"});
  expect_refused(std::string(kSun) + "[solvr]\nthreads = 1\n",
                 {"scene.toml:3: key 'solvr'", "unknown table", "[solver]"});
  expect_refused("layers = 5\n" + std::string(kSun),
                 {"scene.toml:1: key 'layers' = 5", "atmosphere.layers"});
}

TEST_F(SceneFile, WrongTypeIsNamedWithItsLine) {
  const std::string sun = kSun;
  expect_refused(sun + "[solver]\nazimuth_divisions = \"many\"\n",
                 {"scene.toml:4: key 'solver.azimuth_divisions' = ", "many", "integer", "4..360"});
  expect_refused(sun + "[solver]\nazimuth_divisions = 72.5\n", {":4:", "72.5", "integer"});
  expect_refused(sun + "[solver]\nazimuth_divisions = 99999999999\n", {":4:", "99999999999"});
  expect_refused(sun + "[earth]\nground_albedo = true\n", {":4:", "true", "number", "0..1"});
  expect_refused(sun + "[earth]\nradius_km = \"big\"\n", {":4:", "big", "or \"auto\""});
  expect_refused(sun + "[atmosphere]\nrefraction = 1\n", {":4:", "= 1:", "true or false"});
  expect_refused(sun + "[output]\nprojection = 3\n", {":4:", "= 3:", "string"});
  expect_refused(sun + "[spectrum]\nwavelengths_nm = 550\n", {":4:", "array"});
  expect_refused(sun + "[spectrum]\nwavelengths_nm = [500, \"x\"]\n", {":4:", "value 2 of 2"});
  expect_refused(sun + "[observer]\ntime = 12:30:00\n", {":4:", "offset date-time"});
  expect_refused("solver = 3\n" + sun, {"scene.toml:1: key 'solver' = 3", "table"});
  expect_refused(sun + "[[solver]]\nthreads = 1\n", {":3:", "'solver'", "table"});
  expect_refused(sun + "[solver.threads]\nn = 1\n", {":3:", "'solver.threads'", "a table"});
}

TEST_F(SceneFile, NumbersAreFinite) {
  for (const char* bad : {"nan", "-nan", "inf", "-inf"}) {
    expect_refused(std::string("[sun]\nelevation_deg = ") + bad + "\n",
                   {"scene.toml:2: key 'sun.elevation_deg'", "finite", "-90..90"});
    expect_refused(std::string(kSun) + "[spectrum]\nwavelengths_nm = [400, " + bad + "]\n",
                   {":4:", "finite", "value 2 of 2"});
  }
}

TEST_F(SceneFile, RangeIsCheckedAgainstTheLineOfTheKey) {
  expect_refused(std::string(kSun) + "[solver]\n\nazimuth_divisions = 7\n",
                 {"scene.toml:5: key 'solver.azimuth_divisions' = 7: must be even, 4..360"});
  expect_refused(std::string(kSun) + "[atmosphere]\nlayers = -3\n",
                 {"scene.toml:4: key 'atmosphere.layers' = -3: must be 1..500"});
}

TEST_F(SceneFile, SyntaxErrorIsNamedWithItsLine) {
  expect_refused(std::string(kSun) + "[solver\n", {"scene.toml:3: not valid TOML"});
  expect_refused(std::string(kSun) + "elevation_deg = 1\n", {"scene.toml:3: not valid TOML"});
}

TEST_F(SceneFile, MissingFileIsNamed) {
  for (const fs::path& path : {folder_ / "absent.toml", folder_}) {
    try {
      load_scene(path);
      ADD_FAILURE();
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos);
    }
  }
}

TEST_F(SceneFile, OverridesWinAndAreTypedAsToml) {
  const Scene scene =
      load(std::string(kSun) + "[solver]\nthreads = 1\n",
           {"solver.threads=2", "solver.threads=3", "spectrum.wavelengths_nm=[400,500]",
            "sun.spectrum=\"unit\"", "output.projection=octahedral", "earth.radius_km=6371"})
          .scene;
  EXPECT_EQ(scene.solver.threads, 3);
  EXPECT_EQ(scene.spectrum.wavelengths_nm, (std::vector<double>{400, 500}));
  EXPECT_EQ(scene.sun.spectrum, "unit");
  EXPECT_EQ(scene.output.projection, "octahedral");
  EXPECT_EQ(scene.earth.radius_km, 6371.0);
  EXPECT_FALSE(load(kSun, {"earth.radius_km=6371", "earth.radius_km=auto"})
                   .scene.earth.radius_km.has_value());
}

TEST_F(SceneFile, OverrideTakesADateTime) {
  const Scene scene = load("", {"observer.latitude_deg=49.25", "observer.longitude_deg=6.97",
                                "observer.time=2003-12-08T17:00:00+01:00"})
                          .scene;
  EXPECT_EQ(scene.observer.time, "2003-12-08T17:00:00+01:00");
}

TEST_F(SceneFile, BadOverrideIsNamed) {
  expect_refused(kSun,
                 {"--set solver.azimuth_divisions=7: key 'solver.azimuth_divisions' = 7", "4..360"},
                 {"solver.azimuth_divisions=7"});
  expect_refused(kSun, {"--set solver.stripes=7", "unknown key"}, {"solver.stripes=7"});
  expect_refused(kSun, {"--set solver.threads", "KEY=VALUE"}, {"solver.threads"});
  expect_refused(kSun, {"--set solver.threads=", "KEY=VALUE"}, {"solver.threads="});
  expect_refused(kSun, {"--set solver.threads=[1", "not valid TOML"}, {"solver.threads=[1"});
  expect_refused(kSun, {"solver.threads", "one value"}, {"solver.threads=1\nx = 2"});
  expect_refused(kSun, {"solver.threads", "two", "integer"}, {"solver.threads=two"});
  expect_refused(kSun, {"sun.elevation_deg", "finite"}, {"sun.elevation_deg=nan"});
}

TEST_F(SceneFile, PlaceAndElevationExcludeEachOther) {
  const std::string place =
      "[observer]\nlatitude_deg = 49.25\nlongitude_deg = 6.97\ntime = 2003-12-08T17:00:00+01:00\n";
  expect_refused(place + kSun, {"scene.toml:6: key 'sun.elevation_deg' = -4", "not both"});
  expect_refused(place + "[sun]\nazimuth_deg = 90\n",
                 {"scene.toml:6: key 'sun.azimuth_deg' = 90", "sun.elevation_deg"});
  expect_refused("[observer]\nlatitude_deg = 49.25\nlongitude_deg = 6.97\n",
                 {"scene.toml: key 'observer.time' is missing"});
  expect_refused("", {"scene.toml: key 'sun.elevation_deg' is missing"});
}

TEST_F(SceneFile, OpticalLayersAreFoundBesideTheFile) {
  write(kLayers, "layers.csv");
  const Scene scene =
      load(std::string(kSun) + "[atmosphere]\noptical_layers = \"layers.csv\"\n").scene;
  EXPECT_EQ(scene.atmosphere.optical_layers, (folder_ / "layers.csv").string());
  EXPECT_EQ(scene.atmosphere.depolarisation, 0.0);
  EXPECT_EQ(scene.spectrum.wavelengths_nm, (std::vector<double>{450, 550}));
  EXPECT_EQ(load(std::string(kSun) +
                 "[atmosphere]\noptical_layers = \"layers.csv\"\ndepolarisation = 0.03\n")
                .scene.atmosphere.depolarisation,
            0.03);
  expect_refused(std::string(kSun) + "[atmosphere]\noptical_layers = \"absent.csv\"\n",
                 {"scene.toml:4: key 'atmosphere.optical_layers' = \"absent.csv\"",
                  (folder_ / "absent.csv").string()});
}

TEST_F(SceneFile, OpticalLayersAreCheckedWhenTheSceneIsRead) {
  write(kLayers, "layers.csv");
  expect_refused(std::string(kSun) +
                     "[atmosphere]\noptical_layers = \"layers.csv\"\n"
                     "[spectrum]\nwavelengths_nm = [450, 500]\n",
                 {"scene.toml:6: key 'spectrum.wavelengths_nm' = 500", "450, 550"});
  std::string gap = kLayers;
  gap.replace(gap.find("10,60,550"), 9, "11,60,550");
  write(gap, "layers.csv");
  expect_refused(std::string(kSun) + "[atmosphere]\noptical_layers = \"layers.csv\"\n",
                 {"layers.csv:5", "11"});
}

}  // namespace
}  // namespace twilight
