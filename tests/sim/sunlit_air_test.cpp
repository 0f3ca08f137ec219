#include "sim/sunlit_air.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "sim/gauss_legendre.h"
#include "sim/zenith_grid.h"
#include "small_scene.h"
#include "solar/limb_darkening.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kDegree = pi / 180;

Medium real_air(const char* aerosols) {
  Scene scene = small_scene(0);
  scene.atmosphere.layers = 100;
  scene.atmosphere.top_km = 100;
  scene.aerosols.type = aerosols;
  scene.aerosols.phase = "henyey-greenstein";
  scene.spectrum.wavelengths_nm = {400, 700};
  return build_scene_model(scene).medium;
}

struct SunAndTable {
  Medium medium;
  DirectSunlight sunlight;
  OrdersOptions options;
  SunlitAir table;

  static DirectSunlightOptions exact() {
    DirectSunlightOptions o;
    o.exact = true;
    o.refractive_spreading = true;
    return o;
  }
  static OrdersOptions with(bool disc) {
    OrdersOptions o;
    o.disc_average = disc;
    return o;
  }
  SunAndTable(const char* aerosols, bool disc)
      : medium(real_air(aerosols)),
        sunlight(medium, exact()),
        options(with(disc)),
        table(sunlight, options, medium.wavelength_nm, medium.top_km(), 256, 0, 115 * kDegree) {}

  double direct(double altitude_km, double chi, std::size_t w) const {
    std::vector<float> attenuation(sunlight.lanes());
    if (!sunlight.attenuation(altitude_km, std::clamp(chi, 0.0, pi), attenuation.data())) return 0;
    if (attenuation[w] >= DirectSunlight::kOpaque) return 0;
    return std::exp(-static_cast<double>(attenuation[w]));
  }
  double looked_up(double altitude_km, double chi, std::size_t w) const {
    std::vector<float> beam(sunlight.lanes());
    return table.beam(altitude_km, chi, beam.data()) ? static_cast<double>(beam[w]) : 0;
  }
};

constexpr double kEdge_deg = 2 * ZenithGrid::kFineStep_deg;

struct Errors {
  double mean = 0, worst = 0, day = 0, low = 0;
};

// Half of the points over the whole sky, half within 3 degrees of the shadow's edge. Errors are
// absolute, in units of the sunlight above the atmosphere.
template <class Truth>
Errors errors(const SunAndTable& s, const Truth& truth, int points) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  Errors e;
  int low = 0;
  for (int i = 0; i < points; ++i) {
    const double z = 100 * std::pow(unit(random), 2);
    const double shadow = s.sunlight.shadow_zenith_rad(z);
    const double chi = i % 2 ? shadow * unit(random) : shadow - (3 * unit(random) - 0.3) * kDegree;
    for (std::size_t w = 0; w < 2; ++w) {
      const double error = std::abs(s.looked_up(z, chi, w) - truth(z, chi, w));
      e.mean += error / (2 * points);
      if (chi < 80 * kDegree) e.day = std::max(e.day, error);
      if (chi >= 80 * kDegree) {
        e.low += error;
        ++low;
        // Without the disc, light ends abruptly at the shadow's edge, of every colour elsewhere.
        if (std::abs(chi - shadow) > kEdge_deg * kDegree) e.worst = std::max(e.worst, error);
      }
    }
  }
  e.low /= low;
  std::printf("sunlit air: error by day %.1e at most; Sun low %.1e on average, %.1e at most\n",
              e.day, e.low, e.worst);
  return e;
}

TEST(SunlitAir, IsDirectSunlight) {
  for (const char* aerosols : {"none", "continental_average"}) {
    const SunAndTable s(aerosols, false);
    const Errors e = errors(
        s, [&](double z, double chi, std::size_t w) { return s.direct(z, chi, w); }, 4000);
    EXPECT_LE(e.day, 1e-3);
    EXPECT_LE(e.low, 1e-3);
    EXPECT_LE(e.worst, std::string(aerosols) == "none" ? 0.02 : 0.05);
  }
}

// Means of DirectSunlight over the limb-darkened disc by a quadrature of its own: 0.05 degrees are
// the table's resolution of a penumbra of 0.53.
TEST(SunlitAir, DiscIsTheMeanOverItsPoints) {
  const SunAndTable s("continental_average", true);
  std::vector<LimbDarkening> limb;
  for (const double nm : s.medium.wavelength_nm) limb.emplace_back(nm);
  const auto rings = gauss_legendre(10, 0, 1);
  const auto mean = [&](double z, double chi, std::size_t w) {
    double sum = 0;
    constexpr int kAround = 40;
    for (const GaussNode& g : rings) {
      const double rho = kSunAngularRadiusRad * std::sqrt(1 - g.x * g.x);
      for (int k = 0; k < kAround; ++k) {
        const double c = std::cos(chi) * std::cos(rho) +
                         std::sin(chi) * std::sin(rho) * std::cos(2 * pi * (k + 0.5) / kAround);
        sum += 2 * g.weight * g.x * limb[w](g.x) / kAround * s.direct(z, std::acos(c), w);
      }
    }
    return sum;
  };
  const Errors e = errors(s, mean, 700);
  EXPECT_LE(e.day, 1e-3);
  EXPECT_LE(e.low, 1e-3);
  EXPECT_LE(e.worst, 0.01);
}

TEST(SunlitAir, DarkBeyondTheShadowAndNeverNegative) {
  for (const bool disc : {false, true}) {
    const SunAndTable s("none", disc);
    std::vector<float> beam(s.sunlight.lanes());
    for (double z = 0; z <= 100; z += 3.7) {
      const double shadow = s.sunlight.shadow_zenith_rad(z) / kDegree;
      EXPECT_FALSE(s.table.beam(z, (shadow + 0.6) * kDegree, beam.data())) << z;
      for (double chi = 0; chi < 112; chi += 0.31) {
        for (std::size_t w = 0; w < 2; ++w) {
          const double value = s.looked_up(z, chi * kDegree, w);
          EXPECT_GE(value, 0);
          EXPECT_LE(value, 1.001);
        }
      }
    }
  }
}

}  // namespace
}  // namespace twilight
