// Reading the air: keys of a scene retrieved from what was measured of its sky.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "output/measurement.h"
#include "output/retrieval.h"
#include "sim/scene_file.h"

namespace twilight {

/// What `twilight retrieve` was asked for.
struct RetrieveOptions {
  std::filesystem::path measured;
  std::vector<std::string> free;  ///< "KEY" or "KEY=LOW..HIGH"
  std::filesystem::path directory;
  RetrievalOptions search;
  /// Quality level (sim/quality.h) of the solver while it searches, or "scene" for the scene's own
  /// throughout.
  std::string search_quality = "draft";
  std::optional<double> relative_error;  ///< of data that say none
};

/// A retrieval ready to run.
struct RetrievalPlan {
  RetrieveOptions options;
  Scene scene;            ///< with the measurement's wavelengths and the scene's own grids
  Scene search_scene;     ///< with those of the search
  bool corrects = false;  ///< whether the two differ
  Measurement measured;
  std::vector<std::string> keys;          ///< those free
  std::vector<FreeParameter> parameters;  ///< of the keys
};

/// The name of the factor of photographs with a free exposure.
inline constexpr const char* kExposureName = "exposure";

/// Reads the measurement and the free keys. Keys are continuous numbers of the air, the ground or
/// the aerosols; those that are not in the table of usual ranges (air_retrieval.cpp) must say
/// theirs. A key starts at the scene's value, or in the middle of its range where that is outside
/// or unset. A scene that names no method takes "orders". Throws std::invalid_argument naming the
/// file, line or option, and what read_measurement() throws.
RetrievalPlan plan_retrieval(const LoadedScene& scene, const RetrieveOptions& options);

/// Runs it; with a free exposure its factor is the last parameter. Throws as retrieve() and
/// SkyForwardModel.
Retrieval run_retrieval(const RetrievalPlan& plan, const RunControl& control = {});

/// The scene with the retrieved values.
Scene retrieved_scene(const RetrievalPlan& plan, const Retrieval& retrieval);

}  // namespace twilight
