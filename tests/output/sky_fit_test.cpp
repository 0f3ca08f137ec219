// Forms fitted to skies: what is known comes back, what is found is what the file says.
#include "output/sky_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "output/fit_file.h"
#include "output/fit_report.h"
#include "output/perez_fit.h"
#include "sim/models/fitted_sky.h"
#include "tests/sim/small_scene.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using std::numbers::pi;

// The sky of a form at fit_views().
std::vector<FormSample> sky_of(SkyForm form, std::span<const double> coefficients, double scale,
                               double sun_zenith_rad) {
  std::vector<FormSample> samples;
  for (const WeightedView& v : fit_views()) {
    const double up = std::sin(v.direction.elevation_rad);
    const double cosine = up * std::cos(sun_zenith_rad) +
                          std::cos(v.direction.elevation_rad) * std::sin(sun_zenith_rad) *
                              std::cos(v.direction.relative_azimuth_rad);
    const double gamma = std::acos(std::clamp(cosine, -1.0, 1.0));
    samples.push_back({std::min(up, 1.0), gamma, v.solid_angle_sr / (2 * pi),
                       scale * sky_form_value(form, coefficients, std::min(up, 1.0), gamma)});
  }
  return samples;
}

// Preetham et al. (1999), A.2: luminance as a function of turbidity.
std::vector<double> preetham_luminance(double t) {
  return {0.1787 * t - 1.4630, -0.3554 * t + 0.4275, -0.0227 * t + 5.3251, 0.1206 * t - 2.5771,
          -0.0670 * t + 0.3703};
}

void expect_same_coefficients(const std::vector<double>& found, const std::vector<double>& known,
                              double tolerance) {
  ASSERT_EQ(found.size(), known.size());
  for (std::size_t k = 0; k < known.size(); ++k) {
    EXPECT_NEAR(found[k], known[k], tolerance * std::max(1.0, std::abs(known[k])))
        << coefficient_name(k);
  }
}

TEST(FitViews, AreThreeHundredFortyThreeOverTheHemisphere) {
  const std::vector<WeightedView> views = fit_views();
  EXPECT_EQ(views.size(), 343u);  // Preetham et al. (1999), Sec. 3.2
  double sum = 0, lambert = 0;
  for (const WeightedView& v : views) {
    sum += v.solid_angle_sr;
    lambert += v.solid_angle_sr * std::sin(v.direction.elevation_rad);
    EXPECT_GT(v.direction.elevation_rad, 0);
  }
  EXPECT_NEAR(sum, 2 * pi, 1e-12);
  EXPECT_NEAR(lambert, pi, 2e-3 * pi);  // the midpoint rule's error at 5 degrees
}

TEST(FitError, OfAUniformExcessIsThatExcess) {
  const std::vector<double> value(343, 2.0), form(343, 2.2);
  const FitError e = fit_error(form, value);
  for (const double measure : {e.rms, e.p95, e.largest, e.bias}) EXPECT_NEAR(measure, 0.1, 1e-12);
}

TEST(PerezFit, RecoversAKnownSkyByDayAndTwilight) {
  for (const double turbidity : {2.0, 3.0, 6.0}) {
    const std::vector<double> known = preetham_luminance(turbidity);
    for (const double elevation_deg : {80.0, 30.0, 5.0, -3.0, -12.0}) {
      SCOPED_TRACE(testing::Message() << "T " << turbidity << ", Sun " << elevation_deg);
      const double zenith = (90 - elevation_deg) * pi / 180;
      const auto sky = sky_of(SkyForm::kPerez, known, 3e-7, zenith);
      const FormFit fit = fit_form(SkyForm::kPerez, sky, zenith);
      EXPECT_TRUE(fit.converged) << fit.termination;
      expect_same_coefficients(fit.coefficients, known, 1e-4);
      EXPECT_NEAR(fit.normalisation / (3e-7 * sky_form_value(SkyForm::kPerez, known, 1, zenith)), 1,
                  1e-6);
      EXPECT_LT(fit.rms_log, 1e-6);
      EXPECT_TRUE(fit.bounds_hit.empty());
    }
  }
}

TEST(PerezFit, BadStartsEndInTheSameSky) {
  const std::vector<double> known = preetham_luminance(3);
  const auto sky = sky_of(SkyForm::kPerez, known, 1, 1.0);
  const std::vector<double> corners[] = {
      {1e3, -20, 1e5, 1e6, 3, 1e6}, {-0.9999, -1e-4, 1e-4, 0, -20, 1e-7}, {0, -1, 1, 0, 0, 1}};
  for (const auto& start : corners) {
    const FormFit fit = fit_form(SkyForm::kPerez, sky, 1.0, std::span(&start, 1));
    expect_same_coefficients(fit.coefficients, known, 1e-4);
  }
}

