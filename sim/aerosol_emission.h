// What aerosol makes of the moments of the light that arrives, as the emission kernels take it.
#pragma once

#include <cstddef>
#include <vector>

#include "sim/truncated_phase.h"

namespace twilight {

/// AngularBasis of one zenith angle, the degrees of one mode side by side, [mode_major_index][p, r,
/// t]; times (2 - delta_m0) / (4 pi) for the light that is `emitted` under theta_rad, times 1 for
/// the moments of light that arrives.
template <class T>
void fill_mode_basis(int degree, double theta_rad, bool emitted, std::vector<T>& basis);

/// Moments of light that arrives, [node][I, E, B][moment_index][lane] (I alone when not
/// polarised).
template <class T>
struct ArrivingMoments {
  std::size_t nodes = 0, lanes = 0;
  bool polarised = true;
  int stored_degree = 0;
  const T* moments = nullptr;
  const double* trace = nullptr;  ///< by which they are divided, [node][lane]; null: are already
};

/// I' = a1 I + b1 E, E' = b1 I + a2 E, B' = a3 B (Siewert 1982; AngularBasis) to `degree`, in the
/// layout of AerosolPoints::scattered. Nodes of trace 0 are left alone: zero them beforehand.
template <class T>
void scatter_moments(const ArrivingMoments<T>& arriving, const TruncatedPhase& kind, int degree,
                     T* scattered);

}  // namespace twilight
