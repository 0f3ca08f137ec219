// What accuracy costs: a ladder of settings run one by one, each in a process of its own.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "output/rung_run.h"
#include "output/tradeoff_ladder.h"
#include "sim/run_control.h"
#include "sim/scene.h"

namespace twilight {

/// What `twilight tradeoff` was asked for.
struct TradeoffOptions {
  std::filesystem::path scene;
  std::vector<std::string> overrides;  ///< of the scene, "KEY=VALUE"
  /// "orders" (finer grids), "monte-carlo", or a reference.json of an earlier run.
  std::string reference = "orders";
  std::vector<std::string> reference_overrides;  ///< of the reference alone, on top of its own
  std::filesystem::path directory;
  std::optional<std::string> only;  ///< run the rungs whose name or group this glob matches
  bool quick = false;               ///< a short ladder, coarse grids, three Suns
  bool fresh = false;               ///< run again what is there already
  int repeat = 1;                   ///< 1..100 runs of every rung; the least seconds count
  std::string suns;                 ///< "30,5,-6", deg; empty: the usual ones
};

/// A rung made into a scene.
struct PlannedRung {
  Rung rung;
  std::string scene_toml;  ///< in full
  std::string inputs;      ///< fingerprint of version, rung, scene, own layers and Suns
  bool wanted = true;      ///< named by --only, or the baseline of one that is
  std::string skipped;     ///< why it says nothing of this scene; empty: it does
};

struct TradeoffPlan {
  TradeoffOptions options;
  std::vector<double> suns_deg;
  std::string scene_toml;    ///< the ladder's scene in full
  std::string scene_inputs;  ///< fingerprint of its physics: all but solver, spectrum and output
  std::vector<PlannedRung> rungs;
  PlannedRung reference;
  std::optional<std::filesystem::path> reference_file;  ///< instead of running one
};

enum class RungState { kDone, kSkipped, kFailed, kNotRun };
std::string_view rung_state_name(RungState state);

struct RungOutcome {
  PlannedRung planned;
  RungState state = RungState::kNotRun;
  std::string reason;          ///< of kSkipped and kFailed
  std::optional<RungRun> run;  ///< of kDone
};

struct TradeoffOutcome {
  RungRun reference;
  std::vector<RungOutcome> rungs;
  int ran = 0, kept = 0;  ///< rungs run by this call, and taken from files; the reference counts
};

/// "30,5,0,-3,-6,-9,-12" and the like: 1..32 numbers in -18..90, none twice, else
/// std::invalid_argument naming value and range. Empty: those seven, quick: 5, -3, -6.
std::vector<double> parse_suns(std::string_view text, bool quick);

/// Looks at everything that can be wrong before a long run: scene, overrides, reference, Suns,
/// glob. Writes nothing. Throws std::invalid_argument or std::runtime_error naming what is wrong.
TradeoffPlan plan_tradeoff(const TradeoffOptions& options);

/// Runs what is wanted and not in DIR/rungs yet with the same inputs, and writes DIR/reference.json
/// and DIR/rungs/NAME.json, each whole or not at all, as they are done; a run that is
/// stopped or killed loses one rung. A rung that fails is an outcome, a reference that fails
/// std::runtime_error. Throws Cancelled when told to stop.
TradeoffOutcome run_tradeoff(const TradeoffPlan& plan, const RunControl& control);

/// What a child process does: samples the scene, whose TOML is in a file, under the Suns, and
/// returns a SkySample as JSON. Throws as load_scene and sample_sky.
std::string run_tradeoff_rung(const std::filesystem::path& scene, const std::string& suns,
                              const RunControl& control);

}  // namespace twilight
