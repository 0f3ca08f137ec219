#include "output/table_file.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <deque>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "output/atomic_file.h"
#include "output/exr_image.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
static_assert(std::endian::native == std::endian::little, "tables are little-endian");

ordered_json named(const std::vector<std::pair<std::string, std::string>>& pairs) {
  ordered_json out = ordered_json::object();
  for (const auto& [name, value] : pairs) out[name] = value;
  return out;
}

ordered_json sizes_of(const LayoutSizes& n) {
  return {{"transmittance_mu", n.transmittance_mu},
          {"transmittance_r", n.transmittance_r},
          {"irradiance_mu_s", n.irradiance_mu_s},
          {"irradiance_r", n.irradiance_r},
          {"scattering_r", n.r},
          {"scattering_mu", n.mu},
          {"scattering_mu_s", n.mu_s},
          {"scattering_nu", n.nu}};
}

ordered_json errors_of(const std::vector<TableError>& errors) {
  ordered_json out = ordered_json::array();
  for (const TableError& e : errors) {
    out.push_back({{"tables", e.tables},
                   {"sun_elevation_deg", e.sun_elevation_deg},
                   {"mean", e.mean},
                   {"p95", e.p95},
                   {"largest", e.largest},
                   {"bias", e.bias}});
  }
  return out;
}

std::string manifest_text(const std::vector<NamedTexture>& textures, const TableManifest& m,
                          const SkyTables* tables, const TableLayout* layout) {
  ordered_json out;
  out["format"] = "twilight sky tables";
  out["version"] = m.version;
  out["layout"] = m.layout;
  ordered_json files = ordered_json::array();
  for (const NamedTexture& t : textures) {
    files.push_back({{"file", t.name + ".dat"},
                     {"width", t.texture->width},
                     {"height", t.texture->height},
                     {"depth", t.texture->depth},
                     {"type", "float32 RGBA, little-endian, x fastest, then y, then z"},
                     {"channels", t.channels}});
  }
  out["textures"] = files;
  out["spectrum"] = m.spectrum;
  out["radiance_unit"] = m.unit;
  out["channel_names"] = m.channel_names;
  if (m.wavelength_nm[0] > 0) out["channel_wavelengths_nm"] = m.wavelength_nm;
  out["solved_wavelengths_nm"] = m.solved_wavelength_nm;
  out["bottom_radius_km"] = m.bottom_radius_km;
  out["top_radius_km"] = m.top_radius_km;
  if (layout != nullptr) {
    out["sizes"] = sizes_of(layout->sizes());
    out["mu_s_min"] = layout->geometry().mu_s_min;
    out["smallest_mu_s_held"] = layout->scattering_mu_s(0);
  }
  if (tables != nullptr) {
    const TableConstants& k = tables->constants;
    out["mie_storage"] = tables->single_mie ? "separate" : "combined";
    out["sun_scale"] = tables->sun_scale.has_value();
    out["mie_phase_function_g"] = k.mie_g;
    out["solar_irradiance"] = k.solar_irradiance;
    out["rayleigh_scattering_per_km"] = k.rayleigh_per_km;
    out["mie_scattering_per_km"] = k.mie_per_km;
    out["mie_extinction_per_km"] = k.mie_extinction_per_km;
    out["ground_albedo"] = k.ground_albedo;
    out["negative_star_texels"] = tables->negative_star;
    out["negative_colour_components"] = tables->outside_rec709;
  }
  if (tables == nullptr) {
    const TableConstants& k = m.constants;
    out["mie_phase_function_g"] = k.mie_g;
    out["solar_irradiance"] = k.solar_irradiance;
    out["ground_albedo"] = k.ground_albedo;
  } else if (!tables->single_mie) {
    out["mie_scattering_is"] =
        "green and blue of mie_scattering_per_km are what makes the proportionality rule fit the "
        "sky best, not the air's own, which are those of air";
  }
  ordered_json air = ordered_json::array();
  for (const TableManifest::Layer& layer : m.air) {
    air.push_back({{"bottom_km", layer.bottom_km},
                   {"top_km", layer.top_km},
                   {"rayleigh_scattering_per_km", layer.rayleigh_scattering_per_km},
                   {"mie_scattering_per_km", layer.mie_scattering_per_km},
                   {"mie_absorption_per_km", layer.mie_absorption_per_km},
                   {"gas_absorption_per_km", layer.gas_absorption_per_km}});
  }
  out["air"] = std::move(air);
  if (!m.sun_elevation_deg.empty()) out["sky_view_sun_elevations_deg"] = m.sun_elevation_deg;
  out["mappings"] = named(m.mappings);
  out["physics"] = named(m.physics);
  out["scene_file"] = m.scene_file;
  out["scene"] = named(m.settings);
  if (!m.errors.empty()) out["relative_errors"] = errors_of(m.errors);
  return out.dump(2) + "\n";
}

