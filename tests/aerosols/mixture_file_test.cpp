#include "aerosols/mixture_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "aerosols/known_phases.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using testing::HasSubstr;

const std::string kLayer = "[[layer]]\nbottom_km = 0\ntop_km = 2\nnumber_per_cm3 = {WASO = 10}\n";
const std::string kSizes =
    "lognormal = {mode_radius_um = 0.1, geometric_deviation = 1.6, smallest_radius_um = 0.01, "
    "largest_radius_um = 5}\n";
const std::string kIndex =
    "refractive_index = {wavelength_nm = [300, 900], n = [1.5, 1.4], k = "
    "[0.01, 0]}\n";

MixtureFile read(const std::string& text) {
  const TemporaryFolder folder;
  return read_mixture_file(folder.write("mix.toml", text));
}

double amount(const MixtureLayer& layer, std::string_view name) {
  for (const ComponentAmount& a : layer.amounts) {
    if (a.component->name() == name) return a.amount;
  }
  return 0;
}

TEST(MixtureFile, HoldsWhatItSays) {
  const MixtureFile file =
      read("[[component]]\nname = \"smoke\"\n" + kSizes + kIndex +
           "density_g_cm3 = 1.5\n"
           "growth = {humidity_percent = [0, 90], radius_growth_factor = [1, 1.3]}\n"
           "[[layer]]\nbottom_km = 1\ntop_km = 4\nscale_height_km = 3\n"
           "relative_humidity_percent = 70\nnumber_per_cm3 = {SOOT = 5, smoke = 7, WASO = 3}\n"
           "optical_depth_550nm = 0.4\n"
           "[[layer]]\nprofile = {heights_km = [2, 3, 5], relative_density = [0, 1, 0]}\n"
           "relative_humidity_percent = \"profile\"\nmass_ug_m3 = {smoke = 2}\n"
           "[[layer]]\nbottom_km = 0\ntop_km = 1\nnumber_per_cm3 = {INSO = 1}\n"
           "relative_humidity_percent = {heights_km = [0, 1], percent = [80, 60]}\n" +
           kLayer);
  ASSERT_EQ(file.layers.size(), 4u);
  EXPECT_EQ(file.files.size(), 1u);
  const MixtureLayer& a = file.layers[0];
  EXPECT_EQ(a.profile.bottom_km, 1);
  EXPECT_EQ(a.profile.top_km, 4);
  EXPECT_EQ(a.profile.scale_height_km, 3);
  EXPECT_EQ(a.humidity.source, LayerHumidity::Source::kPercent);
  EXPECT_EQ(a.humidity.percent, 70);
  EXPECT_EQ(a.optical_depth_550nm, 0.4);
  // OPAC's components come first, in OPAC's order.
  ASSERT_EQ(a.amounts.size(), 3u);
  EXPECT_EQ(a.amounts[0].component->name(), "WASO");
  EXPECT_EQ(a.amounts[0].amount, 3);
  EXPECT_EQ(a.amounts[1].amount, 5);
  EXPECT_EQ(a.amounts[2].component->name(), "smoke");
  EXPECT_EQ(file.layers[1].profile.top_km, 5);
  EXPECT_EQ(file.layers[1].humidity.source, LayerHumidity::Source::kAtmosphere);
  EXPECT_NEAR(
      amount(file.layers[1], "smoke") * *file.layers[1].amounts[0].component->dry_mass_ug_per_m3(),
      2, 1e-12);
  EXPECT_EQ(file.layers[2].humidity.percents, (std::vector<double>{80, 60}));
  EXPECT_EQ(file.layers[3].humidity.source, LayerHumidity::Source::kScene);
  EXPECT_TRUE(std::isinf(file.layers[3].profile.scale_height_km));
}

