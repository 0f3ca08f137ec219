// The program: scene file in, image or CSV out.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <deque>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <stdexcept>

#include "atmosphere/refraction.h"
#include "output/atomic_file.h"
#include "output/child_run.h"
#include "output/colour.h"
#include "output/command_line.h"
#include "output/comparison_report.h"
#include "output/csv_table.h"
#include "output/exr_image.h"
#include "output/field_file.h"
#include "output/fit_file.h"
#include "output/fit_report.h"
#include "output/photometry.h"
#include "output/preview.h"
#include "output/scene_colour.h"
#include "output/sky_fit.h"
#include "output/sky_image.h"
#include "output/study_axes.h"
#include "output/tables_command.h"
#include "output/tradeoff.h"
#include "output/tradeoff_report.h"
#include "sim/budget_plan.h"
#include "sim/cost_model.h"
#include "sim/orders_sky.h"
#include "sim/scene_file.h"
#include "sim/scene_model.h"
#include "sim/simd_target.h"
#include "solar/place.h"
#include "solar/time_point.h"
#include "solar/twilight_events.h"

namespace twilight {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

// The only state a signal handler may touch.
std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void request_stop(int) { stop_requested.store(true, std::memory_order_relaxed); }

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
  Progress(spdlog::logger& log, bool quiet)
      : log_(log), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1) {}
  ~Progress() { clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void report(std::string_view stage, double fraction) {
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

  /// Takes the bar off the terminal.
  void clear() {
    if (drawn_) fmt::print(stderr, "\r\x1b[K");
    drawn_ = false;
  }

 private:
  spdlog::logger& log_;
  bool quiet_;
  bool terminal_;
  bool drawn_ = false;
  std::mutex mutex_;  // solvers report from any of their threads
  std::string stage_;
  Stopwatch since_drawn_;
};

/// Whether any direct light arrives: elsewhere an apparent elevation has no meaning.
bool sun_in_sight(const Sky& sky) {
  return std::ranges::any_of(sky.sun_transmittance(), [](double t) { return t > 0.0; });
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

/// What a command looks at: the whole hemisphere, its views, or, of a field, every Sun.
WantedSky wanted_sky(const CommandLine& line) {
  WantedSky wanted;
  wanted.every_sun =
      line.command == Command::kSolve || line.command == Command::kTables || line.field.has_value();
  if (line.command != Command::kRadiance && line.command != Command::kAerial) return wanted;
  if (wanted.every_sun) return wanted;
  std::vector<ViewDirection> views;
  for (const View& view : views_of(line)) views.push_back(view.direction());
  if (!views.empty()) wanted.views = listed_views(views);
  return wanted;
}

/// One call of the program: what every command needs.
struct Run {
  const CommandLine& line;
  Scene scene;
  spdlog::logger& log;
  Progress progress;
  Stopwatch clock;
  std::vector<std::pair<std::string, double>> stage_seconds;

  KnownPhases phases;              ///< of the plan's pilot, for the model
  std::optional<BudgetPlan> plan;  ///< that made the scene from what was loaded

  Run(const CommandLine& l, const Scene& s, spdlog::logger& g)
      : line(l), scene(s), log(g), progress(g, l.quiet) {}

  RunControl control() {
    return {[this](std::string_view stage, double fraction) { progress.report(stage, fraction); },
            &stop_requested};
  }

  /// Runs a stage and keeps its time for the summary.
  template <class Action>
  auto timed(const char* stage, Action action) {
    control().check();
    const Stopwatch watch;
    auto result = action();
    stage_seconds.emplace_back(stage, watch.seconds());
    return result;
  }

  SceneModel model() {
    return timed("medium", [&] { return build_scene_model(scene, &phases); });
  }

  /// Chooses the settings where the scene has a budget.
  void choose_settings() {
    if (!scene.budget.max_relative_error && !scene.budget.max_seconds) return;
    plan = timed("choice of settings",
                 [&] { return plan_budget(scene, wanted_sky(line), phases, control()); });
    scene = plan->scene;
  }

  /// Says what a long run will take; refuses one that the machine cannot hold.
  void foretell(std::size_t views) {
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
    const double seconds = wall_seconds(cost.reference_seconds * machine_slowness(), scene);
    if (seconds < kLongSeconds) return;
    progress.clear();
    log.info("predicted: about {:.0f} s and {:.0f} MiB", seconds, cost.peak_bytes / 1048576.0);
  }

  /// Solves the sky, or looks it up in the field the user named.
  std::unique_ptr<Sky> sky(const SceneModel& model) {
    if (!line.field) return solve_sky(model, control());
    auto field = timed("field file", [&] {
      return checking_input(
          [&] { return std::make_shared<const OrdersField>(read_field(*line.field, model)); });
    });
    return sky_from_field(model, std::move(field), control()).sky;
  }

  void row(std::string_view label, std::string_view value) { log.info("{:<36} {}", label, value); }

  /// The summary of a solved sky: figures, seconds per stage, total, peak memory.
  void summarise(const SceneModel& model, const Sky& sky,
                 const std::vector<std::pair<std::string, std::string>>& figures) {
    progress.clear();
    row("Sun",
        fmt::format(
            "elevation {:.4f} deg, {}, azimuth {:.4f} deg", model.sun_elevation_rad * kDegrees,
            sun_in_sight(sky)
                ? fmt::format("apparent {:.4f} deg", sky.apparent_sun_elevation_rad() * kDegrees)
                : "below the horizon",
            model.sun_azimuth_rad * kDegrees));
    summarise(sky.summary(), figures);
  }

  /// The same for what no one Sun is part of.
  void summarise(const RunSummary& summary,
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
};

// From orbit the Sun rises and sets by the almanac of the highest place that tables reach.
std::optional<Place> place_of(const Scene& scene) {
  if (!scene.observer.latitude_deg) return std::nullopt;
  return Place{*scene.observer.latitude_deg, *scene.observer.longitude_deg,
               std::min(scene.observer.height_m, kHighestPlaceM)};
}

/// Place, time, Sun, every setting and version. Threads are left out: the same sky has the same
/// bytes however many computed it.
ImageAttributes image_attributes(const SceneModel& model, const Sky& sky,
                                 const std::optional<BudgetPlan>& plan) {
  ImageAttributes attributes;
  attributes.emplace_back("software", fmt::format("twilight {}", kVersion));
  if (const auto place = place_of(model.scene)) {
    attributes.emplace_back("latitude", static_cast<float>(place->latitude_deg));
    attributes.emplace_back("longitude", static_cast<float>(place->longitude_deg));
    attributes.emplace_back("altitude", static_cast<float>(model.scene.observer.height_m));
  }
  attributes.emplace_back("resolved.sun_elevation_deg", model.sun_elevation_rad * kDegrees);
  if (sun_in_sight(sky)) {
    attributes.emplace_back("resolved.sun_apparent_elevation_deg",
                            sky.apparent_sun_elevation_rad() * kDegrees);
  }
  attributes.emplace_back("resolved.sun_azimuth_deg", model.sun_azimuth_rad * kDegrees);
  attributes.emplace_back("resolved.sun_distance_au", model.sun_distance_au);
  attributes.emplace_back("resolved.earth_radius_km", model.medium.earth_radius_km);
  for (const auto& [key, value] : scene_settings(model.scene))
    if (key != "solver.threads") attributes.emplace_back(key, value);
  for (const auto& [key, what] : sky.summary().clamps)
    attributes.emplace_back("clamped." + key, what);
  if (!plan) return attributes;
  for (auto [label, value] : plan->attributes()) {
    std::ranges::replace(label, ' ', '_');
    attributes.emplace_back("budget." + label, value);
  }
  return attributes;
}

/// Throws before the long run unless the file can be made; leaves nothing behind.
void require_output(const std::filesystem::path& path, std::string_view extension) {
  if (path.extension() != extension) {
    throw std::invalid_argument(
        fmt::format("output '{}': the name must end in {}", path.string(), extension));
  }
  AtomicFile probe(path);
}

/// Colours and lux want the whole visible spectrum.
void warn_of_missing_light(const Run& run) {
  const std::vector<double>& wavelengths = run.scene.spectrum.wavelengths_nm;
  if (wavelengths.front() > 400.0 || wavelengths.back() < 680.0) {
    run.log.warn(
        "warning: the wavelengths, {}..{} nm, leave out visible light; colours and lux are "
        "extrapolated",
        wavelengths.front(), wavelengths.back());
  }
}

MapProjection map_projection(const Scene& scene, double sun_azimuth_rad) {
  const Projection kind = projection_from_name(scene.output.projection);
  if (kind != Projection::kCamera) return kind;
  const CameraOptions& camera = scene.camera;
  CameraView view;
  view.azimuth_rad = camera.azimuth_deg ? *camera.azimuth_deg / kDegrees : sun_azimuth_rad;
  view.elevation_rad = camera.elevation_deg / kDegrees;
  view.field_of_view_rad = camera.field_of_view_deg / kDegrees;
  view.aspect_ratio = camera.aspect_ratio;
  return view;
}

void render(Run& run) {
  const CommandLine& line = run.line;
  const OutputOptions& output = run.scene.output;
  const bool spectral = output.channels.ends_with("+spectral");
  checking_input([&] {
    require_output(line.output, ".exr");
    if (spectral) require_output(line.spectral_output(), ".exr");
    if (line.preview) require_output(*line.preview, ".png");
  });
  warn_of_missing_light(run);

  run.choose_settings();
  const auto size = static_cast<std::size_t>(output.size);
  const auto across =
      static_cast<std::size_t>(map_width(map_projection(run.scene, 0.0), output.size));
  run.foretell(size * across);
  const SceneModel model = run.model();
  const std::unique_ptr<Sky> sky = run.sky(model);
  const SkyMap map = run.timed("map", [&] {
    MapSettings settings;
    settings.projection = map_projection(run.scene, model.sun_azimuth_rad);
    settings.size = output.size;
    settings.sun_azimuth_rad = model.sun_azimuth_rad;
    settings.colour =
        output.channels.starts_with("xyz") ? MapColour::kXyz : MapColour::kLinearRec709;
    settings.spectral = spectral;
    settings.sun_disc = output.sun_disc;
    const double radius_km = model.medium.earth_radius_km;
    settings.horizon_elevation_rad =
        -std::acos(radius_km / (radius_km + observer_altitude_km(run.scene)));
    return render_map(*sky,
                      colour_integrator(model, colour_observer_from_name(output.colour_observer)),
                      settings, run.control());
  });

  // From here on everything is written: either no file or all of them.
  run.timed("files", [&] {
    const MapProjection projection = map_projection(run.scene, model.sun_azimuth_rad);
    const ImageAttributes attributes = image_attributes(model, *sky, run.plan);
    std::deque<AtomicFile> files;
    write_exr(files.emplace_back(line.output), map.colour, projection, attributes);
    if (spectral) {
      const bool rgb = output.channels.starts_with("rgb");
      write_spectral_exr(files.emplace_back(line.spectral_output()), *map.spectral,
                         rgb ? &map.colour : nullptr, projection, attributes);
    }
    if (line.preview) write_preview_png(files.emplace_back(*line.preview), map.colour);
    for (AtomicFile& file : files) file.commit();
    return true;
  });
  std::string files = line.output.string();
  if (spectral) files += ", " + line.spectral_output().string();
  if (line.preview) files += ", " + line.preview->string();
  run.summarise(model, *sky,
                {{"sky pixels", fmt::format("{}", map.sky_pixels)},
                 {"pixels moved into Rec. 709", fmt::format("{}", map.out_of_gamut_pixels)},
                 {"written", files}});
}

double degree_of_polarisation(const StokesRadiance& light, std::size_t at) {
  return light.i[at] > 0.0 ? std::hypot(light.q[at], light.u[at]) / light.i[at] : 0.0;
}

void radiance(Run& run) {
  const std::vector<View> views = views_of(run.line);
  run.choose_settings();
  run.foretell(views.size());
  const SceneModel model = run.model();
  const std::unique_ptr<Sky> sky = run.sky(model);

  CsvTable table({"view_elevation_deg", "relative_azimuth_deg", "wavelength_nm",
                  "radiance_w_m2_sr_nm", "standard_error", "degree_of_polarisation",
                  "stokes_q_w_m2_sr_nm", "stokes_u_w_m2_sr_nm"});
  run.timed("views", [&] {
    constexpr std::size_t kBatch = 256;  // views between two looks at Ctrl-C
    const std::span<const double> wavelength_nm = sky->wavelength_nm();
    for (std::size_t first = 0; first < views.size(); first += kBatch) {
      const std::size_t count = std::min(kBatch, views.size() - first);
      run.control().check();
      run.control().report("views", static_cast<double>(first) / static_cast<double>(views.size()));
      std::vector<ViewDirection> directions;
      for (std::size_t i = 0; i < count; ++i) directions.push_back(views[first + i].direction());
      const StokesRadiance light = sky->stokes(directions);
      // Empty cells where a solver knows no error or is scalar.
      const auto cell = [](const std::vector<double>& values, std::size_t at) {
        return values.empty() ? CsvTable::Cell("") : CsvTable::Cell(values[at] + 0.0);  // no "-0"
      };
      for (std::size_t i = 0; i < count; ++i) {
        const View& view = views[first + i];
        for (std::size_t w = 0; w < wavelength_nm.size(); ++w) {
          const std::size_t at = i * wavelength_nm.size() + w;
          table.add_row({view.elevation_deg, view.relative_azimuth_deg, wavelength_nm[w],
                         light.i[at], cell(light.standard_error, at),
                         light.q.empty() ? CsvTable::Cell("")
                                         : CsvTable::Cell(degree_of_polarisation(light, at)),
                         cell(light.q, at), cell(light.u, at)});
        }
      }
    }
    return true;
  });
  run.control().check();
  run.progress.clear();
  table.write("-", std::cout);
  run.summarise(model, *sky, {});
}

// Aerial perspective of every view over every distance.
void aerial(Run& run) {
  const std::vector<View> views = views_of(run.line);
  run.choose_settings();
  run.foretell(2 * views.size() * run.line.distances_km.size());
  const SceneModel model = run.model();
  const std::unique_ptr<Sky> sky = run.sky(model);
  CsvTable table({"view_elevation_deg", "relative_azimuth_deg", "distance_km", "wavelength_nm",
                  "transmittance", "inscattered_radiance_w_m2_sr_nm"});
  run.timed("views", [&] {
    for (const View& view : views) {
      for (const double km : run.line.distances_km) {
        run.control().check();
        const auto light = sky->aerial_light(view.direction(), km);
        if (!light) {
          throw std::invalid_argument(fmt::format(
              "key 'solver.method' = \"{}\": must be one that knows aerial perspective: "
              "orders, preetham, nishita, hoffman-preetham or bruneton",
              run.scene.solver.method));
        }
        for (std::size_t w = 0; w < sky->wavelength_nm().size(); ++w) {
          table.add_row({view.elevation_deg, view.relative_azimuth_deg, km, sky->wavelength_nm()[w],
                         light->transmittance[w], light->inscattered[w]});
        }
      }
    }
    return true;
  });
  run.control().check();
  run.progress.clear();
  table.write("-", std::cout);
  run.summarise(model, *sky, {});
}

void irradiance(Run& run) {
  warn_of_missing_light(run);
  run.choose_settings();
  constexpr std::size_t kViews = 384;
  run.foretell(kViews);
  const SceneModel model = run.model();
  const std::unique_ptr<Sky> sky = run.sky(model);
  const Irradiance parts = run.timed("irradiance", [&] { return sky->irradiance(); });

  std::vector<double> global(parts.direct.size());
  std::ranges::transform(parts.direct, parts.diffuse, global.begin(), std::plus<>());
  const ColourIntegrator photopic = colour_integrator(model, ColourObserver::kCie1931);
  const auto lux = [&](std::span<const double> spectrum) {
    return illuminance_lux(photopic, spectrum, sky->solar_irradiance());
  };
  CsvTable table(
      {"wavelength_nm", "direct_w_m2_nm", "diffuse_w_m2_nm", "global_w_m2_nm", "illuminance_lux"});
  for (std::size_t w = 0; w < global.size(); ++w) {
    table.add_row(
        {sky->wavelength_nm()[w], parts.direct[w], parts.diffuse[w], global[w], lux(global)});
  }
  run.control().check();
  run.progress.clear();
  table.write("-", std::cout);
  run.summarise(model, *sky,
                {{"illuminance", fmt::format("{:.6g} lux, of which direct {:.6g}, diffuse {:.6g}",
                                             lux(global), lux(parts.direct), lux(parts.diffuse))}});
}

void solve(Run& run) {
  checking_input([&] {
    if (run.scene.solver.method != "orders") {
      throw std::invalid_argument(fmt::format(
          "{}: key 'solver.method' = \"{}\": must be \"orders\" for twilight solve; the "
          "other methods have no field",
          run.line.scene.string(), run.scene.solver.method));
    }
    require_output(run.line.field_output, ".nc");
  });
  run.choose_settings();
  run.foretell(0);
  const SceneModel model = run.model();
  const SolvedField solved = solve_field(model, run.control());
  run.timed("file", [&] {
    AtomicFile file(run.line.field_output);
    write_field(file, *solved.field, model);
    run.control().check();
    file.commit();
    return true;
  });
  run.summarise(solved.summary, {{"written", run.line.field_output.string()}});
}

void sun(Run& run) {
  // Where the Sun is seen depends on the air's refractive index alone: one wavelength, no aerosol.
  Scene scene = run.scene;
  constexpr double kWavelengthNm = 550.0;
  scene.aerosols.type = "none";
  scene.aerosols.optical_depth_550nm.reset();
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

void optics(Run& run) {
  const SceneModel model = run.model();
  const Medium& medium = model.medium;
  CsvTable table({"bottom_km", "top_km", "pressure_hpa", "temperature_k",
                  "relative_humidity_percent", "wavelength_nm", "refractive_index",
                  "air_scattering_per_km", "aerosol_scattering_per_km", "aerosol_absorption_per_km",
                  "aerosol_asymmetry", "gas_absorption_per_km"});
  // A user's own layers have no state of the air.
  const auto state = [](const std::vector<double>& values, std::size_t layer) {
    return values.empty() ? CsvTable::Cell("") : CsvTable::Cell(values[layer]);
  };
  std::vector<double> humidity_percent = medium.relative_humidity;
  for (double& percent : humidity_percent) percent *= 100.0;
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    for (std::size_t w = 0; w < medium.wavelengths(); ++w) {
      table.add_row({medium.boundary_km[i], medium.boundary_km[i + 1],
                     state(medium.pressure_hpa, i), state(medium.temperature_k, i),
                     state(humidity_percent, i), medium.wavelength_nm[w],
                     1.0 + medium.refractivity(i, w), medium.air_scattering_per_km(i, w),
                     medium.aerosol_scattering_per_km(i, w), medium.aerosol_absorption_per_km(i, w),
                     medium.aerosol_asymmetry(i, w), medium.gas_absorption_per_km(i, w)});
    }
  }
  run.control().check();
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
  Run run(line, {}, log);
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
         command == Command::kSolve || command == Command::kTables;
}

void run_command(const CommandLine& line, spdlog::logger& log) {
  if (line.command == Command::kTradeoffRung) return tradeoff_rung(line);
  if (line.command == Command::kCompare) return compare(line, log);
  std::optional<Study> study;
  const LoadedScene loaded = checking_input([&] {
    if (line.command != Command::kFit) return load_scene(line.scene, line.overrides);
    study = study_for_fit(load_study(line.scene, line.overrides), line.fit_suns_deg);
    return study->scene;
  });
  Run run(line, loaded.scene, log);
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
    case Command::kTradeoff:
      // Its rungs say themselves what they model.
      run.scene.quality.reset();
      run.scene.budget = {};
      return tradeoff(run);
    case Command::kFit:
      return fit(run, *study);
    case Command::kCompare:
    case Command::kTradeoffRung:
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
    const bool keeps = parsed.command->command == Command::kTradeoff;
    log.error("twilight: stopped; {}",
              keeps ? "rungs that are done are kept for the next time" : "nothing was written");
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
