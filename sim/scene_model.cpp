#include "sim/scene_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "aerosols/mixtures.h"
#include "atmosphere/air.h"
#include "atmosphere/layers.h"
#include "atmosphere/optical_layers.h"
#include "sim/cell_sky.h"
#include "sim/models/model_sky.h"
#include "sim/monte_carlo_sky.h"
#include "sim/orders_atmosphere.h"
#include "sim/orders_sky.h"
#include "sim/solver_arena.h"
#include "sim/spectral_sky.h"
#include "solar/place.h"
#include "solar/solar_spectrum.h"
#include "solar/sun_position.h"
#include "solar/time_point.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr double kMeanEarthRadiusKm = 6371.0;

// Adds the layers' aerosol to the medium, each coefficient as the layer's mean, or at its
// centre as the paper has it. `phases`, [aerosol layer][wavelength] or empty, become one kind of
// aerosol for every layer that scatters within the model.
void add_aerosols(Medium& medium, const std::vector<AerosolLayer>& aerosols, double factor,
                  bool centre, std::vector<std::vector<PhaseMatrix>> phases) {
  std::vector<LayerTable> kinds(phases.size(), LayerTable(medium.layers(), medium.wavelengths()));
  std::vector<bool> scatters(phases.size(), false);
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    const double z0 = medium.boundary_km[i], z1 = medium.boundary_km[i + 1];
    const double z = 0.5 * (z0 + z1);
    for (std::size_t w = 0; w < medium.wavelengths(); ++w) {
      double scattering = 0, absorption = 0, forward = 0;
      for (std::size_t k = 0; k < aerosols.size(); ++k) {
        const AerosolLayer& a = aerosols[k];
        const bool inside = z >= a.bottom_km && z < a.top_km;
        const double p = factor * (centre ? (inside ? std::exp(-z / a.scale_height_km) : 0.0)
                                          : mean_profile(a, z0, z1));
        scattering += p * a.scattering_per_km[w];
        absorption += p * a.absorption_per_km[w];
        forward += p * a.scattering_per_km[w] * a.asymmetry[w];
        if (phases.empty()) continue;
        kinds[k](i, w) = p * a.scattering_per_km[w];
        if (kinds[k](i, w) > 0) scatters[k] = true;
      }
      medium.aerosol_scattering_per_km(i, w) = scattering;
      medium.aerosol_absorption_per_km(i, w) = absorption;
      medium.aerosol_asymmetry(i, w) = scattering > 0 ? forward / scattering : 0.0;
    }
  }
  for (std::size_t k = 0; k < phases.size(); ++k) {
    if (!scatters[k]) continue;
    medium.aerosol_phase.push_back(std::move(phases[k]));
    medium.aerosol_kind_scattering_per_km.push_back(std::move(kinds[k]));
  }
}

// Takes the particles out of the layers (three, or none) that the scene leaves out. The layers
// stay, so that the air is divided alike.
void empty_layers(const AerosolOptions& options, std::vector<AerosolLayer>& aerosols) {
  const bool kept[] = {options.mixing_layer, options.free_troposphere, options.stratosphere};
  for (std::size_t k = 0; k < aerosols.size(); ++k) {
    if (kept[k]) continue;
    std::ranges::fill(aerosols[k].scattering_per_km, 0.0);
    std::ranges::fill(aerosols[k].absorption_per_km, 0.0);
  }
}

// The published air with what the scene changes of it.
TwoConstituentAir two_constituent_air(const Scene& scene) {
  TwoConstituentAir air = published_air(published_air_name(scene)).value();
  const TwoConstituentOptions& given = scene.two_constituent_air;
  const auto take = [](const std::optional<double>& option, double& value) {
    if (option) value = *option;
  };
  take(scene.earth.radius_km, air.ground_radius_km);
  take(given.top_km, air.top_km);
  take(given.rayleigh_scale_height_km, air.rayleigh_scale_height_km);
  take(given.mie_scale_height_km, air.mie_scale_height_km);
  take(given.mie_scattering_550nm_per_km, air.mie_scattering_550nm_per_km);
  take(given.mie_angstrom_exponent, air.mie_angstrom_exponent);
  take(given.mie_single_scattering_albedo, air.mie_single_scattering_albedo);
  take(given.mie_asymmetry, air.mie_asymmetry);
  if (given.rayleigh_scattering_550nm_per_km) {
    air.rayleigh_wavelength_nm = {550.0};
    air.rayleigh_scattering_per_km = {*given.rayleigh_scattering_550nm_per_km};
  }
  return air;
}

