#include "output/sequence_video.h"

#include <fmt/format.h>

#include <vector>

#include "output/atomic_file.h"
#include "output/child_run.h"

namespace twilight {
namespace {

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

std::vector<std::string> codec(bool webm, bool has_x264) {
  if (webm) return {"-c:v", "libvpx-vp9", "-crf", "24", "-b:v", "0", "-f", "webm"};
  if (has_x264) {
    return {"-c:v", "libx264",   "-crf",       "16", "-preset",
            "slow", "-movflags", "+faststart", "-f", "mp4"};
  }
  return {"-c:v", "mpeg4", "-q:v", "2", "-movflags", "+faststart", "-f", "mp4"};
}

}  // namespace

std::optional<std::string> write_video(const VideoSettings& settings,
                                       const std::atomic<bool>* cancel) {
  const std::string name = "ffmpeg";
  const auto encoders =
      run_program(name, {"-hide_banner", "-loglevel", "error", "-encoders"}, {}, cancel);
  if (!encoders) return fmt::format("there is no ffmpeg: {} is not made", settings.file);
  const std::filesystem::path target = settings.folder / settings.file;
  const bool webm = target.extension() == ".webm";

  AtomicFile file(target);
  std::vector<std::string> arguments = {
      "-hide_banner",
      "-nostdin",
      "-loglevel",
      "error",
      "-y",
      "-framerate",
      fmt::format("{}", settings.frames_per_second),
      "-start_number",
      "1",
      "-i",
      settings.pictures,
      "-frames:v",
      fmt::format("{}", settings.frames),
      "-vf",
      "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p",
      "-colorspace",
      "bt709",
      "-color_primaries",
      "bt709",
      "-color_trc",
      "bt709",
      "-color_range",
      "tv",
      "-map_metadata",
      "-1",
      "-fflags",
      "+bitexact",
      "-flags:v",
      "+bitexact"};
  for (std::string& word : codec(webm, encoders->out.find(" libx264 ") != std::string::npos)) {
    arguments.push_back(std::move(word));
  }
  arguments.push_back("file:" + std::filesystem::absolute(file.temporary()).string());
  const auto run = run_program(name, arguments, settings.folder, cancel);
  if (!run) return fmt::format("there is no ffmpeg: {} is not made", settings.file);
  if (run->exit_code != 0) {
    return fmt::format(
        "ffmpeg has failed ({}): {} is not made",
        run->err.empty() ? fmt::format("exit code {}", run->exit_code) : first_line(run->err),
        settings.file);
  }
  std::error_code ignored;
  if (std::filesystem::file_size(file.temporary(), ignored) == 0) {
    return fmt::format("ffmpeg has written nothing: {} is not made", settings.file);
  }
  file.commit();
  return std::nullopt;
}

}  // namespace twilight
