#include "atmosphere/uvspec_profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "atmosphere/line_reader.h"

namespace twilight {
namespace {

constexpr std::array<std::string_view, 9> kColumns = {"z",  "p",   "T",   "air", "O3",
                                                      "O2", "H2O", "CO2", "NO2"};
enum Column : std::size_t { kHeight, kPressure, kTemperature, kAir, kO3, kO2, kH2O, kCO2, kNO2 };
constexpr std::size_t kFewestColumns = 3;
constexpr std::size_t kMostLevels = 1000;

constexpr double kHighestKm = 200.0;
constexpr double kColdestK = 50.0, kHottestK = 2000.0;
constexpr double kBoltzmannHpaCm3PerK = 1.380649e-19;
// Above, air is no longer mixed and tables depart from the law: AFGL by up to 15 % at 120 km (2e-5
// below 80 km).
constexpr double kIdealGasUpToKm = 80.0;
constexpr double kIdealGasTolerance = 0.05;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

struct Row {
  std::vector<double> value;
  std::vector<std::string_view> text;

  double of(Column column) const { return column < value.size() ? value[column] : 0.0; }
};

Row read_row(const LineReader& line, std::size_t columns) {
  Row row;
  row.text = split_at_blanks(line.text().substr(0, line.text().find('#')));
  if (row.text.size() < kFewestColumns || row.text.size() > kColumns.size()) {
    line.fail("row has " + std::to_string(row.text.size()) + " columns: must have 3..9, " +
              "z (km), p (hPa), T (K), then air, O3, O2, H2O, CO2, NO2 (cm^-3)");
  }
  if (columns != 0 && row.text.size() != columns) {
    line.fail("row has " + std::to_string(row.text.size()) + " columns: must have " +
              std::to_string(columns) + ", as the rows before");
  }
  for (std::size_t c = 0; c < row.text.size(); ++c) {
    row.value.push_back(line.value(row.text[c], kColumns[c]));
  }
  return row;
}

void check_row(const LineReader& line, const Row& row, const ProfileLevel* above) {
  const auto fail = [&](Column column, const std::string& must_be) {
    line.fail(kColumns[column], row.text[column], must_be);
  };
  const double z = row.of(kHeight), p = row.of(kPressure), t = row.of(kTemperature);
  if (!(z >= 0.0 && z <= kHighestKm)) fail(kHeight, "0..200 km above sea level");
  if (!(p > 0.0)) fail(kPressure, "above 0 hPa");
  if (!(t >= kColdestK && t <= kHottestK)) fail(kTemperature, "50..2000 K");
  for (std::size_t c = kAir; c < row.value.size(); ++c) {
    if (!(row.value[c] >= 0.0)) fail(static_cast<Column>(c), "0 cm^-3 or above");
  }
  if (above != nullptr && !(z < above->height_km)) {
    fail(kHeight, "below the " + number(above->height_km) + " km of the level before: top first");
  }
  if (above != nullptr && !(p > above->pressure_hpa)) {
    fail(kPressure,
         "above the " + number(above->pressure_hpa) + " hPa of the level before, which is higher");
  }
  if (row.value.size() <= kAir) return;
  const double air = row.of(kAir), ideal = p / (kBoltzmannHpaCm3PerK * t);
  if (!(air > 0.0)) fail(kAir, "above 0 cm^-3");
  if (z <= kIdealGasUpToKm && std::abs(air - ideal) > kIdealGasTolerance * ideal) {
    fail(kAir, "within 5 % of p / (k T) = " + number(ideal) + " cm^-3");
  }
  for (const Column gas : {kO3, kO2, kH2O, kCO2, kNO2}) {
    if (row.of(gas) > air) fail(gas, "at most the air's " + number(air) + " cm^-3");
  }
}

}  // namespace

Profile read_uvspec_profile(const std::filesystem::path& file) {
  LineReader line(file, "profile");
  std::vector<ProfileLevel> levels;
  std::size_t columns = 0;
  std::string lowest;
  while (line.next()) {
    if (line.text().empty() || line.text().front() == '#') continue;
    const Row row = read_row(line, columns);
    columns = row.text.size();
    check_row(line, row, levels.empty() ? nullptr : &levels.back());
    const double air = columns > kAir
                           ? row.of(kAir)
                           : row.of(kPressure) / (kBoltzmannHpaCm3PerK * row.of(kTemperature));
    levels.push_back({row.of(kHeight), row.of(kPressure), row.of(kTemperature), air, row.of(kO3),
                      row.of(kH2O), row.of(kNO2)});
    lowest = row.text[kHeight];
    if (levels.size() > kMostLevels) line.fail("has more than 1000 levels");
  }
  if (levels.size() < 2) line.fail_file("has fewer than 2 levels");
  if (levels.back().height_km != 0.0) {
    line.fail("the last level, column 'z': value '" + lowest + "': must be 0 km, sea level");
  }
  if (levels.front().height_km < 1.0) {
    line.fail_file("column 'z': the first level, " + number(levels.front().height_km) +
                   " km: must be 1..200 km");
  }
  std::reverse(levels.begin(), levels.end());
  return Profile::of_levels(file.filename().string(), std::move(levels));
}

std::string uvspec_profile_text(const Profile& profile) {
  std::string text =
      "# z(km) p(hPa) T(K) air(cm-3) O3(cm-3) O2(cm-3) H2O(cm-3) CO2(cm-3) NO2(cm-3)\n";
  const auto levels = profile.levels();
  for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
    const double dry = level->air_per_cm3 - level->water_vapour_per_cm3;
    const double columns[] = {level->height_km,
                              level->pressure_hpa,
                              level->temperature_k,
                              level->air_per_cm3,
                              level->ozone_per_cm3,
                              0.2095 * dry,
                              level->water_vapour_per_cm3,
                              420e-6 * dry,
                              level->nitrogen_dioxide_per_cm3};
    for (const double value : columns) {
      char cell[40];
      std::snprintf(cell, sizeof cell, " %.17g", value);
      text += cell;
    }
    text += '\n';
  }
  return text;
}

}  // namespace twilight
