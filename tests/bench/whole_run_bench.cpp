// Whole runs of the program, process start to files written, as a table with its spread:
// whole_run_bench [RUNS] [--only TEXT] [--simd best|avx512|avx2|sse4|scalar] [SCENE.toml ...]
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "output/machine.h"
#include "sim/simd_target.h"
#include "tests/bench/measured_run.h"

namespace {

constexpr const char* kConfigs = TWILIGHT_CONFIGS "/";

/// One row of the table: what the program is asked to do. "{}" in an argument becomes a folder
/// of the run's own for what it writes.
struct Work {
  std::string name;
  std::vector<std::string> arguments;
  /// Run once before the clock starts (to solve a field, say); may be empty.
  std::vector<std::string> before = {};
};

/// A scene rendered into an EXR and a PNG preview, with settings of its own.
Work rendered(const std::string& name, const std::string& scene,
              const std::vector<std::string>& settings = {}) {
  Work work{name, {"render", scene, "--quiet", "-o", "{}/sky.exr", "--preview", "{}/sky.png"}};
  for (const std::string& setting : settings) {
    work.arguments.insert(work.arguments.end(), {"--set", setting});
  }
  return work;
}

/// default.toml by the method "orders" at the paper's eight wavelengths.
std::vector<std::string> by_orders(std::vector<std::string> arguments) {
  for (const char* setting :
       {"solver.method=orders",
        "spectrum.wavelengths_nm=[380,428.5714,477.1429,525.7143,574.2857,622.8571,671.4286,720]",
        "output.projection=latlong"}) {
    arguments.insert(arguments.end(), {"--set", setting});
  }
  return arguments;
}

/// The rows of the standard table: add yours here.
std::vector<Work> standard_work() {
  const std::string paper = std::string(kConfigs) + "haber2005.toml";
  const std::string scene = std::string(kConfigs) + "default.toml";
  std::vector<Work> work{
      rendered("haber2005.toml", paper),
      rendered("haber2005.toml, every shell", paper, {"solver.active_shell_stride=1"}),
      rendered("default.toml", scene),
      {"orders: solve, 8 wavelengths, polarised, aerosols, all Suns",
       by_orders({"solve", scene, "--quiet", "-o", "{}/field.nc"})},
      {"orders: the same, clear air",
       by_orders({"solve", scene, "--quiet", "-o", "{}/field.nc", "--set", "aerosols.type=none"})},
      {"orders: further Sun from the field's file, 1024 x 512",
       by_orders({"render", scene, "--quiet", "-o", "{}/sky.exr", "--field", "{}/field.nc"}),
       by_orders({"solve", scene, "--quiet", "-o", "{}/field.nc"})},
  };
  for (const char* wavelength : {"400", "550", "700"}) {
    work.push_back(
        {std::string("monte-carlo: zenith, Sun -6 deg, 1 %, ") + wavelength + " nm",
         {"radiance", std::string(kConfigs) + "sun_elevation.toml", "--quiet", "--set",
          "sun.elevation_deg=-6", "--set", "solver.method=monte-carlo", "--set",
          "aerosols.type=continental_average", "--set",
          std::string("spectrum.wavelengths_nm=[") + wavelength + "]", "--view", "90,0"}});
  }
  return work;
}

twilight::MeasuredRun run_program(std::vector<std::string> arguments, const std::string& folder) {
  for (std::string& a : arguments) {
    if (const auto at = a.find("{}"); at != std::string::npos) a.replace(at, 2, folder);
  }
  return twilight::run_twilight(std::move(arguments));
}

void print_row(const Work& work, int runs, const std::string& folder) {
  if (!work.before.empty()) run_program(work.before, folder);
  std::vector<double> seconds, processor;
  double peak_mib = 0;
  for (int i = 0; i < runs; ++i) {
    const twilight::MeasuredRun run = run_program(work.arguments, folder);
    seconds.push_back(run.seconds);
    processor.push_back(run.processor_seconds);
    peak_mib = std::max(peak_mib, run.peak_mib);
  }
  std::ranges::sort(seconds);
  std::ranges::sort(processor);
  fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.0f} |\n", work.name, seconds.front(),
             seconds[seconds.size() / 2], seconds.back(), processor[processor.size() / 2],
             peak_mib);
  std::cout << std::flush;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app("Whole runs of twilight, as a table");
  int runs = 5;
  std::string only, simd = "best";
  std::vector<std::string> scenes;
  app.add_option("runs", runs, "runs of each row")->check(CLI::PositiveNumber);
  app.add_option("scenes", scenes, "scenes to render instead of the standard rows");
  app.add_option("--only", only, "rows whose name contains this text");
  app.add_option("--simd", simd, "best, avx512, avx2, sse4 or scalar");
  CLI11_PARSE(app, argc, argv);

  twilight::cap_simd_target(simd);
  ::setenv("TWILIGHT_SIMD", simd.c_str(), 1);
  std::vector<Work> table;
  for (const std::string& scene : scenes) {
    table.push_back(rendered(std::filesystem::path(scene).filename().string(), scene));
  }
  if (scenes.empty()) table = standard_work();

  const auto folder = std::filesystem::temp_directory_path() /
                      fmt::format("twilight-bench-{}", static_cast<long>(::getpid()));
  std::filesystem::create_directory(folder);
  double load[1] = {0};
  ::getloadavg(load, 1);
  fmt::print("{}, {} hardware threads, SIMD target {}, {} runs each, load before {:.1f}\n\n",
             twilight::this_machine().processor, std::thread::hardware_concurrency(),
             twilight::simd_target(), runs, load[0]);
  fmt::print(
      "| work | least s | median s | most s | median processor s | peak memory MiB |\n"
      "|---|---|---|---|---|---|\n");
  for (const Work& work : table) {
    if (work.name.find(only) != std::string::npos) print_row(work, runs, folder.string());
  }
  std::filesystem::remove_all(folder);
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  fmt::print(stderr, "whole_run_bench: {}\n", error.what());
  return EXIT_FAILURE;
}
