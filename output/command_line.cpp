#include "output/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>
#include <stdexcept>

#include "atmosphere/csv_line.h"
#include "sim/quality.h"

namespace twilight {
namespace {

constexpr std::string_view kElevationColumn = "view_elevation_deg";
constexpr std::string_view kAzimuthColumn = "relative_azimuth_deg";

// A whole finite decimal number inside low..high; `what` names it in the complaint.
double number_in(std::string_view text, double low, double high, std::string_view what) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const char* const start = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [stop, error] = std::from_chars(start, end, value);
  if (error != std::errc{} || stop != end || !(value >= low && value <= high)) {
    throw std::invalid_argument(
        fmt::format("{} = {}: must be a number in {}..{}", what, text, low, high));
  }
  return value;
}

double elevation_of(std::string_view text, std::string_view what) {
  return number_in(text, -90.0, 90.0, what);
}

double azimuth_of(std::string_view text, std::string_view what) {
  return number_in(text, -360.0, 360.0, what);
}

// "30,5,-6": distinct elevations of the Sun.
std::vector<double> parse_fit_suns(const std::string& list) {
  std::vector<double> suns;
  for (const std::string_view cell : split_at_commas(list)) {
    const double sun = elevation_of(cell, fmt::format("--suns {}: elevation of the Sun", list));
    if (std::ranges::find(suns, sun) != suns.end()) {
      throw std::invalid_argument(fmt::format("--suns {}: {} is given twice", list, sun));
    }
    suns.push_back(sun);
  }
  return suns;
}

void add_threads(CLI::App* sub, CommandLine& line) {
  sub->add_option_function<int>(
         "--threads",
         [&line](int threads) {
           line.overrides.push_back(fmt::format("solver.threads={}", threads));
         },
         "number of threads, 0 = one per core; the result does not depend on it")
      ->check(CLI::Range(0, 1024));
}

CLI::App* add_command(CLI::App& app, CommandLine& line, Command command, const char* name,
                      const char* what) {
  CLI::App* sub = app.add_subcommand(name, what);
  sub->callback([&line, command] { line.command = command; });
  sub->add_option("SCENE", line.scene, "scene file (TOML)")->required();
  sub->add_option("--set", line.overrides,
                  "KEY=VALUE overrides a key of the scene, as solver.azimuth_divisions=72; the "
                  "value is typed as TOML; repeatable")
      ->allow_extra_args(false);
  add_threads(sub, line);
  sub->add_flag("--quiet", line.quiet, "no progress, no summary on standard error");
  sub->add_flag("--print-config", line.print_config,
                "print the resolved scene, defaults included, and stop");
  return sub;
}

void add_field(CLI::App* sub, CommandLine& line) {
  sub->add_option(
      "--field", line.field,
      "field that `twilight solve` wrote (netCDF), looked up instead of solving; of the "
      "same atmosphere, ground and solver, for any Sun, observer and view");
}

void add_tables(CLI::App& app, CommandLine& line) {
  TablesOptions& options = line.tables;
  CLI::App* sub = add_command(app, line, Command::kTables, "tables",
                              "tables that real-time renderers sample, filled by solver.method "
                              "\"orders\"");
  sub->add_option(
         "--layout", options.layout,
         "bruneton2008, bruneton2017, hillaire2020, or twilight: that of 2017 with another "
         "axis of the Sun, to 18.5 degrees below the horizon")
      ->required();
  sub->add_option("-o,--output", options.directory,
                  "folder for NAME.dat (float32 RGBA), NAME.exr and manifest.json")
      ->required();
  sub->add_option("--spectrum", options.spectrum,
                  "rgb: linear Rec. 709, integrated over the spectrum; wavelengths: spectral "
                  "radiance nearest to 680, 550 and 440 nm")
      ->capture_default_str();
  sub->add_flag("--separate-mie", options.separate_mie,
                "single Mie scattering in a texture of its own, not its red in alpha");
  sub->add_option("--filling", options.filling,
                  "fitted: texels that make the interpolated sky fit best; nodes: the solver's "
                  "values where texels stand")
      ->capture_default_str();
  sub->add_option("--mie-g", options.mie_g,
                  "g of the renderer's Mie phase function, -0.99..0.99 [the best]");
  sub->add_option("--mu-s-min-deg", options.mu_s_min_deg,
                  "solar zenith angle, degrees, that makes mu_s_min: above 90, to 120 [102; "
                  "twilight 108.5]");
  sub->add_option("--scale", options.scale, "factor of every axis' texels, 0.1..4")
      ->capture_default_str();
  sub->add_flag("--half", options.half, "also NAME.half.exr, 16 bit floats");
  sub->add_option("--suns", options.suns,
                  "elevations of the Sun, degrees: of hillaire2020's sky views "
                  "[60,30,10,5,0,-3,-6,-9,-12] and of --check")
      ->delimiter(',');
  sub->add_flag("--check", options.check,
                "compare the sky read from the tables with the solver's, as errors.csv");
  sub->add_option("--check-scales", options.check_scales,
                  "scales whose error --check measures too, as 0.5,2")
      ->delimiter(',');
  add_field(sub, line);
}

void add_optics(CLI::App& app, CommandLine& line) {
  CLI::App* sub =
      add_command(app, line, Command::kOptics, "optics",
                  "the layers of the atmosphere as CSV, or tables of their optics in a file");
  sub->add_option("--export", line.optics.export_file,
                  "FILE.nc (netCDF, CF) or FILE.csv: extinction, scattering, asymmetry, optical "
                  "depths and scattering matrices");
  sub->add_flag("--components", line.optics.components,
                "export the ten shipped components over humidity and the scene's wavelengths, as "
                "FILE_WASO.nc ..., in place of the layers");
}

void add_sequence(CLI::App& app, CommandLine& line) {
  SequenceOptions& options = line.sequence;
  CLI::App* sub = add_command(app, line, Command::kSequence, "sequence",
                              "a film of the sky: numbered images, pictures, and MP4 or WebM");
  const char* const kInstant =
      "time with offset, as 2003-12-08T17:00:00+01:00, of a scene with a place; else elevation of "
      "the Sun, degrees";
  sub->add_option("--from", options.from, kInstant)->required();
  sub->add_option("--to", options.to, kInstant)->required();
  sub->add_option("--frames", options.frames, "how many, both ends included: 2..100000")
      ->required();
  sub->add_option(
         "-o,--output", options.directory,
         "folder for frame_0001.exr, frame_0001.png and on; frames that are there are kept")
      ->required();
  sub->add_option("--fps", options.frames_per_second, "frames per second of the film")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  sub->add_option("--exposure", options.exposure,
                  "of the pictures: auto follows the sky, smoothed over the frames; or a camera's "
                  "exposure value at ISO 100, -40..40, for all of them")
      ->capture_default_str();
  CLI::Option* none = sub->add_flag("!--no-video", options.video, "no film");
  sub->add_flag("--webm", options.webm, "film as WebM (VP9), not MP4 (H.264)")->excludes(none);
  add_field(sub, line);
}

void add_tradeoff(CLI::App& app, CommandLine& line) {
  TradeoffOptions& options = line.tradeoff;
  CLI::App* sub = add_command(app, line, Command::kTradeoff, "tradeoff",
                              "seconds and memory against error, for a ladder of settings");
  sub->add_option("-o,--output", options.directory,
                  "folder for tables, plots and each rung's result; a run that was stopped goes on "
                  "with what is there")
      ->required();
  sub->add_option("--reference", options.reference,
                  "what errors are measured against: orders (finer grids), monte-carlo (at the "
                  "scene's target_relative_error), or the reference.json of an earlier run")
      ->capture_default_str();
  sub->add_option("--reference-set", options.reference_overrides,
                  "KEY=VALUE for the reference alone; repeatable")
      ->allow_extra_args(false);
  sub->add_option(
      "--only", options.only,
      "run only rungs whose name, group or kind matches, as 'cells-*' or approximation");
  sub->add_option("--suns", options.suns,
                  "elevations of the Sun, degrees [30,5,0,-3,-6,-9,-12; quick: 5,-3,-6]");
  sub->add_option("--repeat", options.repeat, "runs of every rung; the least seconds count [1]");
  sub->add_flag("--quick", options.quick, "few rungs, coarse grids, three Suns");
  sub->add_flag("--fresh", options.fresh, "run again what is there already");

  CLI::App* rung = add_command(app, line, Command::kTradeoffRung, "tradeoff-rung", "");
  rung->group("");  // of the program's own use
  rung->add_option("--suns", options.suns)->required();
  rung->add_option("--parent", line.parent)->required();
}

// One command per form: `twilight fit perez SCENE`.
void add_fit(CLI::App& app, CommandLine& line) {
  CLI::App* fit = app.add_subcommand(
      "fit", "a form's coefficients from simulated skies, for solver.method \"fit:FILE\"");
  fit->require_subcommand(1);
  const auto add = [&](SkyForm form, const char* what) {
    const std::string name(sky_form_name(form));
    CLI::App* sub = add_command(*fit, line, Command::kFit, name.c_str(), what);
    sub->callback([&line, form] {
      line.command = Command::kFit;
      line.fit.form = form;
    });
    sub->get_option("SCENE")->description("scene file, or study (a scene and [[axis]] tables)");
    sub->add_option("-o,--output", line.fit_output, "file to write (JSON)")->required();
    sub->add_option_function<std::string>(
           "--quantity",
           [&line](const std::string& word) { line.fit.quantity = fit_quantity_from_name(word); },
           "spectral (radiance per wavelength), or luminance-chromaticity (Y, x, y) [spectral]")
        ->check(CLI::IsMember({"spectral", "luminance-chromaticity"}));
    sub->add_option("--iterations", line.fit.most_iterations,
                    "most steps of a search; one that needs more has not converged, which the file "
                    "and the exit code say")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    sub->add_option_function<std::string>(
           "--suns",
           [&line](const std::string& list) {
             try {
               line.fit_suns_deg = parse_fit_suns(list);
             } catch (const std::invalid_argument& error) {
               throw CLI::ValidationError(error.what());
             }
           },
           "elevations of the Sun, degrees, where the study has no such axis [60..-12, 23 of them]")
        ->allow_extra_args(false);
  };
  add(SkyForm::kPerez, "five parameters: Perez, Seals & Michalsky 1993");
  add(SkyForm::kHosek, "nine parameters: Hosek & Wilkie 2012");
}

void add_retrieve(CLI::App& app, CommandLine& line) {
  RetrieveOptions& options = line.retrieve;
  CLI::App* sub = app.add_subcommand(
      "retrieve",
      "the air from what was measured of its sky: radiances, zenith curves, photographs");
  sub->callback([&line] { line.command = Command::kRetrieve; });
  sub->add_option("MEASURED", options.measured,
                  "CSV of radiances or of zenith brightness, or a TOML file that describes either "
                  "or a photograph")
      ->required();
  sub->add_option("--scene", line.scene, "scene file (TOML): all that is not free")->required();
  sub->add_option("--free", options.free,
                  "keys of the scene to retrieve, as aerosols.optical_depth_550nm,"
                  "atmosphere.ozone_du=200..500")
      ->required()
      ->allow_extra_args(false);
  sub->add_option("-o,--output", options.directory,
                  "folder for retrieval.json, residuals, and the scene with the best values")
      ->required();
  sub->add_option("--relative-error", options.relative_error,
                  "standard error over value, of data that say none")
      ->check(CLI::Range(1e-6, 10.0));
  sub->add_option(
         "--search", options.search_quality,
         "quality of the solver while it searches: draft, fair, standard, high, reference, "
         "or scene; the scene's own has the last word")
      ->check(CLI::IsMember({"draft", "fair", "standard", "high", "reference", "scene"}))
      ->capture_default_str();
  sub->add_option("--starts", options.search.starts, "searches at most; two that agree are enough")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  sub->add_option("--iterations", options.search.most_iterations, "most steps of a search")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  sub->add_option("--seed", options.search.seed, "of the starts")->capture_default_str();
  sub->add_option("--set", line.overrides, "KEY=VALUE overrides a key of the scene; repeatable")
      ->allow_extra_args(false);
  add_threads(sub, line);
  sub->add_flag("--quiet", line.quiet, "no progress, no summary on standard error");
}

void add_views(CLI::App* sub, CommandLine& line) {
  sub->add_option("--view", line.views,
                  "EL,AZ in degrees: elevation, and azimuth from the Sun's; repeatable")
      ->allow_extra_args(false);
  sub->add_option("--views", line.views_file,
                  "CSV file with the columns view_elevation_deg,relative_azimuth_deg");
}

void add_compare(CLI::App& app, CommandLine& line) {
  ComparisonOptions& options = line.comparison;
  CLI::App* sub = app.add_subcommand(
      "compare", "models, methods and images side by side, as CSV: how far each is from the first");
  sub->callback([&line] { line.command = Command::kCompare; });
  sub->add_option("SKY", options.contenders,
                  "a solver.method, with settings of its own behind commas as "
                  "nishita,models.air=scene, or an EXR file; the first is the reference")
      ->required()
      ->expected(2, 64);
  sub->add_option("--scene", options.scene, "scene file (TOML) [the defaults of every key]");
  sub->add_option("-o,--output", options.directory,
                  "folder for the table and the pictures, with false-colour maps of the error");
  sub->add_option("--suns", options.suns,
                  "elevations of the Sun, degrees [60,30,10,5,2,0,-2,-4,-6,-9,-12]");
  sub->add_option("--projection", options.projection,
                  "of images that carry none of ours: fisheye, latlong or octahedral");
  sub->add_option("--picture-size", options.picture_size, "of each fisheye, 16..1024 pixels")
      ->capture_default_str();
  sub->add_option("--set", line.overrides, "KEY=VALUE overrides a key of the scene; repeatable")
      ->allow_extra_args(false);
  add_threads(sub, line);
  sub->add_flag("--quiet", line.quiet, "no progress, no summary on standard error");
}

void add_study(CLI::App& app, CommandLine& line) {
  StudyOptions& options = line.study;
  CLI::App* sub = add_command(app, line, Command::kStudy, "study",
                              "many skies: a scene's keys varied ([[axis]]), what is measured of "
                              "each ([outputs]), as netCDF, CSV, plots and a page");
  CLI::Option* scene = sub->get_option("SCENE");
  scene->required(false)->description("study file (TOML)");
  CLI::Option* output = sub->add_option(
      "-o,--output", options.directory,
      "folder for study.nc, study.csv, index.html and each case's own file; a run that was stopped "
      "goes on with what is there");
  CLI::Option* one = sub->add_option("--case", options.case_number,
                                     "compute this case alone, 1.. as --list numbers them, and put "
                                     "nothing together");
  CLI::Option* shard =
      sub->add_option("--shard", options.shard,
                      "I/N: compute the I-th (1..N) of N parts alone, and put nothing together");
  sub->add_option("--slurm", options.slurm_tasks,
                  "N: write DIR/study.sbatch, an array of N shards with predicted time and memory, "
                  "and stop")
      ->check(CLI::Range(std::size_t{1}, std::size_t{100000}))
      ->excludes(one)
      ->excludes(shard);
  sub->add_option("--merge", options.merge,
                  "put together the cases that these folders hold, in the first or that of -o; "
                  "without study file")
      ->excludes(one)
      ->excludes(shard)
      ->excludes(scene);
  sub->add_flag("--partial", options.partial, "with --merge: cases that are missing become NaN");
  sub->add_flag("--list", options.list, "print the cases as CSV and stop");
  sub->add_flag("--fresh", options.fresh, "compute again what is there already");
  one->excludes(shard);
  sub->callback([&line, scene, output] {
    line.command = Command::kStudy;
    const StudyOptions& options = line.study;
    if (!options.merge.empty()) return;
    if (scene->empty()) throw CLI::RequiredError("SCENE, a study file, or --merge DIR");
    if (output->empty() && !options.list) throw CLI::RequiredError("-o DIR");
    if (options.partial) throw CLI::RequiredError("--merge DIR beside --partial");
  });
}

// CLI11 says of an unknown command only that it was not expected.
std::optional<std::string> unknown_command(const CLI::App& app, int argc, const char* const* argv) {
  if (argc < 2 || std::string_view(argv[1]).starts_with('-')) return std::nullopt;
  std::string known;
  for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (sub->get_name() == argv[1]) return std::nullopt;
    if (sub->get_group().empty()) continue;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", sub->get_name());
  }
  return fmt::format("'{}': unknown command; must be one of {}", argv[1], known);
}

}  // namespace

