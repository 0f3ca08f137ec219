#include "output/sky_quantities.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "output/colour_temperature.h"
#include "output/photometry.h"
#include "output/scene_colour.h"
#include "output/scene_map.h"
#include "output/sky_image.h"
#include "output/twilight_duration.h"
#include "output/ubvri.h"
#include "sim/scene_file.h"
#include "solar/solar_spectrum.h"
#include "solar/twilight_events.h"
#include "tests/sim/small_scene.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using ::testing::HasSubstr;

constexpr double kPi = std::numbers::pi;
constexpr double kRadPerDeg = kPi / 180;

std::vector<double> even(double first, double last, double step) {
  std::vector<double> values;
  for (double v = first; v <= last + 1e-9; v += step) values.push_back(v);
  return values;
}

/// Light of a formula from everywhere, as polarised as Rayleigh scattering makes it.
class FormulaSky : public Sky {
 public:
  FormulaSky(const SceneModel& model, double radiance, bool polarised)
      : model_(model), radiance_(radiance), polarised_(polarised) {}

  std::span<const double> wavelength_nm() const override { return model_.medium.wavelength_nm; }
  std::span<const double> solar_irradiance() const override { return model_.solar_irradiance; }
  std::vector<double> radiance(std::span<const ViewDirection> views) const override {
    return std::vector<double>(views.size() * wavelength_nm().size(), radiance_);
  }
  StokesRadiance stokes(std::span<const ViewDirection> views) const override {
    StokesRadiance light{radiance(views), {}, {}, {}};
    if (!polarised_) return light;
    for (const ViewDirection& v : views) {
      const double h = model_.sun_elevation_rad;
      const double mu = std::sin(h) * std::sin(v.elevation_rad) +
                        std::cos(h) * std::cos(v.elevation_rad) * std::cos(v.relative_azimuth_rad);
      const double degree = (1 - mu * mu) / (1 + mu * mu);
      for (std::size_t w = 0; w < wavelength_nm().size(); ++w) {
        light.q.push_back(-0.6 * degree * radiance_);
        light.u.push_back(0.8 * degree * radiance_);
      }
    }
    return light;
  }
  Irradiance irradiance() const override {
    const std::size_t n = wavelength_nm().size();
    return {std::vector<double>(n, 0.0), std::vector<double>(n, kPi * radiance_)};
  }
  double apparent_sun_elevation_rad() const override { return model_.sun_elevation_rad; }
  std::vector<double> sun_transmittance() const override {
    return std::vector<double>(wavelength_nm().size(), 0.0);
  }
  const RunSummary& summary() const override { return summary_; }

 private:
  const SceneModel& model_;
  double radiance_;
  bool polarised_;
  RunSummary summary_;
};

SceneModel model_at(std::vector<double> wavelengths_nm, double sun_deg = -4,
                    const std::string& spectrum = "unit") {
  Scene scene = small_scene(sun_deg);
  scene.spectrum.wavelengths_nm = std::move(wavelengths_nm);
  scene.sun.spectrum = spectrum;
  scene.output.size = 8;
  return build_scene_model(scene);
}

WantedQuantities everything() {
  WantedQuantities wanted;
  wanted.quantities = {SkyQuantity::kTexture,      SkyQuantity::kRadiance,
                       SkyQuantity::kIrradiance,   SkyQuantity::kIlluminance,
                       SkyQuantity::kChromaticity, SkyQuantity::kMagnitudes,
                       SkyQuantity::kPolarisation, SkyQuantity::kTwilightDuration};
  wanted.texture_size = 6;
  wanted.picture_size = 16;
  return wanted;
}

const StudyQuantity& named(const std::vector<StudyQuantity>& all, const std::string& name) {
  const auto found = std::ranges::find(all, name, &StudyQuantity::name);
  if (found == all.end()) throw std::runtime_error("no quantity " + name);
  return *found;
}

