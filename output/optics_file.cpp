#include "output/optics_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "aerosols/optics_units.h"
#include "aerosols/particle_optics_file.h"
#include "output/atomic_file.h"
#include "output/csv_table.h"
#include "output/netcdf_writer.h"

namespace twilight {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;

using Element = std::vector<double> PhaseMatrix::*;
struct NamedElement {
  const char* name;
  Element element;
  const char* long_name;
};
constexpr NamedElement kElements[] = {
    {"p11", &PhaseMatrix::p11,
     "phase function: 1/2 integral of p11 sin(angle) d(angle) = 1, linear in angle"},
    {"p12", &PhaseMatrix::p12, "scattering matrix, element 12 = 21"},
    {"p33", &PhaseMatrix::p33, "scattering matrix, element 33 = 44"},
    {"p34", &PhaseMatrix::p34,
     "scattering matrix, element 34 = -43; Im(S2 S1*) for the time factor exp(-i omega t)"}};

void require_ending(const std::filesystem::path& path) {
  if (path.extension() == ".nc" || path.extension() == ".csv") return;
  throw std::invalid_argument(fmt::format("{}: must end in .nc (netCDF) or .csv", path.string()));
}

// Every angle of every matrix, rad.
std::vector<double> all_angles(std::span<const PhaseMatrix> matrices) {
  std::vector<double> angles;
  for (const PhaseMatrix& m : matrices) {
    if (m.angle_rad == angles) continue;
    angles.insert(angles.end(), m.angle_rad.begin(), m.angle_rad.end());
    std::ranges::sort(angles);
    const auto twice = std::ranges::unique(angles);
    angles.erase(twice.begin(), twice.end());
  }
  return angles;
}

std::vector<double> on_angles(const PhaseMatrix& m, Element element,
                              const std::vector<double>& angles) {
  const std::vector<double>& values = m.*element;
  if (m.angle_rad == angles) return values;
  std::vector<double> result;
  std::size_t i = 1;
  for (const double angle : angles) {
    while (i + 1 < values.size() && angle > m.angle_rad[i]) ++i;
    const double a = m.angle_rad[i - 1], b = m.angle_rad[i];
    result.push_back(
        std::lerp(values[i - 1], values[i], std::clamp((angle - a) / (b - a), 0.0, 1.0)));
  }
  return result;
}

// In degrees; rounding may not go beyond 180.
std::vector<double> degrees(const std::vector<double>& angles_rad) {
  std::vector<double> result;
  for (const double a : angles_rad) result.push_back(std::min(180.0, a * kDegPerRad));
  return result;
}

void describe(NetcdfWriter& file, std::string_view title, std::string_view history) {
  file.attribute("", "Conventions", "CF-1.10");
  file.attribute("", "title", title);
  file.attribute("", "source", "twilight");
  file.attribute("", "history", history);
}

void define_angles(NetcdfWriter& file, std::size_t count) {
  file.dimension("scattering_angle", count);
  file.variable("scattering_angle", NetcdfNumber::kDouble, {"scattering_angle"},
                {"degree", "scattering angle", "scattering_angle"});
}

void define_matrix(NetcdfWriter& file, std::vector<std::string> dimensions) {
  dimensions.emplace_back("scattering_angle");
  for (const NamedElement& e : kElements) {
    file.variable(e.name, NetcdfNumber::kDouble, dimensions, {"1", e.long_name, ""});
  }
}

void put_matrices(NetcdfWriter& file, std::span<const PhaseMatrix> matrices,
                  const std::vector<double>& angles) {
  file.put("scattering_angle", degrees(angles));
  for (const NamedElement& e : kElements) {
    std::vector<double> all;
    for (const PhaseMatrix& m : matrices) {
      const std::vector<double> values = on_angles(m, e.element, angles);
      all.insert(all.end(), values.begin(), values.end());
    }
    file.put(e.name, all);
  }
}

void write_particles_netcdf(const ParticleOptics& optics, const std::filesystem::path& path,
                            std::string_view history) {
  AtomicFile whole(path);
  NetcdfWriter file(whole);
  const std::string unit(coefficient_unit_text(optics.per));
  describe(file, fmt::format("optical properties of particles: {}", optics.name), history);
  file.attribute("", "format", kParticleOpticsFormat);
  file.attribute("", "particles", optics.name.empty() ? std::string_view("unnamed") : optics.name);
  file.attribute("", "coefficients_per", optics_per_text(optics.per));
  if (optics.dry_mass_ug_per_m3 > 0) {
    file.attribute("", "dry_mass_ug_per_m3", optics.dry_mass_ug_per_m3);
  }
  file.dimension("relative_humidity", optics.relative_humidity_percent.size());
  file.dimension("wavelength", optics.wavelength_nm.size());
  constexpr auto kDouble = NetcdfNumber::kDouble;
  file.variable("relative_humidity", kDouble, {"relative_humidity"},
                {"percent", "relative humidity over liquid water", "relative_humidity"});
  // Coefficients per particle or mass are no volume coefficients in air: CF has no name for them.
  const std::vector<std::string> state = {"relative_humidity", "wavelength"};
  file.variable("extinction_coefficient", kDouble, state, {unit, "extinction coefficient", ""});
  file.variable("scattering_coefficient", kDouble, state, {unit, "scattering coefficient", ""});
  file.variable("absorption_coefficient", kDouble, state, {unit, "absorption coefficient", ""});
  file.variable("single_scattering_albedo", kDouble, state,
                {"1", "single-scattering albedo",
                 "single_scattering_albedo_in_air_due_to_ambient_aerosol_particles"});
  file.variable("asymmetry_factor", kDouble, state,
                {"1", "mean cosine of the scattering angle",
                 "asymmetry_factor_of_ambient_aerosol_particles"});
  const std::vector<double> angles = all_angles(optics.phase);
  if (!angles.empty()) {
    define_angles(file, angles.size());
    define_matrix(file, state);
  }
  // The last in the file: one cut short reads as zeros, which are no wavelengths.
  file.variable("wavelength", kDouble, {"wavelength"},
                {"nm", "wavelength in vacuum", "radiation_wavelength"});
  file.end_definitions();
  file.put("relative_humidity", optics.relative_humidity_percent);
  file.put("wavelength", optics.wavelength_nm);
  std::vector<double> extinction, scattering, absorption, albedo, asymmetry;
  for (const ComponentOptics& o : optics.optics) {
    extinction.push_back(o.extinction_per_km());
    scattering.push_back(o.scattering_per_km);
    absorption.push_back(o.absorption_per_km);
    albedo.push_back(o.single_scattering_albedo());
    asymmetry.push_back(o.asymmetry);
  }
  file.put("extinction_coefficient", extinction);
  file.put("scattering_coefficient", scattering);
  file.put("absorption_coefficient", absorption);
  file.put("single_scattering_albedo", albedo);
  file.put("asymmetry_factor", asymmetry);
  if (!angles.empty()) put_matrices(file, optics.phase, angles);
  file.close();
  whole.commit();
}

void write_particles_csv(const ParticleOptics& optics, const std::filesystem::path& path,
                         std::string_view history) {
  std::string text =
      fmt::format("# {}\n# history = {}\n# particles = {}\n# coefficients_per = {}\n",
                  kParticleOpticsFormat, history, optics.name, optics_per_text(optics.per));
  if (optics.dry_mass_ug_per_m3 > 0) {
    text += fmt::format("# dry_mass_ug_per_m3 = {}\n", shortest_number(optics.dry_mass_ug_per_m3));
  }
  text += fmt::format("{}\n", kParticleOpticsColumns);
  for (std::size_t h = 0; h < optics.relative_humidity_percent.size(); ++h) {
    for (std::size_t w = 0; w < optics.wavelength_nm.size(); ++w) {
      const ComponentOptics& o = optics.optics[optics.index(h, w)];
      const std::string state = fmt::format(
          "{},{},{},{},{}", shortest_number(optics.relative_humidity_percent[h]),
          shortest_number(optics.wavelength_nm[w]), shortest_number(o.scattering_per_km),
          shortest_number(o.absorption_per_km), shortest_number(o.asymmetry));
      if (optics.phase.empty()) {
        text += state + ",,,,,\n";
        continue;
      }
      const PhaseMatrix& m = optics.phase[optics.index(h, w)];
      const std::vector<double> angles = degrees(m.angle_rad);
      for (std::size_t i = 0; i < angles.size(); ++i) {
        text += fmt::format("{},{},{},{},{},{}\n", state, shortest_number(angles[i]),
                            shortest_number(m.p11[i]), shortest_number(m.p12[i]),
                            shortest_number(m.p33[i]), shortest_number(m.p34[i]));
      }
    }
  }
  write_text_file(path, text);
}

// One quantity of every layer and wavelength.
struct LayerQuantity {
  const char* name;
  NetcdfMeaning meaning;
  double (*value)(const Medium&, std::size_t layer, std::size_t wavelength);
};

double aerosol_extinction(const Medium& m, std::size_t i, std::size_t w) {
  return m.aerosol_scattering_per_km(i, w) + m.aerosol_absorption_per_km(i, w);
}
double extinction(const Medium& m, std::size_t i, std::size_t w) {
  return m.air_scattering_per_km(i, w) + aerosol_extinction(m, i, w) +
         m.gas_absorption_per_km(i, w);
}
double thickness_km(const Medium& m, std::size_t i) {
  return m.boundary_km[i + 1] - m.boundary_km[i];
}

const std::vector<LayerQuantity>& layer_quantities() {
  static const std::vector<LayerQuantity> kQuantities = {
      {"extinction", {"km-1", "extinction by air, gases and aerosol", ""}, extinction},
      {"optical_depth",
       {"1", "vertical optical depth of the layer", ""},
       [](const Medium& m, std::size_t i, std::size_t w) {
         return extinction(m, i, w) * thickness_km(m, i);
       }},
      {"single_scattering_albedo",
       {"1", "single-scattering albedo of air, gases and aerosol together", ""},
       [](const Medium& m, std::size_t i, std::size_t w) {
         const double all = extinction(m, i, w);
         const double scattered = m.air_scattering_per_km(i, w) + m.aerosol_scattering_per_km(i, w);
         return all > 0 ? std::min(1.0, scattered / all) : 0.0;
       }},
      {"air_scattering",
       {"km-1", "Rayleigh scattering coefficient of air", ""},
       [](const Medium& m, std::size_t i, std::size_t w) { return m.air_scattering_per_km(i, w); }},
      {"gas_absorption",
       {"km-1", "absorption coefficient of ozone and nitrogen dioxide", ""},
       [](const Medium& m, std::size_t i, std::size_t w) { return m.gas_absorption_per_km(i, w); }},
      {"aerosol_extinction",
       {"km-1", "extinction coefficient of aerosol",
        "volume_extinction_coefficient_in_air_due_to_ambient_aerosol_particles"},
       aerosol_extinction},
      {"aerosol_scattering",
       {"km-1", "scattering coefficient of aerosol",
        "volume_scattering_coefficient_in_air_due_to_ambient_aerosol_particles"},
       [](const Medium& m, std::size_t i, std::size_t w) {
         return m.aerosol_scattering_per_km(i, w);
       }},
      {"aerosol_absorption",
       {"km-1", "absorption coefficient of aerosol", ""},
       [](const Medium& m, std::size_t i, std::size_t w) {
         return m.aerosol_absorption_per_km(i, w);
       }},
      {"aerosol_single_scattering_albedo",
       {"1", "single-scattering albedo of aerosol; 0 where there is none",
        "single_scattering_albedo_in_air_due_to_ambient_aerosol_particles"},
       [](const Medium& m, std::size_t i, std::size_t w) {
         const double all = aerosol_extinction(m, i, w);
         return all > 0 ? m.aerosol_scattering_per_km(i, w) / all : 0.0;
       }},
      {"aerosol_asymmetry",
       {"1", "mean cosine of the scattering angle of aerosol; 0 where there is none",
        "asymmetry_factor_of_ambient_aerosol_particles"},
       [](const Medium& m, std::size_t i, std::size_t w) { return m.aerosol_asymmetry(i, w); }},
      {"refractivity",
       {"1", "refractive index of air less 1", ""},
       [](const Medium& m, std::size_t i, std::size_t w) { return m.refractivity(i, w); }}};
  return kQuantities;
}

// Optical depths of the whole column.
struct ColumnQuantity {
  const char* name;
  NetcdfMeaning meaning;
  double (*value)(const Medium&, std::size_t layer, std::size_t wavelength);  // km^-1
};

const std::vector<ColumnQuantity>& column_quantities() {
  static const std::vector<ColumnQuantity> kQuantities = {
      {"column_optical_depth", {"1", "vertical optical depth of the layers", ""}, extinction},
      {"aerosol_optical_depth",
       {"1", "vertical optical depth of aerosol",
        "atmosphere_optical_thickness_due_to_ambient_aerosol_particles"},
       aerosol_extinction},
      {"aerosol_absorption_optical_depth",
       {"1", "vertical absorption optical depth of aerosol",
        "atmosphere_absorption_optical_thickness_due_to_ambient_aerosol_particles"},
       [](const Medium& m, std::size_t i, std::size_t w) {
         return m.aerosol_absorption_per_km(i, w);
       }}};
  return kQuantities;
}

std::vector<double> values_of(const Medium& m, const LayerQuantity& q) {
  std::vector<double> all;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < m.wavelengths(); ++w) all.push_back(q.value(m, i, w));
  }
  return all;
}

