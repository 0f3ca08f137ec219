#include "atmosphere/air.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "atmosphere/layers.h"
#include "atmosphere/nitrogen_dioxide.h"
#include "atmosphere/ozone.h"
#include "atmosphere/profile.h"
#include "atmosphere/rayleigh.h"
#include "atmosphere/refractive_index.h"
#include "atmosphere/uvspec_profile.h"

namespace twilight {
namespace {

constexpr double kCmPerKm = 1e5;

template <typename Value>
[[noreturn]] void fail(const char* quantity, const Value& value, const char* allowed) {
  std::ostringstream s;
  s << quantity << " '" << value << "' must be " << allowed;
  throw std::invalid_argument(s.str());
}

void check(const AirOptions& o, std::span<const double> wavelength_nm) {
  if (o.layer_optics != "mean" && o.layer_optics != "centre") {
    fail("layer_optics", o.layer_optics, "mean or centre");
  }
  if (o.ozone != "layered" && o.ozone != "vertical") fail("ozone", o.ozone, "layered or vertical");
  if (o.refractive_index != "ciddor" && o.refractive_index != "haber2005") {
    fail("refractive_index", o.refractive_index, "ciddor or haber2005");
  }
  if (o.ozone_du && !(*o.ozone_du >= 0.0 && *o.ozone_du <= 1000.0)) {
    fail("ozone_du", *o.ozone_du, "0..1000");
  }
  if (o.nitrogen_dioxide_du && !(*o.nitrogen_dioxide_du >= 0.0 && *o.nitrogen_dioxide_du <= 5.0)) {
    fail("nitrogen_dioxide_du", *o.nitrogen_dioxide_du, "0..5");
  }
  if (!(o.earth_radius_km >= 1000.0 && o.earth_radius_km <= 70000.0)) {
    fail("earth_radius_km", o.earth_radius_km, "1000..70000");
  }
  if (o.depolarisation && !(*o.depolarisation >= 0.0 && *o.depolarisation < 6.0 / 7.0)) {
    fail("depolarisation", *o.depolarisation, "within [0, 6/7)");
  }
  double last = 0.0;
  for (const double w : wavelength_nm) {
    if (!(w >= 280.0 && w <= 1000.0)) fail("wavelength_nm", w, "280..1000");
    if (!(w > last)) fail("wavelength_nm", w, "above the one before it");
    last = w;
  }
  if (wavelength_nm.empty()) fail("number of wavelengths", 0, "at least 1");
}

ProfileLevel mean_state(const Profile& profile, double bottom_km, double top_km) {
  const auto mean = [&](Profile::Gas gas) { return profile.mean(gas, bottom_km, top_km); };
  return {0.5 * (bottom_km + top_km),
          mean(&ProfileLevel::pressure_hpa),
          profile.mean_temperature_k(bottom_km, top_km),
          mean(&ProfileLevel::air_per_cm3),
          mean(&ProfileLevel::ozone_per_cm3),
          mean(&ProfileLevel::water_vapour_per_cm3),
          mean(&ProfileLevel::nitrogen_dioxide_per_cm3)};
}

// Column wanted, or the profile's own up to its top.
double column_per_cm2(const Profile& profile, Profile::Gas gas, std::optional<double> wanted_du) {
  if (wanted_du) return *wanted_du * kMoleculesPerCm2PerDobson;
  return profile.power_integral(gas, 1.0, 0.0, profile.top_km()) * kCmPerKm;
}

[[noreturn]] void fail_empty(const char* gas, double top_km) {
  std::ostringstream s;
  s << gas << ": the profile has none of it below the top, " << top_km
    << " km, where its column is to be";
  throw std::invalid_argument(s.str());
}

bool holds(const Profile& profile, Profile::Gas gas) {
  return std::ranges::any_of(profile.levels(),
                             [&](const ProfileLevel& level) { return level.*gas > 0.0; });
}

// The profile that shapes a gas: the US standard where the profile has none of it.
Profile shape_of(Profile::Gas gas, const Profile& profile, double ground_depth_km) {
  if (holds(profile, gas)) return profile;
  return Profile::named("us_standard").over_ground_below_sea(ground_depth_km);
}

// Spreads the column over the layers as the profile does, or the US standard where the profile has
// no nitrogen dioxide.
void add_nitrogen_dioxide(Medium& medium, const Profile& profile, double ground_depth_km,
                          double column_per_cm2) {
  if (column_per_cm2 == 0.0) return;
  constexpr auto kGas = &ProfileLevel::nitrogen_dioxide_per_cm3;
  const Profile shape = shape_of(kGas, profile, ground_depth_km);
  std::vector<double> per_cm2;
  double sum_per_cm2 = 0.0;
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    const double bottom_km = std::min(medium.boundary_km[i], shape.top_km());
    const double top_km = std::min(medium.boundary_km[i + 1], shape.top_km());
    per_cm2.push_back(shape.power_integral(kGas, 1.0, bottom_km, top_km) * kCmPerKm);
    sum_per_cm2 += per_cm2.back();
  }
  if (!(sum_per_cm2 > 0.0)) fail_empty("nitrogen_dioxide_du", medium.top_km());
  for (std::size_t w = 0; w < medium.wavelengths(); ++w) {
    const double optical_depth =
        nitrogen_dioxide_cross_section_cm2(medium.wavelength_nm[w]) * column_per_cm2;
    for (std::size_t i = 0; i < medium.layers(); ++i) {
      medium.gas_absorption_per_km(i, w) += optical_depth * per_cm2[i] / sum_per_cm2 /
                                            (medium.boundary_km[i + 1] - medium.boundary_km[i]);
    }
  }
}

// Ozone of a layer, none above the profile's top.
double ozone_in(const Profile& shape, const std::string& optics, double bottom_km, double top_km) {
  constexpr auto kGas = &ProfileLevel::ozone_per_cm3;
  const double centre_km = 0.5 * (bottom_km + top_km);
  if (optics == "centre") return centre_km <= shape.top_km() ? shape.at(centre_km).*kGas : 0.0;
  if (top_km <= shape.top_km()) return shape.mean(kGas, bottom_km, top_km);
  const double top = shape.top_km();
  if (!(bottom_km < top)) return 0.0;
  return shape.mean(kGas, bottom_km, top) * (top - bottom_km) / (top_km - bottom_km);
}

// Height where exp(-h / 8 km) takes its mean over a layer.
double mean_height_km(double bottom_km, double top_km) {
  const double x = (top_km - bottom_km) / kHaberScaleHeightKm;
  return bottom_km - kHaberScaleHeightKm * std::log(-std::expm1(-x) / x);
}

}  // namespace

