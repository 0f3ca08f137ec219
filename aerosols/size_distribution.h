// How many particles of which radius: the truncated lognormal distribution.
#pragma once

#include <cmath>
#include <numbers>

namespace twilight {

/// Lognormal number distribution of one aerosol component per particle, cut at both ends:
///   dN/d ln r = exp(-(ln r - ln r_mod)^2 / (2 ln^2 sigma)) / (sqrt(2 pi) ln sigma)
/// inside [smallest_radius_um, largest_radius_um], 0 outside (Hess, Koepke & Schult 1998).
/// As in OPAC the cut distribution is NOT renormalised: its integral is below 1.
struct LognormalSizeDistribution {
  double mode_radius_um = 0.0;       ///< median of the number distribution, > 0
  double geometric_deviation = 0.0;  ///< sigma, dimensionless, > 1
  double smallest_radius_um = 0.0;   ///< > 0
  double largest_radius_um = 0.0;    ///< > smallest_radius_um

  /// dN/d ln r at a radius in um (> 0), dimensionless.
  double per_log_radius(double radius_um) const {
    if (radius_um < smallest_radius_um || radius_um > largest_radius_um) return 0.0;
    const double width = std::log(geometric_deviation);
    const double t = std::log(radius_um / mode_radius_um) / width;
    return std::exp(-0.5 * t * t) / (std::sqrt(2.0 * std::numbers::pi) * width);
  }

  /// Integral of r^power dN over the radii below `upper_radius_um`, in um^power, exact
  /// (error function): power 0 counts particles, 3 gives 3/(4 pi) of the mean volume.
  double moment(double power, double upper_radius_um) const {
    const double upper = std::fmin(upper_radius_um, largest_radius_um);
    if (upper <= smallest_radius_um) return 0.0;
    const double width = std::log(geometric_deviation);
    const double shift = power * width;  // the r^power-weighted mode lies `shift` widths higher
    const double low = std::log(smallest_radius_um / mode_radius_um) / width - shift;
    const double high = std::log(upper / mode_radius_um) / width - shift;
    const double inside =
        0.5 * (std::erfc(low / std::numbers::sqrt2) - std::erfc(high / std::numbers::sqrt2));
    return std::pow(mode_radius_um, power) * std::exp(0.5 * shift * shift) * inside;
  }
};

}  // namespace twilight
