#include "random_scene.h"

#include <rapidcheck.h>

#include <algorithm>
#include <map>
#include <vector>

#include "sim/scene_file.h"

namespace twilight {
namespace {

// Uniform whatever RapidCheck's size is: small sizes are no simpler scenes here.
int between(int lowest, int highest) {
  return *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(lowest, highest + 1));
}

double between(double lowest, double highest) {
  constexpr int kSteps = 1 << 20;
  return lowest + (highest - lowest) * between(0, kSteps) / kSteps;
}

bool one_in(int n) { return between(1, n) == 1; }

std::string one_of(const std::vector<std::string>& words) {
  return words[static_cast<std::size_t>(between(0, static_cast<int>(words.size()) - 1))];
}

}  // namespace

Scene random_scene() {
  Scene scene;
  // Ends and middle of the range are where geometry degenerates.
  scene.sun.elevation_deg = one_in(8) ? 9.0 * between(-2, 10) : between(-18.0, 90.0);
  scene.sun.spectrum = one_of({"gueymard2004", "unit"});
  scene.earth.ground_albedo = one_in(4) ? between(0, 1) : between(0.0, 1.0);
  if (one_in(10)) scene.earth.radius_km = between(1000.0, 70000.0);

  AtmosphereOptions& air = scene.atmosphere;
  air.profile = one_of({"us_standard", "tropical", "midlatitude_summer", "midlatitude_winter",
                        "subarctic_summer", "subarctic_winter", "exponential"});
  air.top_km = one_in(6) ? between(1.0, 15.0) : between(15.0, 120.0);
  air.layers = one_in(12) ? 500 : between(1, 60);
  air.layer_spacing = one_of({"graded", "equal-air-mass", "even"});
  air.layer_optics = one_of({"mean", "centre"});
  if (one_in(3)) air.ozone_du = one_in(3) ? 0.0 : between(0.0, 1000.0);
  air.ozone = one_of({"layered", "vertical"});
  air.refraction = !one_in(3);
  air.refractive_index = one_of({"ciddor", "haber2005"});
  if (one_in(4)) air.depolarisation = between(0.0, 0.85);

  scene.aerosols.type = one_of({"none", "continental_clean", "continental_average",
                                "continental_polluted", "urban", "desert", "maritime_clean",
                                "maritime_polluted", "maritime_tropical", "arctic", "antarctic"});
  scene.aerosols.relative_humidity_percent = one_in(4) ? 95.0 : between(0.0, 99.0);
  if (scene.aerosols.type != "none" && one_in(6)) {
    scene.aerosols.optical_depth_550nm = between(0.0, 10.0);
  }

  const int wavelengths = between(1, 16);
  scene.spectrum.wavelengths_nm.clear();
  double nm = between(280.0, 700.0);
  for (int i = 0; i < wavelengths; ++i) {
    scene.spectrum.wavelengths_nm.push_back(nm);
    nm += between(0.5, 300.0 / wavelengths);
  }

  SolverOptions& solver = scene.solver;
  solver.azimuth_divisions = 2 * between(4, 18);
  solver.active_shell_stride = between(1, 8);
  solver.inner_radius_m = one_in(6) ? between(10.0, 300.0) : between(500.0, 10000.0);
  if (one_in(15)) {
    solver.azimuth_divisions = 2 * between(20, 90);
    solver.active_shell_stride = 32;
    solver.inner_radius_m = between(2000.0, 10000.0);
    air.layers = between(1, 12);
  } else if (air.layers > 60) {
    solver.azimuth_divisions = 2 * between(4, 8);
    solver.active_shell_stride = between(4, 8);
  }
  solver.scattering_orders = between(1, 10);
  solver.active_shell_weighting = one_of({"quadrature", "rescale"});
  solver.air_phase = one_of({"rayleigh", "isotropic"});
  solver.aerosol_phase = one_of({"truncated", "similarity"});
  solver.ground_light = !one_in(3);
  solver.cell_optics = one_of({"mean", "centre"});
  solver.cell_height_km = one_in(3) ? 0.0 : between(2.0, 30.0);
  solver.gather = one_of({"exact-single", "cells"});
  solver.threads = between(1, 2);

  // Among the lowest 10 km, and below the top.
  if (!one_in(3)) scene.observer.height_m = between(0.0, std::min(10.0, 0.99 * air.top_km)) * 1e3;
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
