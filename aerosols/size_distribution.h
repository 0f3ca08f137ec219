// How many particles of which radius: the truncated lognormal distribution, or any other.
#pragma once

#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

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

/// Any number distribution of spheres; what the size integrals of the Mie theory take.
struct SizeDistribution {
  /// dN/d ln r at a radius in um inside the range below, >= 0, in any one number density.
  std::function<double(double)> per_log_radius;
  double smallest_radius_um = 0.0;  ///< > 0
  double largest_radius_um = 0.0;   ///< > smallest_radius_um

  SizeDistribution() = default;
  SizeDistribution(std::function<double(double)> density, double smallest_um, double largest_um)
      : per_log_radius(std::move(density)),
        smallest_radius_um(smallest_um),
        largest_radius_um(largest_um) {}
  /// A lognormal distribution is one.
  SizeDistribution(const LognormalSizeDistribution& sizes)  // NOLINT: meant to convert
      : SizeDistribution([sizes](double radius_um) { return sizes.per_log_radius(radius_um); },
                         sizes.smallest_radius_um, sizes.largest_radius_um) {}
};

/// Throws std::invalid_argument unless the radii are finite, positive and rise.
inline void require_sizes(const SizeDistribution& sizes) {
  if (sizes.per_log_radius && sizes.smallest_radius_um > 0.0 &&
      sizes.largest_radius_um > sizes.smallest_radius_um &&
      std::isfinite(sizes.largest_radius_um)) {
    return;
  }
  throw std::invalid_argument("radii " + std::to_string(sizes.smallest_radius_um) + ".." +
                              std::to_string(sizes.largest_radius_um) +
                              " um of a size distribution must be positive and rise");
}

}  // namespace twilight
