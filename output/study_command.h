// The command `twilight study`.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace twilight {

struct Run;

/// What the user asks of a study, beside its file and overrides.
struct StudyOptions {
  std::filesystem::path directory;
  std::optional<std::size_t> case_number;    ///< this case alone, 1..
  std::string shard;                         ///< "I/N": this shard alone
  std::optional<std::size_t> slurm_tasks;    ///< write the sbatch file for so many and stop
  std::vector<std::filesystem::path> merge;  ///< folders to put together
  bool list = false;                         ///< print the plan and stop
  bool fresh = false;                        ///< compute again what is there
  bool partial = false;                      ///< merge: put together though cases are missing
};

/// One shard of several.
struct Shard {
  std::size_t index = 1, count = 1;
};

/// Of "I/N". Throws std::invalid_argument naming text and ranges.
Shard parse_shard(std::string_view text);

/// Plans, computes and puts together (study_plan.h, study_run.h, study_files.h), as asked.
void study(Run& run);

}  // namespace twilight
