#include "atmosphere/optical_layers.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace twilight {
namespace {

const std::string kHeader =
    "bottom_km,top_km,wavelength_nm,air_scattering_per_km,aerosol_scattering_per_km,"
    "aerosol_asymmetry,absorption_per_km\n";

class OpticalLayers : public testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::temp_directory_path() /
            ("twilight_optical_layers_" + std::to_string(::getpid()) + ".csv");
  }
  void TearDown() override { std::filesystem::remove(path_); }

  void write(const std::string& text) { std::ofstream(path_, std::ios::binary) << text; }

  Medium read(const std::vector<double>& wanted = {}) {
    return read_optical_layers(path_, 6371.0, wanted, 0.0279);
  }
  std::string complaint(const std::string& text, const std::vector<double>& wanted = {}) {
    write(text);
    try {
      read(wanted);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  }
  void expect_complaint(const std::string& text, const std::vector<std::string>& parts) {
    const std::string message = complaint(text);
    EXPECT_NE(message.find(path_.string()), std::string::npos) << message;
    for (const auto& part : parts) EXPECT_NE(message.find(part), std::string::npos) << message;
  }

  std::filesystem::path path_;
};

TEST_F(OpticalLayers, ReadsWhatTheFileSays) {
  write("# two layers\n\n" + kHeader +
        "0,2,600,0.01,0.1,0.7,0.003\n"
        "2,50,600,0.002,0,0,0\n"
        "  # between blocks\n"
        "0, 2, 400 ,0.04,0.2,-0.5,1e-3\r\n"
        "2,50,400,0.008,0,0,0");
  const Medium m = read();
  EXPECT_EQ(m.wavelength_nm, (std::vector<double>{400.0, 600.0}));
  EXPECT_EQ(m.boundary_km, (std::vector<double>{0.0, 2.0, 50.0}));
  EXPECT_EQ(m.air_scattering_per_km(0, 0), 0.04);
  EXPECT_EQ(m.air_scattering_per_km(1, 1), 0.002);
  EXPECT_EQ(m.aerosol_scattering_per_km(0, 1), 0.1);
  EXPECT_EQ(m.aerosol_asymmetry(0, 0), -0.5);
  EXPECT_EQ(m.gas_absorption_per_km(0, 0), 1e-3);
  EXPECT_EQ(m.aerosol_absorption_per_km(0, 0), 0.0);
  EXPECT_EQ(m.refractivity(0, 0), 0.0);
  EXPECT_EQ(m.depolarisation, (std::vector<double>{0.0279, 0.0279}));
  EXPECT_DOUBLE_EQ(m.extinction_per_km(0, 1), 0.113);
  EXPECT_TRUE(m.pressure_hpa.empty());
  EXPECT_EQ(optical_layer_wavelengths(path_), (std::vector<double>{400.0, 600.0}));
}

TEST_F(OpticalLayers, PicksTheWantedWavelengths) {
  write(kHeader + "0,2,400,1,0,0,0\n0,2,500,2,0,0,0\n0,2,600,3,0,0,0\n");
  const Medium m = read({400.0, 600.0000005});
  ASSERT_EQ(m.wavelengths(), 2u);
  EXPECT_EQ(m.air_scattering_per_km(0, 1), 3.0);
  try {
    read({400.0, 550.0});
    FAIL();
  } catch (const std::invalid_argument& e) {
    const std::string message = e.what();
    EXPECT_NE(message.find("550"), std::string::npos);
    EXPECT_NE(message.find("400, 500, 600"), std::string::npos);
  }
  EXPECT_THROW(read({600.0, 400.0}), std::invalid_argument);
}

