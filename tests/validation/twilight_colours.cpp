// Plots and tables of the twilight sky's colours.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "output/csv_table.h"
#include "output/preview.h"
#include "output/sky_image.h"
#include "output/svg_plot.h"
#include "solar/solar_spectrum.h"
#include "tests/validation/colours.h"
#include "tests/validation/sky_sequence.h"

namespace {

namespace fs = std::filesystem;
using namespace twilight;
using namespace twilight::validation;

// An air, and the Suns it is looked at under.
struct Case {
  ColourAir air;
  std::vector<double> suns;
};

// All that is looked at under one Sun.
struct Look {
  SkyColour zenith;
  std::vector<SkyColour> sunward, antisolar;
};

const std::vector<double>& sunward_deg() {
  static const std::vector<double> kElevations = steps(5, 80, 2.5);
  return kElevations;
}
const std::vector<double>& antisolar_deg() {
  static const std::vector<double> kElevations = steps(1, 60, 1);
  return kElevations;
}

std::vector<Case> cases() {
  const std::vector<double> all = {10, 5, 2, 1, 0, -1, -2, -3, -4, -5, -6, -7, -8, -9, -10};
  const std::vector<double> some = {10, 5, 0, -2, -4, -6, -8, -10};
  const std::vector<double> purple = steps(0, -8, 1);
  const std::string clean = "continental_clean";
  return {{{"clear, 300 DU", "none", 300}, all},
          {{"clear, 0 DU", "none", 0}, all},
          {{"clear, 500 DU", "none", 500}, all},
          {{"clear, 240 DU", "none", 240}, {0}},
          {{"clean, 300 DU", clean, 300}, all},
          {{"clean, sulphate x10", clean, 300, 10}, purple},
          {{"sulphate alone", clean, 300, 1, false}, purple},
          {{"sulphate alone x10", clean, 300, 10, false}, purple},
          {{"clean, 0 DU", clean, 0}, some},
          {{"clean, 500 DU", clean, 500}, some},
          {{"average, 300 DU", "continental_average", 300}, {1, 0, -1, -2, -3, -4, -5, -6}}};
}

struct Run {
  fs::path out, fields;
  Scene scene;
  std::map<std::string, std::map<double, Look>> looks = {};  // by air and Sun
  std::map<std::string, Case> by_name = {};
  Chromaticity sunlight = {};
  bool pictures = true;