void expect_sizes_of_coordinates(const std::vector<StudyQuantity>& all,
                                 const std::vector<StudyCoordinate>& coordinates) {
  std::set<std::string> used, names;
  for (const StudyQuantity& q : all) {
    EXPECT_TRUE(names.insert(q.name).second) << q.name << " twice";
    EXPECT_FALSE(q.meaning.long_name.empty()) << q.name;
    std::size_t size = 1;
    for (const std::string& d : q.dimensions) {
      const auto c = std::ranges::find(coordinates, d, &StudyCoordinate::name);
      ASSERT_NE(c, coordinates.end()) << q.name << " along " << d;
      size *= c->size();
      used.insert(d);
    }
    EXPECT_EQ(q.values.size(), size) << q.name;
    for (const double v : q.values) EXPECT_FALSE(std::isinf(v)) << q.name;
  }
  EXPECT_EQ(used.size(), coordinates.size()) << "a coordinate that nothing uses";
}

TEST(SkyQuantities, HaveTheSizesOfTheirCoordinates) {
  const SceneModel model = model_at(even(380, 780, 20));
  for (const bool polarised : {true, false}) {
    const FormulaSky sky(model, 0.02, polarised);
    for (const auto texture :
         {TextureContent::kSpectral, TextureContent::kRgb, TextureContent::kXyz}) {
      WantedQuantities wanted = everything();
      wanted.texture = texture;
      expect_sizes_of_coordinates(observe(sky, model, wanted),
                                  quantity_coordinates(wanted, model.scene));
    }
    for (const SkyQuantity one : everything().quantities) {
      WantedQuantities wanted = everything();
      wanted.quantities = {one};
      expect_sizes_of_coordinates(observe(sky, model, wanted),
                                  quantity_coordinates(wanted, model.scene));
    }
  }
}

TEST(SkyQuantities, AreKnownInShapeBeforeAnySky) {
  const SceneModel model = model_at(even(380, 780, 20));
  const FormulaSky sky(model, 0.02, true);
  for (const auto texture : {TextureContent::kSpectral, TextureContent::kRgb}) {
    WantedQuantities wanted = everything();
    wanted.texture = texture;
    const auto shapes = quantity_shapes(wanted, quantity_coordinates(wanted, model.scene));
    const auto all = observe(sky, model, wanted);
    ASSERT_EQ(shapes.size(), all.size());
    for (std::size_t k = 0; k < all.size(); ++k) {
      EXPECT_EQ(shapes[k].name, all[k].name);
      EXPECT_EQ(shapes[k].dimensions, all[k].dimensions) << all[k].name;
      if (all[k].name == "texture") continue;
      EXPECT_EQ(shapes[k].values.size(), all[k].values.size()) << all[k].name;
    }
    wanted.quantities = {SkyQuantity::kRadiance};
    EXPECT_EQ(quantity_shapes(wanted, quantity_coordinates(wanted, model.scene)).size(), 1u);
  }
}

TEST(SkyQuantities, OfDarknessAreNumbersOrNone) {
  const SceneModel model = model_at(even(380, 780, 20));
  const FormulaSky sky(model, 0.0, true);
  const auto all = observe(sky, model, everything());
  expect_sizes_of_coordinates(all, quantity_coordinates(everything(), model.scene));
  EXPECT_EQ(named(all, "illuminance").values[0], 0);
  EXPECT_TRUE(std::isnan(named(all, "zenith_magnitude").values[2]));
  EXPECT_TRUE(std::isnan(named(all, "horizontal_chromaticity_x").values[0]));
  EXPECT_TRUE(std::isnan(named(all, "degree_of_polarisation").values[0]));
}

TEST(SkyQuantities, AnIsotropicSkyGivesTheHorizontalPiTimesItsLight) {
  const SceneModel model = model_at(even(380, 780, 10), -4, "gueymard2004");
  const FormulaSky sky(model, 0.02, false);
  const auto all = observe(sky, model, everything());
  const double luminance = named(all, "luminance").values[0];
  EXPECT_NEAR(named(all, "illuminance").values[0], kPi * luminance, 1e-9 * luminance);
  EXPECT_EQ(named(all, "direct_illuminance").values[0], 0);
  for (std::size_t w = 0; w < sky.wavelength_nm().size(); ++w) {
    EXPECT_NEAR(named(all, "irradiance").values[w], kPi * named(all, "radiance").values[w], 1e-12);
  }
  // The same light has the same colour from everywhere.
  EXPECT_NEAR(named(all, "chromaticity_x").values[3],
              named(all, "horizontal_chromaticity_x").values[0], 1e-12);
  EXPECT_NEAR(named(all, "colour_temperature").values[0],
              named(all, "horizontal_colour_temperature").values[0], 1e-6);
}

