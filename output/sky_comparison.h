// Models, methods and images side by side: how far each sky is from the first.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "output/exr_reader.h"
#include "output/sky_image.h"
#include "sim/run_control.h"
#include "sim/scene.h"

namespace twilight {

/// What `twilight compare` was asked for.
struct ComparisonOptions {
  /// The first is what the others are measured against. Each is a method or model (solver.method),
  /// with settings of its own behind commas ("nishita,models.air=scene"), or an EXR file.
  std::vector<std::string> contenders;
  std::optional<std::filesystem::path> scene;  ///< unset: the defaults of every key
  std::vector<std::string> overrides;          ///< of the scene, "KEY=VALUE"
  std::string suns;  ///< "30,0,-6", deg; empty: 60,30,10,5,2,0,-2,-4,-6,-9,-12
  /// For images that carry no projection of ours.
  std::optional<std::string> projection;
  std::filesystem::path directory;  ///< for comparison.csv and pictures; empty: none
  int picture_size = 160;           ///< 16..1024 pixels, of each fisheye
};

/// One sky of the comparison, before any work.
struct Contender {
  std::string label;  ///< as given
  std::optional<Scene> scene;
  std::optional<StoredMap> image;
};

struct ComparisonPlan {
  ComparisonOptions options;
  std::vector<Contender> contenders;
  std::vector<double> suns_deg;  ///< one where an image takes part
  double sun_azimuth_rad = 0;    ///< clockwise from north
};

/// Differences from the first contender over the hemisphere's views, weighted by solid angle.
/// Relative ones leave out views where the first is dark. Chromaticity distances are Euclidean in
/// CIE 1976 u'v' (CIE 15:2004, 8.2.2), where both are lit.
struct SkyErrors {
  /// Of the spectral radiance, over views and wavelengths, W m^-2 sr^-1 nm^-1; with images none.
  std::optional<double> radiance_rmse, radiance_mean_relative, radiance_max_relative;
  double luminance_rmse_cd_m2 = 0, luminance_mean_relative = 0, luminance_max_relative = 0;
  double luminance_bias = 0;  ///< signed mean of the relative difference
  std::optional<double> zenith_luminance_ratio;
  double chromaticity_mean = 0, chromaticity_max = 0;
};

struct ComparisonRow {
  std::size_t contender = 0;
  std::optional<double> sun_elevation_deg;  ///< geometric; none of images that do not say
  std::string undefined;                    ///< why the model has no such sky; empty: it has
  std::vector<std::pair<std::string, std::string>> clamps;  ///< RunSummary::clamps
  /// Wall seconds: to be ready for this Sun (the first carries what later Suns share), and for
  /// the views.
  double setup_seconds = 0, view_seconds = 0;
  SkyErrors errors;  ///< of the first contender itself 0
  SkyImage picture;  ///< fisheye, X, Y, Z; empty where undefined or not asked for
};

struct Comparison {
  ComparisonPlan plan;
  std::vector<ComparisonRow> rows;  ///< Sun by Sun, in each the contenders in order
};

/// Looks at everything that can be wrong before a long run. Throws std::invalid_argument or
/// std::runtime_error naming contender, key, value and range.
ComparisonPlan plan_comparison(const ComparisonOptions& options);

/// Solves and compares. Views: hemisphere_views(), or, where an image takes part, the pixels of the
/// first image above the horizon. A contender that is undefined under a Sun has a row that says so;
/// where the first is undefined the others have no errors. Throws Cancelled when told to stop.
Comparison compare_skies(const ComparisonPlan& plan, const RunControl& control);

/// CIE 1976 u', v' of X, Y, Z (CIE 15:2004, eq. 8.3: 4X/(X + 15Y + 3Z), 9Y/(...)). The sum is > 0.
std::array<double, 2> ucs_chromaticity(const Tristimulus& xyz);

}  // namespace twilight
