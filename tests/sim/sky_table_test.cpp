#include "sim/sky_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "sim/aerosol_emission.h"
#include "sim/angular_moments.h"
#include "sim/emission_kernel.h"
#include "sim/orders_sky.h"
#include "sim/scene_model.h"
#include "sim/sky_table_kernel.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kDegree = pi / 180;

// The default air, or another aerosol in it, on a coarse grid: only the views are looked at.
SceneModel model_of(const std::string& aerosol) {
  Scene scene;
  scene.solver.method = "orders";
  scene.aerosols.type = aerosol;
  scene.sun.elevation_deg = 0;
  scene.spectrum.wavelengths_nm = {400, 550, 750};
  scene.solver.altitude_levels = 30;
  scene.solver.zenith_step_deg = 1.5;
  scene.solver.polar_directions = 8;
  scene.solver.azimuth_directions = 6;
  scene.solver.threads = 2;
  return build_scene_model(scene);
}

std::shared_ptr<const OrdersAtmosphere> atmosphere_of(const std::string& aerosol) {
  static std::map<std::string, std::shared_ptr<const OrdersAtmosphere>> known;
  auto& atmosphere = known[aerosol];
  if (!atmosphere) atmosphere = OrdersSky(model_of(aerosol), {}).atmosphere();
  return atmosphere;
}

SceneModel placed(const std::string& aerosol, double sun_deg, double height_km) {
  SceneModel model = model_of(aerosol);
  model.sun_elevation_rad = sun_deg * kDegree;
  model.scene.observer.height_m = 1e3 * height_km;
  return model;
}

TEST(CubicNodes, CubicsAreExact) {
  const auto law = [](double x) { return 1 - 2 * x + 0.5 * x * x - 3 * x * x * x; };
  const CubicNodes nodes({0, 0.1, 0.35, 0.4, 0.9, 1}, false);
  for (double x = 0; x <= 1; x += 0.013) {
    const CubicNodes::Stencil s = nodes.at(x);
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += s.weight[k] * law(nodes.nodes()[s.node[k]]);
    EXPECT_NEAR(sum, law(x), 1e-12) << x;
  }
}

TEST(CubicNodes, MirroredEndsAreFlat) {
  std::vector<double> at;
  for (int k = 0; k <= 12; ++k) at.push_back(pi * k / 12);
  const CubicNodes nodes(at, true);
  for (double x = 0; x <= pi; x += 0.01) {
    const CubicNodes::Stencil s = nodes.at(x);
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += s.weight[k] * std::cos(nodes.nodes()[s.node[k]]);
    EXPECT_NEAR(sum, std::cos(x), 2e-4) << x;
  }
}

TEST(CubicNodes, FewNodesMakeLowerDegrees) {
  const CubicNodes nodes({0, 0.3, 1}, false);
  for (double x = 0; x <= 1; x += 0.1) {
    const CubicNodes::Stencil s = nodes.at(x);
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const double at = nodes.nodes()[s.node[k]];
      sum += s.weight[k] * (2 + at - at * at);
    }
    EXPECT_NEAR(sum, 2 + x - x * x, 1e-12) << x;
  }
}

class Numbers {
 public:
  std::vector<float> operator()(std::size_t count, double low, double high) {
    std::uniform_real_distribution<double> uniform(low, high);
    std::vector<float> values(count);
    for (float& v : values) v = static_cast<float>(uniform(engine_));
    return values;
  }

 private:
  std::mt19937_64 engine_{3};
};

void expect_near(const std::vector<float>& a, const std::vector<float>& b, double relative) {
  ASSERT_EQ(a.size(), b.size());
  float largest = 0;
  for (const float x : b) largest = std::max(largest, std::abs(x));
  for (std::size_t k = 0; k < a.size(); ++k) EXPECT_NEAR(a[k], b[k], relative * largest) << k;
}

