// Turbidity: how much haze there is for the molecules.
#pragma once

#include "sim/scene.h"

namespace twilight {

/// Vertical optical depths at 550 nm from the scene's ground to the top of its air.
struct TurbidityDepths {
  double molecules = 0.0;  ///< Rayleigh scattering
  double haze = 0.0;       ///< aerosols' scattering and absorption
};

/// Of the scene's atmosphere and aerosols, as the methods that solve the transfer of light take
/// them; gases that absorb do not count. A file of optical layers without 550 nm is interpolated
/// (logarithms of depth and wavelength). Throws std::invalid_argument where such a file's scene
/// does not enclose 550 nm, and as build_scene_model.
TurbidityDepths turbidity_depths(const Scene& scene);

/// T = (tau_m + tau_h) / tau_m at 550 nm, >= 1 (Preetham et al. 1999, Sec. 2.1, after McCartney
/// 1976). The haze counts with its extinction (their haze does not absorb; Angstrom's formula,
/// which their T enters, is of extinction). Throws std::invalid_argument, besides, where the air
/// has no molecules.
double scene_turbidity(const Scene& scene);

}  // namespace twilight
