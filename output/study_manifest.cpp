#include "output/study_manifest.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "output/atomic_file.h"
#include "output/command_line.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

fs::path manifest_file(const fs::path& directory) { return directory / "study.json"; }
fs::path study_copy(const fs::path& directory) { return cases_folder(directory) / "study.toml"; }

std::string text_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw std::runtime_error(fmt::format("{}: cannot be read", path.string()));
  return {std::istreambuf_iterator<char>(stream), {}};
}

json values_of(const std::vector<double>& values, const std::vector<std::string>& words) {
  return words.empty() ? json(values) : json(words);
}

void read_values(const json& from, std::vector<double>& values, std::vector<std::string>& words) {
  if (from.empty() || from[0].is_number()) {
    values = from.get<std::vector<double>>();
  } else {
    words = from.get<std::vector<std::string>>();
  }
}

json to_json(const StudyManifest& m) {
  json axes = json::array(), dimensions = json::array(), coordinates = json::array();
  for (const StudyAxis& axis : m.study.axes) {
    axes.push_back({{"key", axis.key},
                    {"values", values_of(axis.values, axis.words)},
                    {"truths", axis.truths}});
  }
  for (const StudyDimension& d : m.study.dimensions) {
    dimensions.push_back({{"name", d.name}, {"axes", d.axes}, {"size", d.size}});
  }
  for (const StudyCoordinate& c : m.coordinates) {
    coordinates.push_back({{"name", c.name},
                           {"units", c.meaning.units},
                           {"long_name", c.meaning.long_name},
                           {"standard_name", c.meaning.standard_name},
                           {"values", values_of(c.values, c.words)}});
  }
  return {{"program", fmt::format("twilight {}", kVersion)},
          {"format", kStudyFormat},
          {"title", m.title},
          {"scene", m.scene},
          {"axes", axes},
          {"dimensions", dimensions},
          {"coordinates", coordinates},
          {"cases", m.hashes}};
}

StudyManifest from_json(const json& j) {
  if (j.at("format") != kStudyFormat) throw std::runtime_error("is of another format");
  StudyManifest m;
  m.title = j.at("title");
  m.scene = j.at("scene");
  for (const json& axis : j.at("axes")) {
    StudyAxis& a = m.study.axes.emplace_back();
    a.key = axis.at("key");
    a.truths = axis.at("truths");
    read_values(axis.at("values"), a.values, a.words);
  }
  for (const json& dimension : j.at("dimensions")) {
    StudyDimension& d = m.study.dimensions.emplace_back();
    d.name = dimension.at("name");
    d.axes = dimension.at("axes").get<std::vector<std::size_t>>();
    d.size = dimension.at("size");
    bool fits = !d.axes.empty();
    for (const std::size_t a : d.axes) {
      fits = fits && a < m.study.axes.size() && m.study.axes[a].size() == d.size;
    }
    if (!fits) throw std::runtime_error("has axes and dimensions that do not fit");
  }
  for (const json& coordinate : j.at("coordinates")) {
    StudyCoordinate& c = m.coordinates.emplace_back();
    c.name = coordinate.at("name");
    c.meaning = {coordinate.at("units"), coordinate.at("long_name"),
                 coordinate.at("standard_name")};
    read_values(coordinate.at("values"), c.values, c.words);
  }
  m.hashes = j.at("cases").get<std::vector<std::string>>();
  if (m.hashes.size() != m.study.nodes()) {
    throw std::runtime_error("has not as many cases as its axes make");
  }
  return m;
}

}  // namespace

fs::path cases_folder(const fs::path& directory) { return directory / "cases"; }

void clean_study_folder(const fs::path& directory) {
  remove_stale_temporaries(directory);
  std::error_code error;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code ignored;
    if (entry->is_directory(ignored)) remove_stale_temporaries(entry->path());
  }
}

StudyManifest manifest_of(const StudyPlan& plan) {
  StudyManifest m;
  m.title = plan.study.file.stem().string();
  m.scene = scene_inputs(plan.study.scene.scene);
  m.study.axes = plan.study.axes;
  m.study.dimensions = plan.study.dimensions;
  m.coordinates = plan.coordinates;
  for (const PlannedCase& c : plan.cases) m.hashes.push_back(c.hash);
  m.wanted = plan.wanted;
  return m;
}

void write_manifest(const fs::path& directory, const StudyPlan& plan) {
  // The copy first: the manifest is what is looked for.
  write_text_file(study_copy(directory), text_of(plan.study.file));
  const std::string text = to_json(manifest_of(plan)).dump(1) + "\n";
  std::error_code ignored;
  if (fs::is_regular_file(manifest_file(directory), ignored) &&
      text_of(manifest_file(directory)) != text) {
    // What another study put together would stand beside this one's cases; it is made again from
    // them.
    for (const char* name : {"study.nc", "study.csv", "index.html"}) {
      fs::remove(directory / name, ignored);
    }
  }
  write_text_file(manifest_file(directory), text);
}

void copy_manifest(const fs::path& from, const fs::path& directory) {
  const fs::path folder = cases_folder(directory);
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder)) {
    throw std::runtime_error(
        fmt::format("cannot make the folder {}: {}", folder.string(), error.message()));
  }
  write_text_file(study_copy(directory), text_of(study_copy(from)));
  write_text_file(manifest_file(directory), text_of(manifest_file(from)));
}

StudyManifest read_manifest(const fs::path& directory) {
  const fs::path path = manifest_file(directory);
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) {
    throw std::runtime_error(fmt::format(
        "{}: is no folder of a study: must hold study.json, which `twilight study` writes",
        directory.string()));
  }
  try {
    StudyManifest m = from_json(json::parse(text_of(path)));
    m.wanted = read_wanted_quantities(study_copy(directory));
    return m;
  } catch (const std::exception& error) {
    throw std::runtime_error(fmt::format("{}: {}", path.string(), error.what()));
  }
}

}  // namespace twilight
