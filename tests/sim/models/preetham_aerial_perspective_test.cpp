// Preetham, Shirley & Smits (1999), Sec. 4: the closed forms against numerical integration.
#include "sim/models/preetham_aerial_perspective.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/models/preetham_sky.h"
#include "tests/sim/small_scene.h"

namespace twilight {
namespace {

using std::numbers::pi;

constexpr double kRad = pi / 180;

AerialAir air_at(double nm, double turbidity) {
  const PreethamScattering s(nm, turbidity);
  return {s.haze_per_km(), s.molecules_per_km()};
}

double error(const AerialIntegrals& a, const AerialIntegrals& b) {
  return std::max(std::abs(a.haze_km / b.haze_km - 1),
                  std::abs(a.molecules_km / b.molecules_km - 1));
}

// The same sky from everywhere above the horizon, and a Sun.
class UniformSky : public Sky {
 public:
  UniformSky(double sky, double sun) : sky_(sky), sun_(sun) {}
  std::span<const double> wavelength_nm() const override { return nm_; }
  std::span<const double> solar_irradiance() const override { return one_; }
  std::vector<double> radiance(std::span<const ViewDirection> views) const override {
    return std::vector<double>(views.size() * 2, sky_);
  }
  Irradiance irradiance() const override { return {}; }
  double apparent_sun_elevation_rad() const override { return 0.7; }
  std::vector<double> sun_transmittance() const override { return {sun_, sun_}; }
  const RunSummary& summary() const override { return summary_; }

