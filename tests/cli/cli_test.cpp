// The program as its users meet it: what it prints, writes and returns.
#include <OpenEXR/ImfArray.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <map>
#include <regex>

#include "tests/cli/program_run.h"

namespace twilight {
namespace {

// Small enough to be solved in no time.
constexpr const char* kSmallScene = R"([sun]
elevation_deg = -2
azimuth_deg = 250
[atmosphere]
layers = 10
[aerosols]
type = "none"
[spectrum]
wavelengths_nm = [450, 550, 650]
[solver]
azimuth_divisions = 8
scattering_orders = 2
[output]
size = 16
)";

constexpr const char* kPlace = R"([observer]
latitude_deg = 49.25
longitude_deg = 6.97
time = 2003-12-08T17:00:00+01:00
)";

constexpr const char* kLayersHeader =
    "bottom_km,top_km,wavelength_nm,air_scattering_per_km,aerosol_scattering_per_km,"
    "aerosol_asymmetry,absorption_per_km\n";

std::map<std::string, std::string> sun_values(const std::string& csv) {
  std::map<std::string, std::string> values;
  for (const std::string& line : lines_of(csv)) {
    const std::vector<std::string> cells = cells_of(line);
    values[cells.at(0)] = cells.at(1);
  }
  return values;
}

// ---------------------------------------------------------------- bad input

struct BadCase {
  const char* name;
  std::string scene;
  std::vector<std::string> fragments;       ///< all of them in the one complaint
  std::vector<std::string> arguments = {};  ///< after `render scene.toml`
  std::string layers = {};                  ///< contents of layers.csv, if any
};

void PrintTo(const BadCase& bad, std::ostream* stream) { *stream << bad.name; }

class BadInput : public ::testing::TestWithParam<BadCase> {};

TEST_P(BadInput, IsRefusedWithItsPlaceAndLeavesNothing) {
  const BadCase& bad = GetParam();
  const Workplace place;
  place.write("scene.toml", bad.scene);
  if (!bad.layers.empty()) place.write("layers.csv", bad.layers);
  const std::set<std::string> before = place.names();

  std::vector<std::string> arguments = {"render", "scene.toml"};
  arguments.insert(arguments.end(), bad.arguments.begin(), bad.arguments.end());
  const Finished finished = place.run(arguments);

  expect_refused(finished, bad.fragments);
  EXPECT_EQ(place.names(), before);
}

std::string with_layers(const std::string& rows) { return kLayersHeader + rows; }

const std::string kSun = "[sun]\nelevation_deg = -4\n";
const std::string kOwnLayers = kSun + "[atmosphere]\noptical_layers = \"layers.csv\"\n";

