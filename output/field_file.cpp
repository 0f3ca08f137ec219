#include "output/field_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "atmosphere/netcdf_reader.h"
#include "output/checksum.h"
#include "output/command_line.h"
#include "output/netcdf_writer.h"
#include "sim/scene_aerosols.h"
#include "sim/scene_file.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

constexpr const char* kTitle = "Multiply scattered light of a clear twilight sky";
constexpr const char* kChecksum = "checksum_fnv1a64";
constexpr const char* kMixtureChecksum = "aerosol_mixture_fnv1a64";
constexpr std::size_t kCoherencyComponents = 4;
constexpr double kSameMedium = 1e-9;  // relative: another compiler may round differently

using Sizes = std::map<std::string, std::size_t, std::less<>>;  ///< of the dimensions

/// One variable of the file: its numbers, their shape and meaning.
struct Variable {
  const char* name;
  std::vector<const char*> dimensions;
  std::variant<std::vector<float>*, std::vector<double>*> values;
  const char* units;
  const char* long_name;
  const char* standard_name = "";
};

/// What the file holds beside the field: the medium it was solved for, as flat arrays.
struct FieldMedium {
  std::vector<double> boundary_km, ground_albedo, depolarisation;
  std::vector<double> air_scattering, aerosol_scattering, aerosol_absorption, aerosol_asymmetry,
      gas_absorption, refractivity;
};

FieldMedium field_medium(const SceneModel& model) {
  const Medium& m = model.medium;
  const auto flat = [&](const LayerTable& table) {
    std::vector<double> values;
    values.reserve(table.size());
    for (std::size_t i = 0; i < m.layers(); ++i) {
      for (std::size_t w = 0; w < m.wavelengths(); ++w) values.push_back(table(i, w));
    }
    return values;
  };
  FieldMedium flattened{m.boundary_km,
                        model.ground_albedo,
                        m.depolarisation,
                        flat(m.air_scattering_per_km),
                        flat(m.aerosol_scattering_per_km),
                        flat(m.aerosol_absorption_per_km),
                        flat(m.aerosol_asymmetry),
                        flat(m.gas_absorption_per_km),
                        flat(m.refractivity)};
  if (flattened.ground_albedo.empty()) {
    flattened.ground_albedo.assign(m.wavelengths(), model.scene.earth.ground_albedo);
  }
  return flattened;
}

// The one list of the field's arrays, for writing and for reading.
std::vector<Variable> field_variables(OrdersField& f) {
  std::vector<Variable> all = {
      {"wavelength", {"wavelength"}, &f.wavelength_nm, "nm", "wavelength", "radiation_wavelength"},
      {"altitude", {"altitude"}, &f.altitude_km, "km", "height above the ground sphere", "height"},
      {"solar_zenith_rad",
       {"solar_zenith_angle"},
       &f.solar_zenith_rad,
       "radian",
       "solar zenith angle at the point, exactly as solved",
       "solar_zenith_angle"},
      {"coherency",
       {"altitude", "solar_zenith_angle", "coherency_component", "wavelength"},
       &f.coherency,
       "1",
       "integral over all directions of the polarisation tensor of the incoming scattered light: "
       "xx, yy, zz, xz, per unit solar irradiance; z up, x towards the Sun"},
      {"ground_irradiance",
       {"solar_zenith_angle", "wavelength"},
       &f.ground_irradiance,
       "1",
       "diffuse irradiance of the horizontal ground per unit solar irradiance"},
  };
  // A dimension of no length means another thing in netCDF.
  if (!f.order_share.empty()) {
    all.push_back({"order_share",
                   {"scattering_order", "wavelength"},
                   &f.order_share,
                   "1",
                   "share of each order in the mean radiance at the ground, solar zenith angle 96 "
                   "degrees"});
  }
  if (f.aerosol_levels > 0) {
    all.push_back({"aerosol_moments",
                   {"aerosol_altitude", "solar_zenith_angle", "aerosol_moment", "wavelength"},
                   &f.aerosol_moments,
                   "1",
                   "moments of the incoming scattered light in generalised spherical functions, "
                   "levels inside the aerosol, per unit solar irradiance"});
  }
  return all;
}

