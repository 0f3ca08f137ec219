// A rung of the ladder that was run, and its file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "output/machine.h"
#include "output/sky_sample.h"

namespace twilight {

/// What one Sun of a rung took, as if it had been the only one: the least of all repeats, and the
/// most seconds; the largest memory.
struct SunCost {
  double seconds = 0.0, cpu_seconds = 0.0, peak_mib = 0.0;
  double most_seconds = 0.0;
};

/// A rung that was run, now or before.
struct RungRun {
  std::string name, inputs, scene_toml, date;
  std::string scene_inputs;  ///< of the reference: TradeoffPlan::scene_inputs
  Machine machine;
  double seconds = 0.0, cpu_seconds = 0.0;  ///< of all Suns, of the quickest repeat
  SkySample sample;
  std::vector<SunCost> cost;  ///< one per Sun of the sample
};

/// The run as JSON, a file that appears whole or not at all. Throws std::runtime_error naming the
/// file where it cannot be written.
void write_rung_run(const std::filesystem::path& path, const RungRun& run);

/// Throws std::runtime_error naming the file where it cannot be read or holds something else.
RungRun read_rung_run(const std::filesystem::path& path);

/// What a file holds if it was run with these inputs; nothing where there is no file, or a damaged
/// one, or one of other inputs.
std::optional<RungRun> stored_rung_run(const std::filesystem::path& path,
                                       const std::string& inputs);

}  // namespace twilight
