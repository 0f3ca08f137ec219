#include "sim/scene_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "atmosphere/air.h"
#include "atmosphere/layers.h"
#include "atmosphere/optical_layers.h"
#include "sim/cell_sky.h"
#include "sim/models/model_sky.h"
#include "sim/monte_carlo_sky.h"
#include "sim/orders_atmosphere.h"
#include "sim/orders_sky.h"
#include "sim/scene_aerosols.h"
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

}  // namespace

const std::vector<double>& solved_wavelengths_nm(const SpectrumOptions& spectrum) {
  return spectrum.solved_nm.empty() ? spectrum.wavelengths_nm : spectrum.solved_nm;
}

PlacedSun placed_sun(const Scene& scene) {
  PlacedSun placed;
  placed.earth_radius_km = scene.earth.radius_km.value_or(kMeanEarthRadiusKm);
  if (scene.observer.time) {
    // From orbit the Sun stands where it stands from this height, to 1 arc minute (parallax).
    const Place place{*scene.observer.latitude_deg, *scene.observer.longitude_deg,
                      std::min(scene.observer.height_m, kHighestPlaceM)};
    const SunPosition sun = sun_position(place, parse_offset_date_time(*scene.observer.time));
    placed.elevation_rad = sun.elevation_deg * kRadPerDeg;
    placed.azimuth_rad = sun.azimuth_deg * kRadPerDeg;
    placed.distance_au = sun.distance_au;
    if (!scene.earth.radius_km) {
      placed.earth_radius_km = radius_of_curvature_km(place, sun.azimuth_deg);
    }
  } else {
    placed.elevation_rad = *scene.sun.elevation_deg * kRadPerDeg;
    placed.azimuth_rad = scene.sun.azimuth_deg * kRadPerDeg;
  }
  return placed;
}

SceneModel build_scene_model(const Scene& scene, KnownPhases* known) {
  if (const auto problem = validate(scene)) {
    throw std::invalid_argument("key '" + problem->key + "' " + problem->message);
  }
  SceneModel model;
  model.scene = scene;
  const PlacedSun sun = placed_sun(scene);
  const double radius_km = sun.earth_radius_km;
  model.sun_elevation_rad = sun.elevation_rad;
  model.sun_azimuth_rad = sun.azimuth_rad;
  model.sun_distance_au = sun.distance_au;

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
    auto aerosols = scene_aerosol_layers(scene);
    AirOptions air;
    air.profile = scene.atmosphere.profile;
    air.profile_file = scene.atmosphere.profile_file.value_or("");
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
    air.snap_boundaries_km = aerosol_boundaries_km(aerosols, air.top_km);
    model.medium = make_air(air, wavelengths);
    KnownPhases own;
    add_aerosols(model.medium, scene, std::move(aerosols), centre, mie_phase(scene),
                 known != nullptr ? *known : own);
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

std::shared_ptr<const OrdersAtmosphere> solve_atmosphere(const SceneModel& model,
                                                         const RunControl& control) {
  require_orders(model);
  std::shared_ptr<const OrdersAtmosphere> atmosphere;
  SolverArena arena(model.scene.solver.threads);
  arena.arena.execute([&] {
    RunSummary summary;
    atmosphere = std::make_shared<const OrdersAtmosphere>(model, nullptr, control, summary);
  });
  return atmosphere;
}

std::unique_ptr<Sky> sky_in_atmosphere(const SceneModel& model,
                                       std::shared_ptr<const OrdersAtmosphere> atmosphere,
                                       const RunControl& control) {
  require_orders(model);
  return with_every_wavelength(model,
                               std::make_unique<OrdersSky>(model, std::move(atmosphere), control));
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
