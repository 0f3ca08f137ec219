// Coefficients of a form fitted to simulated skies: what `twilight fit` writes and "fit:FILE"
// reads.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace twilight {

/// solver.method "fit:FILE".
inline constexpr std::string_view kFitMethodPrefix = "fit:";

/// Which form was fitted: five parameters (sim/models/perez.h) or nine (sim/models/hosek.h).
enum class SkyForm { kPerez, kHosek };

std::string_view sky_form_name(SkyForm form);  ///< "perez", "hosek"
/// Throws std::invalid_argument for any other name; the message lists them.
SkyForm sky_form_from_name(std::string_view name);
/// 5 (A..E) or 9 (A..I).
std::size_t coefficient_count(SkyForm form);
/// The letter of coefficient k, k < 9.
std::string coefficient_name(std::size_t k);
/// The form in plain text, units and angles named: what the file says of itself.
std::string_view sky_form_text(SkyForm form);

/// F of a form's coefficients (coefficient_count of them): perez() or hosek(). cos_zenith 0..1,
/// sun_angle_rad 0..pi.
double sky_form_value(SkyForm form, std::span<const double> coefficients, double cos_zenith,
                      double sun_angle_rad);

/// What the form describes: radiance at every wavelength, or luminance (cd m^-2) and the CIE 1931
/// chromaticities x and y, three channels.
enum class FitQuantity { kSpectral, kLuminanceChromaticity };

std::string_view fit_quantity_name(FitQuantity quantity);
FitQuantity fit_quantity_from_name(std::string_view name);

/// A key of the scene and the values, strictly increasing, at which skies were fitted.
struct FitAxis {
  std::string key;
  std::vector<double> values;
};

inline constexpr const char* kSunElevationKey = "sun.elevation_deg";

/// A form's coefficients at every node, the nodes being the axes' values crossed, the last axis
/// running fastest. A channel is a wavelength, or one of Y, x, y.
struct FitCoefficients {
  SkyForm form = SkyForm::kPerez;
  FitQuantity quantity = FitQuantity::kSpectral;
  std::vector<FitAxis> axes;             ///< sun.elevation_deg (geometric) is always among them
  std::vector<double> wavelength_nm;     ///< strictly increasing
  std::string solar_spectrum;            ///< its name, for the record
  std::vector<double> solar_irradiance;  ///< per wavelength, W m^-2 nm^-1, of the fitted skies
  std::vector<double> coefficients;      ///< [node][channel][k]
  /// [node][channel]: the zenith's value for Perez, V = normalisation F(theta, gamma) / F(0, Sun's
  /// zenith angle), the mean value of the hemisphere for Hosek, V = normalisation F(theta, gamma).
  /// W m^-2 sr^-1 nm^-1, or cd m^-2 and dimensionless.
  std::vector<double> normalisation;
  std::vector<double> sun_transmittance;  ///< [node][wavelength], 0..1
  std::vector<bool> converged;            ///< [node], of all its channels

  std::size_t nodes() const;
  std::size_t channels() const;
  /// The value of an axis at a node.
  double axis_value(std::size_t node, std::size_t axis) const;
  /// The geometric solar zenith angle of a node, rad.
  double sun_zenith_rad(std::size_t node) const;
  std::span<const double> coefficients_at(std::size_t node, std::size_t channel) const;
  /// What F is multiplied with to give the channel's value.
  double scale(std::size_t node, std::size_t channel) const;
  /// The channel's value for a view: zenith angle's cosine 0..1, angle to the Sun 0..pi rad.
  double value(std::size_t node, std::size_t channel, double cos_zenith,
               double sun_angle_rad) const;
};

inline constexpr const char* kFitFormat = "twilight sky fit";
inline constexpr int kFitFormatVersion = 1;

/// Reads what write_fit (output/fit_file.h) wrote. Throws std::invalid_argument
/// "FILE: /json/pointer = VALUE: must be ..." where text, structure, a size or a value is wrong:
/// numbers finite, normalisation > 0, transmittance 0..1, axes and wavelengths strictly
/// increasing, and the form positive (b <= 0, for Perez c >= 0, e >= -1, a exp(b) >= -1, and for
/// Hosek the terms that sim/models/README.md names), so that no radiance is negative;
/// std::runtime_error if the file cannot be read.
FitCoefficients read_fit_coefficients(const std::filesystem::path& file);

/// Whether a form with these coefficients is positive for every view and Sun angle by the
/// conditions above (sufficient ones).
bool sky_form_is_positive(SkyForm form, std::span<const double> coefficients);

}  // namespace twilight
