#include "aerosols/opac_optdat.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "aerosols/component_phase.h"
#include "aerosols/component_table.h"
#include "aerosols/particle_optics_file.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using testing::HasSubstr;

const std::vector<double> kWavelengths_nm = {350, 550, 800};

std::string format(const char* pattern, ...) {
  char text[200];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

// One humidity of a table in the lines of OPAC's component files, with their four digits.
std::vector<std::string> optdat_lines(const ParticleOptics& table, std::size_t humidity,
                                      const std::string& title) {
  std::vector<std::string> lines = {"# " + title,
                                    "#",
                                    "# size distribution: lognormal",
                                    "# ------------------",
                                    "#",
                                    "#   minimum radius, [um]:      5.000E-03",
                                    "#                  sigma:      2.240E+00",
                                    "#",
                                    "# optical parameters:",
                                    "# -------------------",
                                    "#",
                                    "# wavelength ext.coef  sca.coef  abs.coef  si.sc.alb  "
                                    "asym.par  ext.nor    ref.real  ref.imag",
                                    "#     [um]     [1/km]    [1/km]    [1/km]",
                                    "#"};
  for (std::size_t w = 0; w < table.wavelength_nm.size(); ++w) {
    const ComponentOptics& o = table.optics[table.index(humidity, w)];
    lines.push_back(format("#  %.3E %.3E %.3E %.3E %.3E %.3E %.3E  %.3E %.3E",
                           table.wavelength_nm[w] * 1e-3, o.extinction_per_km(),
                           o.scattering_per_km, o.absorption_per_km, o.single_scattering_albedo(),
                           o.asymmetry, 1.0, 1.5, -0.01));
  }
  for (const char* line :
       {"#", "# volume phase function [1/km]:", "# -----------------------------", "#",
        "# sca.ang. | wavelengths --->", "# ---------|------------------"}) {
    lines.emplace_back(line);
  }
  std::string row = "#          |";
  for (const double nm : table.wavelength_nm) row += format(" %.3E", nm * 1e-3);
  lines.push_back(row);
  lines.emplace_back("#");
  const std::vector<double>& angle = table.phase[table.index(humidity, 0)].angle_rad;
  for (std::size_t i = 0; i < angle.size(); ++i) {
    row = format("  %.5E ", angle[i] * 180.0 / std::numbers::pi);
    for (std::size_t w = 0; w < table.wavelength_nm.size(); ++w) {
      const std::size_t k = table.index(humidity, w);
      row += format(" %.3E", table.phase[k].p11[i] * table.optics[k].scattering_per_km /
                                 (4.0 * std::numbers::pi));
    }
    lines.push_back(row);
  }
  return lines;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

const ParticleOptics& water_soluble() {
  static const ParticleOptics table =
      component_table(AerosolComponent::kWaterSoluble, kWavelengths_nm);
  return table;
}

void expect_state(const ParticleOptics& read, std::size_t at, const ParticleOptics& wanted,
                  std::size_t humidity) {
  for (std::size_t w = 0; w < kWavelengths_nm.size(); ++w) {
    const ComponentOptics& a = read.optics[read.index(at, w)];
    const ComponentOptics& b = wanted.optics[wanted.index(humidity, w)];
    EXPECT_NEAR(a.scattering_per_km, b.scattering_per_km, 5e-4 * b.scattering_per_km);
    EXPECT_NEAR(a.absorption_per_km, b.absorption_per_km, 5e-4 * b.absorption_per_km);
    EXPECT_NEAR(a.asymmetry, b.asymmetry, 5e-4);
    const PhaseMatrix& p = read.phase[read.index(at, w)];
    const PhaseMatrix& q = wanted.phase[wanted.index(humidity, w)];
    EXPECT_NEAR(phase_normalisation(p), 1.0, 1e-12);
    ASSERT_EQ(p.p11.size(), q.p11.size());
    for (std::size_t i = 0; i < p.p11.size(); ++i) {
      EXPECT_NEAR(p.p11[i], q.p11[i], 1.1e-3 * q.p11[i]) << i;
      EXPECT_EQ(p.p12[i], 0.0);
      EXPECT_EQ(p.p34[i], 0.0);
    }
    // What a rotation about the beam leaves as it is, forward and back.
    EXPECT_NEAR(p.p33.front(), p.p11.front(), 1e-12 * p.p11.front());
    EXPECT_NEAR(p.p33.back(), -p.p11.back(), 1e-12 * p.p11.back());
  }
}

TEST(OpacOptdat, AComponentComesBackToThePrintedDigits) {
  const TemporaryFolder folder;
  const auto file =
      folder.write("waso80", joined(optdat_lines(water_soluble(), 3, "water soluble (80%)      ")));
  const ParticleOptics read = read_particle_optics(file);
  EXPECT_EQ(read.name, "water soluble");
  EXPECT_EQ(read.per, OpticsPer::kParticlePerCm3);
  EXPECT_THAT(read.relative_humidity_percent, testing::ElementsAre(80.0));
  for (std::size_t w = 0; w < 3; ++w) EXPECT_NEAR(read.wavelength_nm[w], kWavelengths_nm[w], 1e-9);
  expect_state(read, 0, water_soluble(), 3);
}

TEST(OpacOptdat, HumidityOfTheNameWhereTheTitleHasNone) {
  const TemporaryFolder folder;
  const auto lines = optdat_lines(water_soluble(), 3, "water soluble");
  EXPECT_EQ(read_opac_optdat(folder.write("waso95", joined(lines))).relative_humidity_percent[0],
            95.0);
  EXPECT_EQ(read_opac_optdat(folder.write("waso", joined(lines))).relative_humidity_percent[0],
            0.0);
}

TEST(OpacOptdat, ANameWithoutDigitsReadsEveryHumidity) {
  const TemporaryFolder folder;
  const std::pair<const char*, std::size_t> files[] = {{"waso00", 0}, {"waso50", 1}, {"waso99", 7}};
  for (const auto& [name, humidity] : files) {
    folder.write(name, joined(optdat_lines(water_soluble(), humidity, "water soluble")));
  }
  const ParticleOptics read = read_particle_optics(folder.path / "waso");
  EXPECT_THAT(read.relative_humidity_percent, testing::ElementsAre(0.0, 50.0, 99.0));
  for (std::size_t k = 0; k < 3; ++k) expect_state(read, k, water_soluble(), files[k].second);
  EXPECT_THROW(read_particle_optics(folder.path / "soot"), std::runtime_error);
}

// Where things stand in the lines above.
constexpr std::size_t kUnits = 12, kRow = 14, kPhaseTitle = 18, kPhaseWavelengths = 23,
                      kFirstAngle = 25;

struct Malformed {
  const char* what;
  std::function<void(std::vector<std::string>&)> change;
  const char* complaint;
};

std::string replaced(std::string line, const std::string& from, const std::string& to) {
  const std::size_t at = line.find(from);
  EXPECT_NE(at, std::string::npos) << line;
  return line.replace(at, from.size(), to);
}

TEST(OpacOptdat, RefusesWhatIsWrongNamingTheLine) {
  const ParticleOptics& table = water_soluble();
  const std::string wavelength = format("%.3E", 0.55);
  const auto cell = [&](double value) { return format("%.3E", value); };
  const ComponentOptics& o = table.optics[table.index(3, 0)];
  const Malformed cases[] = {
      {"empty", [](auto& l) { l.clear(); }, "is empty"},
      {"no table", [](auto& l) { l.resize(11); }, ":11: is no file of particle optics"},
      {"humidity 100", [](auto& l) { l[0] = "# water soluble (100%)"; }, ":1: column 'humidity'"},
      {"humidity a word", [](auto& l) { l[0] = "# water soluble (wet%)"; },
       ":1: column 'humidity': value 'wet'"},
      {"wavelength in inch", [](auto& l) { l[kUnits] = "# [in] [1/km] [1/km] [1/km]"; },
       ":13: column 'wavelength': value '[in]': must be a known unit"},
      {"coefficient in dB", [](auto& l) { l[kUnits] = "# [um] [1/km] [dB] [1/km]"; },
       ":13: column 'sca.coef': value '[dB]'"},
      {"no units", [](auto& l) { l[kUnits] = "#"; }, ":13: must be the units"},
      {"a column short", [](auto& l) { l[kRow] = "# 1 2 3 4 5 6 7 8"; },
       ":15: row has 8 columns: must have 9"},
      {"a word", [&](auto& l) { l[kRow] = replaced(l[kRow], cell(o.extinction_per_km()), "abc"); },
       ":15: column 'ext.coef': value 'abc'"},
      {"not a number",
       [&](auto& l) { l[kRow] = replaced(l[kRow], cell(o.scattering_per_km), "nan"); },
       ":15: column 'sca.coef': value 'nan'"},
      {"negative absorption",
       [&](auto& l) { l[kRow] = replaced(l[kRow], cell(o.absorption_per_km), "-1.000E-09"); },
       ":15: column 'abs.coef': value '-1.000E-09': must be 0 or above"},
      {"sum", [&](auto& l) { l[kRow] = replaced(l[kRow], cell(o.extinction_per_km()), "1.0E+00"); },
       ":15: column 'ext.coef': value '1.0E+00': must be the sum"},
      {"albedo above 1",
       [&](auto& l) {
         l[kRow] = replaced(l[kRow], cell(o.single_scattering_albedo()), "1.500E+00");
       },
       ":15: column 'si.sc.alb': value '1.500E+00': must be 0..1"},
      {"albedo of another",
       [&](auto& l) {
         l[kRow] = replaced(l[kRow], cell(o.single_scattering_albedo()), "5.000E-01");
       },
       ":15: column 'si.sc.alb': value '5.000E-01'"},
      {"asymmetry 1.2",
       [&](auto& l) { l[kRow] = replaced(l[kRow], cell(o.asymmetry), "1.200E+00"); },
       ":15: column 'asym.par': value '1.200E+00'"},
      {"wavelengths fall", [](auto& l) { std::swap(l[kRow], l[kRow + 1]); },
       ":16: column 'wavelength'"},
      {"no phase function", [](auto& l) { l.resize(kRow + 4); }, "ends before '# volume phase"},
      {"phase function per m", [](auto& l) { l[kPhaseTitle] = "# volume phase function [1/m]:"; },
       ":19: unit of the volume phase function must be [1/km]"},
      {"a wavelength short",
       [&](auto& l) { l[kPhaseWavelengths] = replaced(l[kPhaseWavelengths], wavelength, ""); },
       ":24: phase function has 2 wavelengths"},
      {"another wavelength",
       [&](auto& l) {
         l[kPhaseWavelengths] = replaced(l[kPhaseWavelengths], wavelength, "5.600E-01");
       },
       ":24: column 'wavelengths': value '5.600E-01'"},
      {"no rows", [](auto& l) { l.resize(kFirstAngle); }, "no rows of the phase function"},
      {"a value short", [](auto& l) { l[kFirstAngle + 5] = "1.0 1e-5 1e-5"; },
       ":31: row has 3 columns: must have 4"},
      {"negative phase function", [](auto& l) { l[kFirstAngle] = "0.0 -1.0E-6 1e-5 1e-5"; },
       ":26: column 'phase function': value '-1.0E-6'"},
      {"angle beyond 180", [](auto& l) { l.back() = "181.0 1e-7 1e-7 1e-7"; },
       "column 'sca.ang.': value '181.0': must be 0..180"},
      {"angle twice", [](auto& l) { l[kFirstAngle + 1] = l[kFirstAngle]; },
       ":27: column 'sca.ang.'"},
      {"ends at 90 degrees", [](auto& l) { l.resize(kFirstAngle + 171); }, "column 'sca.ang.' at"},
      {"ten times too high",
       [](auto& l) {
         for (std::size_t i = kFirstAngle; i < l.size(); ++i) {
           l[i] = replaced(l[i], "E-0", "E-00");
           l[i] = l[i].substr(0, 14) + "  9e-6 9e-6 9e-6";
         }
       },
       "column 'phase function' at 350"},
  };
  const TemporaryFolder folder;
  for (const Malformed& c : cases) {
    auto lines = optdat_lines(table, 3, "water soluble (80%)");
    c.change(lines);
    const auto file = folder.write("bad", joined(lines));
    try {
      read_particle_optics(file);
      ADD_FAILURE() << c.what << " was accepted";
    } catch (const std::exception& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.string())) << c.what;
      EXPECT_THAT(error.what(), HasSubstr(c.complaint)) << c.what;
    }
  }
}

}  // namespace
}  // namespace twilight
