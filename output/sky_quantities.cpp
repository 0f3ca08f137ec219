#include "output/sky_quantities.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>

#include "output/colour_temperature.h"
#include "output/photometry.h"
#include "output/scene_colour.h"
#include "output/scene_map.h"
#include "output/ubvri.h"
#include "sim/relative_difference.h"
#include "solar/solar_spectrum.h"
#include "solar/twilight_events.h"

namespace twilight {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kRadPerDeg = std::numbers::pi / 180;

using Names = std::vector<std::string>;

std::vector<ViewDirection> directions_of(const std::vector<WantedView>& views) {
  std::vector<ViewDirection> directions;
  for (const WantedView& v : views) {
    directions.push_back({v.elevation_deg * kRadPerDeg, v.azimuth_deg * kRadPerDeg});
  }
  return directions;
}

/// Everything that is measured of one sky.
class Observation {
 public:
  Observation(const Sky& sky, const SceneModel& model, const WantedQuantities& wanted,
              const RunControl& control, KnownTwilight* known)
      : sky_(sky),
        model_(model),
        wanted_(wanted),
        control_(control),
        known_(known),
        photopic_(colour_integrator(model, ColourObserver::kCie1931)),
        wavelengths_(sky.wavelength_nm().size()) {}

  std::vector<StudyQuantity> run();

 private:
  void add(std::string name, NetcdfMeaning meaning, Names dimensions, std::vector<double> values) {
    quantities_.push_back(
        {std::move(name), std::move(meaning), std::move(dimensions), std::move(values), false});
  }
  bool wants(SkyQuantity q) const { return wanted_.wants(q); }

  void look();
  void texture();
  void radiance();
  void irradiance();
  void illuminance();
  void chromaticity();
  void magnitudes();
  void polarisation();
  void twilight_duration();

  std::span<const double> spectrum(std::size_t view) const {
    return std::span(light_.i).subspan(view * wavelengths_, wavelengths_);
  }
  double lux(std::span<const double> irradiance) const {
    return illuminance_lux(photopic_, irradiance, sky_.solar_irradiance());
  }

  const Sky& sky_;
  const SceneModel& model_;
  const WantedQuantities& wanted_;
  const RunControl& control_;
  KnownTwilight* known_;
  ColourIntegrator photopic_;
  std::size_t wavelengths_;

