// Scenes drawn at random over everything a scene file may ask for.
#pragma once

#include <string>

#include "sim/scene.h"

namespace twilight {

/// A valid scene, from RapidCheck's generators (call inside rc::check): Sun -18..90 deg, S = 8..36,
/// now and then up to 180 (few shells then), 1..60 layers, now and then 500, every profile,
/// aerosol type and switch, albedo 0..1, observer 0..10 km, 1..16 wavelengths.
Scene random_scene();

/// The keys that differ from the defaults, one `key = value` a line.
std::string describe(const Scene& scene);

}  // namespace twilight
