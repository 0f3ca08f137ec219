// A film of the sky: numbers, one solve, what survives a kill, and what is noticed.
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "output/exr_reader.h"
#include "tests/cli/program_run.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

// Coarse enough for a frame to take a fraction of a second.
constexpr const char* kAir = R"([atmosphere]
layers = 16
[aerosols]
type = "none"
[spectrum]
wavelengths_nm = [440, 550, 660]
[solver]
method = "orders"
altitude_levels = 8
zenith_step_deg = 3
polar_directions = 8
azimuth_directions = 4
view_interpolation = false
[output]
size = 16
)";
const std::string kElevationScene = std::string("[sun]\nelevation_deg = 0\n") + kAir;
const std::string kPlaceScene = std::string(
                                    "[observer]\nlatitude_deg = 49.25\nlongitude_deg = 6.97\n"
                                    "time = 2003-12-08T17:00:00+01:00\n") +
                                kAir;
// A published model: its skies cost nothing.
const std::string kPreethamScene =
    "[sun]\nelevation_deg = 20\n[solver]\nmethod = \"preetham\"\n"
    "[output]\nsize = 8\n";

std::vector<std::string> sequence_of(const std::string& from, const std::string& to, int frames,
                                     const std::string& folder) {
  return {"sequence", "scene.toml",           "--from", from,  "--to", to,
          "--frames", std::to_string(frames), "-o",     folder};
}
const std::vector<std::string> kSunset = sequence_of("5", "-12", 5, "out");
const std::vector<std::string> kNoVideo = {"--no-video"};

std::map<std::string, std::string> files_in(const Workplace& place, const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(place.path(folder))) {
    const std::string name = entry.path().filename().string();
    files[name] = place.read(folder + "/" + name);
  }
  return files;
}

std::set<std::string> names_of(const std::map<std::string, std::string>& files) {
  std::set<std::string> names;
  for (const auto& [name, bytes] : files) names.insert(name);
  return names;
}

std::size_t count_of(const std::string& what, const std::string& text) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++count;
  return count;
}

double largest_relative_difference(const SkyImage& a, const SkyImage& b) {
  double largest = 0;
  EXPECT_EQ(a.pixels.size(), b.pixels.size());
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    if (b.pixels[i] == 0.0f && a.pixels[i] == 0.0f) continue;
    largest = std::max(largest, std::abs(static_cast<double>(a.pixels[i] / b.pixels[i]) - 1.0));
  }
  return largest;
}

bool has_ffmpeg() { return std::system("ffmpeg -version >/dev/null 2>&1") == 0; }

TEST(CliSequence, NumbersFramesAndSolvesOnce) {
  const Workplace place;
  place.write("scene.toml", kElevationScene);
  const Finished done = place.run(with(kSunset, kNoVideo));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  std::set<std::string> names = {"sequence.json"};
  for (int k = 1; k <= 5; ++k) {
    names.insert("frame_000" + std::to_string(k) + ".exr");
    names.insert("frame_000" + std::to_string(k) + ".png");
  }
  EXPECT_EQ(names_of(files_in(place, "out")), names);
  EXPECT_EQ(count_of("orders ...", done.err), 1u) << done.err;
  EXPECT_NE(done.err.find("5 made, 0 kept"), std::string::npos) << done.err;
  const auto manifest = nlohmann::json::parse(place.read("out/sequence.json"));
  ASSERT_EQ(manifest.at("frames").size(), 5u);
  for (int k = 0; k < 5; ++k) {
    const auto& frame = manifest.at("frames")[static_cast<std::size_t>(k)];
    EXPECT_DOUBLE_EQ(frame.at("sun_elevation_deg").get<double>(), 5 - 4.25 * k);
    EXPECT_GT(frame.at("grey_luminance_cd_m2").get<double>(), 0);
  }
}