TEST(PerezFit, AGoodStartWins) {
  const auto sky = sky_of(SkyForm::kPerez, preetham_luminance(3), 1, 1.0);
  const FormFit fit = fit_form(SkyForm::kPerez, sky, 1.0);
  EXPECT_EQ(fit_form(SkyForm::kPerez, sky, 1.0, std::span(&fit.parameters, 1)).start, 0);
}

// A sky that is black but for its horizon, and one that falls away from the Sun to nothing: the
// best form would not stay positive.
TEST(PerezFit, EndsOnItsBoundsWhereTheSkyAsksForMore) {
  for (const bool at_horizon : {true, false}) {
    auto sky = sky_of(SkyForm::kPerez, preetham_luminance(3), 1, 1.0);
    for (FormSample& s : sky) {
      s.value = at_horizon ? std::exp(-30 * s.cos_zenith) : std::exp(-40 * s.sun_angle_rad);
    }
    const FormFit fit = fit_form(SkyForm::kPerez, sky, 1.0);
    EXPECT_FALSE(fit.bounds_hit.empty());
    EXPECT_TRUE(sky_form_is_positive(SkyForm::kPerez, fit.coefficients));
  }
}

TEST(PerezFit, SaysWhenItDidNotConverge) {
  const auto sky = sky_of(SkyForm::kPerez, preetham_luminance(3), 1, 1.0);
  const FormFit fit = fit_form(SkyForm::kPerez, sky, 1.0, {}, 1);
  EXPECT_FALSE(fit.converged);
  EXPECT_THAT(fit.termination, testing::HasSubstr("NO_CONVERGENCE"));
}

TEST(PerezFit, RefusesSkiesWithoutLight) {
  auto sky = sky_of(SkyForm::kPerez, preetham_luminance(3), 1, 1.0);
  sky[7].value = 0;
  EXPECT_THROW(fit_form(SkyForm::kPerez, sky, 1.0), std::invalid_argument);
  EXPECT_THROW(fit_form(SkyForm::kPerez, {}, 1.0), std::invalid_argument);
}

// Terms that do not imitate one another; published sets have such, too (a steep glow and a broad
// peak), but also ones where c and d nearly cancel, of which only the sum is known.
TEST(HosekFit, RecoversAKnownSky) {
  const std::vector<double> known = {-1.1, -0.3, 0.6, 5.0, -3.0, 0.4, 0.15, 0.6, 0.5};
  for (const double elevation_deg : {40.0, 5.0, -6.0}) {
    SCOPED_TRACE(elevation_deg);
    const double zenith = (90 - elevation_deg) * pi / 180;
    const auto sky = sky_of(SkyForm::kHosek, known, 2.0, zenith);
    const FormFit fit = fit_form(SkyForm::kHosek, sky, zenith);
    EXPECT_TRUE(fit.converged) << fit.termination;
    EXPECT_LT(fit.rms_log, 1e-6);
    // The scale is shared between the radiance and c, d, f, g, i: the mean of the form is 1.
    double mean = 0;
    for (const FormSample& s : sky) {
      mean += s.weight * sky_form_value(SkyForm::kHosek, known, s.cos_zenith, s.sun_angle_rad);
    }
    std::vector<double> scaled = known;
    for (const std::size_t k : {2, 3, 5, 6, 8}) scaled[k] /= mean;
    expect_same_coefficients(fit.coefficients, scaled, 1e-3);
    EXPECT_NEAR(fit.normalisation, 2.0 * mean, 1e-6 * mean);
  }
}

TEST(FormParameters, GoThereAndBack) {
  const std::vector<double> perez = preetham_luminance(2);
  expect_same_coefficients(
      form_coefficients_of(SkyForm::kPerez, form_parameters_of(SkyForm::kPerez, perez)), perez,
      1e-12);
  const std::vector<double> hosek = {-1.1, -0.3, 0.6, 5.0, -3.0, 0.4, 0.15, 0.6, 0.5};
  expect_same_coefficients(
      form_coefficients_of(SkyForm::kHosek, form_parameters_of(SkyForm::kHosek, hosek)), hosek,
      1e-12);
}

