#include "atmosphere/nitrogen_dioxide.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "atmosphere/profile.h"

namespace twilight {
namespace {

// JPL Publication 94-26 (1994), Table 13: mean over an interval at 0 C and its temperature
// coefficient per degree, here at -40 C.
TEST(NitrogenDioxideCrossSection, DavidsonAsRecommended) {
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(320.0), 24.77e-20 + 40 * 0.786e-22, 1e-22);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(355.0), 47.17e-20 + 40 * 1.921e-22, 1e-22);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(400.0), 60.21e-20 + 40 * 0.599e-22, 1e-22);
}

// Harder et al. (1997), J. Geophys. Res. 102, 3861, at 294 K, means of five figures 1 nm apart
// around these wavelengths. The measurements of that time agree within 10 % (JPL 94-26).
TEST(NitrogenDioxideCrossSection, HarderWithinTenPercent) {
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(345.0) / 4.363e-19, 1.0, 0.1);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(370.0) / 5.724e-19, 1.0, 0.1);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(400.0) / 6.512e-19, 1.0, 0.1);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(420.0) / 6.047e-19, 1.0, 0.1);
}

// Schneider et al. (1987) at 298 K, means over 5 nm: an independent measurement, at another
// temperature, which the table (Bogumil et al. 2003 at 233 K) meets within 10 % band by band.
TEST(NitrogenDioxideCrossSection, SchneiderWithinTenPercent) {
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(425.0) / 54.70e-20, 1.0, 0.1);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(440.0) / 49.27e-20, 1.0, 0.1);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(475.0) / 37.50e-20, 1.0, 0.1);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(500.0) / 18.50e-20, 1.0, 0.1);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(525.0) / 18.05e-20, 1.0, 0.1);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(590.0) / 4.863e-20, 1.0, 0.1);
}

// Largest about 400 nm, fading to nothing in the red; continuous and never negative.
TEST(NitrogenDioxideCrossSection, ColoursTheAirBrown) {
  double largest = 0.0, place_nm = 0.0, before = nitrogen_dioxide_cross_section_cm2(280.0);
  for (double nm = 280.0; nm <= 1000.0; nm += 0.25) {
    const double here = nitrogen_dioxide_cross_section_cm2(nm);
    EXPECT_GE(here, 0.0);
    EXPECT_NEAR(here, before, 0.07e-19) << nm;
    if (here > largest) {
      largest = here;
      place_nm = nm;
    }
    before = here;
  }
  EXPECT_NEAR(place_nm, 400.0, 10.0);
  EXPECT_LT(nitrogen_dioxide_cross_section_cm2(700.0), 0.003 * largest);
  EXPECT_NEAR(nitrogen_dioxide_cross_section_cm2(790.0), 7e-22, 1e-25);
  EXPECT_EQ(nitrogen_dioxide_cross_section_cm2(1000.0), 0.0);
}

TEST(NitrogenDioxideCrossSection, RejectsValuesOutOfRange) {
  for (const double nm : {279.9, 1000.1, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(nitrogen_dioxide_cross_section_cm2(nm), std::invalid_argument);
  }
}

}  // namespace
}  // namespace twilight
