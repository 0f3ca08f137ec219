// The program: scene file in, image or CSV out.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <map>
#include <memory>
#include <numbers>
#include <stdexcept>

#include "atmosphere/refraction.h"
#include "output/atomic_file.h"
#include "output/child_run.h"
#include "output/command_run.h"
#include "output/comparison_report.h"
#include "output/csv_table.h"
#include "output/field_file.h"
#include "output/fit_file.h"
#include "output/fit_report.h"
#include "output/optics_command.h"
#include "output/retrieve_command.h"
#include "output/scene_map.h"
#include "output/sequence_command.h"
#include "output/sky_commands.h"
#include "output/sky_fit.h"
#include "output/study_axes.h"
#include "output/tables_command.h"
#include "output/tradeoff.h"
#include "output/tradeoff_report.h"
#include "sim/budget_plan.h"
#include "sim/orders_sky.h"
#include "sim/scene_file.h"
#include "sim/scene_model.h"
#include "sim/simd_target.h"
#include "solar/time_point.h"
#include "solar/twilight_events.h"

namespace twilight {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

// The only state a signal handler may touch.
std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void request_stop(int) { stop_requested.store(true, std::memory_order_relaxed); }

void sun(Run& run) {
  // Where the Sun is seen depends on the air's refractive index alone: one wavelength, no aerosol.
  Scene scene = run.scene;
  constexpr double kWavelengthNm = 550.0;
  remove_aerosols(scene);
  scene.spectrum.solved_nm.clear();
  if (!scene.atmosphere.optical_layers) scene.spectrum.wavelengths_nm = {kWavelengthNm};
  const SceneModel model = build_scene_model(scene);
  const Medium& medium = model.medium;

  const auto nearest = std::ranges::min_element(medium.wavelength_nm, {}, [&](double wavelength) {
    return std::abs(wavelength - kWavelengthNm);
  });
  double apparent_rad = model.sun_elevation_rad;
  bool visible = true;  // the Earth does not hide the Sun's centre
  if (scene.atmosphere.refraction) {
    const auto zenith_rad = apparent_zenith_rad(
        medium, static_cast<std::size_t>(nearest - medium.wavelength_nm.begin()),
        observer_altitude_km(scene), std::numbers::pi / 2.0 - model.sun_elevation_rad);
    visible = zenith_rad.has_value();
    if (visible) apparent_rad = std::numbers::pi / 2.0 - *zenith_rad;
  }

  CsvTable table({"quantity", "value"});
  const auto row = [&](const char* name, double value, bool known = true) {
    table.add_row({name, known ? CsvTable::Cell(value) : CsvTable::Cell("")});
  };
  row("true_elevation_deg", model.sun_elevation_rad * kDegrees);
  row("apparent_elevation_deg", apparent_rad * kDegrees, visible);
  row("refraction_deg", (apparent_rad - model.sun_elevation_rad) * kDegrees, visible);
  row("azimuth_deg", model.sun_azimuth_rad * kDegrees);
  row("distance_au", model.sun_distance_au);

  TwilightTimes times;
  int offset_minutes = 0;
  if (const auto place = place_of(scene)) {
    offset_minutes = parse_utc_offset_minutes(*scene.observer.time);
    times = twilight_times(*place, parse_offset_date_time(*scene.observer.time), offset_minutes);
  }
  const std::pair<const char*, std::optional<UtcTime>> events[] = {
      {"sunrise", times.sunrise},
      {"sunset", times.sunset},
      {"civil_twilight_begin", times.civil_begin},
      {"civil_twilight_end", times.civil_end},
      {"nautical_twilight_begin", times.nautical_begin},
      {"nautical_twilight_end", times.nautical_end},
      {"astronomical_twilight_begin", times.astronomical_begin},
      {"astronomical_twilight_end", times.astronomical_end},
  };
  for (const auto& [name, time] : events)
    table.add_row({name, time ? format_offset_date_time(*time, offset_minutes) : ""});
  table.write("-", std::cout);
}

void tables(Run& run) {
  const TablesOptions& options = run.line.tables;
  checking_input([&] {
    try {
      require_tables(options, run.scene);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("{}: {}", run.line.scene.string(), error.what()));
    }
  });
  if (options.spectrum == "rgb") warn_of_missing_light(run);
  run.choose_settings();
  run.foretell(0);
  const SceneModel model = run.model();
  std::shared_ptr<const OrdersField> field;
  if (run.line.field) {
    field = checking_input(
        [&] { return std::make_shared<const OrdersField>(read_field(*run.line.field, model)); });
  }
  const OrdersSky sky(model, std::move(field), run.control());
  const TablesOutcome outcome = run.timed("tables", [&] {
    return make_tables(model, sky, options, run.line.scene.string(), run.control());
  });
  if (!outcome.errors.empty()) {
    std::cout << error_table(outcome.errors).text() << std::flush;
    if (!std::cout) throw std::runtime_error("cannot write standard output");
  }
  auto figures = outcome.figures;
  figures.emplace_back("written to " + options.directory.string(),
                       fmt::format("{}", fmt::join(outcome.files, ", ")));
  run.summarise(sky.summary(), figures);
}

