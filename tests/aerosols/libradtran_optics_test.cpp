#include "aerosols/libradtran_optics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "aerosols/component_phase.h"
#include "aerosols/component_table.h"
#include "aerosols/imported_phase.h"
#include "aerosols/optics_units.h"
#include "aerosols/particle_optics_file.h"
#include "tests/aerosols/libradtran_file.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using testing::HasSubstr;

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

// A component as such a file holds it: angles falling, single precision.
LibradtranFile component_file(const ParticleOptics& table, bool six_elements) {
  LibradtranFile file;
  file.wavelen.clear();
  for (const double nm : table.wavelength_nm) file.wavelen.push_back(nm * 1e-3);
  file.hum = table.relative_humidity_percent;
  file.elements = six_elements ? 6 : 4;
  for (std::size_t w = 0; w < table.wavelength_nm.size(); ++w) {
    for (std::size_t h = 0; h < file.hum.size(); ++h) {
      const ComponentOptics& o = table.optics[table.index(h, w)];
      file.ext.push_back(o.extinction_per_km() * 1e6);
      file.ssa.push_back(o.single_scattering_albedo());
      file.gg.push_back(o.asymmetry);
      const PhaseMatrix& m = table.phase[table.index(h, w)];
      for (std::size_t e = 0; e < file.elements; ++e) {
        for (std::size_t i = m.angle_rad.size(); i-- > 0;) {
          file.theta.push_back(m.angle_rad[i] * kDegPerRad);
          const double value[] = {m.p11[i], m.p12[i], m.p33[i], -m.p34[i], m.p11[i], m.p33[i]};
          file.phase.push_back(value[e]);
        }
      }
    }
  }
  return file;
}

void expect_matrix(const PhaseMatrix& got, const PhaseMatrix& wanted, double tolerance) {
  ASSERT_EQ(got.angle_rad.size(), wanted.angle_rad.size());
  for (std::size_t i = 0; i < got.p11.size(); ++i) {
    EXPECT_NEAR(got.angle_rad[i], wanted.angle_rad[i], 1e-6);
    const double scale = tolerance * wanted.p11[i];
    EXPECT_NEAR(got.p11[i], wanted.p11[i], scale) << i;
    EXPECT_NEAR(got.p12[i], wanted.p12[i], scale) << i;
    EXPECT_NEAR(got.p33[i], wanted.p33[i], scale) << i;
    EXPECT_NEAR(got.p34[i], wanted.p34[i], scale) << i;
  }
}

TEST(LibradtranOptics, HenyeyGreensteinsMomentsGiveItBack) {
  const TemporaryFolder folder;
  for (const double g : {0.0, 0.5, 0.75}) {
    const auto file = henyey_greenstein_file(g, 120).write(folder.path / "hg.cdf");
    const ParticleOptics optics = read_particle_optics(file);
    EXPECT_EQ(optics.name, "hg");
    EXPECT_EQ(optics.per, OpticsPer::kMicrogramPerM3);
    ASSERT_EQ(optics.phase.size(), 3u);
    for (const PhaseMatrix& m : optics.phase) {
      EXPECT_NEAR(phase_normalisation(m), 1.0, 1e-12);
      // The function on the same angles, its interpolant normalised: by 4e-4 at most.
      PhaseMatrix hg{.angle_rad = m.angle_rad, .p11 = {}, .p12 = {}, .p33 = {}, .p34 = {}};
      for (const double angle : m.angle_rad) {
        hg.p11.push_back((1 - g * g) / std::pow(1 + g * g - 2 * g * std::cos(angle), 1.5));
      }
      const double norm = phase_normalisation(hg);
      EXPECT_NEAR(norm, 1.0, 4e-4);
      for (std::size_t i = 0; i < m.p11.size(); ++i) {
        // Moments are in single precision: 1e-7 of the largest value at every angle.
        EXPECT_NEAR(m.p11[i], hg.p11[i] / norm, 2e-6 * hg.p11[0]) << g << ' ' << i;
        EXPECT_EQ(m.p12[i], 0.0);
      }
    }
    EXPECT_EQ(optics.optics[1].asymmetry, g);
    EXPECT_NEAR(optics.optics[1].extinction_per_km(), 2e-6, 1e-18);
    EXPECT_NEAR(optics.optics[1].single_scattering_albedo(), 0.9, 1e-12);
    EXPECT_EQ(optics.wavelength_nm[1], 550.0);
  }
}

