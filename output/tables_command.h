// `twilight tables`: a renderer's sky tables from a scene.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "output/table_check.h"
#include "sim/orders_sky.h"
#include "sim/run_control.h"

namespace twilight {

struct TablesOptions {
  std::string layout;  ///< layout_names() or "hillaire2020"
  std::filesystem::path directory;
  std::string spectrum = "rgb", filling = "fitted";
  bool separate_mie = false, half = false, check = false;
  std::optional<double> mie_g;
  double mu_s_min_deg = 0.0;  ///< 0: the layout's own
  double scale = 1.0;         ///< of every axis, 0.1..4
  std::vector<double> suns;   ///< of sky views and of the check, degrees
  /// Scales that the check measures beside the tables' own.
  std::vector<double> check_scales;
};

/// Throws std::invalid_argument naming option, value and range, or the key of the scene that does
/// not serve; std::runtime_error where the folder cannot be written.
void require_tables(const TablesOptions& options, const Scene& scene);

struct TablesOutcome {
  std::vector<std::string> files;
  std::vector<std::pair<std::string, std::string>> figures;
  std::vector<TableError> errors;
};

/// Fills, writes and, where asked, reads back and compares. `sky` is of the model.
TablesOutcome make_tables(const SceneModel& model, const OrdersSky& sky,
                          const TablesOptions& options, const std::string& scene_file,
                          const RunControl& control);

}  // namespace twilight