void tradeoff(Run& run) {
  const TradeoffPlan plan = checking_input([&] {
    TradeoffOptions options = run.line.tradeoff;
    options.scene = run.line.scene;
    options.overrides = run.line.overrides;
    return plan_tradeoff(options);
  });
  const TradeoffOutcome outcome = run_tradeoff(plan, run.control());
  const std::vector<std::string> files = write_tradeoff_report(plan, outcome);
  run.progress.clear();

  std::map<RungState, int> count;
  for (const RungOutcome& rung : outcome.rungs) {
    ++count[rung.state];
    if (rung.state != RungState::kFailed) continue;
    run.log.error("twilight: rung {} failed: {}", rung.planned.rung.name, rung.reason);
  }
  run.log.info("rungs: {} run now, {} kept; {} done, {} skipped, {} not asked for, {} failed",
               outcome.ran, outcome.kept, count[RungState::kDone], count[RungState::kSkipped],
               count[RungState::kNotRun], count[RungState::kFailed]);
  run.log.info("total {:.1f} s; written to {}: {}", run.clock.seconds(),
               plan.options.directory.string(), fmt::join(files, ", "));
  if (count[RungState::kFailed] > 0) {
    throw std::runtime_error(fmt::format(
        "{} of the rungs failed; the same command tries them again", count[RungState::kFailed]));
  }
}

// Coefficients to the file, their goodness to standard output.
void fit(Run& run, const Study& study) {
  const CommandLine& line = run.line;
  checking_input([&] { require_output(line.fit_output, ".json"); });
  run.foretell(fit_views().size() * study.nodes());
  const SkyFit result = run.timed("fit", [&] { return fit_skies(study, line.fit, run.control()); });
  AtomicFile file(line.fit_output);
  write_fit(file, result, fmt::format("twilight {}", kVersion));
  file.commit();
  run.progress.clear();
  fit_goodness_table(result).write("-", std::cout);
  auto figures = fit_figures(result);
  figures.emplace_back("written", line.fit_output.string());
  run.summarise({}, figures);
  if (result.not_converged == 0) return;
  throw std::runtime_error(fmt::format("{} of {} searches did not converge; {} flags them",
                                       result.not_converged, result.channels.size(),
                                       line.fit_output.string()));
}

void compare(const CommandLine& line, spdlog::logger& log) {
  const ComparisonPlan plan = checking_input([&] {
    ComparisonOptions options = line.comparison;
    options.overrides = line.overrides;
    return plan_comparison(options);
  });
  Run run(line, {}, log, stop_requested);
  const Comparison comparison = compare_skies(plan, run.control());
  run.progress.clear();
  std::vector<std::string> files;
  if (!plan.options.directory.empty()) files = write_comparison(comparison);
  comparison_table(comparison).write("-", std::cout);
  log.info("{}", comparison_markdown(comparison));
  log.info("total {:.1f} s{}{}", run.clock.seconds(),
           files.empty() ? "" : "; written: ", fmt::join(files, ", "));
}

// A child of tradeoff: its scene comes from the parent, its sample goes back as JSON.
void tradeoff_rung(const CommandLine& line) {
  end_with_parent(line.parent);
  std::cout << run_tradeoff_rung(line.scene, line.tradeoff.suns, {{}, &stop_requested})
            << std::flush;
  if (!std::cout) throw std::runtime_error("cannot write standard output");
}

