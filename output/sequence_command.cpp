#include "output/sequence_command.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <signal.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "output/checksum.h"
#include "output/command_run.h"
#include "output/exr_reader.h"
#include "output/file_bytes.h"
#include "output/scene_colour.h"
#include "output/scene_fingerprint.h"
#include "output/scene_map.h"
#include "output/sequence_exposure.h"
#include "output/sequence_instants.h"
#include "output/sequence_video.h"
#include "output/sky_commands.h"
#include "output/sky_sequence.h"
#include "sim/solver_arena.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr const char* kInputs = "sequence.inputs";  // the frame's attribute
constexpr const char* kManifest = "sequence.json";

/// One frame as it is planned.
struct PlannedFrame {
  Scene scene;  // of its own instant, with the radius and the camera of all
  PlacedSun sun;
  std::string inputs;  // hash of what its map depends on
  fs::path exr, spectral, png;
};

/// All that is decided before any frame is made.
struct SequencePlan {
  std::vector<PlannedFrame> frames;
  int digits = 4;  // of a frame's number
  std::optional<double> exposure_value;
  bool spectral = false;
  SceneModel model;  // of the middle frame
};

std::string inputs_of(const Scene& scene, const SceneModel& shared, FileFingerprints& files) {
  return fnv1a64(fmt::format("twilight {}\n{} km {} au\n{}", kVersion,
                             shared.medium.earth_radius_km, shared.sun_distance_au,
                             settings_text(scene, files)));
}

std::optional<double> exposure_value(const std::string& text) {
  if (text == "auto") return std::nullopt;
  double ev = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), ev);
  if (error != std::errc{} || stop != text.data() + text.size() || !(ev >= -40.0 && ev <= 40.0)) {
    throw std::invalid_argument(
        fmt::format("--exposure {}: must be auto or an exposure value in -40..40", text));
  }
  return ev;
}

std::vector<Scene> scenes_of(const Run& run) {
  const SequenceOptions& options = run.line.sequence;
  try {
    return sequence_scenes(run.scene, options.from, options.to, options.frames);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(fmt::format("{}: {}", run.line.scene.string(), error.what()));
  }
}

// Settings, medium and frames. One solve has one radius and a film one camera: the middle frame's.
SequencePlan plan_sequence(Run& run) {
  const SequenceOptions& options = run.line.sequence;
  SequencePlan plan;
  checking_input([&] {
    plan.exposure_value = exposure_value(options.exposure);
    if (run.line.field && run.scene.solver.method != "orders") {
      throw std::invalid_argument(
          fmt::format("{}: key 'solver.method' = \"{}\": must be \"orders\" for --field",
                      run.line.scene.string(), run.scene.solver.method));
    }
    const std::vector<Scene> scenes = scenes_of(run);
    run.scene = scenes[scenes.size() / 2];
    fs::create_directories(options.directory);
    AtomicFile probe(options.directory / kManifest);
  });
  warn_of_missing_light(run);
  run.choose_settings();
  const auto width = map_width(map_projection(run.scene, 0.0), run.scene.output.size);
  run.foretell(static_cast<std::size_t>(run.scene.output.size) * static_cast<std::size_t>(width),
               static_cast<std::size_t>(options.frames));
  plan.model = run.model();
  if (run.scene.observer.time) run.scene.earth.radius_km = plan.model.medium.earth_radius_km;
  if (run.scene.output.projection == "camera" && !run.scene.camera.azimuth_deg) {
    run.scene.camera.azimuth_deg = plan.model.sun_azimuth_rad / kRadPerDeg;
  }
  plan.model.scene = run.scene;
  plan.spectral = run.scene.output.channels.ends_with("+spectral");

  const std::vector<Scene> scenes = scenes_of(run);
  plan.digits = std::max(4, static_cast<int>(std::to_string(scenes.size()).size()));
  FileFingerprints files;
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    const std::string stem = fmt::format("frame_{:0{}}", k + 1, plan.digits);
    PlannedFrame frame{scenes[k],
                       placed_sun(scenes[k]),
                       inputs_of(scenes[k], plan.model, files),
                       options.directory / (stem + ".exr"),
                       options.directory / (stem + ".spectral.exr"),
                       options.directory / (stem + ".png")};
    plan.frames.push_back(std::move(frame));
  }
  return plan;
}

