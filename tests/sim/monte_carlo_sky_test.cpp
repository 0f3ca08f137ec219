#include "sim/monte_carlo_sky.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "atmosphere/air.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRad = kPi / 180;

SceneModel model_of(Medium medium, double sun_elevation_deg, double albedo = 0) {
  SceneModel model;
  model.medium = std::move(medium);
  model.solar_irradiance.assign(model.medium.wavelengths(), 1.0);
  model.ground_albedo.assign(model.medium.wavelengths(), albedo);
  model.sun_elevation_rad = sun_elevation_deg * kRad;
  model.scene.solver.method = "monte-carlo";
  model.scene.solver.polarisation = true;
  model.scene.sun.disc_average = false;
  return model;
}

Medium empty_layers(int layers, double step_km, double radius_km) {
  Medium m;
  m.earth_radius_km = radius_km;
  m.wavelength_nm = {550};
  const auto n = static_cast<std::size_t>(layers);
  for (int i = 0; i <= layers; ++i) m.boundary_km.push_back(step_km * i);
  for (LayerTable* t :
       {&m.air_scattering_per_km, &m.aerosol_scattering_per_km, &m.aerosol_absorption_per_km,
        &m.aerosol_asymmetry, &m.gas_absorption_per_km, &m.refractivity}) {
    *t = LayerTable(n, 1);
  }
  m.depolarisation = {0};
  return m;
}

// Exponential air, 0.0116 / km at the ground and 8 km of scale height, in layers of 0.5 km.
Medium exponential_air() {
  Medium m = empty_layers(200, 0.5, 6371);
  for (int i = 0; i < 200; ++i) {
    m.air_scattering_per_km(static_cast<std::size_t>(i), 0) =
        0.0116 * 16 * (std::exp(-0.5 * i / 8) - std::exp(-0.5 * (i + 1) / 8));
  }
  return m;
}

// A homogeneous layer of 1 km around a planet so large that it is flat.
Medium flat_slab(double optical_depth) {
  Medium m = empty_layers(10, 0.1, 1e6);
  for (std::size_t i = 0; i < 10; ++i) m.air_scattering_per_km(i, 0) = optical_depth;
  return m;
}

// Rows of this project's reference table of open cases: an independent backward Monte Carlo, scalar
// Rayleigh, no refraction, black ground, with its standard error and the orders 1, 2, 3.
TEST(MonteCarloSky, OpenCases) {
  struct Row {
    double sun_deg, elevation_deg, azimuth_deg, radiance, error, order[3];
  };
  constexpr Row kRows[] = {
      {5, 45, 90, 0.005826519, 5.6e-6, {0.0047152, 0.00093535, 0.00014925}},
      {-6, 90, 0, 1.451279e-5, 5.76e-8, {9.5376e-6, 3.9553e-6, 8.3263e-7}},
      {-6, 10, 180, 2.360246e-5, 1.16e-7, {0, 1.9009e-5, 3.7384e-6}},
      {-6, 2, 0, 0.001252633, 4.95e-6, {0.0011067, 0.00012107, 2.0635e-5}},
      {-9, 45, 0, 1.297777e-6, 1.69e-8, {2.6569e-7, 8.3807e-7, 1.5877e-7}},
      {-9, 10, 0, 2.809443e-5, 1.89e-7, {2.2621e-5, 4.561e-6, 7.4247e-7}},
  };
  std::unique_ptr<MonteCarloSky> sky;
  double sun = 99;
  for (const Row& row : kRows) {
    if (row.sun_deg != sun) {
      sun = row.sun_deg;
      SceneModel model = model_of(exponential_air(), sun);
      model.scene.solver.polarisation = false;
      model.scene.solver.target_relative_error = 0.003;
      sky = std::make_unique<MonteCarloSky>(model, RunControl{});
    }
    const MonteCarloEstimate e = sky->estimate({row.elevation_deg * kRad, row.azimuth_deg * kRad});
    const double z = (e.i[0] - row.radiance) / std::hypot(e.i_error[0], row.error);
    EXPECT_LT(std::abs(z), 3) << row.sun_deg << " " << row.elevation_deg << " " << row.azimuth_deg;
    double total = 0;
    for (const auto& order : e.order) total += order[0];
    EXPECT_NEAR(total / e.i[0], 1, 1e-12);
    for (std::size_t k = 0; k < 3; ++k) {
      // An order's own error is at most about the total's.
      EXPECT_NEAR(e.order[k][0], row.order[k], 3 * std::hypot(e.order_error[k][0], row.error))
          << "order " << k + 1 << ": " << row.sun_deg << " " << row.elevation_deg;
    }
  }
}

