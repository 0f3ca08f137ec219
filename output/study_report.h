// A study to look at: plots and a page of pictures.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "output/study_results.h"
#include "output/wanted_quantities.h"

namespace twilight {

/// Writes DIR/plots/*.svg (study_plots.h) and DIR/index.html: the pictures in a grid (the last axis
/// across, the others down; as they come where axes are not crossed), the plots, the failed cases
/// with their errors. The page needs no script and no network; its links are relative to DIR, among
/// them "study.nc" and "study.csv", which are the caller's. Each file appears whole or not at all;
/// the same bytes of the same table. Returns the names written, relative to DIR, "index.html" last.
/// Throws std::runtime_error (or filesystem_error, which is one) naming the file where writing
/// fails.
std::vector<std::string> write_study_report(const std::filesystem::path& directory,
                                            const StudyTable& table,
                                            const WantedQuantities& wanted);

}  // namespace twilight
