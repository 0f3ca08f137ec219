// Checks of whole skies against published or independently computed figures: one row each of the
// table that validation_table prints.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/scene_model.h"
#include "sim/sky.h"

namespace twilight::validation {

inline constexpr double kRadPerDeg = std::numbers::pi / 180;

/// One row of the table.
struct Check {
  std::string name;
  std::string bar;
  std::string measured;
  bool holds = false;
  double seconds = 0;
};

/// How a run was asked for.
struct Settings {
  bool quick = false;               ///< a subset of the points, for tests
  std::filesystem::path directory;  ///< for CSV, Markdown and SVG files; empty: none
  bool progress = false;            ///< say on standard error what is being done
  /// "solver.phase_degree=16" and the like: keys of a scene file that replace those of a check's
  /// own scene.
  std::vector<std::string> overrides;
  double monte_carlo_seconds = 20;      ///< of one view, about, at most
  double monte_carlo_relative = 0.003;  ///< standard error wanted
};

/// A part of the table that can be run alone.
struct Section {
  std::string name;
  std::string about;
  std::function<std::vector<Check>(const Settings&)> run;
};

/// Every section, in the order of the table.
std::vector<Section> sections();

/// The scene with the settings' overrides. Throws std::invalid_argument as parse_scene.
Scene with_overrides(Scene scene, const Settings& settings);

/// "| case | bar | measured | holds | s |", with the separator below; and one row of it.
std::string markdown_header();
std::string markdown_row(const Check& check);

/// Writes a line to standard error where the settings ask for progress.
void say(const Settings& settings, std::string_view text);

/// Seconds since its construction.
class Stopwatch {
 public:
  Stopwatch();
  double seconds() const;

 private:
  double start_;
};

/// Median, 95th percentile and largest of the sizes of relative differences.
struct Spread {
  std::size_t count = 0;
  double median = 0, percentile_95 = 0, worst = 0;
};
Spread spread_of(std::span<const double> differences);

/// "12 values: median 0.10 %, 95 % within 0.30 %, worst 0.40 %".
std::string text_of(const Spread& spread);

/// A view at an elevation and an azimuth from the Sun's, deg.
struct ViewAngles {
  double elevation_deg, relative_azimuth_deg;
  ViewDirection direction() const {
    return {elevation_deg * kRadPerDeg, relative_azimuth_deg * kRadPerDeg};
  }
};

}  // namespace twilight::validation
