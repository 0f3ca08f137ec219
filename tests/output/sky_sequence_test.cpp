#include "output/sky_sequence.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <iterator>
#include <numbers>
#include <string>
#include <vector>

#include "output/exr_reader.h"
#include "sim/orders_sky.h"
#include "sim/scene_model.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

std::string bytes(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(SkySequence, FramesAreTheMapsOfTheirSuns) {
  Scene scene;
  scene.solver.method = "orders";
  scene.sun.elevation_deg = 0;
  scene.aerosols.type = "none";
  scene.atmosphere.layers = 20;
  scene.spectrum.wavelengths_nm = {450, 550, 650};
  scene.solver.altitude_levels = 12;
  scene.solver.zenith_step_deg = 3;
  scene.solver.polar_directions = 8;
  scene.solver.azimuth_directions = 4;
  const SceneModel model = build_scene_model(scene);
  const OrdersSky sky(model, {});
  const ColourIntegrator integrator(
      model.medium.wavelength_nm, [](double) { return 1.0; }, ColourObserver::kCie1931);
  const fs::path folder =
      fs::temp_directory_path() / ("twilight_frames_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  constexpr double kDegree = std::numbers::pi / 180;
  std::vector<SequenceFrame> frames;
  for (int k = 0; k < 3; ++k) {
    frames.push_back(
        {(2 - 3 * k) * kDegree, (250 + 7 * k) * kDegree, folder / (std::to_string(k) + ".exr")});
  }
  MapSettings settings;
  settings.size = 24;
  write_sky_sequence(sky, integrator, settings, frames);
  for (const SequenceFrame& frame : frames) {
    MapSettings own = settings;
    own.sun_azimuth_rad = frame.sun_azimuth_rad;
    const SkyMap map = render_map(*sky.under(frame.sun_elevation_rad), integrator, own);
    const fs::path again = folder / "again.exr";
    write_exr(again, map.colour, settings.projection,
              {{"sunElevation", frame.sun_elevation_rad * (180 / std::numbers::pi)},
               {"sunAzimuth", frame.sun_azimuth_rad * (180 / std::numbers::pi)}});
    EXPECT_FALSE(bytes(frame.file).empty());
    EXPECT_TRUE(bytes(frame.file) == bytes(again)) << frame.file;
  }
  // Under half the sunlight everything is half as bright.
  SequenceFrame half = frames[1];
  half.light = 0.5;
  half.file = folder / "half.exr";
  write_sky_frame(*sky.under(half.sun_elevation_rad), integrator, settings, half);
  const SkyImage whole = read_exr_map(frames[1].file).image, dim = read_exr_map(half.file).image;
  for (std::size_t i = 0; i < whole.pixels.size(); ++i) {
    EXPECT_EQ(dim.pixels[i], 0.5f * whole.pixels[i]);
  }
  // What was cut off or altered is not taken for whole.
  EXPECT_EQ(text_of_whole_exr(frames[0].file, "projection"), "fisheye");
  EXPECT_FALSE(text_of_whole_exr(frames[0].file, "missing"));
  EXPECT_FALSE(text_of_whole_exr(folder / "missing.exr", "projection"));
  fs::resize_file(frames[0].file, fs::file_size(frames[0].file) - 100);
  EXPECT_FALSE(text_of_whole_exr(frames[0].file, "projection"));
  const std::atomic<bool> cancel = true;
  RunControl control;
  control.cancel = &cancel;
  EXPECT_THROW(write_sky_sequence(sky, integrator, settings, frames, {}, control), Cancelled);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace twilight