// One solve, many Suns: the pixels of `twilight render` under the same Sun, every bit.
TEST(CliSequence, FramesAreTheSkiesThatRenderMakes) {
  const Workplace place;
  place.write("scene.toml", kElevationScene);
  ASSERT_EQ(place.run(with(kSunset, kNoVideo)).exit_code, 0);
  for (const auto& [frame, sun] : {std::pair("2", "0.75"), std::pair("5", "-12")}) {
    const Finished render =
        place.run({"render", "scene.toml", "--set", std::string("sun.elevation_deg=") + sun});
    ASSERT_EQ(render.exit_code, 0) << render.err;
    const SkyImage own = read_exr_map(place.path("sky.exr")).image;
    const std::string name = std::string("out/frame_000") + frame + ".exr";
    EXPECT_EQ(read_exr_map(place.path(name)).image.pixels, own.pixels) << name;
  }
}

// With a place the Earth's radius is the middle frame's. With that radius a frame is render's but
// for the distance of the Sun, which scales it (1e-6 in an hour, beyond that float rounding and the
// apparent size of the disc); with its own radius it differs by what the README states.
TEST(CliSequence, FramesOfAnEveningAreRendersToTheStatedBound) {
  const Workplace place;
  place.write("scene.toml", kPlaceScene);
  const Finished done = place.run(with(
      sequence_of("2003-12-08T16:10:00+01:00", "2003-12-08T17:40:00+01:00", 4, "out"), kNoVideo));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const auto manifest = nlohmann::json::parse(place.read("out/sequence.json"));
  const std::string radius = manifest.at("earth_radius_km").dump();
  for (const std::size_t k : {std::size_t{0}, std::size_t{3}}) {
    const std::string time = manifest.at("frames")[k].at("time");
    const SkyImage frame =
        read_exr_map(place.path("out/frame_000" + std::to_string(k + 1) + ".exr")).image;
    const std::vector<std::string> render = {"render", "scene.toml", "--set",
                                             "observer.time=" + time};
    ASSERT_EQ(place.run(with(render, {"--set", "earth.radius_km=" + radius})).exit_code, 0);
    EXPECT_LT(largest_relative_difference(frame, read_exr_map(place.path("sky.exr")).image), 1e-5);
    ASSERT_EQ(place.run(render).exit_code, 0);
    EXPECT_LT(largest_relative_difference(frame, read_exr_map(place.path("sky.exr")).image), 0.005);
  }
}

TEST(CliSequence, KilledAndResumedHasTheSameBytes) {
  const Workplace place;
  place.write("scene.toml", kElevationScene);
  std::vector<std::string> whole = kSunset;
  whole.back() = "whole";
  ASSERT_EQ(place.run(with(whole, {"--no-video", "--threads", "1"})).exit_code, 0);
  for (const char* stage : {"orders", "frames ...", "exposure", "pictures"}) {
    place.run_and_signal(with(kSunset, kNoVideo), SIGKILL, stage);
    // Whatever stands there under its own name is whole.
    if (!fs::exists(place.path("out"))) continue;
    for (const auto& [name, bytes] : files_in(place, "out")) {
      if (name.starts_with("frame_") && name.ends_with(".exr")) {
        EXPECT_EQ(bytes, place.read("whole/" + name)) << stage << " " << name;
      }
    }
  }
  const Finished last = place.run(with(kSunset, kNoVideo));
  ASSERT_EQ(last.exit_code, 0) << last.err;
  EXPECT_EQ(files_in(place, "out"), files_in(place, "whole"));
  EXPECT_NE(last.err.find("kept"), std::string::npos);
}

TEST(CliSequence, KeepsWhatIsThereAndMakesWhatIsDamaged) {
  const Workplace place;
  place.write("scene.toml", kElevationScene);
  ASSERT_EQ(place.run(with(kSunset, kNoVideo)).exit_code, 0);
  const auto first = files_in(place, "out");
  const Finished again = place.run(with(kSunset, kNoVideo));
  EXPECT_NE(again.err.find("0 made, 5 kept"), std::string::npos) << again.err;
  EXPECT_EQ(count_of("orders ...", again.err), 0u) << again.err;
  EXPECT_EQ(files_in(place, "out"), first);

  fs::resize_file(place.path("out/frame_0002.exr"), first.at("frame_0002.exr").size() / 2);
  fs::remove(place.path("out/frame_0004.exr"));
  const Finished repaired = place.run(with(kSunset, kNoVideo));
  EXPECT_NE(repaired.err.find("2 made, 3 kept"), std::string::npos) << repaired.err;
  EXPECT_EQ(files_in(place, "out"), first);

  // Exposure is of the pictures alone.
  const Finished exposed = place.run(with(kSunset, {"--no-video", "--exposure", "9"}));
  EXPECT_NE(exposed.err.find("0 made, 5 kept"), std::string::npos) << exposed.err;
  EXPECT_NE(place.read("out/frame_0005.png"), first.at("frame_0005.png"));
}

