// Inner loops of the successive orders: light gathered along rays, and its moments.
#pragma once

#include <cstddef>

#include "sim/emission_kernel.h"

namespace twilight {

/// Pairs rounded up to whole vectors: the size of the arrays of pairs.
constexpr std::size_t padded_pairs(std::size_t pairs) { return (pairs + 15) / 16 * 16; }

inline constexpr std::size_t kGatherScratch = 12;

/// Adds one point's light to every (solar zenith, azimuth) pair of a ray's start.
template <class T>
struct GatherInput {
  /// The pairs: Sun zenith angle at the start, azimuth of the ray from the Sun's, [padded_pairs].
  std::size_t pairs = 0;
  const T *cos_chi = nullptr, *sin_chi = nullptr, *cos_phi = nullptr, *sin_phi = nullptr;
  T cos_psi = 1, sin_psi = 0;  ///< central angle between start and point
  std::size_t lanes = 0;
  bool polarised = true;
  int degree = 2;            ///< modes above it are small and may be left out
  int stored_degree = 2;     ///< of `modes`, at least degree
  std::size_t nodes = 0;     ///< of `modes`
  const T* modes = nullptr;  ///< as air_modes() lays them out
  /// Position of every point of the fine zenith scale among the nodes.
  const T* fine_position = nullptr;
  T fine_per_radian = 0;
  /// The steep factor that modes are relative to, [fine][lane]; zero from fine_end on.
  const T* reference = nullptr;
  std::size_t fine_end = 0;
  T* scratch = nullptr;  ///< kGatherScratch * padded_pairs
};

/// out[pair][stokes][lane] += reference * modes at the point.
template <class T>
void gather_modes(const GatherInput<T>& in, T* out);
template <class T>
void gather_modes_scalar(const GatherInput<T>& in, T* out);

/// Direct sunlight scattered once at a point, by whole phase functions instead of modes. Of
/// `gather` the members about modes and nodes are unused; `reference` is the irradiance of the
/// beam.
template <class T>
struct BeamInput {
  GatherInput<T> gather;
  T cos_theta = 1, sin_theta = 0;  ///< zenith angle of the look direction at the point
  /// By how much refraction lifts the Sun (0..0.05) at the point's altitude, on the fine scale.
  const T* lift_rad = nullptr;
  const T* air_weight = nullptr;         ///< as SourceModesInput, [lane]
  const T* anisotropic_share = nullptr;  ///< of air, [lane]
  /// The `kinds` of aerosol that are there, by index; of every kind, weights over 4 pi,
  /// [kind][lane], and p11 and p12 at cosines -1..1 in equal steps,
  /// [kind][node][p11, p12][lane].
  std::size_t kinds = 0, phase_nodes = 0;
  const std::size_t* kind = nullptr;
  const T *kind_weight = nullptr, *phase = nullptr;
};

/// out[pair][stokes][lane] grows by the light of the beam scattered at the point.
template <class T>
void gather_beam(const BeamInput<T>& in, T* out);
template <class T>
void gather_beam_scalar(const BeamInput<T>& in, T* out);

/// out[pair][lane] (of `stride` values per pair) += weight[lane] * reference at the point: ground.
template <class T>
void gather_ground(const GatherInput<T>& in, const T* weight, std::size_t stride, T* out);

/// Adds the light of up to kEmissionBatch zenith angles to the moments of every node.
template <class T>
struct MomentInput {
  std::size_t nodes = 0, azimuths = 0, lanes = 0;
  bool polarised = true;
  std::size_t directions = 0;
  T cos_theta[kEmissionBatch] = {}, sin_theta[kEmissionBatch] = {};
  T weight[kEmissionBatch] = {};                   ///< solid angle of every azimuth, both halves
  const T* light[kEmissionBatch] = {};             ///< [node][azimuth][stokes][lane]
  const T *cos_phi = nullptr, *sin_phi = nullptr;  ///< [azimuth]
  int phase_degree = 0;                            ///< of the moments, 0 = none
  const T* basis[kEmissionBatch] = {};             ///< angular basis, [mode_major_index][p, r, t]
  T* scratch = nullptr;  ///< kEmissionBatch * 3 * (phase_degree + 1) * lanes
};

/// coherency[node][4][lane] and moments[node][k][lane] grow by the light.
template <class T>
void add_moments(const MomentInput<T>& in, T* coherency, T* moments);
template <class T>
void add_moments_scalar(const MomentInput<T>& in, T* coherency, T* moments);

}  // namespace twilight