// Hess, Koepke & Schult (1998), Table 1c: mass of one particle cm^-3, ug m^-3.
TEST(MixtureFile, MassLoadsAreNumbersTimesMassPerParticle) {
  const std::pair<const char*, double> published[] = {{"INSO", 23.7},    {"WASO", 1.34e-3},
                                                      {"SOOT", 5.99e-5}, {"SSAM", 0.802},
                                                      {"SSCM", 224.0},   {"MINM", 2.78e-2}};
  for (const auto& [name, mass] : published) {
    const MixtureFile file = read(std::string("[[layer]]\nbottom_km = 0\ntop_km = 1\n") +
                                  "mass_ug_m3 = {" + name + " = 10}\n");
    EXPECT_NEAR(amount(file.layers[0], name) * mass / 10, 1, 0.007) << name;
    const MixtureFile both =
        read(std::string("[[layer]]\nbottom_km = 0\ntop_km = 1\nmass_ug_m3 = {") + name +
             " = 10}\nnumber_per_cm3 = {" + name + " = 4}\n");
    EXPECT_NEAR(amount(both.layers[0], name), amount(file.layers[0], name) + 4, 1e-9) << name;
  }
}

TEST(MixtureFile, IndexMayBeAFileBesideIt) {
  const TemporaryFolder folder;
  folder.write("smoke.csv", "# made up\nwavelength_nm,n,k\n300,1.5,0.01\n900, 1.4, 0\n");
  const std::string text = "[[component]]\nname = \"smoke\"\n" + kSizes;
  const std::string layer = "[[layer]]\nbottom_km=0\ntop_km=1\nnumber_per_cm3 = {smoke = 1}\n";
  const MixtureFile from_file = read_mixture_file(
      folder.write("mix.toml", text + "refractive_index = \"smoke.csv\"\n" + layer));
  EXPECT_EQ(from_file.files.size(), 2u);
  const auto a = from_file.layers[0].amounts[0].component;
  const auto b = read(text + kIndex + layer).layers[0].amounts[0].component;
  EXPECT_EQ(a->identity(), b->identity());
  EXPECT_DOUBLE_EQ(a->spheres(0, 600).index.real(), 1.45);
  EXPECT_DOUBLE_EQ(a->spheres(0, 600).index.imag(), -0.005);
  EXPECT_THROW(a->spheres(0, 950), std::invalid_argument);
}

// The volume distribution of a lognormal mode, tabulated: the mode. A measured distribution counts
// all of its particles; a lognormal one is cut without renormalising, here by 1e-9.
TEST(MixtureFile, MeasuredSizesAreTheModeTheyTabulate) {
  const TemporaryFolder folder;
  const LognormalSizeDistribution mode{0.1, 1.6, 0.01, 5};
  std::string csv = "radius_um,dV_dlnr\n";
  for (int i = 0; i <= 300; ++i) {
    const double r = 0.0101 * std::pow(4.9 / 0.0101, i / 300.0);
    csv += std::to_string(r) + "," + fmt::format("{}", r * r * r * mode.per_log_radius(r)) + "\n";
  }
  folder.write("sizes.csv", csv);
  const std::string tail =
      kIndex + "[[layer]]\nbottom_km=0\ntop_km=1\nnumber_per_cm3 = {smoke = 1}\n";
  const std::string head = "[[component]]\nname = \"smoke\"\n";
  const MixtureFile measured = read_mixture_file(
      folder.write("a.toml", head + "size_distribution = \"sizes.csv\"\n" + tail));
  const MixtureFile with_row = read_mixture_file(folder.write(
      "b.toml", head + "size_distribution = {file = \"sizes.csv\", row = \"1\"}\n" + tail));
  const MixtureFile lognormal = read_mixture_file(folder.write("c.toml", head + kSizes + tail));
  EXPECT_EQ(measured.files.size(), 2u);
  KnownPhases known;
  const std::vector<double> nm = {450, 800};
  const auto optics = [&](const MixtureFile& file) {
    return known.optics({file.layers[0].amounts, 0}, nm);
  };
  const MixtureOptics a = optics(measured), b = optics(with_row), c = optics(lognormal);
  for (std::size_t w = 0; w < nm.size(); ++w) {
    EXPECT_EQ(a.scattering_per_km[w], b.scattering_per_km[w]);
    EXPECT_NEAR(a.scattering_per_km[w] / c.scattering_per_km[w], 1, 0.002);
    EXPECT_NEAR(a.absorption_per_km[w] / c.absorption_per_km[w], 1, 0.002);
    EXPECT_NEAR(a.asymmetry[w], c.asymmetry[w], 0.001);
  }
}

struct BadFile {
  std::string text;
  std::vector<std::string> fragments;
};

