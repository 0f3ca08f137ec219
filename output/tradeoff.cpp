#include "output/tradeoff.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <ctime>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>

#include "atmosphere/csv_line.h"
#include "output/checksum.h"
#include "output/child_run.h"
#include "output/command_line.h"
#include "output/file_bytes.h"
#include "sim/scene_aerosols.h"
#include "sim/scene_file.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReferenceName = "reference";

/// A rung whose process did not bring a sample.
class RungFailed : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

// What the files hold that the scene names.
std::string files_of(const Scene& scene) {
  std::string all;
  for (const auto& file : {scene.atmosphere.optical_layers, scene.atmosphere.profile_file}) {
    if (file) all += file_bytes(*file);
  }
  for (const fs::path& file : aerosol_files(scene)) all += file_bytes(file);
  return all;
}

// The scene of a ladder or rung, ready to be printed: it must mean the same in any folder, and what
// a map looks like is no part of it.
Scene portable(Scene scene) {
  for (auto* file : {&scene.atmosphere.optical_layers, &scene.atmosphere.profile_file,
                     &scene.aerosols.mixture}) {
    if (*file) *file = fs::absolute(**file).string();
  }
  scene.output = {};
  return scene;
}

std::string physics_inputs(Scene scene) {
  scene.solver = {};
  scene.spectrum = {};
  scene.output = {};
  // Both say how, not what, and their defaults go with the method.
  scene.sun.disc_average.reset();
  scene.aerosols.phase.reset();
  return fnv1a64(to_toml(scene) + files_of(scene));
}

std::string suns_text(const std::vector<double>& suns_deg) {
  return fmt::format("{}", fmt::join(suns_deg, ","));
}

PlannedRung planned(Rung rung, const Scene& scene, const std::vector<double>& suns_deg,
                    int repeat) {
  PlannedRung result;
  const Scene there = portable(scene);
  result.scene_toml = to_toml(there);
  result.inputs =
      fnv1a64(fmt::format("twilight {}\n{} x {}\n{}\n{}\n{}", kVersion, rung.name, repeat,
                          suns_text(suns_deg), result.scene_toml, files_of(there)));
  result.rung = std::move(rung);
  return result;
}