TEST(SkyTableKernel, EmissionIsTheFieldKernels) {
  constexpr std::size_t kNodes = 5, kLanes = 16;
  constexpr int kDegree24 = 24;
  Numbers numbers;
  const std::size_t count = moment_count(kDegree24), rows = kDegree24 + 1;
  const auto coherency = numbers(kNodes * 4 * kLanes, -1, 1), weight = numbers(kLanes, 0, 1);
  const auto moments = numbers(kNodes * 3 * count * kLanes, -1, 1);
  const auto p = numbers(count, -1, 1), a1 = numbers(rows * kLanes, 0, 1);
  auto b1 = numbers(rows * kLanes, -1, 1);
  std::fill_n(b1.begin(), 2 * kLanes, 0.0F);  // Q and U have no degrees below 2
  for (const bool polarised : {true, false}) {
    for (const bool aerosol : {true, false}) {
      EmissionInput in;
      in.nodes = kNodes;
      in.lanes = kLanes;
      in.cos_theta = 0.6F;
      in.sin_theta = 0.8F;
      in.coherency = coherency.data();
      in.air_weight = weight.data();
      AirEmission<float> air;
      air.nodes = kNodes;
      air.lanes = kLanes;
      air.polarised = polarised;
      air.cos_theta = 0.6F;
      air.sin_theta = 0.8F;
      air.coherency = coherency.data();
      air.air_weight = weight.data();
      air.degree = aerosol ? kDegree24 : 2;
      const std::size_t stokes = polarised ? 3 : 1, modes = aerosol ? rows : 3;
      const std::size_t stored = mode_rows(air.degree);
      std::vector<float> all(kNodes * stokes * stored * kLanes), fast(kNodes * modes * kLanes);
      std::vector<float> scalar(fast), first;
      air_modes_scalar(air, all.data());
      if (aerosol) {
        in.moments = moments.data();
        in.moments_per_node = polarised ? 3 * count : count;
        in.e_offset = polarised ? count : 0;
        in.degree = kDegree24;
        in.p = p.data();
        in.a1 = a1.data();
        in.b1 = b1.data();
        const std::vector<double> a(a1.begin(), a1.end());
        const TruncatedPhase kind{a, {b1.begin(), b1.end()}, a, a, {}};
        std::vector<float> scattered(kNodes * count * stokes * kLanes), basis(3 * count);
        for (int l = 0; l <= kDegree24; ++l) {
          for (int m = 0; m <= l; ++m) {
            basis[3 * mode_major_index(kDegree24, l, m)] = p[moment_index(l, m)];
          }
        }
        scatter_moments<float>({kNodes, kLanes, polarised, kDegree24, moments.data(), nullptr},
                               kind, kDegree24, scattered.data());
        const std::vector<float> one(kLanes, 1.0F);
        AerosolPoints<float> points;
        points.nodes = kNodes;
        points.lanes = kLanes;
        points.polarised = polarised;
        points.degree = points.phase_degree = kDegree24;
        points.scattered = scattered.data();
        points.points = 1;
        points.basis[0] = basis.data();
        points.weight[0] = one.data();
        points.modes[0] = all.data();
        add_aerosol_modes_scalar(points);
      }
      for (std::size_t j = 0; j < kNodes; ++j) {
        const auto from = all.begin() + static_cast<std::ptrdiff_t>(j * stokes * stored * kLanes);
        first.insert(first.end(), from, from + static_cast<std::ptrdiff_t>(modes * kLanes));
      }
      emission_modes(in, fast.data());
      emission_modes_scalar(in, scalar.data());
      expect_near(scalar, first, 1e-6);
      expect_near(fast, first, 2e-6);
    }
  }
}

