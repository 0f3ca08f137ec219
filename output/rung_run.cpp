#include "output/rung_run.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "output/atomic_file.h"
#include "output/command_line.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string text_of(const RungRun& run) {
  json costs = json::array();
  for (const SunCost& c : run.cost) {
    costs.push_back({{"seconds", c.seconds},
                     {"cpu_seconds", c.cpu_seconds},
                     {"peak_mib", c.peak_mib},
                     {"most_seconds", c.most_seconds}});
  }
  return json({{"name", run.name},
               {"inputs", run.inputs},
               {"scene", run.scene_toml},
               {"scene_inputs", run.scene_inputs},
               {"version", kVersion},
               {"date", run.date},
               {"processor", run.machine.processor},
               {"cores", run.machine.cores},
               {"simd", run.machine.simd},
               {"seconds", run.seconds},
               {"cpu_seconds", run.cpu_seconds},
               {"cost", std::move(costs)},
               {"sample", json::parse(to_json(run.sample))}})
             .dump(1) +
         "\n";
}

RungRun rung_run_of(const json& j) {
  RungRun run;
  j.at("name").get_to(run.name);
  j.at("inputs").get_to(run.inputs);
  j.at("scene").get_to(run.scene_toml);
  j.at("scene_inputs").get_to(run.scene_inputs);
  j.at("date").get_to(run.date);
  j.at("processor").get_to(run.machine.processor);
  j.at("cores").get_to(run.machine.cores);
  j.at("simd").get_to(run.machine.simd);
  j.at("seconds").get_to(run.seconds);
  j.at("cpu_seconds").get_to(run.cpu_seconds);
  for (const json& c : j.at("cost")) {
    run.cost.push_back({c.at("seconds").get<double>(), c.at("cpu_seconds").get<double>(),
                        c.at("peak_mib").get<double>(), c.at("most_seconds").get<double>()});
  }
  run.sample = sky_sample_from_json(j.at("sample").dump());
  if (run.cost.size() != run.sample.suns.size()) {
    throw std::runtime_error(
        fmt::format("{} costs of {} Suns", run.cost.size(), run.sample.suns.size()));
  }
  return run;
}

}  // namespace

void write_rung_run(const fs::path& path, const RungRun& run) {
  AtomicFile file(path);
  file.write(text_of(run));
  file.commit();
}

RungRun read_rung_run(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || fs::is_directory(path)) {
    throw std::runtime_error(fmt::format("{}: cannot be read", path.string()));
  }
  try {
    return rung_run_of(json::parse(stream));
  } catch (const std::exception& error) {
    throw std::runtime_error(
        fmt::format("{}: holds no sampled sky: {}", path.string(), error.what()));
  }
}

std::optional<RungRun> stored_rung_run(const fs::path& path, const std::string& inputs) {
  if (!fs::exists(path)) return std::nullopt;
  try {
    RungRun run = read_rung_run(path);
    if (run.inputs == inputs) return run;
  } catch (const std::runtime_error&) {
    // Damaged, or of another version.
  }
  return std::nullopt;
}

}  // namespace twilight
