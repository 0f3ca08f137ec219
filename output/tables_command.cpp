#include "output/tables_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "output/command_line.h"
#include "output/table_file.h"
#include "sim/scene_file.h"

namespace twilight {
namespace {

constexpr std::string_view kHillaire = "hillaire2020";
const std::vector<double> kSkyViewSuns = {60, 30, 10, 5, 0, -3, -6, -9, -12};
const std::vector<double> kCheckSuns = {60, 30, 15,   10, 5,  2,   0,   -1,
                                        -2, -3, -4.5, -6, -9, -12, -15, -18};

void require_range(const char* option, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw std::invalid_argument(fmt::format("{} {}: must be in {}..{}", option, value, low, high));
}

TableManifest manifest_of(const SceneModel& model, const TableChannels& channels,
                          const TablesOptions& options, const std::string& scene_file) {
  TableManifest m;
  m.layout = options.layout;
  m.version = std::string(kVersion);
  m.scene_file = scene_file;
  m.spectrum = options.spectrum;
  m.unit = channels.unit();
  m.channel_names = {channels.names().begin(), channels.names().end()};
  m.wavelength_nm = channels.wavelength_nm();
  m.solved_wavelength_nm = model.medium.wavelength_nm;
  m.bottom_radius_km = model.medium.earth_radius_km;
  m.top_radius_km = m.bottom_radius_km + model.medium.top_km();
  m.physics = {
      {"solver", "twilight, method orders: all orders of scattering, polarised as the scene says"},
      {"view",
       "mu is the apparent zenith angle's cosine at the observer: rays are refracted; below "
       "the horizontal of a raised observer directions are stretched so that the refracted "
       "horizon lies at the straight one"},
      {"sun",
       "mu_s is the cosine of the geometric solar zenith angle, without refraction; nu that "
       "of the angle between the two"},
      {"ground",
       "scattering holds no light that the ground itself sends up the view ray; the air is "
       "lit by it (ground_albedo)"},
      {"transmittance",
       "of a channel: mean over its spectrum weighted with sunlight above the air"},
      {"filling", options.filling == "fitted"
                      ? "texels make the interpolated sky fit best, relatively, at and between the "
                        "nodes of mu_s and nu"
                      : "texels are the solver's values at their nodes"}};
  for (const auto& [key, value] : scene_settings(model.scene)) {
    if (key != "solver.threads") m.settings.emplace_back(key, value);
  }
  return m;
}

// Layer by layer, each coefficient as a channel's mean.
std::vector<TableManifest::Layer> air_of(const TableSource& source) {
  const Medium& m = source.model.medium;
  std::vector<TableManifest::Layer> layers;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    const auto mean = [&](const LayerTable& table) {
      std::vector<double> spectrum;
      for (std::size_t w = 0; w < m.wavelengths(); ++w) spectrum.push_back(table(i, w));
      ChannelTriple channels = source.channels.mean(spectrum);
      for (double& value : channels) value = std::max(value, 0.0);
      return channels;
    };
    layers.push_back({m.boundary_km[i], m.boundary_km[i + 1], mean(m.air_scattering_per_km),
                      mean(m.aerosol_scattering_per_km), mean(m.aerosol_absorption_per_km),
                      mean(m.gas_absorption_per_km)});
  }
  return layers;
}

SkyTableOptions table_options(const TablesOptions& options) {
  SkyTableOptions out;
  out.storage = options.separate_mie ? MieStorage::kSeparate : MieStorage::kCombined;
  out.filling = options.filling == "nodes" ? TableFilling::kNodes : TableFilling::kFitted;
  out.mie_g = options.mie_g;
  out.sun_scale = options.layout == "twilight";
  return out;
}

TablesOutcome make_hillaire(const TableSource& source, const TablesOptions& options,
                            TableManifest manifest, const RunControl& control) {
  const Hillaire2020Layout layout(Hillaire2020Layout::Sizes{}.scaled(options.scale),
                                  manifest.bottom_radius_km, manifest.top_radius_km);
  const HillaireTables tables = fill_hillaire_tables(
      source, layout, options.suns.empty() ? kSkyViewSuns : options.suns, control);
  manifest.mappings = layout.formulas();
  manifest.sun_elevation_deg = tables.sun_elevation_deg;
  manifest.constants = table_constants(source, table_options(options));
  TablesOutcome out;
  if (options.check) {
    for (const bool half : {false, true}) {
      const auto rows = sky_view_errors(
          source, layout, tables, fmt::format("x{:g}{}", options.scale, half ? " half" : ""), half);
      out.errors.insert(out.errors.end(), rows.begin(), rows.end());
    }
  }
  manifest.errors = out.errors;
  out.figures = {{"tables filled in", fmt::format("{:.1f} s", tables.seconds)}};
  out.files = write_table_set(options.directory, textures_of(tables), manifest, nullptr, nullptr,
                              options.half);
  return out;
}

void add_errors(const TableTruth& truth, const std::string& name, const TableLayout& layout,
                const SkyTables& tables, std::vector<TableError>& out) {
  for (const bool half : {false, true}) {
    const auto rows = truth.errors(name + (half ? " half" : ""), layout, tables, half);
    out.insert(out.end(), rows.begin(), rows.end());
  }
}

}  // namespace