bool solves(Command command) {
  return command == Command::kRender || command == Command::kRadiance ||
         command == Command::kAerial || command == Command::kIrradiance ||
         command == Command::kSolve || command == Command::kTables || command == Command::kSequence;
}

void run_command(const CommandLine& line, spdlog::logger& log) {
  if (line.command == Command::kTradeoffRung) return tradeoff_rung(line);
  if (line.command == Command::kCompare) return compare(line, log);
  if (line.command == Command::kStudy) {
    Run run(line, {}, log, stop_requested);
    return study(run);
  }
  std::optional<Study> study;
  const LoadedScene loaded = checking_input([&] {
    if (line.command != Command::kFit) return load_scene(line.scene, line.overrides);
    study = study_for_fit(load_study(line.scene, line.overrides), line.fit_suns_deg);
    return study->scene;
  });
  Run run(line, loaded.scene, log, stop_requested);
  if (line.print_config) {
    if (solves(line.command)) run.choose_settings();
    run.progress.clear();
    if (run.plan) {
      for (const auto& [label, value] : run.plan->attributes()) {
        std::cout << "# budget: " << label << ": " << value << '\n';
      }
    }
    std::cout << to_toml(run.scene) << std::flush;
    if (!std::cout) throw std::runtime_error("cannot write standard output");
    return;
  }
  switch (line.command) {
    case Command::kRender:
      return render(run);
    case Command::kRadiance:
      return radiance(run);
    case Command::kAerial:
      return aerial(run);
    case Command::kIrradiance:
      return irradiance(run);
    case Command::kSolve:
      return solve(run);
    case Command::kSun:
      return sun(run);
    case Command::kOptics:
      return optics(run);
    case Command::kTables:
      return tables(run);
    case Command::kSequence:
      return sequence(run);
    case Command::kTradeoff:
      // Its rungs say themselves what they model.
      run.scene.quality.reset();
      run.scene.budget = {};
      return tradeoff(run);
    case Command::kFit:
      return fit(run, *study);
    case Command::kRetrieve:
      return retrieve_air(run, loaded);
    case Command::kCompare:
    case Command::kTradeoffRung:
    case Command::kStudy:
      return;  // have no scene of their own
  }
}

int program(int argc, char** argv) {
  const ParsedCommandLine parsed = parse_command_line(argc, argv);
  if (!parsed.command) return parsed.exit_code;

  spdlog::logger log("twilight", std::make_shared<spdlog::sinks::stderr_sink_st>());
  log.set_pattern("%v");
  if (parsed.command->quiet) log.set_level(spdlog::level::err);

  struct sigaction action {};
  action.sa_handler = request_stop;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGHUP, &action, nullptr);
  // A file-size limit shall be a failed write, which is cleaned up, not a sudden end.
  ::signal(SIGXFSZ, SIG_IGN);
  try {
    // For measurements (tests/bench/README.md); a sky differs by rounding only.
    if (const char* cap = std::getenv("TWILIGHT_SIMD")) {
      checking_input([&] { cap_simd_target(cap); });
    }
    run_command(*parsed.command, log);
    return kExitSuccess;
  } catch (const Cancelled&) {
    const Command command = parsed.command->command;
    const char* const kept =
        command == Command::kTradeoff   ? "rungs that are done are kept for the next time"
        : command == Command::kStudy    ? "cases that are done are kept for the next time"
        : command == Command::kSequence ? "frames that are done are kept for the next time"
                                        : "nothing was written";
    log.error("twilight: stopped; {}", kept);
    return kExitInterrupted;
  } catch (const BadInput& error) {
    log.error("twilight: {}", error.what());
    return kExitBadInput;
  } catch (const std::invalid_argument& error) {
    // The tables and layers are looked at while the medium is built: input still.
    const std::string scene = parsed.command->scene.string();
    log.error("twilight: {}{}{}", scene, scene.empty() ? "" : ": ", error.what());
    return kExitBadInput;
  } catch (const std::exception& error) {
    log.error("twilight: {}", error.what());
    return kExitFailure;
  }
}

}  // namespace
}  // namespace twilight

int main(int argc, char** argv) { return twilight::program(argc, argv); }
