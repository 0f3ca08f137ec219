// The sky of coefficients that `twilight fit` made (solver.method = "fit:FILE.json").
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "sim/models/daylight_spectrum.h"
#include "sim/models/fit_coefficients.h"
#include "sim/models/model_sky.h"
#include "sim/spectral_sky.h"

namespace twilight {

/// Nodes of a fit around a scene and their weights, which are positive and add up to 1.
struct FitCorner {
  std::size_t node = 0;
  double weight = 0.0;
};

/// The corners of the cell of nodes in which `values` (one per axis, within its range) lie,
/// weighted multilinearly; a value within 1e-9 of a node's is the node's.
std::vector<FitCorner> fit_corners(const FitCoefficients& fit, const std::vector<double>& values);

/// A fitted sky under any Sun and in any air within the fit's axes: the logarithm of radiance is
/// interpolated multilinearly between the neighbouring nodes' skies, each the node's form with the
/// scene's own Sun in it. (Coefficients of neighbours may differ wildly where radiances do not:
/// they are not interpolated.) So radiance is positive, continuous, and at a node the node's form.
/// The position on an axis is the scene's value of the axis' key; keys that are no axis do not
/// matter: they are the fitted scene's, whatever this one says. Wavelengths: radiance over solar
/// irradiance, interpolated as in SpectralInterpolation. Fits of luminance and chromaticities have
/// those of each view interpolated, and made a spectrum by the daylight basis as Preetham's are
/// (sim/models/daylight_spectrum.h); the solar spectrum does not enter them, negative spectra
/// become 0 and the summary says so.
class FittedSky : public HemisphereSky {
 public:
  /// Throws std::invalid_argument where a wavelength lies beyond the fit's, the scene leaves the
  /// key of an axis of two or more values unset, or, unless models.out_of_range is "clamp", its
  /// value lies beyond the axis (an axis of one value: differs).
  FittedSky(const SceneModel& model, FitCoefficients fit);
  ~FittedSky() override;

  /// Interpolated as radiance is; linearly where one neighbour's Sun is behind the Earth,
  /// and then 0 below -1 degree, from where no refraction lifts it.
  std::vector<double> sun_transmittance() const override;

 protected:
  void spectrum(const ViewDirection& view, std::span<double> out) const override;

 private:
  std::vector<double> place();
  bool spectrum_clipped(const ViewDirection& view, std::span<double> out) const;
  void record_clipped();

  FitCoefficients fit_;
  std::vector<FitCorner> corners_;
  std::vector<double>
      log_scale_;  // [corner][channel], of radiance over solar irradiance, or Y, x, y
  SpectralInterpolation interpolation_;
  DaylightSpectrum daylight_;
};

/// Makes the sky of a scene whose solver.method is "fit:FILE". Throws as read_fit_coefficients and
/// FittedSky do.
std::unique_ptr<Sky> make_fitted_sky(const SceneModel& model);

}  // namespace twilight