// The ground's reflectance at a wavelength: linear between the given ones, constant beyond.
double ground_albedo_at(const EarthOptions& earth, double wavelength_nm) {
  const std::vector<double>& at = earth.albedo_wavelengths_nm;
  const std::vector<double>& albedo = earth.albedo_spectrum;
  if (at.empty()) return earth.ground_albedo;
  const auto above = std::ranges::upper_bound(at, wavelength_nm);
  if (above == at.begin()) return albedo.front();
  if (above == at.end()) return albedo.back();
  const auto i = static_cast<std::size_t>(above - at.begin());
  const double t = (wavelength_nm - at[i - 1]) / (at[i] - at[i - 1]);
  return std::lerp(albedo[i - 1], albedo[i], t);
}

// From orbit the Sun stands where it stands from this height, to 1 arc minute (parallax).
Place place_under(const Scene& scene) {
  return {*scene.observer.latitude_deg, *scene.observer.longitude_deg,
          std::min(scene.observer.height_m, kHighestPlaceM)};
}

}  // namespace

SceneSun sun_of(const Scene& scene) {
  if (!scene.observer.time) {
    return {*scene.sun.elevation_deg, scene.sun.azimuth_deg, 1.0};
  }
  const SunPosition sun =
      sun_position(place_under(scene), parse_offset_date_time(*scene.observer.time));
  return {sun.elevation_deg, sun.azimuth_deg, sun.distance_au};
}

std::vector<std::vector<PhaseMatrix>> KnownPhases::phases(const std::string& type,
                                                          double relative_humidity_percent,
                                                          std::span<const double> wavelength_nm) {
  auto& known = known_[{type, relative_humidity_percent}];
  std::vector<double> unknown;
  std::ranges::copy_if(wavelength_nm, std::back_inserter(unknown),
                       [&](double nm) { return !known.contains(nm); });
  auto computed = opac_aerosol_phases(type, relative_humidity_percent, unknown);
  for (std::size_t w = 0; w < unknown.size(); ++w) {
    std::vector<PhaseMatrix>& layers = known[unknown[w]];
    for (auto& layer : computed) layers.push_back(std::move(layer[w]));
  }
  std::vector<std::vector<PhaseMatrix>> result(computed.size());
  for (std::size_t k = 0; k < result.size(); ++k) {
    for (const double nm : wavelength_nm) result[k].push_back(known[nm][k]);
  }
  return result;
}

const std::vector<double>& solved_wavelengths_nm(const SpectrumOptions& spectrum) {
  return spectrum.solved_nm.empty() ? spectrum.wavelengths_nm : spectrum.solved_nm;
}

SceneModel build_scene_model(const Scene& scene, KnownPhases* known) {
  if (const auto problem = validate(scene)) {
    throw std::invalid_argument("key '" + problem->key + "' " + problem->message);
  }
  SceneModel model;
  model.scene = scene;
  double radius_km = scene.earth.radius_km.value_or(kMeanEarthRadiusKm);
  const SceneSun sun = sun_of(scene);
  model.sun_elevation_rad = sun.elevation_deg * kRadPerDeg;
  model.sun_azimuth_rad = sun.azimuth_deg * kRadPerDeg;
  model.sun_distance_au = sun.distance_au;
  if (scene.observer.time && !scene.earth.radius_km) {
    radius_km = radius_of_curvature_km(place_under(scene), sun.azimuth_deg);
  }

  const auto& wavelengths = solved_wavelengths_nm(scene.spectrum);
  const bool centre = scene.atmosphere.layer_optics == "centre";
  if (scene.atmosphere.optical_layers) {
    model.medium = read_optical_layers(*scene.atmosphere.optical_layers, radius_km, wavelengths,
                                       scene.atmosphere.depolarisation.value_or(0.0));
  } else if (!published_air_name(scene).empty()) {
    model.two_constituent_air = two_constituent_air(scene);
    const AtmosphereOptions& options = scene.atmosphere;
    const double top_km = model.two_constituent_air->top_km;
    // Spaced as in an atmosphere of 8 km scale height, whose profile ends at 200 km.
    const double shrink = std::max(1.0, top_km / 200.0);
    std::vector<double> boundary_km =
        layer_boundaries_km(Profile::named("exponential"), options.layer_spacing,
                            std::min(200.0, top_km / shrink), options.layers);
    for (double& z : boundary_km) z *= shrink;
    boundary_km.back() = top_km;
    model.medium =
        layered(*model.two_constituent_air, wavelengths, std::move(boundary_km), mie_phase(scene));
  } else {
    auto aerosols = opac_aerosol_layers(scene.aerosols.type,
                                        scene.aerosols.relative_humidity_percent, wavelengths);
    AirOptions air;
    air.profile = scene.atmosphere.profile;
    air.top_km = scene.atmosphere.top_km;
    air.layers = scene.atmosphere.layers;
    air.layer_spacing = scene.atmosphere.layer_spacing;
    air.layer_optics = scene.atmosphere.layer_optics;
    air.ozone_du = scene.atmosphere.ozone_du;
    air.ozone = scene.atmosphere.ozone;
    air.nitrogen_dioxide_du = scene.atmosphere.nitrogen_dioxide_du;
    air.refractive_index = scene.atmosphere.refractive_index;
    air.refraction = scene.atmosphere.refraction;
    air.depolarisation = scene.atmosphere.depolarisation;
    air.earth_radius_km = radius_km;
    air.ground_depth_km = ground_depth_km(scene);
    for (const AerosolLayer& a : aerosols) {
      if (a.top_km < air.top_km) air.snap_boundaries_km.push_back(a.top_km);
    }
    model.medium = make_air(air, wavelengths);
    double factor = 1.0;
    if (scene.aerosols.optical_depth_550nm && !aerosols.empty()) {
      const double at_550[] = {550.0};
      double depth = 0;
      for (const AerosolLayer& a : opac_aerosol_layers(
               scene.aerosols.type, scene.aerosols.relative_humidity_percent, at_550)) {
        depth += optical_depth_between(a, 0, 0.0, std::max(a.bottom_km, model.medium.top_km()));
      }
      factor = *scene.aerosols.optical_depth_550nm / depth;
    }
    empty_layers(scene.aerosols, aerosols);
    KnownPhases own;
    add_aerosols(model.medium, aerosols, factor, centre,
                 mie_phase(scene)
                     ? (known != nullptr ? *known : own)
                           .phases(scene.aerosols.type, scene.aerosols.relative_humidity_percent,
                                   wavelengths)
                     : std::vector<std::vector<PhaseMatrix>>());
  }
  for (const double nm : wavelengths) {
    model.solar_irradiance.push_back(solar_irradiance_w_m2_nm(scene.sun.spectrum, nm) /
                                     (model.sun_distance_au * model.sun_distance_au));
    model.ground_albedo.push_back(ground_albedo_at(scene.earth, nm));
  }
  if (scene.solver.method == "cells" && scene.observer.height_m * 1e-3 >= model.medium.top_km()) {
    throw std::invalid_argument(
        fmt::format("key 'observer.height_m' = {}: must be below the top of the atmosphere, {} m, "
                    "where solver.method is \"cells\", whose cells surround the observer",
                    scene.observer.height_m, 1e3 * model.medium.top_km()));
  }
  return model;
}

