#include "aerosols/mixtures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "aerosols/components.h"
#include "tests/aerosols/opac_component_optics.h"

namespace twilight {
namespace {

double extinction(const AerosolLayer& layer, std::size_t w) {
  return layer.scattering_per_km[w] + layer.absorption_per_km[w];
}

double albedo(const AerosolLayer& layer, std::size_t w) {
  return layer.scattering_per_km[w] / extinction(layer, w);
}

// OPAC's own program output for continental polluted at 80 %, 550 nm (OPAC 3.1, kept by IPSL):
// extinction 0.1746 km^-1, scattering 0.1558, absorption 0.01877, single-scattering albedo
// 0.8925, asymmetry 0.6977, optical depth 0.3270, visibility 16.12 km.
// Here: 0.17478, 0.15601, 0.01877, 0.89261, 0.69743, 0.3274. The figures differ beyond the
// print because OPAC's coarse radius grid makes its humid WASO row 0.14 % low at 550 nm (the
// rows scatter by 0.1 % from wavelength to wavelength) and because of its angular rule for g;
// MixingRuleGivesOpacDigits shows that nothing else differs.
TEST(OpacMixture, ContinentalPollutedAsOpacPrints) {
  const double wavelength_nm[] = {550.0};
  const auto layers = opac_aerosol_layers("continental_polluted", 80.0, wavelength_nm);
  ASSERT_EQ(layers.size(), 3u);
  EXPECT_NEAR(extinction(layers[0], 0) / 0.1746, 1.0, 0.0015);
  EXPECT_NEAR(layers[0].scattering_per_km[0] / 0.1558, 1.0, 0.0015);
  EXPECT_NEAR(layers[0].absorption_per_km[0], 0.01877, 0.5e-5);
  EXPECT_NEAR(albedo(layers[0], 0), 0.8925, 0.0002);
  EXPECT_NEAR(layers[0].asymmetry[0], 0.6977, 0.0005);
  const double depth =
      optical_depth(layers[0], 0) + optical_depth(layers[1], 0) + optical_depth(layers[2], 0);
  EXPECT_NEAR(depth, 0.327, 0.0005);
  // OPAC's visibility: 3.0 / (extinction + 0.01159 km^-1 of air).
  EXPECT_NEAR(3.0 / (extinction(layers[0], 0) + 0.01159) / 16.12, 1.0, 0.0015);
}

// The number densities with OPAC's own component rows reproduce OPAC's program output for
// continental polluted (above) to every digit.
TEST(OpacMixture, MixingRuleGivesOpacDigits) {
  const auto per_cm3 = ground_number_densities_per_cm3("continental_polluted");
  double extinction = 0.0, scattering = 0.0, cosine = 0.0;
  for (const opac::PublishedOptics& row : opac::kPublishedOptics) {
    const AerosolComponent c = row.component;
    const bool humid = component_states(c).size() > 1;
    if (row.wavelength_nm != 550.0 || row.humidity_percent != (humid ? 80.0 : 0.0)) continue;
    const double density = per_cm3[static_cast<std::size_t>(c)];
    const double part = density * row.extinction_per_km * row.single_scattering_albedo;
    extinction += density * row.extinction_per_km;
    scattering += part;
    cosine += part * row.asymmetry;
  }
  EXPECT_NEAR(extinction, 0.1746, 0.5e-4);
  EXPECT_NEAR(scattering, 0.1558, 0.5e-4);
  EXPECT_NEAR(scattering / extinction, 0.8925, 0.5e-4);
  EXPECT_NEAR(cosine / scattering, 0.6977, 0.5e-4);
  const double wavelength_nm[] = {550.0};
  const auto layers = opac_aerosol_layers("continental_polluted", 80.0, wavelength_nm);
  EXPECT_NEAR(extinction * 2.0 * layers[0].profile.mean(0.0, 2.0) + optical_depth(layers[1], 0) +
                  optical_depth(layers[2], 0),
              0.3270, 0.5e-4);
}

// Mixing layer at the ground at 80 %, 550 nm, Angstrom exponents and optical depths of its
// layers: OPAC's mixing rule applied to OPAC's component files (Hess, Koepke & Schult 1998).
struct TypeRow {
  std::string name;
  double extinction_per_km, albedo, asymmetry, angstrom_350_500, angstrom_500_800;
  double depth_mixing, depth_troposphere, depth_stratosphere, depth;
};

const std::vector<TypeRow>& published_types() {
  static const std::vector<TypeRow> rows = {
      {"continental_clean", 0.02619, 0.9720, 0.7086, 1.098, 1.422, 0.04635, 0.01316, 0.00492,
       0.0644},
      {"continental_average", 0.07508, 0.9253, 0.7034, 1.112, 1.423, 0.13287, 0.01316, 0.00492,
       0.1509},
      {"continental_polluted", 0.17457, 0.8925, 0.6977, 1.134, 1.452, 0.30892, 0.01316, 0.00492,
       0.3270},
      {"urban", 0.35312, 0.8170, 0.6889, 1.144, 1.428, 0.62487, 0.01316, 0.00492, 0.6430},
      {"desert", 0.14467, 0.8879, 0.7287, 0.204, 0.169, 0.27494, 0.00590, 0.00492, 0.2858},
      {"maritime_clean", 0.08994, 0.9975, 0.7720, 0.124, 0.084, 0.07776, 0.01316, 0.00492, 0.0958},
      {"maritime_polluted", 0.11485, 0.9753, 0.7565, 0.408, 0.347, 0.09931, 0.01316, 0.00492,
       0.1174},
      {"maritime_tropical", 0.04337, 0.9980, 0.7742, 0.075, 0.043, 0.03750, 0.01316, 0.00492,
       0.0556},
      {"arctic", 0.02259, 0.8875, 0.7215, 0.850, 0.891, 0.04473, 0.01316, 0.00492, 0.0628},
      {"antarctic", 0.01149, 0.9996, 0.7840, 0.338, 0.730, 0.06556, 0.00150, 0.00492, 0.0720},
  };
  return rows;
}

TEST(OpacMixture, AllTypesAsPublished) {
  const double wavelength_nm[] = {350.0, 500.0, 550.0, 800.0};
  for (const TypeRow& row : published_types()) {
    SCOPED_TRACE(row.name);
    const auto layers = opac_aerosol_layers(row.name, 80.0, wavelength_nm);
    ASSERT_EQ(layers.size(), 3u);
    const AerosolLayer& ground = layers[0];
    EXPECT_NEAR(extinction(ground, 2) / row.extinction_per_km, 1.0, 0.002);
    EXPECT_NEAR(albedo(ground, 2), row.albedo, 0.0005);
    EXPECT_NEAR(ground.asymmetry[2], row.asymmetry, 0.001);
    const auto angstrom = [&](std::size_t a, std::size_t b) {
      return -std::log(extinction(ground, b) / extinction(ground, a)) /
             std::log(wavelength_nm[b] / wavelength_nm[a]);
    };
    EXPECT_NEAR(angstrom(0, 1), row.angstrom_350_500, 0.005);
    EXPECT_NEAR(angstrom(1, 3), row.angstrom_500_800, 0.005);
    EXPECT_NEAR(optical_depth(ground, 2) / row.depth_mixing, 1.0, 0.002);
    EXPECT_NEAR(optical_depth(layers[1], 2), row.depth_troposphere, 0.003 * row.depth_troposphere);
    EXPECT_NEAR(optical_depth(layers[2], 2), row.depth_stratosphere,
                0.003 * row.depth_stratosphere);
    EXPECT_NEAR(
        (optical_depth(ground, 2) + optical_depth(layers[1], 2) + optical_depth(layers[2], 2)) /
            row.depth,
        1.0, 0.002);
  }
}

// Free-tropospheric (extrapolated to z = 0) and stratospheric extinction, km^-1, of the
// OPAC/GADS background file extback.dat (Koepke, Hess, Schult & Shettle 1997).
TEST(OpacMixture, BackgroundAsPublished) {
  struct Row {
    double wavelength_nm, troposphere_per_km, stratosphere_per_km;
  };
  const std::vector<Row> rows = {
      {300, 0.00606, 0.000324}, {350, 0.00521, 0.000303}, {400, 0.00449, 0.000278},
      {450, 0.00389, 0.000254}, {500, 0.00339, 0.000233}, {550, 0.00296, 0.000214},
      {600, 0.0026, 0.000195},  {650, 0.0023, 0.000179},  {700, 0.00204, 0.000163},
      {750, 0.00183, 0.000149}, {800, 0.00161, 0.000137}, {900, 0.00132, 0.000115},
      {1000, 0.00109, 9.66e-05}};
  for (const Row& row : rows) {
    const double wavelength_nm[] = {row.wavelength_nm};
    const auto layers = opac_aerosol_layers("urban", 0.0, wavelength_nm);
    EXPECT_NEAR(extinction(layers[1], 0) / row.troposphere_per_km, 1.0, 0.005) << row.wavelength_nm;
    EXPECT_NEAR(extinction(layers[2], 0) / row.stratosphere_per_km, 1.0, 0.005)
        << row.wavelength_nm;
  }
}

TEST(OpacMixture, LayersJoinFromTheGroundTo35Km) {
  const double wavelength_nm[] = {550.0};
  ASSERT_EQ(aerosol_types().size(), 10u);
  for (const std::string_view type : aerosol_types()) {
    const auto layers = opac_aerosol_layers(type, 50.0, wavelength_nm);
    ASSERT_EQ(layers.size(), 3u);
    EXPECT_EQ(layers[0].profile.bottom_km, 0.0);
    EXPECT_EQ(layers[0].profile.top_km, layers[1].profile.bottom_km);
    EXPECT_EQ(layers[1].profile.top_km, 12.0);
    EXPECT_EQ(layers[2].profile.bottom_km, 12.0);
    EXPECT_EQ(layers[2].profile.top_km, 35.0);
    EXPECT_TRUE(std::isinf(layers[2].profile.scale_height_km));
  }
}

TEST(OpacMixture, PhysicalOverTheWholeTable) {
  std::vector<double> wavelength_nm;
  for (double w = 280.0; w <= 1000.0; w += 2.5) wavelength_nm.push_back(w);
  for (const std::string_view type : aerosol_types()) {
    for (const double humidity : {0.0, 33.0, 60.0, 85.0, 99.0}) {
      for (const AerosolLayer& layer : opac_aerosol_layers(type, humidity, wavelength_nm)) {
        ASSERT_EQ(layer.scattering_per_km.size(), wavelength_nm.size());
        ASSERT_EQ(layer.absorption_per_km.size(), wavelength_nm.size());
        ASSERT_EQ(layer.asymmetry.size(), wavelength_nm.size());
        for (std::size_t w = 0; w < wavelength_nm.size(); ++w) {
          EXPECT_GT(layer.scattering_per_km[w], 0.0);
          EXPECT_GE(layer.absorption_per_km[w], 0.0);
          EXPECT_GT(layer.asymmetry[w], 0.3);
          EXPECT_LT(layer.asymmetry[w], 1.0);
        }
      }
    }
  }
}

TEST(OpacMixture, HumidityActsOnTheMixingLayerOnly) {
  const double wavelength_nm[] = {550.0};
  const auto dry = opac_aerosol_layers("continental_average", 0.0, wavelength_nm);
  const auto wet = opac_aerosol_layers("continental_average", 95.0, wavelength_nm);
  EXPECT_GT(extinction(wet[0], 0), 2.0 * extinction(dry[0], 0));
  EXPECT_EQ(extinction(wet[1], 0), extinction(dry[1], 0));
  EXPECT_EQ(extinction(wet[2], 0), extinction(dry[2], 0));
}

TEST(OpacMixture, NoneIsEmpty) {
  const double wavelength_nm[] = {550.0};
  EXPECT_TRUE(opac_aerosol_layers("none", 50.0, wavelength_nm).empty());
}

TEST(OpacMixture, UnknownTypeListsTheNames) {
  const double wavelength_nm[] = {550.0};
  try {
    opac_aerosol_layers("martian", 50.0, wavelength_nm);
    FAIL();
  } catch (const std::invalid_argument& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("martian"), std::string::npos);
    EXPECT_NE(message.find("none"), std::string::npos);
    for (const std::string_view type : aerosol_types()) {
      EXPECT_NE(message.find(type), std::string::npos) << type;
    }
  }
}

TEST(OpacMixture, RejectsValuesOutOfRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double good[] = {550.0}, ultraviolet[] = {550.0, 250.0}, infrared[] = {1001.0};
  EXPECT_THROW(opac_aerosol_layers("urban", -1.0, good), std::invalid_argument);
  EXPECT_THROW(opac_aerosol_layers("urban", 99.1, good), std::invalid_argument);
  EXPECT_THROW(opac_aerosol_layers("urban", nan, good), std::invalid_argument);
  EXPECT_THROW(opac_aerosol_layers("none", 120.0, good), std::invalid_argument);
  EXPECT_THROW(opac_aerosol_layers("urban", 50.0, ultraviolet), std::invalid_argument);
  EXPECT_THROW(opac_aerosol_layers("urban", 50.0, infrared), std::invalid_argument);
}

AerosolLayer exponential_layer() {
  AerosolLayer layer;
  layer.profile.bottom_km = 2.0;
  layer.profile.top_km = 12.0;
  layer.profile.scale_height_km = 8.0;
  layer.scattering_per_km = {0.3};
  layer.absorption_per_km = {0.1};
  layer.asymmetry = {0.6};
  return layer;
}

TEST(AerosolProfile, DepthOfAnExponentialLayer) {
  EXPECT_NEAR(optical_depth(exponential_layer(), 0),
              0.4 * 8.0 * (std::exp(-2.0 / 8.0) - std::exp(-12.0 / 8.0)), 1e-14);
}

TEST(AerosolProfile, DepthOfAConstantLayer) {
  AerosolLayer layer = exponential_layer();
  layer.profile.scale_height_km = std::numeric_limits<double>::infinity();
  EXPECT_DOUBLE_EQ(optical_depth(layer, 0), 4.0);
  EXPECT_DOUBLE_EQ(layer.profile.mean(3.0, 5.0), 1.0);
  layer.profile.scale_height_km = 1e9;  // the limit is approached
  EXPECT_NEAR(optical_depth(layer, 0), 4.0, 1e-6);
}

TEST(AerosolProfile, SlicesAddUpToTheLayer) {
  const AerosolLayer layer = exponential_layer();
  double sum = 0.0, from_means = 0.0;
  for (int i = 0; i < 70; ++i) {  // slices 0.5 km thick from -0.2 km cut both ends
    const double z0 = -0.2 + 0.5 * i, z1 = -0.2 + 0.5 * (i + 1);
    sum += optical_depth_between(layer, 0, z0, z1);
    from_means += 0.4 * layer.profile.mean(z0, z1) * (z1 - z0);
  }
  EXPECT_NEAR(sum, optical_depth(layer, 0), 1e-13);
  EXPECT_NEAR(from_means, optical_depth(layer, 0), 1e-12);
}

TEST(AerosolProfile, MeanOfAThinSliceIsTheProfileAtItsHeight) {
  EXPECT_NEAR(exponential_layer().profile.mean(5.0 - 1e-9, 5.0 + 1e-9), std::exp(-5.0 / 8.0), 1e-9);
}

TEST(AerosolProfile, NothingOutsideTheLayer) {
  const AerosolLayer layer = exponential_layer();
  EXPECT_EQ(layer.profile.mean(0.0, 2.0), 0.0);
  EXPECT_EQ(layer.profile.mean(12.0, 20.0), 0.0);
  EXPECT_EQ(optical_depth_between(layer, 0, 12.0, 99.0), 0.0);
  // Half inside: half the mean.
  EXPECT_NEAR(layer.profile.mean(11.0, 13.0), 0.5 * layer.profile.mean(11.0, 12.0), 1e-15);
}

TEST(AerosolProfile, RejectsBadIntervals) {
  const AerosolLayer layer = exponential_layer();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(layer.profile.mean(3.0, 3.0), std::invalid_argument);
  EXPECT_THROW(layer.profile.mean(4.0, 3.0), std::invalid_argument);
  EXPECT_THROW(layer.profile.mean(nan, 3.0), std::invalid_argument);
  EXPECT_THROW(optical_depth_between(layer, 0, 4.0, 3.0), std::invalid_argument);
  EXPECT_THROW(optical_depth_between(layer, 1, 3.0, 4.0), std::out_of_range);
  EXPECT_EQ(optical_depth_between(layer, 0, 3.0, 3.0), 0.0);
}

}  // namespace
}  // namespace twilight
