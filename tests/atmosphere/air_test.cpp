#include "atmosphere/air.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "atmosphere/nitrogen_dioxide.h"
#include "atmosphere/ozone.h"
#include "atmosphere/profile.h"
#include "atmosphere/rayleigh.h"
#include "atmosphere/refractive_index.h"

namespace twilight {
namespace {

const std::vector<double> kWavelengths = {300.0, 400.0, 550.0, 700.0, 1000.0};
constexpr std::size_t k550 = 2;

double column(const Medium& m, const LayerTable& table, std::size_t wavelength) {
  double sum = 0.0;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    sum += table(i, wavelength) * (m.boundary_km[i + 1] - m.boundary_km[i]);
  }
  return sum;
}

// Bodhaine et al. (1999), eq. 30: Rayleigh optical depth at sea level, 1013.25 hPa, 45 N, 0.0971 at
// 550 nm, 0.3602 at 400 nm.
TEST(Air, RayleighOpticalDepthIsBodhaines) {
  for (const char* spacing : {"graded", "even", "equal-air-mass"}) {
    AirOptions options;
    options.layer_spacing = spacing;
    const Medium m = make_air(options, kWavelengths);
    EXPECT_NEAR(column(m, m.air_scattering_per_km, k550) / 0.0971, 1.0, 0.005);
    EXPECT_NEAR(column(m, m.air_scattering_per_km, 1) / 0.36021, 1.0, 0.005);
  }
}

TEST(Air, ColumnsDoNotDependOnTheLayers) {
  for (const auto name : Profile::names()) {
    AirOptions one;
    one.profile = std::string(name);
    one.layers = 1;
    AirOptions many = one;
    many.layers = 500;
    many.snap_boundaries_km = {2.0, 12.0};
    const Medium a = make_air(one, kWavelengths);
    const Medium b = make_air(many, kWavelengths);
    for (std::size_t w = 0; w < kWavelengths.size(); ++w) {
      EXPECT_NEAR(column(a, a.air_scattering_per_km, w) / column(b, b.air_scattering_per_km, w),
                  1.0, 1e-12);
    }
  }
}

TEST(Air, OzoneColumnIsWhatIsAsked) {
  for (const auto name : Profile::names()) {
    for (const char* optics : {"mean", "centre"}) {
      for (const double du : {0.0, 250.0, 1000.0}) {
        AirOptions options;
        options.profile = std::string(name);
        options.layer_optics = optics;
        options.ozone_du = du;
        options.nitrogen_dioxide_du = 0.0;
        options.top_km = 35.0;
        const Medium m = make_air(options, kWavelengths);
        for (std::size_t w = 0; w < kWavelengths.size(); ++w) {
          const double expected =
              du * kMoleculesPerCm2PerDobson * ozone_cross_section_cm2(kWavelengths[w]);
          EXPECT_NEAR(column(m, m.gas_absorption_per_km, w), expected, 1e-12 * expected);
        }
        EXPECT_TRUE(m.vertical_filter_optical_depth.empty());
      }
    }
  }
}

// The US standard ozone profile is commonly quoted as 345 DU; the exponential one is defined to
// hold 300.
TEST(Air, OzoneColumnOfTheProfile) {
  AirOptions options;
  options.nitrogen_dioxide_du = 0.0;
  Medium m = make_air(options, kWavelengths);
  const double unit = kMoleculesPerCm2PerDobson * ozone_cross_section_cm2(550.0);
  EXPECT_NEAR(column(m, m.gas_absorption_per_km, k550) / unit, 345.0, 2.0);
  options.profile = "exponential";
  m = make_air(options, kWavelengths);
  EXPECT_NEAR(column(m, m.gas_absorption_per_km, k550) / unit, 300.0, 1e-6);
}

// Haber et al. (2005), Sec. 4.3: ozone as a filter above the model.
TEST(Air, VerticalOzoneLeavesTheLayersAlone) {
  AirOptions options;
  options.ozone = "vertical";
  options.ozone_du = 300.0;
  options.nitrogen_dioxide_du = 0.0;
  const Medium m = make_air(options, kWavelengths);
  ASSERT_EQ(m.vertical_filter_optical_depth.size(), kWavelengths.size());
  for (std::size_t w = 0; w < kWavelengths.size(); ++w) {
    EXPECT_DOUBLE_EQ(m.vertical_filter_optical_depth[w],
                     300.0 * kMoleculesPerCm2PerDobson * ozone_cross_section_cm2(kWavelengths[w]));
    EXPECT_EQ(column(m, m.gas_absorption_per_km, w), 0.0);
  }
}

// Anderson et al. (1986): the US standard model holds 5.5e15 cm^-2 of nitrogen dioxide, within the
// 2..6e15 measured over clean places; an optical depth of 0.003 at 400..450 nm.
TEST(Air, NitrogenDioxideColumnOfTheProfile) {
  AirOptions options;
  options.ozone_du = 0.0;
  const std::vector<double> w = {400.0, 440.0};
  const Medium m = make_air(options, w);
  const double column_per_cm2 =
      column(m, m.gas_absorption_per_km, 0) / nitrogen_dioxide_cross_section_cm2(400.0);
  EXPECT_NEAR(column_per_cm2, 5.5e15, 0.1e15);
  EXPECT_NEAR(column(m, m.gas_absorption_per_km, 1), 0.003, 0.0005);
  // Most of it lies in the stratosphere.
  double below_15_km = 0.0;
  for (std::size_t i = 0; m.boundary_km[i + 1] < 15.0; ++i) {
    below_15_km += m.gas_absorption_per_km(i, 0) * (m.boundary_km[i + 1] - m.boundary_km[i]);
  }
  EXPECT_LT(below_15_km, 0.15 * column(m, m.gas_absorption_per_km, 0));
}

TEST(Air, NitrogenDioxideColumnIsWhatIsAsked) {
  for (const auto name : Profile::names()) {
    for (const double top_km : {35.0, 100.0, name == "exponential" ? 200.0 : 120.0}) {
      AirOptions options;
      options.profile = std::string(name);
      options.top_km = top_km;
      options.ozone_du = 0.0;
      options.nitrogen_dioxide_du = 0.7;
      const Medium m = make_air(options, kWavelengths);
      for (std::size_t w = 0; w < kWavelengths.size(); ++w) {
        const double expected =
            0.7 * kMoleculesPerCm2PerDobson * nitrogen_dioxide_cross_section_cm2(kWavelengths[w]);
        EXPECT_NEAR(column(m, m.gas_absorption_per_km, w), expected, 1e-12 * expected);
      }
    }
  }
}

TEST(Air, ExponentialHasNoNitrogenDioxideUnlessAsked) {
  AirOptions options;
  options.profile = "exponential";
  options.ozone_du = 0.0;
  const Medium m = make_air(options, kWavelengths);
  EXPECT_EQ(column(m, m.gas_absorption_per_km, 1), 0.0);
}

TEST(Air, CentreTakesTheValueAtTheCentre) {
  AirOptions options;
  options.profile = "exponential";
  options.layer_optics = "centre";
  options.layer_spacing = "equal-air-mass";
  options.top_km = 35.0;
  options.layers = 20;
  const Medium m = make_air(options, kWavelengths);
  const double ground =
      rayleigh_cross_section_cm2(550.0, king_factor(550.0)) * kAirAt15CPerCm3 * 1e5;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    const double centre = 0.5 * (m.boundary_km[i] + m.boundary_km[i + 1]);
    EXPECT_NEAR(m.air_scattering_per_km(i, k550) / (ground * std::exp(-centre / 8.0)), 1.0, 1e-12);
  }
}