TEST(SkyQuantities, EqualEnergyIsAtOneThird) {
  const SceneModel model = model_at(even(360, 830, 8));
  const FormulaSky sky(model, 0.02, false);
  const auto all = observe(sky, model, everything());
  EXPECT_NEAR(named(all, "chromaticity_x").values[0], 1.0 / 3, 2e-4);
  EXPECT_NEAR(named(all, "chromaticity_y").values[0], 1.0 / 3, 2e-4);
  // Illuminant E: 5455 K (CIE 15).
  EXPECT_NEAR(named(all, "colour_temperature").values[0], 5455, 10);
}

TEST(SkyQuantities, TenTimesTheLightIsTwoAndAHalfMagnitudes) {
  const SceneModel model = model_at(even(380, 780, 20), -4, "gueymard2004");
  const FormulaSky dim(model, 1e-6, false), bright(model, 1e-5, false);
  const auto a = observe(dim, model, everything()), b = observe(bright, model, everything());
  for (const std::size_t band : {1U, 2U}) {  // B, V
    EXPECT_NEAR(
        named(a, "zenith_magnitude").values[band] - named(b, "zenith_magnitude").values[band], 2.5,
        1e-12);
    EXPECT_NEAR(named(a, "magnitude").values[5 + band], named(a, "zenith_magnitude").values[band],
                1e-12);
  }
  for (const std::size_t band : {0U, 3U, 4U}) {  // U, R, I are outside 380..780 nm
    EXPECT_TRUE(std::isnan(named(a, "zenith_magnitude").values[band]));
  }
}

TEST(SkyQuantities, LightScatteredOnceAtARightAngleIsPolarisedWholly) {
  for (const double sun : {-12.0, -4.0, 0.0, 30.0, 60.0}) {
    const SceneModel model = model_at({450, 550}, sun);
    const FormulaSky sky(model, 0.02, true);
    WantedQuantities wanted = everything();
    wanted.quantities = {SkyQuantity::kPolarisation};
    wanted.views = {{0, 90}, {0, -90}, {0, 0}};
    const auto all = observe(sky, model, wanted);
    EXPECT_NEAR(named(all, "degree_of_polarisation").values[0], 1, 1e-12) << sun;
    EXPECT_NEAR(named(all, "degree_of_polarisation").values[2], 1, 1e-12) << sun;
    const double mu = std::cos(sun * kRadPerDeg);
    EXPECT_NEAR(named(all, "degree_of_polarisation").values[4], (1 - mu * mu) / (1 + mu * mu),
                1e-12);
    for (const double most : named(all, "maximum_degree_of_polarisation").values) {
      EXPECT_NEAR(most, 1, 1e-3) << sun;
    }
  }
}

TEST(SkyQuantities, ScalarLightHasNoDegreeOfPolarisation) {
  const SceneModel model = model_at({450, 550});
  const FormulaSky sky(model, 0.02, false);
  const auto all = observe(sky, model, everything());
  for (const char* name : {"degree_of_polarisation", "maximum_degree_of_polarisation"}) {
    for (const double v : named(all, name).values) EXPECT_TRUE(std::isnan(v)) << name;
  }
}

TEST(SkyQuantities, TexturesAreTheMapOfTheScene) {
  const SceneModel model = model_at({450, 550, 650});
  const FormulaSky sky(model, 0.02, false);
  WantedQuantities wanted = everything();
  wanted.quantities = {SkyQuantity::kTexture};
  MapSettings settings = map_settings(model);
  settings.size = wanted.texture_size;
  settings.spectral = true;
  const SkyMap map = render_map(sky, colour_integrator(model, ColourObserver::kCie1931), settings);
  const auto spectra = named(observe(sky, model, wanted), "texture");
  wanted.texture = TextureContent::kRgb;
  const auto colours = named(observe(sky, model, wanted), "texture");
  EXPECT_TRUE(spectra.single_precision);
  const std::size_t pixels = 36;
  ASSERT_EQ(spectra.values.size(), 3 * pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(spectra.values[c * pixels + p], map.spectral->pixels[3 * p + c]);
      EXPECT_EQ(colours.values[3 * p + c], map.colour.pixels[3 * p + c]);
    }
  }
  const auto picture = case_picture(sky, model, wanted);
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->height, 16);
  wanted.picture_size = 0;
  EXPECT_FALSE(case_picture(sky, model, wanted));
}

