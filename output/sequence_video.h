// A film of numbered pictures, made by ffmpeg.
#pragma once

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>

namespace twilight {

/// What the film is made of and its file.
struct VideoSettings {
  std::filesystem::path folder;  ///< of the pictures and the film
  std::string pictures;          ///< ffmpeg's pattern in it, as "frame_%04d.png", from 1 on
  int frames = 0;
  double frames_per_second = 25.0;
  std::string file;  ///< in the folder; ".mp4" (H.264, or MPEG-4 part 2 where ffmpeg has no
                     ///< libx264) or ".webm" (VP9)
};

/// Makes the film: 8 bit, 4:2:0, BT.709, sides padded to even numbers. It appears whole or not at
/// all; its bytes are those of the ffmpeg at hand. Returns nothing, or in one line why there is no
/// film: ffmpeg is missing or has failed. Throws Cancelled when stopped, std::runtime_error where
/// the folder cannot be written.
std::optional<std::string> write_video(const VideoSettings& settings,
                                       const std::atomic<bool>* cancel);

}  // namespace twilight
