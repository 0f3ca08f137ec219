// Skies side by side: what is the same is no error, what is known is told as it is.
#include "output/sky_comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "output/comparison_report.h"
#include "output/exr_image.h"
#include "output/false_colour.h"
#include "output/scene_colour.h"
#include "sim/scene_model.h"
#include "tests/output/fake_sky.h"

namespace twilight {
namespace {

using ::testing::HasSubstr;

class SkyComparison : public ::testing::Test {
 protected:
  SkyComparison()
      : folder_(std::filesystem::temp_directory_path() /
                ("twilight_comparison_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~SkyComparison() override { std::filesystem::remove_all(folder_); }

  // A dusk sky times `scale` as a fisheye with the Sun at an azimuth.
  std::string image(const std::string& name, double scale, const MapProjection& projection,
                    MapColour colour = MapColour::kLinearRec709) const {
    const FakeSky sky(fifteen_wavelengths_nm(), [scale](const ViewDirection& v, double nm) {
      return scale * dusk_formula(v, nm);
    });
    const ColourIntegrator integrator(sky.wavelength_nm(), FakeSky::solar_irradiance_at,
                                      ColourObserver::kCie1931);
    MapSettings settings{.projection = projection, .size = 32, .colour = colour};
    settings.sun_azimuth_rad = 2.0;
    const auto path = folder_ / name;
    write_exr(
        path, render_map(sky, integrator, settings).colour, projection,
        {{"resolved.sun_elevation_deg", -4.25}, {"resolved.sun_azimuth_deg", 2.0 * 180 / M_PI}});
    return path.string();
  }

  static Comparison compare(ComparisonOptions options) {
    return compare_skies(plan_comparison(options), {});
  }

  // Coarse skies of clear air.
  static ComparisonOptions coarse(std::vector<std::string> contenders) {
    ComparisonOptions options;
    options.contenders = std::move(contenders);
    options.overrides = {"aerosols.type=none",          "atmosphere.layers=12",
                         "solver.zenith_step_deg=3",    "solver.altitude_levels=8",
                         "solver.polar_directions=8",   "solver.azimuth_directions=4",
                         "solver.azimuth_divisions=12", "spectrum.wavelengths_nm=[450,550,650]"};
    options.suns = "20,-3";
    return options;
  }

  std::filesystem::path folder_;
};

TEST_F(SkyComparison, SkyAgainstItselfHasNoError) {
  const Comparison result = compare(coarse({"orders", "orders"}));
  ASSERT_EQ(result.rows.size(), 4u);
  for (const ComparisonRow& row : result.rows) {
    EXPECT_EQ(row.undefined, "");
    EXPECT_EQ(row.errors.radiance_rmse, 0.0);
    EXPECT_EQ(row.errors.radiance_max_relative, 0.0);
    EXPECT_EQ(row.errors.luminance_max_relative, 0.0);
    EXPECT_EQ(row.errors.chromaticity_max, 0.0);
    EXPECT_EQ(row.errors.zenith_luminance_ratio, 1.0);
  }
}

// Each Sun's errors are those of a comparison under that Sun alone, whatever the Suns share.
TEST_F(SkyComparison, SunsThatShareASolutionAreAsSolvedAlone) {
  ComparisonOptions options = coarse({"orders", "cells", "orders,solver.polarisation=false"});
  const Comparison both = compare(options);
  options.suns = "-3";
  const Comparison one = compare(options);
  for (std::size_t c = 1; c < 3; ++c) {
    EXPECT_EQ(both.rows[3 + c].errors.radiance_rmse, one.rows[c].errors.radiance_rmse);
    EXPECT_EQ(both.rows[3 + c].errors.luminance_bias, one.rows[c].errors.luminance_bias);
    EXPECT_GT(one.rows[c].errors.radiance_mean_relative.value(), 0.0);
    EXPECT_GE(one.rows[c].errors.radiance_max_relative.value(),
              one.rows[c].errors.radiance_mean_relative.value());
  }
}

// A sky three times as bright: every error is known.
TEST_F(SkyComparison, KnownRatioOfImages) {
  ComparisonOptions options;
  options.contenders = {image("one.exr", 1, Projection::kFisheye, MapColour::kXyz),
                        image("three.exr", 3, Projection::kFisheye, MapColour::kXyz)};
  const Comparison result = compare(options);
  ASSERT_EQ(result.rows.size(), 2u);
  const SkyErrors& e = result.rows[1].errors;
  EXPECT_FALSE(e.radiance_rmse);
  EXPECT_NEAR(e.luminance_mean_relative, 2.0, 1e-6);
  EXPECT_NEAR(e.luminance_max_relative, 2.0, 1e-6);
  EXPECT_NEAR(e.luminance_bias, 2.0, 1e-6);
  EXPECT_NEAR(e.zenith_luminance_ratio.value(), 3.0, 1e-6);
  EXPECT_LT(e.chromaticity_max, 1e-6);
  EXPECT_EQ(result.rows[1].sun_elevation_deg, -4.25);
  EXPECT_GT(e.luminance_rmse_cd_m2, 0.0);
}

// The same sky in another projection differs only by where its pixels' centres are.
TEST_F(SkyComparison, ProjectionsAreOriented) {
  ComparisonOptions options;
  options.contenders = {image("fisheye.exr", 1, Projection::kFisheye),
                        image("latlong.exr", 1, Projection::kLatLong)};
  EXPECT_LT(compare(options).rows[1].errors.luminance_mean_relative, 0.08);
  std::swap(options.contenders[0], options.contenders[1]);
  EXPECT_LT(compare(options).rows[1].errors.luminance_mean_relative, 0.08);
}

// What a camera does not see is no error, and not counted.
TEST_F(SkyComparison, CameraAgainstTheWholeSky) {
  ComparisonOptions options;
  const CameraView camera{.azimuth_rad = 2.0, .elevation_rad = 0.4};
  options.contenders = {image("fisheye.exr", 1, Projection::kFisheye),
                        image("camera.exr", 1, camera)};
  options.directory = folder_ / "camera";
  options.picture_size = 32;
  const SkyErrors e = compare(options).rows[1].errors;
  EXPECT_LT(e.luminance_mean_relative, 0.1);
  EXPECT_FALSE(e.zenith_luminance_ratio);
}

TEST_F(SkyComparison, MethodAgainstItsOwnImage) {
  ComparisonOptions options = coarse({"orders", "orders"});
  options.suns = "-3";
  options.overrides.push_back("solver.view_interpolation=false");  // of maps, to 0.1 %
  const ComparisonPlan plan = plan_comparison(options);
  SceneModel model = build_scene_model(*plan.contenders[0].scene);
  model.sun_elevation_rad = -3 * M_PI / 180;
  MapSettings settings{
      .size = 24, .sun_azimuth_rad = model.sun_azimuth_rad, .colour = MapColour::kXyz};
  const auto path = folder_ / "orders.exr";
  write_exr(path,
            render_map(*solve_sky(model, {}), colour_integrator(model, ColourObserver::kCie1931),
                       settings)
                .colour,
            Projection::kFisheye, {{"resolved.sun_elevation_deg", -3.0}});
  options.contenders[1] = path.string();
  options.suns.clear();
  const SkyErrors e = compare(options).rows[1].errors;
  EXPECT_LT(e.luminance_max_relative, 1e-6);  // floats
  EXPECT_LT(e.chromaticity_max, 1e-6);
}

TEST_F(SkyComparison, UndefinedModelSaysSoAndTheOthersGoOn) {
  ComparisonOptions options = coarse({"orders", "orders,observer.height_m=10", "cells"});
  options.directory = folder_ / "pictures";
  options.picture_size = 24;
  Comparison result = compare(options);
  result.rows[1].undefined = "key 'x' = 1: must be 2, \"so\"";
  result.rows[1].picture = {};
  EXPECT_THAT(comparison_table(result).text(), HasSubstr("\"key 'x' = 1: must be 2, \"\"so\"\"\""));
  EXPECT_THAT(comparison_markdown(result), HasSubstr("–"));
  const auto names = write_comparison(result);
  EXPECT_EQ(names, (std::vector<std::string>{"comparison.csv", "sun_+20.0.png", "sun_-03.0.png",
                                             "comparison.svg"}));
  for (const std::string& name : names) {
    EXPECT_GT(std::filesystem::file_size(options.directory / name), 100u) << name;
  }
  const ComparisonPicture picture = comparison_picture(result, 0);
  EXPECT_EQ(picture.width, 3 * 24);
  EXPECT_EQ(picture.height, 2 * 24);
  // The first against itself: neither brighter nor darker, in the middle of its lower map.
  const std::size_t middle = 3 * ((24 + 12) * 72 + 12);
  const Rgb8 none = diverging_colour(0);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(picture.rgb[middle + c], none[c]);
}

std::string refusal(const ComparisonOptions& options) {
  try {
    plan_comparison(options);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "accepted";
}

TEST_F(SkyComparison, RefusesBadInput) {
  EXPECT_THAT(refusal(coarse({"orders"})), HasSubstr("two or more"));
  EXPECT_THAT(refusal(coarse({"orders", "order"})), HasSubstr("'solver.method' = \"order\""));
  EXPECT_THAT(refusal(coarse({"orders", "orders,solver.x=1"})), HasSubstr("'solver.x'"));
  EXPECT_THAT(refusal(coarse({"orders", "orders,spectrum.wavelengths_nm=[450,550]"})),
              HasSubstr("must not be set for one sky alone"));
  EXPECT_THAT(refusal(coarse({"orders", "cells,solver.method=orders"})), HasSubstr("for one sky"));
  EXPECT_THAT(refusal(coarse({"orders", (folder_ / "no.exr").string()})),
              HasSubstr("no such image"));
  std::ofstream(folder_ / "text.exr") << "text";
  EXPECT_THAT(refusal(coarse({"orders", (folder_ / "text.exr").string()})), HasSubstr("is no EXR"));
  ComparisonOptions options = coarse({"orders", "cells"});
  options.suns = "100";
  EXPECT_THAT(refusal(options), HasSubstr("-18..90"));
  options.suns = "3";
  options.picture_size = 3;
  EXPECT_THAT(refusal(options), HasSubstr("16..1024"));
  options.picture_size = 32;
  options.directory = folder_ / "text.exr";
  EXPECT_THAT(refusal(options), HasSubstr("must be a folder"));
  options = coarse({"orders", image("one.exr", 1, Projection::kFisheye)});
  EXPECT_THAT(refusal(options), HasSubstr("must be 20 as --suns says"));
  options.suns = "-4.25,3";
  EXPECT_THAT(refusal(options), HasSubstr("must be one elevation"));
}

// u', v' of D65 (CIE 15:2004, Table 11.3: 0.1978, 0.4683).
TEST(UcsChromaticity, OfD65) {
  const auto uv = ucs_chromaticity({95.04, 100.0, 108.88});
  EXPECT_NEAR(uv[0], 0.1978, 5e-5);
  EXPECT_NEAR(uv[1], 0.4683, 5e-5);
}

TEST(FalseColour, IsSymmetricAndSaturates) {
  EXPECT_EQ(diverging_colour(0), (Rgb8{242, 242, 242}));
  EXPECT_EQ(diverging_colour(1), diverging_colour(7));
  EXPECT_EQ(diverging_colour(-1), diverging_colour(-7));
  EXPECT_GT(diverging_colour(0.5)[0], diverging_colour(0.5)[2]);
  EXPECT_LT(diverging_colour(-0.5)[0], diverging_colour(-0.5)[2]);
  EXPECT_EQ(ratio_colour(2, 4), diverging_colour(0.5));
  EXPECT_EQ(ratio_colour(0.5, 4), diverging_colour(-0.5));
  EXPECT_EQ(ratio_colour(0, 4), diverging_colour(-1));
  EXPECT_EQ(diverging_colour(std::nan("")), (Rgb8{128, 128, 128}));
}

}  // namespace
}  // namespace twilight