// Of the solver itself, one order of scattering of a Sun on the horizon.
TEST(SkyQuantities, SkiesOfTheOrdersAreObservedWhole) {
  Scene scene = small_scene(-3);
  scene.solver.method = "orders";
  scene.solver.scattering_orders = 1;
  scene.earth.ground_albedo = 0;
  scene.sun.disc_average = false;
  scene.atmosphere.depolarisation = 0;
  scene.solver.zenith_step_deg = 3;
  scene.solver.altitude_levels = 20;
  scene.solver.polar_directions = 12;
  scene.solver.azimuth_directions = 8;
  scene.output.size = 16;
  const SceneModel model = build_scene_model(scene);
  const auto sky = solve_sky(model);
  WantedQuantities wanted = everything();
  const auto all = observe(*sky, model, wanted);
  expect_sizes_of_coordinates(all, quantity_coordinates(wanted, model.scene));
  for (const double most : named(all, "maximum_degree_of_polarisation").values) {
    EXPECT_GT(most, 0.985);  // refraction turns the rays by half a degree, no more
    EXPECT_LE(most, 1);
  }
  const auto& depression = named(all, "twilight_sun_depression").values;
  EXPECT_LT(depression[0], depression[1]);
  EXPECT_LT(depression[1], depression[2]);
  // They are those of the air, to the bit, whatever the Sun.
  KnownTwilight known;
  WantedQuantities duration;
  duration.quantities = {SkyQuantity::kTwilightDuration};
  for (const double sun : {-3.0, 20.0}) {
    const auto other = sky->with_sun_at(sun * kRadPerDeg);
    for (KnownTwilight* memory : {static_cast<KnownTwilight*>(nullptr), &known}) {
      EXPECT_EQ(
          named(observe(*other, model, duration, {}, memory), "twilight_sun_depression").values,
          depression);
    }
  }
  // At the depression found the light is the threshold's: 0.01 degrees of it are 1.2 %.
  const auto there = sky->with_sun_at(-depression[0] * kRadPerDeg);
  WantedQuantities light;
  light.quantities = {SkyQuantity::kIlluminance};
  EXPECT_NEAR(named(observe(*there, model, light), "illuminance").values[0] / 3.4, 1, 0.013);
}

TEST(Ubvri, TheSunHasItsMagnitudeAndColours) {
  // V = -26.76 (Bessell, Castelli & Plez 1998); colours of solar twins, Ramirez et al. (2012, ApJ
  // 752, 5): B-V = 0.653 +- 0.005, U-B = 0.166 +- 0.022, V-R = 0.352 +- 0.007, V-I = 0.702 +-
  // 0.010. The tables of the Sun differ from each other by 3 % in these bands, 0.03 mag.
  const std::vector<double> wavelengths = even(300, 930, 1);
  for (const char* name : {"gueymard2004", "kurucz1992", "astm_g173"}) {
    const auto solar = [&](double nm) { return solar_irradiance_w_m2_nm(name, nm); };
    const UbvriIntegrator bands(wavelengths, solar);
    std::vector<double> spectrum;
    for (const double nm : wavelengths) spectrum.push_back(solar(nm));
    const UbvriValues means = bands.means(spectrum, spectrum);
    UbvriValues m;
    for (std::size_t b = 0; b < 5; ++b) m[b] = ubvri_magnitude(b, means[b]);
    EXPECT_NEAR(m[2], -26.76, 0.02) << name;
    EXPECT_NEAR(m[1] - m[2], 0.653, 0.03) << name;
    EXPECT_NEAR(m[0] - m[1], 0.166, 0.055) << name;
    EXPECT_NEAR(m[2] - m[3], 0.352, 0.03) << name;
    EXPECT_NEAR(m[2] - m[4], 0.702, 0.04) << name;
  }
}

