// The cost model beside what runs take: cost_bench [--check] [FILTER]
//
// --check: fails where seconds or memory are not within a factor of two of the prediction.
// Every scene is run by the program in a process of its own (one zenith view); processor seconds
// and largest resident memory are the system's.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "sim/cost_model.h"
#include "sim/scene_file.h"
#include "tests/bench/measured_run.h"

namespace {

using Settings = std::vector<std::string>;

const std::vector<Settings>& cases() {
  static const std::vector<Settings> all = {
      {"quality=draft"},
      {"quality=fair"},
      {"quality=standard"},
      {"quality=standard", "aerosols.type=none"},
      {"quality=draft", "aerosols.type=none"},
      {"quality=standard", "solver.polarisation=false"},
      {"quality=standard", "solver.darkest_zenith_deg=70"},
      {"quality=standard", "spectrum.wavelengths_nm=[550]"},
      {"quality=draft", "spectrum.wavelengths_nm=[550]"},
      {"quality=fair",
       "spectrum.wavelengths_nm=[380,400,420,440,460,480,500,520,540,560,580,600,620,640,660,680,"
       "700]"},
      {"quality=draft",
       "spectrum.wavelengths_nm=[380,390,400,410,420,430,440,450,460,470,480,490,500,510,520,530,"
       "540,550,560,570,580,590,600,610,620,630,640,650,660,670,680,690,700,710,720,730,740,750,"
       "760,770,780,790,800,810,820,830,840,850,860,870,880,890,900,910,920,930,940,950,960,970,"
       "980,990,995,1000]"},
      {"quality=fair", "earth.ground_albedo=1"},
      {"quality=fair", "aerosols.type=urban"},
      {"quality=fair", "aerosols.type=maritime_clean"},
      {"quality=fair", "solver.coarse_orders=false"},
      {"quality=fair", "atmosphere.layers=20"},
      {"quality=fair", "aerosols.mixing_layer=false", "aerosols.free_troposphere=false"},
      {"quality=standard", "solver.scattering_orders=1"},
      {"quality=standard", "solver.scattering_orders=2"},
      {"solver.method=cells", "solver.azimuth_divisions=60"},
      {"solver.method=cells", "solver.azimuth_divisions=60", "solver.active_shell_stride=2"},
      {"solver.method=cells", "solver.azimuth_divisions=60", "solver.active_shell_stride=1"},
      {"solver.method=cells", "solver.azimuth_divisions=120"},
      {"solver.method=cells", "solver.azimuth_divisions=120", "spectrum.wavelengths_nm=[550]"},
      {"solver.method=cells", "solver.azimuth_divisions=120", "solver.active_shell_stride=2"},
      {"solver.method=cells", "solver.azimuth_divisions=180"},
      {"solver.method=cells", "solver.azimuth_divisions=360", "solver.active_shell_stride=12"},
      {"solver.method=cells", "solver.azimuth_divisions=120", "solver.air_phase=isotropic",
       "solver.aerosol_phase=similarity"},
      {"solver.method=cells", "solver.azimuth_divisions=120", "atmosphere.layers=30"},
  };
  return all;
}

twilight::MeasuredRun run(const std::string& scene, const Settings& settings) {
  std::vector<std::string> words = {"radiance", scene, "--quiet", "--view", "90,0"};
  for (const std::string& setting : settings) {
    words.emplace_back("--set");
    words.push_back(setting);
  }
  return twilight::run_twilight(std::move(words));
}

}  // namespace

int main(int argc, char** argv) try {
  std::string filter;
  bool check = false, holds = true;
  for (int i = 1; i < argc; ++i) {
    if (argv[i] == std::string("--check")) {
      check = true;
    } else {
      filter = argv[i];
    }
  }
  const auto scene = std::filesystem::temp_directory_path() /
                     fmt::format("twilight-cost-{}.toml", static_cast<long>(::getpid()));
  std::ofstream(scene) << "[sun]\nelevation_deg = -4\n[spectrum]\n"
                          "wavelengths_nm = [400, 440, 480, 520, 560, 600, 640, 680]\n";
  const double slowness = twilight::machine_slowness();
  fmt::print("slowness {:.2f}\n\n", slowness);
  fmt::print("| scene | seconds | predicted | ratio | MiB | predicted | ratio |\n");
  fmt::print("|---|---|---|---|---|---|---|\n");
  for (const Settings& settings : cases()) {
    std::string name;
    for (const std::string& s : settings) name += s.substr(0, 48) + " ";
    if (name.find(filter) == std::string::npos) continue;
    const twilight::RunCost cost =
        twilight::predict_run(twilight::load_scene(scene, settings).scene, 1);
    const twilight::MeasuredRun used = run(scene.string(), settings);
    const double measured = used.processor_seconds;
    const double mib = used.peak_mib;
    const double predicted = cost.reference_seconds * slowness;
    fmt::print("| {}| {:.2f} | {:.2f} | {:.2f} | {:.0f} | {:.0f} | {:.2f} |\n", name, measured,
               predicted, predicted / measured, mib, cost.peak_bytes / 1048576,
               cost.peak_bytes / 1048576 / mib);
    std::fflush(stdout);
    for (const double ratio : {predicted / measured, cost.peak_bytes / 1048576 / mib}) {
      holds = holds && ratio > 0.5 && ratio < 2;
    }
  }
  std::filesystem::remove(scene);
  return check && !holds ? EXIT_FAILURE : EXIT_SUCCESS;
} catch (const std::exception& error) {
  fmt::print(stderr, "cost_bench: {}\n", error.what());
  return EXIT_FAILURE;
}
