#include "random_scene.h"

#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "sim/scene_file.h"

namespace twilight {

// Uniform whatever RapidCheck's size is: small sizes are no simpler scenes here.
int between(int lowest, int highest) {
  return *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(lowest, highest + 1));
}

double between(double lowest, double highest) {
  constexpr int kSteps = 1 << 20;
  return lowest + (highest - lowest) * between(0, kSteps) / kSteps;
}

bool one_in(int n) { return between(1, n) == 1; }

namespace {

std::string one_of(const std::vector<std::string>& words) {
  return words[static_cast<std::size_t>(between(0, static_cast<int>(words.size()) - 1))];
}

void draw_sun_and_earth(Scene& scene) {
  // Ends and middle of the range are where geometry degenerates; nights teach little.
  scene.sun.elevation_deg = one_in(8)    ? 9.0 * between(-2, 10)
                            : one_in(12) ? between(-90.0, -18.0)
                                         : between(-18.0, 90.0);
  scene.sun.spectrum = one_of({"gueymard2004", "unit"});
  scene.earth.ground_albedo = one_in(4) ? between(0, 1) : between(0.0, 1.0);
  if (one_in(6)) scene.earth.radius_km = 1000 * std::pow(70.0, between(0.0, 1.0));
}

void draw_air(Scene& scene, SceneSize size) {
  AtmosphereOptions& air = scene.atmosphere;
  air.profile = one_of({"us_standard", "tropical", "midlatitude_summer", "midlatitude_winter",
                        "subarctic_summer", "subarctic_winter", "exponential"});
  air.top_km = one_in(6) ? between(1.0, 15.0) : between(15.0, 120.0);
  const bool large = size == SceneSize::kLarge;
  air.layers = one_in(large ? 12 : 200) ? 500 : between(1, large ? 100 : one_in(10) ? 60 : 12);
  air.layer_spacing = one_of({"graded", "equal-air-mass", "even"});
  air.layer_optics = one_of({"mean", "centre"});
  if (one_in(3)) air.ozone_du = one_in(3) ? 0.0 : between(0.0, 1000.0);
  air.ozone = one_of({"layered", "vertical"});
  if (one_in(4)) air.nitrogen_dioxide_du = between(0.0, 5.0);
  // Bent rays take far longer to tabulate than straight ones.
  air.refraction = large ? !one_in(3) : one_in(scene.solver.method == "cells" ? 30 : 8);
  air.refractive_spreading = !one_in(3);
  air.refractive_index = one_of({"ciddor", "haber2005"});
  if (one_in(4)) air.depolarisation = between(0.0, 0.857);
}

void draw_aerosols(Scene& scene) {
  scene.aerosols.type = one_of({"none", "continental_clean", "continental_average",
                                "continental_polluted", "urban", "desert", "maritime_clean",
                                "maritime_polluted", "maritime_tropical", "arctic", "antarctic"});
  if (one_in(4)) scene.aerosols.type = "none";
  scene.aerosols.relative_humidity_percent = one_in(4) ? 99.0 * between(0, 1) : between(0.0, 99.0);
  if (scene.aerosols.type == "none" || !one_in(4)) return;
  scene.aerosols.optical_depth_550nm =
      one_in(6) ? 100.0 * between(0, 1) : std::pow(10.0, between(-3.0, 2.0));
}

void draw_wavelengths(Scene& scene, int most) {
  const int wavelengths = between(1, most);
  scene.spectrum.wavelengths_nm.clear();
  double nm = one_in(10) ? 280.0 : between(280.0, 700.0);
  for (int i = 0; i < wavelengths; ++i) {
    scene.spectrum.wavelengths_nm.push_back(nm);
    nm += between(0.5, 300.0 / wavelengths);
  }
  if (one_in(10)) scene.spectrum.wavelengths_nm = {1000.0};
}

void draw_cells(Scene& scene, SceneSize size) {
  SolverOptions& solver = scene.solver;
  const bool large = size == SceneSize::kLarge;
  solver.azimuth_divisions = 2 * between(2, large ? 18 : 6);
  solver.active_shell_stride = between(1, 8);
  solver.inner_radius_m = one_in(6) ? std::pow(10.0, between(0.0, 2.5)) : between(500.0, 10000.0);
  if (one_in(large ? 15 : 100)) {
    solver.azimuth_divisions = 2 * (large ? between(20, one_in(20) ? 180 : 90) : between(7, 24));
    solver.active_shell_stride = large ? 32 : 16;
    solver.inner_radius_m = between(2000.0, 10000.0);
    scene.atmosphere.layers = between(1, 12);
  } else if (scene.atmosphere.layers > 60) {
    solver.azimuth_divisions = 2 * between(2, large ? 8 : 3);
    solver.active_shell_stride = between(4, 8);
  }
  solver.scattering_orders = between(1, 10);
  solver.active_shell_weighting = one_of({"quadrature", "rescale"});
  solver.air_phase = one_of({"rayleigh", "isotropic"});
  solver.aerosol_phase = one_of({"truncated", "similarity"});
  solver.cell_optics = one_of({"mean", "centre"});
  solver.cell_height_km = one_in(3) ? 0.0 : between(large ? 2.0 : 8.0, 60.0);
  solver.gather = one_of({"exact-single", "cells"});
}

void draw_disc_and_phase(Scene& scene, SceneSize size) {
  scene.sun.disc_average = !one_in(3);
  // Scattering matrices take far longer to make than the rest.
  const bool mie = size == SceneSize::kLarge ? one_in(2) : one_in(8);
  if (scene.aerosols.type != "none" && !mie) scene.aerosols.phase = "henyey-greenstein";
}

void draw_orders(Scene& scene, SceneSize size) {
  SolverOptions& solver = scene.solver;
  const bool large = size == SceneSize::kLarge;
  solver.zenith_step_deg = large ? between(1.0, 3.0) : 3.0;
  solver.altitude_levels = between(4, large ? 40 : 8);
  solver.polar_directions = 2 * between(4, large ? 16 : 5);
  solver.azimuth_directions = 2 * between(2, large ? 8 : 3);
  solver.phase_degree = between(2, large ? 24 : 6);
  solver.order_tolerance = std::pow(10.0, between(large ? -4.0 : -2.0, -1.0));
  if (one_in(3)) solver.scattering_orders = between(1, 10);
  solver.polarisation = !one_in(3);
  solver.single_precision = !one_in(4);
  draw_disc_and_phase(scene, size);
}

void draw_monte_carlo(Scene& scene, SceneSize size) {
  SolverOptions& solver = scene.solver;
  solver.photons = size == SceneSize::kLarge ? 20000 : 100;
  if (size == SceneSize::kSmall) solver.target_relative_error = 1;
  solver.seed = between(0, 1000000);
  if (one_in(3)) solver.scattering_orders = between(1, 10);
  solver.polarisation = !one_in(3);
  draw_disc_and_phase(scene, size);
}

}  // namespace