TEST(CliSequence, AChangedSceneIsMadeAnew) {
  const Workplace place;
  place.write("scene.toml", kElevationScene);
  ASSERT_EQ(place.run(with(kSunset, kNoVideo)).exit_code, 0);
  const auto before = files_in(place, "out");
  const std::vector<std::string> darker = {"--no-video", "--set", "earth.ground_albedo=0.5"};
  const Finished changed = place.run(with(kSunset, darker));
  EXPECT_NE(changed.err.find("5 made, 0 kept"), std::string::npos) << changed.err;
  for (const auto& [name, bytes] : files_in(place, "out")) {
    if (!name.ends_with(".exr")) continue;
    EXPECT_NE(bytes, before.at(name)) << name;
  }
  // Threads are no input.
  const Finished threads = place.run(with(kSunset, with(darker, {"--threads", "1"})));
  EXPECT_NE(threads.err.find("0 made, 5 kept"), std::string::npos) << threads.err;
  // Another number of frames keeps those whose Sun and number stay, and says what is left over.
  const Finished fewer = place.run(with(sequence_of("5", "0.75", 2, "out"), darker));
  EXPECT_NE(fewer.err.find("0 made, 2 kept"), std::string::npos) << fewer.err;
  EXPECT_NE(fewer.err.find("6 files of frames that are not of this sequence"), std::string::npos)
      << fewer.err;
}

TEST(CliSequence, TheBytesOfAFileThatTheSceneNamesCount) {
  const Workplace place;
  std::ifstream stream(std::string(TWILIGHT_CONFIGS) + "/optical_layers.csv");
  const std::string layers{std::istreambuf_iterator<char>(stream), {}};
  place.write("layers.csv", layers);
  place.write("scene.toml", R"([sun]
elevation_deg = 0
[atmosphere]
optical_layers = "layers.csv"
[solver]
method = "orders"
altitude_levels = 8
zenith_step_deg = 3
polar_directions = 8
azimuth_directions = 4
view_interpolation = false
[output]
size = 8
)");
  const auto two = with(sequence_of("5", "-1", 2, "out"), kNoVideo);
  const Finished first = place.run(two);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_NE(place.run(two).err.find("0 made, 2 kept"), std::string::npos);
  place.write("layers.csv", "# other words\n" + layers);
  EXPECT_NE(place.run(two).err.find("2 made, 0 kept"), std::string::npos);
}

TEST(CliSequence, StopsCleanly) {
  const Workplace place;
  place.write("scene.toml", kElevationScene);
  const Finished stopped = place.run_and_signal(with(kSunset, kNoVideo), SIGINT, "orders");
  EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
  EXPECT_NE(stopped.err.find("frames that are done are kept"), std::string::npos) << stopped.err;
  for (const auto& [name, bytes] : files_in(place, "out")) EXPECT_TRUE(name.starts_with("frame_"));
}

TEST(CliSequence, MethodsWithoutSharedWorkSayThatTheySolveAnew) {
  const Workplace place;
  place.write("scene.toml", kPreethamScene);
  const Finished done = place.run(with(sequence_of("30", "10", 3, "out"), kNoVideo));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(count_of("each frame is solved anew", done.err), 1u) << done.err;
  ASSERT_EQ(place.run({"render", "scene.toml"}).exit_code, 0);
  EXPECT_EQ(read_exr_map(place.path("out/frame_0002.exr")).image.pixels,
            read_exr_map(place.path("sky.exr")).image.pixels);
}

