// Scene files: TOML in, a validated Scene out, and back again.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "sim/scene.h"

namespace twilight {

/// Where one key's value lives inside a Scene.
using SceneField = std::variant<double*, std::optional<double>*, int*, std::optional<int>*, bool*,
                                std::optional<bool>*, std::string*, std::optional<std::string>*,
                                std::vector<double>*>;

/// One key of the scene file. The list of them serves the reader, the printer
/// and the attributes of images, so that none can forget a key.
struct SceneKey {
  std::string_view name;        ///< "table.key"
  SceneField (*field)(Scene&);  ///< its value
  std::string_view doc;         ///< unit, range, meaning, in one line
  /// Word that leaves an optional value unset ("auto", "king"); empty where
  /// only leaving the key out does.
  std::string_view unset_word = {};
};

/// Every key a scene file may hold, grouped by table, in the order they are printed.
std::span<const SceneKey> scene_keys();

/// A valid scene, and where each of its values was said.
struct LoadedScene {
  /// Valid; relative paths (optical_layers, a method "fit:FILE") are resolved against the file's
  /// folder.
  Scene scene;
  std::filesystem::path file;
  /// Key -> "scene.toml:12" or "--set solver.threads=2", for the keys that were given.
  std::map<std::string, std::string, std::less<>> origin;

  /// "scene.toml:12: key 'a.b' MESSAGE"; without the line where the key was not given.
  std::string complaint(std::string_view key, std::string_view message) const;
};

/// Reads a TOML scene file, applies `overrides` ("KEY=VALUE", VALUE typed as
/// TOML; a bare word that is no TOML value is a string) in order, and validates.
/// Where optical_layers is given, that file is checked whole; wavelengths_nm, if not given, become
/// the file's own, and depolarisation 0 unless it is a number. So is the file of a method
/// "fit:FILE", whose wavelengths wavelengths_nm becomes if not given. Keys and tables at the top
/// that are `not_of_scene` are left to others.
/// Throws std::invalid_argument with one message `FILE:LINE: key 'x.y' = VALUE: RANGE`
/// for syntax errors, unknown tables and keys, wrong types, numbers that are not
/// finite and everything validate() refuses; std::runtime_error if the file cannot be read.
LoadedScene load_scene(const std::filesystem::path& file,
                       std::span<const std::string> overrides = {},
                       std::span<const std::string_view> not_of_scene = {});

/// A scene file that is read once and finished with other overrides again and again (the cases of
/// a study).
class SceneSource {
 public:
  /// Reads the file. Throws as load_scene().
  explicit SceneSource(const std::filesystem::path& file,
                       std::span<const std::string_view> not_of_scene = {});
  /// As load_scene() with these overrides.
  LoadedScene with(std::span<const std::string> overrides) const;
  /// The same file without what it says of these keys, which need no value.
  SceneSource without(std::span<const std::string_view> keys) const;

 private:
  LoadedScene read_;
};

/// "; did you mean 'x'?", or nothing where no known key is near.
std::string suggested_key(std::string_view unknown);

/// As load_scene() of a file that holds `toml`; `name` stands for the file in complaints, and its
/// folder is where relative paths start.
LoadedScene load_scene_text(const std::string& toml, const std::filesystem::path& name,
                            std::span<const std::string> overrides = {});

/// The options that TOML text holds, as to_toml() writes it; `origin` names it in complaints. Reads
/// no other file and does not validate. Throws std::invalid_argument as load_scene does for
/// syntax errors, unknown tables and keys and wrong types.
Scene parse_scene(const std::string& toml, const std::string& origin);

/// The scene as TOML, every key with its value (defaults included) and its
/// documentation as a comment; unset keys as comments. load_scene() of this
/// text gives the same scene.
std::string to_toml(const Scene& scene);

/// Every key with its value as text (words without quotes); unset keys are left out, those with
/// an unset_word have that.
std::vector<std::pair<std::string, std::string>> scene_settings(const Scene& scene);

}  // namespace twilight
