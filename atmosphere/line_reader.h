// A text file read line by line, with complaints that name the line.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace twilight {

/// The lines of a text file. Complaints are std::invalid_argument "FILE:LINE: ..." or, for a file
/// that cannot be read, std::runtime_error naming it.
class LineReader {
 public:
  /// Reads the file whole; `what` names its kind where it cannot be read: "profile".
  LineReader(const std::filesystem::path& path, std::string_view what);

  const std::string& name() const { return name_; }
  /// Goes to the next line; false behind the last one, whose number stays.
  bool next();
  /// The line at hand without blanks at both ends (nor the byte order mark); its number from 1.
  std::string_view text() const { return text_; }
  std::size_t number() const { return number_; }

  /// What stands between blanks in the line at hand.
  std::vector<std::string_view> words() const;

  /// The finite number that `cell` is. Throws "FILE:LINE: column 'NAME': value 'CELL': must be a
  /// finite number".
  double value(std::string_view cell, std::string_view column) const;

  /// Throws "FILE:LINE: WHAT".
  [[noreturn]] void fail(std::string_view what) const;
  /// Throws "FILE:LINE: column 'NAME': value 'CELL': must be RANGE".
  [[noreturn]] void fail(std::string_view column, std::string_view cell,
                         std::string_view must_be) const;
  /// Throws "FILE: WHAT", for what the whole file lacks.
  [[noreturn]] void fail_file(std::string_view what) const;

 private:
  std::string name_;
  std::string bytes_;
  std::size_t at_ = 0, number_ = 0;
  std::string_view text_;
};

/// What stands between blanks and tabs.
std::vector<std::string_view> split_at_blanks(std::string_view line);

}  // namespace twilight