  StokesRadiance light_;        // of the views
  Irradiance irradiance_;       // where wanted
  std::vector<double> global_;  // direct and diffuse
  std::vector<StudyQuantity> quantities_;
};

void check_values(std::span<const double> values, std::string_view what) {
  for (const double v : values) {
    if (std::isfinite(v) && v >= 0) continue;
    throw std::logic_error(fmt::format("{} is {}: must be finite and >= 0", what, v));
  }
}

void Observation::look() {
  const std::vector<ViewDirection> views = directions_of(wanted_.views);
  if (wants(SkyQuantity::kPolarisation)) {
    light_ = sky_.stokes(views);
  } else if (wants(SkyQuantity::kRadiance) || wants(SkyQuantity::kChromaticity) ||
             wants(SkyQuantity::kMagnitudes)) {
    light_.i = sky_.radiance(views);
  }
  check_values(light_.i, "radiance of a view");
  control_.check();
  if (wants(SkyQuantity::kIrradiance) || wants(SkyQuantity::kIlluminance) ||
      wants(SkyQuantity::kChromaticity)) {
    irradiance_ = sky_.irradiance();
    check_values(irradiance_.direct, "direct irradiance");
    check_values(irradiance_.diffuse, "diffuse irradiance");
    global_.resize(wavelengths_);
    std::ranges::transform(irradiance_.direct, irradiance_.diffuse, global_.begin(), std::plus<>());
  }
  control_.check();
}

void Observation::texture() {
  MapSettings settings = map_settings(model_);
  settings.size = wanted_.texture_size;
  settings.spectral = wanted_.texture == TextureContent::kSpectral;
  settings.colour =
      wanted_.texture == TextureContent::kXyz ? MapColour::kXyz : MapColour::kLinearRec709;
  const ColourObserver observer = colour_observer_from_name(model_.scene.output.colour_observer);
  const SkyMap map = render_map(sky_, colour_integrator(model_, observer), settings, control_);
  const SkyImage& image = settings.spectral ? *map.spectral : map.colour;
  const std::size_t channels = image.channels.size(), pixels = image.pixels.size() / channels;
  std::vector<double> values(image.pixels.size());
  for (std::size_t p = 0; p < pixels; ++p) {
    for (std::size_t c = 0; c < channels; ++c) {
      // Spectra: a plane per wavelength; colours stay together.
      const std::size_t at = settings.spectral ? c * pixels + p : p * channels + c;
      values[at] = image.pixels[p * channels + c];
    }
  }
  if (settings.spectral) {
    add("texture", {"W m-2 sr-1 nm-1", "spectral radiance of the sky", ""},
        {"wavelength", "y", "x"}, std::move(values));
  } else if (wanted_.texture == TextureContent::kRgb) {
    add("texture", {"1", "linear Rec. 709 colour of the sky, (1, 1, 1) = 683 cd m-2", ""},
        {"y", "x", "channel"}, std::move(values));
  } else {
    add("texture", {"W m-2 sr-1", "X, Y, Z of the sky, times 683 lm W-1 for cd m-2", ""},
        {"y", "x", "channel"}, std::move(values));
  }
  quantities_.back().single_precision = true;
}

void Observation::radiance() {
  add("radiance",
      {"W m-2 sr-1 nm-1", "spectral radiance of the sky",
       "surface_downwelling_radiance_per_unit_wavelength_in_air"},
      {"view", "wavelength"}, light_.i);
}

void Observation::irradiance() {
  const Names by = {"wavelength"};
  add("direct_irradiance",
      {"W m-2 nm-1", "spectral irradiance of the horizontal by the Sun's disc", ""}, by,
      irradiance_.direct);
  add("diffuse_irradiance", {"W m-2 nm-1", "spectral irradiance of the horizontal by the sky", ""},
      by, irradiance_.diffuse);
  add("irradiance",
      {"W m-2 nm-1", "spectral irradiance of the horizontal by Sun and sky",
       "surface_downwelling_radiative_flux_per_unit_wavelength_in_air"},
      by, global_);
}

void Observation::illuminance() {
  add("direct_illuminance", {"lux", "illuminance of the horizontal by the Sun's disc", ""}, {},
      {lux(irradiance_.direct)});
  add("diffuse_illuminance", {"lux", "illuminance of the horizontal by the sky", ""}, {},
      {lux(irradiance_.diffuse)});
  add("illuminance", {"lux", "illuminance of the horizontal by Sun and sky", ""}, {},
      {lux(global_)});
}

// x, y and correlated colour temperature; NaN of darkness.
std::array<double, 3> colour_of(const Tristimulus& xyz) {
  if (!(xyz[0] + xyz[1] + xyz[2] > 0)) return {kNone, kNone, kNone};
  const std::array<double, 2> xy = chromaticity(xyz);
  return {xy[0], xy[1], correlated_colour_temperature_K(xy)};
}

void Observation::chromaticity() {
  const std::size_t views = wanted_.views.size();
  std::vector<double> luminance(views), x(views), y(views), temperature(views);
  for (std::size_t v = 0; v < views; ++v) {
    const Tristimulus xyz = photopic_.xyz(spectrum(v), sky_.solar_irradiance());
    const auto colour = colour_of(xyz);
    luminance[v] = kLuminousEfficacy_lm_w * xyz[1];
    x[v] = colour[0], y[v] = colour[1], temperature[v] = colour[2];
  }
  const Names by = {"view"};
  add("luminance", {"cd m-2", "luminance of the sky", ""}, by, std::move(luminance));
  add("chromaticity_x", {"1", "CIE 1931 x of the sky", ""}, by, std::move(x));
  add("chromaticity_y", {"1", "CIE 1931 y of the sky", ""}, by, std::move(y));
  add("colour_temperature", {"K", "correlated colour temperature of the sky", ""}, by,
      std::move(temperature));
  const auto light = colour_of(photopic_.xyz(global_, sky_.solar_irradiance()));
  add("horizontal_chromaticity_x", {"1", "CIE 1931 x of the light on the horizontal", ""}, {},
      {light[0]});
  add("horizontal_chromaticity_y", {"1", "CIE 1931 y of the light on the horizontal", ""}, {},
      {light[1]});
  add("horizontal_colour_temperature",
      {"K", "correlated colour temperature of the light on the horizontal", ""}, {}, {light[2]});
}

void Observation::magnitudes() {
  const double per_distance = 1.0 / (model_.sun_distance_au * model_.sun_distance_au);
  const UbvriIntegrator bands(sky_.wavelength_nm(), [&](double nm) {
    return per_distance * solar_irradiance_w_m2_nm(model_.scene.sun.spectrum, nm);
  });
  std::vector<double> magnitudes;
  for (std::size_t v = 0; v < wanted_.views.size(); ++v) {
    const UbvriValues m = bands.surface_brightness(spectrum(v), sky_.solar_irradiance());
    magnitudes.insert(magnitudes.end(), m.begin(), m.end());
  }
  // UDUNITS knows no magnitude; the name says what one is of.
  add("magnitude", {"1", "surface brightness, mag arcsec-2 (Bessell UBVRI, Vega 0.03)", ""},
      {"view", "band"}, std::move(magnitudes));
  const std::array<ViewDirection, 1> zenith = {ViewDirection{std::numbers::pi / 2, 0}};
  const std::vector<double> overhead = sky_.radiance(zenith);
  check_values(overhead, "radiance of the zenith");
  const UbvriValues m = bands.surface_brightness(overhead, sky_.solar_irradiance());
  add("zenith_magnitude",
      {"1", "surface brightness of the zenith, mag arcsec-2 (Bessell UBVRI, Vega 0.03)", ""},
      {"band"}, {m.begin(), m.end()});
}

// Per view and wavelength; empty where the solver is scalar.
std::vector<double> degrees_of_polarisation(const StokesRadiance& light) {
  std::vector<double> degree(light.q.size());
  for (std::size_t k = 0; k < degree.size(); ++k) {
    degree[k] =
        light.i[k] > 0 ? std::min(std::hypot(light.q[k], light.u[k]) / light.i[k], 1.0) : kNone;
  }
  return degree;
}

void Observation::polarisation() {
  std::vector<double> degree = degrees_of_polarisation(light_);
  std::vector<double> largest(wavelengths_, kNone);
  if (degree.empty()) {
    degree.assign(wanted_.views.size() * wavelengths_, kNone);
  } else {
    const std::vector<ViewDirection> views = polarisation_views(model_.sun_elevation_rad);
    const std::vector<double> all = degrees_of_polarisation(sky_.stokes(views));
    for (std::size_t k = 0; k < all.size(); ++k) {
      double& most = largest[k % wavelengths_];
      most = std::fmax(most, all[k]);  // NaN gives way
    }
  }
  add("degree_of_polarisation", {"1", "degree of linear polarisation of the sky", ""},
      {"view", "wavelength"}, std::move(degree));
  add("maximum_degree_of_polarisation",
      {"1", "largest degree of linear polarisation above 2 degrees", ""}, {"wavelength"},
      std::move(largest));
}

void Observation::twilight_duration() {
  KnownTwilight own;
  const std::vector<double> depressions =
      (known_ != nullptr ? *known_ : own)
          .depressions_deg(sky_, photopic_, wanted_.twilight_thresholds_lux, control_);
  const std::array<double, 3> limits = {-kCivilTwilightElevationDeg, -kNauticalTwilightElevationDeg,
                                        -kAstronomicalTwilightElevationDeg};
  std::vector<double> minutes(depressions.size(), kNone), almanac(limits.size(), kNone);
  const auto place = place_of(model_.scene);
  if (place && model_.scene.observer.time) {
    minutes = minutes_after_sunset(*place, *model_.scene.observer.time, depressions);
    almanac = minutes_after_sunset(*place, *model_.scene.observer.time, limits);
  }
  const Names by = {"threshold"};
  add("twilight_sun_depression",
      {"degree", "depression of the Sun at which the illuminance falls to the threshold", ""}, by,
      depressions);
  add("twilight_duration",
      {"minute", "time from sunset until the illuminance falls to the threshold", ""}, by,
      std::move(minutes));
  const std::array<const char*, 3> names = {"civil", "nautical", "astronomical"};
  for (std::size_t k = 0; k < names.size(); ++k) {
    add(fmt::format("{}_twilight_duration", names[k]),
        {"minute",
         fmt::format("time from sunset until the Sun is {:g} degrees below the horizon", limits[k]),
         ""},
        {}, {almanac[k]});
  }
}

std::vector<StudyQuantity> Observation::run() {
  look();
  using Part = std::pair<SkyQuantity, void (Observation::*)()>;
  constexpr std::array<Part, 8> kParts = {{
      {SkyQuantity::kTexture, &Observation::texture},
      {SkyQuantity::kRadiance, &Observation::radiance},
      {SkyQuantity::kIrradiance, &Observation::irradiance},
      {SkyQuantity::kIlluminance, &Observation::illuminance},
      {SkyQuantity::kChromaticity, &Observation::chromaticity},
      {SkyQuantity::kMagnitudes, &Observation::magnitudes},
      {SkyQuantity::kPolarisation, &Observation::polarisation},
      {SkyQuantity::kTwilightDuration, &Observation::twilight_duration},
  }};
  for (const auto& [quantity, part] : kParts) {
    if (wants(quantity)) (this->*part)();
    control_.check();
  }
  return std::move(quantities_);
}

StudyCoordinate pixels_of(const char* name, const char* what, int count) {
  StudyCoordinate c{name, {"1", what, ""}, {}, {}};
  for (int k = 0; k < count; ++k) c.values.push_back(k + 0.5);
  return c;
}

}  // namespace