void require_tables(const TablesOptions& options, const Scene& scene) {
  std::vector<std::string> names = layout_names();
  names.emplace_back(kHillaire);
  if (std::ranges::find(names, options.layout) == names.end()) {
    throw std::invalid_argument(
        fmt::format("--layout {}: must be one of {}", options.layout, fmt::join(names, ", ")));
  }
  (void)table_spectrum_from_name(options.spectrum);
  if (options.filling != "fitted" && options.filling != "nodes") {
    throw std::invalid_argument(
        fmt::format("--filling {}: must be one of fitted, nodes", options.filling));
  }
  std::vector<std::string> named;
  for (const double sun : options.suns) {
    require_range("--suns", sun, -90, 90);
    named.push_back(fmt::format("{:+g}", sun + 0.0));
    if (std::ranges::count(named, named.back()) == 1) continue;
    throw std::invalid_argument(
        fmt::format("--suns {}: is there twice: files are named by {}", sun, named.back()));
  }
  for (const double scale : options.check_scales) require_range("--check-scales", scale, 0.1, 4);
  require_range("--scale", options.scale, 0.1, 4);
  if (options.mie_g) require_range("--mie-g", *options.mie_g, -0.99, 0.99);
  if (options.layout == kHillaire) {
    if (options.mu_s_min_deg != 0 || options.separate_mie || options.mie_g) {
      throw std::invalid_argument(
          "--mu-s-min-deg, --separate-mie, --mie-g: hillaire2020 has no scattering table");
    }
  } else {
    (void)make_layout(options.layout, {}, 6371, 6471, options.mu_s_min_deg);
  }
  if (scene.solver.method != "orders") {
    throw std::invalid_argument(fmt::format(
        "key 'solver.method' = \"{}\": must be \"orders\" for tables (--set solver.method=orders)",
        scene.solver.method));
  }
  if (observer_altitude_km(scene) > scene.atmosphere.top_km) {
    throw std::invalid_argument(
        fmt::format("key 'observer.height_m' = {}: must be inside the air, below atmosphere.top_km",
                    scene.observer.height_m));
  }
  require_table_folder(options.directory);
}

TablesOutcome make_tables(const SceneModel& model, const OrdersSky& sky,
                          const TablesOptions& options, const std::string& scene_file,
                          const RunControl& control) {
  const TableChannels channels(model, table_spectrum_from_name(options.spectrum));
  const TableSource source{model, sky, channels};
  TableManifest manifest = manifest_of(model, channels, options, scene_file);
  manifest.air = air_of(source);
  if (options.layout == kHillaire) {
    return make_hillaire(source, options, std::move(manifest), control);
  }
  const auto layout_of = [&](double scale) {
    return make_layout(options.layout, LayoutSizes{}.scaled(scale), manifest.bottom_radius_km,
                       manifest.top_radius_km, options.mu_s_min_deg);
  };
  const auto layout = layout_of(options.scale);
  const SkyTables tables = fill_sky_tables(source, *layout, table_options(options), control);
  manifest.mappings = layout->formulas();
  TablesOutcome out;
  if (options.check) {
    control.report("check", 0);
    const TableTruth truth(source, options.suns.empty() ? kCheckSuns : options.suns);
    add_errors(truth, fmt::format("x{:g}", options.scale), *layout, tables, out.errors);
    for (const double scale : options.check_scales) {
      const auto other = layout_of(scale);
      const SkyTables part =
          fill_sky_tables(source, *other, table_options(options), control,
                          slices_about(*other, observer_altitude_km(model.scene)));
      add_errors(truth, fmt::format("x{:g}", scale), *other, part, out.errors);
    }
  }
  manifest.errors = out.errors;
  control.check();
  out.files = write_table_set(options.directory, textures_of(tables), manifest, &tables,
                              layout.get(), options.half);
  out.figures = {
      {"tables filled in", fmt::format("{:.1f} s", tables.seconds)},
      {"g of the renderer's Mie phase function", fmt::format("{:.2f}", tables.constants.mie_g)},
      {"lowest Sun in the tables",
       fmt::format("{:.2f} deg", std::asin(layout->scattering_mu_s(0)) * 57.29577951308232)}};
  return out;
}

}  // namespace twilight
