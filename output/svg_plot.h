// Plots of points and lines as SVG.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace twilight {

/// Points that share a colour, joined by a line or drawn as dots. All texts of a plot may hold
/// XML entities ("&#176;") and must otherwise be free of "<" and "&".
struct PlotSeries {
  std::string label;                                    ///< in the legend; empty: not there
  std::vector<std::pair<double, double>> points = {};   ///< x, y
  std::vector<std::pair<int, std::string>> marks = {};  ///< index of a point, text beside its dot
  bool dashed = false;
  bool dots = false;        ///< marks without a line
  std::string colour = {};  ///< of the line, "#rrggbb"; empty: the next of a palette
  bool hollow = false;      ///< dots as rings
  /// Shown where the pointer rests on a dot; one per point, or none.
  std::vector<std::string> tooltips = {};
  /// Texts that find no free place are left out; false: put where they hide least.
  bool optional_marks = false;
};

struct PlotAxis {
  std::string label;
  std::optional<double> first = {}, last = {};  ///< unset: as the points need
  double step = 0;                              ///< of the grid lines where linear; 0: a round one
  bool logarithmic = false;                     ///< values that are not above 0 are left out
};

/// One pair of axes. What lies outside them is cut off.
struct PlotPanel {
  std::string title;
  PlotAxis x, y;
  std::vector<PlotSeries> series;
};

/// The palette that series take their colours from, over and over: "#rrggbb".
std::string series_colour(std::size_t index);

/// Panels in rows of `columns` (>= 1) under one title, as the text of an SVG file; each 760 x 520
/// pixels. Texts beside points are moved apart: each takes the first of sixteen places about its
/// dot that hides no dot and no text. Points that are not finite are left out and break their line.
/// Throws std::invalid_argument where there is no panel or a mark names no point.
std::string svg_plot(const std::string& title, const std::vector<PlotPanel>& panels, int columns);

/// The plot as a file that appears whole or not at all; the first form of one pair of axes. Throws
/// as svg_plot, and std::runtime_error naming the file where it cannot be written.
void write_svg_plot(const std::filesystem::path& file, const std::string& title, const PlotAxis& x,
                    const PlotAxis& y, const std::vector<PlotSeries>& series);
void write_svg_plot(const std::filesystem::path& file, const std::string& title,
                    const std::vector<PlotPanel>& panels, int columns);

}  // namespace twilight
