#include "output/child_run.h"

#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <system_error>

#include "sim/run_control.h"

extern char** environ;

namespace twilight {
namespace {

using Clock = std::chrono::steady_clock;

[[noreturn]] void fail(const char* what, int error) {
  throw std::runtime_error(std::string("cannot run a process: ") + what + ": " +
                           std::generic_category().message(error));
}

/// An open file that is closed at the end.
class Descriptor {
 public:
  explicit Descriptor(int number, const char* what) : number_(number) {
    if (number < 0) fail(what, errno);
  }
  ~Descriptor() { ::close(number_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

/// A nameless file in memory: holds any amount without a reader, so that no process waits for
/// another's pipe.
class MemoryFile : public Descriptor {
 public:
  explicit MemoryFile(const char* name)
      : Descriptor(::memfd_create(name, MFD_CLOEXEC), "memory file") {}

  void write(const std::string& text) const {
    std::size_t done = 0;
    while (done < text.size()) {
      const ssize_t n = ::write(number(), text.data() + done, text.size() - done);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) fail("memory file", errno);
      done += static_cast<std::size_t>(n);
    }
    ::lseek(number(), 0, SEEK_SET);
  }

  std::string read() const {
    std::string text;
    std::array<char, 1 << 16> buffer;
    for (off_t at = 0;; at = static_cast<off_t>(text.size())) {
      const ssize_t n = ::pread(number(), buffer.data(), buffer.size(), at);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) fail("memory file", errno);
      if (n == 0) return text;
      text.append(buffer.data(), static_cast<std::size_t>(n));
    }
  }
};

double seconds_of(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

struct Program {
  std::string path;  // with a slash, or a name that PATH leads to
  std::vector<std::string> words;
  std::filesystem::path folder;
};

// The child, or nothing where there is no such program.
std::optional<pid_t> spawn(const Program& program, const MemoryFile& in, const MemoryFile& out,
                           const MemoryFile& err) {
  std::vector<std::string> words = program.words;
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, in.number(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, out.number(), STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, err.number(), STDERR_FILENO);
  if (!program.folder.empty()) {
    ::posix_spawn_file_actions_addchdir_np(&actions, program.folder.c_str());
  }
  pid_t child = 0;
  const int error =
      ::posix_spawnp(&child, program.path.c_str(), &actions, nullptr, argv.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (error == ENOENT) return std::nullopt;
  if (error != 0) fail("posix_spawn", error);
  return child;
}

// Whether the child has ended within the time.
bool ends_within(const Descriptor& handle, std::chrono::milliseconds time) {
  pollfd poll{handle.number(), POLLIN, 0};
  return ::poll(&poll, 1, static_cast<int>(time.count())) == 1;
}

// Waits for a child that has ended or is about to.
ChildRun collect(pid_t child) {
  int status = 0;
  rusage used{};
  while (::wait4(child, &status, 0, &used) < 0) {
    if (errno != EINTR) fail("wait4", errno);
  }
  ChildRun run;
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  run.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  run.cpu_seconds = seconds_of(used.ru_utime) + seconds_of(used.ru_stime);
  return run;
}

std::optional<ChildRun> run(const Program& program, const std::string& input,
                            const std::atomic<bool>* cancel) {
  using namespace std::chrono_literals;
  const MemoryFile in("in"), out("out"), err("err");
  in.write(input);
  const auto start = Clock::now();
  const std::optional<pid_t> spawned = spawn(program, in, out, err);
  if (!spawned) return std::nullopt;
  const pid_t child = *spawned;
  // glibc 2.36 declares pidfd_open for C alone.
  const auto handle_number = static_cast<int>(::syscall(SYS_pidfd_open, child, 0));
  if (handle_number < 0) {
    const int error = errno;
    ::kill(child, SIGKILL);
    collect(child);
    fail("pidfd_open", error);
  }
  const Descriptor handle(handle_number, "pidfd_open");
  const auto stop = [&] { return cancel != nullptr && cancel->load(std::memory_order_relaxed); };
  while (!stop() && !ends_within(handle, 100ms)) {
  }
  if (stop()) {
    ::kill(child, SIGTERM);
    if (!ends_within(handle, 3000ms)) ::kill(child, SIGKILL);
    collect(child);
    throw Cancelled();
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  ChildRun run = collect(child);
  run.seconds = seconds;
  run.out = out.read();
  run.err = err.read();
  return run;
}

std::vector<std::string> named(const std::string& name, const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {name};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return words;
}

}  // namespace

ChildRun run_self(const std::vector<std::string>& arguments, const std::string& input,
                  const std::atomic<bool>* cancel) {
  auto finished = run({"/proc/self/exe", named("twilight", arguments), {}}, input, cancel);
  if (!finished) fail("posix_spawn", ENOENT);
  return std::move(*finished);
}

std::optional<ChildRun> run_program(const std::string& name,
                                    const std::vector<std::string>& arguments,
                                    const std::filesystem::path& folder,
                                    const std::atomic<bool>* cancel) {
  return run({name, named(name, arguments), folder}, {}, cancel);
}

void end_with_parent(int parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) std::_Exit(EXIT_FAILURE);  // it has gone already
}

}  // namespace twilight