TEST(Ubvri, BandsAreMeasuredOnlyWhereTheWavelengthsHoldThem) {
  const auto one = [](double) { return 1.0; };
  const auto measured = [&](double first, double last) {
    const UbvriIntegrator bands(even(first, last, 10), one);
    std::string text;
    for (std::size_t b = 0; b < 5; ++b) text += bands.measures(b) ? kUbvriBands[b] : "-";
    return text;
  };
  EXPECT_EQ(measured(300, 930), "UBVRI");
  EXPECT_EQ(measured(380, 780), "-BV--");
  EXPECT_EQ(measured(390, 780), "--V--");  // 5 % of B are below 390 nm
  EXPECT_EQ(measured(310, 850), "UBVR-");
  EXPECT_EQ(measured(313, 903), "UBVRI");
  EXPECT_EQ(measured(500, 600), "-----");
  EXPECT_EQ(measured(550, 550), "-----");
}

TEST(Ubvri, ARayleighSkyNeedsFewWavelengths) {
  const auto solar = [](double nm) { return solar_irradiance_w_m2_nm("gueymard2004", nm); };
  const auto rayleigh = [&](const std::vector<double>& wavelengths) {
    std::vector<double> e0, light;
    for (const double nm : wavelengths) {
      e0.push_back(solar(nm));
      light.push_back(e0.back() * std::pow(550 / nm, 4));
    }
    return UbvriIntegrator(wavelengths, solar).surface_brightness(light, e0);
  };
  const UbvriValues few = rayleigh(even(300, 950, 50)), many = rayleigh(even(300, 950, 5));
  for (std::size_t b = 0; b < 5; ++b) EXPECT_NEAR(few[b], many[b], 1e-9);
}

TEST(Ubvri, AnIsotropicSkyAndItsSquareArcsecondsAgree) {
  // The light of all square arcseconds of a sphere is 4 pi times the radiance.
  EXPECT_NEAR(4 * kPi / kSquareArcsecond_sr, 5.34638e11, 1e6);  // 41252.96 deg^2 of 3600^2
  for (std::size_t b = 0; b < 5; ++b) {
    EXPECT_NEAR(ubvri_magnitude(b, ubvri_zero_w_m2_nm(b)), 0, 1e-12);
    const auto [first, last] = ubvri_range_nm(b);
    EXPECT_EQ(ubvri_response(b, first), 0);
    EXPECT_EQ(ubvri_response(b, last), 0);
    EXPECT_EQ(ubvri_response(b, last + 100), 0);
  }
  EXPECT_TRUE(std::isnan(ubvri_magnitude(2, 0)));
  EXPECT_THROW(UbvriIntegrator(std::vector<double>{500, 400}, [](double) { return 1.0; }),
               std::invalid_argument);
}

TEST(ColourTemperature, OfStandardIlluminants) {
  // CIE 15: A 2856 K, D50 5003 K, D55 5503 K, D65 6504 K, D75 7504 K.
  EXPECT_NEAR(correlated_colour_temperature_K({0.44757, 0.40745}), 2856, 2);
  EXPECT_NEAR(correlated_colour_temperature_K({0.34567, 0.35850}), 5003, 3);
  EXPECT_NEAR(correlated_colour_temperature_K({0.33242, 0.34743}), 5503, 3);
  EXPECT_NEAR(correlated_colour_temperature_K({0.31272, 0.32903}), 6504, 4);
  EXPECT_NEAR(correlated_colour_temperature_K({0.29902, 0.31485}), 7504, 5);
}

TEST(ColourTemperature, OfABlackBodyIsItsOwn) {
  for (const double temperature : {1010.0, 1500.0, 2856.0, 6504.0, 15000.0, 1e5}) {
    EXPECT_NEAR(
        correlated_colour_temperature_K(chromaticity(black_body_xyz(temperature))) / temperature, 1,
        1e-3);
  }
}

TEST(ColourTemperature, IsNoneWhereItHasNoMeaning) {
  for (const std::array<double, 2> xy :
       {std::array{0.23, 0.22}, std::array{0.30, 0.60}, std::array{0.73, 0.26},
        std::array{0.17, 0.01}, std::array{std::nan(""), 0.3}}) {
    EXPECT_TRUE(std::isnan(correlated_colour_temperature_K(xy))) << xy[0] << " " << xy[1];
  }
}

