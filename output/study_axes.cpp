#include "output/study_axes.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace twilight {
namespace {

constexpr std::string_view kNotOfScene[] = {"scene", "axis"};
constexpr std::int64_t kMostValues = 1000;

template <class Node>
std::string shown(const Node& node) {
  if (node.is_table()) return "a table";
  std::ostringstream text;
  node.visit([&](const auto& typed) { text << typed; });
  constexpr std::size_t kLongest = 120;
  return text.str().size() <= kLongest ? text.str() : text.str().substr(0, kLongest) + "...";
}

/// One [[axis]] while it is read.
struct AxisReader {
  std::string file;
  const toml::table& table;

  std::string origin(const toml::node& node) const {
    return fmt::format("{}:{}", file, node.source().begin.line);
  }
  [[noreturn]] void refuse(const toml::node& node, std::string_view name,
                           std::string_view message) const {
    throw std::invalid_argument(
        fmt::format("{}: key 'axis.{}' = {}: {}", origin(node), name, shown(node), message));
  }
  [[noreturn]] void refuse(std::string_view message) const {
    throw std::invalid_argument(fmt::format("{}: [[axis]] {}", origin(table), message));
  }
  double number(const toml::node& node, std::string_view name) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !std::isfinite(*value)) refuse(node, name, "must be a finite number");
    return *value;
  }
  const toml::node& required(std::string_view name) const {
    const toml::node* node = table.get(name);
    if (node == nullptr) refuse(fmt::format("must have a key '{}'", name));
    return *node;
  }

  std::vector<double> values() const;
  std::vector<double> range() const;
};

// from, to, count, spacing.
std::vector<double> AxisReader::range() const {
  const double from = number(required("from"), "from"), to = number(required("to"), "to");
  const toml::node& count_node = required("count");
  const auto count = count_node.is_integer() ? count_node.value<std::int64_t>() : std::nullopt;
  if (!count || *count < 2 || *count > kMostValues) {
    refuse(count_node, "count", fmt::format("must be an integer, 2..{}", kMostValues));
  }
  bool logarithmic = false;
  if (const toml::node* spacing = table.get("spacing")) {
    const std::string word = spacing->value_or(std::string());
    if (!spacing->is_string() || (word != "linear" && word != "log")) {
      refuse(*spacing, "spacing", "must be \"linear\" or \"log\"");
    }
    logarithmic = word == "log";
  }
  if (logarithmic && !(from > 0)) refuse(required("from"), "from", "must be above 0 for \"log\"");
  if (logarithmic && !(to > 0)) refuse(required("to"), "to", "must be above 0 for \"log\"");
  std::vector<double> values;
  for (std::int64_t k = 0; k < *count; ++k) {
    const double t = static_cast<double>(k) / static_cast<double>(*count - 1);
    values.push_back(logarithmic ? from * std::pow(to / from, t) : std::lerp(from, to, t));
  }
  values.back() = to;
  return values;
}

std::vector<double> AxisReader::values() const {
  const toml::node* list = table.get("values");
  if (list == nullptr) {
    if (!table.contains("from")) refuse("must have 'values', or 'from', 'to' and 'count'");
    return range();
  }
  for (const std::string_view name : {"from", "to", "count", "spacing"}) {
    if (table.contains(name)) refuse(required(name), name, "must not be given beside 'values'");
  }
  const toml::array* array = list->as_array();
  if (array == nullptr || array->empty() || array->size() > static_cast<std::size_t>(kMostValues)) {
    refuse(*list, "values", fmt::format("must be an array of 1..{} numbers", kMostValues));
  }
  std::vector<double> values;
  for (const toml::node& node : *array) values.push_back(number(node, "values"));
  return values;
}

StudyAxis read_axis(const toml::table& table, const std::string& file) {
  const AxisReader reader{file, table};
  constexpr std::string_view kKnown[] = {"key", "values", "from", "to", "count", "spacing"};
  for (const auto& [name, node] : table) {
    if (std::ranges::find(kKnown, name.str()) != std::end(kKnown)) continue;
    reader.refuse(node, name.str(),
                  "unknown key; must be one of key, values, from, to, count, spacing");
  }
  const toml::node& key = reader.required("key");
  StudyAxis axis{key.value_or(std::string()), {}, reader.origin(key)};
  if (!key.is_string()) reader.refuse(key, "key", "must be a string, a key of the scene");
  try {
    Scene probe;
    set_number(probe, axis.key, 1);
  } catch (const std::invalid_argument& error) {
    reader.refuse(key, "key", error.what());
  }
  axis.values = reader.values();
  std::vector<double> sorted = axis.values;
  std::ranges::sort(sorted);
  const auto twice = std::ranges::adjacent_find(sorted);
  if (twice != sorted.end()) reader.refuse(fmt::format("has the value {} twice", *twice));
  return axis;
}

toml::table parsed(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) {
    throw std::runtime_error(fmt::format("{}: cannot read this file", file.string()));
  }
  try {
    return toml::parse(stream, file.string());
  } catch (const toml::parse_error& error) {
    throw std::invalid_argument(fmt::format("{}:{}: not valid TOML: {}", file.string(),
                                            error.source().begin.line, error.description()));
  }
}