INSTANTIATE_TEST_SUITE_P(
    Cli, BadInput,
    ::testing::Values(
        BadCase{"UnknownKey",
                kSun + "[solver]\nazimut_divisions = 72\n",
                {"scene.toml:4", "'solver.azimut_divisions'", "72", "unknown key",
                 "'solver.azimuth_divisions'"}},
        BadCase{"UnknownTable", kSun + "[solvers]\n", {"scene.toml:3", "'solvers'", "[solver]"}},
        BadCase{"WrongType",
                kSun + "[solver]\nazimuth_divisions = \"72\"\n",
                {"scene.toml:4", "'solver.azimuth_divisions'", "72", "integer", "4..360"}},
        BadCase{"NotToml", kSun + "[solver\n", {"scene.toml:3", "TOML"}},
        BadCase{"PlaceAndElevation",
                kPlace + kSun,
                {"scene.toml:6", "'sun.elevation_deg'", "-4", "not both", "-90..90"}},
        BadCase{"NeitherPlaceNorElevation",
                "[solver]\nthreads = 1\n",
                {"scene.toml", "'sun.elevation_deg'", "missing"}},
        BadCase{"NegativeLayers",
                kSun + "[atmosphere]\nlayers = -5\n",
                {"scene.toml:4", "'atmosphere.layers'", "= -5", "1..500"}},
        BadCase{"WavelengthOutsideTables",
                kSun + "[spectrum]\nwavelengths_nm = [400, 1200]\n",
                {"scene.toml:4", "'spectrum.wavelengths_nm'", "1200", "280..1000"}},
        BadCase{"Humidity",
                kSun + "[aerosols]\nrelative_humidity_percent = 99.5\n",
                {"scene.toml:4", "'aerosols.relative_humidity_percent'", "99.5", "0..99"}},
        BadCase{"MethodUnknown",
                kSun + "[solver]\nmethod = \"order\"\n",
                {"scene.toml:4", "'solver.method'", "\"order\"", "\"orders\"", "\"monte-carlo\""}},
        BadCase{"CellsPolarised",
                kSun + "[solver]\npolarisation = true\n",
                {"scene.toml:4", "'solver.polarisation'", "= true", "cells", "scalar"}},
        BadCase{"CellsAverageTheDisc",
                kSun + "disc_average = true\n",
                {"scene.toml:3", "'sun.disc_average'", "= true", "cells"}},
        BadCase{"CellsWithMie",
                kSun + "[aerosols]\nphase = \"mie\"\n",
                {"scene.toml:4", "'aerosols.phase'", "\"mie\"", "cells", "henyey-greenstein"}},
        BadCase{"CellsFromOrbit",
                kSun + "[observer]\nheight_m = 400000\n",
                {"scene.toml:4", "'observer.height_m'", "= 400000", "100000", "cells"}},
        BadCase{"HigherThanOrbit",
                kSun + "[observer]\nheight_m = 5e7\n[solver]\nmethod = \"orders\"\n",
                {"scene.toml:4", "'observer.height_m'", "= 50000000", "-500..40000000"}},
        BadCase{"AlbedoWithoutWavelengths",
                kSun + "[earth]\nalbedo_spectrum = [0.1, 0.2]\n",
                {"scene.toml:4", "'earth.albedo_spectrum'", "2 values", "albedo_wavelengths_nm"}},
        BadCase{"AlbedoAboveOne",
                kSun + "[earth]\nalbedo_wavelengths_nm = [550]\nalbedo_spectrum = [1.5]\n",
                {"scene.toml:5", "'earth.albedo_spectrum'", "= 1.5", "0..1"}},
        BadCase{"AlbedoWavelengthsFall",
                kSun + "[earth]\nalbedo_wavelengths_nm = [550, 500]\nalbedo_spectrum = [0, 1]\n",
                {"scene.toml:4", "'earth.albedo_wavelengths_nm'", "= 500", "increase"}},
        BadCase{"NitrogenDioxide",
                kSun + "[atmosphere]\nnitrogen_dioxide_du = 6\n",
                {"scene.toml:4", "'atmosphere.nitrogen_dioxide_du'", "= 6", "0..5"}},
        BadCase{"OrdersGrid",
                kSun + "[solver]\nmethod = \"orders\"\nzenith_step_deg = 5\n",
                {"scene.toml:5", "'solver.zenith_step_deg'", "= 5", "0.1..3"}},
        BadCase{"FewPhotons",
                kSun + "[solver]\nmethod = \"monte-carlo\"\nphotons = 10\n",
                {"scene.toml:5", "'solver.photons'", "= 10", "100..10000000000"}},
        BadCase{"NoSuchField",
                kSun + "[aerosols]\nphase = \"henyey-greenstein\"\n[solver]\nmethod = \"orders\"\n",
                {"absent.nc", "no such file"},
                {"--field", "absent.nc"}},
        BadCase{"FieldIsNoNetcdf",
                kSun + "[aerosols]\nphase = \"henyey-greenstein\"\n[solver]\nmethod = \"orders\"\n",
                {"scene.toml", "netCDF"},
                {"--field", "scene.toml"}},
        BadCase{"NanInScene",
                "[sun]\nelevation_deg = nan\n",
                {"scene.toml:2", "'sun.elevation_deg'", "nan", "-90..90"}},
        BadCase{"NoSuchLayers",
                kOwnLayers,
                {"scene.toml:4", "'atmosphere.optical_layers'", "layers.csv"}},
        BadCase{"GapInLayers",
                kOwnLayers,
                {"layers.csv:3", "2"},
                {},
                with_layers("0,1,550,0.01,0,0,0\n2,3,550,0.01,0,0,0\n")},
        BadCase{"NanInLayers",
                kOwnLayers,
                {"layers.csv:2", "air_scattering_per_km", "nan"},
                {},
                with_layers("0,1,550,nan,0,0,0\n")},
        BadCase{"LettersInLayers",
                kOwnLayers,
                {"layers.csv:3", "absorption_per_km", "none"},
                {},
                with_layers("0,1,550,0.01,0,0,0\n1,2,550,0.01,0,0,none\n")},
        BadCase{"Override",
                kSun,
                {"--set", "'solver.azimuth_divisions'", "= 7", "4..360"},
                {"--set", "solver.azimuth_divisions=7"}},
        BadCase{"UnknownOverride",
                kSun,
                {"--set", "'solver.azimuth'", "unknown key"},
                {"--set", "solver.azimuth=8"}},
        BadCase{"OutputInNoFolder", kSun, {"nowhere/sky.exr"}, {"-o", "nowhere/sky.exr"}},
        BadCase{"OutputIsAFolder", kSun, {"/tmp"}, {"-o", "/tmp/."}},
        BadCase{"OutputIsNoExr", kSun, {"sky.jpg", ".exr"}, {"-o", "sky.jpg"}},
        BadCase{"PreviewInNoFolder", kSun, {"nowhere/sky.png"}, {"--preview", "nowhere/sky.png"}}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(CliBadInput, MissingSceneIsNamed) {
  const Workplace place;
  const Finished finished = place.run({"render", "absent.toml"});
  EXPECT_EQ(finished.exit_code, 2);
  EXPECT_NE(finished.err.find("absent.toml"), std::string::npos) << finished.err;
  EXPECT_TRUE(place.names().empty());
}

TEST(CliBadInput, WrongUsageGoesToStandardError) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  const std::vector<std::string> usages[] = {
      {},
      {"paint", "scene.toml"},
      {"render"},
      {"render", "scene.toml", "--colour"},
      {"render", "scene.toml", "--threads", "many"},
      {"render", "scene.toml", "--threads", "-1"},
      {"radiance", "scene.toml"},
      {"radiance", "scene.toml", "--view", "91,0"},
      {"radiance", "scene.toml", "--view", "north"},
      {"radiance", "scene.toml", "--view", "nan,0"},
      {"radiance", "scene.toml", "--view", "10"},
  };
  for (const auto& usage : usages) {
    const Finished finished = place.run(usage);
    EXPECT_EQ(finished.exit_code, 2) << finished.err;
    EXPECT_EQ(finished.out, "");
    EXPECT_NE(finished.err, "");
  }
}

TEST(CliBadInput, UnknownCommandNamesTheKnownOnes) {
  const Workplace place;
  const Finished finished = place.run({"paint", "scene.toml"});
  EXPECT_EQ(finished.exit_code, 2);
  for (const char* fragment :
       {"paint", "render", "radiance", "irradiance", "solve", "sun", "optics"})
    EXPECT_NE(finished.err.find(fragment), std::string::npos) << finished.err;
}

TEST(CliBadInput, FieldsAreSolvedByOrdersIntoNetcdf) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  const std::pair<std::vector<std::string>, std::vector<std::string>> usages[] = {
      {{"solve", "scene.toml"}, {"scene.toml", "'solver.method'", "\"cells\"", "\"orders\""}},
      {{"solve", "scene.toml", "--set", "solver.method=monte-carlo"},
       {"'solver.method'", "\"monte-carlo\"", "\"orders\""}},
      {{"solve", "scene.toml", "--set", "solver.method=orders", "-o", "field.txt"},
       {"field.txt", ".nc"}},
      {{"solve", "scene.toml", "--set", "solver.method=orders", "-o", "nowhere/field.nc"},
       {"nowhere/field.nc"}},
  };
  for (const auto& [arguments, fragments] : usages) {
    const Finished finished = place.run(arguments);
    expect_refused(finished, fragments);
    EXPECT_EQ(place.names(), (std::set<std::string>{"scene.toml"}));
  }
}

