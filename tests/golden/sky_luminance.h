// Skies of the default scene in photometric units, for comparison with what people measured.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sim/scene_model.h"
#include "sim/sky.h"

namespace twilight {

/// A solved sky and the model it came from.
struct DefaultSky {
  SceneModel model;
  std::unique_ptr<Sky> sky;

  double zenith_luminance_cd_m2() const;
  double global_illuminance_lux() const;
};

/// The default scene with the Sun's centre at a geometric elevation, deg, and an OPAC type of air.
DefaultSky solve_default_sky(double sun_elevation_deg, const std::string& aerosol_type);

}  // namespace twilight
