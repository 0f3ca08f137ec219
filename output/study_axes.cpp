#include "output/study_axes.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>

#include "sim/monte_carlo_random.h"
#include "sim/toml_shown.h"

namespace twilight {
namespace {

constexpr std::string_view kNotOfScene[] = {"scene",    "axis",    "outputs",
                                            "sampling", "samples", "seed"};
constexpr std::string_view kPlaceKeys[] = {"observer.latitude_deg", "observer.longitude_deg",
                                           "observer.time"};
constexpr std::string_view kSunKey = "sun.elevation_deg";
constexpr std::int64_t kMostValues = 1000, kMostCases = 100000;

std::string origin_of(const std::string& file, const toml::node& node) {
  return fmt::format("{}:{}", file, node.source().begin.line);
}

/// How a study's axes are combined.
struct Sampling {
  std::string kind = "crossed";
  std::size_t samples = 0;
  std::uint64_t seed = 1;
};

/// One [[axis]] while it is read.
struct AxisReader {
  std::string file;
  const toml::table& table;
  const Sampling& sampling;

  [[noreturn]] void refuse(const toml::node& node, std::string_view name,
                           std::string_view message) const {
    throw std::invalid_argument(fmt::format("{}: key 'axis.{}' = {}: {}", origin_of(file, node),
                                            name, shown(node), message));
  }
  [[noreturn]] void refuse(std::string_view message) const {
    throw std::invalid_argument(fmt::format("{}: [[axis]] {}", origin_of(file, table), message));
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

  bool drawn() const {
    return sampling.kind == "latin-hypercube" && table.contains("from") && !table.contains("count");
  }
  void values(StudyAxis& axis) const;
  void range(StudyAxis& axis) const;
  StudyAxis read() const;
};

// Points of a Latin hypercube as places 0..1 along an axis, one in each of `count` equal steps.
std::vector<double> stratified(std::size_t count, std::uint64_t key) {
  CounterRandom random(key);
  std::vector<std::size_t> step(count);
  std::iota(step.begin(), step.end(), std::size_t{0});
  for (std::size_t k = count; k > 1; --k) {
    const auto other = static_cast<std::size_t>(random.next() * static_cast<double>(k));
    std::swap(step[k - 1], step[std::min(other, k - 1)]);
  }
  std::vector<double> places;
  for (const std::size_t s : step) {
    places.push_back((static_cast<double>(s) + random.next()) / static_cast<double>(count));
  }
  return places;
}

std::uint64_t key_of(std::string_view text) {
  std::uint64_t key = 0;
  for (const char c : text) key = combine_keys(key, static_cast<unsigned char>(c));
  return key;
}

// from, to, count, spacing.
void AxisReader::range(StudyAxis& axis) const {
  const double from = number(required("from"), "from"), to = number(required("to"), "to");
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
  const auto at = [&](double t) {
    return logarithmic ? from * std::pow(to / from, t) : std::lerp(from, to, t);
  };
  if (drawn()) {
    if (from == to) refuse(required("to"), "to", "must differ from 'from'");
    for (const double t :
         stratified(sampling.samples, combine_keys(sampling.seed, key_of(axis.key)))) {
      axis.values.push_back(at(t));
    }
    return;
  }
  const toml::node& count_node = required("count");
  const auto count = count_node.is_integer() ? count_node.value<std::int64_t>() : std::nullopt;
  if (!count || *count < 2 || *count > kMostValues) {
    refuse(count_node, "count", fmt::format("must be an integer, 2..{}", kMostValues));
  }
  for (std::int64_t k = 0; k < *count; ++k) {
    axis.values.push_back(at(static_cast<double>(k) / static_cast<double>(*count - 1)));
  }
  axis.values.back() = to;
}

void AxisReader::values(StudyAxis& axis) const {
  const toml::node* list = table.get("values");
  if (list == nullptr) {
    if (!table.contains("from")) refuse("must have 'values', or 'from', 'to' and 'count'");
    return range(axis);
  }
  for (const std::string_view name : {"from", "to", "count", "spacing"}) {
    if (table.contains(name)) refuse(required(name), name, "must not be given beside 'values'");
  }
  const toml::array* array = list->as_array();
  if (array == nullptr || array->empty() || array->size() > static_cast<std::size_t>(kMostCases)) {
    refuse(*list, "values",
           fmt::format("must be an array of 1..{} numbers, words or truths", kMostCases));
  }
  const toml::node& first = *array->get(0);
  const bool words = first.is_string() || first.is_date_time();
  axis.truths = first.is_boolean();
  for (const toml::node& node : *array) {
    if (axis.truths != node.is_boolean() || words != (node.is_string() || node.is_date_time())) {
      refuse(node, "values", "must be all numbers, all words, or all true and false");
    }
    if (axis.truths || node.is_date_time()) {
      axis.words.push_back(shown(node));
    } else if (words) {
      axis.words.push_back(node.value_or(std::string()));
    } else {
      axis.values.push_back(number(node, "values"));
    }
  }
}

StudyAxis AxisReader::read() const {
  constexpr std::string_view kKnown[] = {"key", "values", "from", "to", "count", "spacing", "zip"};
  for (const auto& [name, node] : table) {
    if (std::ranges::find(kKnown, name.str()) != std::end(kKnown)) continue;
    refuse(node, name.str(),
           "unknown key; must be one of key, values, from, to, count, spacing, zip");
  }
  const toml::node& key = required("key");
  StudyAxis axis{key.value_or(std::string()), {}, origin_of(file, key)};
  if (!key.is_string()) refuse(key, "key", "must be a string, a key of the scene");
  const auto keys = scene_keys();
  const auto known = std::ranges::find(keys, axis.key, &SceneKey::name);
  if (known == keys.end()) {
    refuse(key, "key", "is no key of a scene" + suggested_key(axis.key));
  }
  Scene probe;
  if (std::holds_alternative<std::vector<double>*>(known->field(probe))) {
    refuse(key, "key", "must be a key that holds one value; " + std::string(known->doc));
  }
  if (axis.key.starts_with("budget.")) {
    refuse(key, "key", "must not be an axis: the settings that a budget chooses are the machine's");
  }
  if (const toml::node* zip = table.get("zip")) {
    axis.zip = zip->value_or(std::string());
    const bool word = !axis.zip.empty() && std::ranges::all_of(axis.zip, [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '_';
    });
    if (!zip->is_string() || !word || std::isdigit(static_cast<unsigned char>(axis.zip[0])) != 0) {
      refuse(*zip, "zip", "must be a word of letters, digits and _ that begins with a letter");
    }
    if (sampling.kind == "zipped") {
      refuse(*zip, "zip", "must not be given where sampling is \"zipped\", which moves all axes");
    }
    if (drawn()) refuse(*zip, "zip", "must not be given for an axis that is drawn");
  }
  values(axis);
  // An axis that moves with others may come back to a value.
  const bool listed = !axis.zip.empty() || sampling.kind == "zipped" || drawn();
  std::vector<std::string> sorted;
  for (std::size_t k = 0; k < axis.size(); ++k) sorted.push_back(axis.text(k));
  std::ranges::sort(sorted);
  const auto twice = std::ranges::adjacent_find(sorted);
  if (!listed && twice != sorted.end()) refuse(fmt::format("has the value {} twice", *twice));
  if (drawn()) axis.zip = "sample";
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

Sampling read_sampling(const toml::table& root, const std::string& file) {
  Sampling sampling;
  const auto refuse = [&](const toml::node& node, const char* key, std::string_view message) {
    throw std::invalid_argument(
        fmt::format("{}: key '{}' = {}: {}", origin_of(file, node), key, shown(node), message));
  };
  const auto whole = [&](const char* key, std::int64_t low, std::int64_t high, auto& value) {
    const toml::node* node = root.get(key);
    const bool drawn = sampling.kind == "latin-hypercube";
    if (node == nullptr) return;
    if (!drawn) refuse(*node, key, "must only be given where sampling is \"latin-hypercube\"");
    const auto number = node->is_integer() ? node->value<std::int64_t>() : std::nullopt;
    if (!number || *number < low || *number > high) {
      refuse(*node, key, fmt::format("must be an integer, {}..{}", low, high));
    }
    value = static_cast<std::remove_reference_t<decltype(value)>>(*number);
  };
  if (const toml::node* kind = root.get("sampling")) {
    sampling.kind = kind->value_or(std::string());
    constexpr std::string_view kKinds[] = {"crossed", "zipped", "latin-hypercube"};
    if (!kind->is_string() || std::ranges::find(kKinds, sampling.kind) == std::end(kKinds)) {
      refuse(*kind, "sampling", "must be \"crossed\", \"zipped\" or \"latin-hypercube\"");
    }
    if (sampling.kind == "latin-hypercube" && !root.contains("samples")) {
      refuse(*kind, "sampling", "must have a key 'samples' beside it");
    }
  }
  whole("samples", 2, kMostCases, sampling.samples);
  whole("seed", 0, std::numeric_limits<std::int64_t>::max(), sampling.seed);
  return sampling;
}

std::vector<StudyAxis> read_axes(const toml::table& root, const std::string& file,
                                 const Sampling& sampling) {
  std::vector<StudyAxis> axes;
  const toml::node* node = root.get("axis");
  if (node == nullptr) return axes;
  const toml::array* array = node->as_array();
  if (array == nullptr) {
    throw std::invalid_argument(
        fmt::format("{}: key 'axis' must be tables, [[axis]]", origin_of(file, *node)));
  }
  for (const toml::node& element : *array) {
    if (!element.is_table()) {
      throw std::invalid_argument(
          fmt::format("{}: key 'axis' must be tables, [[axis]]", origin_of(file, element)));
    }
    StudyAxis axis = AxisReader{file, *element.as_table(), sampling}.read();
    for (const StudyAxis& other : axes) {
      if (other.key != axis.key) continue;
      throw std::invalid_argument(fmt::format("{}: key 'axis.key' = \"{}\": is an axis already, {}",
                                              axis.origin, axis.key, other.origin));
    }
    axes.push_back(std::move(axis));
  }
  return axes;
}

// Axes of one zip are one dimension, where the first of them stands.
void combine(Study& study, const std::string& kind) {
  for (std::size_t a = 0; a < study.axes.size(); ++a) {
    const StudyAxis& axis = study.axes[a];
    const std::string name = kind == "zipped"   ? "case"
                             : axis.zip.empty() ? axis_variable(axis)
                                                : axis.zip;
    const auto same = std::ranges::find(study.dimensions, name, &StudyDimension::name);
    if (same == study.dimensions.end()) {
      study.dimensions.push_back({name, {a}, axis.size()});
      continue;
    }
    const StudyAxis& first = study.axes[same->axes.front()];
    if (axis.size() != same->size) {
      throw std::invalid_argument(
          fmt::format("{}: axis '{}' has {} values: must have {}, as '{}' at {}, with which it "
                      "moves",
                      axis.origin, axis.key, axis.size(), same->size, first.key, first.origin));
    }
    same->axes.push_back(a);
  }
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
    if (std::ranges::find(kNotOfScene, name.str()) != std::end(kNotOfScene)) continue;
    throw std::invalid_argument(
        fmt::format("{}:{}: key '{}' must not be given beside 'scene', which names a file of its "
                    "own",
                    file.string(), name.source().begin.line, name.str()));
  }
  std::filesystem::path scene = named->value_or(std::string());
  return scene.is_relative() ? file.parent_path() / scene : scene;
}

}  // namespace

std::string axis_variable(const StudyAxis& axis) {
  std::string name = axis.key;
  std::ranges::replace(name, '.', '_');
  return name;
}

std::string StudyAxis::text(std::size_t index) const {
  return words.empty() ? fmt::format("{}", values.at(index)) : words.at(index);
}

std::string StudyAxis::override_at(std::size_t index) const {
  if (words.empty() || truths) return fmt::format("{}={}", key, text(index));
  std::ostringstream quoted;
  quoted << toml::value<std::string>(words.at(index));
  return fmt::format("{}={}", key, quoted.str());
}

std::size_t Study::nodes() const {
  std::size_t count = 1;
  for (const StudyDimension& dimension : dimensions) count *= dimension.size;
  return count;
}

std::vector<std::size_t> Study::indices_at(std::size_t node) const {
  std::vector<std::size_t> indices(axes.size());
  for (std::size_t d = dimensions.size(); d-- > 0; node /= dimensions[d].size) {
    for (const std::size_t a : dimensions[d].axes) indices[a] = node % dimensions[d].size;
  }
  return indices;
}

std::vector<double> Study::values_at(std::size_t node) const {
  const std::vector<std::size_t> indices = indices_at(node);
  std::vector<double> values;
  for (std::size_t a = 0; a < axes.size(); ++a) values.push_back(axes[a].values[indices[a]]);
  return values;
}

bool Study::listed(const StudyDimension& dimension) const {
  return dimension.name != axis_variable(axes[dimension.axes.front()]);
}

bool Study::crossed() const {
  return std::ranges::none_of(dimensions, [&](const StudyDimension& d) { return listed(d); });
}

void Study::cross() {
  dimensions.clear();
  for (std::size_t a = 0; a < axes.size(); ++a) {
    dimensions.push_back({axis_variable(axes[a]), {a}, axes[a].size()});
  }
}

std::string Study::place(std::size_t node) const {
  const std::vector<std::size_t> indices = indices_at(node);
  std::string text;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    text +=
        fmt::format("{}{} = {}", text.empty() ? "" : ", ", axes[a].key, axes[a].text(indices[a]));
  }
  return text;
}

namespace {

// What load_scene says of an override, without the override.
std::string without_override(std::string_view message) {
  if (!message.starts_with("--set ")) return std::string(message);
  const std::size_t key = message.find(": key '");
  return std::string(key == std::string_view::npos ? message : message.substr(key + 2));
}

}  // namespace

LoadedScene Study::scene_with(std::span<const std::size_t> indices) const {
  std::vector<std::string> given = overrides;
  if (std::ranges::find(axes, kSunKey, &StudyAxis::key) != axes.end()) {
    std::erase_if(given, [](const std::string& text) {
      return std::ranges::any_of(kPlaceKeys, [&](std::string_view key) {
        return text.starts_with(std::string(key) + "=");
      });
    });
  }
  for (std::size_t a = 0; a < axes.size(); ++a) given.push_back(axes[a].override_at(indices[a]));
  try {
    return source->with(given);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(without_override(error.what()));
  }
}

LoadedScene Study::scene_at(std::size_t node) const {
  try {
    return scene_with(indices_at(node));
  } catch (const std::invalid_argument& error) {
    if (axes.empty()) throw;
    throw std::invalid_argument(
        fmt::format("{}: case {} ({}): {}", file.string(), node + 1, place(node), error.what()));
  }
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

namespace {

// Every value of an axis, the others at their first.
void check_axis(const Study& study, std::size_t a) {
  std::vector<std::size_t> indices(study.axes.size(), 0);
  const StudyAxis& axis = study.axes[a];
  for (std::size_t& k = indices[a]; k < axis.size(); ++k) {
    try {
      study.scene_with(indices);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(
          fmt::format("{}: axis '{}': {}", axis.origin, axis.key, error.what()));
    }
  }
}

}  // namespace

Study load_study(const std::filesystem::path& file, std::span<const std::string> overrides) {
  const toml::table root = parsed(file);
  const Sampling sampling = read_sampling(root, file.string());
  Study study;
  study.file = file;
  study.axes = read_axes(root, file.string(), sampling);
  combine(study, sampling.kind);
  double nodes = 1;
  for (const StudyDimension& d : study.dimensions) nodes *= static_cast<double>(d.size);
  if (nodes > static_cast<double>(kMostCases)) {
    throw std::invalid_argument(fmt::format("{}: the axes make {:.6g} combinations: must be 1..{}",
                                            file.string(), nodes, kMostCases));
  }
  if (sampling.kind == "latin-hypercube" &&
      std::ranges::find(study.dimensions, "sample", &StudyDimension::name) ==
          study.dimensions.end()) {
    throw std::invalid_argument(
        fmt::format("{}: key 'sampling' = \"latin-hypercube\": must have an [[axis]] with from and "
                    "to and no count",
                    file.string()));
  }
  const std::filesystem::path scene = scene_file_of(root, file);
  const SceneSource source(scene, scene == file ? std::span<const std::string_view>(kNotOfScene)
                                                : std::span<const std::string_view>());
  const bool sun = std::ranges::find(study.axes, kSunKey, &StudyAxis::key) != study.axes.end();
  study.source = std::make_shared<SceneSource>(sun ? source.without(kPlaceKeys) : source);
  study.overrides.assign(overrides.begin(), overrides.end());
  try {
    study.scene = source.with(study.overrides);
  } catch (const std::invalid_argument&) {
    // It may lack what the axes say.
    if (study.axes.empty()) throw;
    check_axis(study, 0);
    study.scene = study.scene_at(0);
  }
  for (const StudyDimension& dimension : study.dimensions) {
    if (dimension.axes.size() == 1) check_axis(study, dimension.axes.front());
  }
  return study;
}

}  // namespace twilight
