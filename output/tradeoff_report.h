// A ladder's outcome as tables and plots.
#pragma once

#include <string>
#include <vector>

#include "output/tradeoff.h"

namespace twilight {

/// Writes into the plan's folder, each file whole or not at all: tradeoff.csv (a line per row),
/// tradeoff.json (scene, reference, machine, every rung with its settings, state, cost and
/// errors), front.md and approximations.md (tables), and plots, one panel per Sun:
/// seconds_radiance.svg, seconds_luminance.svg, seconds_ciede2000.svg, memory_radiance.svg, and
/// front.svg, the mean over the Suns. Returns the names. Throws std::runtime_error naming a file
/// that cannot be written.
std::vector<std::string> write_tradeoff_report(const TradeoffPlan& plan,
                                               const TradeoffOutcome& outcome);

}  // namespace twilight