TEST(CliBadInput, BadViewsAreNamedWithTheirLine) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  const std::string header = "view_elevation_deg,relative_azimuth_deg\n";
  const std::pair<std::string, std::vector<std::string>> files[] = {
      {"10,0\n", {"views.csv:1", "view_elevation_deg,relative_azimuth_deg"}},
      {header + "10,0\n95,0\n", {"views.csv:3", "view_elevation_deg", "95", "-90..90"}},
      {header + "10,nan\n", {"views.csv:2", "relative_azimuth_deg", "nan", "-360..360"}},
      {header + "10,east\n", {"views.csv:2", "relative_azimuth_deg", "east"}},
      {header + "10\n", {"views.csv:2"}},
      {header, {"views.csv", "no views"}},
  };
  for (const auto& [text, fragments] : files) {
    place.write("views.csv", text);
    const Finished finished = place.run({"radiance", "scene.toml", "--views", "views.csv"});
    expect_refused(finished, fragments);
  }
}

TEST(CliBadInput, FullDiscUnderStandardOutputIsAFailure) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  const Finished finished = place.run({"sun", "scene.toml"}, "/dev/full");
  EXPECT_EQ(finished.exit_code, 1);
  EXPECT_NE(finished.err.find("standard output"), std::string::npos) << finished.err;
}

