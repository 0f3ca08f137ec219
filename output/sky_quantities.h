// What a study measures of a sky: the [outputs] table of its file, and the numbers.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "output/sky_image.h"
#include "output/study_results.h"
#include "sim/run_control.h"
#include "sim/scene.h"
#include "sim/scene_model.h"
#include "sim/sky.h"

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
  std::string x;       ///< a column of numbers
  std::string y;       ///< a column; or a quantity of several numbers, all columns "y[...]"
  std::string series;  ///< the axis whose values are curves; empty: chosen
  std::optional<bool> logarithmic = {};  ///< of y; unset: where values span two decades
};

/// The [outputs] table of a study.
struct WantedQuantities {
  /// In the order of SkyQuantity, none twice. By default the single numbers and short lists: a
  /// texture per case is megabytes, and the duration of twilight ten more Suns per case.
  std::vector<SkyQuantity> quantities = {SkyQuantity::kRadiance,    SkyQuantity::kIrradiance,
                                         SkyQuantity::kIlluminance, SkyQuantity::kChromaticity,
                                         SkyQuantity::kMagnitudes,  SkyQuantity::kPolarisation};
  /// 1..1000 of them. Zenith; above the Sun; 90 degrees from a low Sun, where Rayleigh light is
  /// most polarised; opposite, in and above the Earth's shadow.
  std::vector<WantedView> views = {{90, 0}, {20, 0}, {20, 90}, {20, 180}};
  TextureContent texture = TextureContent::kSpectral;
  int texture_size = 64;   ///< 4..4096; height in pixels, in the projection of the scene's [output]
  int picture_size = 160;  ///< 0 (no picture) or 16..1024: height of the pictures of the page
  /// Illuminances whose time after sunset is asked for, lux, 1..100, each > 0, decreasing. See
  /// kTwilightThresholds_lux in twilight_duration.h.
  std::vector<double> twilight_thresholds_lux = {3.4, 0.008, 6.5e-4};
  std::vector<WantedPlot> plots;  ///< none: single numbers against the axes that are numbers

  bool wants(SkyQuantity quantity) const;
};

/// Reads the table [outputs] of a TOML file; other tables are ignored, a key not given (or the
/// whole table) keeps its default. Throws std::invalid_argument "FILE:LINE: key 'outputs.x' = V:
/// must be
/// ..." for unknown keys, wrong types and values outside the ranges above, std::runtime_error if
/// the file cannot be read.
WantedQuantities read_wanted_quantities(const std::filesystem::path& study_file);

/// Every field that changes what observe() and case_picture() give, as text for a hash: two are
/// equal where all those fields are. Plots are not among them.
std::string canonical_text(const WantedQuantities& wanted);

/// The coordinates that the quantities of a case have, "wavelength" first, for a scene's
/// wavelengths and projection: the same for all cases of a study. Coordinates of several columns
/// stand in columns of one coordinate's dimension, "view": words such as "el 20 az 90".
std::vector<StudyCoordinate> quantity_coordinates(const WantedQuantities& wanted,
                                                  const Scene& scene);

/// The quantities of a sky solved of the model. Which variables: README, "What a study measures".
/// Every one has the same name, dimensions and size for every case of a study; what the sky or its
/// method does not tell (polarisation of a scalar solver, colour of darkness, a band outside the
/// wavelengths) is NaN. Throws as Sky's functions do, Cancelled when told to stop.
std::vector<StudyQuantity> observe(const Sky& sky, const SceneModel& model,
                                   const WantedQuantities& wanted, const RunControl& control = {});

/// The sky as render_map shows it in the scene's projection, `picture_size` pixels high, for
/// write_preview_png; nothing where that is 0.
std::optional<SkyImage> case_picture(const Sky& sky, const SceneModel& model,
                                     const WantedQuantities& wanted,
                                     const RunControl& control = {});

}  // namespace twilight
