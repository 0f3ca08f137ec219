#include "output/study_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "output/command_line.h"
#include "output/csv_table.h"
#include "output/file_bytes.h"
#include "output/netcdf_writer.h"
#include "output/study_case_file.h"
#include "output/study_report.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
// Columns of one quantity in the table; more are for the netCDF file.
constexpr std::size_t kMostColumns = 512;

// The unit that a key's name ends in, as UDUNITS spells it; "1" where it ends in none.
std::string unit_of_key(const std::string& key) {
  constexpr std::pair<std::string_view, std::string_view> kUnits[] = {
      {"_per_km", "km-1"}, {"_deg", "degree"}, {"_percent", "percent"}, {"_km", "km"},
      {"_m", "m"},         {"_nm", "nm"},      {"_seconds", "s"},       {"_du", "2.687e20 m-2"}};
  for (const auto& [ending, unit] : kUnits) {
    if (key.ends_with(ending)) return std::string(unit);
  }
  return "1";
}

bool is_pixel(const std::string& dimension) { return dimension == "x" || dimension == "y"; }

const StudyCoordinate& coordinate_of(const StudyManifest& manifest, const std::string& name) {
  const auto found = std::ranges::find(manifest.coordinates, name, &StudyCoordinate::name);
  if (found == manifest.coordinates.end()) {
    throw std::runtime_error(
        fmt::format("the cases have a dimension '{}' that the study does not know: compute them "
                    "again with --fresh",
                    name));
  }
  return *found;
}

bool in_table(const StudyQuantity& quantity) {
  return quantity.values.size() <= kMostColumns &&
         std::ranges::none_of(quantity.dimensions, is_pixel);
}

// "radiance[el 20 az 90, 550 nm]" of a number of a quantity.
std::string column_name(const StudyManifest& manifest, const StudyQuantity& quantity,
                        std::size_t component) {
  std::vector<std::string> parts;
  for (std::size_t d = quantity.dimensions.size(); d-- > 0;) {
    const StudyCoordinate& c = coordinate_of(manifest, quantity.dimensions[d]);
    const std::size_t k = component % c.size();
    component /= c.size();
    const bool plain = c.meaning.units.empty() || c.meaning.units == "1";
    parts.push_back(!c.words.empty() ? c.words[k]
                    : plain          ? fmt::format("{} {}", c.name, c.values[k])
                                     : fmt::format("{} {}", c.values[k], c.meaning.units));
  }
  if (parts.empty()) return quantity.name;
  std::string text = quantity.name + "[";
  for (std::size_t p = parts.size(); p-- > 0;) text += parts[p] + (p > 0 ? ", " : "]");
  return text;
}

/// The study as it is put together, case by case.
class Assembler {
 public:
  Assembler(const fs::path& directory, const StudyManifest& manifest, const CaseResult& first)
      : directory_(directory),
        m_(manifest),
        file_(directory / "study.nc"),
        out_(file_),
        quantities_(first.quantities) {
    table_.title = m_.title;
    if (m_.study.crossed()) {
      for (const StudyDimension& d : m_.study.dimensions) table_.crossed_sizes.push_back(d.size);
    }
    table_.pictures.resize(m_.hashes.size());
    table_.errors.resize(m_.hashes.size());
    define();
    columns();
  }

  void put(std::size_t node, const CaseResult& result);
  void put_nothing(std::size_t node, const std::string& why);
  std::vector<std::string> finish();

 private:
  void define();
  void define_axes();
  void columns();
  void put_slab(std::size_t node, const StudyQuantity& shape, std::span<const double> values);
  CsvTable csv() const;

  const fs::path& directory_;
  const StudyManifest& m_;
  AtomicFile file_;
  NetcdfWriter out_;
  std::vector<StudyQuantity> quantities_;  // what every case has; their values do not matter
  StudyTable table_;
};

