// A ladder's outcome as tables and plots.
#pragma once

#include <string>
#include <vector>

#include "output/sky_sample.h"
#include "output/tradeoff.h"

namespace twilight {

/// One rung under one Sun against one baseline.
struct TradeoffRow {
  const RungOutcome* rung = nullptr;
  std::string baseline;  ///< "reference", or the rung that differs by one approximation alone
  double sun_elevation_deg = 0.0;
  SunCost cost;
  SkyDifference difference;
  /// On the Pareto front of seconds and mean error among all rungs under this Sun (against the
  /// reference alone).
  bool front_radiance = false, front_luminance = false, front_ciede2000 = false;
};

/// Rows of every rung that was run, against the reference and then its own baseline. Refers to
/// `outcome`.
std::vector<TradeoffRow> tradeoff_rows(const TradeoffOutcome& outcome);

/// A rung over all its Suns, against the reference: means over the Suns of what a row has, largest
/// for memory.
struct TradeoffMean {
  const RungOutcome* rung = nullptr;
  SunCost cost;
  std::optional<Spread> radiance, luminance, ciede2000;  ///< none if one Sun has none
  bool front_radiance = false, front_luminance = false, front_ciede2000 = false;
};
std::vector<TradeoffMean> tradeoff_means(const std::vector<TradeoffRow>& rows);

/// Writes into the plan's folder, each file whole or not at all: tradeoff.csv (a line per row),
/// tradeoff.json (scene, reference, machine, every rung with its settings, state, cost and
/// errors), front.md and approximations.md (tables), and plots, one panel per Sun:
/// seconds_radiance.svg, seconds_luminance.svg, seconds_ciede2000.svg, memory_radiance.svg, and
/// front.svg, the mean over the Suns. Returns the names. Throws std::runtime_error naming a file
/// that cannot be written.
std::vector<std::string> write_tradeoff_report(const TradeoffPlan& plan,
                                               const TradeoffOutcome& outcome);

}  // namespace twilight
