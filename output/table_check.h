// How well a sky read from tables agrees with the one they were filled from.
#pragma once

#include <string>
#include <vector>

#include "output/csv_table.h"
#include "output/sky_tables.h"

namespace twilight {

/// Relative error of the radiance at hemisphere_views(), three channels each, from the scene's
/// observer.
struct TableError {
  std::string tables;  ///< "x1", "x1 half", ...
  double sun_elevation_deg = 0.0;
  double mean = 0.0, p95 = 0.0, largest = 0.0;
  double bias = 0.0;  ///< mean error with its sign
};

/// Radiances straight from the solver, to compare tables with.
class TableTruth {
 public:
  /// sun_elevation_deg: geometric, -90..90.
  TableTruth(const TableSource& source, std::vector<double> sun_elevation_deg);

  /// Errors of the tables, one row per Sun. name: of the rows.
  std::vector<TableError> errors(const std::string& name, const TableLayout& layout,
                                 const SkyTables& tables, bool half) const;
  const std::vector<double>& sun_elevation_deg() const { return suns_deg_; }

 private:
  double altitude_km_;
  std::vector<double> suns_deg_;
  std::vector<std::vector<ChannelTriple>> light_;  // [sun][view]
};

/// The slices of r about the observer.
std::vector<std::size_t> slices_about(const TableLayout& layout, double altitude_km);

CsvTable error_table(const std::vector<TableError>& errors);

}  // namespace twilight