// ------------------------------------------------------------------- configs

TEST(CliConfig, VersionIsTheProjects) {
  EXPECT_EQ(Workplace().run({"--version"}).out, "twilight " TWILIGHT_VERSION "\n");
}

TEST(CliConfig, PrintedConfigPrintsItselfAgain) {
  for (const char* name :
       {"default", "haber2005", "sun_elevation", "optical_layers", "volcanic_twilight",
        "saharan_dust", "smoke_evening", "saarbruecken_evening"}) {
    const std::string config = std::string(TWILIGHT_CONFIGS "/") + name + ".toml";
    const Workplace place;
    const Finished first = place.run({"render", config, "--print-config"});
    ASSERT_EQ(first.exit_code, 0) << first.err;
    EXPECT_EQ(first.err, "");
    place.write("printed.toml", first.out);
    const Finished second = place.run({"render", "printed.toml", "--print-config"});
    EXPECT_EQ(second.exit_code, 0) << second.err;
    EXPECT_EQ(second.out, first.out);
    EXPECT_EQ(place.names(), (std::set<std::string>{"printed.toml"}));
  }
}

TEST(CliConfig, EveryCommandPrintsTheSameConfig) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  const std::string printed = place.run({"render", "scene.toml", "--print-config"}).out;
  for (const char* command : {"radiance", "irradiance", "sun", "optics", "solve"})
    EXPECT_EQ(place.run({command, "scene.toml", "--print-config"}).out, printed) << command;
}

TEST(CliConfig, DefaultTomlSpellsEveryKeyAtItsDefault) {
  const Workplace place;
  place.write("place.toml", kPlace);
  const std::string config = TWILIGHT_CONFIGS "/default.toml";
  const std::string printed = place.run({"render", config, "--print-config"}).out;
  EXPECT_EQ(printed, place.run({"render", "place.toml", "--print-config"}).out);

  const std::string text = place.read(config);
  const std::regex assignment("^(# )?([a-z0-9_]+) (=|is not set).*");
  int keys = 0;
  for (const std::string& line : lines_of(printed)) {
    std::smatch match;
    if (!std::regex_match(line, match, assignment)) continue;
    ++keys;
    EXPECT_TRUE(std::regex_search(text, std::regex("(^|\n)(# )?" + match[2].str() + " = ")))
        << match[2].str() << " is not in default.toml";
  }
  EXPECT_GE(keys, 40);
}

TEST(CliConfig, OverridesReachThePrintedConfig) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  const Finished finished =
      place.run({"render", "--set", "solver.azimuth_divisions=72", "scene.toml", "--set",
                 "spectrum.wavelengths_nm=[400,500]", "--set", "sun.spectrum=\"unit\"", "--threads",
                 "2", "--print-config"});
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  for (const char* line : {"\nazimuth_divisions = 72\n", "\nwavelengths_nm = [400, 500]\n",
                           "\nspectrum = \"unit\"\n", "\nthreads = 2\n"})
    EXPECT_NE(finished.out.find(line), std::string::npos) << line;
}

// ------------------------------------------------------------------ commands

TEST(CliRender, SmallSceneGivesWholeFiles) {
  const Workplace place;
  place.write("scene.toml", std::string(kSmallScene) + "channels = \"rgb+spectral\"\n");
  const Finished finished = place.run({"render", "scene.toml", "--preview", "sky.png"});
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  EXPECT_EQ(finished.out, "");
  EXPECT_NE(finished.err.find("peak memory"), std::string::npos) << finished.err;
  EXPECT_EQ(place.names(),
            (std::set<std::string>{"scene.toml", "sky.exr", "sky.spectral.exr", "sky.png"}));

  Imf::InputFile file(place.path("sky.exr").c_str());
  const Imath::Box2i window = file.header().dataWindow();
  ASSERT_EQ(window.max.x - window.min.x + 1, 16);
  ASSERT_EQ(window.max.y - window.min.y + 1, 16);
  float brightest = 0.0F;
  for (const char* name : {"R", "G", "B"}) {
    ASSERT_NE(file.header().channels().findChannel(name), nullptr) << name;
    Imf::Array2D<float> pixels(16, 16);
    Imf::FrameBuffer buffer;
    buffer.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&pixels[0][0]),
                                   sizeof(float), 16 * sizeof(float)));
    file.setFrameBuffer(buffer);
    file.readPixels(window.min.y, window.max.y);
    for (int y = 0; y < 16; ++y) {
      for (int x = 0; x < 16; ++x) {
        EXPECT_TRUE(std::isfinite(pixels[y][x]) && pixels[y][x] >= 0.0F) << name << x << "," << y;
        brightest = std::max(brightest, pixels[y][x]);
      }
    }
  }
  EXPECT_GT(brightest, 0.0F);
  const auto* orders =
      file.header().findTypedAttribute<Imf::StringAttribute>("solver.scattering_orders");
  ASSERT_NE(orders, nullptr);
  EXPECT_EQ(orders->value(), "2");

  Imf::InputFile spectral(place.path("sky.spectral.exr").c_str());
  EXPECT_NE(spectral.header().channels().findChannel("S0.550,000nm"), nullptr);
  EXPECT_EQ(place.read("sky.png").substr(0, 8), "\x89PNG\r\n\x1a\n");
}

