#include "output/sky_commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <iostream>
#include <stdexcept>

#include "output/atomic_file.h"
#include "output/colour.h"
#include "output/csv_table.h"
#include "output/exr_image.h"
#include "output/field_file.h"
#include "output/photometry.h"
#include "output/preview.h"
#include "output/scene_colour.h"
#include "output/scene_map.h"
#include "output/sky_image.h"

namespace twilight {
namespace {

double degree_of_polarisation(const StokesRadiance& light, std::size_t at) {
  return light.i[at] > 0.0 ? std::hypot(light.q[at], light.u[at]) / light.i[at] : 0.0;
}

}  // namespace

ImageAttributes image_attributes(const Run& run, const SceneModel& model, const Sky& sky) {
  ImageAttributes attributes = image_attributes(model, sky);
  if (!run.plan) return attributes;
  for (auto [label, value] : run.plan->attributes()) {
    std::ranges::replace(label, ' ', '_');
    attributes.emplace_back("budget." + label, value);
  }
  return attributes;
}

void render(Run& run) {
  const CommandLine& line = run.line;
  const OutputOptions& output = run.scene.output;
  const bool spectral = output.channels.ends_with("+spectral");
  checking_input([&] {
    require_output(line.output, ".exr");
    if (spectral) require_output(line.spectral_output(), ".exr");
    if (line.preview) require_output(*line.preview, ".png");
  });
  warn_of_missing_light(run);

  run.choose_settings();
  const auto size = static_cast<std::size_t>(output.size);
  const auto across =
      static_cast<std::size_t>(map_width(map_projection(run.scene, 0.0), output.size));
  run.foretell(size * across);
  const SceneModel model = run.model();
  const std::unique_ptr<Sky> sky = run.sky(model);
  const SkyMap map = run.timed("map", [&] {
    return render_map(*sky,
                      colour_integrator(model, colour_observer_from_name(output.colour_observer)),
                      map_settings(model), run.control());
  });

  // From here on everything is written: either no file or all of them.
  run.timed("files", [&] {
    const MapProjection projection = map_projection(run.scene, model.sun_azimuth_rad);
    const ImageAttributes attributes = image_attributes(run, model, *sky);
    std::deque<AtomicFile> files;
    write_exr(files.emplace_back(line.output), map.colour, projection, attributes);
    if (spectral) {
      const bool rgb = output.channels.starts_with("rgb");
      write_spectral_exr(files.emplace_back(line.spectral_output()), *map.spectral,
                         rgb ? &map.colour : nullptr, projection, attributes);
    }
    if (line.preview) write_preview_png(files.emplace_back(*line.preview), map.colour);
    for (AtomicFile& file : files) file.commit();
    return true;
  });
  std::string files = line.output.string();
  if (spectral) files += ", " + line.spectral_output().string();
  if (line.preview) files += ", " + line.preview->string();
  run.summarise(model, *sky,
                {{"sky pixels", fmt::format("{}", map.sky_pixels)},
                 {"pixels moved into Rec. 709", fmt::format("{}", map.out_of_gamut_pixels)},
                 {"written", files}});
}

void radiance(Run& run) {
  const std::vector<View> views = views_of(run.line);
  run.choose_settings();
  run.foretell(views.size());
  const SceneModel model = run.model();
  const std::unique_ptr<Sky> sky = run.sky(model);

  CsvTable table({"view_elevation_deg", "relative_azimuth_deg", "wavelength_nm",
                  "radiance_w_m2_sr_nm", "standard_error", "degree_of_polarisation",
                  "stokes_q_w_m2_sr_nm", "stokes_u_w_m2_sr_nm"});
  run.timed("views", [&] {
    constexpr std::size_t kBatch = 256;  // views between two looks at Ctrl-C
    const std::span<const double> wavelength_nm = sky->wavelength_nm();
    for (std::size_t first = 0; first < views.size(); first += kBatch) {
      const std::size_t count = std::min(kBatch, views.size() - first);
      run.control().check();
      run.control().report("views", static_cast<double>(first) / static_cast<double>(views.size()));
      std::vector<ViewDirection> directions;
      for (std::size_t i = 0; i < count; ++i) directions.push_back(views[first + i].direction());
      const StokesRadiance light = sky->stokes(directions);
      // Empty cells where a solver knows no error or is scalar.
      const auto cell = [](const std::vector<double>& values, std::size_t at) {
        return values.empty() ? CsvTable::Cell("") : CsvTable::Cell(values[at] + 0.0);  // no "-0"
      };
      for (std::size_t i = 0; i < count; ++i) {
        const View& view = views[first + i];
        for (std::size_t w = 0; w < wavelength_nm.size(); ++w) {
          const std::size_t at = i * wavelength_nm.size() + w;
          table.add_row({view.elevation_deg, view.relative_azimuth_deg, wavelength_nm[w],
                         light.i[at], cell(light.standard_error, at),
                         light.q.empty() ? CsvTable::Cell("")
                                         : CsvTable::Cell(degree_of_polarisation(light, at)),
                         cell(light.q, at), cell(light.u, at)});
        }
      }
    }
    return true;
  });
  run.control().check();
  run.progress.clear();
  table.write("-", std::cout);
  run.summarise(model, *sky, {});
}

void aerial(Run& run) {
  const std::vector<View> views = views_of(run.line);
  run.choose_settings();
  run.foretell(2 * views.size() * run.line.distances_km.size());
  const SceneModel model = run.model();
  const std::unique_ptr<Sky> sky = run.sky(model);
  CsvTable table({"view_elevation_deg", "relative_azimuth_deg", "distance_km", "wavelength_nm",
                  "transmittance", "inscattered_radiance_w_m2_sr_nm"});
  run.timed("views", [&] {
    for (const View& view : views) {
      for (const double km : run.line.distances_km) {
        run.control().check();
        const auto light = sky->aerial_light(view.direction(), km);
        if (!light) {
          throw std::invalid_argument(fmt::format(
              "key 'solver.method' = \"{}\": must be one that knows aerial perspective: "
              "orders, preetham, nishita, hoffman-preetham or bruneton",
              run.scene.solver.method));
        }
        for (std::size_t w = 0; w < sky->wavelength_nm().size(); ++w) {
          table.add_row({view.elevation_deg, view.relative_azimuth_deg, km, sky->wavelength_nm()[w],
                         light->transmittance[w], light->inscattered[w]});
        }
      }
    }
    return true;
  });
  run.control().check();
  run.progress.clear();
  table.write("-", std::cout);
  run.summarise(model, *sky, {});
}

void irradiance(Run& run) {
  warn_of_missing_light(run);
  run.choose_settings();
  constexpr std::size_t kViews = 384;
  run.foretell(kViews);
  const SceneModel model = run.model();
  const std::unique_ptr<Sky> sky = run.sky(model);
  const Irradiance parts = run.timed("irradiance", [&] { return sky->irradiance(); });

  std::vector<double> global(parts.direct.size());
  std::ranges::transform(parts.direct, parts.diffuse, global.begin(), std::plus<>());
  const ColourIntegrator photopic = colour_integrator(model, ColourObserver::kCie1931);
  const auto lux = [&](std::span<const double> spectrum) {
    return illuminance_lux(photopic, spectrum, sky->solar_irradiance());
  };
  CsvTable table(
      {"wavelength_nm", "direct_w_m2_nm", "diffuse_w_m2_nm", "global_w_m2_nm", "illuminance_lux"});
  for (std::size_t w = 0; w < global.size(); ++w) {
    table.add_row(
        {sky->wavelength_nm()[w], parts.direct[w], parts.diffuse[w], global[w], lux(global)});
  }
  run.control().check();
  run.progress.clear();
  table.write("-", std::cout);
  run.summarise(model, *sky,
                {{"illuminance", fmt::format("{:.6g} lux, of which direct {:.6g}, diffuse {:.6g}",
                                             lux(global), lux(parts.direct), lux(parts.diffuse))}});
}

void solve(Run& run) {
  checking_input([&] {
    if (run.scene.solver.method != "orders") {
      throw std::invalid_argument(fmt::format(
          "{}: key 'solver.method' = \"{}\": must be \"orders\" for twilight solve; the "
          "other methods have no field",
          run.line.scene.string(), run.scene.solver.method));
    }
    require_output(run.line.field_output, ".nc");
  });
  run.choose_settings();
  run.foretell(0);
  const SceneModel model = run.model();
  const SolvedField solved = solve_field(model, run.control());
  run.timed("file", [&] {
    AtomicFile file(run.line.field_output);
    write_field(file, *solved.field, model);
    run.control().check();
    file.commit();
    return true;
  });
  run.summarise(solved.summary, {{"written", run.line.field_output.string()}});
}

}  // namespace twilight