TEST(FormParameters, DerivativesAreThoseOfTheForm) {
  const std::vector<double> points[] = {{-0.6, -0.5, 0.8, 4, -2, 1.3},
                                        {-0.5, -0.3, 0.4, 3, -2, 0.7, 0.2, 0.6, 0.4}};
  for (const SkyForm form : {SkyForm::kPerez, SkyForm::kHosek}) {
    const std::vector<double>& x = points[form == SkyForm::kPerez ? 0 : 1];
    ASSERT_EQ(x.size(), form_parameters(form).size());
    for (const double cos_zenith : {1.0, 0.4, 0.03}) {
      for (const double gamma : {0.0, 0.4, 2.0, pi}) {
        std::vector<double> gradient(x.size());
        log_form(form, x.data(), cos_zenith, gamma, gradient.data());
        for (std::size_t k = 0; k < x.size(); ++k) {
          constexpr double kStep = 1e-6;
          std::vector<double> up = x, down = x;
          up[k] += kStep;
          down[k] -= kStep;
          const double slope = (log_form(form, up.data(), cos_zenith, gamma, nullptr) -
                                log_form(form, down.data(), cos_zenith, gamma, nullptr)) /
                               (2 * kStep);
          EXPECT_NEAR(gradient[k], slope, 1e-7 * std::max(1.0, std::abs(slope)))
              << sky_form_name(form) << ' ' << form_parameters(form)[k].name << ' ' << gamma;
        }
      }
    }
  }
}

TEST(FormParameters, LogarithmIsThatOfTheForm) {
  const std::vector<double> perez = preetham_luminance(2),
                            hosek = {-1.1, -0.3, 0.6, 5.0, -3.0, 0.4, 0.15, 0.6, 0.5};
  for (const SkyForm form : {SkyForm::kPerez, SkyForm::kHosek}) {
    const auto& k = form == SkyForm::kPerez ? perez : hosek;
    const std::vector<double> x = form_parameters_of(form, k);
    EXPECT_NEAR(log_form(form, x.data(), 0.3, 1.1, nullptr),
                std::log(sky_form_value(form, k, 0.3, 1.1)), 1e-12);
  }
}

// Coefficients over two axes, to be rendered and fitted again.
SkyFit synthetic_fit() {
  SkyFit fit;
  FitCoefficients& c = fit.coefficients;
  c.axes = {{"aerosols.optical_depth_550nm", {0.1, 0.4}}, {"sun.elevation_deg", {-5, 10}}};
  c.wavelength_nm = {450, 550};
  c.solar_spectrum = "unit";
  c.solar_irradiance = {1, 1};
  fit.channel_names = {"450", "550"};
  for (std::size_t n = 0; n < 4; ++n) {
    for (std::size_t w = 0; w < 2; ++w) {
      const auto k =
          preetham_luminance(2.0 + static_cast<double>(n) + 0.3 * static_cast<double>(w));
      c.coefficients.insert(c.coefficients.end(), k.begin(), k.end());
      c.normalisation.push_back((1.0 / 3) * static_cast<double>(1 + n + w));
      c.sun_transmittance.push_back(n % 2 == 0 ? 0.0 : 0.1 + 0.2 * static_cast<double>(n));
    }
    c.converged.push_back(true);
  }
  fit.channels.resize(8);
  fit.luminance.resize(4);
  return fit;
}

void expect_same(const FitCoefficients& a, const FitCoefficients& b) {
  EXPECT_EQ(a.form, b.form);
  EXPECT_EQ(a.quantity, b.quantity);
  ASSERT_EQ(a.axes.size(), b.axes.size());
  for (std::size_t k = 0; k < a.axes.size(); ++k) {
    EXPECT_EQ(a.axes[k].key, b.axes[k].key);
    EXPECT_EQ(a.axes[k].values, b.axes[k].values);
  }
  EXPECT_EQ(a.wavelength_nm, b.wavelength_nm);
  EXPECT_EQ(a.solar_spectrum, b.solar_spectrum);
  EXPECT_EQ(a.solar_irradiance, b.solar_irradiance);
  EXPECT_EQ(a.coefficients, b.coefficients);
  EXPECT_EQ(a.normalisation, b.normalisation);
  EXPECT_EQ(a.sun_transmittance, b.sun_transmittance);
  EXPECT_EQ(a.converged, b.converged);
}

TEST(FitFile, KeepsEveryBit) {
  const TemporaryFolder folder;
  const SkyFit fit = synthetic_fit();
  const std::string file = folder.write("fit.json", fit_json(fit, "twilight"));
  expect_same(read_fit_coefficients(file), fit.coefficients);
}

Study study_of(Scene scene, std::vector<StudyAxis> axes) {
  Study study;
  study.scene.scene = std::move(scene);
  study.axes = std::move(axes);
  study.cross();
  return study;
}

