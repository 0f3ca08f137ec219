// The program run once, and what the system says it took.
#pragma once

#include <string>
#include <vector>

namespace twilight {

struct MeasuredRun {
  double seconds = 0, processor_seconds = 0, peak_mib = 0;
};

/// Runs twilight with the arguments in a process of its own, its standard output thrown away, and
/// waits. Throws std::runtime_error where it cannot start or fails.
MeasuredRun run_twilight(std::vector<std::string> arguments);

}  // namespace twilight
