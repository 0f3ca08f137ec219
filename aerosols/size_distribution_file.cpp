#include "aerosols/size_distribution_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>

#include "aerosols/component_mie.h"
#include "aerosols/component_phase.h"
#include "atmosphere/csv_line.h"
#include "atmosphere/line_reader.h"

namespace twilight {
namespace {

constexpr double kSmallestRadius_um = 1e-3, kLargestRadius_um = 100.0;
constexpr double kLargestVolume = 1e6;
constexpr double kMissing = -999.0;  // AERONET's
constexpr std::string_view kPlainHeader = "radius_um,dV_dlnr";

double sphere_volume(double radius_um) {
  return 4.0 / 3.0 * std::numbers::pi * radius_um * radius_um * radius_um;
}

// dV/d ln r at a radius.
double volume_at(const std::vector<double>& radius, const std::vector<double>& volume, double r) {
  const auto above = std::ranges::upper_bound(radius, r);
  if (above == radius.begin()) return 0.0;
  if (above == radius.end()) return r == radius.back() ? volume.back() : 0.0;
  const auto i = static_cast<std::size_t>(above - radius.begin());
  const double t = std::log(r / radius[i - 1]) / std::log(radius[i] / radius[i - 1]);
  return std::lerp(volume[i - 1], volume[i], t);
}

void check(const VolumeSizeDistribution& sizes) {
  if (sizes.radius_um.size() < 2 || sizes.radius_um.size() != sizes.volume_um3_per_um2.size() ||
      !std::ranges::is_sorted(sizes.radius_um, std::less_equal<>()) ||
      !(sizes.radius_um.front() > 0.0)) {
    throw std::invalid_argument("a size distribution must have two or more rising radii");
  }
}

std::optional<double> radius_of(std::string_view column) {
  double value = 0.0;
  const char* const end = column.data() + column.size();
  const auto [stop, problem] = std::from_chars(column.data(), end, value);
  if (column.empty() || problem != std::errc{} || stop != end) return std::nullopt;
  return value;
}

class Reader {
 public:
  explicit Reader(const std::filesystem::path& file) : line_(file, "size distribution") {}

  std::vector<VolumeSizeDistribution> read() {
    if (read_header()) {
      read_plain();
    } else {
      while (line_.next()) {
        if (!line_.text().empty()) read_retrieval();
      }
    }
    if (rows_.empty()) line_.fail_file("has no size distribution");
    return std::move(rows_);
  }

 private:
  // True for the plain format.
  bool read_header() {
    while (line_.next()) {
      const std::string_view text = line_.text();
      if (text.empty() || text.front() == '#') continue;
      if (text == kPlainHeader) return true;
      const auto cells = split_at_commas(text);
      const auto starts = [&](std::string_view name) {
        return std::ranges::find_if(cells, [&](std::string_view c) { return c.starts_with(name); });
      };
      const auto date = starts("Date("), time = starts("Time(");
      if (date == cells.end() || time == cells.end()) continue;  // a line of title
      date_ = static_cast<std::size_t>(date - cells.begin());
      time_ = static_cast<std::size_t>(time - cells.begin());
      columns_ = cells.size();
      read_radii(cells);
      return false;
    }
    line_.fail_file("has no header: must be '" + std::string(kPlainHeader) +
                    "' or AERONET's with Date(...), Time(...) and radii");
  }

  void read_radii(const std::vector<std::string_view>& cells) {
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const auto radius = radius_of(cells[c]);
      if (!radius) continue;
      check_radius(*radius, "header", cells[c]);
      radius_um_.push_back(*radius);
      radius_column_.push_back(c);
      radius_name_.emplace_back(cells[c]);
    }
    if (radius_um_.size() < 2) line_.fail("header has fewer than 2 columns named by a radius");
  }

  void check_radius(double radius, std::string_view column, std::string_view cell) const {
    if (!(radius >= kSmallestRadius_um && radius <= kLargestRadius_um)) {
      line_.fail(column, cell, "a radius of 0.001..100 um");
    }
    if (!radius_um_.empty() && !(radius > radius_um_.back())) {
      line_.fail(column, cell, "above the radius before");
    }
  }

