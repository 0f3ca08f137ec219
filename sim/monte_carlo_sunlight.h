// The refracted, attenuated and spread sunlight at any point, as the Monte Carlo sees it.
#pragma once

#include <cstddef>
#include <vector>

#include "atmosphere/medium.h"
#include "sim/monte_carlo_rays.h"

namespace twilight {

/// Direct sunlight per wavelength: irradiance normal to the beam over that outside the
/// atmosphere, T S, and the cosine of its apparent zenith angle.
///
/// The apparent angle a of true angle chi comes from a table of cos a - cos chi over (sqrt of the
/// altitude, sqrt of the distance of cos chi from the last ray that grazes the ground), filled by
/// BentRays and interpolated by cubics; within 4e-6 in cos a (the test compares with rays). The
/// spreading S = n^2 d(cos a)/d(cos chi) is the derivative of that same interpolant, so that the
/// sunlight through a sphere is conserved whatever the table's error. The optical depth is no
/// table: shell by shell, exact for straight rays.
class MonteCarloSunlight {
 public:
  /// spreading = false: S = 1. Runs on the current oneTBB arena.
  MonteCarloSunlight(const Medium& medium, bool spreading);

  std::size_t wavelengths() const { return wavelengths_; }
  const BentRays& rays(std::size_t wavelength) const { return rays_[wavelength]; }

  /// Sets irradiance and cos_apparent, one per wavelength, at an altitude 0..top (km, in the given
  /// layer of the medium) under the cosine of the true solar zenith angle. False (nothing set)
  /// when every wavelength is in the Earth's shadow; one alone in it gets 0.
  bool at(double height_km, std::size_t layer, double cos_chi, double* irradiance,
          double* cos_apparent) const;
  /// The same for one wavelength.
  bool at_one(std::size_t wavelength, double height_km, std::size_t layer, double cos_chi,
              double* irradiance, double* cos_apparent) const;

  /// Optical depth of the bent ray from outside to a point where its zenith angle has this cosine
  /// (the Earth ignored).
  double optical_depth(std::size_t wavelength, double height_km, std::size_t layer,
                       double cos_apparent) const;

 private:
  struct Interpolation;
  bool locate(double height_km, double cos_chi, Interpolation& at) const;
  bool finish(std::size_t w, double height_km, std::size_t layer, double cosine, double slope,
              double* irradiance, double* cos_apparent) const;
  void fill_table();

  double radius_km_, top_km_;
  std::size_t wavelengths_, shells_ = 0;
  bool spreading_, refracting_ = false;
  std::vector<BentRays> rays_;
  std::vector<double> filter_;  // transmittance of what lies above the model
  // Shells: layers, thick ones divided.
  std::vector<double> shell_height_km_;              // boundaries
  std::vector<std::size_t> layer_shell_;             // first shell of a layer, size layers + 1
  std::vector<double> nr_km_, nr_squared_, weight_;  // [wavelength][boundary]
  std::vector<double> density_;       // extinction x dr / d(n r), [wavelength][shell]
  std::vector<float> table_;          // [altitude][angle][wavelength]
  std::vector<double> last_cos_chi_;  // [altitude]
};

}  // namespace twilight
