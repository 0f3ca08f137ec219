// Field files: what is written is what is read; another atmosphere's field is refused by name.
#include "output/field_file.h"

#include <gtest/gtest.h>
#include <netcdf.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "output/command_line.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

Scene orders_scene() {
  Scene scene;
  scene.solver.method = "orders";
  scene.sun.elevation_deg = -4.0;
  scene.atmosphere.layers = 6;
  scene.atmosphere.top_km = 40;
  scene.aerosols.phase = "henyey-greenstein";
  scene.spectrum.wavelengths_nm = {450, 550, 700};
  return scene;
}

// Every number another one, none of them round.
template <class Number>
std::vector<Number> numbers(std::size_t count) {
  std::vector<Number> values;
  for (std::size_t i = 0; i < count; ++i) {
    values.push_back(static_cast<Number>(std::exp(-0.37 * static_cast<double>(i % 97)) +
                                         1e-3 * std::sqrt(static_cast<double>(i))));
  }
  return values;
}

OrdersField some_field(bool polarised = true, std::size_t aerosol_levels = 2) {
  OrdersField f;
  f.wavelength_nm = {450, 550, 700};
  f.altitude_km = {0, 1.1, 7.3, 40};
  for (int i = 0; i <= 10; ++i) f.solar_zenith_rad.push_back(std::numbers::pi * i / 10.0);
  f.zenith_step_deg = 18.1;
  f.phase_degree = 2;
  f.polarised = polarised;
  f.aerosol_levels = aerosol_levels;
  f.moments_per_node = aerosol_levels == 0 ? 0 : (polarised ? 18 : 6);
  f.coherency = numbers<float>(4 * 11 * 4 * 3);
  f.aerosol_moments = numbers<float>(aerosol_levels * 11 * f.moments_per_node * 3);
  f.ground_irradiance = numbers<float>(11 * 3);
  f.order_share = numbers<double>(5 * 3);
  f.orders = 6;
  return f;
}

void expect_same(const OrdersField& a, const OrdersField& b) {
  EXPECT_EQ(a.wavelength_nm, b.wavelength_nm);
  EXPECT_EQ(a.altitude_km, b.altitude_km);
  EXPECT_EQ(a.solar_zenith_rad, b.solar_zenith_rad);
  EXPECT_EQ(a.zenith_step_deg, b.zenith_step_deg);
  EXPECT_EQ(a.phase_degree, b.phase_degree);
  EXPECT_EQ(a.polarised, b.polarised);
  EXPECT_EQ(a.aerosol_levels, b.aerosol_levels);
  EXPECT_EQ(a.moments_per_node, b.moments_per_node);
  EXPECT_EQ(a.coherency, b.coherency);
  EXPECT_EQ(a.aerosol_moments, b.aerosol_moments);
  EXPECT_EQ(a.ground_irradiance, b.ground_irradiance);
  EXPECT_EQ(a.order_share, b.order_share);
  EXPECT_EQ(a.orders, b.orders);
}