std::vector<Variable> medium_variables(FieldMedium& m) {
  const std::vector<const char*> table = {"layer", "wavelength"};
  return {
      {"layer_boundary",
       {"layer_boundary"},
       &m.boundary_km,
       "km",
       "boundaries of the layers",
       "height"},
      {"ground_albedo",
       {"wavelength"},
       &m.ground_albedo,
       "1",
       "Lambertian reflectance of the ground",
       "surface_albedo"},
      {"depolarisation", {"wavelength"}, &m.depolarisation, "1", "depolarisation ratio of air"},
      {"air_scattering", table, &m.air_scattering, "km-1", "scattering coefficient of air"},
      {"aerosol_scattering", table, &m.aerosol_scattering, "km-1",
       "scattering coefficient of the aerosol"},
      {"aerosol_absorption", table, &m.aerosol_absorption, "km-1",
       "absorption coefficient of the aerosol"},
      {"aerosol_asymmetry", table, &m.aerosol_asymmetry, "1", "asymmetry parameter of the aerosol"},
      {"gas_absorption", table, &m.gas_absorption, "km-1",
       "absorption coefficient of ozone and nitrogen dioxide"},
      {"refractivity", table, &m.refractivity, "1", "refractive index minus one"},
  };
}

Sizes sizes_of(const OrdersField& f, std::size_t layers) {
  Sizes sizes = {{"wavelength", f.wavelength_nm.size()},
                 {"altitude", f.altitude_km.size()},
                 {"solar_zenith_angle", f.solar_zenith_rad.size()},
                 {"coherency_component", kCoherencyComponents},
                 {"layer", layers},
                 {"layer_boundary", layers + 1}};
  if (!f.order_share.empty()) {
    sizes["scattering_order"] = f.order_share.size() / f.wavelength_nm.size();
  }
  if (f.aerosol_levels > 0) {
    sizes["aerosol_altitude"] = f.aerosol_levels;
    sizes["aerosol_moment"] = f.moments_per_node;
  }
  return sizes;
}

std::size_t count_of(const Variable& variable, const Sizes& sizes) {
  std::size_t count = 1;
  for (const char* dimension : variable.dimensions) count *= sizes.find(dimension)->second;
  return count;
}

// Of the numbers' bytes: a file cut short reads as zeros otherwise.
template <class Number>
std::string checksum_of(const std::vector<Number>& values) {
  return fnv1a64(std::as_bytes(std::span(values)));
}

// Threads change no byte of the field, so they change none of the file.
Scene without_threads(Scene scene) {
  scene.solver.threads = 0;
  return scene;
}

void define(NetcdfWriter& writer, const Variable& variable) {
  std::visit(
      [&](const auto* values) {
        using Number = typename std::remove_pointer_t<decltype(values)>::value_type;
        writer.variable(
            variable.name,
            sizeof(Number) == sizeof(float) ? NetcdfNumber::kFloat : NetcdfNumber::kDouble,
            {variable.dimensions.begin(), variable.dimensions.end()},
            {variable.units, variable.long_name, variable.standard_name});
        writer.attribute(variable.name, kChecksum, checksum_of(*values));
      },
      variable.values);
}

int whole_number(const NetcdfReader& reader, const char* name, int low, int high) {
  const double value = reader.required_number("", name);
  if (!(value >= low && value <= high) || value != std::floor(value)) {
    reader.refuse(fmt::format("global attribute '{}' = {}: must be a whole number in {}..{}", name,
                              value, low, high));
  }
  return static_cast<int>(value);
}

void read(const NetcdfReader& reader, const Variable& variable) {
  const auto wrong = [&](std::string_view what) { reader.refuse_variable(variable.name, what); };
  const std::vector<std::string> held = reader.dimensions(variable.name);
  if (!std::ranges::equal(held, variable.dimensions)) {
    wrong(fmt::format("has the dimensions ({}): must have ({})", fmt::join(held, ", "),
                      fmt::join(variable.dimensions, ", ")));
  }
  std::visit(
      [&](auto* values) {
        using Number = typename std::remove_pointer_t<decltype(values)>::value_type;
        constexpr bool kFloat = sizeof(Number) == sizeof(float);
        if (reader.type(variable.name) != (kFloat ? NetcdfType::kFloat : NetcdfType::kDouble)) {
          wrong(fmt::format("must hold {} numbers", kFloat ? "float" : "double"));
        }
        if constexpr (kFloat) {
          *values = reader.floats(variable.name, false);
        } else {
          *values = reader.numbers(variable.name, false);
        }
        if (reader.required_text(variable.name, kChecksum) != checksum_of(*values)) {
          wrong("is damaged: its checksum is another");
        }
        if (!std::ranges::all_of(*values, [](Number v) { return std::isfinite(v); })) {
          wrong("holds a value that is not finite");
        }
      },
      variable.values);
}