TEST(LibradtranOptics, AComponentComesBackWithItsMatrix) {
  const TemporaryFolder folder;
  const ParticleOptics table =
      component_table(AerosolComponent::kSoot, std::vector<double>{450, 550, 800});
  const ParticleOptics read =
      read_particle_optics(component_file(table, false).write(folder.path / "soot.mie.cdf"));
  ASSERT_EQ(read.wavelength_nm.size(), 3u);
  for (std::size_t w = 0; w < 3; ++w) {
    EXPECT_NEAR(read.wavelength_nm[w], table.wavelength_nm[w], 1e-9);
    EXPECT_NEAR(read.optics[w].scattering_per_km, table.optics[w].scattering_per_km,
                1e-12 * table.optics[w].scattering_per_km);
    EXPECT_NEAR(read.optics[w].absorption_per_km, table.optics[w].absorption_per_km,
                1e-9 * table.optics[w].absorption_per_km);
    EXPECT_EQ(read.optics[w].asymmetry, table.optics[w].asymmetry);
    expect_matrix(read.phase[w], table.phase[w], 1e-5);
  }
}

TEST(LibradtranOptics, MopsmapsSixElementsWithoutUnitsAndAsymmetryAreTheSame) {
  const TemporaryFolder folder;
  const ParticleOptics table =
      component_table(AerosolComponent::kMineralAccumulation, std::vector<double>{450, 550});
  LibradtranFile file = component_file(table, true);
  file.units.clear();
  file.gg.clear();
  file.rho = {2.6};
  file.rho_by_humidity = true;
  const ParticleOptics read = read_particle_optics(file.write(folder.path / "dust.nc"));
  for (std::size_t w = 0; w < 2; ++w) {
    expect_matrix(read.phase[w], table.phase[w], 1e-5);
    // The mean cosine of the interpolant, 1.1e-4 high (README.md).
    EXPECT_NEAR(read.optics[w].asymmetry, table.optics[w].asymmetry, 3e-4);
  }
}

TEST(LibradtranOptics, OneSizeInPlaceOfHumiditiesAndFallingWavelengths) {
  const TemporaryFolder folder;
  LibradtranFile file = henyey_greenstein_file(0.6, 80);
  file.reff = true;
  file.hum = {10.0};
  file.units["reff"] = "micrometer";
  file.wavelen = {0.65, 0.55, 0.45};
  file.ext = {1.0, 2.0, 3.0};
  const ParticleOptics read = read_particle_optics(file.write(folder.path / "wc.cdf"));
  EXPECT_EQ(read.relative_humidity_percent, std::vector<double>{0.0});
  EXPECT_THAT(read.wavelength_nm, testing::ElementsAre(450.0, 550.0, 650.0));
  EXPECT_NEAR(read.optics[0].extinction_per_km(), 3e-6, 1e-18);
  EXPECT_NEAR(read.optics[2].extinction_per_km(), 1e-6, 1e-18);
}

TEST(LibradtranOptics, ExtinctionPerWetMassIsReferredToDryMatter) {
  // Volume grows by x, water adding to it; per particle extinction grows by 1.7 per step.
  const double dry_density = 1.8;
  const double growth[] = {1.0, 1.9, 4.0};
  LibradtranFile file = henyey_greenstein_file(0.6, 80);
  file.hum = {0.0, 50.0, 90.0};
  file.ext.clear();
  file.rho.clear();
  file.pmom.clear();
  file.ssa.assign(9, 0.9);
  file.gg.assign(9, 0.0);
  for (int w = 0; w < 3; ++w) {
    for (int h = 0; h < 3; ++h) {
      const double rho = (dry_density + growth[h] - 1.0) / growth[h];
      const double wet_mass = growth[h] * rho;  // per dry volume
      file.rho.push_back(rho);
      file.ext.push_back(std::pow(1.7, h) / wet_mass);
    }
  }
  file.pmom.assign(9, 1.0);
  const TemporaryFolder folder;
  const ParticleOptics read = read_particle_optics(file.write(folder.path / "waso.mie.cdf"));
  for (std::size_t h = 0; h < 3; ++h) {
    EXPECT_NEAR(read.optics[read.index(h, 1)].extinction_per_km(),
                1e-6 * std::pow(1.7, static_cast<double>(h)) / dry_density, 1e-17);
  }
}

