#include "tests/bench/measured_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <stdexcept>

#include "sim/elapsed_time.h"

namespace twilight {
namespace {

double seconds_of(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

}  // namespace

MeasuredRun run_twilight(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "twilight");
  std::vector<char*> argv;
  for (std::string& a : arguments) argv.push_back(a.data());
  argv.push_back(nullptr);
  const auto start = Clock::now();
  std::fflush(nullptr);  // else the child writes it once more
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("cannot start a process");
  if (child == 0) {
    // What the program prints is not part of the table.
    if (std::freopen("/dev/null", "w", stdout) == nullptr) ::_exit(126);
    ::execv(TWILIGHT_PROGRAM, argv.data());
    ::_exit(127);
  }
  int status = 0;
  rusage used{};
  ::wait4(child, &status, 0, &used);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw std::runtime_error(fmt::format("{} failed", fmt::join(arguments, " ")));
  }
  return {seconds_since(start), seconds_of(used.ru_utime) + seconds_of(used.ru_stime),
          static_cast<double>(used.ru_maxrss) / 1024};
}

}  // namespace twilight
