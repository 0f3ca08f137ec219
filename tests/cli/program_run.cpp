#include "tests/cli/program_run.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace twilight {
namespace {

namespace fs = std::filesystem;

std::string text_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

fs::path new_folder() {
  std::string name = (fs::temp_directory_path() / "twilight-cli-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  return name;
}

}  // namespace

void expect_refused(const Finished& finished, const std::vector<std::string>& fragments) {
  EXPECT_EQ(finished.exit_code, 2) << finished.err;
  EXPECT_EQ(finished.out, "");
  std::vector<std::string> complaints = lines_of(finished.err);
  std::erase_if(complaints, [](const std::string& line) { return line.starts_with("warning: "); });
  ASSERT_EQ(complaints.size(), 1u) << finished.err;
  for (const std::string& fragment : fragments) {
    EXPECT_NE(complaints[0].find(fragment), std::string::npos)
        << "'" << fragment << "' is not in: " << finished.err;
  }
}

std::vector<std::string> with(std::vector<std::string> arguments,
                              const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',')
      cells.emplace_back();
    else
      cells.back() += c;
  }
  return cells;
}

Workplace::Workplace() : folder_(new_folder()), streams_(new_folder()) {}

Workplace::~Workplace() {
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
  fs::remove_all(streams_, ignored);
}

void Workplace::write(const std::string& name, const std::string& text) const {
  std::ofstream(path(name), std::ios::binary) << text;
}

std::string Workplace::read(const std::string& name) const { return text_of(path(name)); }

std::set<std::string> Workplace::names() const {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder_))
    names.insert(entry.path().filename().string());
  return names;
}

pid_t Workplace::start(const std::vector<std::string>& arguments,
                       const std::string& out_file) const {
  // Everything that allocates comes before the fork.
  const std::string out = out_file.empty() ? (streams_ / "out").string() : out_file;
  const std::string err = (streams_ / "err").string();
  std::vector<std::string> words = {TWILIGHT_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::ofstream(err).flush();

  const pid_t child = ::fork();
  if (child != 0) return child;
  const int out_descriptor = ::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  const int err_descriptor = ::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (out_descriptor < 0 || err_descriptor < 0 || ::chdir(folder_.c_str()) != 0 ||
      ::dup2(out_descriptor, STDOUT_FILENO) < 0 || ::dup2(err_descriptor, STDERR_FILENO) < 0) {
    ::_exit(126);
  }
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

Finished Workplace::finish(pid_t child) const {
  int status = 0;
  if (::waitpid(child, &status, 0) != child) throw std::runtime_error("the program is lost");
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(streams_ / "out"),
          text_of(streams_ / "err")};
}

Finished Workplace::run(const std::vector<std::string>& arguments,
                        const std::string& out_file) const {
  return finish(start(arguments, out_file));
}

Finished Workplace::run_and_signal(const std::vector<std::string>& arguments, int signal,
                                   const std::string& after) const {
  const pid_t child = start(arguments, {});
  const auto said = [&] {
    const std::string text = text_of(streams_ / "err");
    return !text.empty() && text.find(after) != std::string::npos;
  };
  for (int waited = 0; waited < 6000 && !said(); ++waited)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ::kill(child, signal);
  return finish(child);
}

}  // namespace twilight
