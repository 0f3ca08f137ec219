#include "output/optics_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "aerosols/component_phase.h"
#include "aerosols/component_table.h"
#include "aerosols/particle_optics_file.h"
#include "atmosphere/netcdf_reader.h"
#include "output/netcdf_writer.h"
#include "sim/scene_file.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using testing::HasSubstr;

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

const ParticleOptics& sulfate() {
  static const ParticleOptics table =
      component_table(AerosolComponent::kSulfate, std::vector<double>{450, 550});
  return table;
}

void expect_same(const ParticleOptics& a, const ParticleOptics& b, double tolerance) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.per, b.per);
  EXPECT_EQ(a.dry_mass_ug_per_m3, b.dry_mass_ug_per_m3);
  EXPECT_EQ(a.relative_humidity_percent, b.relative_humidity_percent);
  EXPECT_EQ(a.wavelength_nm, b.wavelength_nm);
  ASSERT_EQ(a.optics.size(), b.optics.size());
  ASSERT_EQ(a.phase.size(), b.phase.size());
  for (std::size_t i = 0; i < a.optics.size(); ++i) {
    EXPECT_EQ(a.optics[i].scattering_per_km, b.optics[i].scattering_per_km);
    EXPECT_EQ(a.optics[i].absorption_per_km, b.optics[i].absorption_per_km);
    EXPECT_EQ(a.optics[i].asymmetry, b.optics[i].asymmetry);
  }
  for (std::size_t k = 0; k < a.phase.size(); ++k) {
    const PhaseMatrix &p = a.phase[k], &q = b.phase[k];
    ASSERT_EQ(p.angle_rad.size(), q.angle_rad.size());
    for (std::size_t i = 0; i < p.angle_rad.size(); ++i) {
      EXPECT_NEAR(p.angle_rad[i], q.angle_rad[i], tolerance);
      const double scale = tolerance * q.p11[i];
      EXPECT_NEAR(p.p11[i], q.p11[i], scale);
      EXPECT_NEAR(p.p12[i], q.p12[i], scale);
      EXPECT_NEAR(p.p33[i], q.p33[i], scale);
      EXPECT_NEAR(p.p34[i], q.p34[i], scale);
    }
  }
}

TEST(ParticleOpticsFile, ExportedTablesComeBackTheSame) {
  const TemporaryFolder folder;
  for (const OpticsPer per :
       {OpticsPer::kParticlePerCm3, OpticsPer::kMicrogramPerM3, OpticsPer::kExtinctionAt550nm}) {
    for (const bool phases : {true, false}) {
      ParticleOptics table = sulfate();
      table.per = per;
      if (!phases) table.phase.clear();
      if (per == OpticsPer::kParticlePerCm3) table.dry_mass_ug_per_m3 = 2.28e-2;
      for (const char* name : {"table.nc", "table.csv"}) {
        write_particle_optics(table, folder.path / name, "test");
        expect_same(read_particle_optics(folder.path / name), table, 1e-12);
      }
    }
  }
}

TEST(ParticleOpticsFile, MatricesOfDifferentAnglesKeepTheirInterpolants) {
  ParticleOptics table = sulfate();
  table.relative_humidity_percent = {0.0};
  table.optics.resize(2);
  table.phase.resize(2);
  // Every second angle of the first matrix alone.
  PhaseMatrix coarse;
  const PhaseMatrix& fine = table.phase[0];
  for (std::size_t i = 0; i < fine.p11.size(); i += 2) {
    coarse.angle_rad.push_back(fine.angle_rad[i]);
    coarse.p11.push_back(fine.p11[i]);
    coarse.p12.push_back(fine.p12[i]);
    coarse.p33.push_back(fine.p33[i]);
    coarse.p34.push_back(fine.p34[i]);
  }
  const double scale = 1.0 / phase_normalisation(coarse);
  for (auto* p : {&coarse.p11, &coarse.p12, &coarse.p33, &coarse.p34}) {
    for (double& v : *p) v *= scale;
  }
  table.phase[0] = coarse;
  const TemporaryFolder folder;
  write_particle_optics(table, folder.path / "two.nc", "test");
  const ParticleOptics read = read_particle_optics(folder.path / "two.nc");
  const PhaseMatrix& back = read.phase[0];
  ASSERT_EQ(back.p11.size(), 2 * coarse.p11.size() - 1);
  for (std::size_t i = 0; i < coarse.p11.size(); ++i) {
    EXPECT_NEAR(back.p11[2 * i], coarse.p11[i], 1e-12 * coarse.p11[i]);
  }
  EXPECT_NEAR(phase_asymmetry(back), phase_asymmetry(coarse), 1e-12);
  // CSV keeps each matrix' own angles.
  write_particle_optics(table, folder.path / "two.csv", "test");
  expect_same(read_particle_optics(folder.path / "two.csv"), table, 1e-12);
}