// Temporary files of processes that are no more.
void remove_leftovers(const fs::path& directory) {
  std::vector<fs::path> leftovers;
  for (const auto& entry : fs::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string();
    const std::size_t mark = name.find(".tmp-");
    if (mark == std::string::npos) continue;
    if (!name.starts_with(".frame_") && !name.starts_with(".sequence.")) continue;
    const int process = std::atoi(name.c_str() + mark + 5);
    if (process > 0 && ::kill(process, 0) != 0 && errno == ESRCH) leftovers.push_back(entry.path());
  }
  std::error_code ignored;
  for (const fs::path& path : leftovers) fs::remove(path, ignored);
}

void remove_results(const fs::path& directory) {
  for (const char* name : {kManifest, "sequence.mp4", "sequence.webm"}) {
    fs::remove(directory / name);
  }
}

// Threads that work on frames of their own: as many as the solver's, but together their maps take
// no more than a fixed amount.
int frames_at_once(const SequencePlan& plan) {
  constexpr double kMapBytes = 1 << 30;
  const OutputOptions& output = plan.model.scene.output;
  const double pixels = static_cast<double>(output.size) *
                        map_width(map_projection(plan.model.scene, 0.0), output.size);
  const double channels =
      3.0 + (plan.spectral
                 ? 2.0 * static_cast<double>(plan.model.scene.spectrum.wavelengths_nm.size())
                 : 0.0);
  // Pixels, their copy in the writer, and luminances.
  const double bytes = pixels * (channels * 2.0 * sizeof(float) + sizeof(double));
  const int threads = SolverArena(plan.model.scene.solver.threads).arena.max_concurrency();
  return std::clamp(static_cast<int>(kMapBytes / bytes), 1, threads);
}

// Does something for every frame, some at a time; each leaves what it finds in its own place.
template <class Action>
void for_frames(const SequencePlan& plan, const char* stage, const RunControl& control,
                Action action) {
  std::atomic<std::size_t> done = 0;
  const std::size_t count = plan.frames.size();
  SolverArena arena(frames_at_once(plan));
  arena.arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t k) {
      control.check();
      action(k);
      control.report(stage, static_cast<double>(++done) / static_cast<double>(count));
    });
  });
}

// Indices of the frames that are not there yet.
std::vector<std::size_t> missing_frames(const SequencePlan& plan, const RunControl& control) {
  std::vector<char> kept(plan.frames.size(), 0);
  for_frames(plan, "frames that are there", control, [&](std::size_t k) {
    const PlannedFrame& frame = plan.frames[k];
    const auto holds = [&](const fs::path& path) {
      return text_of_whole_exr(path, kInputs) == frame.inputs;
    };
    kept[k] = holds(frame.exr) && (!plan.spectral || holds(frame.spectral)) ? 1 : 0;
  });
  std::vector<std::size_t> missing;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    if (kept[k] == 0) missing.push_back(k);
  }
  return missing;
}

// The middle frame's model under another frame's Sun.
SceneModel model_of(const SceneModel& shared, const PlannedFrame& frame) {
  SceneModel model = shared;
  model.scene = frame.scene;
  model.sun_elevation_rad = frame.sun.elevation_rad;
  model.sun_azimuth_rad = frame.sun.azimuth_rad;
  model.sun_distance_au = frame.sun.distance_au;
  return model;
}

SequenceFrame rendered_frame(const PlannedFrame& frame, double sky_distance_au) {
  const double ratio = sky_distance_au / frame.sun.distance_au;
  return {frame.sun.elevation_rad, frame.sun.azimuth_rad, frame.exr, frame.spectral, ratio * ratio};
}

// What all frames of a run share on their way to files.
struct FrameWriter {
  Run& run;
  const SequencePlan& plan;
  ColourIntegrator integrator;
  MapSettings settings;

  ImageAttributes attributes(const PlannedFrame& frame, const SceneModel& own,
                             const Sky& sky) const {
    ImageAttributes facts = image_attributes(run, own, sky);
    facts.emplace_back(kInputs, frame.inputs);
    return facts;
  }
};

