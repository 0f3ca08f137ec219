// Luminance of the twilight sky as measured in Maryland.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <string>
#include <vector>

#include "output/csv_table.h"
#include "output/svg_plot.h"
#include "tests/validation/checks.h"
#include "tests/validation/sky_sequence.h"

namespace twilight::validation {
namespace {

// Koomen, Lock, Packer, Scolnik, Tousey & Hulburt (1952), J. Opt. Soc. Am. 42, 353, Table II: rural
// Maryland, 30 m, January to March 1951, vertical photopic transmission 75 to 85 %, photometer
// field 1.5 deg, candles per square foot read off smooth curves (1 cd/ft^2 = 10.7639 cd/m^2).
// Along the Sun's vertical: azimuth 0 or 180 deg from the Sun.
struct Row {
  double sun_deg, azimuth_deg, elevation_deg, candles_per_ft2;
};
constexpr Row kRows[] = {
    {5, 0, 0, 1000},     {5, 0, 10, 1000},    {5, 0, 30, 350},     {5, 0, 50, 150},
    {5, 0, 70, 80},      {5, 0, 90, 43},      {5, 180, 70, 50},    {5, 180, 50, 65},
    {5, 180, 30, 110},   {5, 180, 10, 170},   {5, 180, 0, 180},    {3, 0, 10, 600},
    {3, 0, 30, 220},     {3, 0, 50, 100},     {3, 0, 70, 62},      {3, 0, 90, 35},
    {3, 180, 70, 40},    {3, 180, 50, 54},    {3, 180, 30, 78},    {3, 180, 10, 120},
    {3, 180, 0, 120},    {0, 0, 10, 150},     {0, 0, 30, 74},      {0, 0, 50, 35},
    {0, 0, 70, 21},      {0, 0, 90, 15},      {0, 180, 70, 19},    {0, 180, 50, 23},
    {0, 180, 30, 35},    {0, 180, 10, 40},    {0, 180, 0, 42},     {-3, 0, 0, 17},
    {-3, 0, 10, 15},     {-3, 0, 30, 9.5},    {-3, 0, 50, 4},      {-3, 0, 70, 3},
    {-3, 0, 90, 2},      {-3, 180, 70, 2},    {-3, 180, 50, 3.2},  {-3, 180, 30, 4},
    {-3, 180, 10, 2},    {-3, 180, 0, 2},     {-6, 0, 0, 0.8},     {-6, 0, 10, 0.7},
    {-6, 0, 30, 0.3},    {-6, 0, 50, 0.12},   {-6, 0, 70, 0.08},   {-6, 0, 90, 0.06},
    {-6, 180, 70, 0.05}, {-6, 180, 50, 0.07}, {-6, 180, 30, 0.07}, {-6, 180, 10, 0.08},
    {-6, 180, 0, 0.09},  {-9, 0, 90, 0.0015},
};
constexpr double kCdM2PerCandleFt2 = 10.7639;

struct Variant {
  std::string name;
  std::function<void(Scene&)> change;
};

double median(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t n = values.size();
  return n == 0 ? 0 : std::sqrt(values[(n - 1) / 2] * values[n / 2]);
}

Check run_variant(const Variant& variant, const Settings& settings, CsvTable& table,
                  std::vector<PlotSeries>* plot) {
  const Stopwatch watch;
  Scene scene;
  scene.observer.height_m = 30;
  scene.earth.ground_albedo = 0.15;
  scene.atmosphere.profile = "midlatitude_winter";
  scene.spectrum.wavelengths_nm = photopic_wavelengths_nm();
  variant.change(scene);
  SkySequence skies(with_overrides(scene, settings));
  std::vector<double> ratios, factors;
  std::string by_sun;
  std::vector<double> of_this_sun;
  double sun = 99;
  const OrdersSky* sky = nullptr;
  const auto close_sun = [&] {
    if (!of_this_sun.empty()) by_sun += fmt::format(", {:g}: {:.2f}", sun, median(of_this_sun));
    of_this_sun.clear();
  };
  for (const Row& row : kRows) {
    if (sky == nullptr || row.sun_deg != sun) {
      close_sun();
      sun = row.sun_deg;
      sky = &skies.under(sun);
    }
    // The photometer's field ends at the horizon.
    const ViewAngles view{std::max(row.elevation_deg, 0.75), row.azimuth_deg};
    const double ours = skies.luminance_cd_m2(*sky, view);
    const double measured = kCdM2PerCandleFt2 * row.candles_per_ft2;
    const double ratio = ours / measured;
    of_this_sun.push_back(ratio);
    if (row.sun_deg <= 0) {
      ratios.push_back(ratio);
      factors.push_back(std::max(ratio, 1 / ratio));
    }
    table.add_row(
        {variant.name, row.sun_deg, row.azimuth_deg, row.elevation_deg, ours, measured, ratio});
    if (plot != nullptr && (row.sun_deg == 0 || row.sun_deg == -3 || row.sun_deg == -6)) {
      const double along = row.azimuth_deg == 0 ? row.elevation_deg : 180 - row.elevation_deg;
      const std::size_t k = row.sun_deg == 0 ? 0 : row.sun_deg == -3 ? 2 : 4;
      (*plot)[k].points.emplace_back(along, measured);
      (*plot)[k + 1].points.emplace_back(along, ours);
    }
  }
  close_sun();
  // Vertical photopic transmission, about: at 555 nm.
  const Medium& m = skies.model().medium;
  double depth = 0;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    depth += m.extinction_per_km(i, 7) * (m.boundary_km[i + 1] - m.boundary_km[i]);
  }
  const double middle = median(ratios);
  return {
      fmt::format("Koomen et al. 1952, Maryland, Sun's vertical, Sun 0 to -9: {}", variant.name),
      "median ratio within 1.5",
      fmt::format("median of {} ratios {:.2f}, of their sizes {:.2f}, largest {:.2f}; median at "
                  "Sun{}; vertical transmission at 555 nm {:.0f} %",
                  ratios.size(), middle, median(factors), std::ranges::max(factors),
                  by_sun.substr(1), 100 * std::exp(-depth)),
      middle <= 1.5 && middle >= 1 / 1.5, watch.seconds()};
}

CsvTable koomen_table() {
  return CsvTable({"variant", "sun_deg", "azimuth_deg", "elevation_deg", "orders_cd_m2",
                   "measured_cd_m2", "ratio"});
}

std::vector<Check> koomen(const Settings& settings) {
  CsvTable table = koomen_table();
  std::vector<PlotSeries> plot;
  for (const char* sun : {"Sun 0", "Sun -3", "Sun -6"}) {
    plot.push_back({.label = fmt::format("{}, measured", sun), .dots = true});
    plot.push_back({.label = fmt::format("{}, orders", sun)});
  }
  const std::vector<Check> checks = {run_variant(
      {"continental average", [](Scene& s) { s.aerosols.type = "continental_average"; }}, settings,
      table, &plot)};
  if (!settings.directory.empty()) {
    table.write(settings.directory / "koomen.csv", std::cout);
    write_svg_plot(settings.directory / "koomen.svg", "Sky along the Sun's vertical, Maryland",
                   {.label = "angle from the horizon below the Sun, deg"},
                   {.label = "cd/m&#178;", .logarithmic = true}, plot);
  }
  return checks;
}

// Which physics moves the comparison; each row is a report, not a bar of its own.
std::vector<Check> koomen_variants(const Settings& settings) {
  const std::vector<Variant> variants = {
      {"no aerosol", [](Scene& s) { s.aerosols.type = "none"; }},
      {"continental clean", [](Scene& s) { s.aerosols.type = "continental_clean"; }},
      {"urban", [](Scene& s) { s.aerosols.type = "urban"; }},
      {"average, optical depth 0.3", [](Scene& s) { s.aerosols.optical_depth_550nm = 0.3; }},
      {"average, US standard", [](Scene& s) { s.atmosphere.profile = "us_standard"; }},
      {"average, albedo 0.5", [](Scene& s) { s.earth.ground_albedo = 0.5; }},
      {"average, no spreading", [](Scene& s) { s.atmosphere.refractive_spreading = false; }},
      {"average, point Sun", [](Scene& s) { s.sun.disc_average = false; }},
      {"average, scalar", [](Scene& s) { s.solver.polarisation = false; }},
      {"average, no ozone", [](Scene& s) { s.atmosphere.ozone_du = 0.0; }},
  };
  CsvTable table = koomen_table();
  std::vector<Check> checks;
  for (const Variant& variant : variants) {
    checks.push_back(run_variant(variant, settings, table, nullptr));
    say(settings, checks.back().name + ": " + checks.back().measured);
    if (settings.quick) break;
  }
  if (!settings.directory.empty()) {
    table.write(settings.directory / "koomen-variants.csv", std::cout);
  }
  return checks;
}

}  // namespace

std::vector<Section> koomen_sections() {
  return {{"koomen", "luminance along the Sun's vertical, Maryland 1951", koomen},
          {"koomen-variants", "the same with one thing changed at a time", koomen_variants}};
}

}  // namespace twilight::validation
