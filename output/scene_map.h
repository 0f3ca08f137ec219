// The map that a scene asks for, and what its file says of it.
#pragma once

#include <optional>

#include "output/exr_image.h"
#include "output/sky_image.h"
#include "sim/scene_model.h"
#include "sim/sky.h"
#include "solar/place.h"

namespace twilight {

/// The projection of [output] and [camera]; a camera that says no azimuth looks at the Sun's (rad,
/// clockwise from north).
MapProjection map_projection(const Scene& scene, double sun_azimuth_rad);

/// Projection, size, colour, spectrum and disc as the scene's [output] has them, for the model's
/// Sun and observer.
MapSettings map_settings(const SceneModel& model);

/// Whether any direct light arrives: elsewhere an apparent elevation has no meaning.
bool sun_in_sight(const Sky& sky);

/// Where the observer stands, for the almanac; nothing where the scene names no place. From orbit
/// the Sun rises and sets by the almanac of the highest place that tables reach.
std::optional<Place> place_of(const Scene& scene);

/// Place, time, Sun, every setting and version. Threads are left out: the same sky has the same
/// bytes however many computed it.
ImageAttributes image_attributes(const SceneModel& model, const Sky& sky);

}  // namespace twilight