// libRadtran, examples/UVSPEC_MC_SPHERICAL (MYSTIC, polarised): US standard air without aerosol,
// black ground, Earth radius 6370 km, Sun at zenith angle 92 deg, zenith from the ground at 500 nm:
// I = 4.02704e-4, Q = -3.42839e-4 of the solar irradiance. Ozone and NO2 are the profile's own.
TEST(MonteCarloSky, LibRadtranSphericalExample) {
  AirOptions air;
  air.earth_radius_km = 6370;
  air.refraction = false;
  air.top_km = 120;
  const double wavelengths[] = {500.0};
  SceneModel model = model_of(make_air(air, wavelengths), -2);
  model.scene.solver.target_relative_error = 0.0015;
  const MonteCarloSky sky(model, RunControl{});
  const MonteCarloEstimate e = sky.estimate({kPi / 2, 0});
  std::printf("I %.4f, Q %.4f of libRadtran's, standard error %.2f %%\n", e.i[0] / 4.02704e-4,
              e.q[0] / -3.42839e-4, 100 * e.i_error[0] / e.i[0]);
  EXPECT_NEAR(e.i[0] / 4.02704e-4, 1, 0.01);
  EXPECT_NEAR(e.q[0] / -3.42839e-4, 1, 0.02);
  EXPECT_NEAR(e.u[0] / e.i[0], 0, 0.005);
}

// Natraj, Li & Yung (2009, ApJ 691, 1909), plane-parallel Rayleigh slabs, light seen from below, I
// for a solar flux of pi; their Q is positive across the vertical plane, so the opposite of ours.
TEST(MonteCarloSky, NatrajPlaneParallelTables) {
  struct Row {
    double optical_depth, sun_cosine, albedo, cosine, azimuth_deg, i, q, u;
  };
  constexpr Row kRows[] = {
      {0.5, 0.2, 0, 0.2, 90, 0.10033646, -0.07022742, 0.02479837},
      {0.5, 0.2, 0, 0.52, 180, 0.10282324, 0.01353678, 0},
      {0.5, 0.2, 0, 0.84, 90, 0.0553467, -0.03883915, 0.00889191},
      {1, 0.6, 0.8, 0.52, 60, 0.44678528, -0.0628504, 0.05299454},
  };
  for (const Row& row : kRows) {
    SceneModel model =
        model_of(flat_slab(row.optical_depth), std::asin(row.sun_cosine) / kRad, row.albedo);
    model.solar_irradiance = {kPi};
    model.scene.solver.target_relative_error = 0.002;
    const MonteCarloSky sky(model, RunControl{});
    const MonteCarloEstimate e = sky.estimate({std::asin(row.cosine), row.azimuth_deg * kRad});
    EXPECT_NEAR(e.i[0], row.i, 3 * e.i_error[0] + 3e-4 * row.i);
    EXPECT_NEAR(e.q[0], -row.q, 3 * e.q_error[0] + 3e-4 * row.i);
    EXPECT_NEAR(e.u[0], row.u, 3 * e.u_error[0] + 3e-4 * row.i);
  }
}

