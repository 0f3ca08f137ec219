// Preetham, Shirley & Smits (1999), Sec. 3.2 and A.2, done again with this program's skies.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "output/fit_sample.h"
#include "sim/models/preetham_sky.h"

namespace twilight::validation {

/// Their turbidities and our twelve Suns (theirs are not told): zenith angles 0, 8 .. 88 degrees.
inline constexpr std::array<double, 5> kRefitTurbidities = {2, 3, 4, 5, 6};
std::vector<double> refit_suns_deg();

/// Perez coefficients A..E as slope and intercept in turbidity; a row of A.2 each.
using LinearCoefficients = std::array<std::array<double, 2>, 5>;
PerezCoefficients at_turbidity(const LinearCoefficients& k, double turbidity);
/// The published ones, of Y, x and y.
LinearCoefficients published_coefficients(std::size_t channel);

/// One simulated sky and its channels Y, x, y.
struct RefitSky {
  double turbidity = 0.0, sun_elevation_deg = 0.0;
  FitSky sky;
};

/// Skies of a scene (its aerosol type and grid; turbidity, Sun and a black ground are set),
/// [T][Sun].
std::vector<RefitSky> refit_skies(const Scene& scene, const RunControl& control);

/// The coefficients, linear in turbidity, that fit a channel of all skies best: least squares of
/// ln(form / value) by solid angle, each sky's scale free. `converged`: whether Ceres says so.
LinearCoefficients fit_linear_in_turbidity(const std::vector<RefitSky>& skies, std::size_t channel,
                                           bool& converged);

/// The zenith's luminance, K cd m^-2: (k0 T + k1) tan chi + k2 T + k3, chi as published.
using ZenithLuminance = std::array<double, 4>;
/// The zenith's x or y: rows T^2, T, 1 by columns theta^3, theta^2, theta, 1.
using ZenithChromaticity = std::array<double, 12>;
struct ZenithFit {
  ZenithLuminance luminance{};
  ZenithChromaticity x{}, y{};
};
/// Least squares of relative errors, over all skies, of the zenith values that give each sky its
/// best scale with the linear coefficients (Y, x, y).
ZenithFit fit_zenith(const std::vector<RefitSky>& skies,
                     const std::array<LinearCoefficients, 3>& linear);
double zenith_value(const ZenithFit& fit, std::size_t channel, double turbidity,
                    double sun_zenith_rad);

/// F of the coefficients over fit_views().
std::vector<double> form_over_views(const PerezCoefficients& k, double sun_zenith_rad);
/// exp of the weighted mean of ln(value / form): the scale that fits a form best.
double best_scale(const std::vector<double>& form, const std::vector<double>& value);

}  // namespace twilight::validation
