// From a sampled sky spectrum to XYZ and to linear Rec. 709.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "output/colour_matching.h"

namespace twilight {

/// Luminous efficacy of the photometric units (SI), lm/W at 540 THz.
inline constexpr double kLuminousEfficacy_lm_w = 683.0;

/// Integrates a sky spectrum, known at a few wavelengths, against a CIE observer.
///
/// The sky's L/E0 (radiance over solar irradiance above the air) is smooth; E0
/// carries the Fraunhofer lines. So
///   XYZ = sum_i w_i L_i/E0_i,
///   w_i = sum over 360..830 nm in 1 nm steps of E0(lambda) cmf(lambda) b_i(lambda),
/// where b_i(lambda) = hat_i(lambda) (lambda_i/lambda)^4: (L/E0) lambda^4 is taken
/// piecewise linear between the samples and constant beyond the first and the
/// last, which is exact for a pure Rayleigh sky (lambda^-4) whatever the samples.
/// (Conversion to XYZ: the paper's Sec. 3 "Sky Texture" and Sec. 4.7.)
///
/// Error bound: for a lambda^-4 sky seen through 10 air masses of Rayleigh
/// extinction, 8 wavelengths 380..720 nm give every component within 4 % and xy
/// within 0.005; 16 (380..780 nm) 1.2 % and 0.002; 81 0.1 %. The error falls with
/// the square of the step (ColourIntegrator.EightSixteenAndEightyOneConverge).
class ColourIntegrator {
 public:
  /// wavelength_nm: strictly increasing, finite, > 0, at least one.
  /// solar_irradiance_w_m2_nm: E0 at a wavelength in nm, W m^-2 nm^-1, finite and
  /// >= 0 over 360..830 nm; called there once per nm, only during construction. It
  /// must be of the same Earth-Sun distance as the samples given to xyz().
  /// Throws std::invalid_argument otherwise.
  ColourIntegrator(std::span<const double> wavelength_nm,
                   const std::function<double(double)>& solar_irradiance_w_m2_nm,
                   ColourObserver observer);

  ColourObserver observer() const { return observer_; }

  /// w_i of X, Y, Z, one row per wavelength, W m^-2; all >= 0.
  std::span<const Tristimulus> weights() const { return weights_; }

  /// X, Y, Z of a radiance (W m^-2 sr^-1 nm^-1) or irradiance (W m^-2 nm^-1) and
  /// the solar irradiance (W m^-2 nm^-1, > 0) at this integrator's wavelengths.
  /// Result in W m^-2 sr^-1 (or W m^-2): not yet multiplied by 683 lm/W.
  /// Throws std::invalid_argument if a size differs or an irradiance is not > 0.
  Tristimulus xyz(std::span<const double> radiance, std::span<const double> solar_irradiance) const;

 private:
  ColourObserver observer_;
  std::vector<Tristimulus> weights_;
};

using LinearRgb = std::array<double, 3>;
using ColourMatrix = std::array<std::array<double, 3>, 3>;  ///< [row][column]

/// CIE xy chromaticities of the Rec. 709 primaries and of its D65 white
/// (ITU-R BT.709-6, item 1.3 and 1.4).
struct Rec709 {
  static constexpr std::array<double, 2> kRed = {0.640, 0.330};
  static constexpr std::array<double, 2> kGreen = {0.300, 0.600};
  static constexpr std::array<double, 2> kBlue = {0.150, 0.060};
  static constexpr std::array<double, 2> kWhite = {0.3127, 0.3290};
};

/// Matrix RGB -> XYZ whose white (1,1,1) has Y = 1, solved from the primaries and
/// the white. The same matrix serves both observers, as in the paper.
const ColourMatrix& xyz_from_rec709();
/// Its inverse, XYZ -> RGB.
const ColourMatrix& rec709_from_xyz();

/// Linear Rec. 709 of X, Y, Z; components are negative outside the gamut. White
/// of Y = 1 is (1,1,1), so that (1,1,1) stands for 683 cd/m^2.
LinearRgb linear_rec709(const Tristimulus& xyz);

/// Y (relative luminance) of a linear Rec. 709 colour.
double rec709_luminance(const LinearRgb& rgb);

struct GamutMapped {
  LinearRgb rgb;  ///< all components >= 0
  bool moved;     ///< whether the colour was outside the gamut
};

/// Moves a colour with a negative component towards the D65 grey of the same Y
/// until its smallest component is 0; Y and the direction from the neutral
/// axis stay. Y <= 0 gives black. Throws std::invalid_argument if not finite.
GamutMapped into_gamut(const LinearRgb& rgb);

/// CIE xy chromaticity of X, Y, Z; throws std::invalid_argument unless X+Y+Z > 0.
std::array<double, 2> chromaticity(const Tristimulus& xyz);

}  // namespace twilight