ViewDirection View::direction() const {
  constexpr double kRadians = std::numbers::pi / 180.0;
  return {elevation_deg * kRadians, relative_azimuth_deg * kRadians};
}

std::filesystem::path CommandLine::spectral_output() const {
  std::filesystem::path path = output;
  return path.replace_extension(".spectral.exr");
}

ParsedCommandLine parse_command_line(int argc, const char* const* argv) {
  CommandLine line;
  CLI::App app{"Spectral radiance of the clear sky, by day and twilight, from a scene file"};
  app.name("twilight");
  app.set_version_flag("--version", fmt::format("twilight {}", kVersion));
  app.require_subcommand(1);

  CLI::App* render =
      add_command(app, line, Command::kRender, "render", "the sky as a high dynamic range image");
  render->add_option("-o,--output", line.output, "image to write (OpenEXR)")->capture_default_str();
  add_field(render, line);
  render->add_option("--preview", line.preview, "tone-mapped picture to write (PNG)");

  render->footer(quality_table());

  CLI::App* radiance = add_command(app, line, Command::kRadiance, "radiance",
                                   "spectral radiance of given views, as CSV");
  add_views(radiance, line);
  add_field(radiance, line);

  CLI::App* aerial = add_command(app, line, Command::kAerial, "aerial",
                                 "aerial perspective: transmittance to things at given distances, "
                                 "and the light of the air in front of them, as CSV");
  add_views(aerial, line);
  aerial->add_option("--distance", line.distances_km, "km along the view, 0..100000; repeatable")
      ->required()
      ->allow_extra_args(false)
      ->check(CLI::Range(0.0, 1e5));
  add_field(aerial, line);

  CLI::App* irradiance = add_command(app, line, Command::kIrradiance, "irradiance",
                                     "direct, diffuse and global horizontal irradiance, as CSV");
  add_field(irradiance, line);
  CLI::App* solve = add_command(app, line, Command::kSolve, "solve",
                                "the field of solver.method \"orders\", which serves every Sun, "
                                "observer and view, as netCDF for --field");
  solve->add_option("-o,--output", line.field_output, "file to write (netCDF)")
      ->capture_default_str();
  add_command(app, line, Command::kSun, "sun",
              "where the Sun stands, and when it sets and twilight ends, as CSV");
  add_optics(app, line);

  add_tables(app, line);
  add_sequence(app, line);
  add_tradeoff(app, line);
  add_fit(app, line);
  add_retrieve(app, line);
  add_compare(app, line);
  add_study(app, line);

  try {
    app.parse(argc, argv);
    const bool no_views = line.views.empty() && !line.views_file;
    const bool looks = line.command == Command::kRadiance || line.command == Command::kAerial;
    if (looks && no_views && !line.print_config)
      throw CLI::RequiredError("--view EL,AZ or --views FILE");
  } catch (const CLI::ParseError& error) {
    if (const auto complaint = unknown_command(app, argc, argv)) {
      fmt::print(stderr, "twilight: {}\n", *complaint);
      return {std::nullopt, kExitBadInput};
    }
    const int code = app.exit(error);
    return {std::nullopt, code == 0 ? kExitSuccess : kExitBadInput};
  }
  return {std::move(line), kExitSuccess};
}

