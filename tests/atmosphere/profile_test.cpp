#include "atmosphere/profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

// AFGL-TR-86-0110 (Anderson et al. 1986), model 6, level 12 km.
TEST(Profile, GivesItsLevels) {
  const ProfileLevel level = Profile::named("us_standard").at(12.0);
  EXPECT_DOUBLE_EQ(level.pressure_hpa, 194.0);
  EXPECT_DOUBLE_EQ(level.temperature_k, 216.7);
  EXPECT_DOUBLE_EQ(level.air_per_cm3, 6.48417e18);
  EXPECT_DOUBLE_EQ(level.ozone_per_cm3, 2.00834e12);
  EXPECT_DOUBLE_EQ(level.water_vapour_per_cm3, 1.2368e14);
  EXPECT_DOUBLE_EQ(level.nitrogen_dioxide_per_cm3, 2.04404e8);
}

// U.S. Standard Atmosphere 1976, table I, geometric height -500 m: 291.400 K, 1074.78 hPa,
// 1.28490 kg m^-3 (1.225 and 1013.25 hPa at sea level).
TEST(Profile, GoesOnBelowTheSea) {
  const Profile sea = Profile::named("us_standard");
  const Profile low = sea.over_ground_below_sea(0.5);
  EXPECT_DOUBLE_EQ(low.top_km(), 120.5);
  EXPECT_NEAR(low.at(0.0).pressure_hpa / sea.at(0.0).pressure_hpa, 1074.78 / 1013.25, 2e-3);
  EXPECT_NEAR(low.at(0.0).temperature_k, 291.4, 0.15);
  EXPECT_NEAR(low.at(0.0).air_per_cm3 / sea.at(0.0).air_per_cm3, 1.28490 / 1.225, 2e-3);
  EXPECT_NEAR(low.at(0.5 + 7.3).air_per_cm3 / sea.at(7.3).air_per_cm3, 1, 1e-12);
  EXPECT_NEAR(low.at(0.5 - 1e-9).air_per_cm3 / sea.at(0.0).air_per_cm3, 1, 1e-8);
  EXPECT_THROW(sea.over_ground_below_sea(1.1), std::invalid_argument);
  EXPECT_THROW(sea.over_ground_below_sea(-0.1), std::invalid_argument);
}

// p = n k T; the tables are rounded to 3..5 digits, fewer above 85 km, where they stop being of
// one mean molecular mass.
TEST(Profile, ObeysTheIdealGasLaw) {
  for (const auto name : Profile::names()) {
    if (name == "exponential") continue;
    const Profile profile = Profile::named(name);
    for (const ProfileLevel& l : profile.levels()) {
      if (l.height_km > 70.0) continue;
      const double pressure_hpa = l.air_per_cm3 * 1.380649e-19 * l.temperature_k;
      EXPECT_NEAR(pressure_hpa / l.pressure_hpa, 1.0, 0.005) << name << ' ' << l.height_km;
    }
  }
  const ProfileLevel ground = Profile::named("exponential").at(0.0);
  EXPECT_NEAR(ground.air_per_cm3 * 1.380649e-19 * 288.15, 1013.25, 0.05);
}

// Weight of the column: m g N = p, with 28.964 g/mol and g falling from 9.80665 m/s^2 with height
// (mean of 1/r^2 over the mass is 0.9977).
TEST(Profile, ColumnWeighsTheGroundPressure) {
  for (const auto name : Profile::names()) {
    if (name == "exponential") continue;
    const Profile profile = Profile::named(name);
    const double column_per_m2 =
        profile.power_integral(&ProfileLevel::air_per_cm3, 1.0, 0.0, 120.0) * 1e9;
    const double pressure_hpa =
        column_per_m2 * 28.964e-3 / 6.02214076e23 * 9.80665 * 0.9977 / 100.0;
    EXPECT_NEAR(pressure_hpa / profile.at(0.0).pressure_hpa, 1.0, 0.006) << name;
  }
}

TEST(Profile, IsContinuousAndLogLinear) {
  const Profile profile = Profile::named("tropical");
  const double a = profile.at(10.0).air_per_cm3;
  const double b = profile.at(11.0).air_per_cm3;
  EXPECT_NEAR(profile.at(10.5).air_per_cm3 / std::sqrt(a * b), 1.0, 1e-14);
  for (double h = 0.5; h < 120.0; h += 0.5) {
    EXPECT_NEAR(profile.at(h).ozone_per_cm3 / profile.at(h - 1e-9).ozone_per_cm3, 1.0, 1e-8);
  }
}

