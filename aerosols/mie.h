// Scattering of a plane wave by a homogeneous sphere (Lorenz-Mie theory).
#pragma once

#include <complex>
#include <span>
#include <vector>

namespace twilight {

/// Optical cross sections of a sphere over its geometric cross section pi r^2.
struct MieEfficiencies {
  double extinction = 0.0;
  double scattering = 0.0;
  double absorption = 0.0;   ///< extinction - scattering, exactly 0 for k = 0
  double asymmetry = 0.0;    ///< mean cosine of the scattering angle, in [-1, 1]
  double backscatter = 0.0;  ///< radar convention: 4 pi (dC/dOmega)(180 deg) / (pi r^2)
};

/// The two elements of the amplitude scattering matrix of a sphere, in the sign
/// convention exp(-i omega t) of Bohren & Huffman (1983).
struct MieAmplitudes {
  std::complex<double> s1;  ///< electric field perpendicular to the scattering plane
  std::complex<double> s2;  ///< electric field parallel to the scattering plane
};

/// The scattering coefficients a_n (electric) and b_n (magnetic); entry n - 1 holds order n.
struct MieSeries {
  std::vector<std::complex<double>> a, b;
};

/// Range of the size parameter that the functions below accept.
inline constexpr double kMieSmallestSizeParameter = 1e-4;
inline constexpr double kMieLargestSizeParameter = 1e4;

/// Efficiencies of a sphere of size parameter x = 2 pi r / lambda and refractive index
/// m = n - i k relative to the medium (k >= 0 absorbs): the series of Bohren & Huffman
/// (1983), Eqs. 4.61, 4.62, 4.82 and 4.88, which the paper names in Sec. 4.5.2.
/// x in [1e-4, 1e4], n in (0, 20], k in [0, 20]. Relative error of the efficiencies below
/// 1e-6 (printed digits of Wiscombe 1979). Throws std::invalid_argument outside those ranges.
MieEfficiencies mie_efficiencies(double size_parameter, std::complex<double> refractive_index);

/// Scattering coefficients by Bohren & Huffman (1983), Eq. 4.88, in their sign convention; as many
/// orders as the series needs, about x + 4 x^(1/3) + 3. Parameters, ranges and exceptions as
/// mie_efficiencies().
MieSeries mie_series(double size_parameter, std::complex<double> refractive_index);

/// Sum of (2n + 1) (|a_n|^2 + |b_n|^2): the scattering efficiency times x^2 / 2
/// (Bohren & Huffman 1983, Eq. 4.61).
double scattering_sum(const MieSeries& series);

/// Amplitudes S1, S2 at each scattering angle whose cosine is given (in [-1, 1]), by
/// Bohren & Huffman (1983), Eq. 4.74. Same ranges and errors as mie_efficiencies(); result
/// has the size of `cos_angle`. Throws std::invalid_argument.
std::vector<MieAmplitudes> mie_amplitudes(double size_parameter,
                                          std::complex<double> refractive_index,
                                          std::span<const double> cos_angle);

/// Phase function for unpolarised light, sr^-1, normalised to 1 over the sphere:
/// p = (|S1|^2 + |S2|^2) / (2 pi x^2 Qsca). Parameters, ranges and exceptions as
/// mie_amplitudes(); result has the size of `cos_angle`.
std::vector<double> mie_phase_function(double size_parameter, std::complex<double> refractive_index,
                                       std::span<const double> cos_angle);

}  // namespace twilight