bool shapes_the_field(std::string_view key) {
  constexpr std::string_view kTables[] = {"earth.",     "atmosphere.",          "aerosols.",
                                          "spectrum.",  "two_constituent_air.", "volcanic_sulfate.",
                                          "dust_layer."};
  constexpr std::string_view kKeys[] = {"solver.method",
                                        "solver.scattering_orders",
                                        "solver.ground_light",
                                        "solver.zenith_step_deg",
                                        "solver.altitude_levels",
                                        "solver.polar_directions",
                                        "solver.azimuth_directions",
                                        "solver.phase_degree",
                                        "solver.order_tolerance",
                                        "solver.single_precision",
                                        "solver.coarse_orders",
                                        "solver.sunlight_nodes",
                                        "solver.darkest_zenith_deg"};
  if (key == "earth.radius_km") return false;  // compared as resolved
  return std::ranges::find(kKeys, key) != std::end(kKeys) ||
         std::ranges::any_of(kTables, [&](std::string_view t) { return key.starts_with(t); });
}

// The keys a field depends on, as the solver takes them.
std::map<std::string, std::string> field_settings(const Scene& scene) {
  std::map<std::string, std::string> settings;
  for (const auto& [key, value] : scene_settings(scene)) {
    if (shapes_the_field(key)) settings[key] = value;
  }
  settings["sun.disc_average"] = disc_averaged(scene) ? "true" : "false";
  settings["solver.polarisation"] = polarised(scene) ? "true" : "false";
  if (scene.atmosphere.optical_layers) {
    settings["atmosphere.optical_layers"] = "a file of layers";  // compared layer by layer
  } else {
    if (scene.atmosphere.profile_file) {
      settings["atmosphere.profile_file"] = "a file of a profile";  // its medium is compared
    }
    settings["aerosols.phase"] = mie_phase(scene) ? "mie" : "henyey-greenstein";
  }
  for (const char* table : {"volcanic_sulfate", "dust_layer"}) {
    if (settings[fmt::format("{}.optical_depth_550nm", table)] != "0") continue;
    settings.erase(fmt::format("{}.bottom_km", table));
    settings.erase(fmt::format("{}.top_km", table));
  }
  if (scene.aerosols.mixture) settings["aerosols.mixture"] = "a mixture file";  // by its checksum
  return settings;
}

void require_same_scene(const std::string& file, const Scene& stored, const Scene& scene) {
  auto theirs = field_settings(stored), ours = field_settings(scene);
  if (theirs.contains("earth.albedo_spectrum") || ours.contains("earth.albedo_spectrum")) {
    theirs.erase("earth.ground_albedo");  // a spectrum stands in its place
    ours.erase("earth.ground_albedo");
  }
  if (theirs["aerosols.mixture"] != ours["aerosols.mixture"]) {
    theirs.erase("aerosols.type");  // a mixture stands in its place
    ours.erase("aerosols.type");
  }
  const auto shown = [](const std::map<std::string, std::string>& settings,
                        const std::string& key) {
    const auto it = settings.find(key);
    return it == settings.end() ? std::string("not set") : it->second;
  };
  // In the order of the scene file, so that the plainest difference is told first.
  for (const SceneKey& scene_key : scene_keys()) {
    const std::string key(scene_key.name);
    const std::string a = shown(theirs, key), b = shown(ours, key);
    if (a == b) continue;
    throw std::invalid_argument(fmt::format(
        "{}: was solved with key '{}' = {}, the scene has {}: must be equal", file, key, a, b));
  }
}

// What the scattering matrices depend on beside the scene's keys; empty without a mixture file.
std::string mixture_checksum(const Scene& scene) {
  const std::vector<fs::path> files = aerosol_files(scene);
  return files.empty() ? std::string() : fnv1a64_of_files(files);
}

