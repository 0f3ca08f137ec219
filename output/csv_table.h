// Tables of numbers as comma-separated text.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace twilight {

/// The shortest decimal text that reads back as the same double; "." always.
std::string shortest_number(double value);

/// A share as per cent for people: two digits below 10, whole numbers above.
std::string percent(double share);

/// A table of named columns and rows of numbers or words.
class CsvTable {
 public:
  using Cell = std::variant<double, std::string>;

  /// Throws std::invalid_argument without columns.
  explicit CsvTable(std::vector<std::string> columns);

  /// A line "# text" above the header; a line break in it starts another such line.
  void add_comment(std::string_view text);
  /// Throws std::invalid_argument if the number of cells is not that of the columns,
  /// std::logic_error if a number is not finite.
  void add_row(const std::vector<Cell>& cells);

  /// The table as text, lines ended by "\n": comments, header, rows. Words with a
  /// comma, quote or line break are quoted (RFC 4180).
  std::string text() const;

  /// Writes to a file, whole or not at all, or to `standard_output` if the path
  /// is "-". Throws std::runtime_error naming the path (or "standard output").
  void write(const std::filesystem::path& path, std::ostream& standard_output) const;

 private:
  std::size_t columns_;
  std::string comments_;
  std::string lines_;
};

}  // namespace twilight