Scene random_scene(const std::string& method, SceneSize size) {
  Scene scene;
  scene.solver.method = method;
  scene.solver.threads = 1;
  draw_sun_and_earth(scene);
  draw_air(scene, size);
  draw_aerosols(scene);
  draw_wavelengths(scene, size == SceneSize::kLarge ? 16 : one_in(4) ? 2 : 1);
  scene.solver.ground_light = !one_in(4);
  if (method == "cells") draw_cells(scene, size);
  if (method == "orders") draw_orders(scene, size);
  if (method == "monte-carlo") draw_monte_carlo(scene, size);
  double& height_m = scene.observer.height_m;
  const double top_m = 1e3 * scene.atmosphere.top_km;
  if (one_in(3)) height_m = between(0.0, std::min(1e4, 0.99 * top_m));
  if (one_in(8)) height_m = between(-500.0, 0.0);
  if (one_in(8)) height_m = method == "cells" ? between(0.0, 0.999 * top_m) : between(0.0, 1e6);
  return scene;
}

std::string describe(const Scene& scene) {
  std::map<std::string, std::string> usual;
  for (const auto& [key, value] : scene_settings(Scene{})) usual[key] = value;
  std::string text;
  for (const auto& [key, value] : scene_settings(scene)) {
    const auto it = usual.find(key);
    if (it == usual.end() || it->second != value) text += key + " = " + value + "\n";
  }
  return text;
}

}  // namespace twilight
