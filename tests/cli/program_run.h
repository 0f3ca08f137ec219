// Starts the program in a folder of its own and catches what it says.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace twilight {

/// What a finished program left behind.
struct Finished {
  int exit_code = -1;  ///< -1 if a signal ended it
  std::string out;     ///< standard output
  std::string err;     ///< standard error
};

/// Checks that the program refused its input: exit code 2, nothing on standard output, one line on
/// standard error (warnings apart) that holds every fragment.
void expect_refused(const Finished& finished, const std::vector<std::string>& fragments);

/// Arguments followed by more of them.
std::vector<std::string> with(std::vector<std::string> arguments,
                              const std::vector<std::string>& more);

std::vector<std::string> lines_of(const std::string& text);

/// Cells of a CSV line without quoted commas; keeps empty ones at the end.
std::vector<std::string> cells_of(const std::string& line);

/// A temporary folder, removed at the end, in which the program runs.
class Workplace {
 public:
  Workplace();
  ~Workplace();
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  void write(const std::string& name, const std::string& text) const;
  std::string read(const std::string& name) const;
  /// Names of the files and folders in it, hidden ones included.
  std::set<std::string> names() const;

  /// Runs the program to its end. Standard output goes to `out_file` (and Finished::out stays
  /// empty) if that is given.
  Finished run(const std::vector<std::string>& arguments, const std::string& out_file = {}) const;

  /// Starts the program, sends the signal as soon as it has said `after` (empty: anything) on
  /// standard error, and waits for its end.
  Finished run_and_signal(const std::vector<std::string>& arguments, int signal,
                          const std::string& after = {}) const;

 private:
  pid_t start(const std::vector<std::string>& arguments, const std::string& out_file) const;
  Finished finish(pid_t child) const;

  std::filesystem::path folder_;   // where the program runs
  std::filesystem::path streams_;  // what it says
};

}  // namespace twilight
