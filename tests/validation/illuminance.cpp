// Clear-sky illuminance through twilight against the almanacs'.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "output/csv_table.h"
#include "output/svg_plot.h"
#include "tests/validation/checks.h"
#include "tests/validation/sky_sequence.h"

namespace twilight::validation {
namespace {

// Sun and clear sky on the horizontal, lux, against the geometric elevation of the Sun: Explanatory
// Supplement to the Astronomical Almanac (Seidelmann 1992), Sec. 9.34; Janiczek & DeYoung (1987),
// USNO Circular 171 (below about -7 deg beyond what it claims).
struct Row {
  double sun_deg, supplement_lux, circular_lux;
};
constexpr Row kRows[] = {
    {10, 11120, 11230},   {8, 8172, 8053},      {6, 5624, 5363},         {5, 4499, 4252},
    {4, 3548, 3317},      {3, 2689, 2557},      {2, 1921, 1946},         {1, 1268, 1434},
    {0, 758.6, 984.5},    {-1, 404.6, 386.8},   {-2, 189.4, 169},        {-3, 79.07, 66.4},
    {-4, 29.93, 24.44},   {-5, 10.41, 8.652},   {-6, 3.412, 2.992},      {-7, 1.086, 1.02},
    {-8, 0.3481, 0.3447}, {-9, 0.1164, 0.1159}, {-10, 0.04211, 0.03886},
};

std::vector<Check> illuminance(const Settings& settings) {
  std::vector<Check> checks;
  std::vector<PlotSeries> series(2);
  series[0].label = "Explanatory Supplement 1992";
  series[1].label = "USNO Circular 171";
  for (PlotSeries& s : series) s.dots = true;
  for (const Row& row : kRows) {
    series[0].points.emplace_back(row.sun_deg, row.supplement_lux);
    series[1].points.emplace_back(row.sun_deg, row.circular_lux);
  }
  CsvTable table({"air", "sun_deg", "orders_lux", "supplement_lux", "circular_lux",
                  "over_supplement", "over_circular"});
  for (const char* type : {"continental_clean", "continental_average"}) {
    const Stopwatch watch;
    Scene scene;
    scene.earth.ground_albedo = 0.15;
    scene.aerosols.type = type;
    scene.spectrum.wavelengths_nm = photopic_wavelengths_nm();
    SkySequence skies(with_overrides(scene, settings));
    double lowest = 1e9, highest = 0;
    PlotSeries line{type};
    for (const Row& row : kRows) {
      const double lux = skies.illuminance_lux(skies.under(row.sun_deg));
      const double ratio = lux / row.supplement_lux;
      lowest = std::min(lowest, ratio);
      highest = std::max(highest, ratio);
      line.points.emplace_back(row.sun_deg, lux);
      table.add_row({type, row.sun_deg, lux, row.supplement_lux, row.circular_lux, ratio,
                     lux / row.circular_lux});
      say(settings, fmt::format("illuminance, {}: Sun {:g}: {:.4g} lx, {:.3f} of the Supplement's, "
                                "{:.3f} of the Circular's",
                                type, row.sun_deg, lux, ratio, lux / row.circular_lux));
    }
    series.push_back(line);
    checks.push_back({fmt::format("clear-sky illuminance, {}, Sun +10 to -10", type),
                      "0.5 to 1.1 of the Explanatory Supplement",
                      fmt::format("{:.2f} to {:.2f} of it (field {:.0f} s)", lowest, highest,
                                  skies.solve_seconds()),
                      lowest >= 0.5 && highest <= 1.1, watch.seconds()});
  }
  if (!settings.directory.empty()) {
    table.write(settings.directory / "illuminance.csv", std::cout);
    write_svg_plot(settings.directory / "illuminance.svg", "Clear-sky illuminance",
                   {.label = "geometric elevation of the Sun, deg"},
                   {.label = "lux", .logarithmic = true}, series);
  }
  return checks;
}

}  // namespace

std::vector<Section> illuminance_sections() {
  return {{"illuminance", "Sun and sky on the ground, against the almanacs", illuminance}};
}

}  // namespace twilight::validation