Medium make_air(const AirOptions& options, std::span<const double> wavelength_nm) {
  check(options, wavelength_nm);
  const Profile profile = (options.profile_file.empty() ? Profile::named(options.profile)
                                                        : read_uvspec_profile(options.profile_file))
                              .over_ground_below_sea(options.ground_depth_km);
  const Profile ozone_shape =
      shape_of(&ProfileLevel::ozone_per_cm3, profile, options.ground_depth_km);

  Medium medium;
  medium.earth_radius_km = options.earth_radius_km;
  medium.wavelength_nm.assign(wavelength_nm.begin(), wavelength_nm.end());
  medium.boundary_km = layer_boundaries_km(profile, options.layer_spacing, options.top_km,
                                           options.layers, options.snap_boundaries_km);
  const std::size_t layers = medium.layers();
  const std::size_t wavelengths = medium.wavelengths();
  medium.zero_tables();

  std::vector<double> cross_section_cm2;
  for (const double w : wavelength_nm) {
    const double king = options.depolarisation
                            ? king_factor_from_depolarisation(*options.depolarisation)
                            : king_factor(w);
    cross_section_cm2.push_back(rayleigh_cross_section_cm2(w, king));
    medium.depolarisation.push_back(
        options.depolarisation.value_or(depolarisation_from_king_factor(king)));
  }

  const double ozone_column_per_cm2 =
      column_per_cm2(profile, &ProfileLevel::ozone_per_cm3, options.ozone_du);
  const double nitrogen_dioxide_column_per_cm2 =
      column_per_cm2(profile, &ProfileLevel::nitrogen_dioxide_per_cm3, options.nitrogen_dioxide_du);

  std::vector<double> ozone_per_cm3;
  double layered_per_cm2 = 0.0;
  for (std::size_t i = 0; i < layers; ++i) {
    const double bottom_km = medium.boundary_km[i];
    const double top_km = medium.boundary_km[i + 1];
    const ProfileLevel mean = mean_state(profile, bottom_km, top_km);
    const ProfileLevel state =
        options.layer_optics == "mean" ? mean : profile.at(0.5 * (bottom_km + top_km));
    const double humidity = relative_humidity(state.water_vapour_per_cm3, state.temperature_k);
    medium.pressure_hpa.push_back(state.pressure_hpa);
    medium.temperature_k.push_back(state.temperature_k);
    medium.relative_humidity.push_back(humidity);
    ozone_per_cm3.push_back(ozone_in(ozone_shape, options.layer_optics, bottom_km, top_km));
    layered_per_cm2 += ozone_per_cm3.back() * (top_km - bottom_km) * kCmPerKm;

    for (std::size_t w = 0; w < wavelengths; ++w) {
      medium.air_scattering_per_km(i, w) = cross_section_cm2[w] * state.air_per_cm3 * kCmPerKm;
      if (!options.refraction) continue;
      medium.refractivity(i, w) =
          options.refractive_index == "ciddor"
              ? ciddor_refractivity(wavelength_nm[w], mean.air_per_cm3, mean.water_vapour_per_cm3)
              : haber2005_refractivity(wavelength_nm[w],
                                       mean_height_km(bottom_km, top_km) - options.ground_depth_km,
                                       humidity);
    }
  }

  for (std::size_t w = 0; w < wavelengths; ++w) {
    const double cross_section = ozone_cross_section_cm2(wavelength_nm[w]);
    if (options.ozone == "vertical") {
      medium.vertical_filter_optical_depth.push_back(cross_section * ozone_column_per_cm2);
      continue;
    }
    if (ozone_column_per_cm2 == 0.0) continue;
    if (!(layered_per_cm2 > 0.0)) fail_empty("ozone_du", medium.top_km());
    const double scale = ozone_column_per_cm2 / layered_per_cm2;
    for (std::size_t i = 0; i < layers; ++i) {
      medium.gas_absorption_per_km(i, w) = cross_section * ozone_per_cm3[i] * scale * kCmPerKm;
    }
  }
  add_nitrogen_dioxide(medium, profile, options.ground_depth_km, nitrogen_dioxide_column_per_cm2);
  return medium;
}

}  // namespace twilight
