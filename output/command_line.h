// What the user types after `twilight`.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "output/air_retrieval.h"
#include "output/optics_command.h"
#include "output/sequence_command.h"
#include "output/sky_comparison.h"
#include "output/sky_fit.h"
#include "output/study_command.h"
#include "output/tables_command.h"
#include "output/tradeoff.h"
#include "sim/sky.h"

namespace twilight {

inline constexpr std::string_view kVersion = "0.1.0";

/// Exit codes of the program. Bad input is whatever is wrong before a long run starts.
inline constexpr int kExitSuccess = 0;
inline constexpr int kExitFailure = 1;
inline constexpr int kExitBadInput = 2;
inline constexpr int kExitInterrupted = 130;

enum class Command {
  kRender,
  kRadiance,
  kIrradiance,
  kSun,
  kOptics,
  kSolve,
  kCompare,
  kAerial,
  kTables,
  kSequence,
  kTradeoff,
  kTradeoffRung,
  kFit,
  kStudy,
  kRetrieve
};

/// A view as the user gave it, in degrees.
struct View {
  double elevation_deg = 0.0;         ///< -90..90
  double relative_azimuth_deg = 0.0;  ///< -360..360; 0 = towards the Sun

  ViewDirection direction() const;
};

struct CommandLine {
  Command command = Command::kRender;
  std::filesystem::path scene;
  std::vector<std::string> overrides;  ///< "KEY=VALUE" in the order given; --threads is the last
  bool quiet = false;
  bool print_config = false;
  std::filesystem::path output = "sky.exr";         ///< render
  std::optional<std::filesystem::path> preview;     ///< render
  std::filesystem::path field_output = "field.nc";  ///< solve
  /// render, radiance, irradiance: a field solved before, looked up instead of solving.
  std::optional<std::filesystem::path> field;
  std::vector<std::string> views;  ///< radiance, "EL,AZ"
  std::optional<std::filesystem::path> views_file;
  std::vector<double> distances_km;  ///< aerial, 0..1e5
  TablesOptions tables;
  OpticsOptions optics;
  SequenceOptions sequence;
  /// tradeoff; its scene and overrides are those above.
  TradeoffOptions tradeoff;
  /// fit: form and quantity, the Suns of a study that names none, and the file to write.
  SkyFitOptions fit;
  std::vector<double> fit_suns_deg;
  std::filesystem::path fit_output;
  RetrieveOptions retrieve;      ///< its scene and overrides are those above
  ComparisonOptions comparison;  ///< compare; its overrides are those above
  StudyOptions study;            ///< its scene (the study file) and overrides are those above
  int parent = 0;                ///< tradeoff-rung: the process that measures it

  /// Where the spectral layout goes: "sky.spectral.exr" beside "sky.exr".
  std::filesystem::path spectral_output() const;
};

/// Either a command to run or, for --help, --version and wrong usage, the exit code.
struct ParsedCommandLine {
  std::optional<CommandLine> command;
  int exit_code = kExitSuccess;
};

/// Reads the arguments; help and version go to standard output, wrong usage to standard error.
ParsedCommandLine parse_command_line(int argc, const char* const* argv);

/// The view of "EL,AZ". Throws std::invalid_argument naming the text and the ranges.
View parse_view(std::string_view text);

/// The views of a CSV file with the columns view_elevation_deg and relative_azimuth_deg, in either
/// order; empty lines and lines that start with '#' are skipped. Throws std::invalid_argument
/// naming file, line, column, value and range; std::runtime_error if the file cannot be read.
std::vector<View> read_views(const std::filesystem::path& path);

}  // namespace twilight