// A folder made for a run, and taken away again unless the run keeps it.
class MadeFolder {
 public:
  explicit MadeFolder(const fs::path& folder) : folder_(folder) {
    std::error_code error;
    made_ = fs::create_directory(folder, error);
    if (!fs::is_directory(folder)) {
      throw std::runtime_error(
          fmt::format("cannot make the folder {}: {}", folder.string(),
                      error ? error.message() : "there is a file of that name"));
    }
  }
  ~MadeFolder() {
    std::error_code ignored;
    if (made_) fs::remove(folder_, ignored);  // only when empty
  }
  MadeFolder(const MadeFolder&) = delete;
  MadeFolder& operator=(const MadeFolder&) = delete;
  void keep() { made_ = false; }

 private:
  fs::path folder_;
  bool made_ = false;
};

Texture read_texture(const fs::path& folder, const std::string& name, std::size_t width,
                     std::size_t height, std::size_t depth) {
  const fs::path path = folder / (name + ".dat");
  Texture out(width, height, depth);
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  const auto bytes = static_cast<std::streamoff>(out.rgba.size() * sizeof(float));
  if (!stream) throw std::runtime_error(fmt::format("{}: cannot be read", path.string()));
  if (stream.tellg() != bytes) {
    throw std::runtime_error(fmt::format("{}: has {} bytes: must have {} x {} x {} x 16 = {}",
                                         path.string(), static_cast<long long>(stream.tellg()),
                                         width, height, depth, static_cast<long long>(bytes)));
  }
  stream.seekg(0);
  stream.read(reinterpret_cast<char*>(out.rgba.data()), bytes);
  if (!stream) throw std::runtime_error(fmt::format("{}: cannot be read", path.string()));
  for (const float value : out.rgba) {
    if (!std::isfinite(value)) {
      throw std::runtime_error(fmt::format("{}: holds {}", path.string(), value));
    }
  }
  return out;
}

}  // namespace

std::vector<NamedTexture> textures_of(const SkyTables& t) {
  const std::string star =
      "R, G, B: (Rayleigh single and all multiple scattering) over Rayleigh's phase function";
  std::vector<NamedTexture> out = {
      {"transmittance", &t.transmittance, "R, G, B: transmittance to the top; A: 1"},
      {"irradiance", &t.irradiance,
       "R, G, B: diffuse irradiance of the horizontal (unit of radiance times sr); A: 1"},
      {"scattering", &t.scattering,
       star + "; A: red of single Mie scattering without its phase function"}};
  if (t.single_mie) {
    out.push_back({"single_mie_scattering", &*t.single_mie,
                   "R, G, B: single Mie scattering without its phase function; A: 0"});
  }
  if (t.sun_scale) {
    out.push_back({"sun_scale", &*t.sun_scale,
                   "natural logarithms of what the scattering textures' R, G, B, A have to be "
                   "multiplied with, against u_mu_s = i / (width - 1)"});
  }
  return out;
}

std::vector<NamedTexture> textures_of(const HillaireTables& t) {
  std::vector<NamedTexture> out = {
      {"transmittance", &t.transmittance, "R, G, B: transmittance to the top; A: 1"},
      {"multiple_scattering", &t.multiple,
       "R, G, B: mean radiance, over all directions, of light scattered or reflected at least "
       "once, "
       "per unit solar illuminance of the channel, sr^-1; A: 1"}};
  for (std::size_t s = 0; s < t.sky_view.size(); ++s) {
    out.push_back({fmt::format("sky_view_{:+g}", t.sun_elevation_deg[s]), &t.sky_view[s],
                   fmt::format("R, G, B: radiance scattered towards the observer, Sun at {:g} deg; "
                               "A: 1",
                               t.sun_elevation_deg[s])});
  }
  return out;
}

void require_table_folder(const fs::path& folder) {
  MadeFolder made(folder);
  AtomicFile probe(folder / "manifest.json");
}

