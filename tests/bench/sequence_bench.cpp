// Maps of many Suns from one solved field, as a table: sequence_bench [RUNS [FIELD.nc [FRAMES]]]
// A field file that does not exist is written, one that does is read.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <numbers>
#include <thread>
#include <vector>

#include "output/field_file.h"
#include "output/sky_sequence.h"
#include "sim/elapsed_time.h"
#include "sim/orders_sky.h"
#include "sim/scene_model.h"
#include "solar/solar_spectrum.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;

struct Spent {
  double wall_s, processor_s;
};

Spent timed(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  const double before = processor_seconds();
  work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
          processor_seconds() - before};
}

void row(const char* what, std::vector<Spent> runs) {
  std::ranges::sort(runs, {}, &Spent::wall_s);
  double busy = 0;
  for (const Spent& run : runs)
    busy += run.processor_s / run.wall_s / static_cast<double>(runs.size());
  fmt::print("| {} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.2f} |\n", what, runs.front().wall_s,
             runs[runs.size() / 2].wall_s, runs.back().wall_s, runs[runs.size() / 2].processor_s,
             busy);
}

Scene scene() {
  Scene scene;
  scene.sun.elevation_deg = 0;
  scene.solver.method = "orders";
  scene.spectrum.wavelengths_nm = {400, 450, 500, 550, 600, 650, 700, 750};
  return scene;
}

// Latitude and longitude, 2 size x size, row by row.
std::vector<ViewDirection> latlong(int size) {
  std::vector<ViewDirection> views;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < 2 * size; ++x) {
      views.push_back(
          {std::numbers::pi * (0.5 - (y + 0.5) / size), std::numbers::pi * ((x + 0.5) / size - 1)});
    }
  }
  return views;
}

int run(int runs, const std::filesystem::path& file, int count) {
  const SceneModel model = build_scene_model(scene());
  fmt::print("{} hardware threads, {} runs each, {} wavelengths, {}\n\n",
             std::thread::hardware_concurrency(), runs, model.medium.wavelengths(),
             model.scene.aerosols.type);
  fmt::print(
      "| work | least s | median s | most s | processor s | cores busy "
      "|\n|---|---|---|---|---|---|\n");
  std::shared_ptr<const OrdersField> field;
  if (!file.empty() && std::filesystem::exists(file)) {
    row("read the field file",
        {timed([&] { field = std::make_shared<OrdersField>(read_field(file, model)); })});
  }
  std::unique_ptr<OrdersSky> sky;
  row(field ? "atmosphere from the field" : "solve",
      {timed([&] { sky = std::make_unique<OrdersSky>(model, field, RunControl{}); })});
  if (!file.empty() && !field) write_field(file, *sky->field(), model);

  const std::vector<ViewDirection> views = latlong(512);
  for (const double sun : {30.0, 5.0, 0.0, -3.0, -6.0, -9.0, -12.0}) {
    std::vector<Spent> spent;
    for (int k = 0; k < runs; ++k) {
      // Suns a little apart, so that nothing of the last run helps but the atmosphere.
      spent.push_back(
          timed([&] { sky->under((sun + 0.01 * k) * kRadPerDeg)->map_radiance(views); }));
    }
    row(fmt::format("further Sun {} deg, 1024 x 512 lat-long", sun).c_str(), spent);
  }

  const auto folder = std::filesystem::temp_directory_path() /
                      fmt::format("twilight-sequence-{}", static_cast<long>(::getpid()));
  std::filesystem::create_directory(folder);
  std::vector<SequenceFrame> frames;
  for (int k = 0; k < count; ++k) {
    // The Sun's azimuth moves, too: no map has the symmetry that halves its pixels.
    const double x = static_cast<double>(k) / std::max(1, count - 1);
    frames.push_back({(5 - 17 * x) * kRadPerDeg, (232 + 18 * x) * kRadPerDeg,
                      folder / fmt::format("{:04}.exr", k)});
  }
  const ColourIntegrator integrator(
      model.medium.wavelength_nm,
      [&](double nm) { return solar_irradiance_w_m2_nm(model.scene.sun.spectrum, nm); },
      ColourObserver::kCie1931);
  std::vector<Spent> spent;
  for (int k = 0; k < runs; ++k) {
    spent.push_back(timed([&] { write_sky_sequence(*sky, integrator, MapSettings{}, frames); }));
  }
  row(fmt::format("{} frames, 512 x 512 hemisphere, Sun 5 to -12 deg, EXR", count).c_str(), spent);
  std::filesystem::remove_all(folder);
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace twilight

int main(int argc, char** argv) try {
  const int runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 5;
  return twilight::run(runs, argc > 2 ? argv[2] : "",
                       argc > 3 ? std::max(1, std::atoi(argv[3])) : 240);
} catch (const std::exception& error) {
  fmt::print(stderr, "sequence_bench: {}\n", error.what());
  return EXIT_FAILURE;
}
