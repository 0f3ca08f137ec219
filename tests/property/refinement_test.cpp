// The error of the sky against a finer grid shrinks when the grid is refined, axis by axis.
#include <gtest/gtest.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "property_size.h"
#include "random_scene.h"
#include "sim/scene_model.h"

namespace twilight {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

// One setting at coarse, finer and finest, the reference.
struct Axis {
  const char* name;
  const char* method;
  std::function<void(Scene&, int)> refine;  // step 0, 1, 2
};

void PrintTo(const Axis& axis, std::ostream* out) { *out << axis.method << ", " << axis.name; }

template <class T>
std::function<void(Scene&, int)> ladder(T SolverOptions::*setting, double a, double b, double c) {
  return [=](Scene& s, int step) {
    using Value = std::remove_cvref_t<decltype(s.solver.*setting)>;
    s.solver.*setting = static_cast<Value>(step == 0 ? a : step == 1 ? b : c);
  };
}

// Any sky, on grids that are good enough for each of their axes to show.
Scene scene_to_refine(const std::string& method) {
  Scene s = random_scene(method, SceneSize::kSmall);
  s.sun.elevation_deg = between(-6.0, 60.0);
  s.observer.height_m = one_in(2) ? 0 : between(-500.0, 3000.0);
  s.atmosphere.top_km = between(40.0, 80.0);
  s.atmosphere.layers = 16;
  s.atmosphere.layer_spacing = "graded";
  s.atmosphere.layer_optics = "mean";
  s.atmosphere.refraction = false;
  s.earth.radius_km.reset();
  s.spectrum.wavelengths_nm = {between(400.0, 700.0)};
  s.aerosols.type = one_in(2) ? "none" : "continental_average";
  s.aerosols.relative_humidity_percent = 70;
  s.aerosols.optical_depth_550nm.reset();
  if (method != "cells" && s.aerosols.type != "none") s.aerosols.phase = "henyey-greenstein";
  SolverOptions& solver = s.solver;
  solver.azimuth_divisions = 24;
  solver.inner_radius_m = 1000;
  solver.active_shell_stride = 2;
  solver.active_shell_weighting = "quadrature";
  solver.scattering_orders = 6;
  solver.aerosol_phase = "truncated";
  solver.air_phase = "rayleigh";
  solver.cell_optics = "mean";
  solver.cell_height_km = 6;
  solver.gather = "exact-single";
  solver.zenith_step_deg = 2;
  solver.altitude_levels = 12;
  solver.polar_directions = 12;
  solver.azimuth_directions = 6;
  solver.phase_degree = 6;
  solver.order_tolerance = 1e-3;
  return s;
}

class Refinement : public testing::TestWithParam<Axis> {};

TEST_P(Refinement, ShrinksTheError) {
  const Axis& axis = GetParam();
  const std::string method = axis.method;
  const auto scenes =
      draw_scenes(scene_count(method == "cells" ? 6 : 3), [&] { return scene_to_refine(method); });
  std::vector<ViewDirection> views;
  for (const double elevation : {90.0, 40.0, 12.0}) {
    for (const double azimuth : {20.0, 160.0}) views.push_back({elevation * kDeg, azimuth * kDeg});
  }
  // Mean relative error of each scene at steps 0 and 1.
  std::vector<double> error[2] = {std::vector<double>(scenes.size()),
                                  std::vector<double>(scenes.size())};
  tbb::parallel_for(std::size_t{0}, scenes.size(), [&](std::size_t i) {
    std::vector<double> sky[3];
    for (int step = 0; step < 3; ++step) {
      Scene s = scenes[i];
      axis.refine(s, step);
      sky[step] = solve_sky(build_scene_model(s))->radiance(views);
    }
    for (int step = 0; step < 2; ++step) {
      double sum = 0;
      for (std::size_t k = 0; k < sky[2].size(); ++k) {
        sum += std::abs(sky[step][k] - sky[2][k]) / std::max(sky[2][k], 1e-12);
      }
      error[step][i] = sum / static_cast<double>(sky[2].size());
    }
  });
  double mean[2] = {}, worst[2] = {};
  for (int step = 0; step < 2; ++step) {
    for (const double e : error[step]) {
      mean[step] += e / static_cast<double>(scenes.size());
      worst[step] = std::max(worst[step], e);
    }
  }
  std::printf("%-11s %-24s mean error %.3g -> %.3g, worst scene %.3g -> %.3g\n", axis.method,
              axis.name, mean[0], mean[1], worst[0], worst[1]);
  // First order halves the error of a halved step against the finest one by more than a third.
  constexpr double kRounding = 1e-6;
  EXPECT_LE(mean[1], 0.75 * mean[0] + kRounding);
  EXPECT_LE(worst[1], worst[0] + kRounding);
}

const Axis kAxes[] = {
    {"azimuth divisions", "cells", ladder(&SolverOptions::azimuth_divisions, 8, 16, 48)},
    {"layers", "cells",
     [](Scene& s, int step) { s.atmosphere.layers = step == 0   ? 3
                                                    : step == 1 ? 9
                                                                : 60; }},
    {"active shell stride", "cells", ladder(&SolverOptions::active_shell_stride, 8, 4, 1)},
    {"scattering orders", "cells", ladder(&SolverOptions::scattering_orders, 1, 3, 12)},
    {"cell height", "cells", ladder(&SolverOptions::cell_height_km, 40, 12, 3)},
    {"layers", "orders",
     [](Scene& s, int step) { s.atmosphere.layers = step == 0   ? 3
                                                    : step == 1 ? 9
                                                                : 60; }},
    {"zenith step", "orders", ladder(&SolverOptions::zenith_step_deg, 3, 1.5, 0.75)},
    {"altitude levels", "orders", ladder(&SolverOptions::altitude_levels, 5, 10, 40)},
    {"polar directions", "orders", ladder(&SolverOptions::polar_directions, 8, 12, 32)},
    {"azimuth directions", "orders", ladder(&SolverOptions::azimuth_directions, 4, 6, 16)},
    {"order tolerance", "orders",
     [](Scene& s, int step) {
       s.solver.scattering_orders.reset();
       s.solver.order_tolerance = step == 0 ? 0.1 : step == 1 ? 0.01 : 1e-5;
     }},
    {"scattering orders", "orders", ladder(&SolverOptions::scattering_orders, 1, 3, 12)},
    // Noise falls like the root of the photons.
    {"photons", "monte-carlo", ladder(&SolverOptions::photons, 500, 8000, 100000)},
};

INSTANTIATE_TEST_SUITE_P(Axes, Refinement, testing::ValuesIn(kAxes), [](const auto& info) {
  std::string name = std::string(info.param.method) + "_" + info.param.name;
  std::erase(name, '-');
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

}  // namespace
}  // namespace twilight