TEST(MixtureFile, WhatIsWrongIsNamedWithItsLine) {
  const std::string smoke = "[[component]]\nname = \"smoke\"\n";
  const std::string own = smoke + kSizes + kIndex;
  const BadFile cases[] = {
      {"[[layer]\n", {"mix.toml:1", "TOML"}},
      {"", {"mix.toml", "[[layer]]"}},
      {"colour = 1\n" + kLayer, {"mix.toml:1", "'colour'", "unknown", "component, layer"}},
      {"layer = 3\n", {"mix.toml:1", "'layer'", "array of tables"}},
      {"[[layer]]\nbottom_km = 0\ntop_km = 2\nheight = 3\n", {"mix.toml:4", "layer[1].height"}},
      {"[[layer]]\nbottom_km = 0\nnumber_per_cm3 = {WASO = 1}\n", {"mix.toml:1", "'top_km'"}},
      {"[[layer]]\nbottom_km = 3\ntop_km = 2\nnumber_per_cm3 = {WASO = 1}\n",
       {"mix.toml:3", "= 2", "above bottom_km = 3"}},
      {"[[layer]]\nbottom_km = -1\ntop_km = 2\nnumber_per_cm3 = {WASO = 1}\n",
       {"mix.toml:2", "= -1", "0..200"}},
      {"[[layer]]\nbottom_km = nan\ntop_km = 2\nnumber_per_cm3 = {WASO = 1}\n",
       {"mix.toml:2", "nan"}},
      {"[[layer]]\nbottom_km = \"low\"\ntop_km = 2\n", {"mix.toml:2", "low", "number"}},
      {kLayer + "scale_height_km = 0\n", {"mix.toml:5", "= 0", "0.01"}},
      {kLayer + "profile = {heights_km = [0, 1], relative_density = [1, 1]}\n",
       {"mix.toml:2", "bottom_km", "profile"}},
      {kLayer + "relative_humidity_percent = 99.5\n", {"mix.toml:5", "99.5", "0..99"}},
      {kLayer + "relative_humidity_percent = \"wet\"\n", {"mix.toml:5", "wet", "profile"}},
      {kLayer + "relative_humidity_percent = {heights_km = [0, 1], percent = [50]}\n",
       {"mix.toml:5", "percent", "1 values", "2"}},
      {kLayer + "relative_humidity_percent = {heights_km = [1, 0], percent = [50, 5]}\n",
       {"mix.toml:5", "above the value before"}},
      {kLayer + "optical_depth_550nm = -0.1\n", {"mix.toml:5", "-0.1", "0..100"}},
      {"[[layer]]\nbottom_km = 0\ntop_km = 2\n", {"mix.toml:1", "must hold particles"}},
      {"[[layer]]\nbottom_km = 0\ntop_km = 2\nnumber_per_cm3 = {WASO = 0}\n",
       {"mix.toml:1", "must hold particles"}},
      {"[[layer]]\nbottom_km = 0\ntop_km = 2\nnumber_per_cm3 = {WASO = -5}\n",
       {"mix.toml:4", "layer[1].number_per_cm3.WASO", "-5"}},
      {"[[layer]]\nbottom_km = 0\ntop_km = 2\nnumber_per_cm3 = {SALT = 5}\n",
       {"mix.toml:4", "SALT", "unknown component", "INSO, WASO, SOOT", "SUSO"}},
      {own + "[[layer]]\nbottom_km = 0\ntop_km = 2\nnumber_per_cm3 = {smog = 5}\n",
       {"smog", "SUSO, smoke"}},
      {own + "[[layer]]\nbottom_km = 0\ntop_km = 2\nmass_ug_m3 = {smoke = 5}\n",
       {"mix.toml:8", "smoke", "density_g_cm3"}},
      {"[[layer]]\nbottom_km = 0\ntop_km = 2\nextinction_550nm_per_km = {WASO = 5}\n",
       {"mix.toml:4", "number_per_cm3 or mass_ug_m3"}},
      {"[[layer]]\nprofile = {heights_km = [0, 1], relative_density = [0, 0]}\n",
       {"mix.toml:2", "relative_density", "above 0"}},
      {"[[layer]]\nprofile = {heights_km = [0], relative_density = [1]}\n",
       {"mix.toml:2", "heights_km", "2 or more"}},
      {smoke + kIndex + kLayer, {"mix.toml:1", "lognormal"}},
      {smoke + kSizes + kLayer, {"mix.toml:1", "refractive_index"}},
      {"[[component]]\nname = \"WASO\"\n", {"mix.toml:2", "WASO", "already"}},
      {own + own + kLayer, {"mix.toml:6", "smoke", "already"}},
      {"[[component]]\nname = \"a b\"\n", {"mix.toml:2", "letters"}},
      {own + "density_g_cm3 = 0\n" + kLayer, {"mix.toml:5", "= 0", "25"}},
      {own + "growth = {humidity_percent = [50, 90], radius_growth_factor = [1, 2]}\n" + kLayer,
       {"mix.toml:1", "0 % with factor 1 first"}},
      {own + "growth = {humidity_percent = [0, 90], radius_growth_factor = [1]}\n" + kLayer,
       {"mix.toml:5", "radius_growth_factor", "1 values"}},
      {own + "optics = \"x.nc\"\n" + kLayer, {"mix.toml:3", "lognormal", "optics"}},
      {smoke + "optics = \"absent.nc\"\n" + kLayer, {"mix.toml:3", "absent.nc", "there is none"}},
      {smoke + kSizes + "refractive_index = \"absent.csv\"\n" + kLayer,
       {"mix.toml:4", "absent.csv", "there is none"}},
      {smoke + kSizes +
           "refractive_index = {wavelength_nm = [500, 400], n = [1, 1], k = [0, 0]}\n" + kLayer,
       {"mix.toml:4", "wavelength_nm", "above the value before"}},
      {smoke + kSizes + "refractive_index = {wavelength_nm = [500], n = [1.5], k = [-1]}\n" +
           kLayer,
       {"mix.toml:4", "-1", "0..20"}},
      {smoke +
           "lognormal = {mode_radius_um = 0.1, geometric_deviation = 1, smallest_radius_um = "
           "0.01, largest_radius_um = 5}\n" +
           kIndex + kLayer,
       {"mix.toml:3", "geometric_deviation", "= 1:"}},
      {smoke +
           "lognormal = {mode_radius_um = 0.1, geometric_deviation = 2, smallest_radius_um = 5, "
           "largest_radius_um = 5}\n" +
           kIndex + kLayer,
       {"mix.toml:3", "largest_radius_um", "above"}},
  };
  for (const BadFile& bad : cases) {
    SCOPED_TRACE(bad.text);
    try {
      read(bad.text);
      ADD_FAILURE() << "was taken";
    } catch (const std::invalid_argument& error) {
      for (const std::string& fragment : bad.fragments) {
        EXPECT_THAT(error.what(), HasSubstr(fragment));
      }
    }
  }
}

