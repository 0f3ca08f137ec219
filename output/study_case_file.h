// The file of one case of a study: its quantities, what they depend on, and a fingerprint.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "output/study_results.h"

namespace twilight {

/// A case that is done.
struct CaseResult {
  std::string hash;     ///< of `inputs` (fnv1a128)
  std::string inputs;   ///< case_inputs(): the scene as TOML, and what is wanted
  std::string picture;  ///< name of the PNG beside it; empty: none
  std::string exr;      ///< name of the EXR beside it; empty: none
  std::string clamps;   ///< what a published model was asked outside its range; empty: nothing
  std::vector<StudyQuantity> quantities;
};

/// FOLDER/HASH.nc, FOLDER/HASH.png, FOLDER/HASH.exr, FOLDER/HASH.error.
std::filesystem::path case_file(const std::filesystem::path& folder, const std::string& hash);
std::filesystem::path case_picture_file(const std::filesystem::path& folder,
                                        const std::string& hash);
std::filesystem::path case_exr_file(const std::filesystem::path& folder, const std::string& hash);
std::filesystem::path case_error_file(const std::filesystem::path& folder, const std::string& hash);

/// Writes a case as netCDF (CF-1.10), whole or not at all; `coordinates` of its quantities. The
/// bytes depend on the arguments alone. Not to be called from two threads at once (the netCDF
/// library). Throws std::runtime_error naming the file.
void write_case(const std::filesystem::path& folder, const CaseResult& result,
                const std::vector<StudyCoordinate>& coordinates);

/// The case of a hash, or nothing where there is no file of it, it is damaged (its
/// bytes do not have the fingerprint they were written with), or its picture or EXR is missing.
std::optional<CaseResult> read_case(const std::filesystem::path& folder, const std::string& hash);

/// Why a case failed, or nothing where it did not.
std::optional<std::string> read_case_error(const std::filesystem::path& folder,
                                           const std::string& hash);

}  // namespace twilight