std::vector<ViewDirection> polarisation_views(double sun_elevation_rad) {
  constexpr double kLowest_rad = 2 * kRadPerDeg, kStep_rad = 2 * kRadPerDeg;
  std::vector<ViewDirection> views;
  for (const ViewDirection& v : coarse_hemisphere(6, 5).views) {
    if (v.elevation_rad >= kLowest_rad) views.push_back(v);
  }
  // The Sun's vertical about a right angle from the Sun, beyond the zenith for one above the
  // horizon: there the light scattered once by air is most polarised.
  for (int k = -10; k <= 10; ++k) {
    const double along = sun_elevation_rad + std::numbers::pi / 2 + k * kStep_rad;
    const bool beyond = along > std::numbers::pi / 2;
    const double elevation = beyond ? std::numbers::pi - along : along;
    if (elevation >= kLowest_rad) views.push_back({elevation, beyond ? std::numbers::pi : 0.0});
  }
  return views;
}

std::vector<StudyCoordinate> quantity_coordinates(const WantedQuantities& wanted,
                                                  const Scene& scene) {
  std::vector<StudyCoordinate> all;
  const bool texture = wanted.wants(SkyQuantity::kTexture);
  const bool by_view =
      wanted.wants(SkyQuantity::kRadiance) || wanted.wants(SkyQuantity::kChromaticity) ||
      wanted.wants(SkyQuantity::kMagnitudes) || wanted.wants(SkyQuantity::kPolarisation);
  const bool spectral = texture && wanted.texture == TextureContent::kSpectral;
  if (spectral || wanted.wants(SkyQuantity::kRadiance) || wanted.wants(SkyQuantity::kIrradiance) ||
      wanted.wants(SkyQuantity::kPolarisation)) {
    all.push_back({"wavelength",
                   {"nm", "wavelength", "radiation_wavelength"},
                   scene.spectrum.wavelengths_nm,
                   {}});
  }
  if (by_view) {
    StudyCoordinate views{
        "view", {"", "elevation and azimuth from the Sun's, degrees", ""}, {}, {}};
    for (const WantedView& v : wanted.views) {
      views.words.push_back(fmt::format("el {:g} az {:g}", v.elevation_deg, v.azimuth_deg));
    }
    all.push_back(std::move(views));
  }
  if (wanted.wants(SkyQuantity::kMagnitudes)) {
    all.push_back({"band",
                   {"", "photometric band (Bessell 1990)", ""},
                   {},
                   {kUbvriBands.begin(), kUbvriBands.end()}});
  }
  if (wanted.wants(SkyQuantity::kTwilightDuration)) {
    all.push_back({"threshold",
                   {"lux", "horizontal illuminance that twilight falls to", ""},
                   wanted.twilight_thresholds_lux,
                   {}});
  }
  if (texture) {
    const MapProjection projection = map_projection(scene, 0.0);
    const std::string kind(projection_name(projection.kind));
    all.push_back(pixels_of("y", ("pixel centres of the " + kind + " map, down").c_str(),
                            map_height(projection, wanted.texture_size)));
    all.push_back(pixels_of("x", ("pixel centres of the " + kind + " map, to the right").c_str(),
                            map_width(projection, wanted.texture_size)));
    if (!spectral) {
      const bool rgb = wanted.texture == TextureContent::kRgb;
      all.push_back({"channel",
                     {"", rgb ? "linear Rec. 709" : "CIE tristimulus value", ""},
                     {},
                     rgb ? Names{"R", "G", "B"} : Names{"X", "Y", "Z"}});
    }
  }
  return all;
}

