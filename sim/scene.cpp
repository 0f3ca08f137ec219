#include "sim/scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <span>
#include <stdexcept>
#include <string_view>

#include "sim/models/fit_coefficients.h"
#include "sim/quality.h"
#include "solar/solar_spectrum.h"
#include "solar/time_point.h"

namespace twilight {
namespace {

constexpr std::size_t kMostWavelengths = 64;
constexpr double kShortestAlbedoNm = 200.0, kLongestAlbedoNm = 2500.0;
constexpr double kLowestObserverM = -500.0;  // the shore of the Dead Sea: -430 m
constexpr double kHighestObserverM = 4e7;    // above the geostationary orbit

// Remembers the first complaint and ignores the ones after it.
class Checker {
 public:
  void fail(std::string_view key, std::string message) {
    if (!problem_) problem_ = SceneProblem{std::string(key), std::move(message)};
  }

  // Written so that NaN fails too.
  void range(std::string_view key, double value, double low, double high) {
    if (!(value >= low && value <= high))
      fail(key, fmt::format("= {}: must be {}..{}", value, low, high));
  }

  void range(std::string_view key, int value, int low, int high) {
    if (value < low || value > high)
      fail(key, fmt::format("= {}: must be {}..{}", value, low, high));
  }

  void range(std::string_view key, const std::optional<double>& value, double low, double high) {
    if (value) range(key, *value, low, high);
  }

  void range(std::string_view key, const std::optional<int>& value, int low, int high) {
    if (value) range(key, *value, low, high);
  }

  void one_of(std::string_view key, std::string_view value,
              std::initializer_list<std::string_view> allowed) {
    one_of(key, value, std::span(allowed.begin(), allowed.size()));
  }

  void one_of(std::string_view key, std::string_view value,
              std::span<const std::string_view> allowed) {
    for (std::string_view word : allowed)
      if (value == word) return;
    std::string list;
    for (std::string_view word : allowed)
      list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", word);
    fail(key,
         fmt::format("= \"{}\": must be {}{}", value, allowed.size() > 1 ? "one of " : "", list));
  }

  bool failed() const { return problem_.has_value(); }
  std::optional<SceneProblem> take() { return std::move(problem_); }

