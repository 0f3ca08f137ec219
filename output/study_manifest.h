// What a study's folder is of: its axes, its cases by name, its [outputs].
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "output/study_plan.h"

namespace twilight {

/// A plan as other processes find it in the folder: enough to put the cases together.
struct StudyManifest {
  std::string title;  ///< name of the study file without its ending
  std::string scene;  ///< scene_inputs() of the study's scene
  Study study;        ///< axes and dimensions alone
  std::vector<StudyCoordinate> coordinates;
  std::vector<std::string> hashes;  ///< of the cases
  WantedQuantities wanted;
};

/// DIR/cases, where every case has its files.
std::filesystem::path cases_folder(const std::filesystem::path& directory);

/// remove_stale_temporaries() of DIR and the folders in it.
void clean_study_folder(const std::filesystem::path& directory);

StudyManifest manifest_of(const StudyPlan& plan);

/// Writes DIR/study.json and DIR/cases/study.toml, a copy of the study file, from which [outputs]
/// is read again. Their bytes depend on the study alone. Throws as AtomicFile.
void write_manifest(const std::filesystem::path& directory, const StudyPlan& plan);

/// The same of a study that another folder is of.
void copy_manifest(const std::filesystem::path& from, const std::filesystem::path& directory);

/// Throws std::runtime_error naming the file where there is none or it is damaged.
StudyManifest read_manifest(const std::filesystem::path& directory);

}  // namespace twilight