  void write(const CsvTable& table, const char* name) const { table.write(out / name, std::cout); }
};

// Chromaticity of a black body, 2000..40000 K.
Chromaticity planck(double kelvin) {
  Tristimulus sum{};
  for (int nm = kFirstObserverWavelength_nm; nm <= kLastObserverWavelength_nm; ++nm) {
    const double power = std::pow(nm / 560.0, -5) / std::expm1(1.4388e7 / (nm * kelvin));
    const Tristimulus cmf = colour_matching(ColourObserver::kCie1931, nm);
    for (std::size_t k = 0; k < 3; ++k) sum[k] += power * cmf[k];
  }
  return chromaticity(sum);
}

std::vector<PlotSeries> landmarks(const Chromaticity& sunlight) {
  PlotSeries locus{"black bodies", {}, {}, true, false, "#999999"};
  for (const double k : {2500., 3000., 3500., 4000., 5000., 6000., 7000., 8000., 10000., 13000.,
                         18000., 25000., 40000.}) {
    const Chromaticity xy = planck(k);
    if (k == 4000 || k == 6000 || k == 10000 || k == 40000) {
      locus.marks.emplace_back(static_cast<int>(locus.points.size()), fmt::format("{:g} K", k));
    }
    locus.points.emplace_back(xy[0], xy[1]);
  }
  return {locus,
          {"", {{1.0 / 3, 1.0 / 3}}, {{0, "E"}}, false, true, "#333333"},
          {"", {{0.3127, 0.3290}}, {{0, "D65"}}, false, true, "#333333"},
          {"", {{sunlight[0], sunlight[1]}}, {{0, "sunlight"}}, false, true, "#b8860b"}};
}

// Pictures of one air from its one field, the Sun at the right (west).
void pictures(const Run& run, ColourSkies& skies) {
  const SceneModel& model = skies.model();
  for (const double sun : {2., -1., -4., -8.}) {
    skies.zenith(sun);
    const ColourIntegrator colour(
        model.medium.wavelength_nm,
        [&](double nm) { return solar_irradiance_w_m2_nm(model.scene.sun.spectrum, nm); },
        ColourObserver::kCie1931);
    MapSettings map;
    map.size = 256;
    map.sun_azimuth_rad = 270 * kRadPerDeg;
    const SkyMap sky = render_map(skies.sky(), colour, map);
    write_preview_png(run.out / fmt::format("sky_{:+g}.png", sun), sky.colour);
    // The horizon all around, the antisolar point's azimuth in the middle.
    map.projection = Projection::kLatLong;
    map.size = 160;
    map.sun_azimuth_rad = 0;
    write_preview_png(run.out / fmt::format("panorama_{:+g}.png", sun),
                      render_map(skies.sky(), colour, map).colour);
    fmt::print("picture, Sun {:g}: {} of {} pixels outside the gamut\n", sun,
               sky.out_of_gamut_pixels, sky.sky_pixels);
  }
}

void look_at_all(Run& run, const std::string& only) {
  CsvTable ratios({"air", "height_m", "sun_deg", "R624", "G540", "B461"});
  CsvTable table({"air", "sun_deg", "azimuth_deg", "elevation_deg", "x", "y", "luminance_cd_m2",
                  "red_over_blue", "red_over_green", "purple_index"});
  for (const Case& c : cases()) {
    if (!only.empty() && c.air.name.find(only) == std::string::npos) continue;
    const Stopwatch watch;
    ColourSkies skies(run.scene, c.air, run.fields);
    run.sunlight = skies.sunlight();
    run.by_name.emplace(c.air.name, c);
    for (const double sun : c.suns) {
      Look& look = run.looks[c.air.name][sun];
      look.zenith = skies.zenith(sun);
      look.sunward = skies.look(sun, vertical(sunward_deg(), 0));
      look.antisolar = skies.look(sun, vertical(antisolar_deg(), 180));
      const auto add = [&](double azimuth, double elevation, const SkyColour& k) {
        table.add_row({c.air.name, sun, azimuth, elevation, k.xy[0], k.xy[1], k.luminance_cd_m2,
                       k.red_over_blue,
                       skies.relative_radiance(k, 650) / skies.relative_radiance(k, 530),
                       purple_index(k)});
      };
      add(0, 90, look.zenith);
      for (std::size_t v = 0; v < look.sunward.size(); ++v) {
        add(0, sunward_deg()[v], look.sunward[v]);
      }
      for (std::size_t v = 0; v < look.antisolar.size(); ++v) {
        add(180, antisolar_deg()[v], look.antisolar[v]);
      }
      if (c.air.ozone_du != 300 || c.air.stratosphere_factor != 1 || (sun != 0 && sun != -3)) {
        continue;
      }
      for (const double height_m : {0., 200., 2000.}) {
        skies.set_height_m(height_m);
        const std::vector<ViewAngles> views = {{45, 0}, {45, 180}};
        const std::vector<SkyColour> sky = skies.look(sun, views);
        const auto ratio = [&](double nm) {
          return skies.relative_radiance(sky[0], nm) / skies.relative_radiance(sky[1], nm);
        };
        ratios.add_row({c.air.name, height_m, sun, ratio(624), ratio(540), ratio(461)});
      }
      skies.set_height_m(0);
    }
    fmt::print("{}: aerosol depth {:.4f}, above 12 km {:.4f}; field {:.1f} s, in all {:.1f} s\n",
               c.air.name, skies.aerosol_optical_depth(), skies.aerosol_optical_depth(12),
               skies.solve_seconds(), watch.seconds());
    std::fflush(stdout);
    if (run.pictures && c.air.name == "clean, 300 DU") pictures(run, skies);
  }
  run.write(table, "skies.csv");
  run.write(ratios, "sunward_over_antisolar.csv");
}

// The zenith's track through the chromaticity diagram, its luminance, and ozone's share.
void zenith(const Run& run) {
  std::vector<PlotSeries> tracks;
  std::vector<PlotSeries> luminance;
  std::map<std::string, std::map<double, Chromaticity>> sunset;  // by air, ozone
  for (const char* name : {"clear, 0 DU", "clear, 300 DU", "clear, 500 DU", "clean, 0 DU",
                           "clean, 300 DU", "clean, 500 DU", "clear, 240 DU"}) {
    if (!run.looks.contains(name)) continue;
    const ColourAir& air = run.by_name.at(name).air;
    PlotSeries track{name};
    track.dashed = air.aerosol != "none";
    PlotSeries line{name};
    for (const auto& [sun, look] : run.looks.at(name)) {
      const Chromaticity& xy = look.zenith.xy;
      if (sun == 0) sunset[air.aerosol][air.ozone_du] = xy;
      if (air.aerosol == "none" && (sun > 2 || sun == 0 || std::fmod(sun, 2) == 0)) {
        track.marks.emplace_back(static_cast<int>(track.points.size()),
                                 fmt::format("{:g}&#176;", sun));
      }
      track.points.emplace_back(xy[0], xy[1]);
      line.points.emplace_back(sun, look.zenith.luminance_cd_m2);
    }
    if (track.points.size() < 2) continue;
    tracks.push_back(track);
    luminance.push_back(line);
  }
  CsvTable shares({"air", "ozone_du", "white", "share", "share_of_distance"});
  for (const auto& [air, by_ozone] : sunset) {
    if (!by_ozone.contains(0)) continue;
    const Chromaticity without = by_ozone.at(0);
    for (const auto& [ozone, xy] : by_ozone) {
      if (ozone == 0) continue;
      for (const auto& [name, white] :
           {std::pair<std::string, Chromaticity>{"E", kEqualEnergyWhite},
            {"D65", {0.3127, 0.3290}},
            {"sunlight", run.sunlight}}) {
        const double share = ozone_share(without, xy, white);
        const double of_distance = 1 - std::hypot(without[0] - white[0], without[1] - white[1]) /
                                           std::hypot(xy[0] - white[0], xy[1] - white[1]);
        shares.add_row({air, ozone, name, share, of_distance});
        fmt::print("ozone's share at sunset, {}, {:g} DU, white {}: {:.3f}, of distances {:.3f}\n",
                   air, ozone, name, share, of_distance);
      }
    }
  }
  run.write(shares, "ozone_share.csv");
  for (PlotSeries& s : landmarks(run.sunlight)) tracks.push_back(s);
  write_svg_plot(run.out / "zenith_chromaticity.svg",
                 "Colour of the zenith, Sun +10&#176; to &#8722;10&#176; (beside the dots)",
                 {"CIE 1931 x", 0.18, 0.38, 0.02}, {"CIE 1931 y", 0.14, 0.40, 0.02}, tracks);
  write_svg_plot(run.out / "zenith_luminance.svg", "Luminance of the zenith",
                 {.label = "geometric elevation of the Sun, deg"},
                 {.label = "cd/m&#178;", .logarithmic = true}, luminance);
}

// The purple light: how much purpler and redder than clear air the sunward vertical is.
void purple_light(const Run& run) {
  CsvTable best({"air", "sun_deg", "purplest_deg", "purple_index", "x", "y", "reddest_deg",
                 "red_excess", "brightest_excess_deg", "light_excess"});
  std::vector<PlotSeries> index, excess, profile;
  if (!run.looks.contains("clear, 300 DU")) return;
  const auto& reference = run.looks.at("clear, 300 DU");
  for (const char* name : {"clear, 300 DU", "sulphate alone", "sulphate alone x10", "clean, 300 DU",
                           "clean, sulphate x10"}) {
    if (!run.looks.contains(name)) continue;
    PlotSeries purple{name}, red{name};
    for (const auto& [sun, look] : run.looks.at(name)) {
      if (sun > 0 || sun < -8) continue;
      const auto largest = [&](auto value) {
        std::size_t top = 0;
        for (std::size_t v = 1; v < look.sunward.size(); ++v) {
          if (value(v) > value(top)) top = v;
        }
        return top;
      };
      const std::vector<SkyColour>& clear = reference.at(sun).sunward;
      const auto purple_at = [&](std::size_t v) { return purple_index(look.sunward[v]); };
      const auto red_at = [&](std::size_t v) {
        return look.sunward[v].red_over_blue / clear[v].red_over_blue;
      };
      const auto light_at = [&](std::size_t v) {
        return look.sunward[v].luminance_cd_m2 / clear[v].luminance_cd_m2;
      };
      const std::size_t p = largest(purple_at), r = largest(red_at), l = largest(light_at);
      best.add_row({name, sun, sunward_deg()[p], purple_at(p), look.sunward[p].xy[0],
                    look.sunward[p].xy[1], sunward_deg()[r], red_at(r), sunward_deg()[l],
                    light_at(l)});
      purple.points.emplace_back(sun, purple_at(p));
      red.points.emplace_back(sun, red_at(r));
      if (std::string(name) != "clean, 300 DU" || sun > -1) continue;
      PlotSeries line{fmt::format("Sun {:g}&#176;", sun)};
      for (std::size_t v = 0; v < look.sunward.size(); ++v) {
        line.points.emplace_back(sunward_deg()[v], purple_at(v));
      }
      profile.push_back(line);
    }
    index.push_back(purple);
    excess.push_back(red);
  }
  run.write(best, "purple_light.csv");
  const PlotAxis sun{"geometric elevation of the Sun, deg", -8, 0, 1};
  const PlotAxis purple{"min(R, B)/G, linear Rec. 709", 0.6, 1.6, 0.1};
  write_svg_plot(run.out / "purple_light.svg",
                 "Purpleness of the sunward sky, its largest at 5&#176;..80&#176;", sun, purple,
                 index);
  write_svg_plot(run.out / "purple_excess.svg",
                 "Red over blue (650/450 nm) against clear air's, largest at 5&#176;..80&#176;",
                 sun, {"ratio to clear air", 0, 12, 1}, excess);
  write_svg_plot(run.out / "purple_profile.svg", "Purpleness of the sunward sky, clean air",
                 {"elevation above the sunward horizon, deg", 5, 80, 5}, purple, profile);
}

// The antisolar vertical.
void belt(const Run& run) {
  CsvTable belts({"air", "sun_deg", "exists", "belt_deg", "belt_red_over_blue", "belt_x",
                  "below_red_over_blue", "below_x", "shadow_deg"});
  for (const char* name : {"clear, 300 DU", "clean, 300 DU", "average, 300 DU"}) {
    if (!run.looks.contains(name)) continue;
    const std::string air = std::string(name).substr(0, 5);
    std::vector<PlotSeries> colour;
    std::vector<PlotSeries> light;
    for (const auto& [sun, look] : run.looks.at(name)) {
      if (sun > 1 || sun < -6) continue;
      PlotSeries c{fmt::format("Sun {:g}&#176;", sun)};
      PlotSeries l{fmt::format("Sun {:g} deg", sun)};
      for (std::size_t v = 0; v < look.antisolar.size(); ++v) {
        c.points.emplace_back(antisolar_deg()[v], look.antisolar[v].xy[0]);
        l.points.emplace_back(antisolar_deg()[v], look.antisolar[v].luminance_cd_m2);
      }
      const BeltOfVenus b = find_belt(antisolar_deg(), look.antisolar);
      belts.add_row({air, sun, b.exists ? 1.0 : 0.0, b.belt_deg, b.belt_red_over_blue, b.belt_x,
                     b.below_red_over_blue, b.below_x, b.shadow_deg});
      colour.push_back(c);
      light.push_back(l);
    }
    write_svg_plot(run.out / fmt::format("belt_of_venus_{}.svg", air),
                   "Colour opposite the Sun, " + air + " air",
                   {"elevation above the antisolar horizon, deg", 0, 60, 5},
                   {"CIE 1931 x", 0.22, 0.44, 0.02}, colour);
    write_svg_plot(run.out / fmt::format("antisolar_luminance_{}.svg", air),
                   "Luminance opposite the Sun, " + air + " air",
                   {.label = "elevation above the antisolar horizon, deg"},
                   {.label = "cd/m&#178;", .logarithmic = true}, light);
  }
  run.write(belts, "belt_of_venus.csv");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Colours of the twilight sky: plots (SVG), tables (CSV), pictures (PNG)");
  std::string out, fields, only;
  std::vector<std::string> overrides;
  app.add_option("OUT", out, "folder to write into")->required();
  app.add_option("--fields", fields, "folder where solved fields are kept and found again");
  app.add_option("--only", only, "airs whose name contains this, e.g. clear");
  app.add_option("--set", overrides, "KEY=VALUE of a scene file, e.g. solver.phase_degree=24");
  bool no_pictures = false;
  app.add_flag("--no-pictures", no_pictures, "plots and tables alone");
  CLI11_PARSE(app, argc, argv);
  try {
    fs::create_directories(out);
    if (!fields.empty()) fs::create_directories(fields);
    Run run{out, fields, {}};
    run.pictures = !no_pictures;
    run.scene.spectrum.wavelengths_nm = photopic_wavelengths_nm();
    run.scene.sun.disc_average = false;
    run.scene.solver.zenith_step_deg = 1.5;
    run.scene.solver.altitude_levels = 40;
    run.scene.solver.polar_directions = 24;
    run.scene.solver.phase_degree = 10;
    run.scene.solver.order_tolerance = 1e-2;
    Settings settings;
    settings.overrides = overrides;
    run.scene = with_overrides(run.scene, settings);
    look_at_all(run, only);
    zenith(run);
    purple_light(run);
    belt(run);
  } catch (const std::exception& error) {
    fmt::print(stderr, "twilight_colours: {}\n", error.what());
    return 2;
  }
  return 0;
}