// State of the air by layer, where the medium has it.
struct StateQuantity {
  const char* name;
  NetcdfMeaning meaning;
  std::vector<double> Medium::*values;
};

const std::vector<StateQuantity>& state_quantities() {
  static const std::vector<StateQuantity> kQuantities = {
      {"air_pressure", {"hPa", "pressure", "air_pressure"}, &Medium::pressure_hpa},
      {"air_temperature", {"K", "temperature", "air_temperature"}, &Medium::temperature_k},
      {"relative_humidity",
       {"1", "relative humidity over liquid water", "relative_humidity"},
       &Medium::relative_humidity}};
  return kQuantities;
}

void define_scene(NetcdfWriter& file, const Medium& m, std::size_t angles) {
  constexpr auto kDouble = NetcdfNumber::kDouble;
  file.attribute("", "earth_radius_km", m.earth_radius_km);
  file.dimension("height", m.layers());
  file.dimension("wavelength", m.wavelengths());
  file.dimension("bounds", 2);
  file.variable("height", kDouble, {"height"},
                {"km", "middle of the layer above the ground", "height"});
  file.attribute("height", "positive", "up");
  file.attribute("height", "bounds", "height_bounds");
  file.variable("height_bounds", kDouble, {"height", "bounds"}, {});
  file.variable("wavelength", kDouble, {"wavelength"},
                {"nm", "wavelength in vacuum", "radiation_wavelength"});
  for (const StateQuantity& q : state_quantities()) {
    if (!(m.*q.values).empty()) file.variable(q.name, kDouble, {"height"}, q.meaning);
  }
  for (const LayerQuantity& q : layer_quantities()) {
    file.variable(q.name, kDouble, {"height", "wavelength"}, q.meaning);
  }
  for (const ColumnQuantity& q : column_quantities()) {
    file.variable(q.name, kDouble, {"wavelength"}, q.meaning);
  }
  file.variable("depolarisation", kDouble, {"wavelength"}, {"1", "depolarisation of air", ""});
  if (angles == 0) {
    file.attribute("", "aerosol_phase", "Henyey-Greenstein with aerosol_asymmetry");
    return;
  }
  file.dimension("aerosol_kind", m.aerosol_phase.size());
  file.variable("aerosol_kind_scattering", kDouble, {"aerosol_kind", "height", "wavelength"},
                {"km-1", "scattering coefficient of one kind of aerosol", ""});
  define_angles(file, angles);
  define_matrix(file, {"aerosol_kind", "wavelength"});
}

