#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "aerosols/cornette_shanks.h"
#include "sim/gauss_legendre.h"
#include "sim/models/bruneton_precompute.h"
#include "sim/models/bruneton_sky.h"

namespace twilight {
namespace {

using std::numbers::pi;

constexpr double kRadPerDeg = pi / 180;

// One wavelength, tables an eighth of the paper's size.
Scene small_scene(double sun_elevation_deg) {
  Scene scene;
  scene.sun.elevation_deg = sun_elevation_deg;
  scene.sun.spectrum = "unit";
  scene.spectrum.wavelengths_nm = {550};
  scene.solver.method = "bruneton";
  scene.solver.threads = 2;
  scene.solver.scattering_orders = 3;
  scene.bruneton.scattering_size = {16, 64, 16, 8};
  scene.bruneton.view_samples = 24;
  scene.bruneton.polar_directions = 16;
  scene.bruneton.azimuth_directions = 8;
  return scene;
}

BrunetonSky sky_of(const Scene& scene) {
  return BrunetonSky(build_scene_model(scene), RunControl{});
}

double one(const Sky& sky, double elevation_deg, double azimuth_deg) {
  const ViewDirection view{elevation_deg * kRadPerDeg, azimuth_deg * kRadPerDeg};
  return sky.radiance({&view, 1}).front();
}

// Sec. 2.1 and Fig. 6.
TEST(Bruneton, AirIsThePapers) {
  Scene scene = small_scene(30);
  scene.spectrum.wavelengths_nm = {440, 550, 680};
  const BrunetonAir air(build_scene_model(scene));
  EXPECT_EQ(air.sphere().ground_radius_km, 6360);
  EXPECT_EQ(air.sphere().top_radius_km, 6420);
  std::array<double, 3> rayleigh{}, mie{}, rayleigh_up{}, mie_up{};
  air.scattering(6360, rayleigh, mie);
  EXPECT_THAT(rayleigh, testing::Pointwise(testing::DoubleNear(1e-9), {33.1e-3, 13.5e-3, 5.8e-3}));
  EXPECT_THAT(mie, testing::Each(testing::DoubleNear(2e-2, 1e-12)));
  air.scattering(6368, rayleigh_up, mie_up);
  EXPECT_NEAR(rayleigh_up[1], rayleigh[1] * std::exp(-1), 1e-9);
  air.scattering(6361.2, rayleigh_up, mie_up);
  EXPECT_NEAR(mie_up[1], mie[1] * std::exp(-1), 1e-9);
  // Eq. 4 with g = 0.76, and 0.9 = scattering / extinction.
  EXPECT_NEAR(air.mie_phase(1, 0.5), cornette_shanks(0.5, 0.76), 1e-15);
  BrunetonAir::Columns vertical;
  air.columns(6360, 1, 0, 60, vertical);
  EXPECT_NEAR(vertical.rayleigh[1], 13.5e-3 * 8 * (1 - std::exp(-60 / 8.0)), 1e-8);
  EXPECT_NEAR(vertical.mie[1], 2e-2 * 1.2, 1e-8);
  EXPECT_NEAR(vertical.extinction[1] - vertical.rayleigh[1], vertical.mie[1] / 0.9, 1e-8);
}

// Sec. 6: "8 MB for S with 16 bits floats" at [C_*, C_M,r] = 4 values per entry; Sec. 4: 6 values
// with the Mie term of three colours.
TEST(Bruneton, TablesAreThePapersSize) {
  const BrunetonOptions options;
  EXPECT_THAT(options.scattering_size, testing::ElementsAre(32, 128, 32, 8));
  EXPECT_EQ(BrunetonSize().texels() * 4 * 2, 8U << 20U);
  EXPECT_THAT(options.transmittance_size, testing::ElementsAre(64, 256));
  EXPECT_THAT(options.irradiance_size, testing::ElementsAre(16, 64));
  for (const bool proportional : {false, true}) {
    Scene scene = small_scene(30);
    scene.spectrum.wavelengths_nm = {440, 550, 680};
    scene.solver.scattering_orders = 1;
    scene.bruneton.scattering_size = {2, 4, 4, 2};
    scene.bruneton.proportional_mie = proportional;
    const auto tables = sky_of(scene).tables();
    EXPECT_EQ(tables.rayleigh_and_multiple.wavelengths() + tables.single_mie.wavelengths(),
              proportional ? 4U : 6U);
  }
}

TEST(Bruneton, TransmittanceTableAgreesWithIntegrals) {
  const BrunetonAir air(build_scene_model(small_scene(30)));
  const BrunetonTransmittance table(air, {64, 256});
  std::array<double, 1> depth{}, between{};
  BrunetonAir::Columns exact;
  for (const double height : {0.0, 0.3, 2.7, 21.0}) {
    const double r = 6360 + height;
    for (const double mu : {1.0, 0.4, 0.05, -0.9 * air.sphere().rho_km(r) / r}) {
      air.columns(r, mu, 0, bruneton_distance_km(air.sphere(), r, {mu, false}), exact);
      table.depth(r, mu, depth);
      EXPECT_NEAR(depth[0], exact.extinction[0], 3e-3 * exact.extinction[0] + 1e-3)
          << height << ' ' << mu;
    }
  }
  // T(x, y) = T(x, v) / T(y, v) up and, turned round, down to the ground.
  for (const bool ground : {false, true}) {
    const BrunetonView view{ground ? -0.2 : 0.2, ground};
    air.columns(6361.5, view.mu, 0, 5, exact);
    table.between(6361.5, view, 5, between);
    EXPECT_NEAR(between[0], std::exp(-exact.extinction[0]), 2e-3);
  }
}

// Single scattering by plain sums: 2000 steps along the view, 400 along every sunbeam.
double single_scattering(double height_km, const ViewDirection& view, double sun_elevation_rad,
                         double length_km) {
  const double Rg = 6360, Rt = 6420;
  const auto depth = [&](double x, double y, double dx, double dy, double length, int steps) {
    double sum = 0;
    for (int k = 0; k < steps; ++k) {
      const double t = (k + 0.5) * length / steps;
      const double h = std::hypot(x + t * dx, y + t * dy) - Rg;
      sum += (13.5e-3 * std::exp(-h / 8) + 2e-2 / 0.9 * std::exp(-h / 1.2)) * length / steps;
    }
    return sum;
  };
  const double mu = std::sin(view.elevation_rad), mu_s = std::sin(sun_elevation_rad);
  const double nu = mu * mu_s + std::cos(view.elevation_rad) * std::cos(sun_elevation_rad) *
                                    std::cos(view.relative_azimuth_rad);
  const double r = Rg + height_km;
  const double end =
      std::min(length_km, -r * mu + std::sqrt(r * r * mu * mu + (Rt - r) * (Rt + r)));
  const int steps = 2000;
  double sum = 0, passed = 0;
  for (int k = 0; k < steps; ++k) {
    const double step = end / steps, d = (k + 0.5) * step;
    const double rd = std::sqrt(r * r + d * d + 2 * r * d * mu), h = rd - Rg;
    const double cosine = (r * mu_s + d * nu) / rd, sine = std::sqrt(1 - cosine * cosine);
    const double rayleigh = 13.5e-3 * std::exp(-h / 8), mie = 2e-2 * std::exp(-h / 1.2);
    const double extinction = rayleigh + mie / 0.9;
    const bool lit = cosine > 0 || rd * sine > Rg;
    if (lit) {
      const double to_top =
          -rd * cosine + std::sqrt(rd * rd * cosine * cosine + (Rt - rd) * (Rt + rd));
      sum += step * (rayleigh * bruneton_rayleigh_phase(nu) + mie * cornette_shanks(nu, 0.76)) *
             std::exp(-passed - 0.5 * step * extinction - depth(0, rd, sine, cosine, to_top, 400));
    }
    passed += step * extinction;
  }
  return sum;
}

class BrunetonFirstOrder : public testing::Test {
 protected:
  static const BrunetonSky& sky() {
    static const auto made = [] {
      Scene scene = small_scene(12);
      scene.solver.scattering_orders = 1;
      scene.earth.ground_albedo = 0;
      scene.bruneton.scattering_size = {32, 128, 32, 8};
      return std::make_unique<BrunetonSky>(build_scene_model(scene), RunControl{});
    }();
    return *made;
  }
};

TEST_F(BrunetonFirstOrder, EqualsAnIndependentQuadrature) {
  for (const double sun : {40.0, 12.0, 3.0}) {
    const auto at = sky().with_sun_at(sun * kRadPerDeg);
    for (const ViewDirection& view : {ViewDirection{pi / 2, 0}, {0.5, pi / 2}, {0.2, pi}}) {
      const double expected = single_scattering(0, view, sun * kRadPerDeg, 1e9);
      EXPECT_NEAR(at->radiance({&view, 1}).front(), expected, 0.006 * expected)
          << sun << ' ' << view.elevation_rad;
    }
  }
}

TEST_F(BrunetonFirstOrder, AerialPerspectiveEqualsAnIndependentQuadrature) {
  for (const double distance : {20.0, 60.0, 200.0}) {
    const ViewDirection view{0.004, 2.0};
    const double expected = single_scattering(0, view, 12 * kRadPerDeg, distance);
    const auto seen = sky().aerial_light(view, distance).value();
    EXPECT_NEAR(seen.inscattered[0], expected, 0.02 * expected) << distance;
  }
}

class BrunetonSmall : public testing::Test {
 protected:
  static const BrunetonSky& sky() {
    static const BrunetonSky made(build_scene_model([] {
                                    Scene scene = small_scene(20);
                                    scene.observer.height_m = 1500;
                                    return scene;
                                  }()),
                                  RunControl{});
    return made;
  }
};

TEST_F(BrunetonSmall, AerialPerspectiveIsTheDifferenceOfTwoSkies) {
  for (const double elevation : {-0.3, 0.0, 0.4}) {
    const ViewDirection view{elevation, 1.0};
    const auto way = sky().passage(view);
    const auto all = sky().aerial_light(view, 1e9).value(),
               none = sky().aerial_light(view, 0).value();
    EXPECT_EQ(none.transmittance[0], 1);
    EXPECT_EQ(none.inscattered[0], 0);
    const auto half = sky().aerial_light(view, 0.5 * way.length_km).value();
    std::array<double, 1> beyond{};
    sky().tables().inscatter(
        bruneton_advanced(sky().tables().air.sphere(), way.start, 0.5 * way.length_km), beyond);
    EXPECT_NEAR(half.inscattered[0] + half.transmittance[0] * beyond[0], all.inscattered[0], 1e-12);
    EXPECT_LT(half.inscattered[0], all.inscattered[0]);
    EXPECT_LT(all.transmittance[0], half.transmittance[0]);
  }
}

// Eqs. 17 and 18.
TEST_F(BrunetonSmall, ShadowsTakeTheirSegmentsAway) {
  for (const double elevation : {-0.3, 0.3}) {
    const ViewDirection view{elevation, 0.7};
    const auto way = sky().passage(view);
    const double length = way.length_km;
    const double lit = sky().shadowed_inscatter(view, 0.0)[0];
    EXPECT_NEAR(lit, sky().aerial_light(view, 1e9).value().inscattered[0], 1e-15);
    EXPECT_EQ(sky().shadowed_inscatter(view, length)[0], 0);
    EXPECT_EQ(sky().shadowed_inscatter(view, 10 * length)[0], 0);
    double before = lit;
    for (double part = 0.2; part < 1; part += 0.2) {
      const double left = sky().shadowed_inscatter(view, part * length)[0];
      EXPECT_LT(left, before);
      EXPECT_GT(left, 0);
      before = left;
    }
    // Towards the ground the lit part is the near one, towards the sky the far one.
    const double l = 0.4 * length;
    const auto near = sky().aerial_light(view, elevation < 0 ? length - l : l).value();
    const double expected = elevation < 0 ? near.inscattered[0] : lit - near.inscattered[0];
    EXPECT_NEAR(sky().shadowed_inscatter(view, l)[0], expected, 1e-12);
    // A shadow in the middle leaves what both its ends do.
    const double middle = sky().shadowed_inscatter(view, 0.3 * length, 0.6 * length)[0];
    const double shaded = sky().aerial_light(view, 0.6 * length).value().inscattered[0] -
                          sky().aerial_light(view, 0.3 * length).value().inscattered[0];
    EXPECT_NEAR(middle, lit - shaded, 1e-12);
  }
}

TEST_F(BrunetonSmall, IrradianceTableIsTheSkysOwn) {
  // Of all orders but the last (Algorithm 4.1 adds E of the light before each step).
  Scene scene = small_scene(20);
  const BrunetonSky ground = sky_of(scene);
  scene.solver.scattering_orders = 2;
  const Irradiance fewer = sky_of(scene).irradiance();
  std::array<double, 1> table{};
  ground.tables().sky_irradiance(6360, std::sin(20 * kRadPerDeg), table);
  EXPECT_NEAR(table[0], fewer.diffuse[0], 0.02 * table[0]);
  EXPECT_LT(table[0], ground.irradiance().diffuse[0]);
  EXPECT_LT(ground.irradiance().diffuse[0] + ground.irradiance().direct[0],
            std::sin(20 * kRadPerDeg));
}

// What enters the air leaves it, or ends in the ground: over the whole globe, no absorption in the
// air, all orders.
TEST(Bruneton, KeepsEnergyOverTheGlobe) {
  Scene scene = small_scene(90);
  scene.two_constituent_air.mie_single_scattering_albedo = 1;
  scene.earth.ground_albedo = 0.3;
  scene.solver.scattering_orders = 25;
  scene.bruneton.scattering_size = {12, 48, 24, 6};
  scene.bruneton.azimuth_directions = 6;
  scene.bruneton.sun_interpolation = "cubic";
  scene.observer.height_m = 60000;
  const BrunetonSky sky = sky_of(scene);
  const double Rg = 6360, Rt = 6420, horizon = -sky.tables().air.sphere().horizon_km() / Rt;
  double scattered = 0, absorbed = 0, straight = 0;
  const auto over_suns = [&](double from, double to, int n) {
    for (const GaussNode& s : gauss_legendre(n, from, to)) {
      const auto at = sky.with_sun_at(std::asin(s.x));
      double flux = 0;
      for (const auto& [low, high] : {std::array{-1.0, horizon}, std::array{horizon, 0.0}}) {
        for (const GaussNode& v : gauss_legendre(8, low, high)) {
          for (int k = 0; k < 12; ++k) {
            const ViewDirection view{std::asin(v.x), (k + 0.5) * pi / 12};
            flux += v.weight * -v.x * 2 * pi / 12 * at->radiance({&view, 1}).front();
          }
        }
      }
      scattered += 2 * pi * Rt * Rt * s.weight * flux;
      std::array<double, 1> direct{}, diffuse{};
      sky.tables().transmittance.sunlight(Rg, s.x, direct);
      sky.tables().sky_irradiance(Rg, s.x, diffuse);
      absorbed += 0.7 * 2 * pi * Rg * Rg * s.weight * (std::max(0.0, s.x) * direct[0] + diffuse[0]);
    }
  };
  over_suns(kBrunetonLowestMuS, 0, 8);
  over_suns(0, 1, 8);
  for (const GaussNode& b : gauss_legendre(24, Rg, Rt)) {  // sunbeams past the Earth
    std::array<double, 1> depth{};
    sky.tables().transmittance.depth(b.x, 0, depth);
    straight += b.weight * 2 * pi * b.x * std::exp(-2 * depth[0]);
  }
  const double entered = pi * Rt * Rt;
  EXPECT_NEAR((scattered + absorbed + straight) / entered, 1, 0.01)
      << scattered / entered << ' ' << absorbed / entered << ' ' << straight / entered;
}

// Sec. 4: the other colours' Mie term from the red one's is an approximation where colours are
// attenuated differently.
TEST(Bruneton, ProportionalMieIsExactInRedAndNearInOthers) {
  Scene scene = small_scene(25);
  scene.spectrum.wavelengths_nm = {440, 550, 680};
  scene.solver.scattering_orders = 2;
  const BrunetonSky full = sky_of(scene);
  scene.bruneton.proportional_mie = true;
  const BrunetonSky kept = sky_of(scene);
  for (const double elevation : {90.0, 50.0, 20.0}) {
    const ViewDirection view{elevation * kRadPerDeg, 0.3};
    const auto a = full.radiance({&view, 1}), b = kept.radiance({&view, 1});
    EXPECT_NEAR(b[2], a[2], 1e-6 * a[2]);
    EXPECT_NEAR(b[1], a[1], 0.12 * a[1]) << elevation;
    EXPECT_NEAR(b[0], a[0], 0.25 * a[0]) << elevation;
  }
}

TEST(Bruneton, SameBytesForAnyNumberOfThreads) {
  Scene scene = small_scene(-3);
  scene.bruneton.scattering_size = {6, 16, 8, 4};
  scene.solver.threads = 1;
  const BrunetonSky one_thread = sky_of(scene);
  scene.solver.threads = 2;
  const BrunetonSky two_threads = sky_of(scene);
  EXPECT_TRUE(std::ranges::equal(one_thread.tables().rayleigh_and_multiple.values(),
                                 two_threads.tables().rayleigh_and_multiple.values()));
  EXPECT_EQ(one_thread.tables().irradiance, two_threads.tables().irradiance);
}

TEST(Bruneton, StopsWhenTold) {
  const std::atomic<bool> stop = true;
  RunControl control;
  control.cancel = &stop;
  EXPECT_THROW(BrunetonSky(build_scene_model(small_scene(20)), control), Cancelled);
}

TEST(Bruneton, KnowsItsLowestSun) {
  Scene scene = small_scene(-12);
  scene.bruneton.scattering_size = {4, 8, 8, 4};
  scene.solver.scattering_orders = 2;
  try {
    sky_of(scene);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("sun.elevation_deg' = -12: must be -11.5"));
  }
  scene.models.out_of_range = "clamp";
  const BrunetonSky clamped = sky_of(scene);
  ASSERT_EQ(clamped.summary().clamps.size(), 1U);
  EXPECT_GT(one(clamped, 90, 0), 0);
}

TEST(Bruneton, SeenFromSpace) {
  Scene scene = small_scene(40);
  scene.observer.height_m = 2e6;
  const BrunetonSky sky = sky_of(scene);
  EXPECT_EQ(one(sky, 30, 0), 0);    // away from the Earth
  EXPECT_EQ(one(sky, -30, 90), 0);  // past it: the horizon lies at -40.5 degrees
  EXPECT_GT(one(sky, -90, 0), 0);
  // Straight down: the sky's light and the ground's, seen through the same air as from its top.
  scene.observer.height_m = 60000;
  EXPECT_NEAR(one(sky, -90, 0), one(sky_of(scene), -90, 0), 1e-9);
  EXPECT_EQ(sky.sun_transmittance().front(), 1);
}

// The law of the whole: Algorithm 4.1 in its own air is the solution that the successive orders of
// "orders" find by other means. Views of at least 10 degrees, 3 degrees from the Sun.
TEST(Bruneton, EqualsSuccessiveOrdersInItsOwnAir) {
  Scene scene = small_scene(0);
  scene.solver.scattering_orders = 5;
  scene.bruneton = {};
  scene.bruneton.view_samples = 24;
  scene.bruneton.polar_directions = 24;
  scene.bruneton.azimuth_directions = 12;
  scene.bruneton.sun_interpolation = "cubic";
  const BrunetonSky sky = sky_of(scene);
  std::vector<ViewDirection> views = {{pi / 2, 0}};
  for (const double elevation : {10.0, 20.0, 45.0, 70.0}) {
    for (const double azimuth : {0.0, 60.0, 120.0, 180.0}) {
      views.push_back({elevation * kRadPerDeg, azimuth * kRadPerDeg});
    }
  }
  std::shared_ptr<const OrdersField> field;  // serves every Sun
  for (const double sun : {30.0, 0.0, -2.0}) {
    Scene other = scene;
    other.sun.elevation_deg = sun;
    other.solver.method = "orders";
    other.atmosphere.profile = "bruneton2008";
    other.atmosphere.layers = 300;
    other.atmosphere.refraction = false;
    other.solver.polarisation = false;
    other.sun.disc_average = false;
    const SceneModel model = build_scene_model(other);
    const FieldSky solved = field ? sky_from_field(model, field) : solve_sky_and_field(model);
    field = solved.field;
    const auto expected = solved.sky->radiance(views);
    const auto seen = sky.with_sun_at(sun * kRadPerDeg)->radiance(views);
    for (std::size_t k = 0; k < views.size(); ++k) {
      EXPECT_NEAR(seen[k] / expected[k], 1, 0.02)
          << sun << ": " << views[k].elevation_rad / kRadPerDeg << ' '
          << views[k].relative_azimuth_rad / kRadPerDeg;
    }
  }
}

}  // namespace
}  // namespace twilight