void require_same_mixture(const NetcdfReader& reader, const Scene& scene) {
  const std::string own = mixture_checksum(scene);
  if (own.empty() || reader.required_text("", kMixtureChecksum) == own) return;
  throw std::invalid_argument(
      fmt::format("{}: was solved with another mixture: the file of key 'aerosols.mixture' = "
                  "\"{}\", or one it names, holds something else now: must be equal",
                  reader.name(), *scene.aerosols.mixture));
}

bool same(double a, double b) {
  return std::abs(a - b) <= kSameMedium * std::max(std::abs(a), std::abs(b)) + 1e-300;
}

void require_same_medium(const std::string& file, FieldMedium& stored, FieldMedium& model) {
  const auto theirs = medium_variables(stored), ours = medium_variables(model);
  for (std::size_t k = 0; k < ours.size(); ++k) {
    const auto& a = *std::get<std::vector<double>*>(theirs[k].values);
    const auto& b = *std::get<std::vector<double>*>(ours[k].values);
    const std::string what = fmt::format(
        "{}: was solved for another medium (tables, optical_layers or profile_file changed since): "
        "variable '{}'",
        file, ours[k].name);
    if (a.size() != b.size()) {
      throw std::invalid_argument(
          fmt::format("{} has {} values, the scene's {}", what, a.size(), b.size()));
    }
    for (std::size_t i = 0; i < a.size(); ++i) {
      if (same(a[i], b[i])) continue;
      throw std::invalid_argument(fmt::format("{}, value {} of {}, is {}, the scene's {}", what,
                                              i + 1, a.size(), a[i], b[i]));
    }
  }
}

void require_increasing(const NetcdfReader& reader, const char* name,
                        const std::vector<double>& values) {
  if (values.size() < 2 && std::string_view(name) != "wavelength") {
    reader.refuse(
        fmt::format("variable '{}' has {} values: must have 2 or more", name, values.size()));
  }
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (!(values[i] > values[i - 1])) {
      reader.refuse(fmt::format("variable '{}' does not increase at value {} of {}", name, i + 1,
                                values.size()));
    }
  }
}

}  // namespace

void write_field(AtomicFile& file, const OrdersField& field, const SceneModel& model) {
  // The list of arrays serves reading too, so it points at what may be changed.
  OrdersField copy = field;
  FieldMedium medium = field_medium(model);
  const Sizes sizes = sizes_of(copy, model.medium.layers());
  std::vector<double> zenith_deg = copy.solar_zenith_rad;
  for (double& angle : zenith_deg) angle *= 180.0 / std::numbers::pi;

  std::vector<Variable> variables = field_variables(copy);
  variables.push_back({"solar_zenith_angle",
                       {"solar_zenith_angle"},
                       &zenith_deg,
                       "degree",
                       "solar zenith angle at the point, without refraction",
                       "solar_zenith_angle"});
  for (const Variable& v : medium_variables(medium)) variables.push_back(v);
  for (const Variable& v : variables) {
    std::visit(
        [&](const auto* values) {
          if (values->size() != count_of(v, sizes)) {
            throw std::logic_error(
                fmt::format("{}: variable '{}' has {} values; its dimensions "
                            "make {}",
                            file.temporary().string(), v.name, values->size(), count_of(v, sizes)));
          }
          if (!std::ranges::all_of(*values, [](auto x) { return std::isfinite(x); })) {
            throw std::logic_error(fmt::format("{}: variable '{}' holds a value that is not finite",
                                               file.temporary().string(), v.name));
          }
        },
        v.values);
  }

  NetcdfWriter writer(file);
  for (const auto& [name, size] : sizes) writer.dimension(name, size);
  writer.attribute("", "Conventions", "CF-1.10");
  writer.attribute("", "title", kTitle);
  writer.attribute("", "source",
                   fmt::format("twilight {}, successive orders of scattering", kVersion));
  writer.attribute("", "comment",
                   "Light scattered or reflected at least once, at every altitude and solar zenith "
                   "angle of one spherically symmetric atmosphere. Read by twilight --field.");
  writer.attribute("", "twilight_version", kVersion);
  writer.attribute("", "scene", to_toml(without_threads(model.scene)));
  if (const std::string mixture = mixture_checksum(model.scene); !mixture.empty()) {
    writer.attribute("", kMixtureChecksum, mixture);
  }
  writer.attribute("", "earth_radius_km", model.medium.earth_radius_km);
  writer.attribute("", "zenith_step_deg", copy.zenith_step_deg);
  writer.attribute("", "phase_degree", copy.phase_degree);
  writer.attribute("", "polarised", copy.polarised ? 1 : 0);
  writer.attribute("", "orders", copy.orders);
  for (const Variable& v : variables) define(writer, v);
  writer.end_definitions();
  for (const Variable& v : variables) {
    std::visit([&](const auto* values) { writer.put(v.name, std::span(*values)); }, v.values);
  }
  writer.close();
}

