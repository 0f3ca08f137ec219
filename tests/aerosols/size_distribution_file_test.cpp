#include "aerosols/size_distribution_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "aerosols/component_mie.h"
#include "aerosols/component_phase.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using testing::HasSubstr;

constexpr std::complex<double> kIndex{1.45, -0.01};

// The radii of AERONET's retrievals: 22, evenly spaced in the logarithm from 0.05 to 15 um.
std::vector<double> aeronet_radii() {
  std::vector<double> radii;
  for (int i = 0; i < 22; ++i) radii.push_back(0.05 * std::pow(300.0, i / 21.0));
  return radii;
}

std::string number(double value, int digits) {
  std::ostringstream s;
  s.precision(digits);
  s << std::fixed << value;
  return s.str();
}

// A retrieval of volume 0.05 um in a fine and 0.02 in a coarse lognormal mode.
double two_modes(double radius) {
  const auto mode = [&](double volume, double median, double width) {
    const double t = std::log(radius / median) / width;
    return volume / (std::sqrt(2 * std::numbers::pi) * width) * std::exp(-0.5 * t * t);
  };
  return mode(0.05, 0.15, 0.45) + mode(0.02, 2.5, 0.6);
}

// As AERONET writes them: version 3, a row per factor.
std::string aeronet_file(const std::vector<double>& factors) {
  std::string text =
      "AERONET Version 3;\nSomewhere\nVersion 3: Almucantar Level 2.0 Inversion\n"
      "The following data are automatically cloud cleared\nUNITS can be found at,,, "
      "http://aeronet.gsfc.nasa.gov\n"
      "Site,Date(dd:mm:yyyy),Time(hh:mm:ss),Day_of_Year,";
  for (const double radius : aeronet_radii()) text += number(radius, 6) + ",";
  text += "Inflection_Radius_of_Size_Distribution(um),Sky_Residual(%)\n";
  int second = 10;
  for (const double factor : factors) {
    text += "Somewhere,15:08:2019,21:46:" + std::to_string(second++) + ",227,";
    for (const double radius : aeronet_radii()) {
      text += (factor < 0 ? "-999." : number(factor * two_modes(radius), 6)) + ",";
    }
    text += "0.576,3.5\n";
  }
  return text;
}

VolumeSizeDistribution fine_table(const LognormalSizeDistribution& sizes, int radii) {
  VolumeSizeDistribution table;
  for (int i = 0; i < radii; ++i) {
    const double r =
        sizes.smallest_radius_um * std::pow(sizes.largest_radius_um / sizes.smallest_radius_um,
                                            static_cast<double>(i) / (radii - 1));
    table.radius_um.push_back(r);
    // The ends lie inside the cut but for rounding.
    const double inside = std::clamp(r, sizes.smallest_radius_um, sizes.largest_radius_um);
    table.volume_um3_per_um2.push_back(sizes.per_log_radius(inside) * 4.0 / 3.0 * std::numbers::pi *
                                       r * r * r);
  }
  return table;
}

TEST(VolumeSizeDistribution, FineTableOfALognormalHasItsOptics) {
  const LognormalSizeDistribution lognormal{0.07, 2.0, 0.005, 10.0};
  const VolumeSizeDistribution table = fine_table(lognormal, 200);
  EXPECT_NEAR(table.number_per_um2(), lognormal.moment(0, 10.0), 2e-3 * lognormal.moment(0, 10.0));
  EXPECT_NEAR(table.volume_um(), 4.0 / 3.0 * std::numbers::pi * lognormal.moment(3, 10.0),
              2e-3 * table.volume_um());
  const std::vector<double> nm = {450, 800};
  const std::vector<std::complex<double>> index(2, kIndex);
  const ParticleOptics optics = optics_of_sizes(table, "x", nm, index);
  EXPECT_EQ(optics.per, OpticsPer::kParticlePerCm3);
  for (std::size_t w = 0; w < nm.size(); ++w) {
    const ComponentOptics whole = integrate_spheres(lognormal, kIndex, nm[w], 300);
    const double particles = lognormal.moment(0, 10.0);  // of the cut distribution
    EXPECT_NEAR(optics.optics[w].scattering_per_km, whole.scattering_per_km / particles,
                5e-3 * whole.scattering_per_km);
    EXPECT_NEAR(optics.optics[w].absorption_per_km, whole.absorption_per_km / particles,
                5e-3 * whole.absorption_per_km);
    EXPECT_NEAR(optics.optics[w].asymmetry, whole.asymmetry, 5e-3);
    const SpheresAtWavelength spheres[] = {{lognormal, kIndex, nm[w], 300}};
    const PhaseMatrix wanted = sphere_phases(spheres).front();
    EXPECT_NEAR(phase_normalisation(optics.phase[w]), 1.0, 1e-12);
    for (std::size_t i = 0; i < wanted.p11.size(); ++i) {
      EXPECT_NEAR(optics.phase[w].p11[i], wanted.p11[i], 5e-3 * wanted.p11[i]);
      EXPECT_NEAR(optics.phase[w].p12[i], wanted.p12[i], 5e-3 * wanted.p11[i]);
    }
  }
}

