// What is wanted of every sky of a study: the [outputs] table of its file.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace twilight {

enum class SkyQuantity {
  kTexture,
  kRadiance,
  kIrradiance,
  kIlluminance,
  kChromaticity,
  kMagnitudes,
  kPolarisation,
  kTwilightDuration,
};

enum class TextureContent { kSpectral, kRgb, kXyz };

/// A direction seen; azimuth from the Sun's, clockwise from above.
struct WantedView {
  double elevation_deg = 90;  ///< -90..90, apparent
  double azimuth_deg = 0;     ///< -360..360
};

/// A plot asked for: columns of the study's table by name.
struct WantedPlot {
  std::string x = {};       ///< an axis, or another column of numbers
  std::string y = {};       ///< a column; or a quantity of several numbers, all columns "y[...]"
  std::string series = {};  ///< the axis whose values are curves; empty: chosen
  std::optional<bool> logarithmic = {};  ///< of y; unset: where values span two decades
  std::string origin = {};               ///< "study.toml:12"
};

/// The [outputs] table of a study.
struct WantedQuantities {
  /// In the order of SkyQuantity, none twice. By default the single numbers and short lists: a
  /// texture is a megabyte per case, and the duration of twilight some fifteen more Suns.
  std::vector<SkyQuantity> quantities = {SkyQuantity::kRadiance,    SkyQuantity::kIrradiance,
                                         SkyQuantity::kIlluminance, SkyQuantity::kChromaticity,
                                         SkyQuantity::kMagnitudes,  SkyQuantity::kPolarisation};
  /// 1..1000 of them, none twice. Zenith; towards the Sun; across, where the light of a low Sun is
  /// most polarised; opposite, where the Earth's shadow rises.
  std::vector<WantedView> views = {{90, 0}, {20, 0}, {20, 90}, {20, 180}};
  TextureContent texture = TextureContent::kSpectral;
  int texture_size = 64;   ///< 4..4096; height in pixels, in the projection of the scene's [output]
  int picture_size = 160;  ///< 0 (no picture) or 16..1024: height of the pictures of the page
  int exr_size = 0;        ///< 0 (none) or 4..4096: height of an EXR of each sky (write_exr)
  /// Horizontal illuminances, lux, 1..100 of them, 1e-6..1e5, decreasing: of a clear sky at the
  /// ends of civil (3.41: Seidelmann 1992, Explanatory Supplement, Sec. 9.34), nautical and
  /// astronomical twilight (0.008, 6e-4: R. L. Lee in the American Meteorological Society's
  /// Glossary).
  std::vector<double> twilight_thresholds_lux = {3.4, 0.008, 6e-4};
  std::vector<WantedPlot> plots = {};  ///< none: single numbers against axes of numbers

  bool wants(SkyQuantity quantity) const;
};

/// "texture", "radiance", ... and "spectral", "rgb", "xyz", as in [outputs].
std::string_view name_of(SkyQuantity quantity);
std::string_view name_of(TextureContent content);

/// Reads the table [outputs] of a TOML file; other tables are ignored, and a key that is not given
/// (or the whole table) keeps its default. Throws std::invalid_argument "FILE:LINE: key 'outputs.x'
/// = V: must be ..." for unknown keys, wrong types and values outside the ranges above,
/// std::runtime_error if the file cannot be read.
WantedQuantities read_wanted_quantities(const std::filesystem::path& study_file);

/// Every field that what is measured depends on, as text for a hash: equal where all those fields
/// are. Plots are not among them: they are drawn of what was measured.
std::string canonical_text(const WantedQuantities& wanted);

/// Throws std::invalid_argument "FILE:LINE: key 'outputs.plots.x' = ...: must be ..." for a wanted
/// plot whose x, y or series is neither one of `columns` nor, for y, the quantity of columns
/// "y[...]"; series must be one of the first `axes` columns.
void check_plots(const WantedQuantities& wanted, std::span<const std::string> columns,
                 std::size_t axes);

}  // namespace twilight
