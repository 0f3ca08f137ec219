// The spherical and the plane-parallel planet of Adams & Kattawar (1978), Icarus 35, 139.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "sim/orders_sky.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kDegree = pi / 180;

struct Row {
  double sun_zenith_deg, view_zenith_deg, azimuth_deg;  // of the light that leaves
  double plane, spherical;                              // single scattering, Table I
};

// Table I: Rayleigh air of optical depth 0.25, homogeneous from 0 to 100 km, radius 6371 km, black
// ground; light that leaves the top, once scattered, for an incident flux of pi.
constexpr std::array<Row, 4> kTable1 = {{
    {84.26, 0, 0, 0.0161, 0.0193},
    {0, 70, 0, 0.0975, 0.1020},
    {84.26, 70, 0, 0.0738, 0.0962},
    {84.26, 70, 180, 0.0790, 0.0872},
}};
constexpr double kPrinted = 0.5e-4;

Medium air(double radius_km) {
  Medium m;
  m.earth_radius_km = radius_km;
  m.wavelength_nm = {500};
  constexpr int kLayers = 10;
  for (int i = 0; i <= kLayers; ++i) m.boundary_km.push_back(100.0 * i / kLayers);
  m.zero_tables();
  m.air_scattering_per_km = LayerTable(kLayers, 1, 0.0025);
  m.depolarisation = {0};
  return m;
}

double once_scattered(double radius_km, const Row& row) {
  SceneModel model;
  model.medium = air(radius_km);
  model.sun_elevation_rad = (90 - row.sun_zenith_deg) * kDegree;
  model.ground_albedo = {0};
  model.solar_irradiance = {pi};
  Scene& scene = model.scene;
  scene.solver.method = "orders";
  scene.solver.scattering_orders = 1;
  scene.solver.zenith_step_deg = 3;
  scene.solver.altitude_levels = 4;
  scene.sun.disc_average = false;
  scene.observer.height_m = 100e3;
  const OrdersSky sky(model, {});
  // The observer looks against the light: azimuth 0 is light that goes on away from the Sun.
  const ViewDirection view{(row.view_zenith_deg - 90) * kDegree, row.azimuth_deg * kDegree};
  return sky.single_scattering({&view, 1}).i[0];
}

// The same once more by the midpoint rule along the ray and straight lines to the Sun.
double integral(double radius_km, const Row& row) {
  constexpr double kTop_km = 100, kPer_km = 0.0025;
  constexpr int kSteps = 20000;
  const double top = radius_km + kTop_km;
  const double s = row.sun_zenith_deg * kDegree, v = row.view_zenith_deg * kDegree;
  const double sun_x = std::sin(s), sun_z = std::cos(s);
  // Backwards along the light: towards the Sun's side for azimuth 0.
  const double back_x = std::sin(v) * std::cos(row.azimuth_deg * kDegree), back_z = -std::cos(v);
  const double b = -top * back_z, ground = radius_km * radius_km - (top * top - b * b);
  const double length = ground > 0 ? b - std::sqrt(ground) : 2 * b;
  const double c = sun_x * back_x + sun_z * back_z;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double l = (i + 0.5) / kSteps * length;
    const double x = l * back_x, z = top + l * back_z;
    const double along = x * sun_x + z * sun_z, across2 = x * x + z * z - along * along;
    if (along < 0 && across2 < radius_km * radius_km) continue;
    sum += std::exp(-kPer_km * (l + std::sqrt(top * top - across2) - along));
  }
  return kPer_km * 0.75 * (1 + c * c) / 4 * sum * length / kSteps;
}

// The integral of the problem as printed is 0.27 % and 0.16 % from two of the printed figures (they
// are from a numerical solution of 1978); so what is exact is asserted to 0.05 %, what is printed
// to 0.3 %.
TEST(AdamsKattawar1978, SphericalPlanet) {
  for (const Row& row : kTable1) {
    const double got = once_scattered(6371, row), exact = integral(6371, row);
    std::printf("Sun %g view %g azimuth %g: %.6f, integral %.6f, printed %.4f\n",
                row.sun_zenith_deg, row.view_zenith_deg, row.azimuth_deg, got, exact,
                row.spherical);
    EXPECT_NEAR(got / exact, 1, 5e-4);
    EXPECT_NEAR(got, row.spherical, kPrinted + 3e-3 * row.spherical);
    // A sphere as large as a plane, by the same integral: the printed digits.
    EXPECT_NEAR(integral(6.371e6, row), row.plane, kPrinted);
  }
}

TEST(AdamsKattawar1978, PlaneParallelPlanetIsAHugeOne) {
  for (const Row& row : kTable1) {
    const double got = once_scattered(6.371e6, row);
    const double mu0 = std::cos(row.sun_zenith_deg * kDegree),
                 mu = std::cos(row.view_zenith_deg * kDegree);
    const double c = -mu * mu0 + std::sin(row.sun_zenith_deg * kDegree) *
                                     std::sin(row.view_zenith_deg * kDegree) *
                                     std::cos(row.azimuth_deg * kDegree);
    const double closed =
        0.25 * 0.75 * (1 + c * c) * mu0 / (mu + mu0) * -std::expm1(-0.25 * (1 / mu + 1 / mu0));
    std::printf("Sun %g view %g azimuth %g: %.6f, closed form %.6f, printed %.4f\n",
                row.sun_zenith_deg, row.view_zenith_deg, row.azimuth_deg, got, closed, row.plane);
    EXPECT_NEAR(got, row.plane, kPrinted);
    EXPECT_NEAR(got / closed, 1, 1e-3);
  }
}

}  // namespace
}  // namespace twilight
