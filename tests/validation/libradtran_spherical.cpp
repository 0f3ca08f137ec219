// A twilight sky published with a Monte Carlo code in spherical geometry.
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "atmosphere/profile.h"
#include "sim/orders_sky.h"
#include "tests/validation/checks.h"

namespace twilight::validation {
namespace {

// libRadtran, examples/UVSPEC_MC_SPHERICAL (MYSTIC, polarised, 1e6 photons, its noise is not
// given): US standard air without aerosol, black ground, Earth radius 6370 km, Sun at zenith angle
// 92 deg, zenith seen from the ground at 500 nm, no refraction: I, Q over the solar irradiance.
// Ozone and nitrogen dioxide by libRadtran's own profile, the AFGL one.
constexpr double kI = 4.02704e-4, kQ = -3.42839e-4;

std::vector<Check> libradtran(const Settings& settings) {
  const Stopwatch watch;
  Scene scene;
  scene.sun.elevation_deg = -2;
  scene.sun.disc_average = false;
  scene.earth.radius_km = 6370;
  scene.earth.ground_albedo = 0;
  scene.atmosphere.refraction = false;
  scene.atmosphere.refractive_spreading = false;
  scene.atmosphere.top_km = 120;
  scene.aerosols.type = "none";
  scene.spectrum.wavelengths_nm = {500};
  scene.solver.method = "orders";
  scene = with_overrides(scene, settings);
  const SceneModel model = build_scene_model(scene);
  const OrdersSky sky(model, RunControl{});
  const ViewDirection zenith{std::numbers::pi / 2, 0};
  const StokesRadiance light = sky.stokes({&zenith, 1});
  const double i = light.i[0] / model.solar_irradiance[0] / kI - 1;
  const double q = light.q[0] / model.solar_irradiance[0] / kQ - 1;
  double depth = 0, gas = 0;
  const Medium& m = model.medium;
  for (std::size_t k = 0; k < m.layers(); ++k) {
    depth += m.air_scattering_per_km(k, 0) * (m.boundary_km[k + 1] - m.boundary_km[k]);
    gas += m.gas_absorption_per_km(k, 0) * (m.boundary_km[k + 1] - m.boundary_km[k]);
  }
  // 1 DU = 2.687e16 cm^-2; densities in cm^-3, heights in km.
  const Profile profile = Profile::named(scene.atmosphere.profile);
  const auto column = [&](Profile::Gas density) {
    return profile.mean(density, 0, profile.top_km()) * profile.top_km() * 1e5 / 2.687e16;
  };
  return {{"libRadtran, spherical, Sun -2, zenith, 500 nm", "I within 1 %, Q within 2 %",
           fmt::format("I {:+.2f} %, Q {:+.2f} % (ozone {:.1f} DU, NO2 {:.3f} DU: the profile's "
                       "own; optical depth of air {:.4f}, of gases {:.4f})",
                       100 * i, 100 * q,
                       scene.atmosphere.ozone_du.value_or(column(&ProfileLevel::ozone_per_cm3)),
                       scene.atmosphere.nitrogen_dioxide_du.value_or(
                           column(&ProfileLevel::nitrogen_dioxide_per_cm3)),
                       depth, gas),
           std::abs(i) <= 0.01 && std::abs(q) <= 0.02, watch.seconds()}};
}

}  // namespace

std::vector<Section> libradtran_sections() {
  return {{"libradtran", "zenith with the Sun two degrees down, by MYSTIC", libradtran}};
}

}  // namespace twilight::validation