TEST(Profile, MeansIntegrateTheInterpolation) {
  const Profile profile = Profile::named("midlatitude_winter");
  for (const auto gas : {&ProfileLevel::air_per_cm3, &ProfileLevel::ozone_per_cm3,
                         &ProfileLevel::water_vapour_per_cm3}) {
    const double lo = 9.3;
    const double hi = 27.9;
    const int steps = 20000;
    double sum = 0.0;
    for (int i = 0; i < steps; ++i) sum += profile.at(lo + (hi - lo) * (i + 0.5) / steps).*gas;
    EXPECT_NEAR(profile.mean(gas, lo, hi) / (sum / steps), 1.0, 1e-7);
  }
  double sum = 0.0;
  for (int i = 0; i < 20000; ++i) sum += profile.at(9.3 + 18.6 * (i + 0.5) / 20000).temperature_k;
  EXPECT_NEAR(profile.mean_temperature_k(9.3, 27.9), sum / 20000, 1e-6);
}

TEST(Profile, IntegralsAddUp) {
  const Profile profile = Profile::named("us_standard");
  const auto gas = &ProfileLevel::air_per_cm3;
  const double whole = profile.power_integral(gas, 0.25, 0.0, 120.0);
  const double parts =
      profile.power_integral(gas, 0.25, 0.0, 13.7) + profile.power_integral(gas, 0.25, 13.7, 120.0);
  EXPECT_NEAR(parts / whole, 1.0, 1e-13);
  EXPECT_EQ(profile.power_integral(gas, 1.0, 5.0, 5.0), 0.0);
}

TEST(Profile, ExponentialIsThePapers) {
  const Profile profile = Profile::named("exponential");
  for (const double h : {0.0, 0.3, 8.0, 34.9, 150.2}) {
    EXPECT_NEAR(profile.at(h).air_per_cm3 / (kAirAt15CPerCm3 * std::exp(-h / 8.0)), 1.0, 1e-13);
  }
  EXPECT_NEAR(profile.power_integral(&ProfileLevel::ozone_per_cm3, 1.0, 0.0, 200.0) * 1e5,
              300.0 * 2.6867e16, 1e6);
  const double peak = profile.at(22.0).ozone_per_cm3;
  EXPECT_LT(profile.at(20.0).ozone_per_cm3, peak);
  EXPECT_LT(profile.at(24.0).ozone_per_cm3, peak);
}

TEST(Profile, RejectsUnknownNamesAndHeights) {
  try {
    Profile::named("lunar");
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("lunar"), std::string::npos);
    EXPECT_NE(std::string(e.what()).find("us_standard"), std::string::npos);
  }
  const Profile profile = Profile::named("us_standard");
  EXPECT_THROW(profile.at(-0.1), std::invalid_argument);
  EXPECT_THROW(profile.at(120.1), std::invalid_argument);
  EXPECT_THROW(profile.at(std::nan("")), std::invalid_argument);
  EXPECT_THROW(profile.mean(&ProfileLevel::air_per_cm3, 3.0, 3.0), std::invalid_argument);
  EXPECT_THROW(profile.mean_temperature_k(0.0, 130.0), std::invalid_argument);
}

// Saturation over water is 6.112 hPa at 0 C and 23.37 hPa at 20 C (WMO, Goff-Gratch).
TEST(RelativeHumidity, FollowsBolton) {
  EXPECT_NEAR(water_saturation_pressure_hpa(273.15), 6.112, 0.01);
  EXPECT_NEAR(water_saturation_pressure_hpa(293.15), 23.37, 0.03);
  // AFGL US standard, ground: 7750 ppmv of 1013 hPa at 288.2 K is 7.85 hPa of 17.1 hPa.
  const ProfileLevel ground = Profile::named("us_standard").at(0.0);
  EXPECT_NEAR(relative_humidity(ground.water_vapour_per_cm3, ground.temperature_k), 0.459, 0.002);
  EXPECT_EQ(relative_humidity(0.0, 200.0), 0.0);
  EXPECT_EQ(relative_humidity(1e19, 250.0), 1.0);
}

}  // namespace
}  // namespace twilight
