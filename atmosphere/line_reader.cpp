#include "atmosphere/line_reader.h"

#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

#include "atmosphere/csv_line.h"

namespace twilight {

LineReader::LineReader(const std::filesystem::path& path, std::string_view what)
    : name_(path.string()) {
  std::error_code ignored;
  std::ifstream in(path, std::ios::binary);
  if (!in || std::filesystem::is_directory(path, ignored)) {
    throw std::runtime_error("cannot read " + std::string(what) + " file '" + name_ + "'");
  }
  bytes_.assign(std::istreambuf_iterator<char>(in), {});
  if (in.bad()) {
    throw std::runtime_error("error while reading " + std::string(what) + " file '" + name_ + "'");
  }
}

bool LineReader::next() {
  if (at_ >= bytes_.size()) return false;
  const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
  text_ = std::string_view(bytes_).substr(at_, end - at_);
  at_ = end + 1;
  if (++number_ == 1 && text_.starts_with("\xEF\xBB\xBF")) text_.remove_prefix(3);
  text_ = trimmed(text_);
  return true;
}

std::vector<std::string_view> LineReader::words() const { return split_at_blanks(text_); }

double LineReader::value(std::string_view cell, std::string_view column) const {
  double value = 0.0;
  const char* const end = cell.data() + cell.size();
  const char* const start = cell.data() + (cell.starts_with('+') ? 1 : 0);
  const auto [stop, problem] = std::from_chars(start, end, value);
  if (cell.empty() || problem != std::errc{} || stop != end || !std::isfinite(value)) {
    fail(column, cell, "a finite number");
  }
  return value;
}

void LineReader::fail(std::string_view what) const {
  throw std::invalid_argument(name_ + ":" + std::to_string(number_) + ": " + std::string(what));
}

void LineReader::fail(std::string_view column, std::string_view cell,
                      std::string_view must_be) const {
  fail("column '" + std::string(column) + "': value '" + std::string(cell) + "': must be " +
       std::string(must_be));
}

void LineReader::fail_file(std::string_view what) const {
  throw std::invalid_argument(name_ + ": " + std::string(what));
}

std::vector<std::string_view> split_at_blanks(std::string_view line) {
  constexpr std::string_view kBlank = " \t\r";
  std::vector<std::string_view> words;
  for (;;) {
    const std::size_t start = line.find_first_not_of(kBlank);
    if (start == std::string_view::npos) return words;
    line.remove_prefix(start);
    const std::size_t length = std::min(line.find_first_of(kBlank), line.size());
    words.push_back(line.substr(0, length));
    line.remove_prefix(length);
  }
}

}  // namespace twilight
