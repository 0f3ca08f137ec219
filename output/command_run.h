// One call of the program: what its commands share.
#pragma once

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "output/command_line.h"
#include "sim/budget_plan.h"
#include "sim/run_control.h"
#include "sim/scene_model.h"

namespace twilight {

/// Input that is wrong before any work has begun.
class BadInput : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Runs something that only looks at input: whatever it throws is bad input.
template <class Action>
auto checking_input(Action action) {
  try {
    return action();
  } catch (const std::exception& error) {
    throw BadInput(error.what());
  }
}

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Progress on standard error: a bar that redraws itself on a terminal, one line per stage
/// elsewhere, nothing when quiet.
class Progress {
 public:
  Progress(spdlog::logger& log, bool quiet);
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// The stage's name and its fraction done, 0..1; from any thread.
  void report(std::string_view stage, double fraction);
  /// Takes the bar off the terminal.
  void clear();

 private:
  spdlog::logger& log_;
  bool quiet_;
  bool terminal_;
  bool drawn_ = false;
  std::mutex mutex_;  // solvers report from any of their threads
  std::string stage_;
  Stopwatch since_drawn_;
};

/// One call of the program: what every command needs.
struct Run {
  const CommandLine& line;
  Scene scene;
  spdlog::logger& log;
  const std::atomic<bool>& stop;  ///< set when the user wants the run to end
  Progress progress;
  Stopwatch clock;
  std::vector<std::pair<std::string, double>> stage_seconds;

  KnownPhases phases;              ///< of the plan's pilot, for the model
  std::optional<BudgetPlan> plan;  ///< that made the scene from what was loaded

  Run(const CommandLine& l, const Scene& s, spdlog::logger& g, const std::atomic<bool>& asked)
      : line(l), scene(s), log(g), stop(asked), progress(g, l.quiet) {}

  RunControl control();

  /// Runs a stage and keeps its time for the summary.
  template <class Action>
  auto timed(const char* stage, Action action) {
    control().check();
    const Stopwatch watch;
    auto result = action();
    stage_seconds.emplace_back(stage, watch.seconds());
    return result;
  }

  SceneModel model();

  /// Chooses the settings where the scene has a budget.
  void choose_settings();

  /// Says what a long run will take, that looks at as many views under each of `suns` Suns;
  /// refuses one that the machine cannot hold.
  void foretell(std::size_t views, std::size_t suns = 1);

  /// Solves the sky, or looks it up in the field the user named.
  std::unique_ptr<Sky> sky(const SceneModel& model);

  void row(std::string_view label, std::string_view value);

  /// The summary of a solved sky: figures, seconds per stage, total, peak memory.
  void summarise(const SceneModel& model, const Sky& sky,
                 const std::vector<std::pair<std::string, std::string>>& figures);

  /// The same for what no one Sun is part of.
  void summarise(const RunSummary& summary,
                 const std::vector<std::pair<std::string, std::string>>& figures);
};

/// Every view that --view and --views name.
std::vector<View> views_of(const CommandLine& line);

/// Throws before the long run unless the file can be made; leaves nothing behind.
void require_output(const std::filesystem::path& path, std::string_view extension);

/// Colours and lux want the whole visible spectrum.
void warn_of_missing_light(const Run& run);

}  // namespace twilight
