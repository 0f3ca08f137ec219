#include "random_layers.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <vector>

namespace twilight {
namespace {

constexpr double kMostPerKm = 1000;  // as read_optical_layers

double log_between(double lowest, double highest) {
  return lowest * std::pow(highest / lowest, between(0.0, 1.0));
}

// Parts of 1, of sizes up to 1e4 times each other and, where allowed, none.
std::vector<double> parts(std::size_t n, bool with_none) {
  std::vector<double> part(n);
  double sum = 0;
  for (double& p : part) sum += p = with_none && one_in(4) ? 0 : log_between(1e-4, 1);
  if (sum > 0) {
    for (double& p : part) p /= sum;
  }
  return part;
}

// A constituent's coefficient in every layer from a vertical optical depth 0..100.
void draw_constituent(const Medium& m, std::size_t w, LayerTable& per_km) {
  const double depth = one_in(4) ? 0.0 : one_in(10) ? 100.0 : log_between(1e-3, 100);
  const std::vector<double> part = parts(m.layers(), true);
  for (std::size_t i = 0; i < m.layers(); ++i) {
    per_km(i, w) =
        std::min(kMostPerKm, depth * part[i] / (m.boundary_km[i + 1] - m.boundary_km[i]));
  }
}

double random_asymmetry() {
  return one_in(6) ? 0.0 : one_in(6) ? 0.99 : one_in(10) ? -0.95 : between(-0.95, 0.99);
}

Medium random_layers(const Scene& scene, SceneSize size) {
  Medium m;
  // Where layers are many the grid is small, and the other way round.
  const bool fixed = scene.atmosphere.layers > 60 ||
                     (scene.solver.method == "cells" && scene.solver.azimuth_divisions > 48);
  const int layers = fixed                       ? scene.atmosphere.layers
                     : one_in(4)                 ? between(1, 3)
                     : size == SceneSize::kLarge ? between(1, 100)
                                                 : between(1, 12);
  const double top_km = one_in(6) ? log_between(0.1, 500) : between(15.0, 120.0);
  m.earth_radius_km = scene.earth.radius_km.value_or(6371.0);
  m.wavelength_nm = scene.spectrum.wavelengths_nm;
  m.boundary_km = {0};
  const bool even = one_in(3);
  for (const double part : parts(static_cast<std::size_t>(layers), false)) {
    m.boundary_km.push_back(m.boundary_km.back() + top_km * (even ? 1.0 / layers : part));
  }
  m.zero_tables();
  m.depolarisation.assign(m.wavelengths(), scene.atmosphere.depolarisation.value_or(0.0));
  for (std::size_t w = 0; w < m.wavelengths(); ++w) {
    draw_constituent(m, w, m.air_scattering_per_km);
    draw_constituent(m, w, m.aerosol_scattering_per_km);
    draw_constituent(m, w, m.gas_absorption_per_km);
    for (std::size_t i = 0; i < m.layers(); ++i) m.aerosol_asymmetry(i, w) = random_asymmetry();
  }
  return m;
}

}  // namespace

SceneModel build_scene_model(const DrawnScene& drawn) {
  if (!drawn.layers) return build_scene_model(drawn.scene);
  // A file's layers are looked at with the scene; here its Sun and its ground alone.
  Scene scene = drawn.scene;
  scene.observer.height_m = 0;
  scene.atmosphere = {};
  scene.atmosphere.profile = "exponential";
  scene.atmosphere.layers = 1;
  scene.aerosols = {};
  scene.aerosols.type = "none";
  SceneModel model = build_scene_model(scene);
  model.scene = drawn.scene;
  model.scene.atmosphere.optical_layers = "(in memory)";
  model.medium = *drawn.layers;
  model.medium.earth_radius_km = drawn.scene.earth.radius_km.value_or(model.medium.earth_radius_km);
  return model;
}

DrawnScene random_scene_or_layers(const std::string& method, SceneSize size) {
  DrawnScene drawn = random_scene(method, size);
  if (!one_in(4)) return drawn;
  Scene& scene = drawn.scene;
  drawn.layers = random_layers(scene, size);
  scene.aerosols.type = "none";
  scene.aerosols.optical_depth_550nm.reset();
  scene.aerosols.phase.reset();
  scene.atmosphere.layers = static_cast<int>(drawn.layers->layers());
  double& height_m = scene.observer.height_m;
  height_m = std::max(0.0, height_m);
  const double highest_km = std::min(199.0, 0.999 * drawn.layers->top_km());
  if (method == "cells") height_m = std::min(height_m, 1e3 * highest_km);
  return drawn;
}

std::string describe(const DrawnScene& drawn) {
  if (!drawn.layers) return describe(drawn.scene);
  std::ostringstream out;
  out.precision(9);
  out << describe(drawn.scene);
  const Medium& m = *drawn.layers;
  for (std::size_t w = 0; w < m.wavelengths(); ++w) {
    for (std::size_t i = 0; i < m.layers(); ++i) {
      out << m.boundary_km[i] << ',' << m.boundary_km[i + 1] << ',' << m.wavelength_nm[w] << ','
          << m.air_scattering_per_km(i, w) << ',' << m.aerosol_scattering_per_km(i, w) << ','
          << m.aerosol_asymmetry(i, w) << ',' << m.gas_absorption_per_km(i, w) << '\n';
    }
  }
  return out.str();
}

}  // namespace twilight
