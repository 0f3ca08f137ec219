// How the cost of a solve grows with each setting: processor seconds against azimuthal divisions,
// layers, wavelengths, orders of scattering and threads, with fitted exponents, as a table and one
// plot. Not a test: prints figures and, with a file name, writes the SVG.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "output/machine.h"
#include "output/svg_plot.h"
#include "sim/elapsed_time.h"
#include "sim/scene_model.h"

namespace twilight {
namespace {

struct Cost {
  double wall_s = 0, processor_s = 0;
};

// Least of some solves: what other work on the machine adds is left out best.
Cost cost_of(const Scene& scene, int runs) {
  const SceneModel model = build_scene_model(scene);
  Cost least{HUGE_VAL, HUGE_VAL};
  for (int i = 0; i < runs; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const double before = processor_seconds();
    solve_sky(model);
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    least.wall_s = std::min(least.wall_s, wall.count());
    least.processor_s = std::min(least.processor_s, processor_seconds() - before);
  }
  return least;
}

std::vector<double> even_wavelengths(int count) {
  std::vector<double> nm;
  for (int i = 0; i < count; ++i) nm.push_back(count == 1 ? 550 : 380 + 400.0 * i / (count - 1));
  return nm;
}

struct Sweep {
  std::string name, method;
  std::vector<int> values;
  std::function<void(Scene&, int)> set;
};

std::vector<Sweep> sweeps() {
  const auto wavelengths = [](Scene& s, int n) { s.spectrum.wavelengths_nm = even_wavelengths(n); };
  const auto layers = [](Scene& s, int n) { s.atmosphere.layers = n; };
  const auto orders = [](Scene& s, int n) { s.solver.scattering_orders = n; };
  const auto threads = [](Scene& s, int n) { s.solver.threads = n; };
  return {
      {"azimuthal divisions S",
       "cells",
       {40, 60, 80, 120, 160},
       [](Scene& s, int n) { s.solver.azimuth_divisions = n; }},
      {"layers", "cells", {25, 50, 100, 200, 400}, layers},
      {"wavelengths", "cells", {8, 16, 32, 64}, wavelengths},
      {"orders of scattering", "cells", {2, 4, 8, 16}, orders},
      {"threads", "cells", {1, 2}, threads},
      {"layers", "orders", {25, 50, 100, 200, 400}, layers},
      {"wavelengths", "orders", {8, 16, 32, 64}, wavelengths},
      {"orders of scattering", "orders", {2, 3, 4, 8, 16}, orders},
      {"threads", "orders", {1, 2}, threads},
  };
}

// Exponent of the least-squares power law through points.
double fitted_exponent(const std::vector<std::pair<double, double>>& points) {
  double x = 0, y = 0, xx = 0, xy = 0;
  const auto n = static_cast<double>(points.size());
  for (const auto& [value, seconds] : points) {
    const double u = std::log(value), v = std::log(seconds);
    x += u;
    y += v;
    xx += u * u;
    xy += u * v;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

void run(int runs, const std::string& file) {
  const Machine machine = this_machine();
  fmt::print(
      "{}, {} cores, {}; least of {} solves, continental average air, Sun -4 deg, 8 "
      "wavelengths, S = 60 where not said otherwise\n\n",
      machine.processor, machine.cores, machine.simd, runs);
  fmt::print(
      "| method | setting | values | processor s (wall s for threads) | exponent |\n"
      "|---|---|---|---|---|\n");
  std::vector<PlotSeries> series;
  for (const Sweep& sweep : sweeps()) {
    std::vector<std::pair<double, double>> points;
    std::string values, seconds;
    for (const int value : sweep.values) {
      Scene scene;
      scene.sun.elevation_deg = -4;
      scene.spectrum.wavelengths_nm = even_wavelengths(8);
      scene.solver.method = sweep.method;
      scene.solver.azimuth_divisions = 60;
      sweep.set(scene, value);
      const Cost cost = cost_of(scene, runs);
      const double y = sweep.name == "threads" ? cost.wall_s : cost.processor_s;
      points.emplace_back(value, y);
      values += fmt::format("{}{}", values.empty() ? "" : ", ", value);
      seconds += fmt::format("{}{:.2f}", seconds.empty() ? "" : ", ", y);
    }
    const double exponent = fitted_exponent(points);
    fmt::print("| {} | {} | {} | {} | {:+.2f} |\n", sweep.method, sweep.name, values, seconds,
               exponent);
    std::fflush(stdout);
    const double first = points.front().first, base = points.front().second;
    PlotSeries line;
    line.label = fmt::format("{}: {}, exponent {:+.2f}", sweep.method, sweep.name, exponent);
    for (const auto& [x, y] : points) line.points.emplace_back(x / first, y / base);
    line.dashed = sweep.method == "orders";
    series.push_back(line);
  }
  if (file.empty()) return;
  PlotAxis x, y;
  x.label = "setting, over its first value";
  y.label = "seconds, over those of the first value";
  x.logarithmic = y.logarithmic = true;
  write_svg_plot(file, "Growth of the cost of a solve", x, y, series);
}

}  // namespace
}  // namespace twilight

int main(int argc, char** argv) try {
  CLI::App app("Growth of the cost with each setting");
  int runs = 3;
  std::string file;
  app.add_option("--runs", runs, "solves of each point")->check(CLI::PositiveNumber);
  app.add_option("-o", file, "SVG to write");
  CLI11_PARSE(app, argc, argv);
  twilight::run(runs, file);
  return EXIT_SUCCESS;
} catch (const std::exception& error) {
  fmt::print(stderr, "growth_bench: {}\n", error.what());
  return EXIT_FAILURE;
}
