// solver.method = "hoffman-preetham".
#pragma once

#include <span>
#include <vector>

#include "sim/models/hoffman_preetham.h"
#include "sim/models/model_sky.h"

namespace twilight {

/// The sky of Hoffman & Preetham (2002), for observers on the ground and a Sun above the horizon:
/// in-scattering in air and haze of constant density, lit everywhere by the sunlight that reaches
/// the ground. Between (and beyond) their three wavelengths haze scatters as a power law; air by
/// their formula. Molecules and haze are the model's own, whatever the scene's air.
class HoffmanPreethamSky final : public HemisphereSky {
 public:
  /// Throws std::invalid_argument (or clamps, see within_model_range) for an observer above the
  /// ground and a Sun below the horizon.
  explicit HoffmanPreethamSky(const SceneModel& model);

  /// Eq. 5: extinction along the optical lengths of air and haze.
  std::vector<double> sun_transmittance() const override;

  /// Eqs. 3 and 4, near the ground, where the density is constant. Throws std::invalid_argument
  /// unless distance_km >= 0 (infinity allowed).
  std::optional<AerialLight> aerial_light(const ViewDirection& view,
                                          double distance_km) const override;

 protected:
  void spectrum(const ViewDirection& view, std::span<double> out) const override;

 private:
  TwoShellOptics optics(const ViewDirection& view, std::size_t wavelength) const;

  std::vector<double> air_per_km_, haze_per_km_;  // scattering
  double haze_absorption_per_km_, asymmetry_;
  bool printed_;
  std::vector<double> sun_irradiance_;  // at the ground, across the rays: E_sun
};

}  // namespace twilight
