// Numbers of a CSV file with a header.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace twilight {

/// A file of comma-separated text with one line of column names. Empty lines and lines that start
/// with '#' are skipped; cells are not quoted.
class CsvFile {
 public:
  /// Throws std::runtime_error where the file cannot be read, std::invalid_argument "FILE:LINE:
  /// ..." without a header, for a column named twice and a row of another number of cells.
  explicit CsvFile(const std::filesystem::path& path);

  const std::vector<std::string>& columns() const { return columns_; }
  std::optional<std::size_t> column(std::string_view name) const;
  /// Throws std::invalid_argument naming the file and the column.
  std::size_t required(std::string_view name) const;

  std::size_t rows() const { return rows_.size(); }
  int line(std::size_t row) const { return rows_[row].line; }
  const std::string& text(std::size_t row, std::size_t column) const {
    return rows_[row].cells[column];
  }
  /// A finite number in low..high. Throws std::invalid_argument "FILE:LINE: column 'x' = TEXT: must
  /// be a number in LOW..HIGH".
  double number(std::size_t row, std::size_t column, double low, double high) const;
  /// Throws "FILE:LINE: column 'x' = TEXT: MESSAGE".
  [[noreturn]] void refuse(std::size_t row, std::size_t column, std::string_view message) const;

 private:
  struct Row {
    int line;
    std::vector<std::string> cells;
  };
  std::string name_;
  std::vector<std::string> columns_;
  std::vector<Row> rows_;
};

}  // namespace twilight
