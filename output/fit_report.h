// How good a fit is, for reading.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "output/csv_table.h"
#include "output/sky_fit.h"

namespace twilight {

/// One row per node and channel, and per node one of channel "luminance" for spectral fits: the
/// axes' values, relative errors (rms, p95, largest, bias), convergence, iterations, the largest
/// component of the projected gradient, bounds that were hit.
CsvTable fit_goodness_table(const SkyFit& fit);

/// Label and figure of what a fit comes to: nodes, rms over all, the worst node, how many searches
/// hit bounds and how many did not converge.
std::vector<std::pair<std::string, std::string>> fit_figures(const SkyFit& fit);

}  // namespace twilight
