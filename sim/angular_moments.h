// Generalised spherical functions, the angular basis of polarised light.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace twilight {

/// Number of (l, m) pairs with 0 <= m <= l <= degree; pair (l, m) has index moment_index(l, m).
constexpr std::size_t moment_count(int degree) {
  return static_cast<std::size_t>((degree + 1) * (degree + 2) / 2);
}
constexpr std::size_t moment_index(int l, int m) {
  return static_cast<std::size_t>(l * (l + 1) / 2 + m);
}

/// The functions of one zenith angle theta, each indexed by moment_index(l, m):
///   p = d^l_{m,0}, r = (d^l_{m,-2} + d^l_{m,2}) / 2, t = (d^l_{m,-2} - d^l_{m,2}) / 2,
/// d the rotation functions of Hovenier, van der Mee & Domke (2004), App. B; r and t are 0 for l <
/// 2.
/// A field of incoming light that is mirror symmetric in azimuth has the moments
///   I_lm = int I p cos(m phi), E_lm = int Q r cos(m phi) + U t sin(m phi),
///   B_lm = int Q t cos(m phi) + U r sin(m phi)   (over all directions, d omega)
/// and scattering by spheres is diagonal in them (Siewert 1982): with the expansion
/// coefficients a1..b1 of the scattering matrix,
///   I' = a1 I + b1 E,  E' = b1 I + a2 E,  B' = a3 B,
///   I_scattered = 1/(4 pi) sum (2 - delta_m0) p I' cos(m phi),
///   Q_scattered = 1/(4 pi) sum (2 - delta_m0) (r E' + t B') cos(m phi),
///   U_scattered = 1/(4 pi) sum (2 - delta_m0) (t E' + r B') sin(m phi).
/// phi is the azimuth of the direction the light comes from and theta its zenith angle; Q > 0 for a
/// field along e_theta, U > 0 along e_theta + e_phi. Circular polarisation is left out (it feeds
/// back on I by less than 1e-5).
struct AngularBasis {
  std::vector<double> p, r, t;
};

/// The basis at theta_rad (0..pi) up to `degree` (>= 0). Accurate to 1e-12 for degrees to 64.
AngularBasis angular_basis(int degree, double theta_rad);

}  // namespace twilight
