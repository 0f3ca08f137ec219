// The air read from synthetic skies, and what is refused.
#include "output/air_retrieval.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "output/csv_table.h"
#include "output/exr_image.h"
#include "output/forward_model.h"
#include "output/photograph.h"
#include "output/retrieval_report.h"
#include "output/scene_colour.h"
#include "output/scene_map.h"
#include "output/sky_image.h"
#include "output/ubvri.h"
#include "sim/orders_sky.h"
#include "solar/solar_spectrum.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using testing::HasSubstr;
constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr const char* kDepth = "aerosols.optical_depth_550nm";
constexpr const char* kHumidity = "aerosols.relative_humidity_percent";
constexpr const char* kOzone = "atmosphere.ozone_du";

// Grids so coarse that a solution takes a fifth of a second; the sky that is read is one of theirs.
const char* const kScene = R"(
[sun]
elevation_deg = -3
azimuth_deg = 230
disc_average = false
[atmosphere]
layers = 20
ozone_du = 300
[aerosols]
optical_depth_550nm = 0.25
relative_humidity_percent = 50
[spectrum]
wavelengths_nm = [440, 520, 600, 680]
[solver]
method = "orders"
polarisation = false
zenith_step_deg = 3
altitude_levels = 10
polar_directions = 12
azimuth_directions = 4
phase_degree = 8
order_tolerance = 1e-2
sunlight_nodes = 64
darkest_zenith_deg = 106
)";

LoadedScene scene_with(const std::vector<std::string>& overrides = {}) {
  return load_scene_text(kScene, "scene.toml", overrides);
}

const std::vector<std::string> kTruth = {"aerosols.optical_depth_550nm=0.15",
                                         "aerosols.relative_humidity_percent=70",
                                         "atmosphere.ozone_du=350"};

// What an instrument would have measured under the truth, with noise of this share, as CSV.
std::string radiances_csv(const std::vector<double>& suns_deg,
                          const std::vector<ViewDirection>& views,
                          const std::vector<double>& wavelengths_nm, double noise, unsigned seed) {
  Scene scene = scene_with(kTruth).scene;
  scene.spectrum.wavelengths_nm = wavelengths_nm;
  const std::unique_ptr<Sky> first = solve_sky(build_scene_model(scene));
  CsvTable table({"sun_elevation_deg", "view_elevation_deg", "relative_azimuth_deg",
                  "wavelength_nm", "radiance_w_m2_sr_nm", "standard_error"});
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (const double sun : suns_deg) {
    const std::unique_ptr<Sky> sky = first->with_sun_at(sun * kRadPerDeg);
    const std::vector<double> radiance = sky->radiance(views);
    for (std::size_t k = 0; k < radiance.size(); ++k) {
      const ViewDirection& v = views[k / wavelengths_nm.size()];
      table.add_row({sun, v.elevation_rad / kRadPerDeg, v.relative_azimuth_rad / kRadPerDeg,
                     wavelengths_nm[k % wavelengths_nm.size()],
                     radiance[k] * (1 + noise * normal(random)), noise * radiance[k]});
    }
  }
  return table.text();
}

ViewDirection view(double elevation_deg, double azimuth_deg) {
  return {elevation_deg * kRadPerDeg, azimuth_deg * kRadPerDeg};
}

RetrieveOptions options_for(const std::filesystem::path& measured, std::vector<std::string> free) {
  RetrieveOptions options;
  options.measured = measured;
  options.free = std::move(free);
  options.directory = measured.parent_path() / "out";
  options.search_quality = "scene";
  options.search.starts = 1;
  return options;
}