std::vector<std::string> joined(std::vector<std::string> all,
                                const std::vector<std::string>& more) {
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

bool matches(const std::string& glob, const Rung& rung) {
  return ::fnmatch(glob.c_str(), rung.name.c_str(), 0) == 0 ||
         ::fnmatch(glob.c_str(), rung.group.c_str(), 0) == 0 ||
         ::fnmatch(glob.c_str(), std::string(rung_kind_name(rung.kind)).c_str(), 0) == 0;
}

void choose(std::vector<PlannedRung>& rungs, const std::string& glob) {
  for (PlannedRung& p : rungs) p.wanted = matches(glob, p.rung);
  if (std::ranges::none_of(rungs, &PlannedRung::wanted)) {
    throw std::invalid_argument(
        fmt::format("--only {}: must match the name, group or kind of a rung, as 'orders-*', "
                    "'layers' or 'approximation'",
                    glob));
  }
  for (const PlannedRung& p : std::vector(rungs)) {
    if (!p.wanted || p.rung.baseline.empty()) continue;
    for (PlannedRung& other : rungs) {
      if (other.rung.name == p.rung.baseline) other.wanted = true;
    }
  }
}

std::string now_utc() { return fmt::format("{:%FT%TZ}", fmt::gmtime(std::time(nullptr))); }

std::string last_line(const std::string& text) {
  const std::size_t end = text.find_last_not_of('\n');
  if (end == std::string::npos) return {};
  const std::size_t start = text.rfind('\n', end);
  return text.substr(start == std::string::npos ? 0 : start + 1,
                     end - (start == std::string::npos ? std::string::npos : start));
}

// Runs one process over some Suns and adds what it brings.
void add_process(const PlannedRung& planned, const std::vector<double>& suns_deg,
                 const RunControl& control, RungRun& run) {
  const ChildRun child = run_self({"tradeoff-rung", "/dev/stdin", "--quiet", "--suns",
                                   suns_text(suns_deg), "--parent", fmt::format("{}", ::getpid())},
                                  planned.scene_toml, control.cancel);
  if (child.exit_code == kExitInterrupted) throw Cancelled();  // Ctrl-C reaches both
  if (child.signal != 0) {
    throw RungFailed(fmt::format("its process was ended by signal {}", child.signal));
  }
  if (child.exit_code != 0) {
    throw RungFailed(
        fmt::format("its process ended with {}: {}", child.exit_code, last_line(child.err)));
  }
  SkySample sample;
  try {
    sample = sky_sample_from_json(child.out);
  } catch (const std::exception& error) {
    throw RungFailed(error.what());
  }
  // One Sun alone takes what all take less what the others add.
  double others = 0, others_cpu = 0;
  for (const SunSample& s : sample.suns) {
    others += s.setup_seconds + s.view_seconds;
    others_cpu += s.setup_cpu_seconds + s.view_cpu_seconds;
  }
  run.seconds += child.seconds;
  run.cpu_seconds += child.cpu_seconds;
  run.sample.wavelength_nm = sample.wavelength_nm;
  run.sample.peak_mib = std::max(run.sample.peak_mib, sample.peak_mib);
  for (SunSample& s : sample.suns) {
    const double seconds = child.seconds - others + s.view_seconds;
    run.cost.push_back(
        {seconds, child.cpu_seconds - others_cpu + s.view_cpu_seconds, sample.peak_mib, seconds});
    run.sample.suns.push_back(std::move(s));
  }
}

RungRun run_once(const PlannedRung& planned, const std::vector<double>& suns_deg,
                 const RunControl& control) {
  RungRun run;
  if (planned.rung.method == "orders") {
    add_process(planned, suns_deg, control, run);  // one field for all
  } else {
    for (const double sun_deg : suns_deg) add_process(planned, {sun_deg}, control, run);
  }
  return run;
}

RungRun run_rung(const PlannedRung& planned, const std::vector<double>& suns_deg, int repeat,
                 const Machine& machine, const RunControl& control) {
  RungRun run = run_once(planned, suns_deg, control);
  for (int k = 1; k < repeat; ++k) {
    const RungRun again = run_once(planned, suns_deg, control);
    run.seconds = std::min(run.seconds, again.seconds);
    run.cpu_seconds = std::min(run.cpu_seconds, again.cpu_seconds);
    for (std::size_t i = 0; i < run.cost.size(); ++i) {
      SunCost& cost = run.cost[i];
      const SunCost& other = again.cost[i];
      cost = {std::min(cost.seconds, other.seconds), std::min(cost.cpu_seconds, other.cpu_seconds),
              std::max(cost.peak_mib, other.peak_mib),
              std::max(cost.most_seconds, other.most_seconds)};
    }
  }
  run.name = planned.rung.name;
  run.inputs = planned.inputs;
  run.scene_toml = planned.scene_toml;
  run.machine = machine;
  run.date = now_utc();
  return run;
}

std::string in_words(double seconds) {
  if (seconds < 60) return fmt::format("{:.0f} s", seconds);
  const auto minutes = static_cast<long>(seconds / 60 + 0.5);
  if (minutes < 60) return fmt::format("{} min", minutes);
  return fmt::format("{} h {:02} min", minutes / 60, minutes % 60);
}

/// Where a ladder stands: rung k of n, time gone, time to go.
class LadderProgress {
 public:
  explicit LadderProgress(const RunControl& control) : control_(control) {}

  void plan(const std::string& method) { ++to_run_[method], ++total_; }
  void learn(const std::string& method, double seconds) { seen_[method].push_back(seconds); }

  void begin(const std::string& name) {
    std::string rest;
    if (const auto seconds = predicted_rest()) rest = ", about " + in_words(*seconds) + " to go";
    control_.report(fmt::format("rung {} of {}: {} ({} gone{})", done_ + 1, total_, name,
                                in_words(elapsed()), rest),
                    static_cast<double>(done_) / std::max(1, total_));
  }
  void end(const std::string& method) {
    --to_run_[method];
    ++done_;
  }

 private:
  double elapsed() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

  // Each method's rungs take what those before took on average.
  std::optional<double> predicted_rest() const {
    double sum = 0, count = 0;
    for (const auto& [method, all] : seen_) {
      for (const double s : all) sum += s, count += 1;
    }
    if (count == 0) return std::nullopt;
    double rest = 0;
    for (const auto& [method, runs] : to_run_) {
      const auto found = seen_.find(method);
      double mean = sum / count;
      if (found != seen_.end()) {
        mean = 0;
        for (const double s : found->second) {
          mean += s / static_cast<double>(found->second.size());
        }
      }
      rest += runs * mean;
    }
    return rest;
  }

  const RunControl& control_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::map<std::string, int> to_run_;
  std::map<std::string, std::vector<double>> seen_;
  int total_ = 0, done_ = 0;
};

// A reference of an earlier run, if it is of this scene and these Suns.
RungRun reference_of_file(const fs::path& path, const TradeoffPlan& plan) {
  RungRun run = read_rung_run(path);
  if (run.scene_inputs != plan.scene_inputs) {
    throw std::invalid_argument(fmt::format(
        "--reference {}: is of another scene: must be of the same Sun, observer, earth, "
        "atmosphere and aerosols",
        path.string()));
  }
  for (const double sun_deg : plan.suns_deg) {
    const bool there = std::ranges::any_of(
        run.sample.suns, [&](const SunSample& s) { return s.sun_elevation_deg == sun_deg; });
    if (there) continue;
    std::vector<double> held;
    for (const SunSample& s : run.sample.suns) held.push_back(s.sun_elevation_deg);
    throw std::invalid_argument(
        fmt::format("--reference {}: has no Sun at {} deg: must hold all "
                    "of --suns {}, has {}",
                    path.string(), sun_deg, suns_text(plan.suns_deg), suns_text(held)));
  }
  return run;
}

void plan_reference(TradeoffPlan& plan, const std::vector<std::string>& base, const Scene& scene) {
  const TradeoffOptions& options = plan.options;
  Rung rung;
  rung.name = kReferenceName;
  rung.group = kReferenceName;
  rung.kind = RungKind::kMethod;
  if (options.reference == "orders") {
    rung.method = "orders";
    rung.label = "orders of scattering, finer grids";
    rung.overrides = orders_reference_overrides(scene, options.quick);
  } else if (options.reference == "monte-carlo") {
    rung.method = "monte-carlo";
    rung.label = "Monte Carlo";
    rung.overrides = monte_carlo_reference_overrides();
  } else {
    plan.reference_file = options.reference;
    if (!options.reference_overrides.empty()) {
      throw std::invalid_argument(
          fmt::format("--reference-set {}: must not be given with --reference {}, which is a file",
                      options.reference_overrides.front(), options.reference));
    }
    reference_of_file(*plan.reference_file, plan);
    return;
  }
  rung.overrides = joined(rung.overrides, options.reference_overrides);
  const LoadedScene loaded = load_scene(options.scene, joined(base, rung.overrides));
  plan.reference = planned(rung, loaded.scene, plan.suns_deg, 1);
}

}  // namespace

