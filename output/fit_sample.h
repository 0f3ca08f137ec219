// Simulated skies at the directions that forms are fitted to.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "output/colour.h"
#include "output/hemisphere.h"
#include "output/perez_fit.h"
#include "sim/run_control.h"
#include "sim/scene_model.h"

namespace twilight {

/// 343 directions with their solid angles: the zenith, and zenith angles 5, 10 .. 85 and 88.75
/// degrees by azimuths 0, 10 .. 180 degrees from the Sun. (Preetham et al. 1999, Sec. 3.2, fitted
/// 343 directions and do not say which; 18 x 19 + 1 is our reading. Their lowest may have been the
/// horizon; 88.75 is the middle of the last, half, cell.) Solid angles add up to 2 pi.
std::vector<WeightedView> fit_views();

/// How well a form gives a sky back: |form / value - 1| over fit_views(), weighted by solid angle.
struct FitError {
  double rms = 0.0, p95 = 0.0, largest = 0.0;
  double bias = 0.0;  ///< mean of form / value - 1, signed
};
/// `form` and `value` at the views of fit_views(), values > 0.
FitError fit_error(const std::vector<double>& form, const std::vector<double>& value);

/// The directions of fit_views() under a Sun (its zenith angle 0..pi rad), without values.
std::vector<FormSample> fit_samples(double sun_zenith_rad);

/// A sky at fit_views().
struct FitSky {
  std::vector<double> radiance;           ///< W m^-2 sr^-1 nm^-1, [view][wavelength]; > 0
  std::vector<double> luminance;          ///< cd m^-2, [view]
  std::vector<double> x, y;               ///< CIE 1931 chromaticity, [view]
  std::vector<double> sun_transmittance;  ///< 0..1, per wavelength
  std::vector<double> solar_irradiance;   ///< W m^-2 nm^-1, per wavelength
};

/// The values of a channel, a wavelength or one of Y, x, y, over the views.
std::vector<double> channel_values(const FitSky& sky, FitQuantity quantity, std::size_t channel);

/// The model's skies under some Suns (geometric elevations, deg): "orders" solves one field for all
/// of them, the other methods one sky each. `colour` is of the CIE 1931 observer and the scene's
/// wavelengths. `begin` is called before each sky with its index. Throws as solve_sky;
/// std::invalid_argument, naming the Sun and `place`, where a sky is dark (0) in a direction.
std::vector<FitSky> simulate_suns(SceneModel model, const std::vector<double>& suns_deg,
                                  const ColourIntegrator& colour, const std::string& place,
                                  const RunControl& control,
                                  const std::function<void(std::size_t)>& begin = {});

}  // namespace twilight
