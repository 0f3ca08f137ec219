// A scattering matrix as a series of generalised spherical functions.
#pragma once

#include <vector>

#include "atmosphere/phase_matrix.h"

namespace twilight {

/// Generalised spherical functions P^l_mn(x) of Gelfand & Shapiro, as used by de Rooij & van der
/// Stap (1984), Astron. Astrophys. 131, 237, and Hovenier, van der Mee & Domke (2004), Transfer of
/// Polarized Light in Planetary Atmospheres, App. B. With Wigner's d: P^l_mn = i^(m-n) d^l_mn, so
/// P^l_00 = P_l (Legendre), P^l_22 = d^l_22, P^l_2,-2 = d^l_2,-2, P^l_02 = -d^l_02
/// = -sqrt((l-2)! / (l+2)!) (1 - x^2) P_l''(x). For every pair the integral over -1..1 of
/// P^l P^k is 2 / (2l + 1) for l = k, else 0; below l = 2 all but P^l_00 are 0.
struct SphericalFunctions {
  std::vector<double> p00, p22, p2m2, p02;  ///< [l], l = 0..degree
};

/// The functions at x = cos(angle) in [-1, 1] by upward recurrence in l (stable), relative error
/// below 1e-12 for degrees up to 2000. Throws std::invalid_argument for x or degree (0..5000) out
/// of range.
SphericalFunctions spherical_functions(double x, int degree);

/// Expansion coefficients of a scattering matrix [a1 b1 0 0; b1 a2 0 0; 0 0 a3 b2; 0 0 -b2 a4] in
/// x = cos(scattering angle):
///   a1 = sum alpha1_l P^l_00,                     a4 = sum alpha4_l P^l_00,
///   a2 + a3 = sum (alpha2_l + alpha3_l) P^l_22,   b1 = sum beta1_l P^l_02,
///   a2 - a3 = sum (alpha2_l - alpha3_l) P^l_2,-2, b2 = sum beta2_l P^l_02.
/// Spheres have a1 = a2 = p11, a3 = a4 = p33, b1 = p12, b2 = p34. alpha1_l is 2l + 1 times the
/// Legendre moment of p11: alpha1_0 = 1, alpha1_1 = 3 times the mean cosine. Rayleigh scattering
/// without depolarisation has alpha1_0 = 1, alpha1_2 = 1/2, alpha2_2 = 3, alpha4_1 = 3/2,
/// beta1_2 = sqrt(6) / 2 and nothing else.
struct PhaseExpansion {
  std::vector<double> alpha1, alpha2, alpha3, alpha4, beta1, beta2;  ///< [l], l = 0..degree
};

/// Coefficients up to a degree, 0..5000, of the linear interpolant in angle, integrated by Gauss
/// quadrature on parts of its intervals no wider than 1 / degree: exact to 1e-10. Throws
/// std::invalid_argument for the degree or a matrix whose vectors differ in size.
PhaseExpansion expand(const PhaseMatrix& phase, int degree);

/// Elements of a scattering matrix at one angle.
struct MatrixElements {
  double a1, a2, a3, a4, b1, b2;
};

/// Sum of the series at x = cos(angle) in [-1, 1]; throws as spherical_functions().
MatrixElements evaluate(const PhaseExpansion& expansion, double x);

}  // namespace twilight