TEST(CliRender, BytesDoNotDependOnThreads) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  for (const char* threads : {"1", "2"}) {
    const std::string stem = std::string("sky") + threads;
    const Finished finished = place.run({"render", "scene.toml", "--threads", threads, "-o",
                                         stem + ".exr", "--preview", stem + ".png", "--quiet"});
    ASSERT_EQ(finished.exit_code, 0) << finished.err;
    EXPECT_EQ(finished.err, "");
  }
  EXPECT_TRUE(place.read("sky1.exr") == place.read("sky2.exr"));
  EXPECT_TRUE(place.read("sky1.png") == place.read("sky2.png"));

  const auto csv = [&](const char* threads) {
    return place.run({"radiance", "scene.toml", "--view", "20,30", "--threads", threads}).out;
  };
  EXPECT_EQ(csv("1"), csv("2"));
}

TEST(CliRender, InterruptLeavesNothing) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  for (const int signal : {SIGINT, SIGTERM}) {
    const Finished finished = place.run_and_signal(
        {"render", "scene.toml", "--preview", "sky.png", "--set", "solver.azimuth_divisions=360",
         "--set", "solver.active_shell_stride=1", "--set", "solver.scattering_orders=50", "--set",
         "atmosphere.layers=500"},
        signal);
    EXPECT_EQ(finished.exit_code, 130) << finished.err;
    EXPECT_EQ(place.names(), (std::set<std::string>{"scene.toml"}));
  }
}

TEST(CliRadiance, EveryViewHasItsRows) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  place.write("views.csv",
              "# two views\nview_elevation_deg,relative_azimuth_deg\n90,0\n\n10,-90\n");
  const Finished by_option =
      place.run({"radiance", "scene.toml", "--view", "90,0", "--view", "10,-90", "--quiet"});
  ASSERT_EQ(by_option.exit_code, 0) << by_option.err;
  EXPECT_EQ(by_option.err, "");
  const std::vector<std::string> lines = lines_of(by_option.out);
  ASSERT_EQ(lines.size(), 7u) << by_option.out;
  EXPECT_EQ(lines[0],
            "view_elevation_deg,relative_azimuth_deg,wavelength_nm,radiance_w_m2_sr_nm,"
            "standard_error,degree_of_polarisation,stokes_q_w_m2_sr_nm,stokes_u_w_m2_sr_nm");
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::vector<std::string> cells = cells_of(lines[i]);
    ASSERT_EQ(cells.size(), 8u) << lines[i];
    EXPECT_EQ(cells[0], i <= 3 ? "90" : "10");
    EXPECT_EQ(cells[1], i <= 3 ? "0" : "-90");
    EXPECT_EQ(cells[2], (std::vector<std::string>{"450", "550", "650"})[(i - 1) % 3]);
    EXPECT_GT(std::stod(cells[3]), 0.0);
    for (std::size_t empty = 4; empty < 8; ++empty) EXPECT_EQ(cells[empty], "");
  }
  EXPECT_EQ(place.run({"radiance", "scene.toml", "--views", "views.csv"}).out, by_option.out);
}

TEST(CliIrradiance, GlobalIsDirectPlusDiffuse) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  const Finished finished =
      place.run({"irradiance", "scene.toml", "--set", "sun.elevation_deg=20"});
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const std::vector<std::string> lines = lines_of(finished.out);
  ASSERT_EQ(lines.size(), 4u) << finished.out;
  EXPECT_EQ(lines[0],
            "wavelength_nm,direct_w_m2_nm,diffuse_w_m2_nm,global_w_m2_nm,illuminance_lux");
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::vector<std::string> cells = cells_of(lines[i]);
    ASSERT_EQ(cells.size(), 5u);
    const double global = std::stod(cells[3]);
    EXPECT_GT(global, 0.0);
    EXPECT_NEAR(std::stod(cells[1]) + std::stod(cells[2]), global, 1e-12 * global);
    EXPECT_GT(std::stod(cells[4]), 0.0);
  }
}

