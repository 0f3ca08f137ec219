// Computes the cases of a study, each into a file of its own.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>

#include "output/study_plan.h"
#include "sim/run_control.h"

namespace twilight {

/// Where a run stands, after every atmosphere.
struct StudyProgress {
  std::size_t cases = 0;  ///< of this run
  std::size_t kept = 0;   ///< of them there already
  std::size_t done = 0, failed = 0;
  double seconds = 0;  ///< since the run began
  std::size_t left() const { return cases - kept - done - failed; }
  /// By the cases done so far; 0 where there are none.
  double seconds_left() const;
};

/// What a run did.
struct StudyOutcome {
  StudyProgress progress;
  std::size_t solves = 0;  ///< atmospheres solved
};

/// Computes those of the cases (increasing numbers) that DIR/cases does not hold sound, group by
/// group: one solved atmosphere per group, the Suns and observers of a group at the same time on
/// the threads of the scene. Every case is written, whole or not at all, as soon as it is done; a
/// case that throws leaves its error instead (DIR/cases/HASH.error) and the others go on. The bytes
/// of a case's file depend on its inputs alone, not on the other cases, threads or earlier runs.
/// Several processes may work on one folder. Nothing is kept in memory but the group being worked
/// on. `after_group` hears where the run stands.
/// Throws std::runtime_error naming the file where a file or folder cannot be written (what is done
/// stays), Cancelled when told to stop, std::bad_alloc.
StudyOutcome run_study(const StudyPlan& plan, const std::filesystem::path& directory,
                       std::span<const std::size_t> cases, bool fresh, const RunControl& control,
                       const std::function<void(const StudyProgress&)>& after_group = {});

}  // namespace twilight