std::vector<std::string> write_table_set(const fs::path& folder,
                                         const std::vector<NamedTexture>& textures,
                                         const TableManifest& manifest, const SkyTables* tables,
                                         const TableLayout* layout, bool half) {
  MadeFolder made(folder);
  std::deque<AtomicFile> files;
  constexpr float kLargestHalf = 65504.0F;
  for (const NamedTexture& t : textures) {
    if (!half) break;
    const float largest = *std::ranges::max_element(t.texture->rgba);
    if (largest <= kLargestHalf) continue;
    throw std::runtime_error(
        fmt::format("{}: texture {} holds {}, above the largest half, {}: leave "
                    "out --half",
                    folder.string(), t.name, largest, kLargestHalf));
  }
  std::vector<std::string> names;
  const auto add = [&](const std::string& name) -> AtomicFile& {
    names.push_back(name);
    return files.emplace_back(folder / name);
  };
  for (const NamedTexture& t : textures) {
    const Texture& texture = *t.texture;
    add(t.name + ".dat").write(texture.rgba.data(), texture.rgba.size() * sizeof(float));
    const ImageAttributes attributes = {{"software", "twilight " + manifest.version},
                                        {"layout", manifest.layout},
                                        {"texture", t.channels},
                                        {"depth", static_cast<std::int32_t>(texture.depth)},
                                        {"radianceUnits", manifest.unit}};
    const int width = static_cast<int>(texture.width);
    const int height = static_cast<int>(texture.height * texture.depth);
    write_rgba_exr(add(t.name + ".exr"), width, height, texture.rgba, false, attributes);
    if (half)
      write_rgba_exr(add(t.name + ".half.exr"), width, height, texture.rgba, true, attributes);
  }
  add("manifest.json").write(manifest_text(textures, manifest, tables, layout));
  if (!manifest.errors.empty()) add("errors.csv").write(error_table(manifest.errors).text());
  for (AtomicFile& file : files) file.commit();
  made.keep();
  return names;
}

TableSet read_table_set(const fs::path& folder) {
  const fs::path path = folder / "manifest.json";
  std::ifstream stream(path);
  if (!stream) throw std::runtime_error(fmt::format("{}: cannot be read", path.string()));
  TableSet out;
  try {
    const ordered_json json = ordered_json::parse(stream);
    const ordered_json& n = json.at("sizes");
    LayoutSizes sizes;
    sizes.transmittance_mu = n.at("transmittance_mu");
    sizes.transmittance_r = n.at("transmittance_r");
    sizes.irradiance_mu_s = n.at("irradiance_mu_s");
    sizes.irradiance_r = n.at("irradiance_r");
    sizes.r = n.at("scattering_r");
    sizes.mu = n.at("scattering_mu");
    sizes.mu_s = n.at("scattering_mu_s");
    sizes.nu = n.at("scattering_nu");
    const double least = json.at("mu_s_min");
    const std::string layout = json.at("layout");
    constexpr double kDegrees = 180 / 3.14159265358979323846;
    out.layout = make_layout(layout, sizes, json.at("bottom_radius_km"), json.at("top_radius_km"),
                             layout == "bruneton2008" ? 0.0 : std::acos(least) * kDegrees);
    TableConstants& k = out.tables.constants;
    k.mie_g = json.at("mie_phase_function_g");
    k.solar_irradiance = json.at("solar_irradiance").get<ChannelTriple>();
    k.rayleigh_per_km = json.at("rayleigh_scattering_per_km").get<ChannelTriple>();
    k.mie_per_km = json.at("mie_scattering_per_km").get<ChannelTriple>();
    k.mie_extinction_per_km = json.at("mie_extinction_per_km").get<ChannelTriple>();
    k.ground_albedo = json.at("ground_albedo").get<ChannelTriple>();
    for (const ordered_json& t : json.at("textures")) {
      std::string name = t.at("file");
      name.resize(name.size() - 4);
      Texture texture = read_texture(folder, name, t.at("width"), t.at("height"), t.at("depth"));
      if (name == "transmittance")
        out.tables.transmittance = std::move(texture);
      else if (name == "irradiance")
        out.tables.irradiance = std::move(texture);
      else if (name == "scattering")
        out.tables.scattering = std::move(texture);
      else if (name == "single_mie_scattering")
        out.tables.single_mie = std::move(texture);
      else if (name == "sun_scale")
        out.tables.sun_scale = std::move(texture);
    }
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(fmt::format("{}: {}", path.string(), error.what()));
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", path.string(), error.what()));
  }
  const LayoutSizes& n = out.layout->sizes();
  const SkyTables& t = out.tables;
  const auto fits = [](const Texture& texture, std::size_t w, std::size_t h, std::size_t d) {
    return texture.width == w && texture.height == h && texture.depth == d;
  };
  if (!fits(t.transmittance, n.transmittance_mu, n.transmittance_r, 1) ||
      !fits(t.irradiance, n.irradiance_mu_s, n.irradiance_r, 1) ||
      !fits(t.scattering, n.nu * n.mu_s, n.mu, n.r) ||
      (t.single_mie && !fits(*t.single_mie, n.nu * n.mu_s, n.mu, n.r))) {
    throw std::runtime_error(
        fmt::format("{}: textures are missing or have other sizes than it says", path.string()));
  }
  return out;
}

}  // namespace twilight
