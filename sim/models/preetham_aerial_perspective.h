// Aerial perspective after Preetham, Shirley & Smits (1999), Sec. 4 and A.4.
#pragma once

#include <vector>

#include "sim/models/preetham_scattering.h"
#include "sim/sky.h"

namespace twilight {

/// A straight path over a flat Earth: from the viewer, at `height_km` >= 0, towards `elevation_rad`
/// (-pi/2..pi/2) over `length_km` >= 0. It must not end below the ground.
struct AerialPath {
  double height_km = 0.0, elevation_rad = 0.0, length_km = 0.0;
};

/// Scattering coefficients at the ground at one wavelength. Density falls with height as
/// exp(-0.8333 h/km) for haze and exp(-0.1136 h/km) for molecules (A.4).
struct AerialAir {
  double haze_per_km = 0.0, molecules_per_km = 0.0;
};
inline constexpr double kHazeDecay_per_km = 0.8333, kMoleculesDecay_per_km = 0.1136;

/// Eq. 7: the share of a distant object's light that arrives, exp(-(beta H (1 - e^(-alpha s cos
/// theta)) / (alpha cos theta)) for both), exact for this air. Theirs, K = beta / (alpha cos
/// theta): the printed K has the other sign, with which light would grow. Throws
/// std::invalid_argument for a bad path.
double aerial_transmittance(const AerialPath& path, const AerialAir& air);

/// I1 (haze) and I2 (molecules) of Eq. 8, km: the integrals along the path of u(x), the density
/// over that at the ground, times the transmittance from 0 to x.
struct AerialIntegrals {
  double haze_km = 0.0, molecules_km = 0.0;
};

/// Eq. 10: for |s cos theta| << 1 km, density and depth taken as those of a level path but for
/// u = H e^(-alpha x cos theta); exact where cos theta = 0. (The factor before the fraction is
/// H1 = e^(-alpha1 h0), illegible in the text.)
AerialIntegrals aerial_integrals_level(const AerialPath& path, const AerialAir& air);

/// Eq. 11 with the cubic of A.4: the other constituent's transmittance f as a Hermite cubic g of
/// v = u(x) between both ends, times e^(-K (H - v)), by parts. Evaluated by the moments of e^(-tau
/// t) over the path's share t of the constituent's own column, which A.4's brackets become without
/// their cancellation (tested against them). f' is by v (A.4). Limits are those of eq. 11: the
/// text's bracket from H1 to u1(s).
/// One cubic bends badly where the other's depth is above 1 or the path climbs several
/// scale heights of haze (f' of the haze's integral grows as e^(0.72 h/km)): it may even turn
/// negative. sim/models/README.md has the errors.
AerialIntegrals aerial_integrals_hermite(const AerialPath& path, const AerialAir& air);

/// What inscattered() uses: Eq. 10 where alpha1 |s cos theta| < 1e-3, else the Hermite form over
/// pieces of the path short enough for it (a quarter of a scale height of haze, an optical depth of
/// 0.4): within 3e-4 of the numerical integral, >= 0.
AerialIntegrals aerial_integrals(const AerialPath& path, const AerialAir& air);

/// The same integrals by composite Gauss-Legendre quadrature to 1e-10, the judge of the others.
AerialIntegrals aerial_integrals_numeric(const AerialPath& path, const AerialAir& air);

/// S0 of Eq. 8: sun and sky light scattered into a direction at the ground by each constituent,
/// W m^-2 sr^-1 nm^-1 km^-1, per wavelength.
struct AerialSource {
  std::vector<double> haze, molecules;
};

/// Aerial perspective under a sky: their Eq. 8 with the light of any Sky (PreethamSky for theirs),
/// taken to be the same at every height.
class PreethamAerialPerspective {
 public:
  /// Looks at the sky's upper hemisphere and Sun once. turbidity >= 1.
  PreethamAerialPerspective(const Sky& sky, double turbidity);

  /// Transmittance of the path per wavelength (Eq. 7).
  std::vector<double> transmittance(const AerialPath& path) const;
  /// Light scattered towards the viewer from a direction, at the ground. The sky by quadrature (24
  /// elevations x 32 azimuths), the Sun as a point.
  AerialSource source(const ViewDirection& direction) const;
  /// L_in of Eq. 8, W m^-2 sr^-1 nm^-1 per wavelength, along a path in the azimuth
  /// `relative_azimuth_rad` from the Sun's.
  std::vector<double> inscattered(const AerialPath& path, double relative_azimuth_rad) const;
  /// The same with a source() computed before, for the path's direction.
  std::vector<double> inscattered(const AerialPath& path, const AerialSource& source) const;

 private:
  struct Light {
    ViewDirection from;
    std::vector<double> irradiance;  // on a surface facing it, W m^-2 nm^-1
  };
  std::vector<PreethamScattering> air_;  // per wavelength
  std::vector<Light> lights_;
};

}  // namespace twilight
