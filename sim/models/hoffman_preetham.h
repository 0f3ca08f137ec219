// Hoffman & Preetham's closed forms: air of constant density in optical lengths.
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace twilight {

/// Their sample wavelengths, R, G, B.
inline constexpr std::array<double, 3> kHoffmanPreethamNm = {650.0, 570.0, 475.0};
/// Optical lengths of the atmosphere at the zenith, km ("Sunlight").
inline constexpr double kAirLengthKm = 8.4;
inline constexpr double kHazeLengthKm = 1.25;

/// A row of Table 1.
struct HazeRow {
  std::string_view name;
  std::array<double, 3> scattering_per_m;  ///< at kHoffmanPreethamNm
  double asymmetry;                        ///< g as printed
};
/// Light haze, heavy haze, light fog, heavy fog. Heavy fog scatters 1e-2 m^-1 at every wavelength:
/// the printed 1e-5 at 475 nm would make it a thousandfold yellow filter against "becomes more
/// monochromatic" in the text above it, and is taken for a misprint.
inline constexpr std::array<HazeRow, 4> kHazeTable = {{{"light haze", {2e-5, 3e-5, 4e-5}, -1.0},
                                                       {"heavy haze", {8e-5, 1e-4, 1.2e-4}, -3.0},
                                                       {"light fog", {9e-4, 1e-3, 1.1e-3}, -10.0},
                                                       {"heavy fog", {1e-2, 1e-2, 1e-2}, -30.0}}};
/// A row by its name, or nothing.
std::optional<HazeRow> haze_row(std::string_view name);

/// Scattering coefficient of air at the ground, m^-1 ("Air Molecules and Rayleigh Scattering"):
/// 8 pi^3 (n^2 - 1)^2 / (3 N lambda^4) (6 + 3 p) / (6 - 7 p), n = 1.0003, N = 2.545e25 m^-3, p =
/// 0.035. (That N is air at 15 degrees Celsius, not at 0 as printed.)
double hoffman_preetham_air_per_m(double wavelength_nm);

/// Their haze phase function as printed, sr^-1:
///   (1 - g)^2 / (4 pi (1 + g^2 - 2 g cos)^(3/2)),
/// cos_angle that of the angle between view ray and Sun. Its integral over the sphere is
/// |1 - g| / |1 + g| for |g| < 1 and |g - 1| / (|g| |g + 1|) beyond, not 1. With g < 0, as in their
/// table, it is dark towards the Sun and bright opposite to it. Singular at cos = sign g for |g| =
/// 1: 1 + g^2 - 2 g cos is held at 1e-4 or above.
double printed_haze_phase_per_sr(double cos_angle, double g);

/// Henyey and Greenstein's g, in (-1, 1), that is meant by a g of their table. The shape of the
/// printed function is the same for g and 1/g (1 + g^2 - 2 g cos = g^2 (1 + g^-2 - 2 g^-1 cos)),
/// so g = -3 is the shape of -1/3. The sign is turned: with the cosine taken against the light's
/// direction of travel, which alone makes "for most haze g should be negative" true, negative g is
/// forward. Within 1 % of |g| = 1, where all light goes straight on, 0.8, a haze's, with that sign.
double physical_asymmetry(double g);

/// Relative optical length times its zenith value, Eq. 5 (Kasten 1966, as in Iqbal 1983), in the
/// unit of zenith_length; zenith angle 0..90 degrees.
double optical_length(double zenith_length, double zenith_deg);

/// Extinction over a distance, Eq. 3, 0..1.
double extinction_factor(double extinction_per_km, double distance_km);

/// In-scattered radiance over a distance per unit of the Sun's irradiance, Eq. 4, sr^-1, for an
/// angular scattering coefficient in km^-1 sr^-1; the limit of no extinction included, and an
/// infinite distance where there is extinction.
double inscattering(double extinction_per_km, double scattering_per_km_sr, double distance_km);

/// What scatters and extinguishes at one wavelength and angle.
struct TwoShellOptics {
  double air_extinction_per_km, haze_extinction_per_km;
  double air_scattering_per_km_sr, haze_scattering_per_km_sr;
};
/// Of the sky ("Sky Color"): air and haze up to haze_length_km, air alone beyond, up to
/// air_length_km >= haze_length_km (optical lengths).
double two_shell_inscattering(const TwoShellOptics& optics, double air_length_km,
                              double haze_length_km);

}  // namespace twilight
