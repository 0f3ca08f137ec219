// A comparison of skies as a table and as pictures.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "output/csv_table.h"
#include "output/sky_comparison.h"

namespace twilight {

/// One row per Sun and contender; empty cells where there is nothing to say. Columns are the
/// members of ComparisonRow and SkyErrors with their units.
CsvTable comparison_table(const Comparison& comparison);

/// The table in short, for a terminal or a README: GitHub's Markdown, one line per contender, a
/// column per Sun: mean relative error of the luminance in per cent, and the zenith's ratio.
std::string comparison_markdown(const Comparison& comparison);

/// Ratio to the first contender that is full colour in the pictures.
inline constexpr double kFullErrorRatio = 4.0;

/// The skies of one Sun side by side above their errors (ratio of luminances, false_colour.h), as
/// sRGB pixels [y][x][3]; all skies at one exposure. Contenders without a picture are grey.
struct ComparisonPicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};
ComparisonPicture comparison_picture(const Comparison& comparison, std::size_t first_row);

/// Writes DIR/comparison.csv, DIR/sun_+05.0.png for every Sun and DIR/comparison.svg, all pictures
/// with names and scale on one sheet; each file whole or not at all. Returns their names. Throws
/// std::runtime_error naming a file that cannot be written.
std::vector<std::string> write_comparison(const Comparison& comparison);

}  // namespace twilight