void put_scene(NetcdfWriter& file, const Medium& m) {
  std::vector<double> middle, bounds;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    middle.push_back(0.5 * (m.boundary_km[i] + m.boundary_km[i + 1]));
    bounds.insert(bounds.end(), {m.boundary_km[i], m.boundary_km[i + 1]});
  }
  file.put("height", middle);
  file.put("height_bounds", bounds);
  file.put("wavelength", m.wavelength_nm);
  file.put("depolarisation", m.depolarisation);
  for (const StateQuantity& q : state_quantities()) {
    if (!(m.*q.values).empty()) file.put(q.name, m.*q.values);
  }
  for (const LayerQuantity& q : layer_quantities()) file.put(q.name, values_of(m, q));
  for (const ColumnQuantity& q : column_quantities()) {
    std::vector<double> sum(m.wavelengths(), 0.0);
    for (std::size_t i = 0; i < m.layers(); ++i) {
      for (std::size_t w = 0; w < sum.size(); ++w) sum[w] += q.value(m, i, w) * thickness_km(m, i);
    }
    file.put(q.name, sum);
  }
}

void write_scene_netcdf(const Medium& m, const std::filesystem::path& path,
                        std::string_view history) {
  std::vector<PhaseMatrix> matrices;
  for (const auto& kind : m.aerosol_phase) {
    matrices.insert(matrices.end(), kind.begin(), kind.end());
  }
  const std::vector<double> angles = all_angles(matrices);
  AtomicFile whole(path);
  NetcdfWriter file(whole);
  describe(file, "optical properties of an atmosphere in layers", history);
  define_scene(file, m, angles.size());
  file.end_definitions();
  put_scene(file, m);
  if (!matrices.empty()) {
    std::vector<double> scattering;
    for (const LayerTable& kind : m.aerosol_kind_scattering_per_km) {
      for (std::size_t i = 0; i < m.layers(); ++i) {
        for (std::size_t w = 0; w < m.wavelengths(); ++w) scattering.push_back(kind(i, w));
      }
    }
    file.put("aerosol_kind_scattering", scattering);
    put_matrices(file, matrices, angles);
  }
  file.close();
  whole.commit();
}