TEST(AirRetrieval, ReadsOpticalDepthAndOzoneToFivePerCentFromNoisyTwilight) {
  const TemporaryFolder folder;
  const auto csv = folder.write(
      "sky.csv", radiances_csv({1, -3, -6}, {view(90, 0), view(20, 0), view(10, 0), view(20, 180)},
                               {440, 520, 600, 680}, 0.02, 11));
  const RetrievalPlan plan = plan_retrieval(
      scene_with(), options_for(csv, {std::string(kDepth) + "," + kHumidity + "," + kOzone}));
  EXPECT_EQ(plan.measured.values.size(), 48u);
  const Retrieval r = run_retrieval(plan);
  ASSERT_TRUE(r.converged);
  EXPECT_TRUE(r.parameters[0].claimed);
  EXPECT_NEAR(r.parameters[0].value, 0.15, 0.05 * 0.15);
  EXPECT_TRUE(r.parameters[2].claimed);
  EXPECT_NEAR(r.parameters[2].value, 350, 0.05 * 350);
  // Chi squared of 45 degrees of freedom: 45 +- 9.5.
  EXPECT_LT(r.chi_squared, 45 + 4 * 9.5);
  EXPECT_GT(r.chi_squared, 45 - 4 * 9.5);
  for (const std::size_t i : {0u, 1u, 2u}) {
    const double truth[] = {0.15, 70, 350};
    EXPECT_LT(std::abs(r.parameters[i].value - truth[i]), 4 * r.parameters[i].standard_error);
  }
  // The same bytes for any number of threads.
  RetrievalPlan other = plan;
  other.scene.solver.threads = other.search_scene.solver.threads = 1;
  other.options.search.most_iterations = 1;
  RetrievalPlan one = plan;
  one.options.search.most_iterations = 1;
  one.options.search.profiles = other.options.search.profiles = false;
  EXPECT_EQ(run_retrieval(one).predicted, run_retrieval(other).predicted);
}

// The zenith at one wavelength cannot tell how humid the haze is where it does not know how much of
// it there is.
TEST(AirRetrieval, DoesNotClaimHumidityWhereTheDataCannotTell) {
  const TemporaryFolder folder;
  const auto csv =
      folder.write("zenith.csv", radiances_csv({-2, -4, -6}, {view(90, 0)}, {600}, 0.02, 5));
  const RetrievalPlan plan = plan_retrieval(scene_with({"atmosphere.ozone_du=350"}),
                                            options_for(csv, {kHumidity, kDepth}));
  const Retrieval r = run_retrieval(plan);
  EXPECT_FALSE(r.parameters[0].claimed);
  EXPECT_FALSE(r.parameters[0].reasons.empty());
  // The interval holds the truth all the same.
  EXPECT_LT(r.parameters[0].low_95, 70);
  EXPECT_GT(r.parameters[0].high_95, 70);
  const auto json = nlohmann::json::parse(retrieval_json(plan, r));
  EXPECT_EQ(json["parameters"][0]["key"], kHumidity);
  EXPECT_EQ(json["parameters"][0]["claimed"], false);
}

// The method "orders" does not look at a model's turbidity.
TEST(AirRetrieval, DoesNotClaimAKeyWithoutEffect) {
  const TemporaryFolder folder;
  const auto csv =
      folder.write("sky.csv", radiances_csv({-3}, {view(90, 0), view(20, 0)}, {600}, 0.02, 5));
  const Retrieval r = run_retrieval(
      plan_retrieval(scene_with(kTruth), options_for(csv, {"preetham.turbidity", kOzone})));
  EXPECT_FALSE(r.parameters[0].claimed);
  EXPECT_THAT(r.parameters[0].reasons, testing::Contains(HasSubstr("no effect")));
}

TEST(AirRetrieval, ReadsOpticalDepthFromAZenithCurveInMagnitudes) {
  const TemporaryFolder folder;
  const Scene truth = scene_with(kTruth).scene;
  // A made-up sky meter: what the forward model itself gives, in magnitudes.
  Measurement measured = read_measurement(
      folder.write("curve.csv",
                   "sun_elevation_deg,magnitude_per_arcsec2,standard_error\n"
                   "6,5,0.02\n2,5,0.02\n0,6,0.02\n-2,7,0.02\n-4,9,0.02\n-6,11,0.02\n"),
      truth);
  EXPECT_EQ(measured.kind, MeasuredKind::kZenithCurve);
  ASSERT_EQ(measured.values.size(), 6u);
  SkyForwardModel model(truth, {}, measured, std::make_shared<KnownPhases>(), {});
  const std::vector<double> magnitudes = model({});
  CsvTable table({"sun_elevation_deg", "magnitude_per_arcsec2", "standard_error"});
  for (std::size_t k = 0; k < magnitudes.size(); ++k) {
    table.add_row({measured.suns[k].elevation_rad / kRadPerDeg, magnitudes[k], 0.02});
    if (k == 0) continue;
    EXPECT_GT(magnitudes[k], magnitudes[k - 1]);  // it grows dark
  }
  const auto csv = folder.write("curve.csv", table.text());
  const Retrieval r = run_retrieval(plan_retrieval(
      scene_with({"aerosols.relative_humidity_percent=70", "atmosphere.ozone_du=350"}),
      options_for(csv, {kDepth})));
  EXPECT_NEAR(r.parameters[0].value, 0.15, 0.002);
  EXPECT_LT(r.chi_squared, 0.1);
}

