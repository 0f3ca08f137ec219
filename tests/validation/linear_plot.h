// Line plots over linear axes, and chromaticity diagrams, as SVG.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace twilight::validation {

struct LinearSeries {
  std::string label;
  std::vector<std::pair<double, double>> points = {};   ///< x, y
  std::vector<std::pair<int, std::string>> marks = {};  ///< index of a point, text beside its dot
  bool dashed = false;
  bool dots = false;        ///< marks without a line
  std::string colour = {};  ///< of the line, "#rrggbb"; empty: the next of a palette
};

struct LinearAxis {
  std::string label;
  double first = 0, last = 1;  ///< first < last
  double step = 1;             ///< of the grid lines, > 0
};

/// Writes a plot of series over two linear axes; what lies outside is cut off. Throws
/// std::runtime_error where the file cannot be written.
void write_linear_plot(const std::filesystem::path& file, const std::string& title,
                       const LinearAxis& x, const LinearAxis& y,
                       const std::vector<LinearSeries>& series);

}  // namespace twilight::validation
