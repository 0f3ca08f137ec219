// Scenes drawn at random over everything a scene file may ask for.
#pragma once

#include <string>

#include "sim/scene.h"

namespace twilight {

/// How much a drawn scene may cost: kSmall milliseconds (CI), kLarge seconds (nightly).
enum class SceneSize { kSmall, kLarge };

/// A valid scene of a method, from RapidCheck's generators (call inside rc::check), over the ranges
/// of tests/property/README.md: Sun -90..90 deg, observer -500 m to 1000 km ("cells": below the
/// top), 1..500 layers, optical depth 0..100, albedo 0..1, radius 1000..70000 km, humidity 0..99 %,
/// 280..1000 nm, every profile, aerosol type and switch; S = 4..12 (now and then to 48), large: to
/// 180, seldom 360. threads = 1.
Scene random_scene(const std::string& method, SceneSize size);

/// The keys that differ from the defaults, one `key = value` a line.
std::string describe(const Scene& scene);

/// Uniform numbers from RapidCheck's generators, the ends included.
int between(int lowest, int highest);
double between(double lowest, double highest);
bool one_in(int n);

}  // namespace twilight
