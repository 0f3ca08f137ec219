#include "output/optics_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <iostream>
#include <stdexcept>
#include <string>
#include <vector>

#include "aerosols/component_table.h"
#include "aerosols/components.h"
#include "output/command_run.h"
#include "output/csv_table.h"
#include "output/optics_file.h"
#include "sim/solver_arena.h"

namespace twilight {
namespace {

void print_layers(Run& run) {
  const SceneModel model = run.model();
  const Medium& medium = model.medium;
  CsvTable table({"bottom_km", "top_km", "pressure_hpa", "temperature_k",
                  "relative_humidity_percent", "wavelength_nm", "refractive_index",
                  "air_scattering_per_km", "aerosol_scattering_per_km", "aerosol_absorption_per_km",
                  "aerosol_asymmetry", "gas_absorption_per_km"});
  // A user's own layers have no state of the air.
  const auto state = [](const std::vector<double>& values, std::size_t layer) {
    return values.empty() ? CsvTable::Cell("") : CsvTable::Cell(values[layer]);
  };
  std::vector<double> humidity_percent = medium.relative_humidity;
  for (double& percent : humidity_percent) percent *= 100.0;
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    for (std::size_t w = 0; w < medium.wavelengths(); ++w) {
      table.add_row({medium.boundary_km[i], medium.boundary_km[i + 1],
                     state(medium.pressure_hpa, i), state(medium.temperature_k, i),
                     state(humidity_percent, i), medium.wavelength_nm[w],
                     1.0 + medium.refractivity(i, w), medium.air_scattering_per_km(i, w),
                     medium.aerosol_scattering_per_km(i, w), medium.aerosol_absorption_per_km(i, w),
                     medium.aerosol_asymmetry(i, w), medium.gas_absorption_per_km(i, w)});
    }
  }
  run.control().check();
  table.write("-", std::cout);
}

std::filesystem::path component_file(const std::filesystem::path& file, std::string_view code) {
  std::filesystem::path named = file;
  named.replace_filename(
      fmt::format("{}_{}{}", file.stem().string(), code, file.extension().string()));
  return named;
}

void require_export(const OpticsOptions& options) {
  checking_input([&] {
    if (!options.export_file) {
      throw std::invalid_argument("--components: must be given together with --export FILE");
    }
    const std::filesystem::path& file = *options.export_file;
    const std::string ending = file.extension().string();
    if (ending != ".nc" && ending != ".csv") {
      throw std::invalid_argument(
          fmt::format("--export {}: must end in .nc (netCDF) or .csv", file.string()));
    }
    require_output(file, ending);
  });
}

}  // namespace

void optics(Run& run) {
  const OpticsOptions& options = run.line.optics;
  if (!options.export_file && !options.components) return print_layers(run);
  require_export(options);
  const std::string history = fmt::format("twilight {}, {}", kVersion, run.line.scene.string());
  std::vector<std::string> files;
  if (!options.components) {
    const SceneModel model = run.model();
    run.control().check();
    for (const auto& file : write_scene_optics(model, *options.export_file, history)) {
      files.push_back(file.string());
    }
  } else {
    const std::vector<double>& wavelengths = solved_wavelengths_nm(run.scene.spectrum);
    SolverArena arena(run.scene.solver.threads);
    std::vector<ParticleOptics> tables;  // all first: a run that is stopped writes nothing
    for (std::size_t c = 0; c < kAerosolComponents; ++c) {
      run.progress.report("components",
                          static_cast<double>(c) / static_cast<double>(kAerosolComponents));
      arena.arena.execute([&] {
        tables.push_back(component_table(static_cast<AerosolComponent>(c), wavelengths,
                                         [&] { run.control().check(); }));
      });
    }
    for (const ParticleOptics& table : tables) {
      const auto file = component_file(*options.export_file, table.name);
      write_particle_optics(table, file, history);
      files.push_back(file.string());
    }
    run.progress.clear();
  }
  run.log.info("total {:.1f} s; written: {}", run.clock.seconds(), fmt::join(files, ", "));
}

}  // namespace twilight
