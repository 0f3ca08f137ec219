#include "atmosphere/optical_layers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include "atmosphere/csv_line.h"

namespace twilight {
namespace {

constexpr std::array<std::string_view, 7> kColumns = {"bottom_km",
                                                      "top_km",
                                                      "wavelength_nm",
                                                      "air_scattering_per_km",
                                                      "aerosol_scattering_per_km",
                                                      "aerosol_asymmetry",
                                                      "absorption_per_km"};
enum Column { kBottom, kTop, kWavelength, kAir, kAerosol, kAsymmetry, kAbsorption };

constexpr std::string_view kHeader =
    "bottom_km,top_km,wavelength_nm,air_scattering_per_km,aerosol_scattering_per_km,"
    "aerosol_asymmetry,absorption_per_km";
constexpr std::size_t kMostLayers = 500;
constexpr double kHighestKm = 500.0;
// A kilometre of cloud has 100; beyond, single precision and the forward peak give out.
constexpr double kLargestPerKm = 1000.0;
constexpr double kLargestAsymmetry = 0.999;
constexpr double kWavelengthToleranceNm = 1e-6;

struct Row {
  std::array<double, kColumns.size()> value;
  std::array<std::string, kColumns.size()> text;
  std::size_t line;
};

struct Block {
  double wavelength_nm;
  std::vector<Row> rows;
};

std::string number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : name_(file.string()) {
    std::error_code ignored;
    std::ifstream in(file);
    if (!in || std::filesystem::is_directory(file, ignored)) {
      throw std::runtime_error("cannot read optical layers file '" + name_ + "'");
    }
    bool header_seen = false;
    std::string line;
    for (std::size_t n = 1; std::getline(in, line); ++n) {
      std::string_view text = line;
      if (n == 1 && text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
      text = trimmed(text);
      if (text.empty() || text.front() == '#') continue;
      if (!header_seen) {
        if (text != kHeader) {
          fail(n, "header '" + std::string(text) + "' must be '" + std::string(kHeader) + "'");
        }
        header_seen = true;
        continue;
      }
      add(parse(text, n));
    }
    if (in.bad())
      throw std::runtime_error("error while reading optical layers file '" + name_ + "'");
    if (!header_seen) {
      throw std::invalid_argument(name_ + ": file is empty: must begin with the header '" +
                                  std::string(kHeader) + "'");
    }
    if (blocks_.empty()) {
      throw std::invalid_argument(name_ + ": file has no rows: must have at least one layer");
    }
    end_block();
    std::sort(blocks_.begin(), blocks_.end(),
              [](const Block& a, const Block& b) { return a.wavelength_nm < b.wavelength_nm; });
  }

  const std::vector<Block>& blocks() const { return blocks_; }
  const std::string& name() const { return name_; }

 private:
  [[noreturn]] void fail(std::size_t line, const std::string& what) const {
    throw std::invalid_argument(name_ + ":" + std::to_string(line) + ": " + what);
  }
  [[noreturn]] void fail(const Row& row, Column column, const std::string& must_be) const {
    fail(row.line, "column '" + std::string(kColumns[column]) + "': value '" + row.text[column] +
                       "': must be " + must_be);
  }

  Row parse(std::string_view text, std::size_t line) const {
    Row row{};
    row.line = line;
    const std::vector<std::string_view> cells = split_at_commas(text);
    if (cells.size() != kColumns.size()) {
      fail(line, "row has " + std::to_string(cells.size()) + " columns: must be " +
                     std::to_string(kColumns.size()));
    }
    for (std::size_t c = 0; c < kColumns.size(); ++c) {
      const std::string_view cell = cells[c];
      row.text[c] = std::string(cell);
      const char* end = cell.data() + cell.size();
      const auto [stop, problem] = std::from_chars(cell.data(), end, row.value[c]);
      const auto column = static_cast<Column>(c);
      if (cell.empty() || problem != std::errc{} || stop != end || !std::isfinite(row.value[c])) {
        fail(row, column, "a finite number");
      }
      const double v = row.value[c];
      const bool height = column == kTop || column == kBottom;
      if (column == kAsymmetry                      ? !(std::abs(v) <= kLargestAsymmetry)
          : column == kWavelength || column == kTop ? !(v > 0.0)
          : height                                  ? !(v >= 0.0)
                                                    : !(v >= 0.0 && v <= kLargestPerKm)) {
        fail(row, column,
             column == kAsymmetry                      ? "-0.999..0.999"
             : column == kWavelength || column == kTop ? "above 0"
             : height                                  ? "0 or above"
                                                       : "0..1000 per km");
      }
    }
    if (!(row.value[kTop] > row.value[kBottom])) {
      fail(row, kTop, "above the layer's bottom " + number(row.value[kBottom]) + " km");
    }
    if (row.value[kTop] > kHighestKm) fail(row, kTop, "at most " + number(kHighestKm) + " km");
    return row;
  }

  void add(const Row& row) {
    const double wavelength_nm = row.value[kWavelength];
    if (blocks_.empty() || blocks_.back().wavelength_nm != wavelength_nm) {
      if (!blocks_.empty()) end_block();
      for (const Block& block : blocks_) {
        if (std::abs(block.wavelength_nm - wavelength_nm) <= 2.0 * kWavelengthToleranceNm) {
          fail(row, kWavelength,
               "in one block of rows only; a block of " + number(block.wavelength_nm) +
                   " nm came before");
        }
      }
      blocks_.push_back({wavelength_nm, {}});
    }
    std::vector<Row>& rows = blocks_.back().rows;
    const double expected_km = rows.empty() ? 0.0 : rows.back().value[kTop];
    if (row.value[kBottom] != expected_km) {
      fail(row, kBottom,
           rows.empty() ? "0, the ground: the lowest layer comes first"
                        : number(expected_km) + ", the top of the layer below: no gap, no overlap");
    }
    if (blocks_.size() > 1) {
      const std::vector<Row>& first = blocks_.front().rows;
      if (rows.size() >= first.size()) {
        fail(row, kBottom,
             "within the " + std::to_string(first.size()) + " layers of the block of " +
                 number(blocks_.front().wavelength_nm) + " nm");
      }
      if (row.value[kTop] != first[rows.size()].value[kTop]) {
        fail(row, kTop,
             number(first[rows.size()].value[kTop]) + ", as in the block of " +
                 number(blocks_.front().wavelength_nm) + " nm");
      }
    }
    rows.push_back(row);
    if (rows.size() > kMostLayers) {
      fail(row, kTop, "within the first " + std::to_string(kMostLayers) + " layers");
    }
  }

  void end_block() const {
    const Block& first = blocks_.front();
    const Block& last = blocks_.back();
    if (last.rows.size() != first.rows.size()) {
      fail(last.rows.back(), kTop,
           "followed by more layers, up to " + number(first.rows.back().value[kTop]) +
               " km as in the block of " + number(first.wavelength_nm) + " nm");
    }
  }

  std::string name_;
  std::vector<Block> blocks_;
};

}  // namespace

Medium read_optical_layers(const std::filesystem::path& file, double earth_radius_km,
                           std::span<const double> wavelength_nm_wanted, double depolarisation) {
  if (!(earth_radius_km >= 1000.0 && earth_radius_km <= 70000.0)) {
    throw std::invalid_argument("earth_radius_km " + number(earth_radius_km) +
                                " must be 1000..70000");
  }
  if (!(depolarisation >= 0.0 && depolarisation < 6.0 / 7.0)) {
    throw std::invalid_argument("depolarisation " + number(depolarisation) +
                                " must be within [0, 6/7)");
  }
  const Reader reader(file);

  std::vector<const Block*> chosen;
  for (const Block& block : reader.blocks()) {
    if (wavelength_nm_wanted.empty()) chosen.push_back(&block);
  }
  double last_nm = 0.0;
  for (const double wanted : wavelength_nm_wanted) {
    if (!(wanted > last_nm)) {
      throw std::invalid_argument("wavelength " + number(wanted) +
                                  " nm must be above the one before it");
    }
    last_nm = wanted;
    const auto found =
        std::find_if(reader.blocks().begin(), reader.blocks().end(), [&](const Block& block) {
          return std::abs(block.wavelength_nm - wanted) <= kWavelengthToleranceNm;
        });
    if (found == reader.blocks().end()) {
      std::string there;
      for (const Block& block : reader.blocks()) {
        there += (there.empty() ? "" : ", ") + number(block.wavelength_nm);
      }
      throw std::invalid_argument(reader.name() + ": column 'wavelength_nm': wanted value '" +
                                  number(wanted) + "': must be one of " + there);
    }
    chosen.push_back(&*found);
  }

  Medium medium;
  medium.earth_radius_km = earth_radius_km;
  medium.boundary_km.push_back(0.0);
  for (const Row& row : chosen.front()->rows) medium.boundary_km.push_back(row.value[kTop]);
  for (std::size_t w = 0; w < chosen.size(); ++w) {
    medium.wavelength_nm.push_back(wavelength_nm_wanted.empty() ? chosen[w]->wavelength_nm
                                                                : wavelength_nm_wanted[w]);
  }
  medium.zero_tables();
  for (std::size_t w = 0; w < chosen.size(); ++w) {
    medium.depolarisation.push_back(depolarisation);
    for (std::size_t i = 0; i < medium.layers(); ++i) {
      const auto& value = chosen[w]->rows[i].value;
      medium.air_scattering_per_km(i, w) = value[kAir];
      medium.aerosol_scattering_per_km(i, w) = value[kAerosol];
      medium.aerosol_asymmetry(i, w) = value[kAsymmetry];
      medium.gas_absorption_per_km(i, w) = value[kAbsorption];
    }
  }
  return medium;
}

std::vector<double> optical_layer_wavelengths(const std::filesystem::path& file) {
  const Reader reader(file);
  std::vector<double> wavelength_nm;
  for (const Block& block : reader.blocks()) wavelength_nm.push_back(block.wavelength_nm);
  return wavelength_nm;
}

}  // namespace twilight