TEST(ParticleOpticsFile, OtherEndingsAreRefusedAndLeaveNothing) {
  const TemporaryFolder folder;
  EXPECT_THROW(write_particle_optics(sulfate(), folder.path / "table.txt", "test"),
               std::invalid_argument);
  EXPECT_THROW(write_particle_optics(sulfate(), folder.path / "no" / "table.nc", "test"),
               std::runtime_error);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path));
}

struct MalformedCsv {
  const char* what;
  std::function<void(std::vector<std::string>&)> change;  // lines from 0
  const char* complaint;
};

TEST(ParticleOpticsFile, MalformedCsvIsRefusedNamingTheLine) {
  const TemporaryFolder folder;
  ParticleOptics table = sulfate();
  table.phase.clear();
  table.relative_humidity_percent = {0, 50};
  table.optics.resize(4);
  table.dry_mass_ug_per_m3 = 0.0;  // no line for it
  write_particle_optics(table, folder.path / "good.csv", "test");
  std::vector<std::string> good;
  std::istringstream in(text_of(folder.path / "good.csv"));
  for (std::string line; std::getline(in, line);) good.push_back(line);
  ASSERT_EQ(good.size(), 9u);  // four comments, header, four rows
  const MalformedCsv cases[] = {
      {"no kind", [](auto& l) { l.erase(l.begin() + 3); }, "lacks the line '# coefficients_per"},
      {"unknown kind", [](auto& l) { l[3] = "# coefficients_per = bushel"; },
       ":4: column 'coefficients_per': value 'bushel'"},
      {"another header", [](auto& l) { l[4] = "wavelength_nm,p11"; }, ":5: header"},
      {"no rows", [](auto& l) { l.resize(5); }, "has no rows"},
      {"a column short", [](auto& l) { l[5] = "0,450,1,1,0.5"; }, ":6: row has 5 columns"},
      {"a word", [](auto& l) { l[5] = "0,450,much,1,0.5,,,,,"; },
       ":6: column 'scattering_per_km': value 'much'"},
      {"negative", [](auto& l) { l[5] = "0,450,-1,1,0.5,,,,,"; },
       ":6: column 'scattering_per_km': value '-1'"},
      {"asymmetry", [](auto& l) { l[6] = "0,550,1,1,1,,,,,"; }, ":7: column 'asymmetry'"},
      {"humidity", [](auto& l) { l[5] = "100,450,1,1,0.5,,,,,"; },
       ":6: column 'relative_humidity_percent': value '100'"},
      {"humidity falls", [](auto& l) { std::swap(l[5], l[7]); }, ":7: column"},
      {"wavelength falls", [](auto& l) { std::swap(l[5], l[6]); }, ":7: column 'wavelength_nm'"},
      {"other wavelengths", [](auto& l) { l[8] = "50,560,1,1,0.5,,,,,"; },
       ":9: column 'wavelength_nm': value '560'"},
      {"a wavelength short", [](auto& l) { l.pop_back(); }, "has 3 blocks"},
      {"row twice", [](auto& l) { l[6] = l[5]; }, ":7: row repeats"},
      {"matrix without angle", [](auto& l) { l[5] = "0,450,1,1,0.5,,1,,,"; },
       ":6: column 'p11': value '1': must be empty"},
      {"angle", [](auto& l) { l[5] = "0,450,1,1,0,200,1,0,0,0"; }, ":6: column 'angle_deg'"},
      {"matrix of one angle", [](auto& l) { l[5] = "0,450,1,1,0,0,1,0,0,0"; },
       ":7: the block that ends before here, column 'angle_deg'"},
  };
  for (const MalformedCsv& c : cases) {
    std::vector<std::string> lines = good;
    c.change(lines);
    std::string text;
    for (const std::string& line : lines) text += line + "\n";
    const auto file = folder.write("bad.csv", text);
    try {
      read_particle_optics(file);
      ADD_FAILURE() << c.what << " was accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.string())) << c.what;
      EXPECT_THAT(error.what(), HasSubstr(c.complaint)) << c.what;
    }
  }
}