TEST(Air, DepolarisationGoesWithTheCrossSection) {
  AirOptions options;
  const Medium king = make_air(options, kWavelengths);
  EXPECT_NEAR(king.depolarisation[k550], 0.02832, 1e-5);
  options.depolarisation = 0.0;
  const Medium none = make_air(options, kWavelengths);
  EXPECT_EQ(none.depolarisation[k550], 0.0);
  EXPECT_NEAR(king.air_scattering_per_km(3, k550) / none.air_scattering_per_km(3, k550),
              king_factor(550.0), 1e-12);
}

TEST(Air, RefractivityOfTheLayers) {
  AirOptions options;
  options.layers = 500;
  const Medium m = make_air(options, kWavelengths);
  // Ground of the US standard: 1013 hPa, 288.2 K, 7.85 hPa of vapour.
  const ProfileLevel ground = Profile::named("us_standard").at(0.0);
  EXPECT_NEAR(m.refractivity(0, k550) /
                  ciddor_refractivity(550.0, ground.air_per_cm3, ground.water_vapour_per_cm3),
              1.0, 0.004);
  for (std::size_t i = 0; i + 1 < m.layers(); ++i) {
    EXPECT_LT(m.refractivity(i + 1, k550), m.refractivity(i, k550));
  }
  options.refraction = false;
  EXPECT_EQ(make_air(options, kWavelengths).refractivity(0, k550), 0.0);
  options.refraction = true;
  options.refractive_index = "haber2005";
  const Medium haber = make_air(options, kWavelengths);
  EXPECT_NEAR(haber.refractivity(0, k550),
              haber2005_refractivity(550.0, 0.5 * haber.boundary_km[1], haber.relative_humidity[0]),
              1e-9);
}

