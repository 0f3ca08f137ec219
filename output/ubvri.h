// Photometric magnitudes of the Johnson-Cousins system.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <numbers>
#include <span>
#include <string_view>
#include <vector>

namespace twilight {

inline constexpr std::array<std::string_view, 5> kUbvriBands = {"U", "B", "V", "R", "I"};

/// One value per band, in the order of kUbvriBands.
using UbvriValues = std::array<double, 5>;

/// A square arcsecond, sr.
inline constexpr double kSquareArcsecond_sr =
    (std::numbers::pi / 648000) * (std::numbers::pi / 648000);

/// First and last wavelength of a band, nm, and its response at a wavelength, 0..1: Bessell (1990,
/// PASP 102, 1181), Table 2, UX, B, V, R and I, linear between its rows, 0 outside. Functions to
/// weigh energy per wavelength with. band < 5.
std::array<double, 2> ubvri_range_nm(std::size_t band);
double ubvri_response(std::size_t band, double wavelength_nm);

/// Spectral irradiance of a star of magnitude 0, W m^-2 nm^-1: Bessell, Castelli & Plez (1998, A&A
/// 333, 231), Table A2 (Vega: V = 0.03). band < 5.
double ubvri_zero_w_m2_nm(std::size_t band);

/// Magnitude of a spectral irradiance that is a band's mean (W m^-2 nm^-1), -2.5 log10(f / zero);
/// NaN where it is not above 0. For a surface brightness (mag arcsec^-2) f is the mean radiance
/// times kSquareArcsecond_sr.
double ubvri_magnitude(std::size_t band, double mean_irradiance_w_m2_nm);

/// Means of a spectrum over the bands, for a sky known at a few wavelengths:
///   mean = integral of L S / integral of S, in steps of 1 nm,
/// with L between the wavelengths as in ColourIntegrator: (L/E0) lambda^4 piecewise linear, E0 with
/// its Fraunhofer lines.
///
/// A band is measured where the wavelengths hold at least kUbvriCoverage of the integral of its
/// response; in what little is beyond them (L/E0) lambda^4 is that of the nearest (were it wrong by
/// 30 % there, 0.003 mag). Other bands are NaN, never extrapolated: 380..780 nm gives B and V, U
/// needs 313 nm, R 840, I 900.
class UbvriIntegrator {
 public:
  /// As ColourIntegrator: wavelength_nm strictly increasing, finite, > 0, at least one;
  /// solar_irradiance_w_m2_nm is E0 at a wavelength in nm, called within the bands that are
  /// measured. Throws std::invalid_argument otherwise.
  UbvriIntegrator(std::span<const double> wavelength_nm,
                  const std::function<double(double)>& solar_irradiance_w_m2_nm);

  bool measures(std::size_t band) const { return !weights_[band].empty(); }

  /// Band means of a radiance (W m^-2 sr^-1 nm^-1) or irradiance, in its unit, from its values and
  /// the solar irradiance (W m^-2 nm^-1, > 0) at this integrator's wavelengths. Throws
  /// std::invalid_argument if a size differs.
  UbvriValues means(std::span<const double> spectrum,
                    std::span<const double> solar_irradiance) const;

  /// Surface brightness of a radiance, mag arcsec^-2; NaN of darkness and of bands not measured.
  UbvriValues surface_brightness(std::span<const double> radiance,
                                 std::span<const double> solar_irradiance) const;

 private:
  std::size_t wavelengths_;
  std::array<std::vector<double>, 5> weights_;  ///< empty: not measured
};

inline constexpr double kUbvriCoverage = 0.99;

}  // namespace twilight
