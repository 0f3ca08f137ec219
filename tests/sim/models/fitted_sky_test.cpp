// Skies of fitted coefficients: exact at nodes, smooth between, refused outside.
#include "sim/models/fitted_sky.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "sim/models/hosek.h"
#include "sim/models/preetham_sky.h"
#include "sim/scene_file.h"
#include "tests/sim/small_scene.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using nlohmann::json;
using std::numbers::pi;
using testing::HasSubstr;

constexpr const char* kDepth = "aerosols.optical_depth_550nm";

// Two suns, two depths, two wavelengths; neighbours whose coefficients are far apart.
FitCoefficients coefficients() {
  FitCoefficients fit;
  fit.axes = {{kDepth, {0.1, 0.3}}, {kSunElevationKey, {-6, 0, 10}}};
  fit.wavelength_nm = {450, 650};
  fit.solar_spectrum = "unit";
  fit.solar_irradiance = {1.0, 2.0};
  for (std::size_t n = 0; n < 6; ++n) {
    const double x = static_cast<double>(n);
    for (std::size_t w = 0; w < 2; ++w) {
      for (const double k : {-1.0 - 0.05 * x, -0.3 - 0.1 * x, 2.0 + 9 * x, -2.0 - 0.2 * x, 0.1 * x})
        fit.coefficients.push_back(k);
      fit.normalisation.push_back(std::exp(x - 3));
      fit.sun_transmittance.push_back(n % 3 == 0 ? 0.0 : 0.02 * x);
    }
    fit.converged.push_back(true);
  }
  return fit;
}

Scene fitted_scene(double sun_deg, double depth) {
  Scene scene = small_scene(sun_deg);
  scene.aerosols.type = "continental_average";
  scene.aerosols.optical_depth_550nm = depth;
  scene.spectrum.wavelengths_nm = {450, 650};
  scene.solver.method = "fit:in-memory.json";
  return scene;
}

FittedSky sky_at(double sun_deg, double depth, const FitCoefficients& fit = coefficients()) {
  return FittedSky(build_scene_model(fitted_scene(sun_deg, depth)), fit);
}

std::vector<ViewDirection> some_views() {
  std::vector<ViewDirection> views;
  for (const double elevation : {0.0, 0.02, 0.3, 0.9, pi / 2}) {
    for (const double azimuth : {0.0, 0.4, 2.0, pi}) views.push_back({elevation, azimuth});
  }
  return views;
}

double sun_angle(const ViewDirection& v, double sun_rad) {
  return std::acos(std::clamp(
      std::sin(v.elevation_rad) * std::sin(sun_rad) +
          std::cos(v.elevation_rad) * std::cos(sun_rad) * std::cos(v.relative_azimuth_rad),
      -1.0, 1.0));
}

TEST(FittedSky, IsTheNodesFormAtANode) {
  const FitCoefficients fit = coefficients();
  for (std::size_t node = 0; node < fit.nodes(); ++node) {
    const double depth = fit.axis_value(node, 0), sun_deg = fit.axis_value(node, 1);
    const FittedSky sky = sky_at(sun_deg, depth);
    const auto views = some_views();
    const auto radiance = sky.radiance(views);
    for (std::size_t v = 0; v < views.size(); ++v) {
      const double cos_zenith = std::sin(views[v].elevation_rad);
      const double gamma = sun_angle(views[v], sun_deg * pi / 180);
      for (std::size_t w = 0; w < 2; ++w) {
        // The scene's Sun is "unit", the fit's is 2 W m^-2 nm^-1 at 650 nm.
        const double expected = fit.value(node, w, cos_zenith, gamma) / fit.solar_irradiance[w];
        EXPECT_NEAR(radiance[2 * v + w] / expected, 1, 1e-12);
      }
    }
    const auto t = sky.sun_transmittance();
    for (std::size_t w = 0; w < 2; ++w)
      EXPECT_NEAR(t[w], fit.sun_transmittance[2 * node + w], 1e-15);
  }
}

TEST(FittedSky, ZenithHasTheNormalisationAtANode) {
  const FitCoefficients fit = coefficients();
  const ViewDirection zenith[] = {{pi / 2, 0}};
  EXPECT_NEAR(sky_at(-6, 0.1).radiance(zenith)[0], fit.normalisation[0], 1e-12);
}

