// What aerosol sends along a ray: expansion coefficients and angular basis as the kernels take
// them.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/orders_kernel.h"
#include "sim/truncated_phase.h"

namespace twilight {

/// The angular basis of one zenith angle in a kernel's precision.
template <class T>
struct KernelBasis {
  std::vector<T> p, r, t;  ///< by moment_index

  /// As AngularBasis, times a factor per azimuthal mode: (2 - delta_m0) / (4 pi) for the light
  /// that is `emitted` under theta_rad, 1 for the moments of light that arrives.
  void set(int degree, double theta_rad, bool emitted);
};

/// The aerosol's part of SourceModesInput at one point after another of a ray.
template <class T>
class AerosolEmission {
 public:
  /// `kinds` outlive the object; degree as they were truncated at.
  AerosolEmission(std::span<const TruncatedPhase> kinds, int degree, std::size_t lanes);

  /// Sums the kinds' expansion coefficients times their weights, [kind][lane]; false (and nothing
  /// done) where every weight is 0.
  bool weigh(const double* weight);

  /// After weigh(): points the input at the coefficients, at the basis of theta_rad and at the
  /// moments of the point's nodes, which are used up to phase_degree.
  void emit(double theta_rad, int phase_degree, const T* moments, SourceModesInput<T>& in);

 private:
  std::span<const TruncatedPhase> kinds_;
  int degree_;
  std::size_t lanes_;
  std::vector<T> a1_, b1_, a2_, a3_;  // [l][lane]
  KernelBasis<T> basis_;
};

}  // namespace twilight