// A camera's picture of the truth, as `twilight render` writes it.
struct Photograph {
  TemporaryFolder folder;
  int width = 0, height = 0;

  Photograph() {
    Scene scene = scene_with(kTruth).scene;
    scene.output.projection = "camera";
    scene.output.size = 48;
    scene.output.channels = "xyz";
    scene.camera.elevation_deg = 18;
    scene.camera.azimuth_deg = 215;
    scene.camera.field_of_view_deg = 40;
    const SceneModel model = build_scene_model(scene);
    const OrdersSky sky(model, {});
    const SkyMap map = render_map(sky, colour_integrator(model, ColourObserver::kCie1931),
                                  map_settings(model), {});
    width = map.colour.width;
    height = map.colour.height;
    write_exr(folder.path / "photo.exr", map.colour, map_projection(scene, model.sun_azimuth_rad));
  }
  std::filesystem::path describe(const std::string& more) const {
    return folder.write("photo.toml",
                        "kind = \"photograph\"\nfile = \"photo.exr\"\nsamples = 60\n" + more);
  }
  RetrievalPlan plan(const std::string& more) const {
    return plan_retrieval(
        scene_with({"aerosols.relative_humidity_percent=70", "atmosphere.ozone_du=350"}),
        options_for(describe(more), {kDepth}));
  }
};

TEST(AirRetrieval, ReadsOpticalDepthFromAPhotograph) {
  const Photograph photo;
  const RetrievalPlan plan = photo.plan("");
  EXPECT_FALSE(plan.measured.free_exposure);  // twilight's files are calibrated
  const Retrieval r = run_retrieval(plan);
  EXPECT_NEAR(r.parameters[0].value, 0.15, 0.05 * 0.15);
  EXPECT_TRUE(r.parameters[0].claimed);

  // With an exposure that is not known, and twice as bright.
  const RetrievalPlan free = photo.plan("exposure = \"free\"\nvalue_scale = 2.0\n");
  const Retrieval scaled = run_retrieval(free);
  ASSERT_EQ(scaled.parameters.size(), 2u);
  EXPECT_EQ(scaled.parameters[1].parameter.name, kExposureName);
  EXPECT_NEAR(scaled.parameters[0].value, 0.15, 0.05 * 0.15);
  EXPECT_NEAR(scaled.parameters[1].value, 2.0, 0.05);
  const std::vector<std::string> files = write_retrieval(free, scaled);
  EXPECT_THAT(files, testing::Contains("residuals_Y.png"));
  for (const std::string& name : files) {
    EXPECT_GT(std::filesystem::file_size(free.options.directory / name), 0u) << name;
  }
}

