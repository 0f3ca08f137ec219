// Small line plots as SVG.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace twilight::validation {

struct SvgSeries {
  std::string label;
  std::vector<std::pair<double, double>> points;  ///< x, y
  bool dots = false;                              ///< marks without a line
};

/// Writes a plot of series over a linear x and a logarithmic y axis. Values of y that are not
/// above 0 are left out. Throws std::runtime_error where the file cannot be written.
void write_svg_plot(const std::filesystem::path& file, const std::string& title,
                    const std::string& x_label, const std::string& y_label,
                    const std::vector<SvgSeries>& series);

}  // namespace twilight::validation