// All frames from one solve, that of the middle frame even where it is there: what a frame is must
// not depend on which others are missing.
RunSummary make_from_one_solve(const FrameWriter& writer, const std::vector<std::size_t>& wanted) {
  Run& run = writer.run;
  const SceneModel& model = writer.plan.model;
  const std::unique_ptr<Sky> sky = run.timed("sky", [&] { return run.sky(model); });
  std::vector<SequenceFrame> frames;
  for (const std::size_t k : wanted) {
    frames.push_back(rendered_frame(writer.plan.frames[k], model.sun_distance_au));
  }
  const FrameAttributes attributes = [&](const SequenceFrame& frame, const Sky& lit) {
    const auto at = static_cast<std::size_t>(&frame - frames.data());
    const PlannedFrame& planned = writer.plan.frames[wanted[at]];
    return writer.attributes(planned, model_of(model, planned), lit);
  };
  run.timed("frames", [&] {
    SolverArena arena(frames_at_once(writer.plan));
    arena.arena.execute([&] {
      write_sky_sequence(*sky, writer.integrator, writer.settings, frames, attributes,
                         run.control());
    });
    return true;
  });
  return sky->summary();
}

// Every frame a solve of its own.
RunSummary make_one_by_one(const FrameWriter& writer, const std::vector<std::size_t>& wanted) {
  Run& run = writer.run;
  run.progress.clear();
  run.log.info("solver.method \"{}\" shares nothing between Suns: each frame is solved anew",
               run.scene.solver.method);
  RunControl quiet;
  quiet.cancel = run.control().cancel;
  return run.timed("frames", [&] {
    RunSummary summary;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const PlannedFrame& planned = writer.plan.frames[wanted[i]];
      run.control().report("frames", static_cast<double>(i) / static_cast<double>(wanted.size()));
      const SceneModel own = build_scene_model(planned.scene, &run.phases);
      const auto sky = solve_sky(own, quiet);
      write_sky_frame(
          *sky, writer.integrator, writer.settings,
          rendered_frame(planned, planned.sun.distance_au),
          [&](const SequenceFrame&, const Sky& seen) {
            return writer.attributes(planned, own, seen);
          },
          quiet);
      summary = sky->summary();
    }
    return summary;
  });
}

// The frames, and what the summary tells of their solve.
RunSummary make_frames(Run& run, const SequencePlan& plan, const std::vector<std::size_t>& wanted) {
  const auto observer = colour_observer_from_name(run.scene.output.colour_observer);
  const FrameWriter writer{run, plan, colour_integrator(plan.model, observer),
                           map_settings(plan.model)};
  return serves_every_sun(run.scene) ? make_from_one_solve(writer, wanted)
                                     : make_one_by_one(writer, wanted);
}

nlohmann::ordered_json manifest(const Run& run, const SequencePlan& plan,
                                const std::vector<ToneExposure>& exposures,
                                double white_luminance_cd_m2) {
  const SequenceOptions& options = run.line.sequence;
  nlohmann::ordered_json root;
  root["program"] = fmt::format("twilight {}", kVersion);
  root["scene"] = run.line.scene.filename().string();
  root["from"] = options.from;
  root["to"] = options.to;
  root["earth_radius_km"] = plan.model.medium.earth_radius_km;
  root["exposure"] = options.exposure;
  root["frames_per_second"] = options.frames_per_second;
  for (std::size_t k = 0; k < plan.frames.size(); ++k) {
    const PlannedFrame& frame = plan.frames[k];
    nlohmann::ordered_json entry;
    entry["exr"] = frame.exr.filename().string();
    if (plan.spectral) entry["spectral_exr"] = frame.spectral.filename().string();
    entry["png"] = frame.png.filename().string();
    if (frame.scene.observer.time) entry["time"] = *frame.scene.observer.time;
    entry["sun_elevation_deg"] = frame.sun.elevation_rad / kRadPerDeg;
    entry["sun_azimuth_deg"] = frame.sun.azimuth_rad / kRadPerDeg;
    entry["sun_distance_au"] = frame.sun.distance_au;
    entry["grey_luminance_cd_m2"] = exposures[k].grey * white_luminance_cd_m2;
    entry["white_luminance_cd_m2"] = exposures[k].white * white_luminance_cd_m2;
    entry["inputs_fnv1a64"] = frame.inputs;
    root["frames"].push_back(entry);
  }
  return root;
}