void Assembler::define_axes() {
  for (const StudyDimension& d : m_.study.dimensions) out_.dimension(d.name, d.size);
  for (const StudyDimension& d : m_.study.dimensions) {
    if (m_.study.listed(d)) {
      out_.variable(d.name, NetcdfNumber::kDouble, {d.name}, {"1", "number of the " + d.name, ""});
    }
    for (const std::size_t a : d.axes) {
      const StudyAxis& axis = m_.study.axes[a];
      const std::string name = axis_variable(axis);
      if (axis.words.empty()) {
        out_.variable(name, NetcdfNumber::kDouble, {d.name},
                      {unit_of_key(axis.key), "key " + axis.key, ""});
      } else {
        const auto longest = std::ranges::max(axis.words, {}, &std::string::size).size();
        out_.words(name, d.name, longest, {"", "key " + axis.key, ""});
        out_.attribute(name, "_Encoding", "utf-8");
      }
    }
  }
}

void Assembler::define() {
  define_axes();
  std::vector<std::string> dimensions;
  std::string listed;  // axes that are no coordinate variables, for CF's "coordinates"
  for (const StudyDimension& d : m_.study.dimensions) {
    dimensions.push_back(d.name);
    if (!m_.study.listed(d)) continue;
    for (const std::size_t a : d.axes) {
      if (!listed.empty()) listed += ' ';
      listed += axis_variable(m_.study.axes[a]);
    }
  }
  std::vector<const StudyCoordinate*> used;
  for (const StudyCoordinate& c : m_.coordinates) {
    const bool wanted = std::ranges::any_of(quantities_, [&](const StudyQuantity& q) {
      return std::ranges::find(q.dimensions, c.name) != q.dimensions.end();
    });
    if (!wanted) continue;
    used.push_back(&c);
    out_.dimension(c.name, c.size());
    if (c.words.empty()) {
      out_.variable(c.name, NetcdfNumber::kDouble, {c.name}, c.meaning);
    } else {
      const auto longest = std::ranges::max(c.words, {}, &std::string::size).size();
      out_.words(c.name, c.name, longest, c.meaning);
      out_.attribute(c.name, "_Encoding", "utf-8");
    }
  }
  for (const StudyQuantity& q : quantities_) {
    std::vector<std::string> all = dimensions;
    for (const std::string& name : q.dimensions) all.push_back(coordinate_of(m_, name).name);
    out_.variable(q.name, q.single_precision ? NetcdfNumber::kFloat : NetcdfNumber::kDouble, all,
                  q.meaning, &kUnknown);
    out_.attribute(q.name, "coordinates", listed);
  }
  out_.attribute("", "Conventions", "CF-1.10");
  out_.attribute("", "title", fmt::format("Study of the clear sky: {}", m_.title));
  out_.attribute("", "source", fmt::format("twilight {}", kVersion));
  out_.attribute("", "scene", m_.scene);
  out_.end_definitions();
  for (const StudyDimension& d : m_.study.dimensions) {
    if (m_.study.listed(d)) {
      std::vector<double> number(d.size);
      std::iota(number.begin(), number.end(), 1.0);
      out_.put(d.name, std::span<const double>(number));
    }
  }
  for (const StudyAxis& axis : m_.study.axes) {
    if (axis.words.empty()) {
      out_.put(axis_variable(axis), std::span<const double>(axis.values));
    } else {
      out_.put(axis_variable(axis), axis.words);
    }
  }
  for (const StudyCoordinate* c : used) {
    if (c->words.empty()) {
      out_.put(c->name, std::span<const double>(c->values));
    } else {
      out_.put(c->name, c->words);
    }
  }
}