TEST(VolumeSizeDistribution, NumberAndVolumeAreTheIntegralsOfTheInterpolant) {
  VolumeSizeDistribution table;
  table.radius_um = {0.1, 0.3, 2.0};
  table.volume_um3_per_um2 = {0.2, 0.5, 0.1};
  const SizeDistribution sizes = table.per_um2();
  double number = 0, volume = 0;
  const int steps = 200000;
  const double step = std::log(20.0) / steps;
  for (int i = 0; i < steps; ++i) {
    const double r = 0.1 * std::exp((i + 0.5) * step);
    number += sizes.per_log_radius(r) * step;
    volume += sizes.per_log_radius(r) * step * 4.0 / 3.0 * std::numbers::pi * r * r * r;
  }
  EXPECT_NEAR(table.number_per_um2(), number, 1e-6 * number);
  EXPECT_NEAR(table.volume_um(), volume, 1e-6 * volume);
  EXPECT_NEAR(table.per_particle().per_log_radius(0.2) * number, sizes.per_log_radius(0.2),
              1e-6 * sizes.per_log_radius(0.2));
}

TEST(VolumeSizeDistribution, OpticalDepthScalesWithTheVolume) {
  VolumeSizeDistribution table;
  table.radius_um = aeronet_radii();
  for (const double r : table.radius_um) table.volume_um3_per_um2.push_back(two_modes(r));
  const double depth = column_optical_depth(table, 550.0, kIndex);
  // Number times the cross section of one particle: 1 um^2 = 1e3 (1e-3 km^-1 cm^3).
  const ComponentOptics one = integrate_spheres(table.per_particle(), kIndex, 550.0, 300);
  EXPECT_NEAR(depth, table.number_per_um2() * one.extinction_per_km() * 1e3, 1e-10 * depth);
  for (double& v : table.volume_um3_per_um2) v *= 3.0;
  EXPECT_NEAR(column_optical_depth(table, 550.0, kIndex), 3.0 * depth, 1e-12 * depth);
}

TEST(SizeDistributionFile, GeometricLimitOfLargeSpheres) {
  // Q_ext = 2 for large spheres: optical depth is 3/2 of volume over radius.
  VolumeSizeDistribution table;
  table.radius_um = {19.0, 20.0, 21.0};
  table.volume_um3_per_um2 = {0.0, 1.0, 0.0};
  EXPECT_NEAR(column_optical_depth(table, 400.0, {1.45, -0.05}), 1.5 * table.volume_um() / 20.0,
              0.05 * 1.5 * table.volume_um() / 20.0);
}

TEST(SizeDistributionFile, AeronetsRetrievalsAreRead) {
  const TemporaryFolder folder;
  const auto file = folder.write("place.siz", aeronet_file({1.0, -1.0, 3.0}));
  const auto rows = read_size_distributions(file);
  ASSERT_EQ(rows.size(), 2u);  // the row of -999 is none
  EXPECT_EQ(rows[0].when, "15:08:2019 21:46:10");
  EXPECT_EQ(rows[1].when, "15:08:2019 21:46:12");
  for (std::size_t i = 0; i < 22; ++i) {
    EXPECT_NEAR(rows[0].radius_um[i], aeronet_radii()[i], 5e-7);
    EXPECT_NEAR(rows[0].volume_um3_per_um2[i], two_modes(aeronet_radii()[i]), 5e-7);
    EXPECT_NEAR(rows[1].volume_um3_per_um2[i], 3 * two_modes(aeronet_radii()[i]), 5e-7);
  }
  EXPECT_EQ(read_size_distribution(file, "2").when, rows[1].when);
  EXPECT_EQ(read_size_distribution(file, "15:08:2019 21:46:12").volume_um3_per_um2,
            rows[1].volume_um3_per_um2);
  const VolumeSizeDistribution mean = read_size_distribution(file);
  EXPECT_EQ(mean.when, "average of 2");
  EXPECT_NEAR(mean.volume_um(), 0.5 * (rows[0].volume_um() + rows[1].volume_um()), 1e-12);
  EXPECT_EQ(read_size_distribution(file, "15:08:2019").volume_um3_per_um2, mean.volume_um3_per_um2);
  for (const char* row : {"0", "3", "yesterday", "", "15:08:2018", "15:08:2019 21:46"}) {
    try {
      read_size_distribution(file, row);
      ADD_FAILURE() << row;
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr("row '" + std::string(row) + "'"));
    }
  }
}

