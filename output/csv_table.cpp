#include "output/csv_table.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <ostream>
#include <stdexcept>

#include "output/atomic_file.h"

namespace twilight {
namespace {

std::string quoted_if_needed(const std::string& word) {
  if (word.find_first_of(",\"\r\n") == std::string::npos) return word;
  std::string quoted = "\"";
  for (char letter : word) {
    if (letter == '"') quoted += '"';
    quoted += letter;
  }
  return quoted + '"';
}

}  // namespace

std::string shortest_number(double value) {
  std::array<char, 32> digits;
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  return {digits.data(), end};
}

std::string percent(double share) {
  const double p = 100 * share;
  return p >= 9.95 ? fmt::format("{:.0f}", p) : fmt::format("{:.2g}", p);
}

CsvTable::CsvTable(std::vector<std::string> columns) : columns_(columns.size()) {
  if (columns.empty()) throw std::invalid_argument("table has 0 columns; at least 1 is needed");
  add_row({columns.begin(), columns.end()});
}

void CsvTable::add_comment(std::string_view text) {
  comments_ += "# ";
  for (char letter : text) {
    comments_ += letter;
    if (letter == '\n') comments_ += "# ";
  }
  comments_ += '\n';
}

void CsvTable::add_row(const std::vector<Cell>& cells) {
  if (cells.size() != columns_) {
    throw std::invalid_argument("row has " + std::to_string(cells.size()) +
                                " cells; it must have " + std::to_string(columns_));
  }
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) line += ',';
    if (const auto* number = std::get_if<double>(&cells[i])) {
      if (!std::isfinite(*number)) {
        throw std::logic_error("column " + std::to_string(i) + " of a table row is " +
                               std::to_string(*number) + "; it must be finite");
      }
      line += shortest_number(*number);
    } else {
      line += quoted_if_needed(std::get<std::string>(cells[i]));
    }
  }
  lines_ += line + '\n';
}

std::string CsvTable::text() const { return comments_ + lines_; }

void CsvTable::write(const std::filesystem::path& path, std::ostream& standard_output) const {
  if (path == "-") {
    standard_output << text() << std::flush;
    if (!standard_output) throw std::runtime_error("cannot write standard output");
    return;
  }
  AtomicFile file(path);
  file.write(text());
  file.commit();
}

}  // namespace twilight
