#include "output/study_case_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <fstream>
#include <iterator>

#include "atmosphere/netcdf_reader.h"
#include "output/checksum.h"
#include "output/command_line.h"
#include "output/file_bytes.h"
#include "output/netcdf_writer.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

// The file's fingerprint stands in itself, behind this word, and is made with noughts in its place.
constexpr std::string_view kMark = "fnv1a64:";
constexpr std::size_t kDigits = 16;

// Where the digits stand; npos in what is no file of a case.
std::size_t digits_at(const std::string& bytes) {
  const std::size_t mark = bytes.find(kMark);
  const bool whole = mark != std::string::npos && mark + kMark.size() + kDigits <= bytes.size();
  return whole ? mark + kMark.size() : std::string::npos;
}

bool is_sound(std::string bytes) {
  const std::size_t at = digits_at(bytes);
  if (at == std::string::npos) return false;
  const std::string said = bytes.substr(at, kDigits);
  bytes.replace(at, kDigits, kDigits, '0');
  return fnv1a64(bytes) == said;
}

bool is_used(const StudyCoordinate& coordinate, const std::vector<StudyQuantity>& quantities) {
  return std::ranges::any_of(quantities, [&](const StudyQuantity& q) {
    return std::ranges::find(q.dimensions, coordinate.name) != q.dimensions.end();
  });
}

}  // namespace

fs::path case_file(const fs::path& folder, const std::string& hash) {
  return folder / (hash + ".nc");
}
fs::path case_picture_file(const fs::path& folder, const std::string& hash) {
  return folder / (hash + ".png");
}
fs::path case_exr_file(const fs::path& folder, const std::string& hash) {
  return folder / (hash + ".exr");
}
fs::path case_error_file(const fs::path& folder, const std::string& hash) {
  return folder / (hash + ".error");
}

void write_case(const fs::path& folder, const CaseResult& result,
                const std::vector<StudyCoordinate>& coordinates) {
  AtomicFile file(case_file(folder, result.hash));
  NetcdfWriter out(file);
  for (const StudyCoordinate& c : coordinates) {
    if (!is_used(c, result.quantities)) continue;
    out.dimension(c.name, c.size());
    if (c.words.empty()) {
      out.variable(c.name, NetcdfNumber::kDouble, {c.name}, c.meaning);
    } else {
      const auto longest = std::ranges::max(c.words, {}, &std::string::size).size();
      out.words(c.name, c.name, longest, c.meaning);
    }
  }
  for (const StudyQuantity& q : result.quantities) {
    out.variable(q.name, q.single_precision ? NetcdfNumber::kFloat : NetcdfNumber::kDouble,
                 q.dimensions, q.meaning);
  }
  out.attribute("", "Conventions", "CF-1.10");
  out.attribute("", "title", "A case of a study of the clear sky");
  out.attribute("", "source", fmt::format("twilight {}", kVersion));
  out.attribute("", "case_hash", result.hash);
  out.attribute("", "inputs", result.inputs);
  out.attribute("", "picture", result.picture);
  out.attribute("", "exr", result.exr);
  out.attribute("", "clamped", result.clamps);
  out.attribute("", "quantities", [&] {
    std::string names;
    for (const StudyQuantity& q : result.quantities) names += (names.empty() ? "" : " ") + q.name;
    return names;
  }());
  out.attribute("", "checksum", fmt::format("{}{:0>{}}", kMark, "", kDigits));
  out.end_definitions();
  for (const StudyCoordinate& c : coordinates) {
    if (!is_used(c, result.quantities)) continue;
    if (c.words.empty()) {
      out.put(c.name, std::span<const double>(c.values));
    } else {
      out.put(c.name, c.words);
    }
  }
  for (const StudyQuantity& q : result.quantities) {
    out.put(q.name, std::span<const double>(q.values));
  }
  out.close();
  const std::string bytes = file_bytes(file.temporary());
  const std::size_t at = digits_at(bytes);
  if (at == std::string::npos) file.fail("it cannot be read back");
  file.seek(at);
  file.write(fnv1a64(bytes));
  file.commit();
}

std::optional<CaseResult> read_case(const fs::path& folder, const std::string& hash) {
  const fs::path path = case_file(folder, hash);
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return std::nullopt;
  if (!is_sound(file_bytes(path))) return std::nullopt;
  try {
    const NetcdfReader file(path, "case of a study");
    CaseResult result;
    result.hash = file.required_text("", "case_hash");
    result.inputs = file.required_text("", "inputs");
    result.picture = file.text_attribute("", "picture").value_or("");
    result.exr = file.text_attribute("", "exr").value_or("");
    result.clamps = file.text_attribute("", "clamped").value_or("");
    const std::string names = file.required_text("", "quantities") + ' ';
    for (std::size_t at = 0; at < names.size();) {
      const std::size_t end = names.find(' ', at);
      StudyQuantity q;
      q.name = names.substr(at, end - at);
      q.meaning.units = file.text_attribute(q.name, "units").value_or("");
      q.meaning.long_name = file.text_attribute(q.name, "long_name").value_or("");
      q.meaning.standard_name = file.text_attribute(q.name, "standard_name").value_or("");
      q.dimensions = file.dimensions(q.name);
      q.single_precision = file.type(q.name) == NetcdfType::kFloat;
      q.values = file.numbers(q.name, false);
      result.quantities.push_back(std::move(q));
      at = end + 1;
    }
    if (result.hash != hash) return std::nullopt;
    for (const std::string& image : {result.picture, result.exr}) {
      if (!image.empty() && !fs::is_regular_file(folder / image, ignored)) return std::nullopt;
    }
    return result;
  } catch (const std::exception&) {
    return std::nullopt;  // damaged: as if it were not there
  }
}

std::optional<std::string> read_case_error(const fs::path& folder, const std::string& hash) {
  std::ifstream stream(case_error_file(folder, hash), std::ios::binary);
  if (!stream) return std::nullopt;
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

}  // namespace twilight
