#include "solar/limb_darkening.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace twilight {
namespace {

TEST(LimbDarkening, MeanOverTheDiscIsOne) {
  for (const double nm : {280.0, 350.0, 379.0, 400.0, 550.0, 1000.0}) {
    const LimbDarkening limb(nm);
    constexpr int kRings = 2000;
    double sum = 0;
    for (int i = 0; i < kRings; ++i) {
      const double mu = (i + 0.5) / kRings;
      sum += 2 * mu * limb(mu) / kRings;
    }
    EXPECT_NEAR(sum, 1, 1e-6) << nm;
  }
}

// Cox (2000), Allen's Astrophysical Quantities, Sec. 14.7: I / I_centre = 1 - u - v + u mu + v mu^2
// with u = 0.99, v = -0.17 at 450 nm, 0.93, -0.23 at 550 nm and 0.73, -0.22 at 800 nm. Nearer the
// limb a quadratic no longer follows the disc.
TEST(LimbDarkening, AgreesWithAllensQuadraticLaw) {
  struct Row {
    double nm, u, v;
  };
  for (const Row& row : {Row{450, 0.99, -0.17}, Row{550, 0.93, -0.23}, Row{800, 0.73, -0.22}}) {
    const LimbDarkening limb(row.nm);
    for (const double mu : {0.5, 0.7, 0.9}) {
      const double allen = 1 - row.u - row.v + row.u * mu + row.v * mu * mu;
      EXPECT_NEAR(limb(mu) / limb(1), allen, 0.012) << row.nm << " " << mu;
    }
  }
}

TEST(LimbDarkening, StrongerInTheBlue) {
  EXPECT_LT(LimbDarkening(400)(0.3) / LimbDarkening(400)(1),
            LimbDarkening(700)(0.3) / LimbDarkening(700)(1));
}

TEST(LimbDarkening, RefusesBadWavelengths) {
  EXPECT_THROW(LimbDarkening(0), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