TEST(MixtureFile, BadIndexFilesAreNamedWithTheirLine) {
  const std::pair<std::string, std::string> cases[] = {
      {"nm,n,k\n300,1.5,0\n", "smoke.csv:1"},
      {"wavelength_nm,n,k\n300,1.5\n", "smoke.csv:2"},
      {"wavelength_nm,n,k\n300,1.5,0\n300,1.5,0\n", "smoke.csv:3"},
      {"wavelength_nm,n,k\n300,1.5,x\n", "smoke.csv:2"},
      {"wavelength_nm,n,k\n300,1.5,0,4\n", "smoke.csv:2"},
      {"wavelength_nm,n,k\n300,-1,0\n", "smoke.csv:2"},
      {"wavelength_nm,n,k\n300,nan,0\n", "smoke.csv:2"},
      {"wavelength_nm,n,k\n", "smoke.csv"},
  };
  for (const auto& [csv, fragment] : cases) {
    SCOPED_TRACE(csv);
    const TemporaryFolder folder;
    folder.write("smoke.csv", csv);
    const auto file = folder.write("mix.toml", "[[component]]\nname = \"smoke\"\n" + kSizes +
                                                   "refractive_index = \"smoke.csv\"\n" + kLayer);
    try {
      read_mixture_file(file);
      ADD_FAILURE() << "was taken";
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr(fragment));
    }
  }
  EXPECT_THROW(read_mixture_file("/nonexistent/mix.toml"), std::runtime_error);
}

}  // namespace
}  // namespace twilight