TEST(CliSequence, RefusesBadInputBeforeAnyWork) {
  const Workplace place;
  place.write("scene.toml", kElevationScene);
  const auto refused = [&](const std::vector<std::string>& arguments,
                           const std::vector<std::string>& fragments) {
    expect_refused(place.run(arguments), fragments);
    EXPECT_EQ(place.names(), (std::set<std::string>{"scene.toml"}));
  };
  refused(sequence_of("5", "-12", 1, "out"), {"scene.toml", "--frames 1", "2..100000"});
  refused(sequence_of("5", "5", 4, "out"), {"--to 5", "differ"});
  refused(sequence_of("5", "-100", 4, "out"), {"--to -100", "-90..90"});
  refused(sequence_of("2003-12-08T17:00:00Z", "5", 4, "out"), {"--from 2003", "no place"});
  refused(with(kSunset, {"--exposure", "bright"}), {"--exposure bright", "auto", "-40..40"});
  refused(with(kSunset, {"--field", "f.nc", "--set", "solver.method=cells"}),
          {"solver.method", "must be \"orders\" for --field"});
  place.write("scene.toml", kPlaceScene);
  refused(kSunset, {"--from 5", "names a place"});
  refused(sequence_of("2003-12-08T17:00:00", "2003-12-08T18:00:00Z", 4, "out"), {"--from"});
  EXPECT_EQ(place.run(with(kSunset, {"--fps", "0"})).exit_code, 2);
  EXPECT_EQ(place.run(with(kSunset, {"--webm", "--no-video"})).exit_code, 2);
  place.write("out", "a file where the folder should be");
  EXPECT_EQ(
      place.run(sequence_of("2003-12-08T17:00:00Z", "2003-12-08T18:00:00Z", 4, "out")).exit_code,
      2);
}

TEST(CliSequence, MakesAFilmWhereThereIsFfmpeg) {
  if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
  const Workplace place;
  place.write("scene.toml", kPreethamScene);
  // 9 x 9 pixels: H.264 in 4:2:0 wants even sides.
  const auto film = with(sequence_of("30", "10", 3, "out"), {"--set", "output.size=9"});
  const Finished done = place.run(film);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(place.read("out/sequence.mp4").substr(4, 4), "ftyp") << done.err;
  const Finished webm = place.run(with(film, {"--webm"}));
  ASSERT_EQ(webm.exit_code, 0) << webm.err;
  EXPECT_EQ(place.read("out/sequence.webm").substr(0, 4), "\x1a\x45\xdf\xa3") << webm.err;
  for (const auto& [name, bytes] : files_in(place, "out")) EXPECT_FALSE(name.starts_with("."));
}

// The frames are the product: without a film the run is no failure.
TEST(CliSequence, WithoutFfmpegItSaysSo) {
  const Workplace place;
  place.write("scene.toml", kPreethamScene);
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", place.path("").c_str(), 1);
  const Finished done = place.run(sequence_of("30", "10", 3, "out"));
  // One that fails.
  place.write("ffmpeg", "#!/bin/sh\necho 'no such thing' >&2\nexit 7\n");
  fs::permissions(place.path("ffmpeg"), fs::perms::owner_all);
  const Finished failed = place.run(sequence_of("30", "10", 3, "out"));
  // One that says it is done and is not.
  place.write("ffmpeg", "#!/bin/sh\nexit 0\n");
  const Finished empty = place.run(sequence_of("30", "10", 3, "out"));
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_NE(done.err.find("warning: there is no ffmpeg: sequence.mp4 is not made"),
            std::string::npos)
      << done.err;
  EXPECT_EQ(failed.exit_code, 0) << failed.err;
  EXPECT_NE(failed.err.find("warning: ffmpeg has failed (no such thing)"), std::string::npos)
      << failed.err;
  EXPECT_EQ(empty.exit_code, 0) << empty.err;
  EXPECT_NE(empty.err.find("warning: ffmpeg has written nothing"), std::string::npos) << empty.err;
  EXPECT_FALSE(fs::exists(place.path("out/sequence.mp4")));
  EXPECT_TRUE(fs::exists(place.path("out/sequence.json")));
}

}  // namespace
}  // namespace twilight