TEST(AirRetrieval, MaskedPixelsDoNotMatter) {
  const Photograph photo;
  // A roof over the lower right quarter: in the mask alone, then in the photograph too.
  std::string pgm =
      "P2\n" + std::to_string(photo.width) + " " + std::to_string(photo.height) + "\n255\n";
  const auto roof = [&](int x, int y) { return 2 * x > photo.width && 2 * y > photo.height; };
  for (int y = 0; y < photo.height; ++y) {
    for (int x = 0; x < photo.width; ++x) pgm += roof(x, y) ? "0 " : "255 ";
    pgm += "\n";
  }
  photo.folder.write("mask.pgm", pgm);
  const RetrievalPlan clean = photo.plan("mask = \"mask.pgm\"\n");
  const LinearImage image = read_linear_image(photo.folder.path / "photo.exr");
  SkyImage painted{
      image.width, image.height, image.channels, image.pixels,
      MapProjection(CameraView{215 * kRadPerDeg, 18 * kRadPerDeg, 40 * kRadPerDeg, 1.5})};
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (!roof(x, y)) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        painted.pixels[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                            static_cast<std::size_t>(x)) +
                       c] = 100.0f;
      }
    }
  }
  write_exr(photo.folder.path / "photo.exr", painted, *painted.projection);
  const RetrievalPlan masked = photo.plan("mask = \"mask.pgm\"\n");
  ASSERT_EQ(masked.measured.values.size(), clean.measured.values.size());
  for (std::size_t k = 0; k < clean.measured.values.size(); ++k) {
    EXPECT_EQ(masked.measured.values[k].value, clean.measured.values[k].value);
    EXPECT_EQ(masked.measured.values[k].standard_error, clean.measured.values[k].standard_error);
  }
  EXPECT_LT(clean.measured.values.size(), photo.plan("").measured.values.size());
}

// Channels of the eye's own sensitivities give what ColourIntegrator gives.
TEST(ForwardModel, ResponseWeightsAreTheColourIntegrators) {
  const std::vector<double> nm = {440, 520, 600, 680};
  const SceneModel model = build_scene_model(scene_with().scene);
  const ColourIntegrator integrator = colour_integrator(model, ColourObserver::kCie1931);
  const std::vector<SpectralResponse> xyz = standard_responses({"X", "Y", "Z"});
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<double> weights = response_weights(xyz[c], nm, model.scene.sun.spectrum);
    for (std::size_t w = 0; w < nm.size(); ++w) {
      EXPECT_NEAR(weights[w], integrator.weights()[w][c], 1e-9 * integrator.weights()[w][c]);
    }
  }
}

// A magnitude that is read is the one that a study measures of the same sky.
TEST(ForwardModel, MagnitudesAreTheBandsOfUbvri) {
  const std::vector<double> nm = {380, 440, 520, 600, 680, 760, 900};
  const std::string& spectrum = scene_with().scene.sun.spectrum;
  const auto solar = [&](double at) { return solar_irradiance_w_m2_nm(spectrum, at); };
  const UbvriIntegrator bands(nm, solar);
  std::vector<double> e0, radiance;
  for (std::size_t w = 0; w < nm.size(); ++w) {
    e0.push_back(solar(nm[w]));
    radiance.push_back(1e-4 * e0.back() * (1 + 0.3 * static_cast<double>(w % 3)));
  }
  const UbvriValues expected = bands.surface_brightness(radiance, e0);
  for (const std::size_t band : {1u, 2u, 3u, 4u}) {
    const std::vector<double> weights = response_weights(band_response(band), nm, spectrum);
    double sum = 0;
    for (std::size_t w = 0; w < nm.size(); ++w) sum += weights[w] * radiance[w] / e0[w];
    EXPECT_NEAR(-2.5 * std::log10(sum), expected[band], 1e-9) << kUbvriBands[band];
  }
  EXPECT_THROW(response_weights(band_response(0), nm, spectrum), std::invalid_argument);
  const std::vector<double> few = {520, 600};
  EXPECT_THROW(response_weights(band_response(2), few, spectrum), std::invalid_argument);
}

// Absolute azimuths are from north clockwise, relative ones from the Sun's: a view east of a Sun in
// the south-west is left of it, its angle negative.
TEST(Measurement, AzimuthsAreOfTheRowsOwnSun) {
  const TemporaryFolder folder;
  const auto csv = folder.write("a.csv",
                                "sun_elevation_deg,sun_azimuth_deg,view_elevation_deg,azimuth_deg,"
                                "wavelength_nm,radiance_w_m2_sr_nm,standard_error\n"
                                "-3,230,10,200,550,1,0.1\n-3,240,10,250,550,1,0.1\n");
  const Measurement m = read_measurement(csv, scene_with().scene);
  ASSERT_EQ(m.suns.size(), 2u);
  EXPECT_NEAR(m.views[m.values[0].views[0].first].relative_azimuth_rad, -30 * kRadPerDeg, 1e-12);
  EXPECT_NEAR(m.views[m.values[1].views[0].first].relative_azimuth_rad, 10 * kRadPerDeg, 1e-12);
}