// Our netCDF with one thing wrong.
void write_own_netcdf(const std::filesystem::path& path, const std::string& wrong) {
  AtomicFile whole(path);
  NetcdfWriter file(whole);
  const auto is = [&](const char* what) { return wrong == what; };
  if (!is("format")) file.attribute("", "format", kParticleOpticsFormat);
  file.attribute("", "particles", "x");
  if (!is("coefficients_per")) {
    file.attribute("", "coefficients_per", is("kind") ? "bushel" : "particle cm-3");
  }
  file.dimension("relative_humidity", 1);
  file.dimension("wavelength", 2);
  file.dimension("scattering_angle", 3);
  const auto define = [&](const char* name, std::vector<std::string> dimensions, const char* unit) {
    if (wrong == std::string("no ") + name) return;
    const bool other = wrong == std::string("unit of ") + name;
    if (wrong == std::string("dimensions of ") + name) dimensions = {"wavelength"};
    file.variable(name, NetcdfNumber::kDouble, dimensions, {other ? "furlong" : unit, "", ""});
  };
  define("relative_humidity", {"relative_humidity"}, "percent");
  define("wavelength", {"wavelength"}, "nm");
  for (const char* name : {"scattering_coefficient", "absorption_coefficient"}) {
    define(name, {"relative_humidity", "wavelength"}, "km-1 cm3");
  }
  define("asymmetry_factor", {"relative_humidity", "wavelength"}, "1");
  define("scattering_angle", {"scattering_angle"}, "degree");
  for (const char* name : {"p11", "p12", "p33", "p34"}) {
    define(name, {"relative_humidity", "wavelength", "scattering_angle"}, "1");
  }
  file.end_definitions();
  const auto put = [&](const char* name, const std::vector<double>& values) {
    if (wrong != std::string("no ") + name) file.put(name, values);
  };
  put("relative_humidity", {is("humidity") ? 120.0 : 0.0});
  put("wavelength", {450, is("wavelengths") ? 450.0 : 550.0});
  put("scattering_coefficient", {1, is("negative") ? -1.0 : 1.0});
  put("absorption_coefficient", {1, is("not finite") ? std::nan("") : 1.0});
  put("asymmetry_factor", {0, is("asymmetry") ? 0.5 : 0.0});
  put("scattering_angle", {0, 90, is("angle") ? 90.0 : 180.0});
  const double p = is("normalisation") ? 2.0 : 1.0;
  put("p11", {p, p, p, p, p, p});
  for (const char* name : {"p12", "p33", "p34"}) {
    put(name, std::vector<double>(6, is("too polarised") ? 0.8 : 0.0));
  }
  file.close();
  whole.commit();
}

TEST(ParticleOpticsFile, MalformedNetcdfIsRefusedNamingTheVariable) {
  const std::pair<const char*, const char*> cases[] = {
      {"format", "global attribute format"},
      {"coefficients_per", "'coefficients_per' is missing"},
      {"kind", "'coefficients_per' = 'bushel'"},
      {"unit of wavelength", "variable 'wavelength' has the unit 'furlong'"},
      {"unit of relative_humidity", "variable 'relative_humidity'"},
      {"unit of scattering_coefficient", "variable 'scattering_coefficient' has the unit"},
      {"unit of scattering_angle", "variable 'scattering_angle'"},
      {"no wavelength", "'wavelength'"},
      {"no absorption_coefficient", "'absorption_coefficient'"},
      {"no p33", "'p33'"},
      {"dimensions of asymmetry_factor", "variable 'asymmetry_factor' has the dimensions"},
      {"humidity", "relative humidity 120"},
      {"wavelengths", "wavelength 450"},
      {"negative", "scattering coefficient -1"},
      {"not finite", "variable 'absorption_coefficient'"},
      {"asymmetry", "asymmetry 0.5"},
      {"angle", "variable 'scattering_angle'"},
      {"normalisation", "variable 'p11'"},
      {"too polarised", "variable 'p12, p33, p34'"}};
  const TemporaryFolder folder;
  write_own_netcdf(folder.path / "good.nc", "");
  EXPECT_NO_THROW(read_particle_optics(folder.path / "good.nc"));
  for (const auto& [wrong, complaint] : cases) {
    const auto file = folder.path / "bad.nc";
    write_own_netcdf(file, wrong);
    try {
      read_particle_optics(file);
      ADD_FAILURE() << wrong << " was accepted";
    } catch (const std::exception& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.string())) << wrong;
      EXPECT_THAT(error.what(), HasSubstr(complaint)) << wrong;
    }
  }
}

TEST(ParticleOpticsFile, AFileCutShortIsRefusedWhereverItEnds) {
  const TemporaryFolder folder;
  ParticleOptics table = sulfate();
  table.relative_humidity_percent = {0.0};
  table.optics.resize(2);
  table.phase.resize(2);
  write_particle_optics(table, folder.path / "good.nc", "test");
  const std::string whole = text_of(folder.path / "good.nc");
  for (std::size_t length = 0; length + 8 <= whole.size(); length += length < 2000 ? 37 : 997) {
    const auto file = folder.write("cut.nc", whole.substr(0, length));
    EXPECT_ANY_THROW(read_particle_optics(file)) << length;
  }
  EXPECT_ANY_THROW(read_particle_optics(folder.write("cut.nc", whole.substr(0, whole.size() - 8))));
}

