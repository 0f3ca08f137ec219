#include "output/atomic_file.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <stdexcept>
#include <string>
#include <system_error>

namespace twilight {
namespace {

constexpr std::string_view kTemporaryMark = ".tmp-";

}  // namespace

AtomicFile::AtomicFile(const std::filesystem::path& target) : named_(target), target_(target) {
  if (target.empty() || !target.has_filename()) fail("no file name");
  std::error_code error;
  const auto status = std::filesystem::status(target, error);
  if (std::filesystem::exists(status)) {
    if (!std::filesystem::is_regular_file(status)) fail("it exists and is not a regular file");
    target_ = std::filesystem::canonical(target, error);
    if (error) fail(error.message());
  }
  std::string stem(".");
  stem += target_.stem().string() + std::string(kTemporaryMark) + std::to_string(::getpid()) + "-";
  for (int n = 0; n < 10000; ++n) {
    std::string name = stem + std::to_string(n) + target_.extension().string();
    temporary_ = target_.parent_path() / name;
    // O_EXCL: another writer's temporary file is never taken over.
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ >= 0) {
      // Tells remove_stale_temporaries() that it is in use; a file system may know no locks.
      ::flock(descriptor_, LOCK_EX | LOCK_NB);
      return;
    }
    if (errno != EEXIST) break;
  }
  fail_with_errno();
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  ::unlink(temporary_.c_str());
}

void AtomicFile::write(const void* bytes, std::size_t count) {
  const char* next = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t written = ::write(descriptor_, next, count);
    if (written < 0) {
      if (errno == EINTR) continue;
      fail_with_errno();
    }
    next += written;
    count -= static_cast<std::size_t>(written);
  }
}

void AtomicFile::seek(std::size_t offset) {
  if (::lseek(descriptor_, static_cast<off_t>(offset), SEEK_SET) < 0) fail_with_errno();
}

void AtomicFile::commit() {
  // Some file systems (pipes, network mounts) do not know fsync: not an error.
  if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP) fail_with_errno();
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail_with_errno();
  const int closing = descriptor_;
  descriptor_ = -1;
  ::close(closing);
}

void AtomicFile::fail(std::string_view reason) const {
  throw std::runtime_error("cannot write " + named_.string() + ": " + std::string(reason));
}

void AtomicFile::fail_with_errno() const {
  fail(std::error_code(errno, std::generic_category()).message());
}

void remove_stale_temporaries(const std::filesystem::path& folder) {
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const std::size_t mark = name.rfind(kTemporaryMark);
    if (!name.starts_with('.') || mark == std::string::npos) continue;
    const char* const digits = name.data() + mark + kTemporaryMark.size();
    pid_t process = 0;
    const auto [stop, failure] = std::from_chars(digits, name.data() + name.size(), process);
    if (failure != std::errc{} || stop == name.data() + name.size() || *stop != '-') continue;
    if (process == ::getpid() || ::kill(process, 0) == 0 || errno == EPERM) continue;
    const int descriptor = ::open(entry->path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (descriptor < 0) continue;
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) ::unlink(entry->path().c_str());
    ::close(descriptor);
  }
}

void write_text_file(const std::filesystem::path& path, std::string_view text) {
  AtomicFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace twilight
