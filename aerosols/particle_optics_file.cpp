#include "aerosols/particle_optics_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "aerosols/imported_phase.h"
#include "aerosols/libradtran_optics.h"
#include "aerosols/opac_optdat.h"
#include "aerosols/optics_units.h"
#include "atmosphere/csv_line.h"
#include "atmosphere/line_reader.h"
#include "atmosphere/netcdf_reader.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr std::string_view kHumidities[] = {"00", "50", "70", "80", "90", "95", "98", "99"};

std::optional<OpticsPer> optics_per(std::string_view text) {
  for (const OpticsPer per :
       {OpticsPer::kParticlePerCm3, OpticsPer::kMicrogramPerM3, OpticsPer::kExtinctionAt550nm}) {
    if (optics_per_text(per) == text) return per;
  }
  return std::nullopt;
}

void require_unit(const NetcdfReader& file, std::string_view variable, std::string_view unit) {
  const std::string held = file.required_text(variable, "units");
  if (held != unit) {
    file.refuse_variable(variable,
                         "has the unit '" + held + "': must be '" + std::string(unit) + "'");
  }
}

ParticleOptics read_own_netcdf(const NetcdfReader& file) {
  ParticleOptics optics;
  optics.name = file.required_text("", "particles");
  const std::string per = file.required_text("", "coefficients_per");
  const auto known = optics_per(per);
  if (!known) file.refuse("global attribute 'coefficients_per' = '" + per + "' is unknown");
  optics.per = *known;
  optics.dry_mass_ug_per_m3 = file.number_attribute("", "dry_mass_ug_per_m3").value_or(0.0);
  require_unit(file, "relative_humidity", "percent");
  require_unit(file, "wavelength", "nm");
  using Names = std::vector<std::string>;
  optics.relative_humidity_percent = file.numbers("relative_humidity", Names{"relative_humidity"});
  optics.wavelength_nm = file.numbers("wavelength", Names{"wavelength"});
  const Names state = {"relative_humidity", "wavelength"};
  for (const char* name : {"scattering_coefficient", "absorption_coefficient"}) {
    require_unit(file, name, coefficient_unit_text(optics.per));
  }
  const auto scattering = file.numbers("scattering_coefficient", state);
  const auto absorption = file.numbers("absorption_coefficient", state);
  const auto asymmetry = file.numbers("asymmetry_factor", state);
  for (std::size_t i = 0; i < scattering.size(); ++i) {
    optics.optics.push_back({.scattering_per_km = scattering[i],
                             .absorption_per_km = absorption[i],
                             .asymmetry = asymmetry[i]});
  }
  if (!file.has_variable("p11")) return optics;
  require_unit(file, "scattering_angle", "degree");
  std::vector<double> angle_rad = file.numbers("scattering_angle", Names{"scattering_angle"});
  for (double& angle : angle_rad) angle *= kRadPerDeg;
  const Names whole = {"relative_humidity", "wavelength", "scattering_angle"};
  const std::array<std::vector<double>, 4> elements = {
      file.numbers("p11", whole), file.numbers("p12", whole), file.numbers("p33", whole),
      file.numbers("p34", whole)};
  const std::size_t angles = angle_rad.size();
  for (std::size_t i = 0; i < scattering.size(); ++i) {
    const auto part = [&](const std::vector<double>& all) {
      const auto start = all.begin() + static_cast<std::ptrdiff_t>(i * angles);
      return std::vector<double>(start, start + static_cast<std::ptrdiff_t>(angles));
    };
    optics.phase.push_back({.angle_rad = angle_rad,
                            .p11 = part(elements[0]),
                            .p12 = part(elements[1]),
                            .p33 = part(elements[2]),
                            .p34 = part(elements[3])});
    normalise_imported(optics.phase.back(), [&](std::string_view element, const std::string& what) {
      file.refuse_variable(element == "angle" ? "scattering_angle" : element, what);
    });
  }
  return optics;
}

// Our CSV: one row per humidity, wavelength and angle, or per humidity and wavelength alone.
class OwnCsv {
 public:
  explicit OwnCsv(const std::filesystem::path& path) : line_(path, "particle optics") {}

