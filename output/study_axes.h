// A scene and the keys of it that vary: studies as TOML files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sim/scene_file.h"

namespace twilight {

/// A key of the scene and the values it takes: numbers or words.
struct StudyAxis {
  std::string key;             ///< of scene_keys(), one that holds a single value
  std::vector<double> values;  ///< one or more, finite, each valid in the scene
  std::string origin;          ///< "study.toml:7"
  /// In place of values: words, or "true" and "false" where `truths`.
  std::vector<std::string> words = {};
  bool truths = false;
  std::string zip = {};  ///< axes with the same word move together; empty: alone

  std::size_t size() const { return words.empty() ? values.size() : words.size(); }
  /// A value as a person reads it: "0.2", "desert", "true".
  std::string text(std::size_t index) const;
  /// The same as an override of load_scene(): "aerosols.type=\"desert\"".
  std::string override_at(std::size_t index) const;
};

/// The axis' name in netCDF files: its key with underscores for points.
std::string axis_variable(const StudyAxis& axis);

/// Axes that move together, crossed with the other dimensions.
struct StudyDimension {
  /// axis_variable() of its only axis; else that of the zip, "case" where all axes are zipped,
  /// "sample" of a Latin hypercube.
  std::string name;
  std::vector<std::size_t> axes;  ///< of Study::axes
  std::size_t size = 0;
};

/// A scene and its axes.
struct Study {
  LoadedScene scene;
  std::vector<StudyAxis> axes;             ///< none: the scene alone
  std::vector<StudyDimension> dimensions;  ///< every axis is in one of them
  std::filesystem::path file;

  /// How many combinations there are: the product of the dimensions' sizes, 1 without axes.
  std::size_t nodes() const;
  /// Where in every axis a combination stands; the last dimension runs fastest.
  std::vector<std::size_t> indices_at(std::size_t node) const;
  /// The values of a combination, one per axis, of a study whose axes are all numbers.
  std::vector<double> values_at(std::size_t node) const;
  /// Whether a dimension's places are cases in a list, not the values of one axis.
  bool listed(const StudyDimension& dimension) const;
  /// Whether every axis is a dimension of its own.
  bool crossed() const;
  /// The scene of a combination, as load_scene() gives it with the axes' values as overrides; a
  /// Sun's elevation takes the place of place and time. Throws std::invalid_argument naming the
  /// combination where it is no valid scene.
  LoadedScene scene_at(std::size_t node) const;
  /// The same where the axes stand at any of their values; what it throws names no combination.
  LoadedScene scene_with(std::span<const std::size_t> indices) const;
  /// "aerosols.type = desert, sun.elevation_deg = -3", of a combination; empty without axes.
  std::string place(std::size_t node) const;

  /// Makes every axis a dimension of its own.
  void cross();

  std::shared_ptr<const SceneSource> source;  ///< of scene_at()
  std::vector<std::string> overrides;         ///< the same, before those of the axes
};

/// Reads a study:
///
///   scene = "scene.toml"          # beside this file; or the scene's own tables here
///   sampling = "crossed"          # the default; or "zipped", or "latin-hypercube" with
///   samples = 200                 # 2..100000 and
///   seed = 1                      # 0.., of the numbers drawn
///   [[axis]]
///   key = "sun.elevation_deg"
///   values = [30, 10, 0, -6]      # or words, or true and false, as the key wants
///   [[axis]]
///   key = "aerosols.optical_depth_550nm"
///   from = 0.05                   # ends included
///   to = 0.8
///   count = 4                     # 2..1000
///   spacing = "log"               # or "linear", the default
///   zip = "haze"                  # optional: moves with the other axes of this word
///
/// "zipped" moves all axes together. A Latin hypercube (McKay, Beckman & Conover 1979,
/// Technometrics 21, 239) draws `samples` points of the axes that have from and to and no count: of
/// every such axis each of as many equal steps (of its logarithm for "log") holds one point. These
/// axes are one dimension, "sample"; axes with values or a count are crossed with it. The numbers
/// depend on the seed, samples and the axis' own key, from and to alone.
///
/// A scene file is a study without axes; the table [outputs] is left to others. Overrides are as
/// in load_scene. An axis of sun.elevation_deg is the Sun's, whatever place and time say; what the
/// scene lacks an axis may say. Throws std::invalid_argument "FILE:LINE: key 'axis.x' = VALUE: ..."
/// for what is wrong with an axis, an unknown key and a value outside its range included, and as
/// load_scene.
Study load_study(const std::filesystem::path& file, std::span<const std::string> overrides = {});

/// Sets a key that holds a number; an elevation of the Sun takes the place of place and time.
/// Throws std::invalid_argument if there is no such key, it holds no number, or an integer is
/// wanted and `value` is none.
void set_number(Scene& scene, const std::string& key, double value);

}  // namespace twilight
