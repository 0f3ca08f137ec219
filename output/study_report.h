// A study to look at: plots and a page of pictures.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "output/sky_quantities.h"
#include "output/study_results.h"

namespace twilight {

/// Writes DIR/plots/*.svg and DIR/index.html: the plots that were wanted (every single-number
/// quantity against every axis that is a number where none were), the pictures in a grid by the
/// axes, the failed cases with their errors. No script, links relative to DIR, each file whole or
/// not at all. Returns the names written, relative to DIR, "index.html" last. The page links to
/// "study.nc" and "study.csv", which are the caller's.
/// Throws std::invalid_argument "key 'outputs.plots' = ...: must be ..." for a plot of columns that
/// the table does not have, std::runtime_error naming the file where writing fails.
std::vector<std::string> write_study_report(const std::filesystem::path& directory,
                                            const StudyTable& table,
                                            const WantedQuantities& wanted);

}  // namespace twilight
