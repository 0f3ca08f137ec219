// The daylight model of Preetham, Shirley & Smits (1999): solver.method "preetham".
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "sim/models/daylight_spectrum.h"
#include "sim/models/model_sky.h"
#include "sim/models/perez.h"
#include "sim/models/preetham_aerial_perspective.h"

namespace twilight {

/// Where the sky's fit is defined: their simulation ran for turbidities 2..6. (Below about 1.66 the
/// luminance's form passes through 0 at the zenith.)
inline constexpr double kPreethamLowestTurbidity = 2.0, kPreethamHighestTurbidity = 6.0;

/// Coefficients of the Perez form (Eq. 3) for luminance and chromaticity, linear in turbidity
/// (A.2).
struct PreethamDistribution {
  PerezCoefficients luminance, x, y;
};
PreethamDistribution preetham_distribution(double turbidity);

/// The sky's zenith (A.2): luminance, cd/m^2, and CIE 1931 chromaticity of a turbidity and the
/// Sun's zenith angle, rad, 0..pi/2.
struct PreethamZenith {
  double luminance_cd_m2 = 0.0, x = 0.0, y = 0.0;
};
PreethamZenith preetham_zenith(double turbidity, double sun_zenith_angle_rad);

/// The turbidity that the scene's method takes: preetham.turbidity or the scene's own, within
/// 2..6 as within_model_range() has it, with what it is in `summary`.
double model_turbidity(const SceneModel& model, RunSummary& summary);

/// The elevation, rad, of the model's Sun, within 0..90 degrees as within_model_range() has it.
double daytime_elevation_rad(const SceneModel& model, RunSummary& summary);

/// Transmittance of the direct beam per wavelength (A.1) for the Sun at an elevation, rad, 0..pi/2.
std::vector<double> clear_sun_transmittance(const SceneModel& model, double turbidity,
                                            double sun_elevation_rad);

/// The sky: luminance and chromaticity of each direction (Eq. 3, 4), made spectra by the daylight
/// basis (A.5); the Sun through their clear air (A.1) with the scene's solar spectrum. The fit's
/// luminance is absolute: the solar spectrum does not enter the sky. Wavelengths beyond 380..780 nm
/// take the end's basis, which `summary` says. Throws std::invalid_argument outside a Sun of 0..90
/// degrees, turbidity 2..6 and the ground, unless models.out_of_range is "clamp".
class PreethamSky final : public HemisphereSky {
 public:
  explicit PreethamSky(const SceneModel& model);
  std::vector<double> sun_transmittance() const override;
  /// PreethamAerialPerspective over their flat ground, from its surface.
  std::optional<AerialLight> aerial_light(const ViewDirection& view,
                                          double distance_km) const override;

 protected:
  void spectrum(const ViewDirection& view, std::span<double> out) const override;

 private:
  bool spectrum_clipped(const ViewDirection& view, std::span<double> out) const;
  void record();

  double turbidity_ = 0.0;
  PreethamDistribution form_;
  PreethamZenith zenith_;    // as published
  PreethamZenith per_form_;  // over F(0, Sun's zenith angle)
  DaylightSpectrum daylight_;
  mutable std::once_flag air_made_;
  mutable std::unique_ptr<const PreethamAerialPerspective> air_;
};

}  // namespace twilight