TEST(SkyTableKernel, AgreesWithItsScalarTwin) {
  constexpr std::size_t kLanes = 8, kModes = 7, kAzimuths = 3;
  Numbers numbers;
  const auto modes = numbers(4 * kModes * kLanes, -1, 1), cosines = numbers(kModes, -1, 1);
  const auto reference = numbers(2 * kLanes, 0, 1), shift = numbers(kLanes, -1e-4, 1e-4);
  std::vector<EmissionTaps> taps(kAzimuths);
  for (EmissionTaps& t : taps) {
    t.modes = modes.data();
    for (float& w : t.weight) w = numbers(1, -0.2, 1)[0];
    t.cosines = cosines.data();
    t.reference = reference.data();
    t.share = 0.3F;
    t.share_per_rad = 1146;
  }
  std::vector<float> a(kAzimuths * kLanes, 0.5F), b(a);
  add_emission(taps.data(), kAzimuths, kModes, kLanes, shift.data(), a.data());
  add_emission_scalar(taps.data(), kAzimuths, kModes, kLanes, shift.data(), b.data());
  expect_near(a, b, 1e-6);

  // Sunlight, its edge and night.
  constexpr std::size_t kWindows = 30, kScatterers = 3;
  auto logarithm = numbers(kWindows * 8 * kLanes, -20, 0);
  for (std::size_t k = 0; k < logarithm.size(); k += 11) logarithm[k] = SunlitAir::kNight;
  const auto scatter = numbers(kWindows * kScatterers * kLanes, 0, 1);
  const auto above = numbers(kWindows * kLanes, -0.1, 0.1);
  const auto angle = numbers(kWindows * kLanes, -1e-3, 1e-3);
  std::vector<BeamTaps> beams(kWindows);
  for (std::size_t k = 0; k < kWindows; ++k) {
    for (std::size_t q = 0; q < 8; ++q) {
      beams[k].sun.logarithm[q / 4][q % 4] = &logarithm[(8 * k + q) * kLanes];
    }
    beams[k].sun.share[0] = 0.2F;
    beams[k].sun.share[1] = 0.7F;
    beams[k].above = 0.4F;
    beams[k].share_per_rad = 900;
    beams[k].along = 0.01F;
    beams[k].below = -0.02F;
  }
  const BeamPath path{kWindows,       kScatterers,  kLanes,      beams.data(),
                      scatter.data(), above.data(), angle.data()};
  std::vector<float> light(kScatterers * kLanes), place(2 * light.size());
  std::vector<float> light_scalar(light), place_scalar(place);
  add_beam(path, light.data(), place.data());
  add_beam_scalar(path, light_scalar.data(), place_scalar.data());
  expect_near(light, light_scalar, 1e-5);
  expect_near(place, place_scalar, 1e-5);

  // A view, from the forward peak to backscattering.
  std::vector<float> phase;
  for (std::size_t k = 0; k < 2 * PhaseTable::kNodes; ++k) {
    const double t = static_cast<double>(k % PhaseTable::kNodes) / PhaseTable::kNodes;
    phase.insert(phase.end(), 2 * kLanes, static_cast<float>(std::exp(-4 * t) + 0.01 * t));
  }
  const auto share = numbers(kLanes, 0.9, 1);
  const auto nodes = numbers(16 * (1 + 3 * kScatterers) * kLanes, -1e-6, 1e-6);
  for (const double scattering : {0.01, 0.1, 1.5, 3.0, 3.14}) {
    SkyPoint point;
    point.nodes = 16;
    for (std::size_t k = 0; k < 16; ++k) {
      point.node[k] = &nodes[k * (1 + 3 * kScatterers) * kLanes];
      point.weight[k] = k == 5 ? 1.0F : 0.0F;
    }
    point.scatterers = kScatterers;
    point.lanes = kLanes;
    point.along = static_cast<float>(std::cos(scattering));
    point.below = static_cast<float>(0.6 * std::sin(scattering));
    point.across = static_cast<float>(0.8 * std::sin(scattering));
    point.anisotropic_share = share.data();
    point.phase = phase.data();
    std::vector<float> fast(kLanes), slow(kLanes);
    sky_radiance(point, fast.data());
    sky_radiance_scalar(point, slow.data());
    expect_near(fast, slow, 1e-4);
  }
}

TEST(SkyTable, AgreesWithGatheredViews) {
  struct Case {
    const char* aerosol;
    double height_km;
    std::vector<double> suns;
  };
  const std::vector<double> all = {30, 5, 0, -3, -6, -9, -12, -18};
  const std::vector<Case> cases = {
      {"continental_average", 0, all},     {"none", 0, {30, 0, -6, -12}}, {"urban", 0, {5, -3, -9}},
      {"continental_average", 3, {0, -6}}, {"urban", 12, {30, -3}},       {"none", 400, {5, -6}}};
  std::vector<double> errors;
  std::mt19937_64 engine(11);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const Case& c : cases) {
    for (const double sun : c.suns) {
      const SceneModel model = placed(c.aerosol, sun, c.height_km);
      const OrdersSky sky(model, atmosphere_of(c.aerosol), {});
      std::vector<ViewDirection> views;
      for (int k = 0; k < 90; ++k) {
        // All over the sphere, the lowest sky and the Sun's surroundings.
        const double azimuth = pi * uniform(engine), x = uniform(engine);
        if (k % 3 == 0) views.push_back({std::asin(2 * x - 1), azimuth});
        if (k % 3 == 1) views.push_back({0.3 * x, azimuth});
        if (k % 3 == 2) views.push_back({(sun + 20 * (x - 0.5)) * kDegree, 0.1 * azimuth});
      }
      const auto table = sky.map_radiance(views), gathered = sky.radiance(views);
      const std::size_t W = sky.wavelength_nm().size();
      for (std::size_t k = 0; k < views.size(); ++k) {
        double worst = 0;
        for (std::size_t w = 0; w < W; ++w) {
          const double wanted = gathered[k * W + w];
          ASSERT_GE(table[k * W + w], 0);
          // Fainter than a thousandth of the moonless night's own light nobody sees twilight.
          if (wanted < 1e-13 * sky.solar_irradiance()[w]) continue;
          worst = std::max(worst, std::abs(table[k * W + w] / wanted - 1));
        }
        errors.push_back(worst);
        EXPECT_LT(worst, 5e-3) << c.aerosol << ", " << c.height_km << " km, Sun " << sun << ": "
                               << views[k].elevation_rad / kDegree << ", "
                               << views[k].relative_azimuth_rad / kDegree;
      }
    }
  }
  std::ranges::sort(errors);
  const auto share = [&](double x) {
    return errors[static_cast<std::size_t>(x * static_cast<double>(errors.size() - 1))];
  };
  EXPECT_LT(share(0.999), 1e-3);
  EXPECT_LT(share(0.5), 1e-4);
  RecordProperty("median", std::to_string(share(0.5)));
  RecordProperty("percentile_99", std::to_string(share(0.99)));
  RecordProperty("percentile_99_9", std::to_string(share(0.999)));
  RecordProperty("worst", std::to_string(errors.back()));
}

