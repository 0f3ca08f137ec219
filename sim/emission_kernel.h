// Light that one point of a ray sends along the ray, as Fourier modes in azimuth.
#pragma once

#include <cstddef>

namespace twilight {

/// Rows kept for the modes 0..degree: an even number, for two modes of 8 lanes share a wide vector.
constexpr std::size_t mode_rows(int degree) { return static_cast<std::size_t>(degree + 2) / 2 * 2; }

/// Index of (l, m), 0 <= m <= l <= degree, where the degrees of one mode stand side by side.
constexpr std::size_t mode_major_index(int degree, int l, int m) {
  return static_cast<std::size_t>(m * (degree + 1) - m * (m - 1) / 2 + l - m);
}

/// Points of rays that are taken together.
inline constexpr std::size_t kEmissionBatch = 4;

/// Light scattered by air at a point, for every solar zenith node:
/// modes[node][stokes][row][lane], I, then Q, then U (when polarised), mode_rows(degree) rows each,
/// those above mode 2 zero; the U mode 0 is unused. Q and U are those of the ray's vertical
/// plane, which holds the Earth's centre and is the same at all its points.
template <class T>
struct AirEmission {
  std::size_t nodes = 0, lanes = 0;
  bool polarised = true;
  int degree = 2;                  ///< of the modes, >= 2
  T cos_theta = 1, sin_theta = 0;  ///< zenith angle of the look direction at the point
  /// Coherency tensor [node][xx, yy, zz, xz][lane], depolarisation included, and 3 / (8 pi) times
  /// the weight of air in the ray's integral, [lane].
  const T* coherency = nullptr;
  const T* air_weight = nullptr;
};

template <class T>
void air_modes(const AirEmission<T>& in, T* modes);
template <class T>
void air_modes_scalar(const AirEmission<T>& in, T* modes);

/// Light scattered by one kind of aerosol at up to kEmissionBatch points of one level: what the
/// modes of each, laid out as by air_modes(), grow by.
template <class T>
struct AerosolPoints {
  std::size_t nodes = 0, lanes = 0;
  bool polarised = true;
  int degree = 2;        ///< of the modes, >= phase_degree
  int phase_degree = 0;  ///< of the moments
  /// Scattered moments I' = a1 I + b1 E, E' = b1 I + a2 E, B' = a3 B (I' alone when scalar),
  /// [node][mode_major_index][I', E', B'][lane].
  const T* scattered = nullptr;
  std::size_t points = 0;
  /// Of each point: (2 - delta_m0) / (4 pi) times p, r, t of AngularBasis at the look direction,
  /// [mode_major_index][p, r, t]; and the weight of the kind in the ray's integral, [lane].
  const T* basis[kEmissionBatch] = {};
  const T* weight[kEmissionBatch] = {};
  T* modes[kEmissionBatch] = {};
};

template <class T>
void add_aerosol_modes(const AerosolPoints<T>& in);
template <class T>
void add_aerosol_modes_scalar(const AerosolPoints<T>& in);

/// The least degree (2..in.degree) such that the modes above it are below `share` of I's mode 0, at
/// every node and lane.
template <class T>
int significant_degree(const AirEmission<T>& in, const T* modes, T share);

}  // namespace twilight