TEST(TwilightDuration, IsFoundToAHundredthOfADegree) {
  int asked = 0;
  const auto light = [&](double sun) {
    ++asked;
    return 400 * std::pow(10, 0.36 * sun - 0.004 * sun * std::abs(sun) * (sun < 0 ? -1 : 1));
  };
  const std::vector<double> thresholds = {3.4, 0.008, 6e-4};
  const auto depressions = twilight_depressions_deg(light, thresholds);
  const int needed = asked;
  for (std::size_t k = 0; k < thresholds.size(); ++k) {
    EXPECT_GE(light(-depressions[k] + 0.006), thresholds[k]);
    EXPECT_LE(light(-depressions[k] - 0.006), thresholds[k]);
  }
  for (std::size_t k = 1; k < thresholds.size(); ++k) {
    EXPECT_GT(depressions[k], depressions[k - 1]);
  }
  EXPECT_LE(needed, 20);
}

TEST(TwilightDuration, IsNoneWhereTheLightStaysOrLacks) {
  const std::vector<double> thresholds = {1e5, 10, 1e-5};
  const auto found = twilight_depressions_deg(
      [](double sun) { return sun > 0     ? 1000.0
                              : sun > -20 ? 100.0
                                          : 1e-3; }, thresholds);
  EXPECT_TRUE(std::isnan(found[0]));
  EXPECT_NEAR(found[1], 20, 0.01);  // a step, which no secant finds
  EXPECT_TRUE(std::isnan(found[2]));
  // Nights without any light end the search too.
  const auto dark = twilight_depressions_deg([](double sun) { return sun > -9 ? 5.0 : 0.0; },
                                             std::vector<double>{1.0, 1e-3});
  EXPECT_NEAR(dark[0], 9, 0.01);
  EXPECT_NEAR(dark[1], 9, 0.01);
}

TEST(TwilightDuration, OfTheAlmanacIsItsEventsApart) {
  const Place place{49.25, 6.97, 0};
  const std::string time = "2003-12-08T17:00:00+01:00";
  const TwilightTimes day = twilight_times(place, parse_offset_date_time(time), 60);
  const std::vector<double> depressions = {50.0 / 60, 6, 12, 18, -5, 90};
  const auto minutes = minutes_after_sunset(place, time, depressions);
  EXPECT_NEAR(minutes[0], 0, 1e-3);
  EXPECT_NEAR(minutes[1], 1440 * days_between(*day.sunset, *day.civil_end), 1e-3);
  EXPECT_NEAR(minutes[2], 1440 * days_between(*day.sunset, *day.nautical_end), 1e-3);
  EXPECT_NEAR(minutes[3], 1440 * days_between(*day.sunset, *day.astronomical_end), 1e-3);
  EXPECT_LT(minutes[4], 0);
  EXPECT_TRUE(std::isnan(minutes[5]));
  // Midsummer in Scotland: it never gets 12 degrees down; further north the Sun never sets.
  const Place scotland{58, -4, 0}, north{75, 20, 0};
  const auto summer =
      minutes_after_sunset(scotland, "2003-06-21T12:00:00Z", std::vector<double>{6, 12});
  EXPECT_GT(summer[0], 50);
  EXPECT_TRUE(std::isnan(summer[1]));
  EXPECT_TRUE(
      std::isnan(minutes_after_sunset(north, "2003-06-21T12:00:00Z", std::vector<double>{6})[0]));
}

TEST(TwilightDuration, OfAnEveningPastMidnightBelongsToIt) {
  // Civil twilight of 60 degrees north ends after local midnight near midsummer.
  const Place place{60, 15, 0};
  const auto minutes =
      minutes_after_sunset(place, "2003-06-21T12:00:00+02:00", std::vector<double>{6});
  EXPECT_GT(minutes[0], 60);
  EXPECT_LT(minutes[0], 180);
}

TEST(SkyQuantities, KnowTheMinutesWhereTheSceneHasPlaceAndTime) {
  Scene scene = small_scene(-4);
  scene.sun.elevation_deg.reset();
  scene.observer.latitude_deg = 49.25;
  scene.observer.longitude_deg = 6.97;
  scene.observer.time = "2003-12-08T17:00:00+01:00";
  const SceneModel model = build_scene_model(scene);
  const FormulaSky sky(model, 0.02, false);
  const auto all = observe(sky, model, everything());
  EXPECT_NEAR(named(all, "civil_twilight_duration").values[0], 36, 2);
  // A sky that knows no other Suns tells nothing of thresholds.
  for (const double d : named(all, "twilight_sun_depression").values) EXPECT_TRUE(std::isnan(d));
  for (const double d : named(all, "twilight_duration").values) EXPECT_TRUE(std::isnan(d));
}

