// Small models for the "orders" solver.
#pragma once

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "sim/orders_sky.h"
#include "small_scene.h"

namespace twilight {

/// A medium of our own under a point Sun above a black ground, on a coarse grid.
inline SceneModel orders_model(const Medium& medium, double sun_elevation_deg, double albedo = 0,
                               double height_km = 0) {
  SceneModel model;
  model.medium = medium;
  model.sun_elevation_rad = sun_elevation_deg * std::numbers::pi / 180;
  model.ground_albedo.assign(medium.wavelengths(), albedo);
  model.solar_irradiance.assign(medium.wavelengths(), 1.0);
  Scene& scene = model.scene;
  scene.sun.elevation_deg = sun_elevation_deg;
  scene.sun.disc_average = false;
  scene.observer.height_m = 1e3 * height_km;
  scene.earth.ground_albedo = albedo;
  scene.spectrum.wavelengths_nm = medium.wavelength_nm;
  scene.solver.method = "orders";
  scene.solver.altitude_levels = 16;
  scene.solver.zenith_step_deg = 2;
  scene.solver.polar_directions = 12;
  scene.solver.azimuth_directions = 8;
  scene.solver.threads = 2;
  return model;
}

/// Rayleigh air exp(-z / 8 km) of a vertical optical depth, in even layers to 60 km.
inline Medium exponential_air(double optical_depth, int layers = 30, double top_km = 60,
                              std::size_t wavelengths = 1) {
  std::vector<double> per_km;
  const double step = top_km / layers;
  for (int i = 0; i < layers; ++i) {
    per_km.push_back(optical_depth / step *
                     (std::exp(-i * step / 8) - std::exp(-(i + 1) * step / 8)));
  }
  return layered_air(top_km, per_km, 0, wavelengths);
}

inline ViewDirection view_deg(double elevation, double azimuth) {
  return {elevation * std::numbers::pi / 180, azimuth * std::numbers::pi / 180};
}

}  // namespace twilight