void warn_of_other_frames(const Run& run, const SequencePlan& plan) {
  std::size_t others = 0;
  for (const auto& entry : fs::directory_iterator(run.line.sequence.directory)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("frame_") || !(name.ends_with(".exr") || name.ends_with(".png")))
      continue;
    const auto is_it = [&](const PlannedFrame& f) {
      return name == f.exr.filename() || name == f.png.filename() ||
             (plan.spectral && name == f.spectral.filename());
    };
    // The name tells where the frame would be.
    const long number = std::atol(name.c_str() + 6);
    const bool planned = number >= 1 && number <= static_cast<long>(plan.frames.size()) &&
                         is_it(plan.frames[static_cast<std::size_t>(number - 1)]);
    if (!planned) ++others;
  }
  if (others == 0) return;
  run.log.warn("warning: {} holds {} files of frames that are not of this sequence",
               run.line.sequence.directory.string(), others);
}

// Pictures, film and manifest, all of them from the frames' files.
std::vector<std::string> make_pictures(Run& run, const SequencePlan& plan) {
  const SequenceOptions& options = run.line.sequence;
  std::vector<std::optional<ToneExposure>> own(plan.frames.size());
  double white_luminance_cd_m2 = 683.0;
  run.timed("exposure", [&] {
    for_frames(plan, "exposure", run.control(), [&](std::size_t k) {
      const StoredMap map = read_exr_map(plan.frames[k].exr);
      own[k] = sky_exposure(map.image);
      if (k == 0) white_luminance_cd_m2 = map.white_luminance_cd_m2;
    });
    return true;
  });
  const std::vector<ToneExposure> exposures =
      plan.exposure_value ? fixed_exposures(own, *plan.exposure_value, white_luminance_cd_m2)
                          : follow_exposures(own);
  const std::string text = manifest(run, plan, exposures, white_luminance_cd_m2).dump(1) + "\n";
  if (file_bytes(options.directory / kManifest) != text) remove_results(options.directory);
  run.timed("pictures", [&] {
    for_frames(plan, "pictures", run.control(), [&](std::size_t k) {
      write_preview_png(plan.frames[k].png, read_exr_map(plan.frames[k].exr).image,
                        {.exposure = exposures[k]});
    });
    return true;
  });
  std::vector<std::string> written;
  if (options.video) {
    VideoSettings video;
    video.folder = options.directory;
    video.pictures = fmt::format("frame_%0{}d.png", plan.digits);
    video.frames = static_cast<int>(plan.frames.size());
    video.frames_per_second = options.frames_per_second;
    video.file = options.webm ? "sequence.webm" : "sequence.mp4";
    run.control().report("film", 0.0);
    const auto complaint =
        run.timed("film", [&] { return write_video(video, run.control().cancel); });
    run.progress.clear();
    if (complaint) {
      run.log.warn("warning: {}", *complaint);
    } else {
      written.push_back(video.file);
    }
  }
  run.control().check();
  write_text_file(options.directory / kManifest, text);
  written.push_back(kManifest);
  return written;
}

}  // namespace

void sequence(Run& run) {
  const SequencePlan plan = plan_sequence(run);
  const fs::path& directory = run.line.sequence.directory;
  remove_leftovers(directory);
  warn_of_other_frames(run, plan);
  const std::vector<std::size_t> missing = missing_frames(plan, run.control());
  RunSummary summary;
  if (!missing.empty()) {
    remove_results(directory);
    summary = make_frames(run, plan, missing);
  }
  const std::vector<std::string> written = make_pictures(run, plan);
  run.summarise(
      summary,
      {{"frames",
        fmt::format("{} made, {} kept", missing.size(), plan.frames.size() - missing.size())},
       {"Earth's radius", fmt::format("{:.3f} km", plan.model.medium.earth_radius_km)},
       {"written to " + directory.string(),
        fmt::format("{} .. {}, {}", plan.frames.front().exr.filename().string(),
                    plan.frames.back().png.filename().string(), fmt::join(written, ", "))}});
}

}  // namespace twilight