std::vector<StudyAxis> read_axes(const toml::table& root, const std::string& file) {
  std::vector<StudyAxis> axes;
  const toml::node* node = root.get("axis");
  if (node == nullptr) return axes;
  const toml::array* array = node->as_array();
  const auto place = [&](const toml::node& n) {
    return fmt::format("{}:{}", file, n.source().begin.line);
  };
  if (array == nullptr) {
    throw std::invalid_argument(
        fmt::format("{}: key 'axis' must be tables, [[axis]]", place(*node)));
  }
  for (const toml::node& element : *array) {
    if (!element.is_table()) {
      throw std::invalid_argument(
          fmt::format("{}: key 'axis' must be tables, [[axis]]", place(element)));
    }
    StudyAxis axis = read_axis(*element.as_table(), file);
    for (const StudyAxis& other : axes) {
      if (other.key != axis.key) continue;
      throw std::invalid_argument(fmt::format("{}: key 'axis.key' = \"{}\": is an axis already, {}",
                                              axis.origin, axis.key, other.origin));
    }
    axes.push_back(std::move(axis));
  }
  return axes;
}

// The file that holds the scene's tables: the study's own or the one it names.
std::filesystem::path scene_file_of(const toml::table& root, const std::filesystem::path& file) {
  const toml::node* named = root.get("scene");
  if (named == nullptr) return file;
  const std::string origin = fmt::format("{}:{}", file.string(), named->source().begin.line);
  if (!named->is_string()) {
    throw std::invalid_argument(fmt::format(
        "{}: key 'scene' = {}: must be the name of a scene file", origin, shown(*named)));
  }
  for (const auto& [name, node] : root) {
    if (name == "scene" || name == "axis") continue;
    throw std::invalid_argument(
        fmt::format("{}:{}: key '{}' must not be given beside 'scene', which names a file of its "
                    "own",
                    file.string(), name.source().begin.line, name.str()));
  }
  std::filesystem::path scene = named->value_or(std::string());
  return scene.is_relative() ? file.parent_path() / scene : scene;
}

}  // namespace

std::size_t Study::nodes() const {
  std::size_t count = 1;
  for (const StudyAxis& axis : axes) count *= axis.values.size();
  return count;
}

std::vector<double> Study::values_at(std::size_t node) const {
  std::vector<double> values(axes.size());
  for (std::size_t a = axes.size(); a-- > 0; node /= axes[a].values.size()) {
    values[a] = axes[a].values[node % axes[a].values.size()];
  }
  return values;
}

void set_number(Scene& scene, const std::string& name, double value) {
  const auto keys = scene_keys();
  const auto key = std::ranges::find(keys, name, &SceneKey::name);
  if (key == keys.end()) {
    throw std::invalid_argument("is no key of a scene" + suggested_key(name));
  }
  const SceneField field = key->field(scene);
  const auto whole = [&] {
    if (value != std::round(value) || std::abs(value) > 1e9) {
      throw std::invalid_argument(fmt::format("must be an integer; {}", key->doc));
    }
    return static_cast<int>(value);
  };
  if (auto* const* real = std::get_if<double*>(&field)) {
    **real = value;
  } else if (auto* const* optional_real = std::get_if<std::optional<double>*>(&field)) {
    **optional_real = value;
  } else if (auto* const* integer = std::get_if<int*>(&field)) {
    **integer = whole();
  } else if (auto* const* optional_integer = std::get_if<std::optional<int>*>(&field)) {
    **optional_integer = whole();
  } else {
    throw std::invalid_argument("must be a key that holds a number; " + std::string(key->doc));
  }
  if (name == "sun.elevation_deg") {
    scene.observer.latitude_deg.reset();
    scene.observer.longitude_deg.reset();
    scene.observer.time.reset();
  }
}

Study load_study(const std::filesystem::path& file, std::span<const std::string> overrides) {
  const toml::table root = parsed(file);
  Study study;
  study.axes = read_axes(root, file.string());
  constexpr double kMostNodes = 100000;
  double nodes = 1;
  for (const StudyAxis& axis : study.axes) nodes *= static_cast<double>(axis.values.size());
  if (nodes > kMostNodes) {
    throw std::invalid_argument(fmt::format("{}: the axes make {:.6g} combinations: must be 1..{}",
                                            file.string(), nodes, kMostNodes));
  }
  const std::filesystem::path scene = scene_file_of(root, file);
  std::vector<std::string> given(overrides.begin(), overrides.end());
  const auto sun = std::ranges::find(study.axes, "sun.elevation_deg", &StudyAxis::key);
  const bool placed = root["sun"]["elevation_deg"] || root["observer"]["time"];
  if (scene == file && sun != study.axes.end() && !placed) {
    given.insert(given.begin(), fmt::format("sun.elevation_deg={}", sun->values.front()));
  }
  study.scene = load_scene(scene, given,
                           scene == file ? std::span<const std::string_view>(kNotOfScene)
                                         : std::span<const std::string_view>());
  for (const StudyAxis& axis : study.axes) {
    for (const double value : axis.values) {
      std::string wrong;
      try {
        Scene probe = study.scene.scene;
        set_number(probe, axis.key, value);
        if (const auto problem = validate(probe)) {
          wrong = problem->key == axis.key
                      ? problem->message
                      : fmt::format("= {}: key '{}' {}", value, problem->key, problem->message);
        }
      } catch (const std::invalid_argument& error) {
        wrong = fmt::format("= {}: {}", value, error.what());
      }
      if (wrong.empty()) continue;
      throw std::invalid_argument(fmt::format("{}: axis '{}' {}", axis.origin, axis.key, wrong));
    }
  }
  return study;
}

}  // namespace twilight
