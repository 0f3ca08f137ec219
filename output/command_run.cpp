#include "output/command_run.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "output/atomic_file.h"
#include "output/field_file.h"
#include "output/scene_map.h"
#include "sim/cost_model.h"
#include "sim/orders_sky.h"

namespace twilight {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

/// What a command looks at: the whole hemisphere, its views, or, of a field, every Sun.
WantedSky wanted_sky(const CommandLine& line) {
  WantedSky wanted;
  wanted.every_sun = line.command == Command::kSolve || line.command == Command::kTables ||
                     line.command == Command::kSequence || line.field.has_value();
  if (line.command != Command::kRadiance && line.command != Command::kAerial) return wanted;
  if (wanted.every_sun) return wanted;
  std::vector<ViewDirection> views;
  for (const View& view : views_of(line)) views.push_back(view.direction());
  if (!views.empty()) wanted.views = listed_views(views);
  return wanted;
}

}  // namespace

Progress::Progress(spdlog::logger& log, bool quiet)
    : log_(log), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1) {}

void Progress::report(std::string_view stage, double fraction) {
  if (quiet_) return;
  const std::lock_guard lock(mutex_);
  const bool new_stage = stage != stage_;
  if (new_stage) stage_ = stage;
  if (!terminal_) {
    if (new_stage) log_.info("{} ...", stage);
    return;
  }
  if (!new_stage && since_drawn_.seconds() < 0.1) return;
  since_drawn_ = Stopwatch();
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(std::lround(std::clamp(fraction, 0.0, 1.0) * kWidth));
  fmt::print(stderr, "\r\x1b[K[{:=<{}}{:{}}] {:3.0f} %  {}", "", filled, "", kWidth - filled,
             100.0 * fraction, stage);
  std::fflush(stderr);
  drawn_ = true;
}

void Progress::clear() {
  if (drawn_) fmt::print(stderr, "\r\x1b[K");
  drawn_ = false;
}

RunControl Run::control() {
  return {[this](std::string_view stage, double fraction) { progress.report(stage, fraction); },
          &stop};
}

SceneModel Run::model() {
  return timed("medium", [&] { return build_scene_model(scene, &phases); });
}

void Run::choose_settings() {
  if (!scene.budget.max_relative_error && !scene.budget.max_seconds) return;
  plan = timed("choice of settings",
               [&] { return plan_budget(scene, wanted_sky(line), phases, control()); });
  scene = plan->scene;
}

void Run::foretell(std::size_t views, std::size_t suns) {
  if (line.field) return;
  const RunCost cost = predict_run(scene, views);
  if (!cost.known) return;
  checking_input([&] {
    try {
      require_memory(scene, cost, available_bytes());
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("{}: {}", line.scene.string(), error.what()));
    }
  });
  constexpr double kLongSeconds = 3.0;
  double work = cost.reference_seconds;
  if (suns > 1) {
    const double once = serves_every_sun(scene) ? predict_run(scene, 0).reference_seconds : 0.0;
    work += static_cast<double>(suns - 1) * (work - once);
  }
  const double seconds = wall_seconds(work * machine_slowness(), scene);
  if (seconds < kLongSeconds) return;
  progress.clear();
  log.info("predicted: about {:.0f} s and {:.0f} MiB", seconds, cost.peak_bytes / 1048576.0);
}

std::unique_ptr<Sky> Run::sky(const SceneModel& model) {
  if (!line.field) return solve_sky(model, control());
  auto field = timed("field file", [&] {
    return checking_input(
        [&] { return std::make_shared<const OrdersField>(read_field(*line.field, model)); });
  });
  return sky_from_field(model, std::move(field), control()).sky;
}

void Run::row(std::string_view label, std::string_view value) {
  log.info("{:<36} {}", label, value);
}

void Run::summarise(const SceneModel& model, const Sky& sky,
                    const std::vector<std::pair<std::string, std::string>>& figures) {
  progress.clear();
  row("Sun", fmt::format(
                 "elevation {:.4f} deg, {}, azimuth {:.4f} deg", model.sun_elevation_rad * kDegrees,
                 sun_in_sight(sky) ? fmt::format("apparent {:.4f} deg",
                                                 sky.apparent_sun_elevation_rad() * kDegrees)
                                   : "below the horizon",
                 model.sun_azimuth_rad * kDegrees));
  summarise(sky.summary(), figures);
}

void Run::summarise(const RunSummary& summary,
                    const std::vector<std::pair<std::string, std::string>>& figures) {
  progress.clear();
  if (plan) {
    for (const auto& [label, value] : plan->figures()) row(label, value);
  }
  for (const auto& [label, value] : summary.figures) row(label, value);
  for (const auto& [key, what] : summary.clamps) log.warn("warning: {} = {}", key, what);
  for (const auto& [label, value] : figures) row(label, value);
  for (const auto& [stage, seconds] : summary.stage_seconds)
    row("  " + stage, fmt::format("{:.3f} s", seconds));
  for (const auto& [stage, seconds] : stage_seconds) row(stage, fmt::format("{:.3f} s", seconds));
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  row("total", fmt::format("{:.3f} s", clock.seconds()));
  row("peak memory", fmt::format("{:.1f} MiB", static_cast<double>(usage.ru_maxrss) / 1024.0));
}
std::vector<View> views_of(const CommandLine& line) {
  return checking_input([&] {
    std::vector<View> all;
    for (const std::string& text : line.views) all.push_back(parse_view(text));
    if (line.views_file) {
      const std::vector<View> read = read_views(*line.views_file);
      all.insert(all.end(), read.begin(), read.end());
    }
    return all;
  });
}

void require_output(const std::filesystem::path& path, std::string_view extension) {
  if (path.extension() != extension) {
    throw std::invalid_argument(
        fmt::format("output '{}': the name must end in {}", path.string(), extension));
  }
  AtomicFile probe(path);
}

void warn_of_missing_light(const Run& run) {
  const std::vector<double>& wavelengths = run.scene.spectrum.wavelengths_nm;
  if (wavelengths.front() > 400.0 || wavelengths.back() < 680.0) {
    run.log.warn(
        "warning: the wavelengths, {}..{} nm, leave out visible light; colours and lux are "
        "extrapolated",
        wavelengths.front(), wavelengths.back());
  }
}

}  // namespace twilight
