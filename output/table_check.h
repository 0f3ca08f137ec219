// How well a sky read from tables agrees with the one they were filled from.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "output/csv_table.h"
#include "output/hillaire2020_layout.h"
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
  /// Of any reader: radiance of a view (index of hemisphere_views()) under a Sun (index).
  using Reader = std::function<ChannelTriple(std::size_t sun, std::size_t view)>;
  std::vector<TableError> errors(const std::string& name, const Reader& reader) const;

 private:
  double altitude_km_;
  std::vector<double> suns_deg_;
  std::vector<std::vector<ChannelTriple>> light_;  // [sun][view]
};

/// The slices of r about the observer.
std::vector<std::size_t> slices_about(const TableLayout& layout, double altitude_km);

/// The same of Hillaire's sky views, at their own Suns.
std::vector<TableError> sky_view_errors(const TableSource& source, const Hillaire2020Layout& layout,
                                        const HillaireTables& tables, const std::string& name,
                                        bool half);

CsvTable error_table(const std::vector<TableError>& errors);

}  // namespace twilight
