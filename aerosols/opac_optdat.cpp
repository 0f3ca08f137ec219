#include "aerosols/opac_optdat.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "aerosols/imported_phase.h"
#include "aerosols/optics_units.h"
#include "atmosphere/csv_line.h"
#include "atmosphere/line_reader.h"

namespace twilight {
namespace {

constexpr std::array<std::string_view, 9> kColumns = {"wavelength", "ext.coef",  "sca.coef",
                                                      "abs.coef",   "si.sc.alb", "asym.par",
                                                      "ext.nor",    "ref.real",  "ref.imag"};
enum Column : std::size_t {
  kWavelength,
  kExtinction,
  kScattering,
  kAbsorption,
  kAlbedo,
  kAsymmetry
};

// Files print four digits of each column.
constexpr double kSumTolerance = 0.01;
constexpr double kAlbedoTolerance = 0.01;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

class OptdatReader {
 public:
  explicit OptdatReader(const std::filesystem::path& file) : line_(file, "OPAC component") {
    const std::string stem = file.filename().string();
    optics_.name = stem;
    if (stem.size() >= 2 && std::isdigit(static_cast<unsigned char>(stem[stem.size() - 1])) &&
        std::isdigit(static_cast<unsigned char>(stem[stem.size() - 2]))) {
      humidity_ = std::stod(stem.substr(stem.size() - 2));
    }
  }

  ParticleOptics read() {
    read_title();
    find("ext.coef", "the table of coefficients, '# wavelength ext.coef ...'");
    read_units();
    read_coefficients();
    find("volume phase function", "'# volume phase function [1/km]:'");
    if (line_.text().find("[1/km]") == std::string_view::npos) {
      line_.fail("unit of the volume phase function must be [1/km]");
    }
    find("wavelengths", "'# sca.ang. | wavelengths --->'");
    read_phase_wavelengths();
    read_phase_rows();
    finish();
    return std::move(optics_);
  }

 private:
  // The words of a comment line without its '#'.
  std::vector<std::string_view> comment_words() const {
    std::string_view text = line_.text();
    if (text.starts_with('#')) text.remove_prefix(1);
    return split_at_blanks(text);
  }

  void require_next(const std::string& wanted) {
    if (!line_.next()) line_.fail_file("ends before " + wanted);
  }

  void find(std::string_view part, const std::string& wanted) {
    do {
      require_next(wanted);
      if (!line_.text().empty() && !line_.text().starts_with('#')) {
        line_.fail("must be a comment line: before " + wanted);
      }
    } while (line_.text().find(part) == std::string_view::npos);
  }

  void read_title() {
    require_next("its title");
    if (!line_.text().starts_with('#')) line_.fail("must be a title, '# component (humidity%)'");
    std::string_view title = trimmed(line_.text().substr(1));
    const std::size_t open = title.find('('), percent = title.find('%');
    if (open != std::string_view::npos && percent != std::string_view::npos && open < percent) {
      humidity_ = line_.value(trimmed(title.substr(open + 1, percent - open - 1)), "humidity");
    }
    if (!(humidity_ >= 0.0 && humidity_ <= 99.0)) {
      line_.fail("humidity", std::to_string(humidity_), "0..99 %");
    }
    title = trimmed(title.substr(0, open));
    if (!title.empty()) optics_.name = title;
    optics_.relative_humidity_percent = {humidity_};
  }

  void read_units() {
    require_next("the units of the table");
    const auto units = comment_words();
    if (units.size() != 4) line_.fail("must be the units '# [um] [1/km] [1/km] [1/km]'");
    const auto length = nm_in(units[0]);
    if (!length) line_.fail("wavelength", units[0], "a known unit, as [um]");
    nm_ = *length;
    for (std::size_t c = kExtinction; c <= kAbsorption; ++c) {
      const auto unit = coefficient_unit(units[c]);
      if (!unit || unit->per != OpticsPer::kExtinctionAt550nm) {
        line_.fail(kColumns[c], units[c], "a known unit, as [1/km]");
      }
      per_km_[c] = unit->per_km;
    }
  }

  void read_coefficients() {
    for (;;) {
      require_next("the end of the table of coefficients");
      const auto words = comment_words();
      if (words.empty() && optics_.optics.empty()) continue;
      if (words.empty()) return;
      if (!line_.text().starts_with('#')) line_.fail("must be a comment line: a row of the table");
      add_coefficients(words);
    }
  }

