// What was measured of a sky: radiances, zenith brightness, photographs, each as data of a view, a
// Sun and a spectral response.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/scene.h"
#include "sim/sky.h"

namespace twilight {

/// What an instrument makes of a spectrum: the radiance at one wavelength, or the integral of
/// radiance times sensitivity over nm (luminance: 683 V(lambda)).
struct SpectralResponse {
  std::string name;                         ///< "550 nm", "luminance", "R"
  std::optional<double> single_nm;          ///< of a monochromatic radiance
  std::vector<double> sensitivity_nm = {};  ///< strictly increasing
  std::vector<double> sensitivity = {};     ///< as many; linear between, zero beyond
  /// Share of the integral that the wavelengths of a sky must hold. Magnitudes need nearly all, as
  /// UbvriIntegrator does.
  double least_held = 0.0;
};

/// The Sun of some data.
struct MeasuredSun {
  double elevation_rad = 0.0;  ///< geometric
  double azimuth_rad = 0.0;    ///< clockwise from north
  double distance_au = 1.0;    ///< the solar irradiance is scaled by it
};

/// Mean over a band of ubvri.h times kSquareArcsecond_sr over its zero point, named "V" etc.: the
/// surface brightness is -2.5 log10 of it. band < 5.
SpectralResponse band_response(std::size_t band);

/// One datum: the mean over its views, as the response sees it.
struct MeasuredValue {
  std::size_t sun = 0;
  std::vector<std::pair<std::size_t, double>> views;  ///< index into Measurement::views, share
  std::size_t response = 0;
  double value = 0.0;
  double standard_error = 0.0;                   ///< one sigma, > 0
  int line = 0;                                  ///< of its file, or 0
  int left = 0, top = 0, right = 0, bottom = 0;  ///< block of a photograph, right and bottom beyond
};

enum class MeasuredKind { kRadiances, kZenithCurve, kPhotograph };

/// A data set.
struct Measurement {
  MeasuredKind kind = MeasuredKind::kRadiances;
  std::filesystem::path file;
  std::vector<MeasuredSun> suns;
  std::vector<SpectralResponse> responses;
  std::vector<ViewDirection> views;  ///< azimuths relative to the Sun of the value that looks there
  std::vector<MeasuredValue> values;
  bool magnitudes = false;     ///< values and errors are mag arcsec^-2 of their response's band
  bool free_exposure = false;  ///< values carry an unknown factor
  /// For people: samples taken, pose and its residual...
  std::vector<std::pair<std::string, std::string>> figures;
  int width = 0, height = 0;  ///< of a photograph
};

/// Reads what was measured under the scene's Sun or at its place:
/// - A CSV file with a header. Radiances: view_elevation_deg (-90..90); relative_azimuth_deg (from
///   the Sun's) or azimuth_deg (clockwise from north); wavelength_nm (280..1000);
///   radiance_w_m2_sr_nm (> 0). Zenith curves: luminance_cd_m2 (> 0) or magnitude_per_arcsec2, and
///   no view. Both: sun_elevation_deg (geometric) or time (RFC 3339; the scene then has a place),
///   else the scene's Sun (azimuth_deg beside sun_elevation_deg needs sun_azimuth_deg too; two
///   columns for one thing are refused); standard_error in the value's unit, else `relative_error`
///   is asked for. Other columns are not looked at; empty lines and lines with '#' are skipped.
/// - A TOML file that names such a file, `kind`, and `relative_error`; or a photograph
///   (photograph.h).
/// Throws std::invalid_argument "FILE:LINE: ..." for whatever is wrong, std::runtime_error where a
/// file cannot be read.
Measurement read_measurement(const std::filesystem::path& file, const Scene& scene,
                             std::optional<double> relative_error = std::nullopt);

/// The Sun of the scene, or of a time at the scene's place. Throws std::invalid_argument.
MeasuredSun sun_of(const Scene& scene);
MeasuredSun sun_at(const Scene& scene, const std::string& time);

/// A response per channel of a CSV file: first column wavelength_nm, one column per channel, its
/// name the channel's. Throws as read_measurement.
std::vector<SpectralResponse> read_sensitivities(const std::filesystem::path& file);

}  // namespace twilight
