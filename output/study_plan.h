// What a study computes: its cases, and which of them share a solved atmosphere.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "output/sky_quantities.h"
#include "output/study_axes.h"

namespace twilight {

/// Raised whenever the same inputs give other numbers or other files of cases.
inline constexpr int kStudyFormat = 1;

/// One combination of a study's axes.
struct PlannedCase {
  std::string hash;       ///< 32 hexadecimal digits, of all that its result depends on
  std::size_t group = 0;  ///< of StudyPlan::groups
};

/// Cases that share one solved atmosphere.
struct CaseGroup {
  std::vector<std::size_t> cases;  ///< increasing; of StudyPlan::cases
  bool shares = false;             ///< the method has an atmosphere to share ("orders")
  std::string particles;           ///< equal where scattering matrices are: the order of work
};

/// Cases by number (0, 1, ... as Study::nodes()), and groups in the order they are worked on:
/// those with the same scattering matrices one after the other.
struct StudyPlan {
  Study study;
  WantedQuantities wanted;
  std::vector<StudyCoordinate> coordinates;
  std::vector<PlannedCase> cases;
  std::vector<CaseGroup> groups;

  /// Atmospheres that need not be solved thanks to grouping.
  std::size_t saved_solves() const;
};

/// Loads and checks every case of a study file, its [outputs] too. Throws std::invalid_argument
/// where a case is no valid scene, has a budget, or other coordinates (wavelengths) than the first;
/// as load_study and read_wanted_quantities.
StudyPlan plan_study(const std::filesystem::path& file, std::span<const std::string> overrides);

/// The scene's part of case_inputs().
std::string scene_inputs(const Scene& scene);

/// Everything that a case's result depends on, as text: format and version of the program, every
/// key of the scene but solver.threads, contents of the files it names (by their fingerprint, not
/// their place), and what is wanted.
std::string case_inputs(const Scene& scene, const WantedQuantities& wanted);

/// Everything that a solved atmosphere of method "orders" depends on: case_inputs() without what
/// only looking at it needs (Sun, its spectrum, observer, output, camera), with the Earth's radius,
/// the Sun's distance and the ground's depth as placed_sun() resolves them.
std::string atmosphere_inputs(const Scene& scene);

/// The cases of shard `index` of `count` (1..count), increasing: disjoint, complete, a function of
/// the plan alone. Groups are kept whole where there are as many as shards; a shard's work is equal
/// to within one group, of a solve that counts as 20 cases.
std::vector<std::size_t> shard_cases(const StudyPlan& plan, std::size_t index, std::size_t count);

/// What a run will take on this machine.
struct StudyCost {
  bool known = true;      ///< false: some method's time is not known beforehand
  double seconds = 0;     ///< wall time
  double peak_bytes = 0;  ///< largest resident memory
};

/// Predicts a run of some cases (predict_run, machine_slowness).
StudyCost predict_study(const StudyPlan& plan, std::span<const std::size_t> cases);

}  // namespace twilight