TEST(FittedSky, IsPositiveAndContinuousBetweenNodes) {
  const auto views = some_views();
  std::vector<double> before;
  // Across the node at 0 and through two cells.
  for (double sun = -6; sun <= 10; sun += 0.05) {
    const auto now = sky_at(std::min(sun, 10.0), 0.1 + 0.2 * (sun + 6) / 16.0001).radiance(views);
    for (std::size_t k = 0; k < now.size(); ++k) {
      ASSERT_GT(now[k], 0);
      // exp(16 nodes' units / 16 degrees) and forms that differ: below 10 % a step of 0.05 degrees.
      if (!before.empty()) {
        EXPECT_NEAR(now[k] / before[k], 1, 0.1) << sun;
      }
    }
    before = now;
  }
  const auto below = sky_at(-1e-6, 0.2).radiance(views), above = sky_at(1e-6, 0.2).radiance(views);
  for (std::size_t k = 0; k < below.size(); ++k) EXPECT_NEAR(below[k] / above[k], 1, 1e-4);
}

TEST(FittedSky, HalfWayIsTheGeometricMean) {
  FitCoefficients fit = coefficients();
  fit.coefficients.assign(fit.coefficients.size(), 0.0);  // uniform skies
  const ViewDirection view[] = {{0.5, 1.0}};
  const double middle = sky_at(-3, 0.2, fit).radiance(view)[0];
  const double product =
      fit.normalisation[0] * fit.normalisation[2] * fit.normalisation[6] * fit.normalisation[8];
  EXPECT_NEAR(middle, std::pow(product, 0.25), 1e-12 * middle);
}

TEST(FittedSky, CornersAreWeightedMultilinearly) {
  const FitCoefficients fit = coefficients();
  const auto corners = fit_corners(fit, {0.15, 5.0});
  ASSERT_EQ(corners.size(), 4u);
  double sum = 0, depth = 0, sun = 0;
  for (const FitCorner& c : corners) {
    EXPECT_GT(c.weight, 0);
    sum += c.weight;
    depth += c.weight * fit.axis_value(c.node, 0);
    sun += c.weight * fit.axis_value(c.node, 1);
  }
  EXPECT_NEAR(sum, 1, 1e-15);
  EXPECT_NEAR(depth, 0.15, 1e-15);
  EXPECT_NEAR(sun, 5, 1e-14);
  EXPECT_EQ(fit_corners(fit, {0.3, 10}).size(), 1u);
  EXPECT_EQ(fit_corners(fit, {0.1, -6 + 1e-12}).size(), 1u);
}

// A uniform sky of radiance L lights the ground with pi L.
TEST(FittedSky, IrradianceIsThatOfItsRadiance) {
  FitCoefficients fit = coefficients();
  fit.coefficients.assign(fit.coefficients.size(), 0.0);
  const Irradiance light = sky_at(10, 0.1, fit).irradiance();
  EXPECT_NEAR(light.diffuse[0], pi * fit.normalisation[4], 1e-6);
  EXPECT_NEAR(light.direct[0], fit.sun_transmittance[4] * std::sin(10 * pi / 180), 1e-12);
}

TEST(FittedSky, TakesTheWavelengthsOfTheScene) {
  FitCoefficients fit = coefficients();
  fit.coefficients.assign(fit.coefficients.size(), 0.0);
  Scene scene = fitted_scene(-6, 0.1);
  scene.spectrum.wavelengths_nm = {550};
  const ViewDirection view[] = {{0.5, 1.0}};
  const FittedSky sky(build_scene_model(scene), fit);
  // Half way, in the logarithm, between shares of sunlight of L/1 and L/2.
  EXPECT_NEAR(sky.radiance(view)[0], fit.normalisation[0] / std::sqrt(2.0), 1e-12);
  scene.spectrum.wavelengths_nm = {400};
  EXPECT_THROW(FittedSky(build_scene_model(scene), fit), std::invalid_argument);
}