// A thin uniform layer, all of it sunlit: I = beta L 3 / (16 pi) (1 + cos^2), the electric field
// across the plane of Sun and view. U is positive clockwise of the vertical as the observer sees
// it.
TEST(MonteCarloSky, ThinLayerScattersOnceAfterRayleigh) {
  Medium m = empty_layers(4, 2.5, 1e6);
  for (std::size_t i = 0; i < 4; ++i) m.air_scattering_per_km(i, 0) = 1e-7;
  SceneModel model = model_of(m, 30);
  model.scene.solver.photons = 4096;
  const MonteCarloSky sky(model, RunControl{});
  const Vec3 sun{std::cos(30 * kRad), 0, 0.5};
  for (const ViewDirection v : {ViewDirection{50 * kRad, 0}, ViewDirection{40 * kRad, 90 * kRad},
                                ViewDirection{70 * kRad, 200 * kRad}}) {
    const double c = std::cos(v.elevation_rad), a = v.relative_azimuth_rad;
    // x towards the Sun, z up; clockwise from above is towards -y.
    const Vec3 d{c * std::cos(a), -c * std::sin(a), std::sin(v.elevation_rad)};
    const double cosine = dot(d, sun);
    const double expected =
        1e-7 * 10 / std::sin(v.elevation_rad) * 3 / (16 * kPi) * (1 + cosine * cosine);
    const MonteCarloEstimate e = sky.estimate(v);
    EXPECT_NEAR(e.i[0] / expected, 1, 2e-4);
    const Vec3 field = unit(cross(d, sun)), side = unit(cross(d, {0, 0, 1}));
    const Vec3 vertical = cross(side, d);
    const double degree = (1 - cosine * cosine) / (1 + cosine * cosine);
    const double up = dot(field, vertical), right = dot(field, side);
    EXPECT_NEAR(e.q[0] / e.i[0], degree * (up * up - right * right), 2e-4);
    EXPECT_NEAR(e.u[0] / e.i[0], degree * 2 * up * right, 2e-4);
  }
}

// Conservative slab, black ground: what comes out above and arrives below is what came in.
TEST(MonteCarloSky, ConservativeSlabConservesEnergy) {
  constexpr double kSunDeg = 40, kDepth = 0.5;
  SceneModel model = model_of(flat_slab(kDepth), kSunDeg);
  model.scene.solver.target_relative_error = 0.005;
  const MonteCarloSky below(model, RunControl{});
  const Irradiance ground = below.irradiance();
  EXPECT_NEAR(ground.direct[0],
              std::sin(kSunDeg * kRad) * std::exp(-kDepth / std::sin(kSunDeg * kRad)), 1e-5);
  model.scene.observer.height_m = 2000;
  const MonteCarloSky above(model, RunControl{});
  EXPECT_EQ(above.estimate({0.2, 1.0}).i[0], 0);
  // Gauss-Legendre in the cosine; Rayleigh's azimuth has modes 0, 1, 2: six azimuths are exact.
  constexpr double kNode[] = {0.0469100770, 0.2307653449, 0.5, 0.7692346551, 0.9530899230};
  constexpr double kWeight[] = {0.1184634425, 0.2393143352, 0.2844444444, 0.2393143352,
                                0.1184634425};
  double up = 0, variance = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    for (const double azimuth : {30.0, 90.0, 150.0}) {
      const MonteCarloEstimate e = above.estimate({-std::asin(kNode[i]), azimuth * kRad});
      const double weight = 2 * kPi / 3 * kWeight[i] * kNode[i];
      up += weight * e.i[0];
      variance += std::pow(weight * e.i_error[0], 2);
    }
  }
  const double in = std::sin(kSunDeg * kRad);
  const double total = (up + ground.direct[0] + ground.diffuse[0]) / in;
  std::printf("out %.4f of in\n", total);
  EXPECT_NEAR(total, 1, 3 * (std::sqrt(variance) + 0.005 * ground.diffuse[0]) / in);
}

