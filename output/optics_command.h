// `twilight optics`: the layers of a scene's air, and the optics of particles, as tables.
#pragma once

#include <filesystem>
#include <optional>

namespace twilight {

struct Run;

/// What `twilight optics` writes.
struct OpticsOptions {
  /// The file to write, .nc or .csv; none: the layers as CSV on standard output.
  std::optional<std::filesystem::path> export_file;
  /// The ten shipped components in place of the scene's layers, each in a file of its own:
  /// "NAME_WASO.nc".
  bool components = false;
};

void optics(Run& run);

}  // namespace twilight
