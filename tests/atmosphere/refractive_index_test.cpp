#include "atmosphere/refractive_index.h"

#include <gtest/gtest.h>

#include <cmath>

#include "atmosphere/rayleigh.h"

namespace twilight {
namespace {

double number_per_cm3(double pressure_pa, double celsius) {
  return pressure_pa / (1.380649e-23 * (celsius + 273.15)) * 1e-6;
}

// Ciddor (1996), Table 1: 1e8 (n - 1) of dry air with 450 ppm CO2 at 633 nm.
TEST(Ciddor, DryAirOfTable1) {
  struct Row {
    double celsius, kilopascal, expected;
  };
  for (const Row& r : {Row{20, 80, 21458.0}, Row{20, 100, 26824.4}, Row{20, 120, 32191.6},
                       Row{10, 100, 27774.7}, Row{30, 100, 25937.2}}) {
    const double n = number_per_cm3(1e3 * r.kilopascal, r.celsius);
    EXPECT_NEAR(1e8 * ciddor_refractivity(633.0, n, 0.0) / r.expected, 1.0, 3e-4) << r.expected;
  }
}

// Ciddor (1996), Table 2: moist air at 633 nm, vapour pressures 641..1065 Pa. CO2 differs from 450
// ppm by at most 150, worth 1e-4 of n - 1 at most.
TEST(Ciddor, MoistAirOfTable2) {
  struct Row {
    double celsius, pascal, vapour_pascal, expected;
  };
  for (const Row& r : {Row{19.526, 102094.8, 1065, 27392.9}, Row{19.173, 102993.0, 641, 27682.4},
                       Row{19.188, 102918.8, 706, 27658.7}, Row{19.532, 103603.2, 986, 27802.0}}) {
    const double n = number_per_cm3(r.pascal, r.celsius);
    const double vapour = number_per_cm3(r.vapour_pascal, r.celsius);
    EXPECT_NEAR(1e8 * ciddor_refractivity(633.0, n, vapour) / r.expected, 1.0, 3e-4) << r.expected;
  }
}

// Two measurements of the same air: Peck & Reeder (1972), which Ciddor refitted.
TEST(Ciddor, DryTermAgreesWithPeckAndReeder) {
  for (const double nm : {300.0, 400.0, 550.0, 700.0, 1000.0}) {
    EXPECT_NEAR(ciddor_dry_refractivity(nm) / peck_reeder_refractivity(nm), 1.0, 1e-4) << nm;
  }
}

// Water vapour refracts less than the air it displaces, which is why humid air has a lower index:
// at 20 C and 80 % humidity (18.7 hPa) by 0.25 %.
TEST(Ciddor, HumidityLowersTheIndexSlightly) {
  const double n = number_per_cm3(101325.0, 20.0);
  const double vapour = number_per_cm3(0.8 * 2337.0, 20.0);
  const double change =
      ciddor_refractivity(550.0, n, vapour) / ciddor_refractivity(550.0, n, 0.0) - 1.0;
  EXPECT_NEAR(change, -0.0026, 2e-4);
}

// As printed (Haber et al. 2005, Sec. 4.4): right when dry, four fifths gone at 80 % humidity.
TEST(Haber2005Refractivity, IsAsPrinted) {
  EXPECT_EQ(haber2005_refractivity(550.0, 0.0, 0.0), ciddor_dry_refractivity(550.0));
  EXPECT_NEAR(haber2005_refractivity(550.0, 8.0, 0.0) / ciddor_dry_refractivity(550.0),
              std::exp(-1.0), 1e-14);
  EXPECT_NEAR(haber2005_refractivity(550.0, 0.0, 0.8) / ciddor_dry_refractivity(550.0), 0.209,
              0.001);
  EXPECT_NEAR(haber2005_refractivity(550.0, 0.0, 0.8), 5.8e-5, 0.05e-5);
}

}  // namespace
}  // namespace twilight
