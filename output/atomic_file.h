// Files that appear whole or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

namespace twilight {

/// A temporary file beside the target, renamed onto it by commit() and removed
/// by the destructor otherwise. A symbolic link as target stays a link: the file
/// it points to is replaced.
class AtomicFile {
 public:
  /// Makes an empty file ".<stem>.tmp-<process>-<n><extension>" in the target's
  /// folder. Throws std::runtime_error naming the target where that fails, or
  /// where the target exists and is no regular file.
  explicit AtomicFile(const std::filesystem::path& target);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// The temporary file; for a writer that opens it by name.
  const std::filesystem::path& temporary() const { return temporary_; }

  /// Writes bytes at the current position; throws std::runtime_error naming the target.
  void write(const void* bytes, std::size_t count);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// Moves to a byte offset from the start; throws std::runtime_error naming the target.
  void seek(std::size_t offset);

  /// Forces the bytes to the disc and renames; throws std::runtime_error naming
  /// the target, in which case the temporary file is removed.
  void commit();

  /// Throws std::runtime_error "cannot write <target>: <reason>".
  [[noreturn]] void fail(std::string_view reason) const;

 private:
  void fail_with_errno() const;

  std::filesystem::path named_;   // as the caller named it, for messages
  std::filesystem::path target_;  // with symbolic links followed
  std::filesystem::path temporary_;
  int descriptor_ = -1;
};

/// Removes temporary files of AtomicFile that killed programs left in a folder: whose process is
/// not alive here and which no other machine that shares the folder holds (flock). What cannot be
/// removed stays.
void remove_stale_temporaries(const std::filesystem::path& folder);

/// Writes a text file, whole or not at all. Throws as AtomicFile.
void write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace twilight