TEST(SkyQuantities, RefuseLightThatIsNone) {
  const SceneModel model = model_at({450, 550});
  EXPECT_THROW(observe(FormulaSky(model, -1, false), model, everything()), std::logic_error);
  EXPECT_THROW(observe(FormulaSky(model, std::nan(""), false), model, everything()),
               std::logic_error);
}

TEST(WantedQuantities, DefaultWhereTheFileSaysNothing) {
  const TemporaryFolder folder;
  const auto none = read_wanted_quantities(folder.write("a.toml", "scene = \"s.toml\"\n[outputs]"));
  const auto absent = read_wanted_quantities(folder.write("b.toml", "[[axis]]\nkey = \"x\"\n"));
  EXPECT_EQ(canonical_text(none), canonical_text(WantedQuantities{}));
  EXPECT_EQ(canonical_text(absent), canonical_text(WantedQuantities{}));
  EXPECT_TRUE(none.wants(SkyQuantity::kIlluminance));
  EXPECT_FALSE(none.wants(SkyQuantity::kTexture));
}

TEST(WantedQuantities, AreReadWhole) {
  const TemporaryFolder folder;
  const auto wanted = read_wanted_quantities(folder.write("study.toml", R"([outputs]
quantities = ["twilight_duration", "texture", "illuminance"]
views = [[90, 0], [5.5, -30]]
texture = "xyz"
texture_size = 32
picture_size = 0
twilight_thresholds_lux = [100, 1]
plots = [{x = "sun.elevation_deg", y = "illuminance", series = "aerosols.type", log = true},
         {x = "illuminance", y = "radiance"}]
)"));
  EXPECT_EQ(wanted.quantities, (std::vector{SkyQuantity::kTexture, SkyQuantity::kIlluminance,
                                            SkyQuantity::kTwilightDuration}));
  ASSERT_EQ(wanted.views.size(), 2u);
  EXPECT_EQ(wanted.views[1].elevation_deg, 5.5);
  EXPECT_EQ(wanted.views[1].azimuth_deg, -30);
  EXPECT_EQ(wanted.texture, TextureContent::kXyz);
  EXPECT_EQ(wanted.texture_size, 32);
  EXPECT_EQ(wanted.picture_size, 0);
  EXPECT_EQ(wanted.twilight_thresholds_lux, (std::vector<double>{100, 1}));
  ASSERT_EQ(wanted.plots.size(), 2u);
  EXPECT_EQ(wanted.plots[0].series, "aerosols.type");
  EXPECT_EQ(wanted.plots[0].logarithmic, true);
  EXPECT_FALSE(wanted.plots[1].logarithmic);
}

TEST(WantedQuantities, RefuseWhatIsWrongByFileLineAndKey) {
  struct Bad {
    const char* text;
    const char* complaint;
  };
  constexpr Bad kBad[] = {
      {"outputs = 3", "study.toml:1: key 'outputs' = 3: must be a table"},
      {"[outputs]\nview = 3",
       "study.toml:2: key 'outputs.view' = 3: unknown key; must be one of "
       "quantities, views, texture"},
      {"[outputs]\nquantities = []", ":2: key 'outputs.quantities' = []: must be an array of 1..8"},
      {"[outputs]\nquantities = [\"colour\"]", "must be one of \"texture\", \"radiance\""},
      {"[outputs]\nquantities = [\n\"radiance\",\n\"radiance\"]", ":4: key 'outputs.quantities'"},
      {"[outputs]\nquantities = \"radiance\"", "must be an array"},
      {"[outputs]\nviews = [[91, 0]]", ":2: key 'outputs.views' = 91: must be a number, -90..90"},
      {"[outputs]\nviews = [[10, 361]]", "must be a number, -360..360"},
      {"[outputs]\nviews = [10, 20]", "must be a pair [elevation, azimuth from the Sun's]"},
      {"[outputs]\nviews = [[10, 20, 30]]", "must be a pair"},
      {"[outputs]\nviews = [[10, nan]]", "must be a number"},
      {"[outputs]\nviews = [[10, 20], [10, 20]]", "is given twice"},
      {"[outputs]\ntexture = \"png\"", "must be one of \"spectral\", \"rgb\", \"xyz\""},
      {"[outputs]\ntexture_size = 3",
       "key 'outputs.texture_size' = 3: must be an integer, 4..4096"},
      {"[outputs]\ntexture_size = 64.5", "must be an integer"},
      {"[outputs]\npicture_size = 5", "must be an integer, 0 or 16..1024"},
      {"[outputs]\ntwilight_thresholds_lux = [0]", "must be a number, 1e-06..100000"},
      {"[outputs]\ntwilight_thresholds_lux = [1, 2]", "must be below the one before it"},
      {"[outputs]\ntwilight_thresholds_lux = []", "must be an array of 1..100"},
      {"[outputs]\nplots = [3]", "must be tables"},
      {"[outputs]\nplots = [{x = \"a\"}]", "key 'outputs.plots.y' = (none): must be given"},
      {"[outputs]\nplots = [{x = 1, y = \"b\"}]", "key 'outputs.plots.x' = 1: must be a string"},
      {"[outputs]\nplots = [{x = \"a\", y = \"b\", colour = 1}]",
       "key 'outputs.plots.colour' = 1: unknown key; must be one of x, y, series, log"},
      {"[outputs]\nplots = [{x = \"a\", y = \"b\", log = 1}]", "must be true or false"},
      {"[outputs\n", "not valid TOML"},
  };
  const TemporaryFolder folder;
  for (const Bad& bad : kBad) {
    const auto file = folder.write("study.toml", bad.text);
    try {
      read_wanted_quantities(file);
      ADD_FAILURE() << "accepted: " << bad.text;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr(bad.complaint)) << bad.text;
      EXPECT_THAT(error.what(), HasSubstr("study.toml:")) << bad.text;
    }
  }
  EXPECT_THROW(read_wanted_quantities(folder.path / "none.toml"), std::runtime_error);
}

