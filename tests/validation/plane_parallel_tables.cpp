// Published tables of plane-parallel Rayleigh atmospheres, polarised.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "sim/orders_grid.h"
#include "sim/orders_sky.h"
#include "tests/validation/checks.h"

namespace twilight::validation {
namespace {

using std::numbers::pi;

// One table: a slab of conservative Rayleigh air without depolarisation over Lambertian ground.
struct Slab {
  std::string name;
  double optical_depth, sun_cosine, albedo;
  /// Radiances are given for an irradiance normal to the beam of pi, or as pi I / (mu0 F0) where
  /// this is set.
  bool over_horizontal_irradiance;
  /// Sign of the table's Q and U over ours (Sky: Q positive for a vertical field).
  double q_sign, u_sign;
  double zenith_step_deg;
};
struct Row {
  bool down;  ///< light going down, as the observer on the ground sees it; else from above
  double cosine, relative_azimuth_deg, i, q, u;
};

// Natraj, Li & Yung (2009), Astrophys. J. 691, 1909: Coulson, Dave and Sekera's tables corrected.
// Theirs is Q = horizontal less vertical.
const Slab kThin{"Natraj, Li & Yung 2009, optical depth 0.5", 0.5, 0.2, 0, false, -1, 1, 1};
constexpr Row kThinRows[] = {
    {true, 0.1, 0, 0.13485741, -0.01538451, 0},
    {true, 0.1, 90, 0.08801144, -0.0589805, 0.02077195},
    {true, 0.1, 180, 0.13070302, -0.01123012, 0},
    {true, 0.2, 0, 0.1583861, -0.01767297, 0},
    {true, 0.2, 90, 0.10033646, -0.07022742, 0.02479837},
    {true, 0.2, 180, 0.14846675, -0.00775363, 0},
    {true, 0.52, 0, 0.12178394, -0.00542392, 0},
    {true, 0.52, 90, 0.07796226, -0.05573965, 0.01823144},
    {true, 0.52, 180, 0.10282324, 0.01353678, 0},
    {true, 0.84, 0, 0.07348081, 0.01547851, 0},
    {true, 0.84, 90, 0.0553467, -0.03883915, 0.00889191},
    {true, 0.84, 180, 0.0585424, 0.03041692, 0},
    {true, 1, 0, 0.04682203, 0.03225729, 0},
    {false, 0.02, 0, 0.44129802, -0.01753141, 0},
    {false, 0.4, 0, 0.1688902, 0.01119511, 0},
    {false, 1, 0, 0.05300496, 0.03755859, 0},
    {false, 0.02, 60, 0.30091208, -0.15965601, 0.07365528},
    {false, 0.4, 60, 0.1275245, -0.06066038, 0.05293867},
    {false, 0.1, 0, 0.35082997, -0.01524525, 0},
    {false, 0.1, 90, 0.21348201, -0.16821107, 0.06357361},
    {false, 0.52, 90, 0.09759154, -0.07273772, 0.02406753},
};
const Slab kBright{
    "Natraj, Li & Yung 2009, optical depth 1, albedo 0.8", 1, 0.6, 0.8, false, -1, 1, 3};
constexpr Row kBrightRows[] = {
    {true, 0.2, 0, 0.54343745, -0.01182454, 0},
    {true, 0.2, 60, 0.48947168, -0.04927829, 0.07677722},
    {true, 0.2, 120, 0.46930289, -0.0291095, 0.09788965},
    {true, 0.2, 180, 0.50309986, 0.02851305, 0},
    {true, 0.52, 0, 0.50768142, -0.02486171, 0},
    {true, 0.52, 60, 0.44678528, -0.0628504, 0.05299454},
    {true, 0.52, 120, 0.39713938, -0.0132045, 0.11236937},
    {true, 0.52, 180, 0.40838961, 0.0744301, 0},
    {true, 0.84, 0, 0.40181472, -0.00108813, 0},
    {true, 0.84, 60, 0.36677945, -0.05263716, 0.00397016},
    {true, 0.84, 120, 0.32219935, -0.00805706, 0.08795246},
    {true, 0.84, 180, 0.31265451, 0.08807208, 0},
    {true, 1, 0, 0.31234078, 0.05344101, 0},
};
// Natraj & Hovenier (2012), Astrophys. J. 748, 28. Theirs is Q = vertical less horizontal.
const Slab kThick{
    "Natraj & Hovenier 2012, optical depth 2, albedo 0.25", 2, 0.5, 0.25, false, 1, -1, 3};
constexpr Row kThickRows[] = {
    {true, 0.1, 0, 0.15069939, -0.00095723, 0},
    {true, 0.1, 90, 0.13217771, 0.01409473, -0.0190273},
    {true, 0.1, 180, 0.14689393, -0.00476269, 0},
    {true, 0.5, 0, 0.22452437, 0.01119809, 0},
    {true, 0.5, 90, 0.1841865, 0.03343917, -0.03374152},
    {true, 0.5, 180, 0.19078285, -0.02254344, 0},
    {true, 0.9, 0, 0.21782802, -0.01125754, 0},
    {true, 0.9, 90, 0.19125214, 0.03941798, -0.02137444},
    {true, 0.9, 180, 0.17935403, -0.04973153, 0},
    {true, 1, 0, 0.18851672, -0.03911481, 0},
};
// Kokhanovsky et al. (2010), J. Quant. Spectrosc. Radiat. Transfer 111, 1931, Table A1: pi I /
// (mu0 F0) of the light let through; I alone is at hand.
const Slab kKokhanovsky{
    "Kokhanovsky et al. 2010, optical depth 0.3262", 0.3262, 0.5, 0, true, 0, 0, 3};
constexpr Row kKokhanovskyRows[] = {
    {true, 1, 0, 0.1396923, 0, 0},          {true, 0.766044, 0, 0.259092, 0, 0},
    {true, 0.766044, 90, 0.1689676, 0, 0},  {true, 0.766044, 180, 0.1509949, 0, 0},
    {true, 0.017452, 0, 0.5599639, 0, 0},   {true, 0.017452, 90, 0.3617355, 0, 0},
    {true, 0.017452, 180, 0.5515021, 0, 0},
};

// A plane-parallel slab depends on optical depth alone, so the air may be spread over the height
// as suits the levels of the field: steps of optical depth that are finest at both faces, where the
// source bends. (In a slab of even density the longest steps are at the top: 0.4 % low at optical
// depth 2 with 50 levels, 0.1 % with 100.) 1 km of air on a sphere of 1e6 km: with 10 km curvature
// takes 1.1 % off a ray at mu = 0.02.
SceneModel model_of(const Slab& slab, const Settings& settings) {
  constexpr double kTopKm = 1, kEarthRadiusKm = 1e6;
  SceneModel model;
  Scene& scene = model.scene;
  scene.solver.method = "orders";
  scene.solver.altitude_levels = settings.quick ? 36 : 64;
  scene.solver.order_tolerance =
      1e-4;  // of 50 orders at optical depth 2; the tables have six digits
  scene.solver.polar_directions = settings.quick ? 20 : 32;
  scene.solver.azimuth_directions = 12;
  scene.solver.zenith_step_deg = slab.zenith_step_deg;
  scene.sun.disc_average = false;
  scene.atmosphere.refraction = false;
  scene.atmosphere.refractive_spreading = false;
  scene.aerosols.type = "none";
  scene = with_overrides(scene, settings);
  Medium& m = model.medium;
  m.earth_radius_km = kEarthRadiusKm;
  m.wavelength_nm = {550};
  m.boundary_km = orders_levels(kTopKm, scene.solver.altitude_levels);
  m.zero_tables();
  for (std::size_t i = 0; i < m.layers(); ++i) {
    const auto below = [&](std::size_t k) {
      const double x = static_cast<double>(k) / static_cast<double>(m.layers());
      return x * x * (3 - 2 * x);
    };
    m.air_scattering_per_km(i, 0) =
        slab.optical_depth * (below(i + 1) - below(i)) / (m.boundary_km[i + 1] - m.boundary_km[i]);
  }
  m.depolarisation = {0};
  model.solar_irradiance = {1};
  model.ground_albedo = {slab.albedo};
  model.sun_elevation_rad = std::asin(slab.sun_cosine);
  return model;
}

Check check_table(const Slab& slab, std::span<const Row> rows, const Settings& settings) {
  constexpr double kBar = 0.003;
  const Stopwatch watch;
  SceneModel model = model_of(slab, settings);
  const OrdersSky from_below(model, RunControl{});
  model.scene.observer.height_m = 1e3 * model.medium.top_km();
  const OrdersSky from_above(model, from_below.field(), RunControl{});
  double worst[3] = {};
  std::string at;
  for (const Row& row : rows) {
    const double elevation = std::asin(row.cosine);
    const ViewDirection view{row.down ? elevation : -elevation,
                             row.relative_azimuth_deg * kRadPerDeg};
    const StokesRadiance light = (row.down ? from_below : from_above).stokes({&view, 1});
    const double unit = slab.over_horizontal_irradiance ? pi / slab.sun_cosine : pi;
    const double ours[3] = {unit * light.i[0], slab.q_sign * unit * light.q[0],
                            slab.u_sign * unit * light.u[0]};
    const double theirs[3] = {row.i, row.q, row.u};
    for (int k = 0; k < (slab.q_sign == 0 ? 1 : 3); ++k) {
      const double difference = ours[k] / row.i - theirs[k] / row.i;
      if (std::abs(difference) > std::abs(worst[k])) worst[k] = difference;
      say(settings, fmt::format("{}, {} mu {:g} azimuth {:g}: {} {:+.3f} % of I", slab.name,
                                row.down ? "down" : "up", row.cosine, row.relative_azimuth_deg,
                                "IQU"[k], 100 * difference));
    }
  }
  Check check;
  check.name = fmt::format("{}, {} rows", slab.name, rows.size());
  check.bar = slab.q_sign == 0 ? "I within 0.3 %" : "I, Q, U within 0.3 % of I";
  check.measured = slab.q_sign == 0 ? fmt::format("largest: I {:+.3f} %", 100 * worst[0])
                                    : fmt::format("largest: I {:+.3f} %, Q {:+.3f} %, U {:+.3f} %",
                                                  100 * worst[0], 100 * worst[1], 100 * worst[2]);
  check.holds = std::ranges::all_of(worst, [](double w) { return std::abs(w) <= kBar; });
  check.seconds = watch.seconds();
  return check;
}

// Adams & Kattawar (1978), Icarus 35, 139, Table I: single scattering of Rayleigh air of vertical
// optical depth 0.25, even over 100 km, black ground, seen from the top with the Sun's zenith angle
// there; R = 6371 km, and plane. The radiance is that of a solar irradiance of pi.
struct AdamsKattawarRow {
  double sun_zenith_deg, view_zenith_deg, azimuth_deg, plane, spherical;
};
constexpr AdamsKattawarRow kAdamsKattawar[] = {
    {84.26, 0, 0, 0.0161, 0.0193},
    {0, 70, 0, 0.0975, 0.102},
    {84.26, 70, 0, 0.0738, 0.0962},
    {84.26, 70, 180, 0.079, 0.0872},
};

Check adams_kattawar(const Settings& settings) {
  const Stopwatch watch;
  SceneModel model;
  Scene& scene = model.scene;
  scene.solver.method = "orders";
  scene.solver.scattering_orders = 1;
  scene.solver.altitude_levels = 16;
  scene.solver.polar_directions = 8;
  scene.solver.azimuth_directions = 4;
  scene.solver.zenith_step_deg = 3;
  scene.sun.disc_average = false;
  scene.atmosphere.refraction = false;
  scene.atmosphere.refractive_spreading = false;
  scene.aerosols.type = "none";
  Medium& m = model.medium;
  m.wavelength_nm = {550};
  constexpr double kTopKm = 100, kDepth = 0.25;
  for (int i = 0; i <= 100; ++i) m.boundary_km.push_back(kTopKm * i / 100);
  m.depolarisation = {0};
  model.solar_irradiance = {1};
  model.ground_albedo = {0};
  scene.observer.height_m = 1e3 * kTopKm;
  double worst = 0;
  bool holds = true;
  std::string values;
  for (const bool plane : {true, false}) {
    m.earth_radius_km = plane ? 1e8 : 6371;
    m.zero_tables();
    for (std::size_t i = 0; i < m.layers(); ++i) m.air_scattering_per_km(i, 0) = kDepth / kTopKm;
    for (const AdamsKattawarRow& row : kAdamsKattawar) {
      model.sun_elevation_rad = (90 - row.sun_zenith_deg) * kRadPerDeg;
      const OrdersSky sky(model, RunControl{});
      const ViewDirection view{(row.view_zenith_deg - 90) * kRadPerDeg,
                               row.azimuth_deg * kRadPerDeg};
      const double ours = pi * sky.single_scattering({&view, 1}).i[0];
      const double theirs = plane ? row.plane : row.spherical;
      // Half of the last digit printed.
      const double digits = theirs == 0.102 ? 0.0005 : 0.00005;
      holds = holds && std::abs(ours - theirs) <= 1.02 * digits;
      worst = std::max(worst, std::abs(ours - theirs));
      values += fmt::format("{}{:.5f}", values.empty() ? "" : ", ", ours);
      say(settings,
          fmt::format("Adams & Kattawar, {}, Sun {:g}, view {:g}/{:g}: {:.5f}, table {:g}",
                      plane ? "plane" : "spherical", row.sun_zenith_deg, row.view_zenith_deg,
                      row.azimuth_deg, ours, theirs));
    }
  }
  return {"Adams & Kattawar 1978, single scattering, plane (4) and spherical (4)",
          "the printed digits", values, holds, watch.seconds()};
}

}  // namespace

std::vector<Section> plane_parallel_sections() {
  return {{"natraj", "plane-parallel polarised tables through a huge Earth radius",
           [](const Settings& settings) {
             return std::vector<Check>{check_table(kThin, kThinRows, settings),
                                       check_table(kBright, kBrightRows, settings),
                                       check_table(kThick, kThickRows, settings)};
           }},
          {"kokhanovsky", "light let through by a thinner slab",
           [](const Settings& settings) {
             return std::vector<Check>{check_table(kKokhanovsky, kKokhanovskyRows, settings)};
           }},
          {"adams-kattawar", "single scattering, plane and spherical",
           [](const Settings& settings) { return std::vector<Check>{adams_kattawar(settings)}; }}};
}

}  // namespace twilight::validation