  ParticleOptics read() {
    read_head();
    while (line_.next()) {
      if (line_.text().empty() || line_.text().front() == '#') continue;
      read_row();
    }
    end_state();
    if (states_ == 0) line_.fail_file("has no rows");
    const std::size_t all = optics_.relative_humidity_percent.size() * optics_.wavelength_nm.size();
    if (states_ != all) {
      line_.fail_file("has " + std::to_string(states_) +
                      " blocks of one humidity and wavelength: " + "must have " +
                      std::to_string(all) + ", every wavelength at every humidity");
    }
    return std::move(optics_);
  }

 private:
  void read_head() {
    bool per_seen = false;
    while (line_.next()) {
      std::string_view text = line_.text();
      if (text.empty()) continue;
      if (text.front() != '#') break;
      text = trimmed(text.substr(1));
      const std::size_t equals = text.find('=');
      if (equals == std::string_view::npos) continue;
      const std::string_view name = trimmed(text.substr(0, equals));
      const std::string_view value = trimmed(text.substr(equals + 1));
      if (name == "particles") optics_.name = value;
      if (name == "dry_mass_ug_per_m3") optics_.dry_mass_ug_per_m3 = line_.value(value, name);
      if (name == "coefficients_per") {
        const auto per = optics_per(value);
        if (!per) line_.fail(name, value, "a known kind, as 'particle cm-3'");
        optics_.per = *per;
        per_seen = true;
      }
    }
    if (!per_seen) line_.fail_file("lacks the line '# coefficients_per = ...'");
    if (line_.text() != kParticleOpticsColumns) {
      line_.fail("header '" + std::string(line_.text()) + "' must be '" +
                 std::string(kParticleOpticsColumns) + "'");
    }
  }

  void read_row() {
    const auto cells = split_at_commas(line_.text());
    static const std::vector<std::string_view> kNames = split_at_commas(kParticleOpticsColumns);
    if (cells.size() != kNames.size()) {
      line_.fail("row has " + std::to_string(cells.size()) + " columns: must have 10");
    }
    constexpr std::size_t kStateColumns = 5;
    std::array<double, 10> v{};
    const bool angle = !cells[kStateColumns].empty();
    for (std::size_t c = 0; c < (angle ? v.size() : kStateColumns); ++c) {
      v[c] = line_.value(cells[c], kNames[c]);
    }
    for (std::size_t c = kStateColumns; !angle && c < v.size(); ++c) {
      if (!cells[c].empty()) line_.fail(kNames[c], cells[c], "empty where there is no angle");
    }
    const std::array<double, 5> state = {v[0], v[1], v[2], v[3], v[4]};
    if (states_ == 0 || state[0] != state_[0] || state[1] != state_[1]) {
      begin_state(state, cells);
    } else if (state != state_ || !angle || phase_.angle_rad.empty()) {
      line_.fail(
          "row repeats the humidity and wavelength of the row before: must be another angle "
          "with the same coefficients");
    }
    if (!angle) return;
    if (!(v[5] >= 0.0 && v[5] <= 180.0)) line_.fail(kNames[5], cells[5], "0..180 degrees");
    if (!phase_.angle_rad.empty() && !(v[5] * kRadPerDeg > phase_.angle_rad.back())) {
      line_.fail(kNames[5], cells[5], "above the one before");
    }
    phase_.angle_rad.push_back(v[5] * kRadPerDeg);
    phase_.p11.push_back(v[6]);
    phase_.p12.push_back(v[7]);
    phase_.p33.push_back(v[8]);
    phase_.p34.push_back(v[9]);
  }

