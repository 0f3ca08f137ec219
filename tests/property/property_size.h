// How many scenes a property test draws: CI or nightly.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "sim/scene.h"

namespace twilight {

/// Whether the environment asks for bigger grids and more scenes: TWILIGHT_PROPERTY=nightly.
bool nightly();

/// Scenes of a test whose CI size is `ci`: TWILIGHT_PROPERTY_SCENES, a factor, scales it.
std::size_t scene_count(std::size_t ci);

/// n scenes from RapidCheck's generators. The seed is fixed; TWILIGHT_PROPERTY_SEED draws others.
std::vector<Scene> draw_scenes(std::size_t n, const std::function<Scene()>& draw);

}  // namespace twilight