std::vector<StudyQuantity> quantity_shapes(const WantedQuantities& wanted,
                                           const std::vector<StudyCoordinate>& coordinates) {
  const Names none = {}, wavelength = {"wavelength"}, view = {"view"}, threshold = {"threshold"};
  const bool spectral = wanted.texture == TextureContent::kSpectral;
  const std::vector<std::tuple<SkyQuantity, const char*, Names>> all = {
      {SkyQuantity::kTexture, "texture",
       spectral ? Names{"wavelength", "y", "x"} : Names{"y", "x", "channel"}},
      {SkyQuantity::kRadiance, "radiance", {"view", "wavelength"}},
      {SkyQuantity::kIrradiance, "direct_irradiance", wavelength},
      {SkyQuantity::kIrradiance, "diffuse_irradiance", wavelength},
      {SkyQuantity::kIrradiance, "irradiance", wavelength},
      {SkyQuantity::kIlluminance, "direct_illuminance", none},
      {SkyQuantity::kIlluminance, "diffuse_illuminance", none},
      {SkyQuantity::kIlluminance, "illuminance", none},
      {SkyQuantity::kChromaticity, "luminance", view},
      {SkyQuantity::kChromaticity, "chromaticity_x", view},
      {SkyQuantity::kChromaticity, "chromaticity_y", view},
      {SkyQuantity::kChromaticity, "colour_temperature", view},
      {SkyQuantity::kChromaticity, "horizontal_chromaticity_x", none},
      {SkyQuantity::kChromaticity, "horizontal_chromaticity_y", none},
      {SkyQuantity::kChromaticity, "horizontal_colour_temperature", none},
      {SkyQuantity::kMagnitudes, "magnitude", {"view", "band"}},
      {SkyQuantity::kMagnitudes, "zenith_magnitude", {"band"}},
      {SkyQuantity::kPolarisation, "degree_of_polarisation", {"view", "wavelength"}},
      {SkyQuantity::kPolarisation, "maximum_degree_of_polarisation", wavelength},
      {SkyQuantity::kTwilightDuration, "twilight_sun_depression", threshold},
      {SkyQuantity::kTwilightDuration, "twilight_duration", threshold},
      {SkyQuantity::kTwilightDuration, "civil_twilight_duration", none},
      {SkyQuantity::kTwilightDuration, "nautical_twilight_duration", none},
      {SkyQuantity::kTwilightDuration, "astronomical_twilight_duration", none},
  };
  std::vector<StudyQuantity> shapes;
  for (const auto& [quantity, name, dimensions] : all) {
    if (!wanted.wants(quantity)) continue;
    std::size_t size = quantity == SkyQuantity::kTexture ? 0 : 1;
    for (const std::string& d : dimensions) {
      size *= std::ranges::find(coordinates, d, &StudyCoordinate::name)->size();
    }
    shapes.push_back({name, {}, dimensions, std::vector<double>(size, kNone), false});
  }
  return shapes;
}

std::vector<StudyQuantity> observe(const Sky& sky, const SceneModel& model,
                                   const WantedQuantities& wanted, const RunControl& control,
                                   KnownTwilight* known) {
  return Observation(sky, model, wanted, control, known).run();
}

namespace {

std::optional<SkyImage> case_image(const Sky& sky, const SceneModel& model, int size,
                                   const RunControl& control) {
  if (size == 0) return std::nullopt;
  MapSettings settings = map_settings(model);
  settings.size = size;
  settings.spectral = false;
  const ColourObserver observer = colour_observer_from_name(model.scene.output.colour_observer);
  return render_map(sky, colour_integrator(model, observer), settings, control).colour;
}

}  // namespace

std::optional<SkyImage> case_picture(const Sky& sky, const SceneModel& model,
                                     const WantedQuantities& wanted, const RunControl& control) {
  return case_image(sky, model, wanted.picture_size, control);
}

std::optional<SkyImage> case_exr(const Sky& sky, const SceneModel& model,
                                 const WantedQuantities& wanted, const RunControl& control) {
  return case_image(sky, model, wanted.exr_size, control);
}

}  // namespace twilight
