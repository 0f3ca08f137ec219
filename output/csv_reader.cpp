#include "output/csv_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "atmosphere/csv_line.h"

namespace twilight {

CsvFile::CsvFile(const std::filesystem::path& path) : name_(path.string()) {
  std::ifstream stream(path);
  if (!stream || std::filesystem::is_directory(path)) {
    throw std::runtime_error(fmt::format("{}: cannot read this file", name_));
  }
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    const std::string_view content = trimmed(line);
    if (content.empty() || content.starts_with('#')) continue;
    std::vector<std::string> cells;
    for (const std::string_view cell : split_at_commas(content)) cells.emplace_back(cell);
    if (columns_.empty()) {
      columns_ = std::move(cells);
      for (std::size_t i = 0; i < columns_.size(); ++i) {
        if (std::ranges::count(columns_, columns_[i]) == 1) continue;
        throw std::invalid_argument(
            fmt::format("{}:{}: column '{}' is there twice", name_, number, columns_[i]));
      }
      continue;
    }
    if (cells.size() != columns_.size()) {
      throw std::invalid_argument(
          fmt::format("{}:{}: '{}' has {} values: must have {}, as the header", name_, number,
                      content, cells.size(), columns_.size()));
    }
    rows_.push_back({number, std::move(cells)});
  }
  if (stream.bad()) throw std::runtime_error(fmt::format("{}: cannot be read", name_));
  if (columns_.empty()) {
    throw std::invalid_argument(fmt::format("{}: is empty: must begin with column names", name_));
  }
}

std::optional<std::size_t> CsvFile::column(std::string_view name) const {
  const auto it = std::ranges::find(columns_, name);
  if (it == columns_.end()) return std::nullopt;
  return static_cast<std::size_t>(it - columns_.begin());
}

std::size_t CsvFile::required(std::string_view name) const {
  if (const auto found = column(name)) return *found;
  throw std::invalid_argument(fmt::format("{}: must have a column '{}'", name_, name));
}

double CsvFile::number(std::size_t row, std::size_t column, double low, double high) const {
  const std::string& cell = text(row, column);
  double value = 0.0;
  const char* const end = cell.data() + cell.size();
  const char* const start = cell.data() + (cell.starts_with('+') ? 1 : 0);
  const auto [stop, error] = std::from_chars(start, end, value);
  if (error != std::errc{} || stop != end || !std::isfinite(value) ||
      !(value >= low && value <= high)) {
    refuse(row, column, fmt::format("must be a number in {:g}..{:g}", low, high));
  }
  return value;
}

void CsvFile::refuse(std::size_t row, std::size_t column, std::string_view message) const {
  throw std::invalid_argument(
      fmt::format("{}:{}: column '{}' = {}: {}", name_, line(row), columns_[column],
                  text(row, column).empty() ? "\"\"" : text(row, column), message));
}

}  // namespace twilight