 private:
  std::optional<SceneProblem> problem_;
};

void check_sun(const Scene& scene, Checker& check) {
  const ObserverOptions& observer = scene.observer;
  check.range("observer.latitude_deg", observer.latitude_deg, -90.0, 90.0);
  check.range("observer.longitude_deg", observer.longitude_deg, -180.0, 360.0);
  check.range("sun.elevation_deg", scene.sun.elevation_deg, -90.0, 90.0);
  check.range("sun.azimuth_deg", scene.sun.azimuth_deg, -360.0, 360.0);
  if (observer.time) {
    try {
      parse_offset_date_time(*observer.time);
    } catch (const std::invalid_argument& error) {
      check.fail("observer.time", fmt::format("= \"{}\": must be an offset date-time, as "
                                              "2003-12-08T17:00:00+01:00, in the years {}..{}: {}",
                                              *observer.time, kFirstYear, kLastYear, error.what()));
    }
  }
  check.one_of("sun.spectrum", scene.sun.spectrum, solar_spectra());

  const bool any_place = observer.latitude_deg || observer.longitude_deg || observer.time;
  if (any_place && scene.sun.elevation_deg) {
    check.fail("sun.elevation_deg",
               fmt::format("= {}: must not be given together with [observer] latitude_deg, "
                           "longitude_deg or time; give a place and time, or an elevation in "
                           "-90..90, not both",
                           *scene.sun.elevation_deg));
  } else if (any_place) {
    constexpr std::string_view kMissing =
        "is missing: [observer] latitude_deg (-90..90), longitude_deg (-180..360) and time "
        "(an offset date-time) must all be given, or none of them";
    if (!observer.latitude_deg) check.fail("observer.latitude_deg", std::string(kMissing));
    if (!observer.longitude_deg) check.fail("observer.longitude_deg", std::string(kMissing));
    if (!observer.time) check.fail("observer.time", std::string(kMissing));
  } else if (!scene.sun.elevation_deg) {
    check.fail("sun.elevation_deg",
               "is missing: give it (-90..90), or [observer] latitude_deg, longitude_deg and time");
  }
}

void check_albedo(const EarthOptions& earth, Checker& check) {
  check.range("earth.ground_albedo", earth.ground_albedo, 0.0, 1.0);
  constexpr std::string_view kWavelengths = "earth.albedo_wavelengths_nm";
  constexpr std::string_view kSpectrum = "earth.albedo_spectrum";
  const std::vector<double>& wavelengths = earth.albedo_wavelengths_nm;
  const std::vector<double>& spectrum = earth.albedo_spectrum;
  for (std::size_t i = 0; i < wavelengths.size(); ++i) {
    const double value = wavelengths[i];
    if (!(value >= kShortestAlbedoNm && value <= kLongestAlbedoNm)) {
      check.fail(kWavelengths,
                 fmt::format("= {} (value {} of {}): must be {}..{}", value, i + 1,
                             wavelengths.size(), kShortestAlbedoNm, kLongestAlbedoNm));
    }
    if (i > 0 && !(value > wavelengths[i - 1])) {
      check.fail(kWavelengths,
                 fmt::format("= {} (value {} of {}): must be above the value before it, {}; "
                             "wavelengths increase strictly within {}..{}",
                             value, i + 1, wavelengths.size(), wavelengths[i - 1],
                             kShortestAlbedoNm, kLongestAlbedoNm));
    }
  }
  for (std::size_t i = 0; i < spectrum.size(); ++i) {
    if (!(spectrum[i] >= 0.0 && spectrum[i] <= 1.0)) {
      check.fail(kSpectrum, fmt::format("= {} (value {} of {}): must be 0..1", spectrum[i], i + 1,
                                        spectrum.size()));
    }
  }
  if (wavelengths.size() != spectrum.size()) {
    check.fail(kSpectrum, fmt::format("has {} values: must have as many as "
                                      "earth.albedo_wavelengths_nm, {}",
                                      spectrum.size(), wavelengths.size()));
  }
}

// The cells of the paper stand around an observer inside the air; the other methods know every
// height.
void check_height(const Scene& scene, Checker& check) {
  constexpr std::string_view kKey = "observer.height_m";
  const double height_m = scene.observer.height_m;
  if (height_m < 0.0 && scene.atmosphere.optical_layers) {
    return check.fail(kKey, fmt::format("= {}: must be at least 0, the bottom of the lowest layer, "
                                        "where atmosphere.optical_layers is given",
                                        height_m));
  }
  if (scene.solver.method != "cells") {
    return check.range(kKey, height_m, kLowestObserverM, kHighestObserverM);
  }
  const double height_km = height_m / 1000.0, top_km = scene.atmosphere.top_km;
  // A user's own layers bring their own top, which is looked at where they are read.
  if (!(height_m >= kLowestObserverM && (height_km < top_km || scene.atmosphere.optical_layers) &&
        height_km < 200.0)) {
    check.fail(kKey, fmt::format("= {}: must be {} up to below the top of the atmosphere, "
                                 "1000 * atmosphere.top_km = {}, where solver.method is \"cells\", "
                                 "whose cells surround the observer",
                                 height_m, kLowestObserverM, 1000.0 * top_km));
  }
}

void check_added_layer(const Scene& scene, std::string_view table, const AddedLayerOptions& layer,
                       Checker& check) {
  const auto key = [&](std::string_view leaf) { return fmt::format("{}.{}", table, leaf); };
  check.range(key("optical_depth_550nm"), layer.optical_depth_550nm, 0.0, 10.0);
  check.range(key("bottom_km"), layer.bottom_km, 0.0, 120.0);
  check.range(key("top_km"), layer.top_km, 0.0, 120.0);
  if (!(layer.top_km > layer.bottom_km)) {
    check.fail(key("top_km"), fmt::format("= {}: must be above {} = {}", layer.top_km,
                                          key("bottom_km"), layer.bottom_km));
  }
  if (!(layer.optical_depth_550nm > 0.0)) return;
  if (scene.atmosphere.optical_layers) {
    check.fail(key("optical_depth_550nm"),
               fmt::format("= {}: must be 0 where atmosphere.optical_layers is given, which "
                           "replaces all aerosols",
                           layer.optical_depth_550nm));
  } else if (published_air_name(scene).empty() && layer.top_km > scene.atmosphere.top_km) {
    check.fail(key("top_km"), fmt::format("= {}: must be at most atmosphere.top_km = {}",
                                          layer.top_km, scene.atmosphere.top_km));
  }
}

void check_aerosols(const Scene& scene, Checker& check) {
  const AerosolOptions& aerosols = scene.aerosols;
  check.one_of("aerosols.type", aerosols.type,
               {"none", "continental_clean", "continental_average", "continental_polluted", "urban",
                "desert", "maritime_clean", "maritime_polluted", "maritime_tropical", "arctic",
                "antarctic"});
  if (aerosols.mixture && aerosols.mixture->empty())
    check.fail("aerosols.mixture", "= \"\": must be the path of a mixture file");
  check.range("aerosols.relative_humidity_percent", aerosols.relative_humidity_percent, 0.0, 99.0);
  check.one_of("aerosols.humidity", aerosols.humidity, {"mixing-layer", "profile"});
  check.range("aerosols.optical_depth_550nm", aerosols.optical_depth_550nm, 0.0, 100.0);
  check.range("aerosols.angstrom_exponent", aerosols.angstrom_exponent, -1.0, 4.0);
  if (!has_column_aerosol(scene)) {
    if (aerosols.optical_depth_550nm.value_or(0.0) > 0.0) {
      check.fail("aerosols.optical_depth_550nm",
                 fmt::format("= {}: must be 0 or unset where aerosols.type is \"none\"",
                             *aerosols.optical_depth_550nm));
    }
    if (aerosols.angstrom_exponent) {
      check.fail("aerosols.angstrom_exponent",
                 fmt::format("= {}: must be unset where aerosols.type is \"none\"",
                             *aerosols.angstrom_exponent));
    }
  }
  if (aerosols.mixture) {
    // A mixture file has layers of its own.
    const std::pair<std::string_view, bool> kept[] = {
        {"aerosols.mixing_layer", aerosols.mixing_layer},
        {"aerosols.free_troposphere", aerosols.free_troposphere},
        {"aerosols.stratosphere", aerosols.stratosphere}};
    for (const auto& [key, value] : kept) {
      if (!value) check.fail(key, "= false: must be true where aerosols.mixture is given");
    }
  }
  check_added_layer(scene, "volcanic_sulfate", scene.volcanic_sulfate, check);
  check_added_layer(scene, "dust_layer", scene.dust_layer, check);
}

void check_medium(const Scene& scene, Checker& check) {
  const AtmosphereOptions& air = scene.atmosphere;
  check.range("earth.radius_km", scene.earth.radius_km, 1000.0, 70000.0);
  check_albedo(scene.earth, check);

  check.one_of(
      "atmosphere.profile", air.profile,
      {"us_standard", "tropical", "midlatitude_summer", "midlatitude_winter", "subarctic_summer",
       "subarctic_winter", "exponential", "scratchapixel", "scratchapixel_code", "bruneton2008"});
  if (air.profile_file) {
    constexpr std::string_view kKey = "atmosphere.profile_file";
    if (air.profile_file->empty()) check.fail(kKey, "= \"\": must be the path of a profile");
    if (air.optical_layers) {
      check.fail(kKey, "is given: must be left out where atmosphere.optical_layers is given");
    }
    if (!published_air_name(scene).empty()) {
      check.fail(kKey, fmt::format("is given: must be left out where the air is that of \"{}\"",
                                   published_air_name(scene)));
    }
  }
  // The AFGL tables end at 120 km; a user's own layers and profile bring their own top.
  const bool afgl = air.profile != "exponential" && !air.optical_layers && !air.profile_file &&
                    published_air_name(scene).empty();
  check.range("atmosphere.top_km", air.top_km, 1.0, afgl ? 120.0 : 200.0);
  check.range("atmosphere.layers", air.layers, 1, 500);
  check.one_of("atmosphere.layer_spacing", air.layer_spacing, {"graded", "equal-air-mass", "even"});
  check.one_of("atmosphere.layer_optics", air.layer_optics, {"mean", "centre"});
  check.range("atmosphere.ozone_du", air.ozone_du, 0.0, 1000.0);
  check.one_of("atmosphere.ozone", air.ozone, {"layered", "vertical"});
  check.range("atmosphere.nitrogen_dioxide_du", air.nitrogen_dioxide_du, 0.0, 5.0);
  check.one_of("atmosphere.refractive_index", air.refractive_index, {"ciddor", "haber2005"});
  if (air.depolarisation && !(*air.depolarisation >= 0.0 && *air.depolarisation < 6.0 / 7.0)) {
    check.fail("atmosphere.depolarisation",
               fmt::format("= {}: must be \"king\" or a number from 0 to below 6/7 = 0.857",
                           *air.depolarisation));
  }
  if (air.optical_layers && air.optical_layers->empty())
    check.fail("atmosphere.optical_layers", "= \"\": must be the path of a CSV file");

  check_height(scene, check);

  check_aerosols(scene, check);
  if (scene.aerosols.phase) {
    constexpr std::string_view kPhase = "aerosols.phase";
    check.one_of(kPhase, *scene.aerosols.phase, {"mie", "henyey-greenstein"});
    if (*scene.aerosols.phase == "mie" && scene.solver.method == "cells") {
      check.fail(kPhase,
                 "= \"mie\": must be \"henyey-greenstein\" or unset where solver.method is "
                 "\"cells\", which know the asymmetry of the aerosol alone");
    } else if (*scene.aerosols.phase == "mie" && air.optical_layers) {
      check.fail(kPhase,
                 "= \"mie\": must be \"henyey-greenstein\" or unset where "
                 "atmosphere.optical_layers is given, which holds the asymmetry of the aerosol "
                 "alone");
    }
  }
}

void check_spectrum(const Scene& scene, Checker& check) {
  constexpr std::string_view kKey = "spectrum.wavelengths_nm";
  if (check.failed()) return;  // the range asks for a spectrum that exists
  const auto [shortest, longest] = solar_spectrum_range_nm(scene.sun.spectrum);
  const std::vector<double>& wavelengths = scene.spectrum.wavelengths_nm;
  if (wavelengths.empty() || wavelengths.size() > kMostWavelengths) {
    check.fail(kKey,
               fmt::format("has {} values: must have 1..{}", wavelengths.size(), kMostWavelengths));
  }
  for (std::size_t i = 0; i < wavelengths.size(); ++i) {
    const double value = wavelengths[i];
    if (!(value >= shortest && value <= longest)) {
      check.fail(kKey, fmt::format("= {} (value {} of {}): must be {}..{}, the range of the tables "
                                   "(sun.spectrum \"{}\")",
                                   value, i + 1, wavelengths.size(), shortest, longest,
                                   scene.sun.spectrum));
    }
    if (i > 0 && !(value > wavelengths[i - 1])) {
      check.fail(kKey, fmt::format("= {} (value {} of {}): must be above the value before it, {}; "
                                   "wavelengths increase strictly within {}..{}",
                                   value, i + 1, wavelengths.size(), wavelengths[i - 1], shortest,
                                   longest));
    }
  }
}

void check_solved_wavelengths(const SpectrumOptions& spectrum, Checker& check) {
  constexpr std::string_view kKey = "spectrum.solved_nm";
  const std::vector<double>&solved = spectrum.solved_nm, &all = spectrum.wavelengths_nm;
  if (solved.empty() || check.failed()) return;
  if (solved.front() != all.front() || solved.back() != all.back()) {
    check.fail(kKey,
               fmt::format("= {}..{}: must begin and end with spectrum.wavelengths_nm, {}..{}",
                           solved.front(), solved.back(), all.front(), all.back()));
  }
  for (std::size_t i = 0; i < solved.size(); ++i) {
    const bool known = std::ranges::find(all, solved[i]) != all.end();
    if (known && (i == 0 || solved[i] > solved[i - 1])) continue;
    check.fail(kKey,
               fmt::format("= {} (value {} of {}): must be one of spectrum.wavelengths_nm and "
                           "above the value before it",
                           solved[i], i + 1, solved.size()));
  }
}

void check_budget(const Scene& scene, Checker& check) {
  const BudgetOptions& budget = scene.budget;
  check.range("budget.max_relative_error", budget.max_relative_error, 0.001, 0.5);
  check.range("budget.max_seconds", budget.max_seconds, 0.1, 1e6);
  if (!scene.quality) return;
  std::vector<std::string_view> names;
  for (const QualityLevel& level : quality_levels()) names.push_back(level.name);
  check.one_of("quality", *scene.quality, names);
  if (budget.max_relative_error || budget.max_seconds) {
    check.fail("quality", fmt::format("= \"{}\": must not be given together with [budget], which "
                                      "chooses it",
                                      *scene.quality));
  }
}

void check_solver(const Scene& scene, Checker& check) {
  const SolverOptions& solver = scene.solver;
  if (!solver.method.starts_with(kFitMethodPrefix) ||
      solver.method.size() == kFitMethodPrefix.size()) {
    check.one_of("solver.method", solver.method,
                 {"cells", "orders", "monte-carlo", "preetham", "cie-clear", "cie-overcast",
                  "nishita", "hoffman-preetham", "bruneton", "fit:coefficients.json"});
  }
  if (solver.azimuth_divisions < 4 || solver.azimuth_divisions > 360 ||
      solver.azimuth_divisions % 2 != 0) {
    check.fail("solver.azimuth_divisions",
               fmt::format("= {}: must be even, 4..360", solver.azimuth_divisions));
  }
  check.range("solver.scattering_orders", solver.scattering_orders, 1, 500);
  check.range("solver.active_shell_stride", solver.active_shell_stride, 1, 32);
  check.one_of("solver.active_shell_weighting", solver.active_shell_weighting,
               {"quadrature", "rescale"});
  check.range("solver.inner_radius_m", solver.inner_radius_m, 1.0, 10000.0);
  check.one_of("solver.air_phase", solver.air_phase, {"rayleigh", "isotropic"});
  check.one_of("solver.aerosol_phase", solver.aerosol_phase, {"truncated", "similarity"});
  check.one_of("solver.cell_optics", solver.cell_optics, {"mean", "centre"});
  check.range("solver.cell_height_km", solver.cell_height_km, 0.0, 200.0);
  check.one_of("solver.gather", solver.gather, {"exact-single", "cells"});
  const bool cells = solver.method == "cells";
  if ((cells || !solves_transfer(scene)) && solver.polarisation.value_or(false)) {
    check.fail("solver.polarisation",
               fmt::format("= true: must be false or unset where solver.method is \"{}\", which is "
                           "scalar",
                           solver.method));
  }
  if ((cells || !solves_transfer(scene)) && scene.sun.disc_average.value_or(false)) {
    check.fail("sun.disc_average",
               fmt::format("= true: must be false or unset where solver.method is \"{}\", which "
                           "knows one elevation of the Sun",
                           solver.method));
  }
  check.range("solver.zenith_step_deg", solver.zenith_step_deg, 0.1, 3.0);
  check.range("solver.altitude_levels", solver.altitude_levels, 4, 400);
  check.range("solver.polar_directions", solver.polar_directions, 8, 128);
  check.range("solver.azimuth_directions", solver.azimuth_directions, 4, 64);
  check.range("solver.phase_degree", solver.phase_degree, 2, 64);
  check.range("solver.order_tolerance", solver.order_tolerance, 1e-8, 0.1);
  check.range("solver.sunlight_nodes", solver.sunlight_nodes, 64, 2048);
  check.range("solver.darkest_zenith_deg", solver.darkest_zenith_deg, 60.0, 130.0);
  check.range("solver.target_relative_error", solver.target_relative_error, 1e-5, 1.0);
  check.range("solver.photons", solver.photons, 100.0, 1e10);
  check.range("solver.seed", solver.seed, 0, std::numeric_limits<int>::max());
  check.range("solver.threads", solver.threads, 0, 1024);
}

void check_table_size(std::string_view key, const std::vector<double>& size,
                      std::initializer_list<double> least, double most, Checker& check) {
  const auto fits = [&](std::size_t k) {
    return size[k] >= std::data(least)[k] && size[k] <= most && size[k] == std::floor(size[k]);
  };
  bool valid = size.size() == least.size();
  double texels = 1;
  for (std::size_t k = 0; valid && k < size.size(); ++k) {
    valid = fits(k);
    texels *= size[k];
  }
  if (valid && texels <= 67108864) return;
  check.fail(key, fmt::format("= [{}]: must be {} whole numbers {}..{}, their product at most "
                              "67108864",
                              fmt::join(size, ", "), least.size(), *least.begin(), most));
}

void check_bruneton(const BrunetonOptions& options, Checker& check) {
  check_table_size("bruneton.scattering_size", options.scattering_size, {2, 4, 2, 2}, 512, check);
  check_table_size("bruneton.transmittance_size", options.transmittance_size, {2, 2}, 4096, check);
  check_table_size("bruneton.irradiance_size", options.irradiance_size, {2, 2}, 4096, check);
  if (!check.failed() && std::fmod(options.scattering_size[1], 2) != 0) {
    check.fail("bruneton.scattering_size",
               fmt::format("= [{}]: the second, of view angles, must be even, 4..512: half of them "
                           "look at the ground",
                           fmt::join(options.scattering_size, ", ")));
  }
  check.one_of("bruneton.sun_interpolation", options.sun_interpolation, {"linear", "cubic"});
  check.range("bruneton.view_samples", options.view_samples, 8, 512);
  check.range("bruneton.polar_directions", options.polar_directions, 4, 256);
  if (options.polar_directions % 2 != 0) {
    check.fail("bruneton.polar_directions",
               fmt::format("= {}: must be even, 4..256", options.polar_directions));
  }
  check.range("bruneton.azimuth_directions", options.azimuth_directions, 4, 256);
}

void check_models(const Scene& scene, Checker& check) {
  const ModelOptions& models = scene.models;
  check.one_of("models.air", models.air, {"published", "scene"});
  check.one_of("models.out_of_range", models.out_of_range, {"error", "clamp"});
  const TwoConstituentOptions& air = scene.two_constituent_air;
  check.range("two_constituent_air.top_km", air.top_km, 1.0, 1000.0);
  check.range("two_constituent_air.rayleigh_scale_height_km", air.rayleigh_scale_height_km, 0.1,
              100.0);
  check.range("two_constituent_air.rayleigh_scattering_550nm_per_km",
              air.rayleigh_scattering_550nm_per_km, 0.0, 10.0);
  check.range("two_constituent_air.mie_scale_height_km", air.mie_scale_height_km, 0.1, 100.0);
  check.range("two_constituent_air.mie_scattering_550nm_per_km", air.mie_scattering_550nm_per_km,
              0.0, 10.0);
  check.range("two_constituent_air.mie_angstrom_exponent", air.mie_angstrom_exponent, -4.0, 4.0);
  check.range("two_constituent_air.mie_single_scattering_albedo", air.mie_single_scattering_albedo,
              0.01, 1.0);
  check.range("two_constituent_air.mie_asymmetry", air.mie_asymmetry, -0.99, 0.99);
  check.range("preetham.turbidity", scene.preetham.turbidity, 1.0, 100.0);
  check.one_of("preetham.sun_position", scene.preetham.sun_position, {"scene", "preetham"});
  check.range("cie.zenith_luminance_cd_m2", scene.cie.zenith_luminance_cd_m2, 0.0, 1e6);
  check.range("nishita.view_samples", scene.nishita.view_samples, 1, 100000);
  check.range("nishita.light_samples", scene.nishita.light_samples, 1, 100000);
  check_bruneton(scene.bruneton, check);
}

void check_hoffman_preetham(const HoffmanPreethamOptions& options, Checker& check) {
  check.one_of("hoffman_preetham.haze", options.haze,
               {"none", "light haze", "heavy haze", "light fog", "heavy fog"});
  constexpr std::string_view kScattering = "hoffman_preetham.haze_scattering_per_km";
  const std::vector<double>& rgb = options.haze_scattering_per_km;
  if (!rgb.empty() && rgb.size() != 3) {
    check.fail(kScattering,
               fmt::format("holds {} values: must be three, at 650, 570 and 475 nm", rgb.size()));
  }
  for (const double value : rgb) check.range(kScattering, value, 0.0, 100.0);
  check.range("hoffman_preetham.haze_absorption_per_km", options.haze_absorption_per_km, 0.0,
              100.0);
  check.range("hoffman_preetham.asymmetry", options.asymmetry, -1000.0, 1000.0);
  check.one_of("hoffman_preetham.phase", options.phase, {"normalised", "printed"});
}

void check_output(const OutputOptions& output, Checker& check) {
  check.one_of("output.projection", output.projection,
               {"fisheye", "latlong", "octahedral", "camera"});
  check.range("output.size", output.size, 4, 16384);
  check.one_of("output.channels", output.channels, {"rgb", "xyz", "rgb+spectral", "xyz+spectral"});
  check.one_of("output.colour_observer", output.colour_observer, {"cie1931", "cie1964"});
}

void check_camera(const CameraOptions& camera, Checker& check) {
  check.range("camera.azimuth_deg", camera.azimuth_deg, -360.0, 360.0);
  check.range("camera.elevation_deg", camera.elevation_deg, -90.0, 90.0);
  check.range("camera.field_of_view_deg", camera.field_of_view_deg, 0.1, 170.0);
  check.range("camera.aspect_ratio", camera.aspect_ratio, 0.2, 5.0);
}

}  // namespace

double observer_altitude_km(const Scene& scene) {
  return std::max(0.0, 1e-3 * scene.observer.height_m);
}

double ground_depth_km(const Scene& scene) {
  return std::max(0.0, -1e-3 * scene.observer.height_m);
}

bool solves_transfer(const Scene& scene) {
  const std::string& method = scene.solver.method;
  return method == "cells" || method == "orders" || method == "monte-carlo";
}

bool serves_every_sun(const Scene& scene) {
  return scene.solver.method == "orders" || scene.solver.method == "bruneton";
}

std::string published_air_name(const Scene& scene) {
  if (scene.atmosphere.optical_layers) return {};
  const std::string& profile = scene.atmosphere.profile;
  if (profile.starts_with("scratchapixel") || profile == "bruneton2008") return profile;
  const bool own = scene.models.air == "published";
  if (own && scene.solver.method == "nishita") return "scratchapixel";
  if (own && scene.solver.method == "bruneton") return "bruneton2008";
  return {};
}

bool replaces_profile(const Scene& scene) {
  return scene.atmosphere.optical_layers || !published_air_name(scene).empty();
}

bool has_column_aerosol(const Scene& scene) {
  return scene.aerosols.mixture || scene.aerosols.type != "none";
}

bool has_aerosol(const Scene& scene) {
  return has_column_aerosol(scene) || scene.volcanic_sulfate.optical_depth_550nm > 0.0 ||
         scene.dust_layer.optical_depth_550nm > 0.0;
}

void remove_aerosols(Scene& scene) {
  scene.aerosols.type = "none";
  scene.aerosols.mixture.reset();
  scene.aerosols.optical_depth_550nm.reset();
  scene.aerosols.angstrom_exponent.reset();
  scene.volcanic_sulfate.optical_depth_550nm = scene.dust_layer.optical_depth_550nm = 0.0;
}

bool polarised(const Scene& scene) {
  return scene.solver.polarisation.value_or(scene.solver.method != "cells" &&
                                            solves_transfer(scene));
}

bool disc_averaged(const Scene& scene) {
  return scene.sun.disc_average.value_or(scene.solver.method != "cells" && solves_transfer(scene));
}

bool mie_phase(const Scene& scene) {
  if (scene.atmosphere.optical_layers) return false;
  if (!has_aerosol(scene) && published_air_name(scene).empty()) return false;
  if (scene.aerosols.phase) return *scene.aerosols.phase == "mie";
  const std::string& method = scene.solver.method;
  return method == "orders" || method == "monte-carlo" || method == "nishita" ||
         method == "bruneton";
}

std::optional<SceneProblem> validate_quality(const Scene& scene) {
  Checker check;
  check_budget(scene, check);
  return check.take();
}

std::optional<SceneProblem> validate(const Scene& scene) {
  Checker check;
  check_sun(scene, check);
  check_medium(scene, check);
  check_spectrum(scene, check);
  check_solved_wavelengths(scene.spectrum, check);
  check_solver(scene, check);
  check_models(scene, check);
  check_budget(scene, check);
  check_hoffman_preetham(scene.hoffman_preetham, check);
  check_output(scene.output, check);
  check_camera(scene.camera, check);
  return check.take();
}

}  // namespace twilight