TEST_F(OpticalLayers, NamesFileLineColumnValueAndRange) {
  const std::string good = "0,2,400,0.04,0.2,0.5,0\n";
  expect_complaint(kHeader + good + "2,x,400,0,0,0,0\n", {":3:", "'top_km'", "'x'", "must be"});
  expect_complaint(kHeader + "0,2,400,nan,0,0,0\n", {":2:", "'air_scattering_per_km'", "'nan'"});
  expect_complaint(kHeader + "0,2,400,inf,0,0,0\n", {":2:", "'air_scattering_per_km'", "'inf'"});
  expect_complaint(kHeader + "0,2,400,1e999,0,0,0\n", {":2:", "'1e999'"});
  expect_complaint(kHeader + "0,2,400,0.1km,0,0,0\n", {":2:", "'0.1km'"});
  expect_complaint(kHeader + "0,2,400,,0,0,0\n", {":2:", "''", "number"});
  expect_complaint(kHeader + "0,2,400,-1,0,0,0\n", {":2:", "'-1'", "0..1000 per km"});
  expect_complaint(kHeader + "0,2,400,0,-1e-9,0,0\n", {"'aerosol_scattering_per_km'"});
  expect_complaint(kHeader + "0,2,400,0,0,1,0\n", {"'aerosol_asymmetry'", "'1'", "-0.999..0.999"});
  expect_complaint(kHeader + "0,2,400,1e300,0,0,0\n", {"'air_scattering_per_km'", "1000"});
  expect_complaint(kHeader + "0,2,400,0,0,-1.5,0\n", {"'aerosol_asymmetry'", "-0.999..0.999"});
  expect_complaint(kHeader + "0,2,400,0,0,0,-2\n", {"'absorption_per_km'"});
  expect_complaint(kHeader + "0,2,0,0,0,0,0\n", {"'wavelength_nm'", "above 0"});
  expect_complaint(kHeader + "0,0,400,0,0,0,0\n", {"'top_km'"});
  expect_complaint(kHeader + "0,501,400,0,0,0,0\n", {"'top_km'", "500"});
  expect_complaint(kHeader + good + "3,4,400,0,0,0,0\n", {":3:", "'bottom_km'", "must be 2"});
  expect_complaint(kHeader + good + "1,4,400,0,0,0,0\n", {":3:", "'bottom_km'", "must be 2"});
  expect_complaint(kHeader + "1,2,400,0,0,0,0\n", {":2:", "'bottom_km'", "ground"});
  expect_complaint(kHeader + good + "2,2,400,0,0,0,0\n", {":3:", "'top_km'"});
}

TEST_F(OpticalLayers, NamesWhatIsWrongWithTheShape) {
  const std::string two = "0,2,400,0,0,0,0\n2,4,400,0,0,0,0\n";
  expect_complaint("", {"empty"});
  expect_complaint("# nothing\n\n", {"empty"});
  expect_complaint(kHeader, {"no rows"});
  expect_complaint("0,2,400,0,0,0,0\n", {":1:", "header"});
  expect_complaint("bottom,top\n", {":1:", "header"});
  expect_complaint(kHeader + "0,2,400,0,0,0\n", {":2:", "6 columns", "7"});
  expect_complaint(kHeader + "0,2,400,0,0,0,0,\n", {":2:", "8 columns"});
  expect_complaint(kHeader + two + "0,3,500,0,0,0,0\n3,4,500,0,0,0,0\n",
                   {":4:", "'top_km'", "must be 2"});
  expect_complaint(kHeader + two + "0,2,500,0,0,0,0\n", {":4:", "'top_km'", "up to 4"});
  expect_complaint(kHeader + two + "0,2,500,0,0,0,0\n0,2,600,0,0,0,0\n2,4,600,0,0,0,0\n", {":4:"});
  expect_complaint(kHeader + two + "0,2,500,0,0,0,0\n2,4,500,0,0,0,0\n4,6,500,0,0,0,0\n",
                   {":6:", "2 layers"});
  expect_complaint(kHeader + two + "0,2,500,0,0,0,0\n2,4,500,0,0,0,0\n" + two,
                   {":6:", "'wavelength_nm'", "one block"});
  std::string many = kHeader;
  for (int i = 0; i <= 500; ++i) {
    many += std::to_string(0.5 * i) + "," + std::to_string(0.5 * (i + 1)) + ",400,0,0,0,0\n";
  }
  expect_complaint(many, {":502:", "500 layers"});
}

TEST_F(OpticalLayers, MissingFileIsAnIoError) {
  EXPECT_THROW(read_optical_layers("/no/such/file.csv", 6371.0, {}, 0.0), std::runtime_error);
  EXPECT_THROW(optical_layer_wavelengths("/no/such/file.csv"), std::runtime_error);
  EXPECT_THROW(read_optical_layers(std::filesystem::temp_directory_path(), 6371.0, {}, 0.0),
               std::runtime_error);
}

TEST_F(OpticalLayers, RejectsParametersOutOfRange) {
  write(kHeader + "0,2,400,0,0,0,0\n");
  EXPECT_THROW(read_optical_layers(path_, 100.0, {}, 0.0), std::invalid_argument);
  EXPECT_THROW(read_optical_layers(path_, 6371.0, {}, 0.9), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
