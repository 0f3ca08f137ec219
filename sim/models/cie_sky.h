// The CIE's clear and overcast skies: solver.method "cie-clear" and "cie-overcast".
#pragma once

#include <vector>

#include "sim/models/model_sky.h"

namespace twilight {

/// Luminance over that of the zenith of the CIE clear sky (Kittler 1967; CIE 1973; Eq. 1 of
/// Preetham et al. 1999): dimensionless. cos_zenith of the view, 0..1 (0: the limit, the horizon);
/// angles in rad.
double cie_clear_luminance(double cos_zenith, double sun_angle_rad, double sun_zenith_angle_rad);

/// The same of the CIE overcast sky (Moon & Spencer 1942; CIE 1955; Eq. 2): (1 + 2 cos theta) / 3.
double cie_overcast_luminance(double cos_zenith);

/// Zenith luminance of the overcast sky, cd/m^2: 123 + 8600 sin of the Sun's elevation (rad, 0..
/// pi/2), Krochmann & Seidl (1974): the CIE overcast sky of their horizontal illuminance 300 +
/// 21000 sin, lux, within 0.3 %.
double overcast_zenith_luminance_cd_m2(double sun_elevation_rad);

/// The CIE's skies. They are of luminance alone; one relative spectrum serves all directions:
/// daylight of Preetham's zenith chromaticity for the clear sky (as their Fig. 8 does), the same
/// radiance at every wavelength for the overcast one (their Sec. 5). Zenith luminance:
/// cie.zenith_luminance_cd_m2, else Preetham's Y_z, or overcast_zenith_luminance_cd_m2. The clear
/// sky's Sun shines as Preetham's; the overcast sky hides it. Throws std::invalid_argument outside
/// a Sun of 0..90 degrees, for the clear sky a turbidity of 2..6, and the ground, unless
/// models.out_of_range is "clamp".
class CieSky final : public HemisphereSky {
 public:
  explicit CieSky(const SceneModel& model);
  std::vector<double> sun_transmittance() const override { return sun_transmittance_; }

 protected:
  void spectrum(const ViewDirection& view, std::span<double> out) const override;

 private:
  bool clear_;
  std::vector<double> zenith_, sun_transmittance_;  // per wavelength
};

}  // namespace twilight
