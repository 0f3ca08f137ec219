// `twilight retrieve`: the air from what was measured of its sky.
#pragma once

#include "output/command_run.h"
#include "sim/scene_file.h"

namespace twilight {

/// Retrieves and writes; the table of parameters goes to standard output. Throws BadInput for what
/// is wrong with the input, std::runtime_error where the search did not converge (its files are
/// written and say so), Cancelled.
void retrieve_air(Run& run, const LoadedScene& scene);

}  // namespace twilight