void Assembler::columns() {
  for (const StudyAxis& axis : m_.study.axes) {
    StudyColumn column;
    column.name = axis.key;
    column.unit = axis.words.empty() ? unit_of_key(axis.key) : "";
    table_.axes.push_back(std::move(column));
  }
  for (std::size_t node = 0; node < m_.hashes.size(); ++node) {
    const std::vector<std::size_t> at = m_.study.indices_at(node);
    for (std::size_t a = 0; a < at.size(); ++a) {
      const StudyAxis& axis = m_.study.axes[a];
      if (axis.words.empty()) {
        table_.axes[a].values.push_back(axis.values[at[a]]);
      } else {
        table_.axes[a].words.push_back(axis.words[at[a]]);
      }
    }
  }
  for (const StudyQuantity& q : quantities_) {
    if (!in_table(q)) continue;
    for (std::size_t k = 0; k < q.values.size(); ++k) {
      StudyColumn column;
      column.name = column_name(m_, q, k);
      column.unit = q.meaning.units;
      column.values.assign(m_.hashes.size(), kUnknown);
      table_.quantities.push_back(std::move(column));
    }
  }
}

void Assembler::put_slab(std::size_t node, const StudyQuantity& shape,
                         std::span<const double> values) {
  const std::vector<std::size_t> at = m_.study.indices_at(node);
  std::vector<std::size_t> start, count;
  for (const StudyDimension& d : m_.study.dimensions) {
    start.push_back(at[d.axes.front()]);
    count.push_back(1);
  }
  for (const std::string& name : shape.dimensions) {
    start.push_back(0);
    count.push_back(coordinate_of(m_, name).size());
  }
  out_.put(shape.name, start, count, values);
}

void Assembler::put(std::size_t node, const CaseResult& result) {
  std::size_t column = 0;
  for (std::size_t k = 0; k < quantities_.size(); ++k) {
    const StudyQuantity& shape = quantities_[k];
    const bool alike = result.quantities.size() == quantities_.size() &&
                       result.quantities[k].name == shape.name &&
                       result.quantities[k].dimensions == shape.dimensions &&
                       result.quantities[k].values.size() == shape.values.size();
    if (!alike) {
      throw std::runtime_error(
          fmt::format("{}: case {} has other quantities than the first: compute it again",
                      directory_.string(), node + 1));
    }
    const std::vector<double>& values = result.quantities[k].values;
    put_slab(node, shape, values);
    if (!in_table(shape)) continue;
    for (const double value : values) table_.quantities[column++].values[node] = value;
  }
  if (!result.picture.empty()) table_.pictures[node] = "cases/" + result.picture;
}

void Assembler::put_nothing(std::size_t node, const std::string& why) {
  for (const StudyQuantity& shape : quantities_) {
    put_slab(node, shape, std::vector<double>(shape.values.size(), kUnknown));
  }
  table_.errors[node] = why;
}

CsvTable Assembler::csv() const {
  std::vector<std::string> names = {"case"};
  for (const StudyColumn& column : table_.axes) names.push_back(column.name);
  for (const StudyColumn& column : table_.quantities) {
    const bool plain = column.unit.empty() || column.unit == "1";
    names.push_back(plain ? column.name : fmt::format("{} ({})", column.name, column.unit));
  }
  names.emplace_back("error");
  CsvTable csv(names);
  for (std::size_t node = 0; node < table_.cases(); ++node) {
    std::vector<CsvTable::Cell> row = {static_cast<double>(node + 1)};
    for (const StudyColumn& column : table_.axes) {
      row.push_back(column.words.empty() ? CsvTable::Cell(column.values[node])
                                         : CsvTable::Cell(column.words[node]));
    }
    for (const StudyColumn& column : table_.quantities) {
      const double value = column.values[node];
      row.push_back(std::isfinite(value) ? CsvTable::Cell(value) : CsvTable::Cell(""));
    }
    row.emplace_back(table_.errors[node]);
    csv.add_row(row);
  }
  return csv;
}

std::vector<std::string> Assembler::finish() {
  out_.close();
  file_.commit();
  csv().write(directory_ / "study.csv", std::cout);
  std::vector<std::string> files = {"study.nc", "study.csv"};
  const auto report = write_study_report(directory_, table_, m_.wanted);
  files.insert(files.end(), report.begin(), report.end());
  return files;
}