 private:
  std::vector<double> nm_{450, 650}, one_{1, 1};
  double sky_, sun_;
  RunSummary summary_;
};

TEST(AerialPerspective, TransmittanceOfKnownPaths) {
  const AerialAir air = air_at(550, 2);
  // Level: Beer's law; upwards without end: the columns of both, over 1 / 0.8333 and 1 / 0.1136 km.
  EXPECT_NEAR(aerial_transmittance({0, 0, 10}, air),
              std::exp(-10 * (air.haze_per_km + air.molecules_per_km)), 1e-12);
  EXPECT_NEAR(aerial_transmittance({0, pi / 2, 1e4}, air),
              std::exp(-air.haze_per_km / 0.8333 - air.molecules_per_km / 0.1136), 1e-12);
  // Up and down again, and piece by piece.
  const AerialPath up{0, 0.3, 20}, down{20 * std::sin(0.3), -0.3, 20};
  EXPECT_NEAR(aerial_transmittance(up, air), aerial_transmittance(down, air), 1e-12);
  const double half = aerial_transmittance({0, 0.3, 10}, air),
               rest = aerial_transmittance({10 * std::sin(0.3), 0.3, 10}, air);
  EXPECT_NEAR(aerial_transmittance(up, air), half * rest, 1e-12);
  EXPECT_EQ(aerial_transmittance({1, 0.3, 0}, air), 1);
}

// Between them the constituents lose what the path loses:
// beta1 I1 + beta2 I2 = integral of -dT/dx = 1 - T.
TEST(AerialPerspective, IntegralsAddUpToTheLoss) {
  for (const double t : {1.0, 2.0, 6.0, 20.0}) {
    const AerialAir air = air_at(550, t);
    for (const AerialPath path :
         {AerialPath{0, 0, 30}, {0, 0.02, 200}, {2, -0.05, 30}, {0, 1.2, 50}}) {
      const double lost = 1 - aerial_transmittance(path, air);
      const auto of = [&](const AerialIntegrals& i) {
        return air.haze_per_km * i.haze_km + air.molecules_per_km * i.molecules_km;
      };
      EXPECT_NEAR(of(aerial_integrals_numeric(path, air)), lost, 1e-9);
      EXPECT_NEAR(of(aerial_integrals(path, air)), lost, 3e-4 * lost);
    }
  }
}

TEST(AerialPerspective, ClosedFormInUseIsWithinItsBound) {
  double worst = 0;
  for (const double t : {1.0, 2.0, 6.0, 20.0}) {
    for (const double nm : {400.0, 550.0, 700.0}) {
      const AerialAir air = air_at(nm, t);
      for (const double h : {0.0, 1.0, 5.0, 20.0}) {
        for (const double e :
             {-90.0, -30.0, -5.0, -1.0, -0.05, 0.0, 0.01, 0.1, 1.0, 3.0, 10.0, 30.0, 90.0}) {
          for (double s : {0.01, 1.0, 10.0, 100.0, 500.0}) {
            const double sine = std::sin(e * kRad);
            if (sine < 0) s = std::min(s, h / -sine);
            if (s == 0) continue;
            const AerialPath path{h, e * kRad, s};
            const AerialIntegrals own = aerial_integrals(path, air);
            EXPECT_GT(own.haze_km, 0);
            worst = std::max(worst, error(own, aerial_integrals_numeric(path, air)));
          }
        }
      }
    }
  }
  EXPECT_LT(worst, 3e-4);
  std::printf("aerial integrals: within %.1e\n", worst);
}

// Eq. 10: exact for level paths; else its error is of the order of alpha1 s cos theta times the
// depth (tests' table in sim/models/README.md).
TEST(AerialPerspective, LevelFormIsExactForLevelPathsAndFirstOrderElse) {
  for (const double t : {2.0, 6.0}) {
    const AerialAir air = air_at(550, t);
    for (const double s : {0.1, 5.0, 50.0}) {
      const AerialPath level{0.5, 0, s};
      EXPECT_LT(error(aerial_integrals_level(level, air), aerial_integrals_numeric(level, air)),
                1e-9);
    }
    const auto at = [&](double degrees, double s) {
      const AerialPath path{0, degrees * kRad, s};
      return error(aerial_integrals_level(path, air), aerial_integrals_numeric(path, air));
    };
    EXPECT_NEAR(at(0.1, 5) / at(0.2, 5), 0.5, 0.02);  // first order in cos theta
    EXPECT_LT(at(1, 1), 1e-3);
    EXPECT_LT(at(5, 1), 5e-3);
    EXPECT_LT(at(1, 10), 0.03);
  }
}

// A.4's cubic and brackets, written out as printed (limits of Eq. 11), against the moments.
TEST(AerialPerspective, HermiteFormIsThatOfThePrintedBrackets) {
  const AerialAir air = air_at(550, 6);
  for (const AerialPath path : {AerialPath{0, 1.0, 2}, {0.5, 0.5, 3}, {2, -0.6, 2.5}}) {
    const double cosine = std::sin(path.elevation_rad), s = path.length_km;
    const double alpha[] = {0.8333, 0.1136}, beta[] = {air.haze_per_km, air.molecules_per_km};
    double integral[2];
    for (int own = 0; own < 2; ++own) {
      const int other = 1 - own;
      const double k1 = beta[own] / (alpha[own] * cosine),
                   k2 = beta[other] / (alpha[other] * cosine);
      const auto u = [&](int c, double x) {
        return std::exp(-alpha[c] * (path.height_km + x * cosine));
      };
      const double h1 = u(own, 0), h2 = u(other, 0), end = u(own, s),
                   power = alpha[other] / alpha[own];
      const auto f = [&](double v) { return std::exp(-k2 * (h2 - std::pow(v, power))); };
      const auto slope = [&](double v) { return f(v) * k2 * power * std::pow(v, power - 1); };
      // The cubic through both ends about v0 = h1, with its derivatives.
      const double d = end - h1, f0 = f(h1), f1 = f(end), m0 = slope(h1) * d, m1 = slope(end) * d;
      const double c2 = (3 * (f1 - f0) - 2 * m0 - m1) / (d * d),
                   c3 = (2 * (f0 - f1) + m0 + m1) / (d * d * d), c1 = m0 / d;
      const auto bracket = [&](double v) {
        const double w = v - h1;
        const double g = f0 + c1 * w + c2 * w * w + c3 * w * w * w,
                     g1 = c1 + 2 * c2 * w + 3 * c3 * w * w, g2 = 2 * c2 + 6 * c3 * w, g3 = 6 * c3;
        return std::exp(-k1 * (h1 - v)) *
               (g / k1 - g1 / (k1 * k1) + g2 / (k1 * k1 * k1) - g3 / (k1 * k1 * k1 * k1));
      };
      integral[own] = -1 / (alpha[own] * cosine) * (bracket(end) - bracket(h1));
    }
    const AerialIntegrals ours = aerial_integrals_hermite(path, air);
    EXPECT_NEAR(ours.haze_km, integral[0], 1e-9 * integral[0]);
    EXPECT_NEAR(ours.molecules_km, integral[1], 1e-7 * integral[1]);
  }
}

// Eq. 11 with one cubic, T = 2: 1e-3 where the path climbs less than a scale height or so of haze
// and its depth is below 1; its error falls with the fourth power of the length.
TEST(AerialPerspective, HermiteFormOfShortPaths) {
  const AerialAir air = air_at(550, 2);
  for (const double degrees : {0.5, 1.0, 2.0, 5.0, 10.0}) {
    const AerialPath path{0, degrees * kRad, 5};
    EXPECT_LT(error(aerial_integrals_hermite(path, air), aerial_integrals_numeric(path, air)),
              5e-4);
  }
  const auto at = [&](double s) {
    const AerialPath path{0, 30 * kRad, s};
    return error(aerial_integrals_hermite(path, air), aerial_integrals_numeric(path, air));
  };
  EXPECT_LT(at(1), 1e-5);
  EXPECT_NEAR(std::log2(at(1) / at(0.5)), 4, 0.3);
}

// Half of Rayleigh's scattering is from either hemisphere, wherever one looks.
TEST(AerialPerspective, SourceOfAUniformSky) {
  const PreethamAerialPerspective aerial(UniformSky(2.0, 0.0), 3);
  for (const ViewDirection view : {ViewDirection{0, 0}, {0.4, 1}, {-0.3, 2}, {pi / 2, 0}}) {
    const AerialSource source = aerial.source(view);
    EXPECT_NEAR(source.molecules[0], 0.5 * 2.0 * PreethamScattering(450, 3).molecules_per_km(),
                1e-4 * source.molecules[0]);
  }
  // The haze of views up and down shares all that is scattered.
  const double up = aerial.source({0.5, 1}).haze[1], down = aerial.source({-0.5, 1 + pi}).haze[1];
  EXPECT_NEAR(up + down, 2.0 * PreethamScattering(650, 3).haze_per_km(), 0.02 * (up + down));
  EXPECT_GT(up, down);  // forwards
}

TEST(AerialPerspective, SourceOfTheSunIsTheAngularCoefficient) {
  const PreethamAerialPerspective aerial(UniformSky(0.0, 0.8), 3);
  const PreethamScattering air(650, 3);
  EXPECT_NEAR(aerial.source({0.7, 0}).haze[1], 0.8 * air.haze_per_km_sr(0), 1e-9);
  EXPECT_NEAR(aerial.source({0.7 - pi / 2, 0}).haze[1], 0.8 * air.haze_per_km_sr(pi / 2), 1e-12);
  EXPECT_NEAR(aerial.source({0.7 - pi / 2, 0}).molecules[1], 0.8 * air.molecules_per_km_sr(pi / 2),
              1e-12);
}

// A far horizon takes the colour of the air: S0 over the extinction.
TEST(AerialPerspective, FarLevelPathsShowTheAirAlone) {
  const PreethamAerialPerspective aerial(UniformSky(1.0, 0.5), 3);
  const ViewDirection level{0, 1.3};
  const AerialSource source = aerial.source(level);
  const auto far = aerial.inscattered({0, 0, 2000}, level.relative_azimuth_rad);
  for (std::size_t w = 0; w < 2; ++w) {
    const AerialAir air = air_at(w == 0 ? 450 : 650, 3);
    EXPECT_NEAR(far[w],
                (source.haze[w] + source.molecules[w]) / (air.haze_per_km + air.molecules_per_km),
                1e-9);
  }
  for (const double none : aerial.inscattered({0, 0.2, 0}, 1.0)) EXPECT_EQ(none, 0);
  for (const double all : aerial.transmittance({0, 0, 0})) EXPECT_EQ(all, 1);
}

// Da Vinci's rules (their Sec. 1 and 2.4): dark things turn blue with distance, and yellow-shift
// towards the Sun.
TEST(AerialPerspective, OfTheirOwnSky) {
  Scene scene = small_scene(10);
  scene.solver.method = "preetham";
  scene.preetham.turbidity = 2.5;
  scene.sun.spectrum = "gueymard2004";
  const auto sky = solve_sky(build_scene_model(scene));
  const PreethamAerialPerspective aerial(*sky, 2.5);
  const auto away = aerial.inscattered({0, 0, 10}, pi),
             towards = aerial.inscattered({0, 0, 10}, 0.0);
  EXPECT_GT(away[0], 1.2 * away[2]);  // 450 over 700 nm
  EXPECT_LT(towards[0] / towards[2], away[0] / away[2]);
  double before = 0;
  for (const double s : {1.0, 5.0, 20.0, 100.0, 1000.0}) {
    const auto light = aerial.inscattered({0, 0.01, s}, 2.0);
    EXPECT_GT(light[1], before);
    before = light[1];
  }
}

TEST(AerialPerspective, RefusesPathsUnderGround) {
  const AerialAir air = air_at(550, 2);
  EXPECT_THROW(aerial_transmittance({-1, 0, 1}, air), std::invalid_argument);
  EXPECT_THROW(aerial_integrals({1, -0.5, 10}, air), std::invalid_argument);
  EXPECT_THROW(aerial_integrals({1, 0, -1}, air), std::invalid_argument);
  EXPECT_THROW(aerial_integrals({NAN, 0, 1}, air), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
