// A retrieval as files and for people.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "output/air_retrieval.h"
#include "output/csv_table.h"

namespace twilight {

/// One row per parameter: value, standard error, 95 % interval, whether it is claimed, and why not.
CsvTable parameter_table(const Retrieval& retrieval);

/// One row per datum: Sun, view (of a block the mean), response, measured, error, predicted,
/// residual over error, and the line or block that it comes from.
CsvTable residual_table(const Measurement& measured, const Retrieval& retrieval);

/// Everything as JSON: parameters, covariance and correlation (null where there is none), singular
/// values, chi squared, starts.
std::string retrieval_json(const RetrievalPlan& plan, const Retrieval& retrieval);

/// Lines for people: chi squared, starts, grids, what trades off with what.
std::vector<std::pair<std::string, std::string>> retrieval_figures(const RetrievalPlan& plan,
                                                                   const Retrieval& retrieval);

/// Writes retrieval.json, residuals.csv, residuals.svg, retrieved.toml (the scene with the best
/// values) and, of a photograph, residuals_CHANNEL.png (ratio of predicted to measured, red and
/// blue at 1.25 to either side) into the folder, which is made; all of them or none. Returns their
/// names. Throws std::runtime_error naming a file that cannot be written.
std::vector<std::string> write_retrieval(const RetrievalPlan& plan, const Retrieval& retrieval);

}  // namespace twilight
