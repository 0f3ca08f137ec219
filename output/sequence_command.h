// `twilight sequence`: a film of the sky, frame by frame.
#pragma once

#include <filesystem>
#include <string>

namespace twilight {

struct Run;

/// What the command line says of a sequence.
struct SequenceOptions {
  std::string from, to;  ///< times of a scene with a place, else elevations of the Sun, degrees
  int frames = 0;        ///< see output/sequence_instants.h
  std::filesystem::path directory;
  double frames_per_second = 25.0;  ///< of the film, 0.1..1000
  /// "auto" (follow_exposures), or a camera's exposure value at ISO 100, -40..40.
  std::string exposure = "auto";
  bool video = true;
  bool webm = false;  ///< VP9 in WebM, not H.264 in MP4
};

/// Makes the folder's frame_0001.exr and on, then from these all pictures, the film and, last of
/// all, sequence.json. Frames whose file is whole and of the same inputs are kept. Throws BadInput
/// for wrong options, Cancelled when stopped (what is done stays), and as the solvers.
void sequence(Run& run);

}  // namespace twilight