TEST(Air, EveryTableIsSizedFiniteAndNotNegative) {
  for (const auto name : Profile::names()) {
    for (const double top_km : {1.0, 35.0, 120.0}) {
      AirOptions options;
      options.profile = std::string(name);
      options.top_km = top_km;
      options.layers = 40;
      const Medium m = make_air(options, kWavelengths);
      ASSERT_EQ(m.layers(), 40u);
      ASSERT_EQ(m.wavelengths(), kWavelengths.size());
      EXPECT_EQ(m.top_km(), top_km);
      for (const LayerTable* table :
           {&m.air_scattering_per_km, &m.aerosol_scattering_per_km, &m.aerosol_absorption_per_km,
            &m.aerosol_asymmetry, &m.gas_absorption_per_km, &m.refractivity}) {
        ASSERT_EQ(table->size(), 40u * kWavelengths.size());
        for (std::size_t i = 0; i < 40; ++i) {
          for (std::size_t w = 0; w < kWavelengths.size(); ++w) {
            EXPECT_TRUE(std::isfinite((*table)(i, w)) && (*table)(i, w) >= 0.0);
          }
        }
      }
      ASSERT_EQ(m.pressure_hpa.size(), 40u);
      ASSERT_EQ(m.temperature_k.size(), 40u);
      ASSERT_EQ(m.relative_humidity.size(), 40u);
      for (const double rh : m.relative_humidity) EXPECT_TRUE(rh >= 0.0 && rh <= 1.0);
    }
  }
}

TEST(Air, NamesWhatIsOutOfRange) {
  const auto complaint = [](const AirOptions& o, const std::vector<double>& w) -> std::string {
    try {
      make_air(o, w);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  const auto with = [](auto change) {
    AirOptions o;
    change(o);
    return o;
  };
  const std::vector<double> w = {550.0};
  EXPECT_NE(complaint(with([](auto& o) { o.ozone_du = 1001.0; }), w).find("0..1000"),
            std::string::npos);
  EXPECT_NE(complaint(with([](auto& o) { o.nitrogen_dioxide_du = 5.1; }), w).find("0..5"),
            std::string::npos);
  EXPECT_NE(complaint(with([](auto& o) { o.depolarisation = 0.9; }), w).find("[0, 6/7)"),
            std::string::npos);
  EXPECT_NE(complaint(with([](auto& o) { o.top_km = 121.0; }), w).find("1..120"),
            std::string::npos);
  EXPECT_NE(complaint(with([](auto& o) { o.layers = 501; }), w).find("1..500"), std::string::npos);
  EXPECT_NE(complaint(with([](auto& o) { o.ozone = "thick"; }), w).find("thick"),
            std::string::npos);
  EXPECT_NE(complaint(with([](auto& o) { o.layer_optics = "top"; }), w).find("centre"),
            std::string::npos);
  EXPECT_NE(complaint(with([](auto& o) { o.refractive_index = "x"; }), w).find("ciddor"),
            std::string::npos);
  EXPECT_NE(complaint(with([](auto& o) { o.earth_radius_km = 10.0; }), w).find("1000..70000"),
            std::string::npos);
  EXPECT_NE(complaint({}, {279.0}).find("280..1000"), std::string::npos);
  EXPECT_NE(complaint({}, {500.0, 500.0}).find("500"), std::string::npos);
  EXPECT_NE(complaint({}, {}), "");
  EXPECT_NE(complaint({}, {std::nan("")}), "");
}

}  // namespace
}  // namespace twilight