TEST(MonteCarloSky, MirrorSymmetricAboutTheSunsVertical) {
  SceneModel model = model_of(exponential_air(), -3, 0.3);
  model.scene.solver.target_relative_error = 0.005;
  const MonteCarloSky sky(model, RunControl{});
  const MonteCarloEstimate a = sky.estimate({0.5, 1.1}), b = sky.estimate({0.5, -1.1});
  EXPECT_NEAR(a.i[0], b.i[0], 4 * std::hypot(a.i_error[0], b.i_error[0]));
  EXPECT_NEAR(a.q[0], b.q[0], 4 * std::hypot(a.q_error[0], b.q_error[0]));
  EXPECT_NEAR(a.u[0], -b.u[0], 4 * std::hypot(a.u_error[0], b.u_error[0]));
  EXPECT_GT(std::abs(a.u[0]), 10 * a.u_error[0]);
}

Medium refracting_hazy_air() {
  const double wavelengths[] = {400.0, 550.0, 700.0};
  Medium m = make_air(AirOptions{}, wavelengths);
  for (std::size_t i = 0; i < m.layers() && m.boundary_km[i + 1] < 12; ++i) {
    for (std::size_t w = 0; w < 3; ++w) {
      m.aerosol_scattering_per_km(i, w) = 0.1 * std::exp(-m.boundary_km[i] / 2);
      m.aerosol_absorption_per_km(i, w) = 0.05 * m.aerosol_scattering_per_km(i, w);
      m.aerosol_asymmetry(i, w) = 0.7;
    }
  }
  return m;
}

Medium one_wavelength(const Medium& m, std::size_t w) {
  Medium one = m;
  one.wavelength_nm = {m.wavelength_nm[w]};
  one.depolarisation = {m.depolarisation[w]};
  for (LayerTable Medium::*t : {&Medium::air_scattering_per_km, &Medium::aerosol_scattering_per_km,
                                &Medium::aerosol_absorption_per_km, &Medium::aerosol_asymmetry,
                                &Medium::gas_absorption_per_km, &Medium::refractivity}) {
    one.*t = LayerTable(m.layers(), 1);
    for (std::size_t i = 0; i < m.layers(); ++i) (one.*t)(i, 0) = (m.*t)(i, w);
  }
  return one;
}

// Wavelengths share their paths without bias.
TEST(MonteCarloSky, SharedPathsAgreeWithOwnPaths) {
  const Medium medium = refracting_hazy_air();
  SceneModel all = model_of(medium, -5, 0.3);
  all.scene.solver.target_relative_error = 0.012;
  const MonteCarloSky sky(all, RunControl{});
  const std::vector<ViewDirection> views = {{kPi / 2, 0}, {0.1, 2.0}};
  for (std::size_t w = 0; w < 3; ++w) {
    SceneModel own = model_of(one_wavelength(medium, w), -5, 0.3);
    own.scene.solver.target_relative_error = 0.012;
    const MonteCarloSky alone(own, RunControl{});
    for (const ViewDirection& v : views) {
      const MonteCarloEstimate a = sky.estimate(v), b = alone.estimate(v);
      EXPECT_NEAR(a.i[w] / b.i[0], 1, 3 * std::hypot(a.i_error[w] / a.i[w], b.i_error[0] / b.i[0]));
      EXPECT_NEAR(a.q[w] / b.i[0], b.q[0] / b.i[0],
                  3 * std::hypot(a.q_error[w], b.q_error[0]) / b.i[0]);
    }
  }
}

TEST(MonteCarloSky, SameBytesForAnyNumberOfThreadsAndOrderOfViews) {
  SceneModel model = model_of(refracting_hazy_air(), -4, 0.2);
  model.scene.solver.photons = 3000;
  const std::vector<ViewDirection> views = {{0.3, 0.5}, {-0.2, 2.0}, {kPi / 2, 0}};
  model.scene.solver.threads = 1;
  const MonteCarloSky one(model, RunControl{});
  model.scene.solver.threads = 2;
  const MonteCarloSky two(model, RunControl{});
  const StokesRadiance a = one.stokes(views), b = two.stokes(views);
  EXPECT_EQ(a.i, b.i);
  EXPECT_EQ(a.q, b.q);
  EXPECT_EQ(a.u, b.u);
  EXPECT_EQ(a.standard_error, b.standard_error);
  const std::vector<double> last = two.radiance({&views[2], 1});
  EXPECT_EQ(last, std::vector<double>(a.i.begin() + 6, a.i.end()));
  model.scene.solver.seed = 2;
  const MonteCarloSky other(model, RunControl{});
  EXPECT_NE(other.radiance({&views[2], 1}), last);
}