TEST(SizeDistributionFile, TwoColumnsAreOneDistribution) {
  const TemporaryFolder folder;
  const auto sizes = read_size_distribution(
      folder.write("own.csv", "# mine\nradius_um,dV_dlnr\n0.1,0.2\n1,0.3\n10,0\n"));
  EXPECT_THAT(sizes.radius_um, testing::ElementsAre(0.1, 1.0, 10.0));
  EXPECT_THAT(sizes.volume_um3_per_um2, testing::ElementsAre(0.2, 0.3, 0.0));
  // Linear in ln r.
  const double r = std::sqrt(0.1);
  EXPECT_NEAR(sizes.per_um2().per_log_radius(r) * 4.0 / 3.0 * std::numbers::pi * r * r * r, 0.25,
              1e-12);
}

struct Malformed {
  const char* what;
  std::string text;
  const char* complaint;
};

TEST(SizeDistributionFile, RefusesWhatIsWrongNamingTheLine) {
  const std::string head = "radius_um,dV_dlnr\n";
  const std::string aeronet = "title\nDate(dd-mm-yyyy),Time(hh:mm:ss),0.05,0.1,0.2,Sky_error\n";
  const std::string start = "15-08-2019,12:00:00,";
  const Malformed cases[] = {
      {"empty", "", "has no header"},
      {"no header", "0.1,0.2\n", "has no header"},
      {"no rows", head, "fewer than 2 radii"},
      {"one radius", head + "0.1,0.2\n", "fewer than 2 radii"},
      {"three columns", head + "0.1,0.2,0.3\n", ":2: row has 3 columns: must have 2"},
      {"a word", head + "0.1,many\n", ":2: column 'dV_dlnr': value 'many'"},
      {"negative", head + "0.1,-0.2\n", ":2: column 'dV_dlnr': value '-0.2'"},
      {"not finite", head + "0.1,inf\n", ":2: column 'dV_dlnr': value 'inf'"},
      {"radius 0", head + "0,0.2\n", ":2: column 'radius_um': value '0'"},
      {"nanometres", head + "100,0.2\n500,0.2\n", ":3: column 'radius_um': value '500'"},
      {"radius twice", head + "0.1,0.2\n0.1,0.3\n", ":3: column 'radius_um': value '0.1'"},
      {"no particles", head + "0.1,0\n1,0\n", ":3: the size distribution holds no particles"},
      {"no radii", "Date(dd-mm-yyyy),Time(hh:mm:ss),Sky_error\n", ":1: header has fewer than 2"},
      {"radii fall", "Date(dd),Time(hh),0.2,0.1\n", ":1: column 'header': value '0.1'"},
      {"no retrievals", aeronet, "has no size distribution"},
      {"only missing ones", aeronet + start + "-999.,-999.,-999.,1\n", "has no size distribution"},
      {"a column short", aeronet + start + "0.1,0.2,0.3\n", ":3: row has 5 columns: must have 6"},
      {"a word in a row", aeronet + start + "0.1,x,0.3,1\n", ":3: column '0.1': value 'x'"},
      {"negative in a row", aeronet + start + "0.1,-1,0.3,1\n", ":3: column '0.1': value '-1'"},
      {"row of zeros", aeronet + start + "0,0,0,1\n", ":3: the size distribution holds no"},
  };
  const TemporaryFolder folder;
  for (const Malformed& c : cases) {
    const auto file = folder.write("bad.siz", c.text);
    try {
      read_size_distributions(file);
      ADD_FAILURE() << c.what << " was accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.string())) << c.what;
      EXPECT_THAT(error.what(), HasSubstr(c.complaint)) << c.what;
    }
  }
  EXPECT_THROW(read_size_distributions(folder.path / "none.siz"), std::runtime_error);
}

TEST(OpticsOfSizes, RefusesWhatDoesNotFit) {
  VolumeSizeDistribution table;
  table.radius_um = {0.1, 1.0};
  table.volume_um3_per_um2 = {0.1, 0.1};
  const std::vector<double> nm = {450, 550};
  const std::vector<std::complex<double>> one(1, kIndex), two(2, kIndex);
  EXPECT_THROW(optics_of_sizes(table, "x", nm, one), std::invalid_argument);
  EXPECT_THROW(optics_of_sizes(table, "x", std::vector<double>{550, 450}, two),
               std::invalid_argument);
  table.radius_um = {1.0, 0.1};
  EXPECT_THROW(optics_of_sizes(table, "x", nm, two), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
