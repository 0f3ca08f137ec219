#include "output/study_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <oneapi/tbb/info.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iostream>
#include <numeric>
#include <stdexcept>

#include "output/atomic_file.h"
#include "output/command_run.h"
#include "output/csv_table.h"
#include "output/sky_quantities.h"
#include "output/study_files.h"
#include "output/study_run.h"
#include "sim/cost_model.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

constexpr double kMiB = 1048576.0;

std::string duration_text(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 100 * 60) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

std::vector<std::size_t> asked_cases(const StudyPlan& plan, const StudyOptions& options) {
  if (options.case_number) {
    if (*options.case_number < 1 || *options.case_number > plan.cases.size()) {
      throw std::invalid_argument(fmt::format("--case {}: must be 1..{}, the study's cases",
                                              *options.case_number, plan.cases.size()));
    }
    return {*options.case_number - 1};
  }
  if (!options.shard.empty()) {
    const Shard shard = parse_shard(options.shard);
    return shard_cases(plan, shard.index, shard.count);
  }
  std::vector<std::size_t> all(plan.cases.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

std::string plan_text(const StudyPlan& plan) {
  return fmt::format("{} cases, {} atmospheres to solve ({} solves saved)", plan.cases.size(),
                     plan.groups.size(), plan.saved_solves());
}

// The plan as a table: what --case and --shard are of.
void list(Run& run, const StudyPlan& plan, const std::vector<std::size_t>& cases) {
  std::vector<std::string> names = {"case", "atmosphere"};
  for (const StudyAxis& axis : plan.study.axes) names.push_back(axis.key);
  names.emplace_back("hash");
  CsvTable table(names);
  for (const std::size_t node : cases) {
    std::vector<CsvTable::Cell> row = {static_cast<double>(node + 1),
                                       static_cast<double>(plan.cases[node].group + 1)};
    const std::vector<std::size_t> at = plan.study.indices_at(node);
    for (std::size_t a = 0; a < at.size(); ++a) row.emplace_back(plan.study.axes[a].text(at[a]));
    row.emplace_back(plan.cases[node].hash);
    table.add_row(row);
  }
  run.progress.clear();
  table.write("-", std::cout);
}

std::string shell_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string program_path() {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  return error ? "twilight" : self.string();
}

// A Slurm array of the study's shards.
std::string sbatch_text(const Run& run, const StudyPlan& plan, std::size_t tasks) {
  StudyCost largest;
  for (std::size_t index = 1; index <= tasks; ++index) {
    const StudyCost cost = predict_study(plan, shard_cases(plan, index, tasks));
    largest.known = largest.known && cost.known;
    largest.seconds = std::max(largest.seconds, cost.seconds);
    largest.peak_bytes = std::max(largest.peak_bytes, cost.peak_bytes);
  }
  const int asked = plan.study.scene.scene.solver.threads;
  const int threads = asked > 0 ? asked : oneapi::tbb::info::default_concurrency();
  // Prediction is within a factor of two, on this machine.
  constexpr double kTimeMargin = 3, kMemoryMargin = 1.5, kSpareMiB = 256;
  const auto minutes =
      static_cast<int>(std::ceil(std::max(10.0, kTimeMargin * largest.seconds / 60)));
  const auto mebibytes = static_cast<int>(kMemoryMargin * largest.peak_bytes / kMiB + kSpareMiB);
  const std::string program = shell_quoted(program_path());
  const fs::path directory = fs::absolute(run.line.study.directory).lexically_normal();
  std::string command =
      fmt::format("{} study {} -o {}", program,
                  shell_quoted(fs::absolute(run.line.scene).lexically_normal().string()),
                  shell_quoted(directory.string()));
  for (const std::string& text : run.line.overrides) {
    if (!text.starts_with("solver.threads=")) command += " --set " + shell_quoted(text);
  }
  std::string text = "#!/bin/bash\n";
  text += fmt::format("#SBATCH --job-name=twilight-study\n#SBATCH --array=1-{}\n", tasks);
  text += "#SBATCH --requeue\n#SBATCH --open-mode=append\n";
  text += fmt::format("#SBATCH --ntasks=1\n#SBATCH --cpus-per-task={}\n", threads);
  if (largest.known) {
    text += fmt::format("#SBATCH --mem={}M\n#SBATCH --time={}:{:02}:00\n", mebibytes, minutes / 60,
                        minutes % 60);
    text +=
        fmt::format("# Predicted for the largest shard: {} and {:.0f} MiB; above with a margin.\n",
                    duration_text(largest.seconds), largest.peak_bytes / kMiB);
  } else {
    text += "# The time of this method is not known beforehand: give --time and --mem.\n";
  }
  text += fmt::format("# {}.\n", plan_text(plan));
  text += fmt::format(
      "# A task that is killed goes on where it was; when all have ended:\n"
      "#   {} study --merge {}\n",
      program, shell_quoted(directory.string()));
  text += fmt::format(
      "exec {} --shard \"${{SLURM_ARRAY_TASK_ID}}/{}\" --threads "
      "\"${{SLURM_CPUS_PER_TASK:-{}}}\"\n",
      command, tasks, threads);
  return text;
}

void write_sbatch(Run& run, const StudyPlan& plan, std::size_t tasks) {
  const fs::path directory = run.line.study.directory;
  std::error_code error;
  fs::create_directories(directory, error);
  const fs::path file = directory / "study.sbatch";
  write_text_file(file, sbatch_text(run, plan, tasks));
  run.log.info("{}; written: {}", plan_text(plan), file.string());
}

void put_together(Run& run, const fs::path& directory, const StudyManifest& manifest) {
  const AssembledStudy made = assemble_study(directory, manifest, run.control());
  run.progress.clear();
  run.log.info("cases: {} done, {} failed, {} missing; total {:.1f} s; written to {}: {}",
               made.done, made.failed, made.missing, run.clock.seconds(), directory.string(),
               fmt::join(made.files, ", "));
  if (made.failed > 0) {
    throw std::runtime_error(
        fmt::format("{} of {} cases failed (study.csv says why); the same command tries them again",
                    made.failed, manifest.hashes.size()));
  }
  if (made.missing > 0) {
    throw std::runtime_error(
        fmt::format("{} of {} cases are missing", made.missing, manifest.hashes.size()));
  }
}

void merge(Run& run) {
  const StudyOptions& options = run.line.study;
  const fs::path first = options.merge.front();
  const fs::path directory = options.directory.empty() ? first : options.directory;
  const StudyManifest manifest = checking_input([&] { return read_manifest(first); });
  std::vector<fs::path> others = options.merge;
  std::erase(others, directory);
  if (directory != first) copy_manifest(first, directory);
  clean_study_folder(directory);
  const std::size_t copied = gather_cases(directory, others, manifest, run.control());
  if (!others.empty()) run.log.info("{} cases taken from other folders", copied);
  const StudyState state = study_state(directory, manifest, run.control());
  if (!state.missing.empty() && !options.partial) {
    throw std::runtime_error(fmt::format(
        "{}: {} of {} cases are missing, the first of them case {}: run them, or put together what "
        "is there with --partial; nothing was written",
        directory.string(), state.missing.size(), manifest.hashes.size(),
        state.missing.front() + 1));
  }
  put_together(run, directory, manifest);
}

void say_plan(Run& run, const StudyPlan& plan, const std::vector<std::size_t>& cases) {
  const StudyCost cost = predict_study(plan, cases);
  std::string text = plan_text(plan);
  if (cases.size() < plan.cases.size())
    text += fmt::format("; of them {} cases here", cases.size());
  if (cost.known && cost.seconds > 3) {
    text += fmt::format("; predicted: about {} and {:.0f} MiB", duration_text(cost.seconds),
                        cost.peak_bytes / kMiB);
  }
  run.log.info("{}", text);
  const auto available = available_bytes();
  if (cost.known && available && cost.peak_bytes > *available) {
    checking_input([&] {
      const Scene scene = plan.study.scene_at(cases.front()).scene;
      RunCost needs;
      needs.peak_bytes = cost.peak_bytes;
      require_memory(scene, needs, available);
    });
  }
}

// Its plots are of columns that there will be.
StudyPlan checked_plan(const fs::path& file, std::span<const std::string> overrides) {
  StudyPlan plan = plan_study(file, overrides);
  check_plots(plan.wanted,
              table_columns(manifest_of(plan), quantity_shapes(plan.wanted, plan.coordinates)),
              plan.study.axes.size());
  for (const WantedPlot& plot : plan.wanted.plots) {
    for (const StudyAxis& axis : plan.study.axes) {
      if (axis.words.empty() || (axis.key != plot.x && axis.key != plot.y)) continue;
      throw std::invalid_argument(fmt::format(
          "{}: key 'outputs.plots.{}' = \"{}\": must be a column of numbers; an axis of "
          "words may be the series",
          plot.origin, axis.key == plot.x ? "x" : "y", axis.key));
    }
  }
  return plan;
}

}  // namespace

Shard parse_shard(std::string_view text) {
  Shard shard;
  const char* const end = text.data() + text.size();
  const auto [slash, first] = std::from_chars(text.data(), end, shard.index);
  const bool divided = first == std::errc{} && slash != end && *slash == '/';
  const auto [stop, second] = std::from_chars(divided ? slash + 1 : end, end, shard.count);
  constexpr std::size_t kMost = 100000;
  if (!divided || second != std::errc{} || stop != end || shard.index < 1 ||
      shard.index > shard.count || shard.count > kMost) {
    throw std::invalid_argument(
        fmt::format("--shard {}: must be I/N, shard 1..N of N, N to {}", text, kMost));
  }
  return shard;
}

void study(Run& run) {
  const StudyOptions& options = run.line.study;
  if (!options.merge.empty()) return merge(run);
  const StudyPlan plan =
      checking_input([&] { return checked_plan(run.line.scene, run.line.overrides); });
  if (run.line.print_config) {
    std::cout << to_toml(plan.study.scene.scene) << std::flush;
    if (!std::cout) throw std::runtime_error("cannot write standard output");
    return;
  }
  const std::vector<std::size_t> cases = checking_input([&] { return asked_cases(plan, options); });
  if (options.list) {
    list(run, plan, cases);
    run.log.info("{}", plan_text(plan));
    return;
  }
  if (options.slurm_tasks) return write_sbatch(run, plan, *options.slurm_tasks);
  if (cases.empty()) {
    run.log.info("{}; none of them in shard {}", plan_text(plan), options.shard);
    return;
  }
  const StudyManifest manifest = manifest_of(plan);
  say_plan(run, plan, cases);
  const StudyOutcome outcome = run_study(
      plan, options.directory, cases, options.fresh, run.control(), [&](const StudyProgress& p) {
        run.progress.clear();
        run.log.info(
            "{} of {} cases{}{}", p.kept + p.done + p.failed, p.cases,
            p.failed > 0 ? fmt::format(", {} failed", p.failed) : "",
            p.left() > 0 ? fmt::format("; about {} left", duration_text(p.seconds_left())) : "");
      });
  const StudyProgress& p = outcome.progress;
  run.progress.clear();
  run.log.info("cases: {} computed, {} kept, {} failed; {} solves; {:.1f} s", p.done, p.kept,
               p.failed, outcome.solves, p.seconds);
  if (cases.size() == plan.cases.size()) {
    return put_together(run, options.directory, manifest);
  }
  run.log.info("written to {}; when all shards are done: twilight study --merge {}",
               options.directory.string(), options.directory.string());
  if (p.failed > 0) {
    throw std::runtime_error(
        fmt::format("{} of {} cases failed; the same command tries them again", p.failed, p.cases));
  }
}

}  // namespace twilight