TEST(CliSun, ElevationComesBackAndRefractionIsTheAlmanacs) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  const auto below = sun_values(place.run({"sun", "scene.toml"}).out);
  EXPECT_NEAR(std::stod(below.at("true_elevation_deg")), -2.0, 1e-12);
  EXPECT_NEAR(std::stod(below.at("azimuth_deg")), 250.0, 1e-12);
  EXPECT_EQ(below.at("apparent_elevation_deg"), "");  // behind the Earth
  EXPECT_EQ(below.at("sunset"), "");                  // no place

  // Hohenkerk & Sinclair (1985), NAO Technical Note 63: 319.43" at 10 degrees apparent altitude for
  // 501.69 nm, 1010 hPa, 283.15 K. In the US standard (1013.25 hPa, 288.15 K; density 0.98581 of
  // theirs) at 550 nm (refractivity 0.99609 of theirs, Edlen 1966) that is 313.7".
  const auto above = sun_values(place
                                    .run({"sun", "scene.toml", "--set", "sun.elevation_deg=9.9129",
                                          "--set", "atmosphere.layers=100"})
                                    .out);
  EXPECT_NEAR(std::stod(above.at("apparent_elevation_deg")), 10.0, 1e-3);
  EXPECT_NEAR(std::stod(above.at("refraction_deg")) * 3600.0, 313.7, 0.01 * 313.7);
  EXPECT_NEAR(std::stod(above.at("apparent_elevation_deg")),
              9.9129 + std::stod(above.at("refraction_deg")), 1e-9);
}

TEST(CliSun, EveningFollowsItsOrderInTheScenesZone) {
  const Workplace place;
  place.write("scene.toml", kPlace);
  auto sun = sun_values(place.run({"sun", "scene.toml"}).out);
  // All texts have one form and one offset, so that they sort as the instants do.
  const std::regex form(R"(2003-12-08T\d\d:\d\d:\d\d\+01:00)");
  std::string previous;
  for (const char* key :
       {"astronomical_twilight_begin", "nautical_twilight_begin", "civil_twilight_begin", "sunrise",
        "sunset", "civil_twilight_end", "nautical_twilight_end", "astronomical_twilight_end"}) {
    EXPECT_TRUE(std::regex_match(sun[key], form)) << key << " " << sun[key];
    EXPECT_LT(previous, sun[key]) << key;
    previous = sun[key];
  }
  // 17:00 lies between sunset and the end of civil twilight: Sun between -0.8 and -6 degrees.
  EXPECT_LT(sun["sunset"], "2003-12-08T17:00");
  EXPECT_GT(sun["civil_twilight_end"], "2003-12-08T17:00");
  EXPECT_LT(std::stod(sun["true_elevation_deg"]), -0.8);
  EXPECT_GT(std::stod(sun["true_elevation_deg"]), -6.0);
}

TEST(CliOptics, LayersAreContiguousFromTheGroundToTheTop) {
  const Workplace place;
  place.write("scene.toml", kSmallScene);
  const Finished finished = place.run({"optics", "scene.toml"});
  ASSERT_EQ(finished.exit_code, 0) << finished.err;
  const std::vector<std::string> lines = lines_of(finished.out);
  ASSERT_EQ(lines.size(), 1u + 10 * 3);
  EXPECT_EQ(lines[0],
            "bottom_km,top_km,pressure_hpa,temperature_k,relative_humidity_percent,wavelength_nm,"
            "refractive_index,air_scattering_per_km,aerosol_scattering_per_km,"
            "aerosol_absorption_per_km,aerosol_asymmetry,gas_absorption_per_km");
  double top = 0.0;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::vector<std::string> cells = cells_of(lines[i]);
    ASSERT_EQ(cells.size(), 12u);
    if ((i - 1) % 3 == 0) {
      EXPECT_EQ(std::stod(cells[0]), top);
      top = std::stod(cells[1]);
    }
    EXPECT_GE(std::stod(cells[6]), 1.0);
  }
  EXPECT_NEAR(top, 100.0, 1e-9);
}

}  // namespace
}  // namespace twilight
