#include "sim/scene_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "aerosols/mixture_file.h"
#include "atmosphere/optical_layers.h"
#include "atmosphere/uvspec_profile.h"
#include "sim/models/fit_coefficients.h"
#include "sim/quality.h"
#include "sim/toml_shown.h"

namespace twilight {
namespace {

#define TWILIGHT_FIELD(member) [](Scene& s) -> SceneField { return &s.member; }

// clang-format off
constexpr SceneKey kKeys[] = {
    {"quality", TWILIGHT_FIELD(quality),
     "draft, fair, standard, high, or reference: sets solver.method = orders and its steps, but for those "
     "named beside it"},

    {"budget.max_relative_error", TWILIGHT_FIELD(budget.max_relative_error),
     "0.001..0.5: what the sky's radiance may be wrong by; the program chooses the settings and "
     "leaves out what cannot matter"},
    {"budget.max_seconds", TWILIGHT_FIELD(budget.max_seconds),
     "0.1..1e6 seconds that the run may take; depends on the machine"},

    {"observer.latitude_deg", TWILIGHT_FIELD(observer.latitude_deg),
     "degrees north (geodetic, WGS84), -90..90"},
    {"observer.longitude_deg", TWILIGHT_FIELD(observer.longitude_deg),
     "degrees east, -180..360"},
    {"observer.height_m", TWILIGHT_FIELD(observer.height_m),
     "metres above sea level (0 = on the ground), from -500 (then the ground lies there too): below "
     "the top for cells, to 40000000 (orbit) for orders, monte-carlo, nishita and bruneton"},
    {"observer.time", TWILIGHT_FIELD(observer.time),
     "offset date-time, as 2003-12-08T17:00:00+01:00"},

    {"sun.elevation_deg", TWILIGHT_FIELD(sun.elevation_deg),
     "geometric elevation of the Sun (no refraction), degrees, -90..90; instead of a place and "
     "time"},
    {"sun.azimuth_deg", TWILIGHT_FIELD(sun.azimuth_deg),
     "degrees clockwise from north, -360..360; only together with elevation_deg"},
    {"sun.spectrum", TWILIGHT_FIELD(sun.spectrum),
     "gueymard2004, kurucz1992, astm_g173, tsis1_hsrs, or unit (1 W m^-2 nm^-1 everywhere)"},
    {"sun.disc_average", TWILIGHT_FIELD(sun.disc_average),
     "sky light averaged over the limb-darkened disc (0.53 degrees), true or false (a point); "
     "auto: true, false for cells, which cannot", "auto"},

    {"earth.radius_km", TWILIGHT_FIELD(earth.radius_km),
     "1000..70000; auto: the ellipsoid's curvature in the Sun's azimuth, 6371 without a place",
     "auto"},
    {"earth.ground_albedo", TWILIGHT_FIELD(earth.ground_albedo),
     "Lambertian reflectance of the ground, 0..1"},
    {"earth.albedo_wavelengths_nm", TWILIGHT_FIELD(earth.albedo_wavelengths_nm),
     "wavelengths of albedo_spectrum, strictly increasing within 200..2500 nm"},
    {"earth.albedo_spectrum", TWILIGHT_FIELD(earth.albedo_spectrum),
     "reflectances 0..1 in place of ground_albedo, one per wavelength of albedo_wavelengths_nm; "
     "linear between them, constant beyond"},

    {"atmosphere.profile", TWILIGHT_FIELD(atmosphere.profile),
     "us_standard, tropical, midlatitude_summer, midlatitude_winter, subarctic_summer, "
     "subarctic_winter (AFGL), exponential (the paper's exp(-h/8 km)), scratchapixel, "
     "scratchapixel_code, or bruneton2008 (those models' air, haze and Earth, see "
     "[two_constituent_air])"},
    {"atmosphere.profile_file", TWILIGHT_FIELD(atmosphere.profile_file),
     "profile in uvspec's format (columns z, p, T, air, O3, O2, H2O, CO2, NO2, top first) in place "
     "of profile; a relative path starts at this file's folder"},
    {"atmosphere.top_km", TWILIGHT_FIELD(atmosphere.top_km),
     "top of the atmosphere, 1..120 km, 1..200 km for exponential, 1..its top for profile_file"},
    {"atmosphere.layers", TWILIGHT_FIELD(atmosphere.layers),
     "number of layers, 1..500"},
    {"atmosphere.layer_spacing", TWILIGHT_FIELD(atmosphere.layer_spacing),
     "graded (fine near the ground), equal-air-mass (the paper's recursion), or even"},
    {"atmosphere.layer_optics", TWILIGHT_FIELD(atmosphere.layer_optics),
     "density of a layer: its mean, or at its centre (the paper)"},
    {"atmosphere.ozone_du", TWILIGHT_FIELD(atmosphere.ozone_du),
     "ozone column in Dobson units, 0..1000; auto: the profile's own, 300 for exponential", "auto"},
    {"atmosphere.ozone", TWILIGHT_FIELD(atmosphere.ozone),
     "layered (along the slant path), or vertical (the paper's filter of sunlight)"},
    {"atmosphere.nitrogen_dioxide_du", TWILIGHT_FIELD(atmosphere.nitrogen_dioxide_du),
     "nitrogen dioxide column in Dobson units, 0..5 (0.2 clean air, 1 a polluted city); auto: the "
     "profile's own, none for exponential", "auto"},
    {"atmosphere.refraction", TWILIGHT_FIELD(atmosphere.refraction),
     "whether sunlight and view rays bend, true or false"},
    {"atmosphere.refractive_spreading", TWILIGHT_FIELD(atmosphere.refractive_spreading),
     "whether bending also dilutes sunlight, as neighbouring rays bend differently: true, or false "
     "(the paper)"},
    {"atmosphere.refractive_index", TWILIGHT_FIELD(atmosphere.refractive_index),
     "ciddor, or haber2005 (the paper's formula as printed)"},
    {"atmosphere.depolarisation", TWILIGHT_FIELD(atmosphere.depolarisation),
     "king (the King factor of air; 0 with optical_layers), or one ratio from 0 to below 6/7",
     "king"},
    {"atmosphere.optical_layers", TWILIGHT_FIELD(atmosphere.optical_layers),
     "CSV file that replaces profile and aerosols; a relative path starts at this file's folder"},

    {"aerosols.type", TWILIGHT_FIELD(aerosols.type),
     "none, continental_clean, continental_average, continental_polluted, urban, desert, "
     "maritime_clean, maritime_polluted, maritime_tropical, arctic, antarctic"},
    {"aerosols.mixture", TWILIGHT_FIELD(aerosols.mixture),
     "file of a mixture in place of type; a relative path starts at this file's folder", "none"},
    {"aerosols.relative_humidity_percent", TWILIGHT_FIELD(aerosols.relative_humidity_percent),
     "of the mixing layer, and of a mixture's layers that name none, 0..99"},
    {"aerosols.humidity", TWILIGHT_FIELD(aerosols.humidity),
     "mixing-layer (as above; OPAC's above that layer), or profile (the atmosphere's water vapour "
     "at every height, at most 99 %)"},
    {"aerosols.optical_depth_550nm", TWILIGHT_FIELD(aerosols.optical_depth_550nm),
     "0..100: scales the aerosol column to this optical depth; auto: the type's own", "auto"},
    {"aerosols.angstrom_exponent", TWILIGHT_FIELD(aerosols.angstrom_exponent),
     "-1..4, of the column between 440 and 870 nm: scales coarse particles against fine ones; auto: "
     "the mixture's own", "auto"},
    {"aerosols.phase", TWILIGHT_FIELD(aerosols.phase),
     "mie (the mixture's scattering matrix, polarised), or henyey-greenstein; auto: mie, "
     "henyey-greenstein for cells and optical_layers, which know no other", "auto"},
    {"aerosols.mixing_layer", TWILIGHT_FIELD(aerosols.mixing_layer),
     "whether the lowest aerosol layer takes part, true or false"},
    {"aerosols.free_troposphere", TWILIGHT_FIELD(aerosols.free_troposphere),
     "whether the aerosol above it, to 12 km, takes part"},
    {"aerosols.stratosphere", TWILIGHT_FIELD(aerosols.stratosphere),
     "whether the aerosol at 12..35 km takes part"},

    {"volcanic_sulfate.optical_depth_550nm", TWILIGHT_FIELD(volcanic_sulfate.optical_depth_550nm),
     "0..10, of a layer of sulphuric acid droplets on top of [aerosols]; 0 = none"},
    {"volcanic_sulfate.bottom_km", TWILIGHT_FIELD(volcanic_sulfate.bottom_km), "0..120 km"},
    {"volcanic_sulfate.top_km", TWILIGHT_FIELD(volcanic_sulfate.top_km), "above bottom_km, to 120 km"},

    {"dust_layer.optical_depth_550nm", TWILIGHT_FIELD(dust_layer.optical_depth_550nm),
     "0..10, of a layer of mineral dust from afar on top of [aerosols]; 0 = none"},
    {"dust_layer.bottom_km", TWILIGHT_FIELD(dust_layer.bottom_km), "0..120 km"},
    {"dust_layer.top_km", TWILIGHT_FIELD(dust_layer.top_km), "above bottom_km, to 120 km"},

    {"spectrum.wavelengths_nm", TWILIGHT_FIELD(spectrum.wavelengths_nm),
     "1..64 wavelengths, strictly increasing within 280..1000 nm"},
    {"spectrum.solved_nm", TWILIGHT_FIELD(spectrum.solved_nm),
     "those of wavelengths_nm that are solved, its first and last among them; the others are "
     "interpolated; [] = all"},

    {"solver.method", TWILIGHT_FIELD(solver.method),
     "cells (the paper's exchange between cells around the observer), orders (the reference: "
     "successive orders of scattering, polarised), monte-carlo (the independent judge), or a "
     "published model: preetham, cie-clear, cie-overcast, nishita, hoffman-preetham, bruneton, or "
     "fit:FILE.json (made by twilight fit)"},
    {"solver.azimuth_divisions", TWILIGHT_FIELD(solver.azimuth_divisions),
     "cells: around a ring, even, 4..360; 120 = 3 degrees"},
    {"solver.scattering_orders", TWILIGHT_FIELD(solver.scattering_orders),
     "scattering events followed, 1..500; auto: 8 for cells, until order_tolerance for orders, "
     "until roulette ends the path for monte-carlo, 5 for bruneton", "auto"},
    {"solver.active_shell_stride", TWILIGHT_FIELD(solver.active_shell_stride),
     "cells: every n-th shell exchanges light, 1..32"},
    {"solver.active_shell_weighting", TWILIGHT_FIELD(solver.active_shell_weighting),
     "cells: quadrature (active shells carry the passive ones' weight), or rescale (the paper's ratio)"},
    {"solver.inner_radius_m", TWILIGHT_FIELD(solver.inner_radius_m),
     "cells: radius of the innermost shell, 1..10000 m"},
    {"solver.air_phase", TWILIGHT_FIELD(solver.air_phase),
     "cells: rayleigh, or isotropic (the paper)"},
    {"solver.aerosol_phase", TWILIGHT_FIELD(solver.aerosol_phase),
     "cells: truncated (delta-M, every event), or similarity (the paper, Eq. 2)"},
    {"solver.ground_light", TWILIGHT_FIELD(solver.ground_light),
     "light from the ground takes part; false = dropped (the paper)"},
    {"solver.cell_optics", TWILIGHT_FIELD(solver.cell_optics),
     "cells: medium of a cell: its mean, or at its centre (the paper)"},
    {"solver.cell_height_km", TWILIGHT_FIELD(solver.cell_height_km),
     "cells: taller cells are divided, 0..200 km; 0 = never (the paper)"},
    {"solver.gather", TWILIGHT_FIELD(solver.gather),
     "cells: exact-single (single scattering along the view ray plus the cells' multiple), or cells "
     "(the paper)"},
    {"solver.polarisation", TWILIGHT_FIELD(solver.polarisation),
     "true or false (scalar); auto: true, false for cells, which are scalar", "auto"},
    {"solver.zenith_step_deg", TWILIGHT_FIELD(solver.zenith_step_deg),
     "orders: step in solar zenith angle about the terminator, 0.1..3 degrees"},
    {"solver.altitude_levels", TWILIGHT_FIELD(solver.altitude_levels),
     "orders: levels of the field, 4..400"},
    {"solver.polar_directions", TWILIGHT_FIELD(solver.polar_directions),
     "orders: directions of incoming light in zenith angle, 8..128"},
    {"solver.azimuth_directions", TWILIGHT_FIELD(solver.azimuth_directions),
     "orders: and in azimuth over half a turn, 4..64"},
    {"solver.phase_degree", TWILIGHT_FIELD(solver.phase_degree),
     "orders: degree of the aerosol phase function in multiple scattering, 2..64"},
    {"solver.order_tolerance", TWILIGHT_FIELD(solver.order_tolerance),
     "orders: stop when the orders left add less than this share, 1e-8..0.1"},
    {"solver.single_precision", TWILIGHT_FIELD(solver.single_precision),
     "orders: the field in single precision, true, or in double, false"},
    {"solver.coarse_orders", TWILIGHT_FIELD(solver.coarse_orders),
     "orders: light scattered twice on fewer directions, three times or more on half the levels too"},
    {"solver.sunlight_nodes", TWILIGHT_FIELD(solver.sunlight_nodes),
     "orders: angles at which the bending of sunlight is traced, 64..2048"},
    {"solver.darkest_zenith_deg", TWILIGHT_FIELD(solver.darkest_zenith_deg),
     "orders: solar zenith angle beyond which the field is night, 60..130 degrees"},
    {"solver.view_interpolation", TWILIGHT_FIELD(solver.view_interpolation),
     "orders: maps interpolated between directions chosen for an error below 0.1 %, true, or every "
     "pixel gathered, false"},
    {"solver.target_relative_error", TWILIGHT_FIELD(solver.target_relative_error),
     "monte-carlo: standard error of each radiance over its value, 1e-5..1"},
    {"solver.photons", TWILIGHT_FIELD(solver.photons),
     "monte-carlo: photons per view, 100..1e10; auto: until target_relative_error", "auto"},
    {"solver.seed", TWILIGHT_FIELD(solver.seed),
     "monte-carlo: of the random numbers, 0..2147483647; the same seed gives the same bytes"},
    {"solver.threads", TWILIGHT_FIELD(solver.threads),
     "0..1024; 0 = one per core; results do not depend on it"},

    {"models.air", TWILIGHT_FIELD(models.air),
     "nishita, bruneton: published (their own air), or scene (its atmosphere and aerosols)"},
    {"models.out_of_range", TWILIGHT_FIELD(models.out_of_range),
     "where a published model is undefined: error, or clamp (to its edge; recorded)"},

    {"two_constituent_air.top_km", TWILIGHT_FIELD(two_constituent_air.top_km),
     "top of the air, 1..1000 km; auto: as published", "auto"},
    {"two_constituent_air.rayleigh_scale_height_km",
     TWILIGHT_FIELD(two_constituent_air.rayleigh_scale_height_km),
     "of the molecules, 0.1..100 km; auto: as published", "auto"},
    {"two_constituent_air.rayleigh_scattering_550nm_per_km",
     TWILIGHT_FIELD(two_constituent_air.rayleigh_scattering_550nm_per_km),
     "of the molecules at the ground, 0..10 per km, then as wavelength^-4; auto: as published", "auto"},
    {"two_constituent_air.mie_scale_height_km", TWILIGHT_FIELD(two_constituent_air.mie_scale_height_km),
     "of the haze, 0.1..100 km; auto: as published", "auto"},
    {"two_constituent_air.mie_scattering_550nm_per_km",
     TWILIGHT_FIELD(two_constituent_air.mie_scattering_550nm_per_km),
     "of the haze at the ground, 0..10 per km; auto: as published", "auto"},
    {"two_constituent_air.mie_angstrom_exponent", TWILIGHT_FIELD(two_constituent_air.mie_angstrom_exponent),
     "haze scatters as wavelength^-exponent, -4..4; auto: as published, 0", "auto"},
    {"two_constituent_air.mie_single_scattering_albedo",
     TWILIGHT_FIELD(two_constituent_air.mie_single_scattering_albedo),
     "of the haze, 0.01..1; auto: as published", "auto"},
    {"two_constituent_air.mie_asymmetry", TWILIGHT_FIELD(two_constituent_air.mie_asymmetry),
     "g of the haze's Cornette-Shanks phase function, -0.99..0.99; auto: as published", "auto"},

    {"preetham.turbidity", TWILIGHT_FIELD(preetham.turbidity),
     "preetham, cie-clear: of air and haze over air alone, 1..100; the sky is defined for 2..6; auto: the "
     "scene's own at 550 nm", "auto"},
    {"preetham.sun_position", TWILIGHT_FIELD(preetham.sun_position),
     "elevation of the Sun of a place and time: scene (the ephemeris), or preetham (their formula)"},

    {"cie.zenith_luminance_cd_m2", TWILIGHT_FIELD(cie.zenith_luminance_cd_m2),
     "cie-clear, cie-overcast: 0..1e6; auto: Preetham's of the turbidity, or Krochmann & Seidl's for "
     "overcast", "auto"},

    {"nishita.converged", TWILIGHT_FIELD(nishita.converged),
     "steps that converge to 1e-4 in place of the samples, true or false"},
    {"nishita.view_samples", TWILIGHT_FIELD(nishita.view_samples),
     "even segments of the view ray, 1..100000; 16: the lesson's"},
    {"nishita.light_samples", TWILIGHT_FIELD(nishita.light_samples),
     "even segments of each ray to the Sun, 1..100000; 8: the lesson's"},

    {"hoffman_preetham.haze", TWILIGHT_FIELD(hoffman_preetham.haze),
     "none, light haze, heavy haze, light fog, or heavy fog (their Table 1)"},
    {"hoffman_preetham.haze_scattering_per_km",
     TWILIGHT_FIELD(hoffman_preetham.haze_scattering_per_km),
     "three values 0..100 per km at 650, 570 and 475 nm in place of the table's"},
    {"hoffman_preetham.haze_absorption_per_km",
     TWILIGHT_FIELD(hoffman_preetham.haze_absorption_per_km), "of the haze, grey, 0..100 per km"},
    {"hoffman_preetham.asymmetry", TWILIGHT_FIELD(hoffman_preetham.asymmetry),
     "their g, -1000..1000 (negative: forward); auto: the table's", "auto"},
    {"hoffman_preetham.phase", TWILIGHT_FIELD(hoffman_preetham.phase),
     "normalised (Henyey-Greenstein of the printed function's shape, bright towards the Sun), or "
     "printed (to the letter)"},
    {"bruneton.scattering_size", TWILIGHT_FIELD(bruneton.scattering_size),
     "texels of the scattering table along radius, view zenith angle (even), solar zenith angle and "
     "the angle between; each 2..512"},
    {"bruneton.transmittance_size", TWILIGHT_FIELD(bruneton.transmittance_size),
     "texels of the transmittance table along radius and zenith angle, each 2..4096"},
    {"bruneton.irradiance_size", TWILIGHT_FIELD(bruneton.irradiance_size),
     "texels of the irradiance table along radius and solar zenith angle, each 2..4096"},
    {"bruneton.proportional_mie", TWILIGHT_FIELD(bruneton.proportional_mie),
     "keep single Mie scattering at the wavelength nearest 680 nm and take the others in "
     "proportion (the paper's four values), true or false"},
    {"bruneton.sun_interpolation", TWILIGHT_FIELD(bruneton.sun_interpolation),
     "between the table's Suns at run time: cubic, or linear (the paper's; up to 10 % off in twilight)"},
    {"bruneton.view_samples", TWILIGHT_FIELD(bruneton.view_samples),
     "nodes along a view in the precomputation, 8..512"},
    {"bruneton.polar_directions", TWILIGHT_FIELD(bruneton.polar_directions),
     "zenith angles of arriving light in the precomputation, even, 4..256"},
    {"bruneton.azimuth_directions", TWILIGHT_FIELD(bruneton.azimuth_directions),
     "its azimuths over half a turn, 4..256"},

    {"output.projection", TWILIGHT_FIELD(output.projection),
     "fisheye, latlong, octahedral, or camera (see [camera])"},
    {"output.size", TWILIGHT_FIELD(output.size),
     "height in pixels, 4..16384; a latlong map is twice as wide, a camera's camera.aspect_ratio "
     "times"},
    {"output.channels", TWILIGHT_FIELD(output.channels),
     "rgb, xyz, rgb+spectral, or xyz+spectral (the spectrum goes to a second file)"},
    {"output.colour_observer", TWILIGHT_FIELD(output.colour_observer),
     "cie1931 (2 degrees), or cie1964 (10 degrees, the paper)"},
    {"output.sun_disc", TWILIGHT_FIELD(output.sun_disc),
     "whether the Sun's disc is drawn, true or false"},

    {"camera.azimuth_deg", TWILIGHT_FIELD(camera.azimuth_deg),
     "where the camera looks, degrees clockwise from north, -360..360; auto: towards the Sun",
     "auto"},
    {"camera.elevation_deg", TWILIGHT_FIELD(camera.elevation_deg),
     "above the horizon, -90..90 degrees"},
    {"camera.field_of_view_deg", TWILIGHT_FIELD(camera.field_of_view_deg),
     "from bottom to top, 0.1..170 degrees"},
    {"camera.aspect_ratio", TWILIGHT_FIELD(camera.aspect_ratio),
     "width over height, 0.2..5; pixels are square"},
};
// clang-format on

#undef TWILIGHT_FIELD

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

// Keys without a point stand above the tables.
std::string_view table_of(std::string_view key) {
  return key.substr(0, key.find('.') == std::string_view::npos ? 0 : key.find('.'));
}
constexpr std::string_view kOverride = "--set ";

std::string_view leaf_of(std::string_view key) {
  return key.substr(key.find('.') + 1);
}  // npos + 1 = 0

const SceneKey* find_key(std::string_view name) {
  const auto it = std::ranges::find(kKeys, name, &SceneKey::name);
  return it == std::end(kKeys) ? nullptr : it;
}

bool is_table(std::string_view name) {
  return !name.empty() &&
         std::ranges::any_of(kKeys, [&](const SceneKey& k) { return table_of(k.name) == name; });
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t swap = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({swap, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

// A known key in the wrong table counts as near.
std::string suggestion(std::string_view unknown) {
  const std::string_view leaf = leaf_of(unknown);
  std::string_view best;
  std::size_t best_distance = std::numeric_limits<std::size_t>::max();
  for (const SceneKey& key : kKeys) {
    const std::size_t distance =
        std::min(edit_distance(unknown, key.name), 1 + edit_distance(leaf, leaf_of(key.name)));
    if (distance < best_distance) {
      best_distance = distance;
      best = key.name;
    }
  }
  if (best_distance > std::max<std::size_t>(3, leaf.size() / 3)) return {};
  return fmt::format("; did you mean '{}'?", best);
}

std::string table_list() {
  std::string list;
  std::string_view last;
  for (const SceneKey& key : kKeys) {
    if (table_of(key.name).empty() || table_of(key.name) == last) continue;
    last = table_of(key.name);
    list += fmt::format("{}[{}]", list.empty() ? "" : " ", last);
  }
  return list;
}

template <class T>
std::string streamed(const T& value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string toml_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\u{:04X}", static_cast<unsigned char>(c));
    } else {
      out += c;
    }
  }
  return out + '"';
}

[[noreturn]] void refuse(std::string_view origin, std::string_view key, std::string_view message) {
  throw std::invalid_argument(fmt::format("{}: key '{}' {}", origin, key, message));
}

// The number of an integer or float node; complains about every other type, and
// about NaN and infinity.
double number_of(const toml::node& node, std::string_view origin, const SceneKey& key,
                 std::string_view place = {}) {
  double value = 0.0;
  if (const auto* integer = node.as_integer()) {
    value = static_cast<double>(integer->get());
  } else if (const auto* real = node.as_floating_point()) {
    value = real->get();
  } else {
    refuse(origin, key.name,
           fmt::format("= {}{}: must be a number{}; {}", shown(node), place,
                       key.unset_word.empty() ? "" : fmt::format(" or \"{}\"", key.unset_word),
                       key.doc));
  }
  if (!std::isfinite(value)) {
    refuse(origin, key.name,
           fmt::format("= {}{}: must be a finite number; {}", shown(node), place, key.doc));
  }
  return value;
}

void assign(Scene& scene, const SceneKey& key, const toml::node& node, std::string_view origin) {
  const std::string or_unset =
      key.unset_word.empty() ? "" : fmt::format(" or \"{}\"", key.unset_word);
  const auto wrong_type = [&](std::string_view wanted) {
    refuse(origin, key.name,
           fmt::format("= {}: must be {}{}; {}", shown(node), wanted, or_unset, key.doc));
  };
  const auto whole_number = [&] {
    const auto* integer = node.as_integer();
    if (integer == nullptr) wrong_type("an integer");
    const std::int64_t wide = integer->get();
    if (wide < std::numeric_limits<int>::min() || wide > std::numeric_limits<int>::max())
      refuse(origin, key.name, fmt::format("= {}: is out of range; {}", wide, key.doc));
    return static_cast<int>(wide);
  };
  const auto truth = [&] {
    const auto* boolean = node.as_boolean();
    if (boolean == nullptr) wrong_type("true or false");
    return boolean->get();
  };
  const auto text_of = [&]() -> std::string {
    if (const auto* text = node.as_string()) return text->get();
    if (key.name == "observer.time") {
      if (const auto* time = node.as_date_time()) return streamed(time->get());
      wrong_type("an offset date-time");
    }
    wrong_type("a string");
    return {};
  };
  const auto says_unset = [&] {
    const auto* text = node.as_string();
    return text != nullptr && !key.unset_word.empty() && text->get() == key.unset_word;
  };
  std::visit(Overloaded{
                 [&](double* value) { *value = number_of(node, origin, key); },
                 [&](std::optional<double>* value) {
                   if (says_unset())
                     value->reset();
                   else
                     *value = number_of(node, origin, key);
                 },
                 [&](int* value) { *value = whole_number(); },
                 [&](std::optional<int>* value) {
                   if (says_unset())
                     value->reset();
                   else
                     *value = whole_number();
                 },
                 [&](bool* value) { *value = truth(); },
                 [&](std::optional<bool>* value) {
                   if (says_unset())
                     value->reset();
                   else
                     *value = truth();
                 },
                 [&](std::string* value) { *value = text_of(); },
                 [&](std::optional<std::string>* value) {
                   if (says_unset())
                     value->reset();
                   else
                     *value = text_of();
                 },
                 [&](std::vector<double>* value) {
                   const toml::array* array = node.as_array();
                   if (array == nullptr) wrong_type("an array of numbers");
                   value->clear();
                   for (const toml::node& element : *array) {
                     value->push_back(number_of(
                         element, origin, key,
                         fmt::format(" (value {} of {})", value->size() + 1, array->size())));
                   }
                 },
             },
             key.field(scene));
}

void assign_named(LoadedScene& loaded, std::string_view name, const toml::node& node,
                  std::string_view origin) {
  const SceneKey* key = find_key(name);
  if (key == nullptr) {
    refuse(origin, name, fmt::format("= {}: unknown key{}", shown(node), suggestion(name)));
  }
  assign(loaded.scene, *key, node, origin);
  loaded.origin[std::string(name)] = std::string(origin);
}

void read_text(LoadedScene& loaded, const std::string& text, const std::string& name,
               std::span<const std::string_view> not_of_scene = {}) {
  toml::table root;
  try {
    root = toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    throw std::invalid_argument(fmt::format("{}:{}: not valid TOML: {}", name,
                                            error.source().begin.line, error.description()));
  }
  for (const auto& [table_name, table_node] : root) {
    const std::string_view table_key = table_name.str();
    if (std::ranges::find(not_of_scene, table_key) != not_of_scene.end()) continue;
    const auto line_of = [&](const toml::key& key) {
      return fmt::format("{}:{}", name, key.source().begin.line);
    };
    const toml::table* table = table_node.as_table();
    if (const SceneKey* key = find_key(table_key); key != nullptr && table == nullptr) {
      assign_named(loaded, table_key, table_node, line_of(table_name));
      continue;
    }
    if (table == nullptr && !is_table(table_key)) {
      refuse(line_of(table_name), table_key,
             fmt::format("= {}: unknown key outside the tables {}{}", shown(table_node),
                         table_list(), suggestion(table_key)));
    }
    if (table == nullptr) {
      refuse(line_of(table_name), table_key,
             fmt::format("= {}: must be a table, [{}]", shown(table_node), table_key));
    }
    if (!is_table(table_key)) {
      refuse(line_of(table_name), table_key,
             fmt::format("is an unknown table; the tables are {}", table_list()));
    }
    for (const auto& [key, node] : *table)
      assign_named(loaded, fmt::format("{}.{}", table_key, key.str()), node, line_of(key));
  }
}

void read_file(LoadedScene& loaded, std::span<const std::string_view> not_of_scene) {
  const std::string name = loaded.file.string();
  std::ifstream stream(loaded.file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(loaded.file))
    throw std::runtime_error(fmt::format("{}: cannot read this scene file", name));
  read_text(loaded, {std::istreambuf_iterator<char>(stream), {}}, name, not_of_scene);
}

void apply_override(LoadedScene& loaded, const std::string& assignment) {
  std::string origin = std::string(kOverride) + assignment;
  std::ranges::replace(origin, '\n', ' ');  // complaints stay on one line
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == assignment.size()) {
    throw std::invalid_argument(
        fmt::format("{}: must be KEY=VALUE, as --set solver.azimuth_divisions=72", origin));
  }
  const std::string key = assignment.substr(0, equals);
  const std::string value = assignment.substr(equals + 1);
  toml::table parsed;
  try {
    parsed = toml::parse("value = " + value);
  } catch (const toml::parse_error& error) {
    // A bare word (unit, my/layers.csv) is a string; anything with TOML's own
    // punctuation in it was meant as TOML and is wrong.
    if (value.find_first_of("\"'[]{}#=,\n\r") != std::string::npos) {
      refuse(origin, key, fmt::format("= {}: is not valid TOML: {}", value, error.description()));
    }
    parsed.insert_or_assign("value", value);
  }
  if (parsed.size() != 1) refuse(origin, key, "must be one value");
  assign_named(loaded, key, *parsed.get("value"), origin);
}

// The file that a key's value names (all of it, or a part), which must be there: a relative path
// starts beside the scene file.
std::filesystem::path file_beside(const LoadedScene& loaded, std::string_view key,
                                  std::string_view value, std::string_view named,
                                  std::string_view must_be) {
  std::filesystem::path file = named;
  if (file.is_relative()) file = loaded.file.parent_path() / file;
  file = file.lexically_normal();
  if (named.empty() || !std::filesystem::is_regular_file(file)) {
    throw std::invalid_argument(loaded.complaint(
        key,
        fmt::format("= {}: {}; there is none at {}", toml_string(value), must_be, file.string())));
  }
  return file;
}

// Finds the user's layers beside the scene file and checks them whole; they come with their own
// wavelengths, and without depolarisation unless a number is given.
void resolve_optical_layers(LoadedScene& loaded) {
  Scene& scene = loaded.scene;
  const std::filesystem::path layers =
      file_beside(loaded, "atmosphere.optical_layers", *scene.atmosphere.optical_layers,
                  *scene.atmosphere.optical_layers, "must be a CSV file");
  scene.atmosphere.optical_layers = layers.string();
  const std::vector<double> held = optical_layer_wavelengths(layers);
  std::vector<double>& wanted = scene.spectrum.wavelengths_nm;
  if (!loaded.origin.contains("spectrum.wavelengths_nm")) wanted = held;
  constexpr double kSameNm = 1e-6;
  for (const double wavelength : wanted) {
    if (std::ranges::none_of(held,
                             [&](double own) { return std::abs(own - wavelength) <= kSameNm; })) {
      throw std::invalid_argument(
          loaded.complaint("spectrum.wavelengths_nm",
                           fmt::format("= {}: must be one of the wavelengths of {}: {}", wavelength,
                                       layers.string(), fmt::join(held, ", "))));
    }
  }
  if (!scene.atmosphere.depolarisation) scene.atmosphere.depolarisation = 0.0;
}

// Finds the user's profile beside the scene file and checks it whole, and that it reaches the top.
void resolve_profile_file(LoadedScene& loaded) {
  AtmosphereOptions& air = loaded.scene.atmosphere;
  const std::filesystem::path file =
      file_beside(loaded, "atmosphere.profile_file", *air.profile_file, *air.profile_file,
                  "must be a profile in uvspec's format");
  air.profile_file = file.string();
  const double top_km = read_uvspec_profile(file).top_km();
  if (air.top_km > top_km) {
    throw std::invalid_argument(loaded.complaint(
        "atmosphere.top_km",
        fmt::format("= {}: must be 1..{}, the top of {}", air.top_km, top_km, file.string())));
  }
}

bool overridden(const LoadedScene& loaded, std::string_view key) {
  const auto it = loaded.origin.find(key);
  return it != loaded.origin.end() && it->second.starts_with(kOverride);
}

// Finds the mixture file beside the scene file and checks it whole.
void resolve_mixture(LoadedScene& loaded) {
  AerosolOptions& aerosols = loaded.scene.aerosols;
  if (overridden(loaded, "aerosols.type") && !overridden(loaded, "aerosols.mixture")) {
    throw std::invalid_argument(loaded.complaint(
        "aerosols.type", fmt::format("= \"{}\": must not be set where aerosols.mixture takes its "
                                     "place; set aerosols.mixture=none too",
                                     aerosols.type)));
  }
  const std::filesystem::path file = file_beside(loaded, "aerosols.mixture", *aerosols.mixture,
                                                 *aerosols.mixture, "must be a mixture file");
  read_mixture_file(file);
  aerosols.mixture = file.string();
}

// Finds a fit's coefficients beside the scene file and checks them whole; they come with their own
// wavelengths.
void resolve_fit(LoadedScene& loaded) {
  std::string& method = loaded.scene.solver.method;
  const std::filesystem::path file =
      file_beside(loaded, "solver.method", method, method.substr(kFitMethodPrefix.size()),
                  "must name a file that `twilight fit` made");
  method = fmt::format("{}{}", kFitMethodPrefix, file.string());
  std::vector<double> held = read_fit_coefficients(file).wavelength_nm;
  if (!loaded.origin.contains("spectrum.wavelengths_nm")) {
    loaded.scene.spectrum.wavelengths_nm = std::move(held);
  }
}

// A quality or a budget sets the method and its steps, but for the keys that the same file (or
// command line) names.
void resolve_quality(LoadedScene& loaded) {
  Scene& scene = loaded.scene;
  const bool planned = scene.budget.max_relative_error || scene.budget.max_seconds;
  if (!planned && !scene.quality) return;
  if (const auto problem = validate_quality(scene)) {
    throw std::invalid_argument(loaded.complaint(problem->key, problem->message));
  }
  const std::string_view asking = scene.quality                     ? "quality"
                                  : scene.budget.max_relative_error ? "budget.max_relative_error"
                                                                    : "budget.max_seconds";
  const bool from_line = overridden(loaded, asking);
  const auto free = [&](std::string_view key) {
    return from_line ? !overridden(loaded, key) : !loaded.origin.contains(key);
  };
  if (!free("solver.method") && scene.solver.method != "orders") {
    throw std::invalid_argument(loaded.complaint(
        "solver.method", fmt::format("= \"{}\": must be \"orders\" or left out where {} is given",
                                     scene.solver.method, asking)));
  }
  scene.solver.method = "orders";
  if (scene.quality) apply_quality(quality_level(*scene.quality), free, scene.solver);
}

std::string value_text(const SceneField& field) {
  return std::visit(Overloaded{
                        [](const double* value) { return fmt::format("{}", *value); },
                        [](const std::optional<double>* value) {
                          return *value ? fmt::format("{}", **value) : std::string();
                        },
                        [](const int* value) { return fmt::format("{}", *value); },
                        [](const std::optional<int>* value) {
                          return *value ? fmt::format("{}", **value) : std::string();
                        },
                        [](const bool* value) { return fmt::format("{}", *value); },
                        [](const std::optional<bool>* value) {
                          return *value ? fmt::format("{}", **value) : std::string();
                        },
                        [](const std::string* value) { return toml_string(*value); },
                        [](const std::optional<std::string>* value) {
                          return *value ? toml_string(**value) : std::string();
                        },
                        [](const std::vector<double>* value) {
                          return value->empty() ? std::string()
                                                : fmt::format("[{}]", fmt::join(*value, ", "));
                        },
                    },
                    field);
}

// What to_toml prints for a key; empty for one that is unset.
std::string printed_value(const SceneKey& key, Scene& scene) {
  // The azimuth only says something next to an elevation (load_scene refuses it elsewhere).
  if (key.name == "sun.azimuth_deg" && !scene.sun.elevation_deg) return {};
  const std::string text = value_text(key.field(scene));
  return text.empty() && !key.unset_word.empty() ? toml_string(key.unset_word) : text;
}

// All that follows the reading of a scene's text. Its complaints name the file.
void finish(LoadedScene& loaded, std::span<const std::string> overrides) {
  for (const std::string& assignment : overrides) apply_override(loaded, assignment);
  resolve_quality(loaded);
  if (loaded.scene.atmosphere.optical_layers) resolve_optical_layers(loaded);
  if (loaded.scene.atmosphere.profile_file) resolve_profile_file(loaded);
  if (loaded.scene.aerosols.mixture) resolve_mixture(loaded);
  if (loaded.scene.solver.method.starts_with(kFitMethodPrefix)) resolve_fit(loaded);

  const Scene& scene = loaded.scene;
  if (const auto problem = validate(scene))
    throw std::invalid_argument(loaded.complaint(problem->key, problem->message));
  if (!scene.sun.elevation_deg && loaded.origin.contains("sun.azimuth_deg")) {
    throw std::invalid_argument(loaded.complaint(
        "sun.azimuth_deg", fmt::format("= {}: must only be given together with sun.elevation_deg; "
                                       "place and time say where the Sun is",
                                       scene.sun.azimuth_deg)));
  }
}

}  // namespace

std::span<const SceneKey> scene_keys() { return kKeys; }

std::string LoadedScene::complaint(std::string_view key, std::string_view message) const {
  const auto it = origin.find(key);
  return fmt::format("{}: key '{}' {}", it == origin.end() ? file.string() : it->second, key,
                     message);
}

std::string suggested_key(std::string_view unknown) { return suggestion(unknown); }

LoadedScene load_scene(const std::filesystem::path& file, std::span<const std::string> overrides,
                       std::span<const std::string_view> not_of_scene) {
  return SceneSource(file, not_of_scene).with(overrides);
}

SceneSource::SceneSource(const std::filesystem::path& file,
                         std::span<const std::string_view> not_of_scene) {
  read_.file = file;
  read_file(read_, not_of_scene);
}

LoadedScene SceneSource::with(std::span<const std::string> overrides) const {
  LoadedScene loaded = read_;
  finish(loaded, overrides);
  return loaded;
}

SceneSource SceneSource::without(std::span<const std::string_view> keys) const {
  SceneSource rest = *this;
  for (const std::string_view name : keys) {
    std::visit(
        [](auto* value) {
          if constexpr (requires { value->reset(); }) value->reset();
        },
        find_key(name)->field(rest.read_.scene));
    if (const auto said = rest.read_.origin.find(name); said != rest.read_.origin.end()) {
      rest.read_.origin.erase(said);
    }
  }
  return rest;
}

LoadedScene load_scene_text(const std::string& toml, const std::filesystem::path& name,
                            std::span<const std::string> overrides) {
  LoadedScene loaded;
  loaded.file = name;
  read_text(loaded, toml, name.string());
  finish(loaded, overrides);
  return loaded;
}

Scene parse_scene(const std::string& toml, const std::string& origin) {
  LoadedScene loaded;
  read_text(loaded, toml, origin);
  return loaded.scene;
}

std::string to_toml(const Scene& scene) {
  Scene copy = scene;
  std::string text;
  std::string_view table;
  for (const SceneKey& key : kKeys) {
    if (table_of(key.name) != table && !table_of(key.name).empty()) {
      table = table_of(key.name);
      text += fmt::format("{}[{}]\n", text.empty() ? "" : "\n", table);
    }
    const std::string value = printed_value(key, copy);
    text += fmt::format("# {}\n", key.doc);
    if (value.empty())
      text += fmt::format("# {} is not set\n", leaf_of(key.name));
    else
      text += fmt::format("{} = {}\n", leaf_of(key.name), value);
  }
  return text;
}

std::vector<std::pair<std::string, std::string>> scene_settings(const Scene& scene) {
  Scene copy = scene;
  std::vector<std::pair<std::string, std::string>> settings;
  for (const SceneKey& key : kKeys) {
    if (printed_value(key, copy).empty()) continue;
    // A user's own layers replace the profile and the aerosols.
    constexpr std::string_view kStillUsed[] = {"atmosphere.optical_layers",
                                               "atmosphere.depolarisation"};
    if (scene.atmosphere.optical_layers &&
        (key.name.starts_with("aerosols.") || key.name.starts_with("atmosphere.")) &&
        std::ranges::find(kStillUsed, key.name) == std::end(kStillUsed)) {
      continue;
    }
    if (scene.atmosphere.profile_file && key.name == "atmosphere.profile") continue;
    if (scene.aerosols.mixture && key.name == "aerosols.type") continue;
    const SceneField field = key.field(copy);
    std::string text;
    if (const auto* word = std::get_if<std::string*>(&field))
      text = **word;
    else if (const auto* optional_word = std::get_if<std::optional<std::string>*>(&field))
      text = (*optional_word)->value_or(std::string(key.unset_word));
    else if (text = value_text(field); text.empty())
      text = key.unset_word;
    settings.emplace_back(key.name, std::move(text));
  }
  return settings;
}

}  // namespace twilight