TEST(WantedQuantities, CanonicalTextTellsAllButPlots) {
  const WantedQuantities base;
  std::set<std::string> texts = {canonical_text(base)};
  const auto differs = [&](auto change) {
    WantedQuantities other = base;
    change(other);
    return texts.insert(canonical_text(other)).second;
  };
  EXPECT_TRUE(differs([](auto& w) { w.quantities.pop_back(); }));
  EXPECT_TRUE(differs([](auto& w) { w.views[1].azimuth_deg = 1e-9; }));
  EXPECT_TRUE(differs([](auto& w) { w.views[1].elevation_deg = 21; }));
  EXPECT_TRUE(differs([](auto& w) { w.texture = TextureContent::kRgb; }));
  EXPECT_TRUE(differs([](auto& w) { w.texture_size = 65; }));
  EXPECT_TRUE(differs([](auto& w) { w.picture_size = 0; }));
  EXPECT_TRUE(differs([](auto& w) { w.twilight_thresholds_lux[2] = 6.1e-4; }));
  EXPECT_FALSE(differs([](auto& w) { w.plots.push_back({"a", "b"}); }));
}

TEST(WantedQuantities, PlotsOfColumnsThatAreNotThereAreRefused) {
  WantedQuantities wanted;
  const std::vector<std::string> columns = {"sun.elevation_deg", "aerosols.type", "illuminance",
                                            "radiance[el 90 az 0, 550 nm]"};
  wanted.plots = {{"sun.elevation_deg", "illuminance", "aerosols.type", {}, "s.toml:7"},
                  {"illuminance", "radiance", "", {}, "s.toml:8"}};
  EXPECT_NO_THROW(check_plots(wanted, columns, 2));
  const auto complaint = [&](WantedPlot plot) {
    wanted.plots = {std::move(plot)};
    try {
      check_plots(wanted, columns, 2);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(complaint({"sun", "illuminance", "", {}, "s.toml:7"}),
              HasSubstr("s.toml:7: key 'outputs.plots.x' = \"sun\": must be a column"));
  EXPECT_THAT(complaint({"illuminance", "radian", "", {}, "s.toml:7"}),
              HasSubstr("key 'outputs.plots.y' = \"radian\""));
  EXPECT_THAT(complaint({"illuminance", "radiance", "illuminance", {}, "s.toml:7"}),
              HasSubstr("must be an axis: sun.elevation_deg, aerosols.type"));
}

}  // namespace
}  // namespace twilight
