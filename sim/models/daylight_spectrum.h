// Spectra of daylight from luminance and chromaticity.
#pragma once

#include <span>
#include <vector>

namespace twilight {

/// M1 and M2 of S = S0 + M1 S1 + M2 S2 (Preetham et al. 1999, A.5, after Wyszecki & Stiles):
/// dimensionless.
struct DaylightWeights {
  double m1 = 0.0, m2 = 0.0;
};

/// Of a CIE 1931 chromaticity x, y. Throws std::invalid_argument where the denominator
/// 0.0241 + 0.2562 x - 0.7341 y is not negative: beyond the line where no such spectrum exists
/// (daylight, x = 0.25..0.5, has about -0.1).
DaylightWeights daylight_weights(double x, double y);

/// X, Y, Z of S0, S1 and S2 (Table 2, linear between its rows): the integrals of S times the
/// CIE 1931 functions over 380..780 nm (trapezoidal rule, 1 nm), times 1 nm. The colour tables are
/// in output/, which this folder may not use; DaylightSpectrum.TristimulusValuesOfTheBasis
/// computes these from them.
inline constexpr double kDaylightTristimulus[3][3] = {
    {10245.362243852, 10676.657939574, 12367.653163274},
    {187.498451526, 193.018970397, 3480.589033921},
    {213.229528320, 76.421055986, -235.644574451},
};
/// The same integral of the CIE 1931 y function alone: of a flat spectrum of 1 per nm.
inline constexpr double kFlatTristimulusY = 106.856399283;
/// lm/W (SI). As kLuminousEfficacy_lm_w of output/colour.h.
inline constexpr double kDaylightEfficacy_lm_w = 683.0;

/// Daylight at some wavelengths.
class DaylightSpectrum {
 public:
  /// Finite wavelengths, nm. Beyond 380..780 nm the basis is that of the end.
  explicit DaylightSpectrum(std::span<const double> wavelength_nm);

  /// Spectral radiance, W m^-2 sr^-1 nm^-1, of a luminance (cd/m^2, >= 0) and a chromaticity, one
  /// value per wavelength; its luminance is 683 lm/W times its integral against the y function
  /// over 380..780 nm. Values below 0 (chromaticities far from daylight) become 0; returns whether
  /// there were any. The chromaticity of the result is that asked for within 2e-4 for x =
  /// 0.25..0.45 about the daylight locus (rounding of the published M1, M2), as long as nothing was
  /// below 0. Throws as daylight_weights, and where the spectrum has no luminance.
  bool radiance(double luminance_cd_m2, double x, double y, std::span<double> out) const;

 private:
  struct Basis {
    double s0, s1, s2;
  };
  std::vector<Basis> basis_;
};

}  // namespace twilight