/// A folder of its own, gone at the end.
class FieldFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() /
              ("twilight_field_" + std::to_string(::getpid()) + "_" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    path_ = folder_ / "field.nc";
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string bytes() const {
    std::ifstream stream(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void write_bytes(const std::string& text) const {
    std::ofstream(path_, std::ios::binary) << text;
  }

  template <class Error>
  void expect_refused(const Scene& scene, const std::vector<std::string>& fragments) const {
    try {
      read_field(path_, build_scene_model(scene));
      ADD_FAILURE() << "accepted; expected a complaint with " << fragments.front();
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      EXPECT_NE(message.find(path_.string()), std::string::npos) << message;
      for (const std::string& fragment : fragments)
        EXPECT_NE(message.find(fragment), std::string::npos)
            << "'" << fragment << "' is not in: " << message;
    }
  }

  fs::path folder_, path_;
};

TEST_F(FieldFile, WhatIsWrittenIsRead) {
  const SceneModel model = build_scene_model(orders_scene());
  for (const bool polarised : {true, false}) {
    for (const std::size_t aerosol_levels : {std::size_t{0}, std::size_t{2}}) {
      OrdersField field = some_field(polarised, aerosol_levels);
      write_field(path_, field, model);
      expect_same(read_field(path_, model), field);
      field.order_share.clear();
      write_field(path_, field, model);
      expect_same(read_field(path_, model), field);
    }
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(FieldFile, SameFieldSameBytesForAnyThreads) {
  Scene scene = orders_scene();
  write_field(path_, some_field(), build_scene_model(scene));
  const std::string first = bytes();
  scene.solver.threads = 2;
  write_field(path_, some_field(), build_scene_model(scene));
  EXPECT_TRUE(bytes() == first);
}

// What a reader that knows nothing of this program needs (CF conventions 1.10, chapters 2 to 5).
TEST_F(FieldFile, CoordinatesFollowTheConventions) {
  write_field(path_, some_field(), build_scene_model(orders_scene()));
  int id = 0;
  ASSERT_EQ(nc_open(path_.c_str(), NC_NOWRITE, &id), NC_NOERR);
  const auto text = [&](int variable, const char* name) {
    std::size_t length = 0;
    EXPECT_EQ(nc_inq_attlen(id, variable, name, &length), NC_NOERR) << name;
    std::string value(length, '\0');
    nc_get_att_text(id, variable, name, value.data());
    return value;
  };
  EXPECT_EQ(text(NC_GLOBAL, "Conventions"), "CF-1.10");
  EXPECT_EQ(text(NC_GLOBAL, "twilight_version"), kVersion);
  EXPECT_NE(text(NC_GLOBAL, "scene").find("method = \"orders\""), std::string::npos);
  const char* coordinates[][3] = {{"altitude", "km", "height"},
                                  {"solar_zenith_angle", "degree", "solar_zenith_angle"},
                                  {"wavelength", "nm", "radiation_wavelength"}};
  for (const auto& [name, units, standard_name] : coordinates) {
    int variable = 0;
    ASSERT_EQ(nc_inq_varid(id, name, &variable), NC_NOERR) << name;
    EXPECT_EQ(text(variable, "units"), units);
    EXPECT_EQ(text(variable, "standard_name"), standard_name);
  }
  std::vector<double> zenith_deg(11);
  int variable = 0;
  ASSERT_EQ(nc_inq_varid(id, "solar_zenith_angle", &variable), NC_NOERR);
  ASSERT_EQ(nc_get_var_double(id, variable, zenith_deg.data()), NC_NOERR);
  for (int i = 0; i <= 10; ++i) EXPECT_NEAR(zenith_deg[static_cast<std::size_t>(i)], 18 * i, 1e-12);
  int variables = 0;
  ASSERT_EQ(nc_inq_nvars(id, &variables), NC_NOERR);
  for (int v = 0; v < variables; ++v) {
    EXPECT_NE(text(v, "units"), "");
    EXPECT_NE(text(v, "long_name"), "");
  }
  nc_close(id);
}

TEST_F(FieldFile, SunObserverAndOutputAreFree) {
  write_field(path_, some_field(), build_scene_model(orders_scene()));
  const std::function<void(Scene&)> free[] = {
      [](Scene& s) { s.sun.elevation_deg = 30; },
      [](Scene& s) { s.sun.azimuth_deg = 12; },
      [](Scene& s) { s.sun.spectrum = "unit"; },
      [](Scene& s) { s.observer.height_m = 400000; },
      [](Scene& s) { s.output.size = 64; },
      [](Scene& s) { s.output.projection = "latlong"; },
      [](Scene& s) { s.solver.threads = 1; },
      [](Scene& s) { s.solver.seed = 7; },
      [](Scene& s) { s.solver.azimuth_divisions = 8; },
      [](Scene& s) { s.solver.polarisation = true; },  // as "auto"
      [](Scene& s) { s.earth.radius_km = 6371; },      // as "auto" without a place
  };
  for (const auto& change : free) {
    Scene scene = orders_scene();
    change(scene);
    EXPECT_NO_THROW(expect_same(read_field(path_, build_scene_model(scene)), some_field()));
  }
}

TEST_F(FieldFile, AnotherAtmosphereIsRefusedByKey) {
  write_field(path_, some_field(), build_scene_model(orders_scene()));
  struct Difference {
    std::vector<std::string> fragments;
    std::function<void(Scene&)> change;
  };
  const Difference differences[] = {
      {{"'earth.radius_km'", "6371", "6400"}, [](Scene& s) { s.earth.radius_km = 6400; }},
      {{"'earth.ground_albedo'", "0.1", "0.2"}, [](Scene& s) { s.earth.ground_albedo = 0.2; }},
      {{"'earth.albedo_wavelengths_nm'", "not set", "[500]"},
       [](Scene& s) {
         s.earth.albedo_wavelengths_nm = {500};
         s.earth.albedo_spectrum = {0.3};
       }},
      {{"'atmosphere.profile'", "us_standard", "tropical"},
       [](Scene& s) { s.atmosphere.profile = "tropical"; }},
      {{"'atmosphere.ozone_du'", "auto", "400"}, [](Scene& s) { s.atmosphere.ozone_du = 400; }},
      {{"'atmosphere.nitrogen_dioxide_du'", "auto", "0.5"},
       [](Scene& s) { s.atmosphere.nitrogen_dioxide_du = 0.5; }},
      {{"'atmosphere.refractive_spreading'", "true", "false"},
       [](Scene& s) { s.atmosphere.refractive_spreading = false; }},
      {{"'aerosols.type'", "continental_average", "urban"},
       [](Scene& s) { s.aerosols.type = "urban"; }},
      {{"'aerosols.optical_depth_550nm'", "auto", "0.3"},
       [](Scene& s) { s.aerosols.optical_depth_550nm = 0.3; }},
      {{"'aerosols.angstrom_exponent'", "auto", "1.2"},
       [](Scene& s) { s.aerosols.angstrom_exponent = 1.2; }},
      {{"'aerosols.humidity'", "mixing-layer", "profile"},
       [](Scene& s) { s.aerosols.humidity = "profile"; }},
      {{"'volcanic_sulfate.optical_depth_550nm'", "0", "0.1"},
       [](Scene& s) { s.volcanic_sulfate.optical_depth_550nm = 0.1; }},
      {{"'dust_layer.optical_depth_550nm'", "0", "0.1"},
       [](Scene& s) { s.dust_layer.optical_depth_550nm = 0.1; }},
      {{"'spectrum.wavelengths_nm'", "[450, 550, 700]", "[450, 550]"},
       [](Scene& s) {
         s.spectrum.wavelengths_nm = {450, 550};
       }},
      {{"'sun.disc_average'", "true", "false"}, [](Scene& s) { s.sun.disc_average = false; }},
      {{"'solver.polarisation'", "true", "false"}, [](Scene& s) { s.solver.polarisation = false; }},
      {{"'solver.scattering_orders'", "auto", "3"},
       [](Scene& s) { s.solver.scattering_orders = 3; }},
      {{"'solver.zenith_step_deg'", "1", "0.5"}, [](Scene& s) { s.solver.zenith_step_deg = 0.5; }},
      {{"'solver.altitude_levels'", "50", "51"}, [](Scene& s) { s.solver.altitude_levels = 51; }},
      {{"'solver.polar_directions'", "32", "25"}, [](Scene& s) { s.solver.polar_directions = 25; }},
      {{"'solver.azimuth_directions'", "16", "13"},
       [](Scene& s) { s.solver.azimuth_directions = 13; }},
      {{"'solver.phase_degree'", "24", "9"}, [](Scene& s) { s.solver.phase_degree = 9; }},
      {{"'solver.order_tolerance'", "0.001", "0.01"},
       [](Scene& s) { s.solver.order_tolerance = 1e-2; }},
      {{"'solver.single_precision'", "true", "false"},
       [](Scene& s) { s.solver.single_precision = false; }},
      {{"'solver.ground_light'", "true", "false"}, [](Scene& s) { s.solver.ground_light = false; }},
  };
  for (const Difference& difference : differences) {
    SCOPED_TRACE(difference.fragments.front());
    Scene scene = orders_scene();
    difference.change(scene);
    expect_refused<std::invalid_argument>(scene, difference.fragments);
  }
  for (const char* method : {"cells", "monte-carlo"}) {
    Scene scene = orders_scene();
    scene.solver.method = method;
    expect_refused<std::invalid_argument>(scene, {"'solver.method'", method, "orders"});
  }
}

// The Earth's radius of curvature goes with place and the Sun's azimuth; a field has one.
TEST_F(FieldFile, PlaceWithAnotherCurvatureIsRefused) {
  Scene scene = orders_scene();
  scene.sun.elevation_deg.reset();
  scene.observer.latitude_deg = 49.25;
  scene.observer.longitude_deg = 6.97;
  scene.observer.time = "2003-12-08T17:00:00+01:00";
  write_field(path_, some_field(), build_scene_model(scene));
  EXPECT_NO_THROW(read_field(path_, build_scene_model(scene)));
  scene.observer.time = "2003-12-08T17:20:00+01:00";
  expect_refused<std::invalid_argument>(scene, {"'earth.radius_km'"});
  scene.earth.radius_km = 6380;
  write_field(path_, some_field(), build_scene_model(scene));
  scene.observer.time = "2003-12-08T17:40:00+01:00";
  EXPECT_NO_THROW(read_field(path_, build_scene_model(scene)));
}

// The path of a user's own layers may change, what they hold may not.
TEST_F(FieldFile, OwnLayersAreComparedByWhatTheyHold) {
  const auto layers =
      [&](const char* name, double scattering) {
        std::ofstream(folder_ / name)
            << "bottom_km,top_km,wavelength_nm,air_scattering_per_km,aerosol_scattering_per_km,"
               "aerosol_asymmetry,absorption_per_km\n0,40,550,"
            << scattering << ",0,0,0\n";
        Scene scene = orders_scene();
        scene.spectrum.wavelengths_nm = {550};
        scene.atmosphere.optical_layers = (folder_ / name).string();
        return scene;
      };
  const Scene scene = layers("a.csv", 0.01);
  OrdersField field = some_field(true, 0);
  field.wavelength_nm = {550};
  field.coherency.resize(field.coherency.size() / 3);
  field.ground_irradiance.resize(field.ground_irradiance.size() / 3);
  field.order_share.resize(field.order_share.size() / 3);
  write_field(path_, field, build_scene_model(scene));
  EXPECT_NO_THROW(read_field(path_, build_scene_model(layers("b.csv", 0.01))));
  expect_refused<std::invalid_argument>(layers("a.csv", 0.02), {"air_scattering", "0.01", "0.02"});
}

// A mixture file may lie elsewhere; what it holds may not change, even where the coefficients do
// not (a matrix might).
TEST_F(FieldFile, MixturesAreComparedByWhatTheyHold) {
  const auto mixture = [&](const char* name, const char* humidity) {
    std::ofstream(folder_ / name) << "[[layer]]\nbottom_km = 0\ntop_km = 2\n"
                                     "relative_humidity_percent = "
                                  << humidity
                                  << "\nnumber_per_cm3 = {WASO = 3000}\n"
                                     "optical_depth_550nm = 0.1\n";
    Scene scene = orders_scene();
    scene.aerosols.mixture = (folder_ / name).string();
    return scene;
  };
  write_field(path_, some_field(), build_scene_model(mixture("a.toml", "50")));
  EXPECT_NO_THROW(read_field(path_, build_scene_model(mixture("b.toml", "50"))));
  expect_refused<std::invalid_argument>(mixture("a.toml", "51"), {"aerosols.mixture", "a.toml"});
  expect_refused<std::invalid_argument>(orders_scene(), {"aerosols.mixture", "none"});
}

TEST_F(FieldFile, UnreadableFilesAreNamed) {
  expect_refused<std::runtime_error>(orders_scene(), {"no such file"});
  write_bytes("[sun]\nelevation_deg = -4\n");
  expect_refused<std::runtime_error>(orders_scene(), {"netCDF"});
  write_bytes("");
  expect_refused<std::runtime_error>(orders_scene(), {"netCDF"});
}

// Cut anywhere or with a byte turned: refused, never read as if whole.
TEST_F(FieldFile, DamagedFilesAreRefused) {
  write_field(path_, some_field(), build_scene_model(orders_scene()));
  const std::string whole = bytes();
  const SceneModel model = build_scene_model(orders_scene());
  for (const double share : {0.1, 0.5, 0.8, 0.9, 0.999}) {
    write_bytes(whole.substr(0, static_cast<std::size_t>(share * double(whole.size()))));
    EXPECT_THROW(read_field(path_, model), std::runtime_error) << share;
  }
  // Data come last and are most of the file; every sampled byte of them is under a checksum.
  // (Only the copy of the zenith angles in degrees is for others to read.)
  int caught = 0, tried = 0;
  for (std::size_t at = whole.size() - 8000; at < whole.size(); at += 61) {
    std::string turned = whole;
    turned[at] = static_cast<char>(turned[at] ^ 0x10);
    write_bytes(turned);
    ++tried;
    try {
      read_field(path_, model);
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("variable '"), std::string::npos) << error.what();
      ++caught;
    }
  }
  EXPECT_GE(caught, tried - 2);
}

// A netCDF file of the right looks that lacks something or has another shape.
TEST_F(FieldFile, MissingAndMisshapenVariablesAreNamed) {
  const SceneModel model = build_scene_model(orders_scene());
  const auto renamed = [&](const char* from, const char* to) {
    write_field(path_, some_field(), model);
    int id = 0, variable = 0;
    ASSERT_EQ(nc_open(path_.c_str(), NC_WRITE, &id), NC_NOERR);
    nc_redef(id);
    if (nc_inq_varid(id, from, &variable) == NC_NOERR) nc_rename_var(id, variable, to);
    nc_close(id);
  };
  for (const char* name :
       {"wavelength", "altitude", "solar_zenith_rad", "coherency", "ground_irradiance",
        "order_share", "aerosol_moments", "air_scattering", "gas_absorption", "ground_albedo"}) {
    renamed(name, "another");
    expect_refused<std::runtime_error>(orders_scene(), {std::string("'") + name + "'", "missing"});
  }
  for (const char* name : {"title", "scene", "earth_radius_km", "zenith_step_deg", "phase_degree",
                           "polarised", "orders"}) {
    write_field(path_, some_field(), model);
    int id = 0;
    ASSERT_EQ(nc_open(path_.c_str(), NC_WRITE, &id), NC_NOERR);
    nc_redef(id);
    ASSERT_EQ(nc_del_att(id, NC_GLOBAL, name), NC_NOERR);
    nc_close(id);
    expect_refused<std::runtime_error>(orders_scene(), {std::string("'") + name + "'"});
  }
  write_field(path_, some_field(), model);
  int id = 0, dimension = 0;
  ASSERT_EQ(nc_open(path_.c_str(), NC_WRITE, &id), NC_NOERR);
  nc_redef(id);
  ASSERT_EQ(nc_inq_dimid(id, "coherency_component", &dimension), NC_NOERR);
  nc_rename_dim(id, dimension, "component");
  nc_close(id);
  expect_refused<std::runtime_error>(orders_scene(), {"'coherency'", "component", "dimensions"});
}

TEST_F(FieldFile, FieldOfTheWrongSizeOrNotFiniteIsNotWritten) {
  const SceneModel model = build_scene_model(orders_scene());
  OrdersField field = some_field();
  field.coherency.pop_back();
  EXPECT_THROW(write_field(path_, field, model), std::logic_error);
  field = some_field();
  field.ground_irradiance[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(write_field(path_, field, model), std::logic_error);
  EXPECT_TRUE(fs::is_empty(folder_));
  EXPECT_THROW(write_field(folder_ / "nowhere" / "field.nc", some_field(), model),
               std::runtime_error);
}

}  // namespace
}  // namespace twilight
