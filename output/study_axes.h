// A scene and the keys of it that vary: studies as TOML files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "sim/scene_file.h"

namespace twilight {

/// A key of the scene and the values it takes.
struct StudyAxis {
  std::string key;             ///< of scene_keys(), one that holds a single number
  std::vector<double> values;  ///< one or more, finite, none twice, each valid in the scene
  std::string origin;          ///< "study.toml:7"
};

/// A scene and its axes, which are crossed.
struct Study {
  LoadedScene scene;
  std::vector<StudyAxis> axes;  ///< none: the scene alone

  /// How many combinations there are: the product of the axes' sizes, 1 without axes.
  std::size_t nodes() const;
  /// The values of a combination, one per axis; the last axis runs fastest.
  std::vector<double> values_at(std::size_t node) const;
};

/// Reads a study:
///
///   scene = "scene.toml"          # beside this file; or the scene's own tables here
///   [[axis]]
///   key = "sun.elevation_deg"
///   values = [30, 10, 0, -6]
///   [[axis]]
///   key = "aerosols.optical_depth_550nm"
///   from = 0.05                   # ends included
///   to = 0.8
///   count = 4                     # 2..1000
///   spacing = "log"               # or "linear", the default
///
/// A scene file is a study without axes. Overrides are as in load_scene. An axis of
/// sun.elevation_deg is the Sun's, whatever place and time say; a study that says neither has its
/// first value. Throws std::invalid_argument "FILE:LINE: key 'axis.x' = VALUE: ..." for what is
/// wrong with an axis, an unknown key and a value outside its range included, and as load_scene.
Study load_study(const std::filesystem::path& file, std::span<const std::string> overrides = {});

/// Sets a key that holds a number; an elevation of the Sun takes the place of place and time.
/// Throws std::invalid_argument if there is no such key, it holds no number, or an integer is
/// wanted and `value` is none.
void set_number(Scene& scene, const std::string& key, double value);

}  // namespace twilight
