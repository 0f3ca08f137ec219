// Programs, this one included, run in a process of their own.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace twilight {

/// What a finished child left behind.
struct ChildRun {
  int exit_code = 0;         ///< -1 if a signal ended it
  int signal = 0;            ///< that signal, else 0
  std::string out, err;      ///< standard output and standard error
  double seconds = 0.0;      ///< from its start to its end
  double cpu_seconds = 0.0;  ///< user and system time of all its threads
};

/// Runs this very program (/proc/self/exe) with `arguments` and `input` as its standard input, and
/// waits. Where `cancel` (may be null) becomes true, the child is told to stop (SIGTERM, and after
/// 3 s SIGKILL) and Cancelled is thrown. Throws std::runtime_error where no process can be made.
ChildRun run_self(const std::vector<std::string>& arguments, const std::string& input,
                  const std::atomic<bool>* cancel);

/// Runs another program, found on PATH, in the working folder `folder` (empty: this one's), with
/// an empty standard input; otherwise as run_self. Nothing where there is no such program.
std::optional<ChildRun> run_program(const std::string& name,
                                    const std::vector<std::string>& arguments,
                                    const std::filesystem::path& folder,
                                    const std::atomic<bool>* cancel);

/// Called by a child: it ends as soon as the process `parent` does, whatever ends that one.
void end_with_parent(int parent);

}  // namespace twilight
