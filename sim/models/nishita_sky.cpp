#include "sim/models/nishita_sky.h"

#include <fmt/format.h>

#include <limits>
#include <numbers>
#include <stdexcept>

namespace twilight {

NishitaSky::NishitaSky(const SceneModel& model)
    : ModelSky(model),
      air_(single_scattering_air(model_)),
      scattering_(*air_, model_.scene.nishita, model_.solar_irradiance),
      height_km_(observer_altitude_km(model_.scene)) {
  const NishitaOptions& options = model_.scene.nishita;
  summary_.figures.emplace_back(
      "air", model_.two_constituent_air ? "two exponential constituents" : "the scene's layers");
  summary_.figures.emplace_back(
      "samples", options.converged ? std::string("until converged")
                                   : fmt::format("{} along the view, {} towards the Sun",
                                                 options.view_samples, options.light_samples));
}

std::vector<double> NishitaSky::sun_transmittance() const {
  return scattering_.sun_transmittance(height_km_, model_.sun_elevation_rad);
}

SingleScatteredRay NishitaSky::aerial_perspective(double start_height_km,
                                                  const ViewDirection& direction,
                                                  double length_km) const {
  if (!(start_height_km >= 0.0 && start_height_km < 1e9)) {
    throw std::invalid_argument(
        fmt::format("start_height_km is {}; it must be in 0..1e9", start_height_km));
  }
  if (!(length_km >= 0.0)) {
    throw std::invalid_argument(fmt::format("length_km is {}; it must be >= 0", length_km));
  }
  return scattering_.along({start_height_km, direction.elevation_rad,
                            direction.relative_azimuth_rad, length_km, model_.sun_elevation_rad});
}

std::optional<AerialLight> NishitaSky::aerial_light(const ViewDirection& view,
                                                    double distance_km) const {
  return aerial_perspective(height_km_, view, distance_km);
}

void NishitaSky::spectrum(const ViewDirection& view, std::span<double> out) const {
  const SingleScatteredRay seen =
      scattering_.along({height_km_, view.elevation_rad, view.relative_azimuth_rad,
                         std::numeric_limits<double>::infinity(), model_.sun_elevation_rad});
  for (std::size_t w = 0; w < out.size(); ++w) {
    out[w] = seen.inscattered[w] + seen.transmittance[w] * model_.ground_albedo[w] /
                                       std::numbers::pi * seen.ground_irradiance[w] *
                                       model_.solar_irradiance[w];
  }
}

}  // namespace twilight
