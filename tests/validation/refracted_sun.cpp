// Air mass and refraction against tables, and what the switches of the Sun change.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <numbers>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "atmosphere/air.h"
#include "atmosphere/refraction.h"
#include "output/csv_table.h"
#include "tests/validation/checks.h"
#include "tests/validation/sky_sequence.h"

namespace twilight::validation {
namespace {

Medium us_standard(double wavelength_nm) {
  AirOptions options;
  options.profile = "us_standard";
  options.layers = 100;
  options.top_km = 100;
  options.refraction = true;
  return make_air(options, std::vector<double>{wavelength_nm});
}

// Kasten & Young (1989), Appl. Opt. 28, 4735: their fit to the relative optical air mass against
// apparent elevation, and their Table II on the horizon, 38.0868.
std::vector<Check> air_mass(const Settings&) {
  const Stopwatch watch;
  const Medium m = us_standard(700);
  const RefractedRays rays(m, 0);
  std::vector<double> path_km(m.layers());
  const auto ours = [&](double elevation_deg) {
    rays.trace_outward(0, (90 - elevation_deg) * kRadPerDeg, path_km);
    double slant = 0, vertical = 0;
    for (std::size_t i = 0; i < m.layers(); ++i) {
      slant += m.air_scattering_per_km(i, 0) * path_km[i];
      vertical += m.air_scattering_per_km(i, 0) * (m.boundary_km[i + 1] - m.boundary_km[i]);
    }
    return slant / vertical;
  };
  double worst = 0;
  for (const double h : {1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 60.0, 90.0}) {
    const double fit = 1 / (std::sin(h * kRadPerDeg) + 0.50572 * std::pow(h + 6.07995, -1.6364));
    worst = std::max(worst, std::abs(ours(h) / fit - 1));
  }
  const double horizon = ours(0);
  return {{"Kasten & Young 1989 air mass", "0.5 % from 1 deg up, 2 % at 0 deg",
           fmt::format("{:.2f} % from 1 deg up; on the horizon {:.2f}, theirs 38.09 ({:+.2f} %)",
                       100 * worst, horizon, 100 * (horizon / 38.0868 - 1)),
           worst <= 0.005 && std::abs(horizon / 38.0868 - 1) <= 0.02, watch.seconds()}};
}

// Hohenkerk & Sinclair (1985), HM Nautical Almanac Office Technical Note 63: refraction at sea
// level against apparent altitude, 1010 hPa, 283.15 K, 0.50169 um, arc seconds, for an
// atmosphere of their own: polytropic to 11 km, isothermal above, n - 1 = (287.604 + 1.6288 / l^2 +
// 0.0136 / l^4) 1e-6 (273.15 / 1013.25) P / T.
std::vector<Check> refraction(const Settings&) {
  constexpr double kRows[][2] = {{15, 214.21}, {12, 267.70}, {10, 319.43}, {7, 444.25}, {5, 592.09},
                                 {4, 704.78},  {3, 862.54},  {2, 1093.79}, {1, 1451.88}};
  constexpr double kHorizon = 2044.24, kArcsecond = kRadPerDeg / 3600;
  const Stopwatch watch;
  AirOptions options;
  options.layers = 100;
  options.top_km = 80;
  options.refraction = true;
  options.earth_radius_km = 6378.12;
  Medium m = make_air(options, std::vector<double>{501.69});
  const double l2 = 0.50169 * 0.50169;
  const double ground =
      (287.604 + 1.6288 / l2 + 0.0136 / (l2 * l2)) * 1e-6 * (273.15 / 1013.25) * (1010.0 / 283.15);
  const double g = 9.784 * (1 - 0.0026 * std::cos(100 * kRadPerDeg));
  const double exponent = g * 28.9644e-3 / (8.31436 * 6.5e-3);
  const auto refractivity = [&](double h) {
    const double low = std::min(h, 11.0);
    return ground * std::pow((283.15 - 6.5 * low) / 283.15, exponent - 1) *
           std::exp(-(h - low) * 1e3 * g * 28.9644e-3 / (8.31436 * (283.15 - 71.5)));
  };
  for (std::size_t i = 0; i < m.layers(); ++i) {
    const double bottom = m.boundary_km[i], step = (m.boundary_km[i + 1] - bottom) / 100;
    double mean = 0;
    for (int k = 0; k < 100; ++k) mean += refractivity(bottom + (k + 0.5) * step) / 100;
    m.refractivity(i, 0) = mean;
  }
  const RefractedRays rays(m, 0);
  const auto ours = [&](double altitude_deg) {
    return rays.trace_outward(0, (90 - altitude_deg) * kRadPerDeg, {}).deflection_rad / kArcsecond;
  };
  double worst = 0;
  for (const auto& row : kRows) worst = std::max(worst, std::abs(ours(row[0]) / row[1] - 1));
  const double horizon = ours(0) / kHorizon - 1;
  return {
      {"refraction, Hohenkerk & Sinclair 1985", "0.5 % from 1 deg up, 2 % at 0 deg",
       fmt::format("{:.3f} % from 1 deg up; on the horizon {:+.3f} %", 100 * worst, 100 * horizon),
       worst <= 0.005 && std::abs(horizon) <= 0.02, watch.seconds()}};
}

// Changes from the default when one switch is turned off. No bar: what the issue asks to be said.
std::vector<Check> switches(const Settings& settings) {
  const ViewAngles views[] = {{90, 0}, {10, 0}, {10, 180}};
  std::vector<double> suns = {0, -2, -4, -6, -8, -10, -12};
  if (settings.quick) suns = {0, -6};
  struct Values {
    std::vector<double> all;
    double seconds;
  };
  const auto run = [&](const std::function<void(Scene&)>& change) {
    const Stopwatch watch;
    Scene scene;
    scene.spectrum.wavelengths_nm = photopic_wavelengths_nm();
    change(scene);
    SkySequence skies(with_overrides(scene, settings));
    Values values;
    for (const double sun : suns) {
      const OrdersSky& sky = skies.under(sun);
      for (const ViewAngles& view : views) {
        values.all.push_back(skies.luminance_cd_m2(sky, view));
        const ViewDirection direction = view.direction();
        values.all.push_back(sky.radiance({&direction, 1})[7]);  // 555 nm
      }
      values.all.push_back(skies.illuminance_lux(sky));
    }
    values.seconds = watch.seconds();
    return values;
  };
  const Values base = run([](Scene&) {});
  CsvTable table({"switch_off", "sun_deg", "zenith_luminance_percent", "zenith_555nm_percent",
                  "10_0_luminance_percent", "10_0_555nm_percent", "10_180_luminance_percent",
                  "10_180_555nm_percent", "illuminance_percent"});
  std::vector<Check> checks;
  const std::pair<const char*, std::function<void(Scene&)>> kSwitches[] = {
      {"refractive spreading off", [](Scene& s) { s.atmosphere.refractive_spreading = false; }},
      {"disc average off", [](Scene& s) { s.sun.disc_average = false; }},
      {"refraction off", [](Scene& s) { s.atmosphere.refraction = false; }},
      {"polarisation off", [](Scene& s) { s.solver.polarisation = false; }},
  };
  for (const auto& [name, change] : kSwitches) {
    const Values off = run(change);
    std::string text;
    for (std::size_t s = 0; s < suns.size(); ++s) {
      std::vector<CsvTable::Cell> cells;
      cells.emplace_back(std::string(name));
      cells.emplace_back(suns[s]);
      for (std::size_t k = 0; k < 7; ++k) {
        cells.emplace_back(100 * (off.all[7 * s + k] / base.all[7 * s + k] - 1));
      }
      table.add_row(cells);
      const auto percent = [&](std::size_t k) { return std::get<double>(cells[2 + k]); };
      text +=
          fmt::format("{}Sun {:g}: {:+.1f}, {:+.1f}, {:+.1f}, {:+.1f}", text.empty() ? "" : "; ",
                      suns[s], percent(0), percent(2), percent(4), percent(6));
    }
    say(settings, fmt::format("{}: {}", name, text));
    checks.push_back({fmt::format("{}: change of luminance at the zenith, 10/0, 10/180 and of "
                                  "illuminance, %",
                                  name),
                      "none", text, true, base.seconds / 4 + off.seconds});
    if (settings.quick) break;
  }
  if (!settings.directory.empty()) {
    table.write(settings.directory / "sun-switches.csv", std::cout);
  }
  return checks;
}

}  // namespace

std::vector<Section> refracted_sun_sections() {
  return {{"air-mass", "Kasten & Young", air_mass},
          {"refraction", "Hohenkerk & Sinclair", refraction},
          {"sun-switches", "spreading, disc, refraction, polarisation off", switches}};
}

}  // namespace twilight::validation