// Whoever reads radiances that `twilight radiance` printed has the Sun of the scene.
TEST(Measurement, TakesTheScenesSunAndARelativeError) {
  const TemporaryFolder folder;
  const auto csv = folder.write("a.csv",
                                "# comment\nview_elevation_deg,relative_azimuth_deg,wavelength_nm,"
                                "radiance_w_m2_sr_nm,standard_error,degree_of_polarisation\n"
                                "90,0,550,0.5,,\n10,-30,450,0.25,,\n");
  const Measurement m = read_measurement(csv, scene_with().scene, 0.02);
  ASSERT_EQ(m.values.size(), 2u);
  EXPECT_EQ(m.suns.size(), 1u);
  EXPECT_NEAR(m.suns[0].elevation_rad, -3 * kRadPerDeg, 1e-12);
  EXPECT_DOUBLE_EQ(m.values[1].standard_error, 0.005);
  EXPECT_EQ(m.values[1].line, 4);
  EXPECT_EQ(scene_for(scene_with().scene, m).spectrum.wavelengths_nm,
            (std::vector<double>{450, 550}));
}

TEST(Measurement, TimesAreSunsOfThePlace) {
  const TemporaryFolder folder;
  LoadedScene scene = load_scene_text(
      "[observer]\nlatitude_deg = 49.23\nlongitude_deg = 7.0\ntime = 2003-12-08T16:40:00+01:00\n",
      "s.toml");
  const auto csv =
      folder.write("z.csv",
                   "time,luminance_cd_m2,standard_error\n"
                   "2003-12-08T16:40:00+01:00,100,1\n2003-12-08T17:10:00+01:00,1,0.1\n");
  const Measurement m = read_measurement(csv, scene.scene);
  ASSERT_EQ(m.suns.size(), 2u);
  EXPECT_NEAR(m.suns[0].elevation_rad, build_scene_model(scene.scene).sun_elevation_rad, 1e-12);
  EXPECT_LT(m.suns[1].elevation_rad, m.suns[0].elevation_rad);
  EXPECT_LT(m.suns[0].distance_au, 0.99);  // December
}

void expect_refusal(const std::function<void()>& action,
                    const std::vector<std::string>& fragments) {
  try {
    action();
    ADD_FAILURE() << "nothing was refused: " << fragments.front();
  } catch (const std::invalid_argument& error) {
    for (const std::string& f : fragments) EXPECT_THAT(error.what(), HasSubstr(f));
  }
}

TEST(Measurement, RefusesRowsByFileAndLine) {
  const TemporaryFolder folder;
  const std::string header =
      "view_elevation_deg,relative_azimuth_deg,wavelength_nm,radiance_w_m2_sr_nm,standard_error\n";
  const auto refused = [&](const std::string& text, const std::vector<std::string>& fragments) {
    const auto csv = folder.write("bad.csv", text);
    expect_refusal([&] { read_measurement(csv, scene_with().scene); }, fragments);
  };
  refused(header + "90,0,550,0.5,0.01\n91,0,550,0.5,0.01\n",
          {"bad.csv:3", "view_elevation_deg", "91", "-90..90"});
  refused(header + "90,0,550,0.5\n", {"bad.csv:2", "4 values", "5"});
  refused(header + "90,0,270,0.5,0.1\n", {"bad.csv:2", "wavelength_nm", "280..1000"});
  refused(header + "90,0,550,-1,0.1\n", {"bad.csv:2", "radiance_w_m2_sr_nm", "-1"});
  refused(header + "90,0,550,nan,0.1\n", {"bad.csv:2", "nan"});
  refused(header + "90,0,550,1,0\n", {"bad.csv:2", "standard_error", "above 0"});
  refused(header, {"bad.csv", "no data"});
  refused(
      "sun_elevation_deg,view_elevation_deg,azimuth_deg,wavelength_nm,radiance_w_m2_sr_nm,"
      "standard_error\n1,1,1,550,1,1\n",
      {"bad.csv", "sun_azimuth_deg"});
  refused("luminance_cd_m2,magnitude_per_arcsec2,standard_error\n1,1,1\n", {"bad.csv", "both"});
  refused("sun_elevation_deg,time,luminance_cd_m2,standard_error\n1,1,1,1\n", {"bad.csv", "both"});
  refused("magnitude_per_arcsec2,magnitude_band,standard_error\n1,X,1\n",
          {"bad.csv:2", "magnitude_band", "U, B, V, R or I"});
  refused("view_elevation_deg,wavelength_nm\n1,2\n", {"bad.csv", "relative_azimuth_deg"});
  refused("time,luminance_cd_m2,standard_error\n2003-12-08T16:40:00+01:00,1,1\n",
          {"bad.csv:2", "time", "place"});
}

