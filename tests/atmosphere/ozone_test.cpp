#include "atmosphere/ozone.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace twilight {
namespace {

// Serdyuchenko et al. (2014), Atmos. Meas. Tech. 7, 625, at 233 K, means over 10 nm from the given
// wavelength, cm^2, as tabulated in Bruneton's precomputed atmospheric scattering demo: an
// independent measurement. Bogumil's Chappuis band lies 3 to 4.5 % above it throughout (the two
// differ in how they fix the absolute scale), which is the uncertainty of the data themselves.
TEST(OzoneCrossSection, AgreesWithSerdyuchenkoInTheChappuisBand) {
  const auto mean_10nm = [](double from) {
    double sum = 0.0;
    for (int i = 0; i < 10; ++i) sum += ozone_cross_section_cm2(from + i + 0.5);
    return sum / 10.0;
  };
  EXPECT_NEAR(mean_10nm(470.0) / 4.9240e-22, 1.0, 0.05);
  EXPECT_NEAR(mean_10nm(500.0) / 1.4800e-21, 1.0, 0.05);
  EXPECT_NEAR(mean_10nm(550.0) / 3.5e-21, 1.0, 0.05);
  EXPECT_NEAR(mean_10nm(600.0) / 5.0190e-21, 1.0, 0.05);
  EXPECT_NEAR(mean_10nm(650.0) / 2.2380e-21, 1.0, 0.05);
  EXPECT_NEAR(mean_10nm(700.0) / 7.4550e-22, 1.0, 0.05);
}

TEST(OzoneCrossSection, IsNowhereNegativeAndContinuous) {
  for (int nm = 281; nm < 1000; ++nm) {
    const double here = ozone_cross_section_cm2(nm);
    ASSERT_GE(here, 0.0);
    ASSERT_NEAR(ozone_cross_section_cm2(nm - 1e-9), here, 1e-6 * here) << nm;
    ASSERT_NEAR(ozone_cross_section_cm2(nm + 1e-9), here, 1e-6 * here) << nm;
  }
  EXPECT_EQ(ozone_cross_section_cm2(1000.0), 0.0);
}

// The Huggins band falls by four orders of magnitude from 280 to 350 nm; the Chappuis band peaks
// near 602 nm (Gorshelev et al. 2014).
TEST(OzoneCrossSection, HasItsBands) {
  EXPECT_GT(ozone_cross_section_cm2(280.0) / ozone_cross_section_cm2(350.0), 1e4);
  double peak_nm = 0.0;
  for (double nm = 400.0; nm <= 800.0; nm += 1.0) {
    if (ozone_cross_section_cm2(nm) > ozone_cross_section_cm2(std::max(peak_nm, 400.0)))
      peak_nm = nm;
  }
  EXPECT_NEAR(peak_nm, 602.0, 2.0);
}

TEST(OzoneCrossSection, RejectsWavelengthsOutOfRange) {
  EXPECT_THROW(ozone_cross_section_cm2(279.9), std::invalid_argument);
  EXPECT_THROW(ozone_cross_section_cm2(1000.1), std::invalid_argument);
  EXPECT_THROW(ozone_cross_section_cm2(std::nan("")), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