CsvTable layer_table(const Medium& m, std::string_view history) {
  std::vector<std::string> columns = {"bottom_km", "top_km", "wavelength_nm"};
  for (const LayerQuantity& q : layer_quantities()) {
    columns.push_back(q.meaning.units == "km-1" ? std::string(q.name) + "_per_km" : q.name);
  }
  CsvTable table(std::move(columns));
  table.add_comment(history);
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      std::vector<CsvTable::Cell> row = {m.boundary_km[i], m.boundary_km[i + 1],
                                         m.wavelength_nm[w]};
      for (const LayerQuantity& q : layer_quantities()) row.emplace_back(q.value(m, i, w));
      table.add_row(row);
    }
  }
  return table;
}

CsvTable matrix_table(const Medium& m, std::string_view history) {
  CsvTable table({"aerosol_kind", "wavelength_nm", "angle_deg", "p11", "p12", "p33", "p34"});
  table.add_comment(history);
  for (std::size_t k = 0; k < m.aerosol_phase.size(); ++k) {
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      const PhaseMatrix& p = m.aerosol_phase[k][w];
      const std::vector<double> angles = degrees(p.angle_rad);
      for (std::size_t i = 0; i < angles.size(); ++i) {
        table.add_row({static_cast<double>(k), m.wavelength_nm[w], angles[i], p.p11[i], p.p12[i],
                       p.p33[i], p.p34[i]});
      }
    }
  }
  return table;
}

}  // namespace

void write_particle_optics(const ParticleOptics& optics, const std::filesystem::path& path,
                           std::string_view history) {
  require_ending(path);
  if (path.extension() == ".nc") {
    write_particles_netcdf(optics, path, history);
  } else {
    write_particles_csv(optics, path, history);
  }
}

std::vector<std::filesystem::path> write_scene_optics(const SceneModel& model,
                                                      const std::filesystem::path& path,
                                                      std::string_view history) {
  require_ending(path);
  if (path.extension() == ".nc") {
    write_scene_netcdf(model.medium, path, history);
    return {path};
  }
  write_text_file(path, layer_table(model.medium, history).text());
  if (model.medium.aerosol_phase.empty()) return {path};
  std::filesystem::path phases = path;
  phases.replace_extension(".phase.csv");
  write_text_file(phases, matrix_table(model.medium, history).text());
  return {path, phases};
}

}  // namespace twilight