TEST(AirRetrieval, RefusesKeysThatCannotBeFree) {
  const TemporaryFolder folder;
  const auto csv = folder.write("sky.csv",
                                "view_elevation_deg,relative_azimuth_deg,wavelength_nm,"
                                "radiance_w_m2_sr_nm,standard_error\n90,0,550,1,0.1\n");
  const auto refused = [&](const std::string& free, const std::vector<std::string>& fragments) {
    expect_refusal([&] { plan_retrieval(scene_with(), options_for(csv, {free})); }, fragments);
  };
  refused("atmosphere.ozon_du", {"--free atmosphere.ozon_du", "atmosphere.ozone_du"});
  refused("aerosols.type", {"--free aerosols.type", "number"});
  refused("atmosphere.layers=10..50", {"integer"});
  refused("dust_layer.optical_depth_550nm=0..1", {"LOW above 0"});
  refused("sun.elevation_deg=-5..5", {"the air, the ground or the aerosols"});
  refused("observer.height_m=0..500", {"the air, the ground or the aerosols"});
  refused("atmosphere.top_km", {"no usual range", "LOW..HIGH"});
  refused("aerosols.angstrom_exponent", {"no usual range", "LOW..HIGH"});
  refused("atmosphere.ozone_du=400..200", {"LOW below HIGH"});
  refused("atmosphere.ozone_du=400", {"LOW..HIGH"});
  refused("atmosphere.ozone_du=0..2000", {"1000"});
  refused("atmosphere.ozone_du,atmosphere.ozone_du", {"twice"});
  refused("atmosphere.ozone_du,earth.ground_albedo", {"sky.csv", "1 data cannot tell 2"});
}

TEST(Photograph, RefusesWhatIsNoPhotograph) {
  const Photograph photo;
  const auto refused = [&](const std::string& text, const std::vector<std::string>& fragments) {
    const auto toml = photo.folder.write("bad.toml", text);
    expect_refusal([&] { read_measurement(toml, scene_with().scene); }, fragments);
  };
  const std::string start = "kind = \"photograph\"\nfile = \"photo.exr\"\n";
  refused("kind = \"photo\"\n", {"bad.toml:1", "photo", "zenith_curve"});
  refused("kind = \"photograph\"\n", {"bad.toml", "file"});
  refused("kind = \"photograph\"\nfile = \"none.exr\"\n", {"none.exr"});
  refused(start + "azimut = 3\n", {"bad.toml:3", "azimut", "unknown"});
  refused(start + "relative_error = 0\n", {"bad.toml:3", "relative_error"});
  refused(start + "exposure = \"auto\"\n", {"bad.toml:3", "exposure"});
  refused(start + "mask = \"photo.toml\"\n", {"photo.toml"});
  refused(start + "[camera]\nazimuth_deg = 1\n", {"bad.toml:3", "camera.elevation_deg"});
  refused(start + "[[star]]\nx = 1\ny = 2\nazimuth_deg = 3\nelevation_deg = 4\n",
          {"bad.toml", "two stars"});
  refused(start + "lowest_elevation_deg = 80\n", {"bad.toml", "no block"});
  photo.folder.write("small.pgm", "P2\n2 2\n255\n0 0 0 0\n");
  refused(start + "mask = \"small.pgm\"\n", {"small.pgm", "2 x 2"});
  photo.folder.write("eight.pgm", "P2\n2 2\n255\n0 0 0 0\n");
  refused("kind = \"photograph\"\nfile = \"eight.pgm\"\n", {"eight.pgm", "8 bits"});
}

}  // namespace
}  // namespace twilight