TEST(LibradtranOptics, ExtinctionOfAirBecomesAShapeOfOnePerKmAt550nm) {
  LibradtranFile file = henyey_greenstein_file(0.6, 80);
  file.units["ext"] = "km-1";
  file.wavelen = {0.5, 0.6};
  file.ext = {0.3, 0.2};
  file.ssa.assign(2, 0.9);
  file.gg.assign(2, 0.6);
  file.pmom.resize(2 * 80);
  const TemporaryFolder folder;
  const ParticleOptics read = read_particle_optics(file.write(folder.path / "shape.nc"));
  EXPECT_EQ(read.per, OpticsPer::kExtinctionAt550nm);
  EXPECT_NEAR(read.optics[0].extinction_per_km(), 0.3 / 0.25, 1e-12);
  EXPECT_NEAR(read.optics[1].extinction_per_km(), 0.2 / 0.25, 1e-12);
}

TEST(LibradtranOptics, UnitsAreConverted) {
  EXPECT_EQ(nm_in("micrometer"), 1e3);
  EXPECT_EQ(nm_in(" um"), 1e3);
  EXPECT_EQ(nm_in("nm"), 1.0);
  EXPECT_EQ(nm_in("m"), 1e9);
  EXPECT_FALSE(nm_in("inch"));
  EXPECT_EQ(percent_in("per cent"), 1.0);
  EXPECT_EQ(percent_in("1"), 100.0);
  EXPECT_FALSE(percent_in("kg"));
  EXPECT_NEAR(*degrees_in("radian"), 57.29577951308232, 1e-12);
  EXPECT_FALSE(degrees_in("grad"));
  const auto per_km = [](const char* unit) { return coefficient_unit(unit)->per_km; };
  EXPECT_EQ(coefficient_unit("m2 g-1")->per, OpticsPer::kMicrogramPerM3);
  EXPECT_DOUBLE_EQ(per_km("m2 g-1"), 1e3 * per_km("km^-1/(g/m^3)"));
  EXPECT_DOUBLE_EQ(per_km("m2 kg-1"), 1e-3 * per_km("m2 g-1"));
  EXPECT_EQ(coefficient_unit("um^2")->per, OpticsPer::kParticlePerCm3);
  EXPECT_DOUBLE_EQ(per_km("m2"), 1e12 * per_km("um2"));
  EXPECT_DOUBLE_EQ(per_km("cm2"), 1e8 * per_km("um2"));
  EXPECT_EQ(coefficient_unit("1/km")->per, OpticsPer::kExtinctionAt550nm);
  EXPECT_DOUBLE_EQ(per_km("m-1"), 1e3);
  EXPECT_FALSE(coefficient_unit("furlong"));
  // The same particles whatever the unit of the file.
  const TemporaryFolder folder;
  LibradtranFile file = henyey_greenstein_file(0.6, 80);
  const ParticleOptics a = read_particle_optics(file.write(folder.path / "a.nc"));
  file.units["wavelen"] = "nm";
  for (double& w : file.wavelen) w *= 1e3;
  file.units["ext"] = "m2 g-1";
  for (double& e : file.ext) e *= 1e-3;
  const ParticleOptics b = read_particle_optics(file.write(folder.path / "b.nc"));
  for (std::size_t w = 0; w < 3; ++w) {
    EXPECT_NEAR(a.wavelength_nm[w], b.wavelength_nm[w], 1e-9);
    EXPECT_NEAR(a.optics[w].scattering_per_km, b.optics[w].scattering_per_km, 1e-18);
  }
}

