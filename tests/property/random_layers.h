// Scenes with air of their own: layers of any optical properties, as from a file of
// atmosphere.optical_layers, but in memory.
#pragma once

#include <optional>
#include <string>

#include "atmosphere/medium.h"
#include "random_scene.h"
#include "sim/scene_model.h"

namespace twilight {

/// A scene and, where it has them, the layers that replace its profile and aerosols.
struct DrawnScene {
  DrawnScene(Scene s) : scene(std::move(s)) {}  // NOLINT: a scene is one without such layers
  Scene scene;
  std::optional<Medium> layers;
};

/// What build_scene_model makes of the scene, from a file of the layers where it has them.
SceneModel build_scene_model(const DrawnScene& drawn);

/// A scene of random_scene, one in four of them in random layers: 1..500 of them, 0.1..500 km in
/// all ("cells": the observer below the top), vertical optical depths of air, aerosol and
/// absorption 0..100 each and g = -0.95..0.99, each for itself in every layer at every wavelength:
/// neighbours differ by up to nothing at all against everything. At most 1000 per km. Call inside
/// rc::check.
DrawnScene random_scene_or_layers(const std::string& method, SceneSize size);

/// As describe(Scene), and the layers as a file of optical_layers has them.
std::string describe(const DrawnScene& drawn);

}  // namespace twilight