std::string refusal(const Scene& scene, const FitCoefficients& fit) {
  try {
    const FittedSky sky(build_scene_model(scene), fit);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(FittedSky, OutsideItsAxesIsRefusedOrTakenToTheEdge) {
  const FitCoefficients fit = coefficients();
  EXPECT_THAT(refusal(fitted_scene(-7, 0.1), fit),
              testing::AllOf(HasSubstr("'sun.elevation_deg' = -7"), HasSubstr("-6..10")));
  EXPECT_THAT(refusal(fitted_scene(0, 0.5), fit),
              testing::AllOf(HasSubstr(kDepth), HasSubstr("0.1..0.3")));
  Scene clamped = fitted_scene(-7, 0.5);
  clamped.models.out_of_range = "clamp";
  const FittedSky sky(build_scene_model(clamped), fit);
  EXPECT_EQ(sky.summary().clamps.size(), 2u);
  EXPECT_EQ(sky.radiance(some_views()), sky_at(-6, 0.3).radiance(some_views()));
}

TEST(FittedSky, AnAxisMustBeKnownUnlessItHasOneValue) {
  FitCoefficients fit = coefficients();
  Scene scene = fitted_scene(0, 0.1);
  scene.aerosols.optical_depth_550nm.reset();
  EXPECT_THAT(refusal(scene, fit), HasSubstr("is not set: must be 0.1..0.3"));
  fit.axes[0].values = {0.1};
  EXPECT_EQ(refusal(scene, fit), "accepted");
}

// Preetham's own coefficients as a file, against his model.
TEST(FittedSky, LuminanceAndChromaticitiesBecomeDaylight) {
  constexpr double kTurbidity = 3;
  const PreethamDistribution known = preetham_distribution(kTurbidity);
  const PreethamZenith zenith = preetham_zenith(kTurbidity, 60 * pi / 180);
  FitCoefficients fit;
  fit.quantity = FitQuantity::kLuminanceChromaticity;
  fit.axes = {{kSunElevationKey, {30}}};
  fit.wavelength_nm = {450, 650};
  fit.solar_irradiance = {1, 1};
  for (const PerezCoefficients& k : {known.luminance, known.x, known.y}) {
    for (const double value : {k.a, k.b, k.c, k.d, k.e}) fit.coefficients.push_back(value);
  }
  fit.normalisation = {zenith.luminance_cd_m2, zenith.x, zenith.y};
  fit.sun_transmittance = {0.7, 0.8};
  fit.converged = {true};
  Scene scene = fitted_scene(30, 0.1);
  const auto fitted = FittedSky(build_scene_model(scene), fit).radiance(some_views());
  scene.solver.method = "preetham";
  scene.preetham.turbidity = kTurbidity;
  const auto published = PreethamSky(build_scene_model(scene)).radiance(some_views());
  for (std::size_t k = 0; k < fitted.size(); ++k) EXPECT_NEAR(fitted[k] / published[k], 1, 1e-12);
}

TEST(FittedSky, TellsOfNodesThatDidNotConverge) {
  FitCoefficients fit = coefficients();
  fit.converged[1] = false;
  bool told = false;
  const FittedSky sky = sky_at(0, 0.1, fit);
  for (const auto& [label, value] : sky.summary().figures)
    told = told || label.find("not converge") != std::string::npos;
  EXPECT_TRUE(told);
}

TEST(HosekForm, LimitsAreThoseOfItsTerms) {
  EXPECT_EQ(hosek({}, 0.3, 1.0), 1.0);  // c = 1 alone: uniform
  for (const double gamma : {0.0, 1.0, pi}) {
    const double c = std::cos(gamma);
    EXPECT_NEAR(hosek_chi(0, c), 1 + c * c, 1e-15);  // Rayleigh's
  }
  EXPECT_NEAR(hosek_chi(0.5, 1), 2 / 0.125, 1e-12);  // 2 / (1 - h)^3 towards the Sun
  EXPECT_TRUE(std::isfinite(hosek({.a = -1, .b = -0.3, .i = 1}, 0, 1)));
}

/// A folder with a scene and a fit of it.
class FitFile : public testing::Test {
 protected:
  static json valid() {
    return {{"format", "twilight sky fit"},
            {"format_version", 1},
            {"form", "perez"},
            {"quantity", "spectral"},
            {"axes", {{{"key", "sun.elevation_deg"}, {"values", {-3, 4}}}}},
            {"wavelengths_nm", {450, 550, 650}},
            {"solar_spectrum", "unit"},
            {"solar_irradiance_w_m2_nm", {1, 1, 1}},
            {"coefficients", json(2, json(3, {-1, -0.3, 5, -2, 0.4}))},
            {"normalisation", json(2, {1e-3, 1e-3, 1e-3})},
            {"sun_transmittance", json(2, {0, 0.1, 0.2})},
            {"converged", {true, true}}};
  }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    return folder_.write(name, text);
  }
  std::string refusal(const std::string& text) const {
    try {
      read_fit_coefficients(write("fit.json", text));
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  }
  // Complaint about the valid file with one value changed.
  std::string changed(const std::string& pointer, const json& value) const {
    json file = valid();
    file[json::json_pointer(pointer)] = value;
    return refusal(file.dump());
  }

  TemporaryFolder folder_;
};

TEST_F(FitFile, ComplaintsNameFilePlaceValueAndRange) {
  EXPECT_EQ(refusal(valid().dump()), "accepted");
  EXPECT_THAT(refusal("{\"format\": "), HasSubstr("fit.json: is not JSON"));
  EXPECT_THAT(refusal("[]"), HasSubstr("/ = array: must be an object"));
  EXPECT_THAT(refusal("{}"), HasSubstr("/format is missing"));
  EXPECT_THAT(changed("/format", "x"), HasSubstr("/format = \"x\": must be \"twilight sky fit\""));
  EXPECT_THAT(changed("/format_version", 2), HasSubstr("/format_version = 2: must be 1"));
  EXPECT_THAT(changed("/form", "cie"), HasSubstr("/form = \"cie\": must be one of"));
  EXPECT_THAT(changed("/axes/0/values/1", -3), HasSubstr("/axes/0/values/1 = -3: must be"));
  EXPECT_THAT(changed("/axes/0/values/1", 91), HasSubstr("-90..90"));
  EXPECT_THAT(changed("/axes/0/key", "earth.ground_albedo"), HasSubstr("sun.elevation_deg"));
  EXPECT_THAT(changed("/wavelengths_nm/2", 450), HasSubstr("above the one before"));
  EXPECT_THAT(changed("/coefficients/1/2/0", "a"),
              HasSubstr("/coefficients/1/2/0 = \"a\": must be a finite number"));
  EXPECT_THAT(changed("/coefficients/1/2", {1, 2}), HasSubstr("must be an array of 5"));
  EXPECT_THAT(changed("/coefficients/1", json(2, {1})), HasSubstr("must be an array of 3"));
  EXPECT_THAT(changed("/coefficients/0/0", {-3, -0.3, 5, -2, 0.4}),
              HasSubstr("/coefficients/0/0 = array: must be coefficients of a form that is "
                        "positive"));
  EXPECT_THAT(changed("/coefficients/0/0", {-1, 0.3, 5, -2, 0.4}), HasSubstr("positive"));
  EXPECT_THAT(changed("/normalisation/0/1", 0), HasSubstr("must be a number above 0"));
  EXPECT_THAT(changed("/sun_transmittance/0/1", 1.5), HasSubstr("= 1.5: must be a number in 0..1"));
  EXPECT_THAT(changed("/converged/0", 1), HasSubstr("must be true or false"));
  EXPECT_THROW(read_fit_coefficients(folder_.path / "none.json"), std::runtime_error);
}

TEST_F(FitFile, IsFoundBesideTheSceneAndBringsItsWavelengths) {
  write("fit.json", valid().dump());
  const auto scene =
      write("scene.toml", "[sun]\nelevation_deg = 0\n[solver]\nmethod = \"fit:fit.json\"\n");
  const LoadedScene loaded = load_scene(scene);
  EXPECT_EQ(loaded.scene.solver.method, "fit:" + (folder_.path / "fit.json").string());
  EXPECT_EQ(loaded.scene.spectrum.wavelengths_nm, (std::vector<double>{450, 550, 650}));
  const auto sky = solve_sky(build_scene_model(loaded.scene));
  EXPECT_GT(sky->irradiance().diffuse[0], 0);
  const auto missing =
      write("missing.toml", "[sun]\nelevation_deg = 0\n[solver]\nmethod = \"fit:no.json\"\n");
  try {
    load_scene(missing);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("missing.toml:4: key 'solver.method' = \"fit:no.json\""));
  }
}

}  // namespace
}  // namespace twilight
