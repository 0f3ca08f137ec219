#include "output/scene_fingerprint.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <variant>

#include "output/checksum.h"
#include "sim/scene_aerosols.h"
#include "sim/scene_file.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFitPrefix = "fit:";

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return path.has_filename() && fs::is_regular_file(path, ignored);
}

// The words between quotes.
std::set<std::string> quoted_words(std::string_view text) {
  std::set<std::string> words;
  for (std::size_t at = 0; (at = text.find_first_of("\"'", at)) != std::string_view::npos;) {
    const std::size_t end = text.find_first_of("\"'\n", at + 1);
    if (end == std::string_view::npos) break;
    if (text[end] == text[at]) words.emplace(text.substr(at + 1, end - at - 1));
    at = end + 1;
  }
  return words;
}

// The file that a key's words name; empty where they name none. Words that are no file names have
// neither point nor slash.
fs::path named_file(std::string_view key, std::string_view words) {
  if (words.starts_with(kFitPrefix)) words.remove_prefix(kFitPrefix.size());
  constexpr std::string_view kFileKeys[] = {"atmosphere.optical_layers", "atmosphere.profile_file",
                                            "aerosols.mixture"};
  const bool may = std::ranges::find(kFileKeys, key) != std::end(kFileKeys) ||
                   words.find_first_of("./") != std::string_view::npos;
  return may && is_file(words) ? fs::path(words) : fs::path();
}

}  // namespace

const std::string& FileFingerprints::of(const fs::path& file) {
  const auto known = known_.find(file);
  if (known != known_.end()) return known->second;
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream && !stream.eof()) {
    throw std::runtime_error(fmt::format("{}: cannot be read", file.string()));
  }
  known_[file] = "";  // a file that names itself
  std::string inner;
  if (file.extension() == ".toml") {
    for (const std::string& word : quoted_words(text)) {
      const fs::path named = file.parent_path() / word;
      if (is_file(named)) inner += of(named);
    }
  }
  return known_[file] = fnv1a128(text + inner);
}

const std::string& FileFingerprints::of_mixture(const Scene& scene) {
  const fs::path mixture = *scene.aerosols.mixture;
  const auto known = mixtures_.find(mixture);
  if (known != mixtures_.end()) return known->second;
  std::string text = of(mixture);
  try {
    for (const fs::path& file : aerosol_files(scene)) text += of(file);
  } catch (const std::exception&) {
    // What is wrong in it is for those to say who compute with it.
  }
  return mixtures_[mixture] = fnv1a128(text);
}

std::string settings_text(Scene scene, FileFingerprints& files) {
  scene.solver.threads = 0;
  const Scene named = scene;
  std::string text;
  for (const SceneKey& key : scene_keys()) {
    const SceneField field = key.field(scene);
    std::string* words = nullptr;
    if (auto* const* plain = std::get_if<std::string*>(&field)) words = *plain;
    if (auto* const* optional = std::get_if<std::optional<std::string>*>(&field)) {
      if (**optional) words = &***optional;
    }
    if (words == nullptr || words->empty()) continue;
    const fs::path file = named_file(key.name, *words);
    if (file.empty()) continue;
    const bool mixture = key.name == std::string_view("aerosols.mixture");
    *words =
        fmt::format("file of fingerprint {}", mixture ? files.of_mixture(named) : files.of(file));
  }
  std::istringstream lines(to_toml(scene));
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && !line.starts_with('#')) text += line + '\n';
  }
  return text;
}

}  // namespace twilight
