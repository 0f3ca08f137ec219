// A study's numbers as plots.
#pragma once

#include <string>
#include <vector>

#include "output/study_results.h"
#include "output/wanted_quantities.h"

namespace twilight {

struct StudyPlot {
  std::string name;  ///< of its file without extension: letters, digits, "-", "_", "."
  std::string x, y;
  std::string svg;  ///< the file's text
};

/// Curves and panels of one plot; of more values those at even distances are shown, and its title
/// says so.
inline constexpr std::size_t kMostPlotCurves = 8, kMostPlotPanels = 6;

/// The plots that were wanted; where none were, every single number, those of the zenith's bands
/// ("zenith_magnitude[V]") and of the thresholds of twilight among them, against every axis of two
/// numbers or more, those left out that have nothing to show. Failed cases and NaNs leave gaps.
///
/// x on an axis of crossed ones: lines through the cases that differ in x alone, one for each value
/// of the series axis (if not said: an axis of words, else the one of fewest values), the other
/// axes in panels that share their y unless none of them would fill a quarter of it. Cases in a
/// list, or x a quantity: dots, coloured by the series axis. y a quantity of several numbers: a
/// curve of each, or a panel of each where the series is said. An axis is logarithmic where its
/// numbers are above 0 and span two decades, y also where some are 0, which are left out. An axis
/// that y does not change with (the end of twilight with the Sun) has one curve or panel.
///
/// A wanted plot of a column that the table does not have is not drawn (check_plots).
std::vector<StudyPlot> study_plots(const StudyTable& table, const WantedQuantities& wanted);

/// A value of an axis or quantity as text: a word, or 6 digits; empty for NaN.
std::string text_of(const StudyColumn& column, std::size_t row);

}  // namespace twilight
