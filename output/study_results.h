// What the cases of a study give: quantities, their coordinates, and the table a report is made of.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "output/netcdf_writer.h"

namespace twilight {

/// A quantity of one case: numbers on named dimensions, beside the axes of the study.
struct StudyQuantity {
  std::string name;  ///< of the netCDF variable, "illuminance"
  NetcdfMeaning meaning;
  /// Slowest first, names of StudyCoordinate: "wavelength", "view", "band", "y", "x", "channel";
  /// empty: a single number.
  std::vector<std::string> dimensions;
  std::vector<double> values;     ///< row-major; NaN where undefined (no twilight that long)
  bool single_precision = false;  ///< stored as float: textures
};

/// A coordinate that quantities share: numbers, or words (bands, channels).
struct StudyCoordinate {
  std::string name;
  NetcdfMeaning meaning;
  std::vector<double> values;
  std::vector<std::string> words;  ///< in place of values

  std::size_t size() const { return words.empty() ? values.size() : words.size(); }
};

/// A column of the study's table: an axis or a single number of a quantity, one entry per case.
struct StudyColumn {
  std::string name;  ///< "sun.elevation_deg"; "radiance[view 2, 550 nm]"
  std::string unit;
  std::vector<double> values;      ///< NaN where a case failed or has none
  std::vector<std::string> words;  ///< in place of values
};

/// The study as a table: small whatever the size of its textures.
struct StudyTable {
  std::string title;
  std::vector<StudyColumn> axes;
  /// Crossed axes: sizes in the order of `axes`, the last fastest. Empty: cases in a list (zipped
  /// axes, Latin hypercube), each with its own values.
  std::vector<std::size_t> crossed_sizes;
  std::vector<StudyColumn> quantities;
  std::vector<std::string> pictures;  ///< per case, PNG relative to the study's folder; "" none
  std::vector<std::string> errors;    ///< per case; "" where it is done

  std::size_t cases() const { return errors.size(); }
};

}  // namespace twilight