std::string_view rung_state_name(RungState state) {
  switch (state) {
    case RungState::kDone:
      return "done";
    case RungState::kSkipped:
      return "skipped";
    case RungState::kFailed:
      return "failed";
    case RungState::kNotRun:
      break;
  }
  return "not run";
}

std::vector<double> parse_suns(std::string_view text, bool quick) {
  if (text.empty()) {
    return quick ? std::vector<double>{5, -3, -6} : std::vector<double>{30, 5, 0, -3, -6, -9, -12};
  }
  constexpr std::size_t kMost = 32;
  std::vector<double> suns_deg;
  for (const std::string_view cell : split_at_commas(text)) {
    double value = 0;
    const auto [stop, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc{} || stop != cell.data() + cell.size() ||
        !(value >= -18 && value <= 90)) {
      throw std::invalid_argument(
          fmt::format("--suns {}: '{}': must be an elevation in -18..90 degrees", text, cell));
    }
    if (std::ranges::find(suns_deg, value) != suns_deg.end()) {
      throw std::invalid_argument(fmt::format("--suns {}: {} is there twice", text, value));
    }
    suns_deg.push_back(value);
  }
  if (suns_deg.size() > kMost) {
    throw std::invalid_argument(
        fmt::format("--suns: has {} values: must have 1..{}", suns_deg.size(), kMost));
  }
  return suns_deg;
}