void copy_whole(const fs::path& from, const fs::path& to) {
  std::error_code ignored;
  if (fs::is_regular_file(from, ignored)) write_text_file(to, file_bytes(from));
}

}  // namespace

std::vector<std::string> table_columns(const StudyManifest& manifest,
                                       const std::vector<StudyQuantity>& quantities) {
  std::vector<std::string> names;
  for (const StudyAxis& axis : manifest.study.axes) names.push_back(axis.key);
  for (const StudyQuantity& q : quantities) {
    if (!in_table(q)) continue;
    for (std::size_t k = 0; k < q.values.size(); ++k) {
      names.push_back(column_name(manifest, q, k));
    }
  }
  return names;
}

StudyState study_state(const fs::path& directory, const StudyManifest& manifest,
                       const RunControl& control) {
  StudyState state;
  const fs::path folder = cases_folder(directory);
  for (std::size_t node = 0; node < manifest.hashes.size(); ++node) {
    control.check();
    if (read_case(folder, manifest.hashes[node])) {
      ++state.done;
    } else if (read_case_error(folder, manifest.hashes[node])) {
      ++state.failed;
    } else {
      state.missing.push_back(node);
    }
  }
  return state;
}

AssembledStudy assemble_study(const fs::path& directory, const StudyManifest& manifest,
                              const RunControl& control) {
  const fs::path folder = cases_folder(directory);
  AssembledStudy made;
  std::optional<Assembler> assembler;
  // Cases before the first that is done wait for it: it says what a case holds.
  std::vector<std::pair<std::size_t, std::string>> waiting;
  for (std::size_t node = 0; node < manifest.hashes.size(); ++node) {
    control.check();
    control.report("putting together",
                   static_cast<double>(node) / static_cast<double>(manifest.hashes.size()));
    const std::string& hash = manifest.hashes[node];
    const auto result = read_case(folder, hash);
    if (!result) {
      const auto error = read_case_error(folder, hash);
      ++(error ? made.failed : made.missing);
      const std::string why = error.value_or("not computed");
      if (assembler) {
        assembler->put_nothing(node, why);
      } else {
        waiting.emplace_back(node, why);
      }
      continue;
    }
    if (!assembler) {
      assembler.emplace(directory, manifest, *result);
      for (const auto& [earlier, why] : waiting) assembler->put_nothing(earlier, why);
    }
    ++made.done;
    assembler->put(node, *result);
  }
  if (!assembler) {
    throw std::runtime_error(fmt::format("{}: no case is done{}", directory.string(),
                                         waiting.empty() ? "" : ": " + waiting.front().second));
  }
  made.files = assembler->finish();
  return made;
}

std::size_t gather_cases(const fs::path& directory, const std::vector<fs::path>& others,
                         const StudyManifest& manifest, const RunControl& control) {
  std::size_t copied = 0;
  const fs::path own = cases_folder(directory);
  for (const fs::path& other : others) {
    if (read_manifest(other).hashes != manifest.hashes) {
      throw std::runtime_error(
          fmt::format("{}: is the folder of another study than {}: must have the same cases",
                      other.string(), directory.string()));
    }
    const fs::path theirs = cases_folder(other);
    for (const std::string& hash : manifest.hashes) {
      control.check();
      if (read_case(own, hash)) continue;
      const auto result = read_case(theirs, hash);
      if (!result) {
        copy_whole(case_error_file(theirs, hash), case_error_file(own, hash));
        continue;
      }
      // Pictures first: the case's own file says that all is there.
      copy_whole(case_picture_file(theirs, hash), case_picture_file(own, hash));
      copy_whole(case_exr_file(theirs, hash), case_exr_file(own, hash));
      copy_whole(case_file(theirs, hash), case_file(own, hash));
      ++copied;
    }
  }
  return copied;
}

}  // namespace twilight
