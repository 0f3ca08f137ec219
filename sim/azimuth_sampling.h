// Azimuthal modes of the rings, and how finely a pair of rings is sampled.
#pragma once

#include <vector>

#include "sim/exchange_medium.h"
#include "sim/ring_point.h"

namespace twilight {

/// Cosines and sines of m k d for the azimuthal modes m of a ring.
struct AzimuthModes {
  int divisions = 0, samples = 0, modes = 0;
  std::vector<float> cosine, sine;              ///< [mode][sample]
  std::vector<double> sin_step, sin_half_step;  ///< [sample]: sin(k d), sin(k d / 2)
  /// Of azimuth i d, i = -S/2..S+1, [i + S/2]; and each eight times over.
  std::vector<float> cos_around, sin_around, cos_around_8, sin_around_8;
  AzimuthModes(int azimuth_divisions, int modes);
};

/// How finely the exchange between two rings must be sampled in azimuth.
struct AzimuthSampling {
  int every = 1;
  int modes = 1;
};

/// 1/d^2 between two rings has azimuthal modes that fall like exp(-eta m) with
/// cosh(eta) = (rho_s^2 + rho_t^2 + dz^2)/(2 rho_s rho_t), and extinction narrows a pair's
/// kernel to sqrt(d/(beta rho_s rho_t)). Modes below `tolerance` are dropped, and the azimuth
/// differences are thinned to what the trapezoidal rule needs for the rest; thinned samples
/// divide S/2. tolerance = 0 keeps everything. Where sources with structure of their own are summed
/// directly (first_event_pass), source_modes of them must be told from the kernel's.
AzimuthSampling azimuth_sampling(const ExchangeMedium& medium, const RingPoint& source,
                                 const RingPoint& target, int azimuth_divisions, int max_modes,
                                 double tolerance, int source_modes = 0);

}  // namespace twilight
