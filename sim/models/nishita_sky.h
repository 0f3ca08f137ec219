// solver.method = "nishita": single scattering along straight rays.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim/models/model_sky.h"
#include "sim/models/single_scattering_path.h"

namespace twilight {

/// The sky of Nishita et al. (1993) as the Scratchapixel lesson "Simulating the Colors of the Sky"
/// has it, from any height up to orbit and under any Sun: sunlight scattered once. Rays that end on
/// the ground show it as a Lambertian reflector lit by the attenuated Sun alone (this model has no
/// sky light there), behind the air's own light; the lesson leaves it black, which an albedo of 0
/// gives. No refraction, no multiple scattering: in civil twilight a fraction of the true sky.
class NishitaSky final : public ModelSky {
 public:
  explicit NishitaSky(const SceneModel& model);

  std::vector<double> sun_transmittance() const override;
  /// What the air does to a ray of a length (km) from a height (km) into a direction, where the Sun
  /// stands at the scene's elevation; in-scattered radiance in W m^-2 sr^-1 nm^-1. Throws
  /// std::invalid_argument unless start_height_km and length_km are >= 0 (the length may be
  /// infinite).
  SingleScatteredRay aerial_perspective(double start_height_km, const ViewDirection& direction,
                                        double length_km) const;
  /// The same from the observer.
  std::optional<AerialLight> aerial_light(const ViewDirection& view,
                                          double distance_km) const override;

 protected:
  void spectrum(const ViewDirection& view, std::span<double> out) const override;

 private:
  std::unique_ptr<const SingleScatteringAir> air_;
  SingleScattering scattering_;
  double height_km_;
};

}  // namespace twilight