TradeoffPlan plan_tradeoff(const TradeoffOptions& options) {
  TradeoffPlan plan;
  plan.options = options;
  plan.suns_deg = parse_suns(options.suns, options.quick);
  if (options.repeat < 1 || options.repeat > 100) {
    throw std::invalid_argument(fmt::format("--repeat {}: must be 1..100", options.repeat));
  }
  if (options.directory.empty()) throw std::invalid_argument("-o: must name a folder");
  if (fs::exists(options.directory) && !fs::is_directory(options.directory)) {
    throw std::invalid_argument(
        fmt::format("-o {}: is a file: must be a folder", options.directory.string()));
  }
  const std::vector<std::string> base = joined(
      options.quick ? quick_base_overrides() : std::vector<std::string>{}, options.overrides);
  const LoadedScene loaded = load_scene(options.scene, base);
  plan.scene_toml = to_toml(portable(loaded.scene));
  plan.scene_inputs = physics_inputs(portable(loaded.scene));
  plan_reference(plan, base, loaded.scene);

  std::map<std::string, std::string> named;  // by scene: settings that are the same run once
  for (Rung& rung : tradeoff_ladder(options.quick)) {
    if (auto reason = why_inapplicable(rung, loaded.scene)) {
      plan.rungs.push_back({rung, {}, {}, true, std::move(*reason)});
      continue;
    }
    try {
      const LoadedScene there = load_scene(options.scene, joined(base, rung.overrides));
      PlannedRung p = planned(rung, there.scene, plan.suns_deg, options.repeat);
      const auto [same, first] = named.try_emplace(p.scene_toml, rung.name);
      if (!first) p.skipped = fmt::format("the same settings as '{}'", same->second);
      plan.rungs.push_back(std::move(p));
    } catch (const std::invalid_argument& error) {
      plan.rungs.push_back({rung, {}, {}, true, error.what()});
    }
  }
  if (options.only) choose(plan.rungs, *options.only);
  return plan;
}

TradeoffOutcome run_tradeoff(const TradeoffPlan& plan, const RunControl& control) {
  const fs::path& directory = plan.options.directory;
  const fs::path rungs = directory / "rungs", reference_path = directory / "reference.json";
  TradeoffOutcome outcome;
  std::optional<RungRun> reference;
  if (plan.reference_file) reference = reference_of_file(*plan.reference_file, plan);
  fs::create_directories(rungs);
  const Machine machine = this_machine();
  LadderProgress progress(control);

  if (!reference && !plan.options.fresh)
    reference = stored_rung_run(reference_path, plan.reference.inputs);
  if (reference) {
    ++outcome.kept;
  } else {
    progress.plan(kReferenceName);
  }
  for (const PlannedRung& p : plan.rungs) {
    RungOutcome rung{p, RungState::kNotRun, p.skipped, {}};
    if (!p.skipped.empty()) {
      rung.state = RungState::kSkipped;
    } else if (!plan.options.fresh || !p.wanted) {
      rung.run = stored_rung_run(rungs / (p.rung.name + ".json"), p.inputs);
      if (rung.run) {
        rung.state = RungState::kDone;
        progress.learn(p.rung.method, plan.options.repeat * rung.run->seconds);
        ++outcome.kept;
      }
    }
    if (rung.state == RungState::kNotRun && p.wanted) progress.plan(p.rung.method);
    outcome.rungs.push_back(std::move(rung));
  }

  if (!reference) {
    progress.begin(kReferenceName);
    try {
      reference = run_rung(plan.reference, plan.suns_deg, 1, machine, control);
    } catch (const RungFailed& error) {
      throw std::runtime_error(fmt::format("the reference failed: {}", error.what()));
    }
    reference->scene_inputs = plan.scene_inputs;
    progress.end(kReferenceName);
    ++outcome.ran;
    write_rung_run(reference_path, *reference);
  } else if (plan.reference_file) {
    write_rung_run(reference_path, *reference);
  }
  outcome.reference = std::move(*reference);

  for (RungOutcome& rung : outcome.rungs) {
    const PlannedRung& p = rung.planned;
    if (rung.state != RungState::kNotRun || !p.wanted) continue;
    control.check();
    progress.begin(p.rung.name);
    try {
      rung.run = run_rung(p, plan.suns_deg, plan.options.repeat, machine, control);
      rung.state = RungState::kDone;
      progress.learn(p.rung.method, plan.options.repeat * rung.run->seconds);
      write_rung_run(rungs / (p.rung.name + ".json"), *rung.run);
    } catch (const RungFailed& error) {
      rung.state = RungState::kFailed;
      rung.reason = error.what();
    }
    progress.end(p.rung.method);
    ++outcome.ran;
  }
  return outcome;
}

std::string run_tradeoff_rung(const fs::path& scene, const std::string& suns,
                              const RunControl& control) {
  const LoadedScene loaded = load_scene(scene, {});
  return to_json(sample_sky(build_scene_model(loaded.scene), parse_suns(suns, false), control));
}

}  // namespace twilight
