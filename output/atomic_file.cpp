#include "output/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>

namespace twilight {

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
  stem += target_.stem().string() + ".tmp-" + std::to_string(::getpid()) + "-";
  for (int n = 0; n < 10000; ++n) {
    std::string name = stem + std::to_string(n) + target_.extension().string();
    temporary_ = target_.parent_path() / name;
    // O_EXCL: another writer's temporary file is never taken over.
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ >= 0) return;
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

void write_text_file(const std::filesystem::path& path, std::string_view text) {
  AtomicFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace twilight