// A fit of a fitted sky: the whole way from a scene to coefficients and back.
TEST(SkyFit, RecoversTheCoefficientsOfASyntheticSky) {
  const TemporaryFolder folder;
  const SkyFit known = synthetic_fit();
  Scene scene = small_scene(10);
  scene.spectrum.wavelengths_nm = {450, 550};
  scene.aerosols.type = "continental_average";
  scene.solver.method = "fit:" + folder.write("fit.json", fit_json(known, "twilight")).string();
  Study study = study_of(scene, {});
  for (const FitAxis& axis : known.coefficients.axes)
    study.axes.push_back({axis.key, axis.values, ""});
  study.cross();

  const SkyFit found = fit_skies(study, {});
  EXPECT_EQ(found.not_converged, 0u);
  EXPECT_LT(found.rms_of_all, 1e-6);
  const FitCoefficients& c = found.coefficients;
  expect_same_coefficients(c.coefficients, known.coefficients.coefficients, 1e-4);
  expect_same_coefficients(c.normalisation, known.coefficients.normalisation, 1e-6);
  EXPECT_EQ(c.sun_transmittance, known.coefficients.sun_transmittance);

  study.scene.scene.solver.threads = 4;
  const SkyFit parallel = fit_skies(study, {});
  EXPECT_EQ(fit_json(found, ""), fit_json(parallel, ""));
}

Scene coarse_orders() {
  Scene scene = small_scene(10);
  scene.spectrum.wavelengths_nm = {450, 600};
  scene.solver.method = "orders";
  scene.solver.zenith_step_deg = 3;
  scene.solver.altitude_levels = 10;
  scene.solver.polar_directions = 8;
  scene.solver.azimuth_directions = 4;
  scene.solver.scattering_orders = 2;
  scene.solver.sunlight_nodes = 64;
  return scene;
}

// What the table says of a fit is what a user of the file gets.
TEST(SkyFit, RenderedCoefficientsHaveTheResidualsReported) {
  const TemporaryFolder folder;
  const Scene scene = coarse_orders();
  const std::vector<double> suns_deg = {-4, 20};
  std::vector<ViewDirection> views;
  for (const WeightedView& v : fit_views()) views.push_back(v.direction);
  SceneModel model = build_scene_model(scene);
  std::vector<std::vector<double>> truth;  // [Sun][view and wavelength]
  std::shared_ptr<const OrdersField> field;
  for (const double sun_deg : suns_deg) {
    model.sun_elevation_rad = sun_deg * pi / 180;
    FieldSky solved = field ? sky_from_field(model, field) : solve_sky_and_field(model);
    truth.push_back(solved.sky->radiance(views));
    field = solved.field;
  }
  for (const SkyForm form : {SkyForm::kPerez, SkyForm::kHosek}) {
    SkyFitOptions options;
    options.form = form;
    const SkyFit fit = fit_skies(study_of(scene, {{kSunElevationKey, suns_deg, ""}}), options);
    Scene fitted = scene;
    fitted.solver.method = "fit:" + folder.write("fit.json", fit_json(fit, "twilight")).string();
    for (std::size_t n = 0; n < suns_deg.size(); ++n) {
      fitted.sun.elevation_deg = suns_deg[n];
      const auto rendered = solve_sky(build_scene_model(fitted))->radiance(views);
      for (std::size_t w = 0; w < 2; ++w) {
        std::vector<double> a, b;
        for (std::size_t v = 0; v < views.size(); ++v) {
          a.push_back(rendered[2 * v + w]);
          b.push_back(truth[n][2 * v + w]);
        }
        const FitError seen = fit_error(a, b), said = fit.channels[2 * n + w].error;
        EXPECT_NEAR(seen.rms, said.rms, 1e-9);
        EXPECT_NEAR(seen.p95, said.p95, 1e-9);
        EXPECT_NEAR(seen.largest, said.largest, 1e-9);
        EXPECT_NEAR(seen.bias, said.bias, 1e-9);
        EXPECT_TRUE(fit.channels[2 * n + w].fit.converged);
      }
    }
    const std::string csv = fit_goodness_table(fit).text();
    EXPECT_EQ(std::ranges::count(csv, '\n'), 1 + 2 * 3);
  }
}

TEST(SkyFit, LuminanceAndChromaticitiesHaveThreeChannels) {
  SkyFitOptions options;
  options.quantity = FitQuantity::kLuminanceChromaticity;
  const SkyFit fit = fit_skies(study_of(coarse_orders(), {{kSunElevationKey, {20}, ""}}), options);
  EXPECT_THAT(fit.channel_names, testing::ElementsAre("Y", "x", "y"));
  for (const std::size_t k : {1, 2}) {
    EXPECT_LT(fit.channels[k].error.rms, 0.1);
    EXPECT_GT(fit.coefficients.normalisation[k], 0.1);
    EXPECT_LT(fit.coefficients.normalisation[k], 0.7);
  }
  const TemporaryFolder folder;
  expect_same(read_fit_coefficients(folder.write("f.json", fit_json(fit, ""))), fit.coefficients);
}

TEST(SkyFit, IsStoppedByControl) {
  const std::atomic<bool> stop{true};
  EXPECT_THROW(
      fit_skies(study_of(coarse_orders(), {{kSunElevationKey, {20}, ""}}), {}, {{}, &stop}),
      Cancelled);
}

}  // namespace
}  // namespace twilight
