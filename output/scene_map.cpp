#include "output/scene_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "output/command_line.h"
#include "sim/scene_file.h"

namespace twilight {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

}  // namespace

MapProjection map_projection(const Scene& scene, double sun_azimuth_rad) {
  const Projection kind = projection_from_name(scene.output.projection);
  if (kind != Projection::kCamera) return kind;
  const CameraOptions& camera = scene.camera;
  CameraView view;
  view.azimuth_rad = camera.azimuth_deg ? *camera.azimuth_deg / kDegrees : sun_azimuth_rad;
  view.elevation_rad = camera.elevation_deg / kDegrees;
  view.field_of_view_rad = camera.field_of_view_deg / kDegrees;
  view.aspect_ratio = camera.aspect_ratio;
  return view;
}

MapSettings map_settings(const SceneModel& model) {
  const Scene& scene = model.scene;
  const OutputOptions& output = scene.output;
  MapSettings settings;
  settings.projection = map_projection(scene, model.sun_azimuth_rad);
  settings.size = output.size;
  settings.sun_azimuth_rad = model.sun_azimuth_rad;
  settings.colour = output.channels.starts_with("xyz") ? MapColour::kXyz : MapColour::kLinearRec709;
  settings.spectral = output.channels.ends_with("+spectral");
  settings.sun_disc = output.sun_disc;
  const double radius_km = model.medium.earth_radius_km;
  settings.horizon_elevation_rad =
      -std::acos(radius_km / (radius_km + observer_altitude_km(scene)));
  return settings;
}

bool sun_in_sight(const Sky& sky) {
  return std::ranges::any_of(sky.sun_transmittance(), [](double t) { return t > 0.0; });
}

std::optional<Place> place_of(const Scene& scene) {
  if (!scene.observer.latitude_deg) return std::nullopt;
  return Place{*scene.observer.latitude_deg, *scene.observer.longitude_deg,
               std::min(scene.observer.height_m, kHighestPlaceM)};
}

ImageAttributes image_attributes(const SceneModel& model, const Sky& sky) {
  ImageAttributes attributes;
  attributes.emplace_back("software", fmt::format("twilight {}", kVersion));
  if (const auto place = place_of(model.scene)) {
    attributes.emplace_back("latitude", static_cast<float>(place->latitude_deg));
    attributes.emplace_back("longitude", static_cast<float>(place->longitude_deg));
    attributes.emplace_back("altitude", static_cast<float>(model.scene.observer.height_m));
  }
  attributes.emplace_back("resolved.sun_elevation_deg", model.sun_elevation_rad * kDegrees);
  if (sun_in_sight(sky)) {
    attributes.emplace_back("resolved.sun_apparent_elevation_deg",
                            sky.apparent_sun_elevation_rad() * kDegrees);
  }
  attributes.emplace_back("resolved.sun_azimuth_deg", model.sun_azimuth_rad * kDegrees);
  attributes.emplace_back("resolved.sun_distance_au", model.sun_distance_au);
  attributes.emplace_back("resolved.earth_radius_km", model.medium.earth_radius_km);
  for (const auto& [key, value] : scene_settings(model.scene))
    if (key != "solver.threads") attributes.emplace_back(key, value);
  for (const auto& [key, what] : sky.summary().clamps)
    attributes.emplace_back("clamped." + key, what);
  return attributes;
}

}  // namespace twilight