TEST(SkyTable, SwitchedOffEveryViewIsGathered) {
  SceneModel model = placed("none", -4, 0);
  const std::vector<ViewDirection> views = {{0.3, 0.2}, {0.01, 3}, {1.2, 2}, {-0.4, 1}};
  model.scene.solver.view_interpolation = false;
  const OrdersSky sky(model, atmosphere_of("none"), {});
  EXPECT_EQ(sky.map_radiance(views), sky.radiance(views));
}

// The irradiance shares rays among azimuths; its views are not interpolated.
TEST(SkyTable, IrradianceIsThatOfGatheredViews) {
  double worst = 0;
  for (const char* aerosol : {"none", "urban"}) {
    for (const double sun : {30.0, -3.0, -9.0}) {
      SceneModel model = placed(aerosol, sun, 0);
      const Irradiance shared = OrdersSky(model, atmosphere_of(aerosol), {}).irradiance();
      model.scene.solver.view_interpolation = false;
      const Irradiance gathered = OrdersSky(model, atmosphere_of(aerosol), {}).irradiance();
      EXPECT_EQ(shared.direct, gathered.direct);
      for (std::size_t w = 0; w < 3; ++w) {
        worst = std::max(worst, std::abs(shared.diffuse[w] / gathered.diffuse[w] - 1));
      }
    }
  }
  EXPECT_LT(worst, 1e-3);
  RecordProperty("worst", std::to_string(worst));
}

TEST(SkyTable, SameBytesForAnyNumberOfThreads) {
  SceneModel model = placed("continental_average", -4, 0);
  std::vector<ViewDirection> views;
  for (int k = 0; k < 500; ++k) views.push_back({0.003 * k, 0.7 * k});
  const auto atmosphere = atmosphere_of("continental_average");
  const auto two = OrdersSky(model, atmosphere, {}).map_radiance(views);
  model.scene.solver.threads = 1;
  EXPECT_EQ(OrdersSky(model, atmosphere, {}).map_radiance(views), two);
}

// A further Sun's sky is that of a scene solved for it, and mirror symmetric.
TEST(SkyTable, FurtherSunsShareTheAtmosphere) {
  const auto atmosphere = atmosphere_of("none");
  const OrdersSky first(placed("none", 20, 0), atmosphere, {});
  const auto further = first.under(-5 * kDegree);
  const OrdersSky own(placed("none", -5, 0), first.field(), {});
  const std::vector<ViewDirection> views = {{0.3, 0.2}, {0.01, 3}, {1.2, 2}, {0.3, -0.2}};
  EXPECT_EQ(further->stokes(views).i, own.stokes(views).i);
  EXPECT_EQ(further->irradiance().diffuse, own.irradiance().diffuse);
  EXPECT_EQ(further->sun_transmittance(), own.sun_transmittance());
  const auto map = further->map_radiance(views);
  EXPECT_EQ(map, own.map_radiance(views));
  for (std::size_t w = 0; w < 3; ++w) EXPECT_EQ(map[w], map[9 + w]);
}

// The ground at one's feet, and nothing above the air.
TEST(SkyTable, GroundBelowAndNothingAbove) {
  const auto atmosphere = atmosphere_of("none");
  const OrdersSky low(placed("none", 20, 0), atmosphere, {});
  const std::vector<ViewDirection> down = {{-0.01, 0.5}, {-1.0, 2.0}, {-pi / 2, 0}};
  const auto ground = low.map_radiance(down), gathered = low.radiance(down);
  for (std::size_t k = 0; k < ground.size(); ++k) EXPECT_NEAR(ground[k] / gathered[k], 1, 1e-5);
  const OrdersSky orbit(placed("none", 20, 400), atmosphere, {});
  const std::vector<ViewDirection> up = {{0.2, 0.5}, {-0.2, 2.0}};
  for (const double i : orbit.map_radiance(up)) EXPECT_EQ(i, 0);
}

}  // namespace
}  // namespace twilight
