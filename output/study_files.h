// A study's results put together: one netCDF file, one table, the report.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "output/study_manifest.h"
#include "sim/run_control.h"

namespace twilight {

/// What was put together.
struct AssembledStudy {
  std::size_t done = 0, failed = 0, missing = 0;
  std::vector<std::string> files;  ///< relative to the folder; empty: nothing was written
};

/// Which cases a folder lacks.
struct StudyState {
  std::size_t done = 0, failed = 0;
  std::vector<std::size_t> missing;  ///< increasing; never computed, or damaged
};
StudyState study_state(const std::filesystem::path& directory, const StudyManifest& manifest,
                       const RunControl& control = {});

/// Reads the files of the cases one after the other and writes
///   DIR/study.nc   CF-1.10: a dimension per axis (Study::dimensions) with its coordinate, and
///   every
///                  quantity on them and its own dimensions; NaN where a case failed or is missing
///   DIR/study.csv  a row per case: axes, numbers of quantities (no textures), what went wrong
/// and write_study_report()'s files, each whole or not at all, from the cases alone: the same bytes
/// whatever computed them, in whatever order. Memory does not grow with textures.
/// Throws std::runtime_error where no case is done, cases differ in their quantities, or a file
/// cannot be written; Cancelled when told to stop.
AssembledStudy assemble_study(const std::filesystem::path& directory, const StudyManifest& manifest,
                              const RunControl& control = {});

/// Names of the table's columns, axes first, as write_study_report() takes them, of a study whose
/// cases have these quantities. Throws std::runtime_error where the study does not know their
/// dimensions.
std::vector<std::string> table_columns(const StudyManifest& manifest,
                                       const std::vector<StudyQuantity>& quantities);

/// Copies into `directory` the files of cases that only others of these folders hold sound.
/// Throws std::runtime_error where a folder is of another study or a file cannot be written.
/// Returns how many were copied.
std::size_t gather_cases(const std::filesystem::path& directory,
                         const std::vector<std::filesystem::path>& others,
                         const StudyManifest& manifest, const RunControl& control = {});

}  // namespace twilight