  void add_coefficients(const std::vector<std::string_view>& words) {
    if (words.size() != kColumns.size()) {
      line_.fail("row has " + std::to_string(words.size()) + " columns: must have 9");
    }
    std::array<double, kColumns.size()> v{};
    for (std::size_t c = 0; c < v.size(); ++c) v[c] = line_.value(words[c], kColumns[c]);
    const auto fail = [&](Column column, const std::string& must_be) {
      line_.fail(kColumns[column], words[column], must_be);
    };
    const double nm = v[kWavelength] * nm_;
    if (!(nm > 0.0)) fail(kWavelength, "above 0");
    if (!optics_.wavelength_nm.empty() && !(nm > optics_.wavelength_nm.back())) {
      fail(kWavelength, "above the one before");
    }
    if (!(v[kExtinction] > 0.0)) fail(kExtinction, "above 0");
    for (const Column c : {kScattering, kAbsorption}) {
      if (!(v[c] >= 0.0)) fail(c, "0 or above");
    }
    if (!(v[kAlbedo] >= 0.0 && v[kAlbedo] <= 1.0)) fail(kAlbedo, "0..1");
    if (!(std::abs(v[kAsymmetry]) < 1.0)) fail(kAsymmetry, "within (-1, 1)");
    if (std::abs(v[kScattering] + v[kAbsorption] - v[kExtinction]) >
        kSumTolerance * v[kExtinction]) {
      fail(kExtinction, "the sum of sca.coef and abs.coef within 1 %");
    }
    if (std::abs(v[kScattering] / v[kExtinction] - v[kAlbedo]) > kAlbedoTolerance) {
      fail(kAlbedo, "sca.coef over ext.coef within 0.01");
    }
    optics_.wavelength_nm.push_back(nm);
    optics_.optics.push_back({.scattering_per_km = v[kScattering] * per_km_[kScattering],
                              .absorption_per_km = v[kAbsorption] * per_km_[kAbsorption],
                              .asymmetry = v[kAsymmetry]});
  }

  void read_phase_wavelengths() {
    require_next("the wavelengths of the phase function");
    require_next("the wavelengths of the phase function");
    auto words = comment_words();
    if (!words.empty() && words.front() == "|") words.erase(words.begin());
    const std::vector<double>& table = optics_.wavelength_nm;
    if (words.size() != table.size()) {
      line_.fail("phase function has " + std::to_string(words.size()) +
                 " wavelengths: must have the table's " + std::to_string(table.size()));
    }
    for (std::size_t w = 0; w < words.size(); ++w) {
      const double nm = line_.value(words[w], "wavelengths") * nm_;
      if (std::abs(nm - table[w]) > 1e-6 * table[w]) {
        line_.fail("wavelengths", words[w], "as in the table of coefficients");
      }
    }
    volume_phase_.resize(table.size());
  }

  void read_phase_rows() {
    while (line_.next()) {
      if (line_.text().empty() || line_.text().starts_with('#')) continue;
      const auto words = line_.words();
      if (words.size() != volume_phase_.size() + 1) {
        line_.fail("row has " + std::to_string(words.size()) + " columns: must have " +
                   std::to_string(volume_phase_.size() + 1) + ", angle and phase functions");
      }
      const double angle = line_.value(words[0], "sca.ang.");
      if (!(angle >= 0.0 && angle <= 180.0)) line_.fail("sca.ang.", words[0], "0..180 degrees");
      if (!angle_rad_.empty() && !(angle * kRadPerDeg > angle_rad_.back())) {
        line_.fail("sca.ang.", words[0], "above the one before");
      }
      angle_rad_.push_back(angle * kRadPerDeg);
      for (std::size_t w = 0; w < volume_phase_.size(); ++w) {
        const double p = line_.value(words[w + 1], "phase function");
        if (!(p >= 0.0)) line_.fail("phase function", words[w + 1], "0 or above");
        volume_phase_[w].push_back(p);
      }
    }
    if (angle_rad_.empty()) line_.fail_file("has no rows of the phase function");
  }

  void finish() {
    for (std::size_t w = 0; w < volume_phase_.size(); ++w) {
      PhaseMatrix phase{.angle_rad = angle_rad_, .p11 = {}, .p12 = {}, .p33 = {}, .p34 = {}};
      const double scattering = optics_.optics[w].scattering_per_km / per_km_[kScattering];
      if (!(scattering > 0.0)) {
        line_.fail_file("column 'sca.coef' at " + std::to_string(optics_.wavelength_nm[w]) +
                        " nm: must be above 0 where there is a phase function");
      }
      for (const double p : volume_phase_[w]) {
        phase.p11.push_back(4.0 * std::numbers::pi * p / scattering);
      }
      phase.p12.assign(angle_rad_.size(), 0.0);
      phase.p33 = unpolarised_p33(angle_rad_, phase.p11);
      phase.p34 = phase.p12;
      normalise_imported(phase, [&](std::string_view element, const std::string& what) {
        const std::string name =
            element == "angle" ? "column 'sca.ang.'" : "column 'phase function'";
        line_.fail(name + " at " + std::to_string(optics_.wavelength_nm[w]) + " nm: " + what);
      });
      optics_.phase.push_back(std::move(phase));
    }
    require_particle_optics(optics_, line_.name());
  }

  LineReader line_;
  ParticleOptics optics_;
  double humidity_ = 0.0;
  double nm_ = 1.0;
  std::array<double, kColumns.size()> per_km_{};
  std::vector<double> angle_rad_;
  std::vector<std::vector<double>> volume_phase_;  // [wavelength][angle]
};

}  // namespace

ParticleOptics read_opac_optdat(const std::filesystem::path& file) {
  return OptdatReader(file).read();
}

}  // namespace twilight
