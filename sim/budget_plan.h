// The choice of settings for a budget of error or of time.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/run_control.h"
#include "sim/scene_model.h"
#include "sim/scene_requirements.h"

namespace twilight {

/// Something that the plan leaves out, and the error it estimates for that.
struct LeftOut {
  std::string what;
  double error;
};

struct BudgetPlan {
  Scene scene;          ///< with the settings chosen; without quality and budget
  std::string quality;  ///< the level whose steps it has
  double discretisation_error = 0;
  std::vector<LeftOut> left_out;
  std::vector<LeftOut> kept;     ///< what was looked at and stays, and what leaving it out would do
  double estimated_error = 0;    ///< of everything together, before the safety factor
  double predicted_seconds = 0;  ///< of processor time on this machine, the pilot apart
  double full_seconds = 0;       ///< the same with nothing left out, at quality "standard"
  double pilot_seconds = 0;      ///< processor time of the choice itself
  bool within_budget = true;     ///< false: max_seconds is too short for any level

  /// Lines for a run's summary.
  std::vector<std::pair<std::string, std::string>> figures() const;
  /// What an image's attributes hold of it: deterministic for max_relative_error.
  std::vector<std::pair<std::string, std::string>> attributes() const;
};

/// Errors are estimated at the 95th percentile of the views by coarse solutions, and those of
/// several effects add up; what is left for the unknown.
inline constexpr double kBudgetSafety = 1.5;

/// Chooses for a scene with a [budget]. The method is "orders": at equal error it is the cheapest
/// of the three for any view (sim/README.md).
///
/// max_relative_error: of every quality level whose discretisation error (discretisation_error())
/// leaves something, the cheapest after leaving out, by saving over error, what fits into
/// kBudgetSafety * (sum of the estimated errors) + discretisation error <= budget. Effects that
/// save nothing are left out only where they cannot matter: below kNegligibleShare of the budget
/// each. The choice depends on the scene and the views alone, not on the machine or its threads.
///
/// max_seconds: the finest level that is predicted to fit (cost_model.h), and, where not even the
/// coarsest does, without the effects that matter least for what they save, up to half the light.
/// It depends on the machine. With both, the error counts first; `within_budget` says whether the
/// time fits as well.
///
/// Throws std::invalid_argument where no level is fine enough for the budget, and as
/// estimate_requirements().
BudgetPlan plan_budget(const Scene& scene, const WantedSky& wanted, KnownPhases& known,
                       const RunControl& control);

}  // namespace twilight
