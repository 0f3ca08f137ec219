// Whole runs of the program, as a table: whole_run_bench [RUNS [SCENE.toml ...]]
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "output/machine.h"

namespace {

struct Run {
  double seconds = 0;
  double peak_mib = 0;
};

Run render(const std::string& scene, const std::string& image) {
  const auto start = std::chrono::steady_clock::now();
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("cannot start a process");
  if (child == 0) {
    ::execl(TWILIGHT_PROGRAM, "twilight", "render", scene.c_str(), "--quiet", "-o", image.c_str(),
            static_cast<char*>(nullptr));
    ::_exit(127);
  }
  int status = 0;
  rusage used{};
  ::wait4(child, &status, 0, &used);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw std::runtime_error("twilight render " + scene + " failed");
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  return {wall.count(), static_cast<double>(used.ru_maxrss) / 1024};
}

}  // namespace

int main(int argc, char** argv) try {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 5;
  std::vector<std::string> scenes(argv + std::min(argc, 2), argv + argc);
  if (scenes.empty()) {
    scenes = {TWILIGHT_CONFIGS "/haber2005.toml", TWILIGHT_CONFIGS "/default.toml"};
  }
  const auto image = std::filesystem::temp_directory_path() /
                     fmt::format("twilight-bench-{}.exr", static_cast<long>(::getpid()));
  fmt::print("{}, {} hardware threads, {} runs each\n\n", twilight::this_machine().processor,
             std::thread::hardware_concurrency(), runs);
  fmt::print("| scene | least s | median s | most s | peak memory MiB |\n|---|---|---|---|---|\n");
  for (const std::string& scene : scenes) {
    std::vector<double> seconds;
    double peak_mib = 0;
    for (int i = 0; i < runs; ++i) {
      const Run run = render(scene, image.string());
      seconds.push_back(run.seconds);
      peak_mib = std::max(peak_mib, run.peak_mib);
    }
    std::ranges::sort(seconds);
    fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} | {:.0f} |\n",
               std::filesystem::path(scene).filename().string(), seconds.front(),
               seconds[seconds.size() / 2], seconds.back(), peak_mib);
  }
  std::filesystem::remove(image);
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  fmt::print(stderr, "whole_run_bench: {}\n", error.what());
  return EXIT_FAILURE;
}
