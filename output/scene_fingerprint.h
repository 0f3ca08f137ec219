// What a scene says, files that it names included, as text to make a hash of.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "sim/scene.h"

namespace twilight {

/// Fingerprints of files that scenes name, each read once.
class FileFingerprints {
 public:
  /// Of the file and, where it is TOML, of the files that its strings name beside it. Throws
  /// std::runtime_error naming the file where it cannot be read.
  const std::string& of(const std::filesystem::path& file);

  /// Of a scene's mixture file (aerosols.mixture, given) and all files it names, by stems too, as
  /// aerosol_files() finds them; of a mixture that cannot be read, of() alone.
  const std::string& of_mixture(const Scene& scene);

 private:
  std::map<std::filesystem::path, std::string> known_, mixtures_;
};

/// Every key of the scene but its threads as "key = value" lines; files (layers, profiles,
/// mixtures, fits) by their fingerprint, so that their bytes count and their place does not. Equal
/// texts, equal skies. Throws as FileFingerprints::of.
std::string settings_text(Scene scene, FileFingerprints& files);

}  // namespace twilight
