// What each step of the orders' grids costs and errs by.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "tests/validation/checks.h"
#include "tests/validation/sky_sequence.h"

namespace twilight::validation {
namespace {

struct Grid {
  std::string key;
  std::vector<double> values;  ///< coarse to fine, each half the step of the one before
  std::function<void(SolverOptions&, double)> set;
};

int whole(double x) { return static_cast<int>(x + 0.5); }

std::vector<Grid> grids() {
  const SolverOptions d;
  const auto halvings = [](double now) { return std::vector<double>{now / 2, now, now * 2}; };
  return {
      {"zenith_step_deg",
       {2 * d.zenith_step_deg, d.zenith_step_deg, d.zenith_step_deg / 2},
       [](SolverOptions& s, double v) { s.zenith_step_deg = v; }},
      {"altitude_levels", halvings(d.altitude_levels),
       [](SolverOptions& s, double v) { s.altitude_levels = whole(v); }},
      {"polar_directions", halvings(d.polar_directions),
       [](SolverOptions& s, double v) { s.polar_directions = whole(v); }},
      {"azimuth_directions", halvings(d.azimuth_directions),
       [](SolverOptions& s, double v) { s.azimuth_directions = whole(v); }},
      {"phase_degree", halvings(d.phase_degree),
       [](SolverOptions& s, double v) { s.phase_degree = whole(v); }},
      {"order_tolerance",
       {4 * d.order_tolerance, 2 * d.order_tolerance, d.order_tolerance},
       [](SolverOptions& s, double v) { s.order_tolerance = v; }},
  };
}

struct Skies {
  std::vector<double> radiance;
  double seconds = 0;
};

Skies skies_of(const Scene& scene, const Settings& settings) {
  std::vector<double> suns = {30, 5, 0, -3, -6, -9, -12};
  std::vector<ViewAngles> views = {{90, 0},   {45, 0}, {10, 0}, {10, 90},
                                   {10, 180}, {2, 0},  {2, 90}, {2, 180}};
  if (settings.quick) {
    suns = {5, -6};
    views = {{90, 0}, {10, 180}};
  }
  SkySequence sequence(scene);
  std::vector<ViewDirection> directions;
  for (const ViewAngles& v : views) directions.push_back(v.direction());
  Skies result;
  for (const double sun : suns) {
    const std::vector<double> here = sequence.under(sun).radiance(directions);
    result.radiance.insert(result.radiance.end(), here.begin(), here.end());
  }
  result.seconds = sequence.solve_seconds();
  return result;
}

Spread spread_between(const Skies& a, const Skies& b) {
  std::vector<double> differences;
  for (std::size_t k = 0; k < a.radiance.size(); ++k) {
    differences.push_back(a.radiance[k] / b.radiance[k] - 1);
  }
  return spread_of(differences);
}

// One grid's settings: the change from each step to its half, and the order p of the scheme that
// two such changes show: error ~ step^p. The error left at a setting is the next change over
// 2^p - 1, with p at least 1.
std::vector<Check> convergence(const Grid& grid, const std::string& air, const Settings& settings) {
  Scene scene;
  scene.aerosols.type = air;
  scene.spectrum.wavelengths_nm = {400, 550, 700};
  scene = with_overrides(scene, settings);
  std::vector<Skies> skies;
  const Stopwatch watch;
  std::vector<double> values = grid.values;
  // The order in which the settings are tried ends with the finest, which "quick" leaves out.
  if (settings.quick) values.pop_back();
  for (const double value : values) {
    Scene here = scene;
    grid.set(here.solver, value);
    skies.push_back(skies_of(here, settings));
    say(settings, fmt::format("grid convergence, {}, {} = {:g}: {:.1f} s", air, grid.key, value,
                              skies.back().seconds));
  }
  std::string text;
  std::vector<Spread> changes;
  for (std::size_t k = 0; k + 1 < skies.size(); ++k) {
    changes.push_back(spread_between(skies[k], skies[k + 1]));
  }
  double order = 0;
  bool falls = true;
  if (changes.size() > 1 && changes[1].median > 0) {
    order = std::log2(changes[0].median / changes[1].median);
    // Below 0.01 % single precision and the other grids speak.
    falls = changes[1].median < changes[0].median || changes[0].median < 1e-4;
  }
  for (std::size_t k = 0; k < changes.size(); ++k) {
    text += fmt::format("{:g} -> {:g}: median {:.3f} %, worst {:.2f} %; ", values[k], values[k + 1],
                        100 * changes[k].median, 100 * changes[k].worst);
  }
  const std::string seconds = [&] {
    std::string s;
    for (const Skies& sky : skies) s += fmt::format("{}{:.1f}", s.empty() ? "" : ", ", sky.seconds);
    return s;
  }();
  if (changes.size() > 1) text += fmt::format("order {:.1f}; ", order);
  text += "solved in " + seconds + " s";
  return {{fmt::format("grid convergence, {}, {}", air == "none" ? "clear" : air, grid.key),
           "each halving changes less than the one before", text, falls, watch.seconds()}};
}

}  // namespace

std::vector<Section> grid_convergence_sections() {
  std::vector<Section> all;
  for (const char* air : {"none", "continental_average"}) {
    for (const Grid& grid : grids()) {
      const bool clear = std::string(air) == "none";
      if (clear && grid.key == "phase_degree") continue;
      all.push_back({fmt::format("grid-{}-{}", clear ? "clear" : "average", grid.key),
                     fmt::format("halving {} ({})", grid.key, air),
                     [grid, air = std::string(air)](const Settings& settings) {
                       return convergence(grid, air, settings);
                     }});
    }
  }
  return all;
}

}  // namespace twilight::validation