namespace {

// The sky at all of the scene's wavelengths where only some were solved.
std::unique_ptr<Sky> with_every_wavelength(const SceneModel& model, std::unique_ptr<Sky> solved) {
  const std::vector<double>& wanted = model.scene.spectrum.wavelengths_nm;
  if (model.medium.wavelength_nm.size() == wanted.size()) return solved;
  std::vector<double> sun;
  for (const double nm : wanted) {
    sun.push_back(solar_irradiance_w_m2_nm(model.scene.sun.spectrum, nm) /
                  (model.sun_distance_au * model.sun_distance_au));
  }
  return std::make_unique<SpectralSky>(std::move(solved), wanted, std::move(sun));
}

void require_orders(const SceneModel& model) {
  if (model.scene.solver.method == "orders") return;
  throw std::invalid_argument(
      fmt::format("key 'solver.method' = \"{}\": must be \"orders\", the method that has a field",
                  model.scene.solver.method));
}

}  // namespace

SolvedField solve_field(const SceneModel& model, const RunControl& control) {
  require_orders(model);
  SolvedField solved;
  SolverArena arena(model.scene.solver.threads);
  arena.arena.execute([&] {
    const SolvedAtmosphere atmosphere(model, nullptr, control, solved.summary);
    solved.summary.figures = atmosphere.figures();
    solved.field = atmosphere.field;
  });
  return solved;
}

FieldSky solve_sky_and_field(const SceneModel& model, const RunControl& control) {
  require_orders(model);
  auto sky = std::make_unique<OrdersSky>(model, control);
  auto field = sky->field();
  return {with_every_wavelength(model, std::move(sky)), std::move(field)};
}

FieldSky sky_from_field(const SceneModel& model, std::shared_ptr<const OrdersField> field,
                        const RunControl& control) {
  require_orders(model);
  auto sky = std::make_unique<OrdersSky>(model, field, control);
  return {with_every_wavelength(model, std::move(sky)), std::move(field)};
}

std::unique_ptr<Sky> solve_sky(const SceneModel& model, const RunControl& control) {
  const std::string& method = model.scene.solver.method;
  std::unique_ptr<Sky> sky;
  if (method == "orders") {
    sky = std::make_unique<OrdersSky>(model, control);
  } else if (method == "monte-carlo") {
    sky = std::make_unique<MonteCarloSky>(model, control);
  } else if (method == "cells") {
    sky = std::make_unique<CellSky>(model, control);
  } else {
    sky = make_model_sky(model, control);
  }
  return with_every_wavelength(model, std::move(sky));
}

}  // namespace twilight