View parse_view(std::string_view text) {
  const std::vector<std::string_view> cells = split_at_commas(text);
  if (cells.size() != 2) {
    throw std::invalid_argument(fmt::format(
        "--view {}: must be EL,AZ, elevation -90..90 and azimuth from the Sun -360..360", text));
  }
  return {elevation_of(cells[0], fmt::format("--view {}: elevation", text)),
          azimuth_of(cells[1], fmt::format("--view {}: azimuth from the Sun", text))};
}

std::vector<View> read_views(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::ifstream stream(path);
  if (!stream || std::filesystem::is_directory(path))
    throw std::runtime_error(fmt::format("{}: cannot read this file of views", name));

  std::vector<View> views;
  bool header_seen = false;
  std::size_t elevation_column = 0;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    const std::string_view content = trimmed(line);
    if (content.empty() || content.starts_with('#')) continue;
    const std::vector<std::string_view> cells = split_at_commas(content);
    if (!header_seen) {
      const bool forward = content.find(kElevationColumn) < content.find(kAzimuthColumn);
      elevation_column = forward ? 0 : 1;
      if (cells.size() != 2 || cells[elevation_column] != kElevationColumn ||
          cells[1 - elevation_column] != kAzimuthColumn) {
        throw std::invalid_argument(fmt::format("{}:{}: header is '{}': must be {},{}", name,
                                                number, content, kElevationColumn, kAzimuthColumn));
      }
      header_seen = true;
      continue;
    }
    if (cells.size() != 2) {
      throw std::invalid_argument(fmt::format("{}:{}: '{}' has {} values: must have 2, {},{}", name,
                                              number, content, cells.size(), kElevationColumn,
                                              kAzimuthColumn));
    }
    const auto column = [&](std::string_view title) {
      return fmt::format("{}:{}: column '{}'", name, number, title);
    };
    views.push_back({elevation_of(cells[elevation_column], column(kElevationColumn)),
                     azimuth_of(cells[1 - elevation_column], column(kAzimuthColumn))});
  }
  if (stream.bad()) throw std::runtime_error(fmt::format("{}: cannot be read", name));
  if (views.empty()) {
    throw std::invalid_argument(
        fmt::format("{}: has no views: must have a header {},{} and at "
                    "least one row",
                    name, kElevationColumn, kAzimuthColumn));
  }
  return views;
}

}  // namespace twilight