  void begin_state(const std::array<double, 5>& state, const std::vector<std::string_view>& cells) {
    end_state();
    std::vector<double>& humidity = optics_.relative_humidity_percent;
    std::vector<double>& wavelength = optics_.wavelength_nm;
    if (!(state[0] >= 0.0 && state[0] <= 99.0)) {
      line_.fail("relative_humidity_percent", cells[0], "0..99");
    }
    if (humidity.empty() || state[0] != humidity.back()) {
      if (!humidity.empty() && !(state[0] > humidity.back())) {
        line_.fail("relative_humidity_percent", cells[0], "above the one before");
      }
      humidity.push_back(state[0]);
      next_wavelength_ = 0;
    }
    if (humidity.size() == 1) {
      if (!(state[1] > (wavelength.empty() ? 0.0 : wavelength.back()))) {
        line_.fail("wavelength_nm", cells[1], "above 0 and the one before");
      }
      wavelength.push_back(state[1]);
    } else if (next_wavelength_ >= wavelength.size() || state[1] != wavelength[next_wavelength_]) {
      line_.fail("wavelength_nm", cells[1], "as at the first humidity");
    }
    ++next_wavelength_;
    for (const std::size_t c : {std::size_t{2}, std::size_t{3}}) {
      if (!(state[c] >= 0.0)) {
        line_.fail(c == 2 ? "scattering_per_km" : "absorption_per_km", cells[c], "0 or above");
      }
    }
    if (!(std::abs(state[4]) < 1.0)) line_.fail("asymmetry", cells[4], "within (-1, 1)");
    optics_.optics.push_back(
        {.scattering_per_km = state[2], .absorption_per_km = state[3], .asymmetry = state[4]});
    state_ = state;
    ++states_;
  }

  void end_state() {
    if (phase_.angle_rad.empty()) return;
    normalise_imported(phase_, [&](std::string_view element, const std::string& what) {
      const std::string column = element == "angle" ? "angle_deg" : std::string(element);
      line_.fail("the block that ends before here, column '" + column + "': " + what);
    });
    optics_.phase.push_back(std::move(phase_));
    phase_ = {};
  }

  LineReader line_;
  ParticleOptics optics_;
  PhaseMatrix phase_;
  std::array<double, 5> state_{};
  std::size_t states_ = 0, next_wavelength_ = 0;
};

// The files of one OPAC component, or none.
std::vector<std::filesystem::path> opac_files(const std::filesystem::path& stem) {
  std::vector<std::filesystem::path> files;
  if (!stem.has_filename()) return files;
  for (const std::string_view humidity : kHumidities) {
    std::filesystem::path file = stem;
    file += humidity;
    if (std::filesystem::is_regular_file(file)) files.push_back(std::move(file));
  }
  return files;
}

ParticleOptics read_text(const std::filesystem::path& path) {
  LineReader line(path, "particle optics");
  if (!line.next()) line.fail_file("is empty");
  if (line.text().find(kParticleOpticsFormat) != std::string_view::npos) {
    ParticleOptics optics = OwnCsv(path).read();
    require_particle_optics(optics, path.string());
    return optics;
  }
  do {
    if (line.text().find("ext.coef") != std::string_view::npos) return read_opac_optdat(path);
  } while (line.text().starts_with('#') && line.next());
  line.fail(
      "is no file of particle optics: must be an OPAC component with the columns 'wavelength "
      "ext.coef ...', netCDF of libRadtran or MOPSMAP, or an export of this program");
}

}  // namespace

std::string_view optics_per_text(OpticsPer per) {
  switch (per) {
    case OpticsPer::kParticlePerCm3:
      return "particle cm-3";
    case OpticsPer::kMicrogramPerM3:
      return "microgram m-3 of dry matter";
    case OpticsPer::kExtinctionAt550nm:
      return "extinction of 1 km-1 at 550 nm";
  }
  return "";
}

ParticleOptics read_particle_optics(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) {
    const auto files = opac_files(path);
    if (files.empty()) {
      throw std::runtime_error("cannot read particle optics file '" + path.string() +
                               "': there is none");
    }
    std::vector<ParticleOptics> tables;
    for (const auto& file : files) tables.push_back(read_opac_optdat(file));
    return joined_humidities(std::move(tables), path.string());
  }
  std::array<char, 4> start{};
  std::ifstream(path, std::ios::binary).read(start.data(), start.size());
  const std::string_view magic(start.data(), start.size());
  if (!magic.starts_with("CDF") && magic != "\x89HDF") return read_text(path);
  const NetcdfReader file(path, "particle optics");
  if (is_libradtran_optics(file)) return read_libradtran_optics(file);
  if (file.text_attribute("", "format") == kParticleOpticsFormat) {
    ParticleOptics optics = read_own_netcdf(file);
    require_particle_optics(optics, file.name());
    return optics;
  }
  file.refuse(
      "is no file of particle optics: must have the variables wavelen, ext, ssa (libRadtran, "
      "MOPSMAP) or the global attribute format = '" +
      std::string(kParticleOpticsFormat) + "'");
}

}  // namespace twilight
