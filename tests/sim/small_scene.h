// Scenes small enough to be solved in a fraction of a second.
#pragma once

#include <vector>

#include "sim/scene_model.h"

namespace twilight {

/// The defaults on a coarse grid: S = 30, 24 layers up to 60 km, three wavelengths, clean air.
inline Scene small_scene(double sun_elevation_deg) {
  Scene scene;
  scene.sun.elevation_deg = sun_elevation_deg;
  scene.sun.spectrum = "unit";
  scene.atmosphere.layers = 24;
  scene.atmosphere.top_km = 60;
  scene.aerosols.type = "none";
  scene.spectrum.wavelengths_nm = {450, 550, 700};
  scene.solver.azimuth_divisions = 30;
  scene.solver.inner_radius_m = 2000;
  scene.solver.active_shell_stride = 2;
  scene.solver.scattering_orders = 6;
  scene.solver.threads = 1;
  return scene;
}

/// Layers of one extinction each, straight rays: what geometry alone can check.
inline Medium layered_air(double top_km, const std::vector<double>& scattering_per_km,
                          double absorption_per_km = 0, std::size_t wavelengths = 1) {
  Medium m;
  const std::size_t n = scattering_per_km.size();
  for (std::size_t w = 0; w < wavelengths; ++w) {
    m.wavelength_nm.push_back(400 + 10.0 * static_cast<double>(w));
  }
  for (std::size_t i = 0; i <= n; ++i) {
    m.boundary_km.push_back(top_km * static_cast<double>(i) / static_cast<double>(n));
  }
  m.air_scattering_per_km = LayerTable(n, wavelengths);
  m.aerosol_scattering_per_km = LayerTable(n, wavelengths);
  m.aerosol_absorption_per_km = LayerTable(n, wavelengths);
  m.aerosol_asymmetry = LayerTable(n, wavelengths);
  m.gas_absorption_per_km = LayerTable(n, wavelengths, absorption_per_km);
  m.refractivity = LayerTable(n, wavelengths);
  m.depolarisation.assign(wavelengths, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t w = 0; w < wavelengths; ++w) {
      m.air_scattering_per_km(i, w) = scattering_per_km[i] / static_cast<double>(w + 1);
    }
  }
  return m;
}

}  // namespace twilight