// Half a disc's rms width up and down: the mean of the two follows the disc's average to second
// order in the slope.
TEST(MonteCarloSky, DiscAverageFollowsTheSlope) {
  SceneModel model = model_of(exponential_air(), -6);
  model.scene.solver.target_relative_error = 0.002;
  const LimbDarkening limb(550);
  double square = 0;
  for (int i = 0; i < 1000; ++i) {
    const double area = (i + 0.5) / 1000;
    square += area * limb(std::sqrt(1 - area)) / 1000;
  }
  const double rms = kSunAngularRadiusRad * std::sqrt(square / 2);
  const auto zenith = [&](double offset, bool disc) {
    SceneModel m = model;
    m.sun_elevation_rad += offset;
    m.scene.sun.disc_average = disc;
    return MonteCarloSky(m, RunControl{}).estimate({kPi / 2, 0}).i[0];
  };
  const double disc = zenith(0, true), pair = (zenith(rms, false) + zenith(-rms, false)) / 2;
  EXPECT_NEAR(disc / pair, 1, 0.008);
}

// From orbit: past the Earth's limb there is nothing, downwards there is.
TEST(MonteCarloSky, SeenFromOrbit) {
  SceneModel model = model_of(refracting_hazy_air(), 30, 0.3);
  model.scene.observer.height_m = 400e3;
  model.scene.solver.photons = 2000;
  const MonteCarloSky sky(model, RunControl{});
  EXPECT_EQ(sky.estimate({0.1, 0.0}).i[1], 0);
  EXPECT_EQ(sky.estimate({-10 * kRad, 0.0}).i[1], 0);
  const MonteCarloEstimate limb = sky.estimate({-19.5 * kRad, 1.0});
  EXPECT_GT(limb.i[1], 0);
  const MonteCarloEstimate down = sky.estimate({-kPi / 2, 0.0});
  // Reflectance of the ground through the air, and the air's own: 0.15..0.45 of white.
  const double white = std::sin(30 * kRad) / kPi;
  EXPECT_GT(down.i[1], 0.15 * white);
  EXPECT_LT(down.i[1], 0.45 * white);
  EXPECT_NEAR(sky.apparent_sun_elevation_rad(), 30 * kRad, 1e-9);
  EXPECT_NEAR(sky.sun_transmittance()[1], 1, 1e-12);
}

TEST(MonteCarloSky, StopsWhenCancelled) {
  std::atomic<bool> cancel = true;
  RunControl control;
  control.cancel = &cancel;
  EXPECT_THROW(MonteCarloSky(model_of(exponential_air(), 10), control), Cancelled);
}

// Every extreme of geometry gives finite, sensible light.
TEST(MonteCarloSky, ExtremesAreFinite) {
  for (const double sun : {90.0, 0.0, -90.0}) {
    SceneModel model = model_of(refracting_hazy_air(), sun, 1.0);
    model.scene.solver.photons = 600;
    const MonteCarloSky sky(model, RunControl{});
    const std::vector<ViewDirection> views = {{kPi / 2, 0}, {sun * kRad, 0}, {0, 0},
                                              {0, kPi},     {-kPi / 2, 1},   {-1e-4, 0.3}};
    const StokesRadiance s = sky.stokes(views);
    for (std::size_t k = 0; k < s.i.size(); ++k) {
      EXPECT_TRUE(std::isfinite(s.i[k]) && s.i[k] >= 0) << sun << " " << k;
      EXPECT_LE(std::hypot(s.q[k], s.u[k]), s.i[k]) << sun << " " << k;
      EXPECT_TRUE(std::isfinite(s.standard_error[k]));
    }
  }
}

}  // namespace
}  // namespace twilight