void write_field(const fs::path& path, const OrdersField& field, const SceneModel& model) {
  AtomicFile file(path);
  write_field(file, field, model);
  file.commit();
}

OrdersField read_field(const fs::path& path, const SceneModel& model) {
  const NetcdfReader reader(path, "field");
  if (reader.required_text("", "title") != kTitle) {
    reader.refuse(
        fmt::format("global attribute 'title' is not \"{}\": not a field that `twilight "
                    "solve` wrote",
                    kTitle));
  }
  if (model.scene.solver.method != "orders") {
    throw std::invalid_argument(
        fmt::format("{}: is a field of solver.method \"orders\"; the scene's key 'solver.method' = "
                    "\"{}\" must be \"orders\"",
                    reader.name(), model.scene.solver.method));
  }
  const Scene stored =
      parse_scene(reader.required_text("", "scene"), reader.name() + " (attribute 'scene')");
  require_same_scene(reader.name(), stored, model.scene);
  require_same_mixture(reader, model.scene);
  const double radius_km = reader.required_number("", "earth_radius_km");
  if (!same(radius_km, model.medium.earth_radius_km)) {
    throw std::invalid_argument(
        fmt::format("{}: was solved with the Earth's radius {} km, the scene resolves key "
                    "'earth.radius_km' to {}: must be equal; set earth.radius_km = {} to use this "
                    "field for other places and times",
                    reader.name(), radius_km, model.medium.earth_radius_km, radius_km));
  }

  OrdersField field;
  field.zenith_step_deg = reader.required_number("", "zenith_step_deg");
  field.phase_degree = whole_number(reader, "phase_degree", 0, 1000);
  field.polarised = whole_number(reader, "polarised", 0, 1) == 1;
  field.orders = whole_number(reader, "orders", 0, 1000000);
  field.aerosol_levels = reader.size("aerosol_altitude");
  field.moments_per_node = reader.size("aerosol_moment");
  field.order_share.resize(reader.size("scattering_order"));  // its variable is in the list
  for (const Variable& variable : field_variables(field)) read(reader, variable);
  FieldMedium medium, own = field_medium(model);
  for (const Variable& variable : medium_variables(medium)) read(reader, variable);
  require_same_medium(reader.name(), medium, own);

  require_increasing(reader, "wavelength", field.wavelength_nm);
  require_increasing(reader, "altitude", field.altitude_km);
  require_increasing(reader, "solar_zenith_rad", field.solar_zenith_rad);
  if (field.wavelength_nm != model.medium.wavelength_nm) {
    reader.refuse("variable 'wavelength' disagrees with the scene in its attribute 'scene'");
  }
  if (reader.size("coherency_component") != kCoherencyComponents) {
    reader.refuse(fmt::format("variable 'coherency' has {} components: must have {}",
                              reader.size("coherency_component"), kCoherencyComponents));
  }
  if (field.aerosol_levels > field.altitude_km.size()) {
    reader.refuse(
        fmt::format("variable 'aerosol_moments' has {} levels, more than the {} of "
                    "'altitude'",
                    field.aerosol_levels, field.altitude_km.size()));
  }
  const auto degree = static_cast<std::size_t>(field.phase_degree);
  const std::size_t moments = (degree + 1) * (degree + 2) / 2 * (field.polarised ? 3 : 1);
  if (field.aerosol_levels > 0 && field.moments_per_node != moments) {
    reader.refuse(
        fmt::format("variable 'aerosol_moments' has {} moments: must have {}, for "
                    "phase_degree {}",
                    field.moments_per_node, moments, field.phase_degree));
  }
  return field;
}

}  // namespace twilight
