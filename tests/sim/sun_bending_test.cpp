#include "sim/sun_bending.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <vector>

#include "small_scene.h"

namespace twilight {
namespace {

constexpr int kRows = 24, kColumns = 512;

Medium air_at(std::vector<double> wavelengths_nm, double radius_km = 0) {
  Scene scene = small_scene(0);
  scene.atmosphere.layers = 60;
  scene.atmosphere.top_km = 100;
  if (radius_km > 0) scene.earth.radius_km = radius_km;
  scene.spectrum.wavelengths_nm = std::move(wavelengths_nm);
  return build_scene_model(scene).medium;
}

// Differences between the family's tables and their wavelengths' own: of the bending and of the
// shadow's edge over the greatest bending, and of da/dchi.
struct Difference {
  double worst = 0, mean = 0, horizon = 0, mean_derivative = 0;
};
Difference from_own_rays(const Medium& m) {
  const std::vector<BendingTable> family = bending_tables(m, kRows, kColumns);
  Difference e;
  double count = 0;
  for (std::size_t w = 0; w < m.wavelengths(); ++w) {
    const BendingTable own = traced_bending(m, w, kRows, kColumns);
    const double most = static_cast<double>(*std::ranges::max_element(own.bending_rad));
    for (std::size_t i = 0; i < own.horizon_rad.size(); ++i) {
      const double edge = std::abs(family[w].horizon_rad[i] - own.horizon_rad[i]);
      e.horizon = std::max(e.horizon, edge / most);
    }
    for (std::size_t i = 0; i < own.bending_rad.size(); ++i) {
      const auto bent = static_cast<double>(family[w].bending_rad[i] - own.bending_rad[i]);
      e.worst = std::max(e.worst, std::abs(bent) / most);
      e.mean += std::abs(bent) / most;
      e.mean_derivative +=
          std::abs(static_cast<double>(family[w].derivative[i] - own.derivative[i]));
    }
    count += static_cast<double>(own.bending_rad.size());
  }
  e.mean /= count;
  e.mean_derivative /= count;
  return e;
}

// The refractivity differs by 9 % from 280 to 1000 nm and bending is the refractivity's to some
// tenths, so that the cubic term left out is some 1e-6; the mean is that of rows near the ground.
// Rays that graze the boundary of two layers bend with a kink whose place differs from colour to
// colour by a part of a column: there the error is the columns', 1e-4 (5e-7 rad of the Sun's
// place), for the family as for a table of its own (ExactSunlight.AgreesWithTheRaysThemselves).
TEST(SunBending, ColoursBetweenTracedOnes) {
  std::vector<double> nm;
  for (double w = 280; w <= 1000; w += 60) nm.push_back(w);
  const Difference e = from_own_rays(air_at(nm));
  std::printf("bending worst %.1e mean %.1e, horizon %.1e, da/dchi mean %.1e\n", e.worst, e.mean,
              e.horizon, e.mean_derivative);
  EXPECT_LT(e.worst, 1e-4);
  EXPECT_LT(e.mean, 1e-6);
  EXPECT_LT(e.horizon, 1e-5);
  EXPECT_LT(e.mean_derivative, 1e-4);
}

// Up to three wavelengths are traced, and so is every one where rays are nearly ducted, or where
// the same air stands beside itself with half of its refraction, or with more at one height alone.
TEST(SunBending, OwnRaysWhereInterpolationWouldNotDo) {
  Medium half = air_at({400, 450, 550, 700}), bent = half;
  for (std::size_t i = 0; i < half.layers(); ++i) half.refractivity(i, 2) *= 0.5;
  bent.refractivity(10, 1) *= 1.001;
  for (const Medium& m :
       {air_at({400, 550, 700}), air_at({400, 450, 550, 700}, 30000), half, bent}) {
    const Difference e = from_own_rays(m);
    EXPECT_EQ(e.worst, 0);
    EXPECT_EQ(e.horizon, 0);
    EXPECT_EQ(e.mean_derivative, 0);
  }
}

TEST(SunBending, RefusesTablesWithoutNodes) {
  const Medium m = air_at({550});
  EXPECT_THROW(traced_bending(m, 0, 3, 96), std::invalid_argument);
  EXPECT_THROW(bending_tables(m, 24, 7), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