SceneModel scene_model(const std::string& more = "") {
  return build_scene_model(
      parse_scene("[sun]\nelevation_deg = 10\n[atmosphere]\nlayers = 20\n"
                  "[spectrum]\nwavelengths_nm = [450, 550]\n"
                  "[solver]\nmethod = \"orders\"\n" +
                      more,
                  "test"));
}

TEST(SceneOpticsFile, HoldsTheMediumAndAddsUp) {
  const TemporaryFolder folder;
  const SceneModel model = scene_model();
  const Medium& m = model.medium;
  const auto written = write_scene_optics(model, folder.path / "air.nc", "test");
  EXPECT_EQ(written.size(), 1u);
  const NetcdfReader file(folder.path / "air.nc");
  EXPECT_EQ(file.required_text("", "Conventions"), "CF-1.10");
  const auto extinction = file.numbers("extinction", {"height", "wavelength"});
  const auto scattering = file.numbers("aerosol_scattering", {"height", "wavelength"});
  const auto absorption = file.numbers("aerosol_absorption", {"height", "wavelength"});
  const auto albedo = file.numbers("aerosol_single_scattering_albedo", {"height", "wavelength"});
  const auto depth = file.numbers("optical_depth", {"height", "wavelength"});
  const auto column = file.numbers("column_optical_depth");
  const auto aerosol = file.numbers("aerosol_optical_depth");
  EXPECT_EQ(file.required_text("aerosol_optical_depth", "standard_name"),
            "atmosphere_optical_thickness_due_to_ambient_aerosol_particles");
  std::vector<double> sum(2, 0.0), aerosol_sum(2, 0.0);
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < 2; ++w) {
      const std::size_t k = 2 * i + w;
      const double a = m.aerosol_scattering_per_km(i, w) + m.aerosol_absorption_per_km(i, w);
      EXPECT_EQ(scattering[k], m.aerosol_scattering_per_km(i, w));
      EXPECT_DOUBLE_EQ(extinction[k],
                       m.air_scattering_per_km(i, w) + a + m.gas_absorption_per_km(i, w));
      EXPECT_NEAR(albedo[k] * (scattering[k] + absorption[k]), scattering[k],
                  1e-14 * scattering[k]);
      sum[w] += depth[k];
      aerosol_sum[w] += a * (m.boundary_km[i + 1] - m.boundary_km[i]);
    }
  }
  for (std::size_t w = 0; w < 2; ++w) {
    EXPECT_NEAR(column[w], sum[w], 1e-12);
    EXPECT_NEAR(aerosol[w], aerosol_sum[w], 1e-12);
  }
  // The kinds add up to the aerosol, and every matrix is normalised.
  const auto kinds =
      file.numbers("aerosol_kind_scattering", {"aerosol_kind", "height", "wavelength"});
  for (std::size_t k = 0; k < scattering.size(); ++k) {
    double all = 0;
    for (std::size_t kind = 0; kind < file.size("aerosol_kind"); ++kind) {
      all += kinds[kind * scattering.size() + k];
    }
    EXPECT_NEAR(all, scattering[k], 1e-12 * scattering[k] + 1e-300);
  }
  const auto p11 = file.numbers("p11", {"aerosol_kind", "wavelength", "scattering_angle"});
  const std::vector<PhaseMatrix>& first = m.aerosol_phase.front();
  for (std::size_t i = 0; i < first[0].p11.size(); ++i) EXPECT_EQ(p11[i], first[0].p11[i]);
}

TEST(SceneOpticsFile, CsvHoldsTheSameInTwoFiles) {
  const TemporaryFolder folder;
  const auto written = write_scene_optics(scene_model(), folder.path / "air.csv", "test");
  ASSERT_EQ(written.size(), 2u);
  EXPECT_EQ(written[1].filename(), "air.phase.csv");
  EXPECT_THAT(text_of(written[0]), HasSubstr("bottom_km,top_km,wavelength_nm,extinction_per_km"));
  EXPECT_THAT(text_of(written[1]), HasSubstr("aerosol_kind,wavelength_nm,angle_deg,p11"));
  const auto plain = write_scene_optics(scene_model("[aerosols]\ntype = \"none\"\n"),
                                        folder.path / "clear.csv", "test");
  EXPECT_EQ(plain.size(), 1u);
}

}  // namespace
}  // namespace twilight
