// How the Sun's disc darkens towards its limb.
#pragma once

#include <array>
#include <cstddef>

namespace twilight {

/// Angular radius of the Sun's disc at 1 au, rad: 959.63 arcsec (IAU, Auwers 1891).
inline constexpr double kSunAngularRadiusRad = 959.63 / 206264.80624709636;

/// Limb darkening of one wavelength: radiance of the disc, relative to its mean over the disc, by
/// the polynomial of degree 5 in mu of Neckel & Labs (1994, Solar Phys. 153, 91) with the
/// coefficients as functions of wavelength of Neckel (2005, Solar Phys. 229, 13), continuum.
class LimbDarkening {
 public:
  /// Valid 300..1100 nm; wavelengths beyond take the nearest end's darkening, those across the
  /// Balmer jump, 373..385 nm, a linear mixture of its two sides. Throws std::invalid_argument
  /// unless wavelength_nm is finite and > 0.
  explicit LimbDarkening(double wavelength_nm);

  /// Radiance over the disc's mean, dimensionless; mu = cosine of the angle between the line of
  /// sight and the Sun's surface normal, 0 (limb) to 1 (centre). The mean over the disc,
  /// 2 integral of mu value d(mu), is 1 exactly. Error of the fit about 0.5 % of the centre.
  double operator()(double mu) const {
    double sum = coefficient_[5];
    for (int k = 4; k >= 0; --k) sum = sum * mu + coefficient_[static_cast<std::size_t>(k)];
    return sum;
  }

 private:
  std::array<double, 6> coefficient_;
};

}  // namespace twilight