TEST(LibradtranOptics, SwingsOfACutSeriesCountAsZeroUpToOnePercentOfTheMean) {
  const RefuseElement refuse = [](std::string_view element, const std::string& what) {
    throw std::invalid_argument(std::string(element) + " " + what);
  };
  // 1 + 3 g P_1: -0.005 at 180 degrees for g = 0.335.
  const PhaseMatrix m = phase_of_moments({std::vector<double>{1.0, 3 * 0.335}, {}, {}, {}}, refuse);
  EXPECT_EQ(m.p11.back(), 0.0);
  EXPECT_NEAR(phase_normalisation(m), 1.0, 1e-12);
  EXPECT_THROW(phase_of_moments({std::vector<double>{1.0, 3 * 0.35}, {}, {}, {}}, refuse),
               std::invalid_argument);
}

struct Malformed {
  const char* what;
  std::function<void(LibradtranFile&)> change;
  const char* complaint;
};

TEST(LibradtranOptics, RefusesWhatIsWrongNamingTheVariable) {
  const Malformed cases[] = {
      {"unknown length", [](auto& f) { f.units["wavelen"] = "inch"; },
       "variable 'wavelen' has the unknown unit 'inch'"},
      {"unknown humidity", [](auto& f) { f.units["hum"] = "kg/kg"; },
       "variable 'hum' has the unknown unit 'kg/kg'"},
      {"unknown extinction", [](auto& f) { f.units["ext"] = "dB"; },
       "variable 'ext' has the unknown unit 'dB'"},
      {"no humidity", [](auto& f) { f.left_out = "hum"; }, "neither variable 'hum' nor 'reff'"},
      {"several sizes",
       [](auto& f) {
         f.reff = true;
         f.hum = {5, 10};
         f.ext.assign(6, 1.0);
         f.ssa.assign(6, 1.0);
         f.gg.assign(6, 0.5);
         f.pmom.clear();
       },
       "variable 'reff' has 2 sizes"},
      {"wavelength twice",
       [](auto& f) {
         f.wavelen = {0.45, 0.55, 0.55};
       },
       "variable 'wavelen'"},
      {"negative wavelength",
       [](auto& f) {
         f.wavelen = {-0.45, 0.55, 0.65};
       },
       "variable 'wavelen' must be above 0"},
      {"humidity beyond 99", [](auto& f) { f.hum = {100}; }, "variable 'hum' reaches from 100"},
      {"zero extinction", [](auto& f) { f.ext[1] = 0; }, "variable 'ext' is 0 at 550 nm"},
      {"negative extinction", [](auto& f) { f.ext[2] = -1; }, "variable 'ext' is -1 at 650 nm"},
      {"extinction not finite", [](auto& f) { f.ext[2] = NAN; }, "variable 'ext'"},
      {"albedo above 1", [](auto& f) { f.ssa[0] = 1.1; }, "variable 'ssa' is 1.1 at 450 nm"},
      {"negative albedo", [](auto& f) { f.ssa[0] = -0.1; }, "variable 'ssa' is -0.1"},
      {"asymmetry 1", [](auto& f) { f.gg[0] = 1.0; }, "variable 'gg' is 1 at 450 nm"},
      {"asymmetry of another function", [](auto& f) { f.gg[1] = 0.1; }, "asymmetry 0.1"},
      {"no angular distribution",
       [](auto& f) {
         f.gg.clear();
         f.pmom.clear();
       },
       "none of the variables 'gg', 'phase'"},
      {"three elements",
       [](auto& f) {
         f.elements = 3;
         f.pmom.assign(3 * 3 * 2, 1.0);
       },
       "variable 'pmom' has 3 matrix elements"},
      {"moments without their number", [](auto& f) { f.left_out = "nmom"; }, "'nmom'"},
      {"more moments than there are", [](auto& f) { f.counts.assign(3, 81.0); },
       "variable 'nmom' is 81 at 450 nm"},
      {"no moments", [](auto& f) { f.counts.assign(3, 0.0); }, "variable 'nmom' is 0"},
      {"moment not finite", [](auto& f) { f.pmom[5] = NAN; }, "variable 'pmom' (p11)"},
      {"moments without 2 l + 1",
       [](auto& f) {
         for (std::size_t i = 0; i < f.pmom.size(); ++i) {
           f.pmom[i] = -f.pmom[i];
         }
       },
       "variable 'pmom' (p11) at 450 nm"},
      {"mean 1.2",
       [](auto& f) {
         for (double& p : f.pmom) p *= 1.2;
       },
       "over the sphere: must be 1 within 0.05"},
      {"several humidities without density",
       [](auto& f) {
         f.hum = {0, 50};
         f.ext.assign(6, 1.0);
         f.ssa.assign(6, 1.0);
         f.gg.assign(6, 0.6);
         f.pmom.clear();
       },
       "variable 'rho' is missing"},
      {"density that rises",
       [](auto& f) {
         f.hum = {0, 50};
         f.ext.assign(6, 1.0);
         f.ssa.assign(6, 1.0);
         f.gg.assign(6, 0.6);
         f.pmom.clear();
         f.rho = {1.5, 1.6, 1.5, 1.6, 1.5, 1.6};
       },
       "variable 'rho' is 1.6 at 50 %"},
      {"density in kg m-3",
       [](auto& f) {
         f.hum = {0, 50};
         f.ext.assign(6, 1.0);
         f.ssa.assign(6, 1.0);
         f.gg.assign(6, 0.6);
         f.pmom.clear();
         f.rho.assign(6, 1500);
         f.units["rho"] = "kg m-3";
       },
       "variable 'rho' has the unknown unit 'kg m-3'"},
      {"shape without 550 nm",
       [](auto& f) {
         f.units["ext"] = "1/km";
         f.wavelen = {0.6, 0.7, 0.8};
       },
       "variable 'wavelen' does not enclose 550 nm"},
      {"unknown angle",
       [](auto& f) {
         f.pmom.clear();
         f.theta = {0, 90, 180, 0, 90, 180, 0, 90, 180};
         f.phase.assign(9, 1.0);
         f.gg.assign(3, 0.0);
         f.units["theta"] = "gon";
       },
       "variable 'theta' has the unknown unit 'gon'"},
      {"angles to 170",
       [](auto& f) {
         f.pmom.clear();
         f.theta = {0, 90, 170, 0, 90, 170, 0, 90, 170};
         f.phase.assign(9, 1.0);
         f.gg.assign(3, 0.0);
       },
       "variable 'theta' (angle) at 450 nm, 0 % humidity: ends at 170"},
      {"angle twice",
       [](auto& f) {
         f.pmom.clear();
         f.theta = {0, 0, 180, 0, 0, 180, 0, 0, 180};
         f.phase.assign(9, 1.0);
         f.gg.assign(3, 0.0);
       },
       "variable 'theta' (angle)"},
      {"negative phase function",
       [](auto& f) {
         f.pmom.clear();
         f.theta = {0, 90, 180, 0, 90, 180, 0, 90, 180};
         f.phase.assign(9, 1.0);
         f.phase[4] = -0.5;
         f.gg.assign(3, 0.0);
       },
       "variable 'phase' (p11) at 550 nm"},
      {"more than polarised",
       [](auto& f) {
         f.elements = 4;
         f.pmom.assign(12, 0.0);
         for (std::size_t i = 0; i < 12; i += 4) {
           f.pmom[i] = 1.0;
           f.pmom[i + 1] = 1.5;
         }
         f.gg.assign(3, 0.0);
       },
       "variable 'pmom' (p12, p33, p34)"},
  };
  const TemporaryFolder folder;
  int refused = 0;
  for (const Malformed& c : cases) {
    LibradtranFile file = henyey_greenstein_file(0.6, 80);
    c.change(file);
    const auto path = file.write(folder.path / "bad.nc");
    try {
      read_particle_optics(path);
      ADD_FAILURE() << c.what << " was accepted";
    } catch (const std::exception& error) {
      EXPECT_THAT(error.what(), HasSubstr(path.string())) << c.what;
      EXPECT_THAT(error.what(), HasSubstr(c.complaint)) << c.what;
      ++refused;
    }
  }
  EXPECT_GE(refused, 30);
}

}  // namespace
}  // namespace twilight
