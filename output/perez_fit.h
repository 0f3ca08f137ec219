// Fits the forms of Perez and of Hosek & Wilkie to one sky.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "sim/models/fit_coefficients.h"

namespace twilight {

/// One direction of a sky.
struct FormSample {
  double cos_zenith = 1.0;     ///< 0.001..1
  double sun_angle_rad = 0.0;  ///< 0..pi
  double weight = 0.0;         ///< share of the sky, > 0; all add up to 1
  double value = 0.0;          ///< > 0: radiance, luminance or chromaticity
};

/// The parameters in which a form is fitted. With theta-dependent factor
///   1 + p exp(b m), m = 1 / cos theta - 1 (Perez), 1 / (cos theta + 0.01) - 1 / 1.01 (Hosek),
/// p = a exp(b) or a exp(b / 1.01) being its value at the zenith, and gamma-dependent factor
///   k sin^2 gamma + f cos^2 gamma + c k exp(d gamma),  f = k (1 + e)                 (Perez)
///   c' sin^2 gamma + f' cos^2 gamma + d (exp(e gamma) - exp(e pi)) + g chi(h, gamma)
///     + i sqrt(cos theta),  c' = c + d exp(e pi), f' = f + c'                          (Hosek)
/// boxes keep every term positive, so that no fitted sky is negative in any direction and, b being
/// <= 0, none diverges at the horizon. k is the form's scale; skies that want nothing of its
/// constant 1 have it on its bound, not c and e at infinity. Order: p, b, k, c k, d, f;
/// p, b, c', d, e, f', g, h, i.
struct FormParameter {
  const char* name;
  double lowest, highest;  ///< the bounds of the fit
};
std::span<const FormParameter> form_parameters(SkyForm form);

/// ln of the form at a direction, and, if `gradient` is not null, its derivatives by the parameters
/// (form_parameters().size() of them), all analytic. The parameters are within their bounds.
double log_form(SkyForm form, const double* parameters, double cos_zenith, double sun_angle_rad,
                double* gradient);

/// What a form's coefficients are in these parameters and back; k of Perez' is 1, and Hosek's
/// coefficients keep their scale.
std::vector<double> form_parameters_of(SkyForm form, std::span<const double> coefficients);
std::vector<double> form_coefficients_of(SkyForm form, std::span<const double> parameters);

/// The sky's best form.
struct FormFit {
  std::vector<double> coefficients;     ///< A.., see coefficient_count
  double normalisation = 0.0;           ///< as in FitCoefficients
  std::vector<double> parameters;       ///< of the fit; a start for a neighbouring sky's
  double rms_log = 0.0;                 ///< weighted rms of ln(form / value)
  std::vector<std::string> bounds_hit;  ///< "b highest": the parameters that ended on a bound
  bool converged = false;
  std::string termination;     ///< Ceres' word and reason
  int iterations = 0;          ///< of the start that won
  double gradient_norm = 0.0;  ///< largest component of the projected gradient at the end
  int start = 0;               ///< which start won: 0.. of those given, then the form's own
};

/// A search that needs more has not converged.
inline constexpr int kFormFitIterations = 400;

/// Weighted least squares of ln(form / value), by Levenberg-Marquardt (Ceres) within the bounds:
/// logarithms, because twilight skies range over four decades, and relative errors are seen, not
/// absolute ones; their quotient residual would forgive a form that is too dark.
/// Several starts, always the same: first `starts`, each a FormFit::parameters of a neighbour, then
/// the form's own; for Hosek the first of those is the best Perez form. The least sum of squares
/// wins; within 1e-6 of it the earliest start. One that has not converged within `most_iterations`
/// goes on once from where it stands. Runs on one thread.
/// Throws std::invalid_argument without samples, or where a sample is outside the ranges above.
FormFit fit_form(SkyForm form, std::span<const FormSample> samples, double sun_zenith_rad,
                 std::span<const std::vector<double>> starts = {},
                 int most_iterations = kFormFitIterations);

}  // namespace twilight