  void check_volume(double volume, std::string_view column, std::string_view cell) const {
    if (!(volume >= 0.0 && volume <= kLargestVolume)) {
      line_.fail(column, cell, "0..1e6 um^3 um^-2");
    }
  }

  void read_plain() {
    VolumeSizeDistribution sizes;
    while (line_.next()) {
      if (line_.text().empty() || line_.text().front() == '#') continue;
      const auto cells = split_at_commas(line_.text());
      if (cells.size() != 2) {
        line_.fail("row has " + std::to_string(cells.size()) + " columns: must have 2");
      }
      const double radius = line_.value(cells[0], "radius_um");
      check_radius(radius, "radius_um", cells[0]);
      const double volume = line_.value(cells[1], "dV_dlnr");
      check_volume(volume, "dV_dlnr", cells[1]);
      radius_um_.push_back(radius);
      sizes.volume_um3_per_um2.push_back(volume);
    }
    if (radius_um_.size() < 2) line_.fail_file("has fewer than 2 radii");
    sizes.radius_um = radius_um_;
    require_particles(sizes);
    rows_.push_back(std::move(sizes));
  }

  void read_retrieval() {
    const auto cells = split_at_commas(line_.text());
    if (cells.size() != columns_) {
      line_.fail("row has " + std::to_string(cells.size()) + " columns: must have " +
                 std::to_string(columns_) + ", as the header");
    }
    VolumeSizeDistribution sizes;
    sizes.when = std::string(cells[date_]) + " " + std::string(cells[time_]);
    sizes.radius_um = radius_um_;
    for (std::size_t i = 0; i < radius_column_.size(); ++i) {
      const std::string_view cell = cells[radius_column_[i]];
      if (cell == "N/A") return;
      const double volume = line_.value(cell, radius_name_[i]);
      if (volume == kMissing) return;
      check_volume(volume, radius_name_[i], cell);
      sizes.volume_um3_per_um2.push_back(volume);
    }
    require_particles(sizes);
    rows_.push_back(std::move(sizes));
  }

  void require_particles(const VolumeSizeDistribution& sizes) const {
    if (std::ranges::any_of(sizes.volume_um3_per_um2, [](double v) { return v > 0.0; })) return;
    line_.fail("the size distribution holds no particles: every dV/d ln r is 0");
  }

  LineReader line_;
  std::vector<VolumeSizeDistribution> rows_;
  std::vector<double> radius_um_;
  std::vector<std::size_t> radius_column_;
  std::vector<std::string> radius_name_;
  std::size_t date_ = 0, time_ = 0, columns_ = 0;
};

VolumeSizeDistribution mean(const std::vector<VolumeSizeDistribution>& rows) {
  VolumeSizeDistribution sum = rows.front();
  for (std::size_t k = 1; k < rows.size(); ++k) {
    for (std::size_t i = 0; i < sum.volume_um3_per_um2.size(); ++i) {
      sum.volume_um3_per_um2[i] += rows[k].volume_um3_per_um2[i];
    }
  }
  for (double& v : sum.volume_um3_per_um2) v /= static_cast<double>(rows.size());
  if (rows.size() > 1) sum.when = "average of " + std::to_string(rows.size());
  return sum;
}

}  // namespace

SizeDistribution VolumeSizeDistribution::per_um2() const {
  check(*this);
  return {[radius = radius_um, volume = volume_um3_per_um2](double r) {
            return volume_at(radius, volume, r) / sphere_volume(r);
          },
          radius_um.front(), radius_um.back()};
}

SizeDistribution VolumeSizeDistribution::per_particle() const {
  const double number = number_per_um2();
  if (!(number > 0.0)) throw std::invalid_argument("the size distribution holds no particles");
  SizeDistribution all = per_um2();
  const auto density = std::move(all.per_log_radius);
  all.per_log_radius = [density, number](double r) { return density(r) / number; };
  return all;
}

