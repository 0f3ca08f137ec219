// The angular sums of Mie theory for many spheres and angles at once.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "aerosols/mie.h"

namespace twilight {

/// Angular functions pi_n, tau_n (Bohren & Huffman 1983, Eq. 4.47) of scattering angles up to 90
/// degrees, [angle][n - 1].
class AngularFunctions {
 public:
  /// `cos_angle`: cosines in [0, 1] (else std::invalid_argument); `orders`: largest n.
  AngularFunctions(std::span<const double> cos_angle, std::size_t orders);

  std::size_t angles() const { return angles_; }
  std::size_t orders() const { return orders_; }
  const double* pi(std::size_t angle) const { return pi_.data() + angle * orders_; }
  const double* tau(std::size_t angle) const { return tau_.data() + angle * orders_; }

 private:
  std::size_t angles_, orders_;
  std::vector<double> pi_, tau_;
};

/// Spheres that are summed together: a SIMD lane each.
inline constexpr std::size_t kSpheresTogether = 8;

/// Amplitudes of kSpheresTogether spheres at one angle and at its supplement. pi_n and tau_n are
/// even or odd about 90 degrees, so that the same eight sums give both.
struct PairedAmplitudes {
  using Lanes = std::array<double, kSpheresTogether>;
  /// Parts of S1 and S2 that keep (even) or change (odd) their sign from an angle to its
  /// supplement, real and imaginary: S(angle) = even + odd, S(180 deg - angle) = even - odd.
  Lanes s1_even_re, s1_even_im, s1_odd_re, s1_odd_im;
  Lanes s2_even_re, s2_even_im, s2_odd_re, s2_odd_im;
};

/// Amplitudes S1, S2 (Bohren & Huffman 1983, Eq. 4.74) at every angle of `functions` and at its
/// supplement, for at most kSpheresTogether spheres; lanes without a sphere are 0. Result has the
/// size functions.angles(). Equal to mie_amplitudes() up to rounding. Throws
/// std::invalid_argument for too many spheres or more orders than `functions` has.
std::vector<PairedAmplitudes> paired_amplitudes(const AngularFunctions& functions,
                                                std::span<const MieSeries> spheres);

}  // namespace twilight