double VolumeSizeDistribution::number_per_um2() const {
  check(*this);
  // Of (a + b u) exp(-3 u) over u = 0..d, u = ln(r / r_i), divided by the volume at r_i.
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < radius_um.size(); ++i) {
    const double d = std::log(radius_um[i + 1] / radius_um[i]);
    const double a = volume_um3_per_um2[i], b = (volume_um3_per_um2[i + 1] - a) / d;
    const double e = std::exp(-3.0 * d);
    sum += (a * (-std::expm1(-3.0 * d)) / 3.0 + b * (1.0 - e * (1.0 + 3.0 * d)) / 9.0) /
           sphere_volume(radius_um[i]);
  }
  return sum;
}

double VolumeSizeDistribution::volume_um() const {
  check(*this);
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < radius_um.size(); ++i) {
    sum += 0.5 * (volume_um3_per_um2[i] + volume_um3_per_um2[i + 1]) *
           std::log(radius_um[i + 1] / radius_um[i]);
  }
  return sum;
}

std::vector<VolumeSizeDistribution> read_size_distributions(const std::filesystem::path& file) {
  return Reader(file).read();
}

VolumeSizeDistribution read_size_distribution(const std::filesystem::path& file,
                                              std::string_view row) {
  const auto rows = read_size_distributions(file);
  if (row == "average") return mean(rows);
  std::size_t number = 0;
  const char* const end = row.data() + row.size();
  const auto [stop, problem] = std::from_chars(row.data(), end, number);
  if (problem == std::errc{} && stop == end) {
    if (number >= 1 && number <= rows.size()) return rows[number - 1];
    throw std::invalid_argument(file.string() + ": row '" + std::string(row) + "': must be 1.." +
                                std::to_string(rows.size()));
  }
  std::vector<VolumeSizeDistribution> found;
  for (const VolumeSizeDistribution& r : rows) {
    const bool whole = r.when == row;
    const bool date =
        r.when.size() > row.size() && r.when.starts_with(row) && r.when[row.size()] == ' ';
    if (!row.empty() && (whole || date)) found.push_back(r);
  }
  if (found.empty()) {
    throw std::invalid_argument(file.string() + ": row '" + std::string(row) +
                                "': must be 'average', 1.." + std::to_string(rows.size()) +
                                " or the date and time of a row, as '" + rows.front().when + "'");
  }
  return mean(found);
}

ParticleOptics optics_of_sizes(const VolumeSizeDistribution& sizes, std::string name,
                               std::span<const double> wavelength_nm,
                               std::span<const std::complex<double>> index) {
  if (wavelength_nm.empty() || index.size() != wavelength_nm.size()) {
    throw std::invalid_argument("optics of sizes need one refractive index for each wavelength, " +
                                std::to_string(index.size()) + " given for " +
                                std::to_string(wavelength_nm.size()));
  }
  if (!std::ranges::is_sorted(wavelength_nm, std::less_equal<>())) {
    throw std::invalid_argument("wavelengths must be strictly increasing");
  }
  ParticleOptics optics;
  optics.name = std::move(name);
  optics.relative_humidity_percent = {0.0};
  optics.wavelength_nm.assign(wavelength_nm.begin(), wavelength_nm.end());
  const SizeDistribution particle = sizes.per_particle();
  std::vector<SpheresAtWavelength> spheres;
  for (std::size_t w = 0; w < index.size(); ++w) {
    optics.optics.push_back(
        integrate_spheres(particle, index[w], wavelength_nm[w], kMeasuredRadiiPerEfold));
    spheres.push_back({particle, index[w], wavelength_nm[w], kMeasuredRadiiPerEfold});
  }
  optics.phase = sphere_phases(spheres);
  return optics;
}

double column_optical_depth(const VolumeSizeDistribution& sizes, double wavelength_nm,
                            std::complex<double> index) {
  // integrate_spheres() takes um^2 cm^-3 to km^-1; um^2 um^-2 is an optical depth as it stands.
  constexpr double kPerKmPerSquareUm = 1e-3;
  return integrate_spheres(sizes.per_um2(), index, wavelength_nm, kMeasuredRadiiPerEfold)
             .extinction_per_km() /
         kPerKmPerSquareUm;
}

}  // namespace twilight
