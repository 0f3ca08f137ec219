#include "aerosols/mixture_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "aerosols/particle_optics_file.h"
#include "aerosols/size_distribution_file.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

constexpr double kLargestHeight_km = 200.0;
constexpr double kSmallestRadius_um = 1e-3, kLargestRadius_um = 100.0;
constexpr double kMostNumber_per_cm3 = 1e8, kMostMass_ug_m3 = 1e7, kMostExtinction_per_km = 100.0;

std::string read_whole(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || fs::is_directory(path)) {
    throw std::runtime_error(fmt::format("{}: cannot read this file of an aerosol", path.string()));
  }
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::string shown(const toml::node& node) {
  if (node.is_table()) return "a table";
  if (node.is_array()) return "an array";
  std::ostringstream text;
  node.visit([&](const auto& typed) {
    if constexpr (!toml::is_table<decltype(typed)> && !toml::is_array<decltype(typed)>) {
      text << typed;
    }
  });
  return text.str();
}

// A table of the file with its place in complaints.
class Table {
 public:
  Table(const toml::table& table, std::string file, std::string name)
      : table_(&table), file_(std::move(file)), name_(std::move(name)) {}

  const toml::table& toml() const { return *table_; }
  bool has(std::string_view key) const { return table_->contains(key); }
  std::string place(std::string_view key) const {
    return name_.empty() ? std::string(key) : fmt::format("{}.{}", name_, key);
  }

  [[noreturn]] void refuse(std::string_view message) const {
    throw std::invalid_argument(
        fmt::format("{}:{}: {} {}", file_, table_->source().begin.line, name_, message));
  }

  [[noreturn]] void refuse(std::string_view key, std::string_view message) const {
    const auto it = table_->find(key);
    const auto line =
        it == table_->end() ? table_->source().begin.line : it->first.source().begin.line;
    throw std::invalid_argument(
        fmt::format("{}:{}: key '{}' {}", file_, line, place(key), message));
  }

  void allow(std::initializer_list<std::string_view> keys) const {
    for (const auto& [key, node] : *table_) {
      if (std::ranges::find(keys, key.str()) != keys.end()) continue;
      refuse(key.str(), fmt::format("= {}: unknown key; those of {} are {}", shown(node),
                                    name_.empty() ? "the file" : name_, fmt::join(keys, ", ")));
    }
  }

  std::optional<double> number(std::string_view key, double low, double high) const {
    const toml::node* node = table_->get(key);
    if (node == nullptr) return std::nullopt;
    return number_of(*node, key, "", low, high);
  }

  double required_number(std::string_view key, double low, double high) const {
    const auto value = number(key, low, high);
    if (!value) refuse(fmt::format("must have '{}', a number in {}..{}", key, low, high));
    return *value;
  }

  std::optional<std::string> text(std::string_view key) const {
    const toml::node* node = table_->get(key);
    if (node == nullptr) return std::nullopt;
    if (const auto* string = node->as_string()) return string->get();
    refuse(key, fmt::format("= {}: must be a string", shown(*node)));
  }

  std::vector<double> numbers(std::string_view key, double low, double high) const {
    const toml::node* node = table_->get(key);
    const toml::array* array = node == nullptr ? nullptr : node->as_array();
    if (array == nullptr) {
      refuse(key,
             fmt::format("{}must be an array of numbers in {}..{}",
                         node == nullptr ? "" : fmt::format("= {}: ", shown(*node)), low, high));
    }
    std::vector<double> values;
    for (const toml::node& element : *array) {
      values.push_back(
          number_of(element, key, fmt::format(" (value {})", values.size() + 1), low, high));
    }
    return values;
  }

  std::optional<Table> table(std::string_view key) const {
    const toml::node* node = table_->get(key);
    if (node == nullptr) return std::nullopt;
    if (const auto* table = node->as_table()) return Table(*table, file_, place(key));
    refuse(key, fmt::format("= {}: must be a table", shown(*node)));
  }

 private:
  double number_of(const toml::node& node, std::string_view key, std::string_view which, double low,
                   double high) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !(*value >= low && *value <= high)) {
      refuse(key, fmt::format("= {}{}: must be a number in {}..{}", shown(node), which, low, high));
    }
    return *value;
  }

  const toml::table* table_;
  std::string file_, name_;
};

void require_rising(const Table& table, std::string_view key, const std::vector<double>& values) {
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (values[i] > values[i - 1]) continue;
    table.refuse(key, fmt::format("= {} (value {}): must be above the value before it, {}",
                                  values[i], i + 1, values[i - 1]));
  }
}

void require_as_many(const Table& table, std::string_view key, std::size_t held,
                     std::string_view as, std::size_t wanted, std::size_t least) {
  if (wanted < least) {
    table.refuse(as, fmt::format("has {} values: must have {} or more", wanted, least));
  }
  if (held != wanted) {
    table.refuse(key,
                 fmt::format("has {} values: must have as many as '{}', {}", held, as, wanted));
  }
}

constexpr double kShortest_nm = 100.0, kLongest_nm = 1e5, kLargestIndex = 20.0;

// The CSV of a refractive index: a header, then rows; '#' begins a comment.
RefractiveIndexTable read_refractive_index(const fs::path& path) {
  std::istringstream lines(read_whole(path));
  RefractiveIndexTable table;
  std::string line;
  bool header = false;
  for (int row = 1; std::getline(lines, line); ++row) {
    const auto refuse = [&](std::string_view message) {
      throw std::invalid_argument(fmt::format("{}:{}: '{}' {}", path.string(), row, line, message));
    };
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.find_first_not_of(" \t") == std::string::npos || line.front() == '#') continue;
    if (!header) {
      if (line != "wavelength_nm,n,k") refuse("must be the header wavelength_nm,n,k");
      header = true;
      continue;
    }
    std::array<double, 3> values{};
    std::istringstream cells(line);
    std::string cell;
    std::size_t count = 0;
    for (; std::getline(cells, cell, ','); ++count) {
      std::size_t used = 0;
      double value = NAN;
      try {
        value = std::stod(cell, &used);
      } catch (const std::exception&) {
        used = 0;
      }
      const bool blank_after = cell.find_first_not_of(" \t", used) == std::string::npos;
      if (count > 2 || used == 0 || !blank_after || !std::isfinite(value)) {
        refuse("must be three numbers, wavelength_nm,n,k");
      }
      values[count] = value;
    }
    if (count != 3) refuse("must be three numbers, wavelength_nm,n,k");
    if (!(values[0] >= kShortest_nm && values[0] <= kLongest_nm) ||
        (!table.wavelength_nm.empty() && !(values[0] > table.wavelength_nm.back()))) {
      refuse(fmt::format("must have a wavelength in {}..{} nm above the one before it",
                         kShortest_nm, kLongest_nm));
    }
    if (!(values[1] > 0.0 && values[1] <= kLargestIndex && values[2] >= 0.0 &&
          values[2] <= kLargestIndex)) {
      refuse(fmt::format("must have n above 0 and k from 0, both to {}", kLargestIndex));
    }
    table.wavelength_nm.push_back(values[0]);
    table.real.push_back(values[1]);
    table.imaginary.push_back(values[2]);
  }
  if (table.wavelength_nm.empty()) {
    throw std::invalid_argument(
        fmt::format("{}: must hold a header wavelength_nm,n,k and rows of numbers", path.string()));
  }
  return table;
}

using Components = std::map<std::string, std::shared_ptr<const MixtureComponent>, std::less<>>;

class Reader {
 public:
  explicit Reader(const fs::path& path) : path_(path), name_(path.string()) {}

  MixtureFile run() {
    toml::table root;
    try {
      root = toml::parse(read_whole(path_), name_);
    } catch (const toml::parse_error& error) {
      throw std::invalid_argument(fmt::format("{}:{}: not valid TOML: {}", name_,
                                              error.source().begin.line, error.description()));
    }
    result_.files.push_back(path_);
    Table(root, name_, "").allow({"component", "layer"});
    for (const Table& table : tables(root, "component")) add_component(table);
    for (const Table& table : tables(root, "layer")) result_.layers.push_back(layer(table));
    if (result_.layers.empty()) {
      throw std::invalid_argument(
          fmt::format("{}: has no [[layer]]: must have one or more", name_));
    }
    return std::move(result_);
  }

 private:
  std::vector<Table> tables(const toml::table& root, std::string_view key) const {
    std::vector<Table> all;
    const toml::node* node = root.get(key);
    if (node == nullptr) return all;
    const toml::array* array = node->as_array();
    if (array == nullptr) {
      throw std::invalid_argument(fmt::format("{}:{}: key '{}' must be an array of tables, [[{}]]",
                                              name_, node->source().begin.line, key, key));
    }
    for (const toml::node& element : *array) {
      const toml::table* table = element.as_table();
      if (table == nullptr) {
        throw std::invalid_argument(
            fmt::format("{}:{}: key '{}' must be an array of tables, [[{}]]", name_,
                        element.source().begin.line, key, key));
      }
      all.emplace_back(*table, name_, fmt::format("{}[{}]", key, all.size() + 1));
    }
    return all;
  }

  fs::path beside(fs::path file) const {
    if (file.is_relative()) file = path_.parent_path() / file;
    return file.lexically_normal();
  }

  // The file that a key names, beside this one.
  fs::path file_of(const Table& table, std::string_view key) {
    const std::string given = table.text(key).value();
    const fs::path file = beside(given);
    if (given.empty() || !fs::is_regular_file(file)) {
      table.refuse(key, fmt::format("= \"{}\": must name a file; there is none at {}", given,
                                    file.string()));
    }
    result_.files.push_back(file);
    return file;
  }

  void add_component(const Table& table) {
    table.allow({"name", "lognormal", "size_distribution", "refractive_index", "density_g_cm3",
                 "growth", "optics"});
    const std::string name = table.text("name").value_or("");
    const bool word = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '_' || c == '-';
    });
    if (!word) {
      table.refuse("name", fmt::format("= \"{}\": must be letters, digits, _ or -", name));
    }
    if (find_opac_component(name) || components_.contains(name)) {
      table.refuse("name", fmt::format("= \"{}\": must not be a component's already", name));
    }
    components_[name] = table.has("optics") ? imported(table) : own(table, name);
  }

  // What a component complains of itself, with its place in the file.
  template <class Make>
  static auto placed(const Table& table, Make make) {
    try {
      return make();
    } catch (const std::invalid_argument& error) {
      table.refuse(error.what());
    }
  }

  std::shared_ptr<const MixtureComponent> imported(const Table& table) {
    for (const std::string_view key :
         {"lognormal", "size_distribution", "refractive_index", "density_g_cm3", "growth"}) {
      if (table.has(key)) table.refuse(key, "must not be given together with 'optics'");
    }
    // OPAC's files stand under one name without the digits of their humidities.
    const fs::path stem = beside(table.text("optics").value_or(""));
    std::string content;
    const auto take = [&](const fs::path& part) {
      content += read_whole(part);
      result_.files.push_back(part);
    };
    for (const char* humidity : {"00", "50", "70", "80", "90", "95", "98", "99"}) {
      const fs::path part = stem.string() + humidity;
      if (!fs::is_regular_file(stem) && fs::is_regular_file(part)) take(part);
    }
    const fs::path file = content.empty() ? file_of(table, "optics") : stem;
    if (content.empty()) content = read_whole(file);
    ParticleOptics optics = read_particle_optics(file);
    return placed(table, [&] {
      return table_component(std::move(optics), fmt::format("{} {:x}", file.string(),
                                                            std::hash<std::string>{}(content)));
    });
  }

  std::shared_ptr<const MixtureComponent> own(const Table& table, const std::string& name) {
    Microphysics m;
    m.name = name;
    read_sizes(table, m);
    m.index = refractive_index(table);
    m.density_g_cm3 = table.number("density_g_cm3", 0.01, 25.0).value_or(0.0);
    if (const auto growth = table.table("growth")) {
      growth->allow({"humidity_percent", "radius_growth_factor"});
      m.humidity_percent = growth->numbers("humidity_percent", 0.0, 99.0);
      m.radius_growth_factor = growth->numbers("radius_growth_factor", 1.0, 10.0);
      require_rising(*growth, "humidity_percent", m.humidity_percent);
      require_as_many(*growth, "radius_growth_factor", m.radius_growth_factor.size(),
                      "humidity_percent", m.humidity_percent.size(), 1);
    }
    return placed(table, [&] { return own_component(std::move(m)); });
  }

  void read_sizes(const Table& table, Microphysics& m) {
    if (table.has("lognormal") == table.has("size_distribution")) {
      table.refuse("must have either 'lognormal' or 'size_distribution'; or 'optics'");
    }
    if (table.has("size_distribution")) {
      const auto with_row = table.toml().get("size_distribution")->is_table()
                                ? table.table("size_distribution")
                                : std::nullopt;
      if (with_row) with_row->allow({"file", "row"});
      if (with_row && !with_row->has("file")) with_row->refuse("must have 'file'");
      const fs::path file =
          with_row ? file_of(*with_row, "file") : file_of(table, "size_distribution");
      const std::string row = with_row ? with_row->text("row").value_or("average") : "average";
      m.sizes = read_size_distribution(file, row).per_particle();
      m.sizes_text =
          fmt::format("{} {} {:x}", file.string(), row, std::hash<std::string>{}(read_whole(file)));
      return;
    }
    const Table sizes = table.table("lognormal").value();
    sizes.allow(
        {"mode_radius_um", "geometric_deviation", "smallest_radius_um", "largest_radius_um"});
    LognormalSizeDistribution lognormal;
    lognormal.mode_radius_um =
        sizes.required_number("mode_radius_um", kSmallestRadius_um, kLargestRadius_um);
    lognormal.geometric_deviation = sizes.required_number("geometric_deviation", 1.01, 10.0);
    lognormal.smallest_radius_um =
        sizes.required_number("smallest_radius_um", kSmallestRadius_um, kLargestRadius_um);
    lognormal.largest_radius_um =
        sizes.required_number("largest_radius_um", kSmallestRadius_um, kLargestRadius_um);
    if (!(lognormal.largest_radius_um > lognormal.smallest_radius_um)) {
      sizes.refuse("largest_radius_um",
                   fmt::format("= {}: must be above smallest_radius_um = {}",
                               lognormal.largest_radius_um, lognormal.smallest_radius_um));
    }
    if (!(lognormal.moment(0.0, kLargestRadius_um) > 1e-6)) {
      sizes.refuse("mode_radius_um",
                   fmt::format("= {}: must have particles between smallest_radius_um = {} and "
                               "largest_radius_um = {}",
                               lognormal.mode_radius_um, lognormal.smallest_radius_um,
                               lognormal.largest_radius_um));
    }
    m.sizes = lognormal;
    m.sizes_text =
        fmt::format("{} {} {} {}", lognormal.mode_radius_um, lognormal.geometric_deviation,
                    lognormal.smallest_radius_um, lognormal.largest_radius_um);
  }

  RefractiveIndexTable refractive_index(const Table& table) {
    if (!table.has("refractive_index")) {
      table.refuse("must have 'refractive_index', a CSV file or { wavelength_nm, n, k }");
    }
    if (table.toml().get("refractive_index")->is_string()) {
      return read_refractive_index(file_of(table, "refractive_index"));
    }
    const Table index = table.table("refractive_index").value();
    index.allow({"wavelength_nm", "n", "k"});
    RefractiveIndexTable result{index.numbers("wavelength_nm", kShortest_nm, kLongest_nm),
                                index.numbers("n", 0.01, kLargestIndex),
                                index.numbers("k", 0.0, kLargestIndex)};
    require_rising(index, "wavelength_nm", result.wavelength_nm);
    for (const auto& [key, held] :
         {std::pair{"n", result.real.size()}, std::pair{"k", result.imaginary.size()}}) {
      require_as_many(index, key, held, "wavelength_nm", result.wavelength_nm.size(), 1);
    }
    return result;
  }

  MixtureLayer layer(const Table& table) {
    table.allow({"bottom_km", "top_km", "scale_height_km", "profile", "relative_humidity_percent",
                 "number_per_cm3", "mass_ug_m3", "extinction_550nm_per_km", "optical_depth_550nm"});
    MixtureLayer result;
    result.profile = profile(table);
    result.humidity = humidity(table);
    add_amounts(table, "number_per_cm3", kMostNumber_per_cm3, result);
    add_amounts(table, "mass_ug_m3", kMostMass_ug_m3, result);
    add_amounts(table, "extinction_550nm_per_km", kMostExtinction_per_km, result);
    const bool any = std::ranges::any_of(result.amounts,
                                         [](const ComponentAmount& a) { return a.amount > 0.0; });
    if (!any) {
      table.refuse(
          "must hold particles: number_per_cm3, mass_ug_m3 or extinction_550nm_per_km "
          "above 0");
    }
    result.optical_depth_550nm = table.number("optical_depth_550nm", 0.0, 100.0);
    return result;
  }

  static HeightProfile profile(const Table& table) {
    if (const auto shape = table.table("profile")) {
      for (const std::string_view key : {"bottom_km", "top_km", "scale_height_km"}) {
        if (table.has(key)) table.refuse(key, "must not be given together with 'profile'");
      }
      shape->allow({"heights_km", "relative_density"});
      std::vector<double> heights = shape->numbers("heights_km", 0.0, kLargestHeight_km);
      std::vector<double> density = shape->numbers("relative_density", 0.0, 1e9);
      require_rising(*shape, "heights_km", heights);
      require_as_many(*shape, "relative_density", density.size(), "heights_km", heights.size(), 2);
      if (std::ranges::all_of(density, [](double d) { return d == 0.0; })) {
        shape->refuse("relative_density", "must hold a value above 0");
      }
      return tabulated_profile(std::move(heights), std::move(density));
    }
    HeightProfile result;
    result.bottom_km = table.required_number("bottom_km", 0.0, kLargestHeight_km);
    result.top_km = table.required_number("top_km", 0.0, kLargestHeight_km);
    if (!(result.top_km > result.bottom_km)) {
      table.refuse("top_km", fmt::format("= {}: must be above bottom_km = {}", result.top_km,
                                         result.bottom_km));
    }
    if (const auto scale = table.number("scale_height_km", 0.01, 1e6)) {
      result.scale_height_km = *scale;
    }
    return result;
  }

  static LayerHumidity humidity(const Table& table) {
    constexpr std::string_view kKey = "relative_humidity_percent";
    LayerHumidity result;
    if (!table.has(kKey)) return result;
    const toml::node& node = *table.toml().get(kKey);
    if (node.is_number()) {
      result.source = LayerHumidity::Source::kPercent;
      result.percent = *table.number(kKey, 0.0, 99.0);
    } else if (node.is_string() && node.as_string()->get() == "profile") {
      result.source = LayerHumidity::Source::kAtmosphere;
    } else if (node.is_table()) {
      const Table shape = *table.table(kKey);
      shape.allow({"heights_km", "percent"});
      result.source = LayerHumidity::Source::kTable;
      result.heights_km = shape.numbers("heights_km", 0.0, kLargestHeight_km);
      result.percents = shape.numbers("percent", 0.0, 99.0);
      require_rising(shape, "heights_km", result.heights_km);
      require_as_many(shape, "percent", result.percents.size(), "heights_km",
                      result.heights_km.size(), 1);
    } else {
      table.refuse(kKey, fmt::format("= {}: must be 0..99, \"profile\" or a table {{ heights_km = "
                                     "[], percent = [] }}",
                                     shown(node)));
    }
    return result;
  }

  std::shared_ptr<const MixtureComponent> component(const Table& of, std::string_view name) const {
    if (auto opac = find_opac_component(name)) return opac;
    if (const auto it = components_.find(name); it != components_.end()) return it->second;
    std::string known;
    for (std::size_t i = 0; i < kAerosolComponents; ++i) {
      known +=
          fmt::format("{}{}", i > 0 ? ", " : "", component_code(static_cast<AerosolComponent>(i)));
    }
    for (const auto& [own, _] : components_) known += ", " + own;
    of.refuse(name, fmt::format("is an unknown component; known: {}", known));
  }

  void add_amounts(const Table& table, std::string_view key, double most,
                   MixtureLayer& layer) const {
    const auto given = table.table(key);
    if (!given) return;
    for (const auto& [name_node, node] : given->toml()) {
      const std::string_view name = name_node.str();
      auto of = component(*given, name);
      const double value = given->required_number(name, 0.0, most);
      const double amount = amount_of(*given, key, name, *of, value);
      const auto same = std::ranges::find_if(layer.amounts, [&](const ComponentAmount& a) {
        return a.component->identity() == of->identity();
      });
      if (same != layer.amounts.end()) {
        same->amount += amount;
      } else {
        layer.amounts.push_back({std::move(of), amount});
      }
    }
    // OPAC's first, in its order, so that the file's order does not change a digit.
    std::ranges::stable_sort(layer.amounts, {}, [](const ComponentAmount& a) {
      for (std::size_t i = 0; i < kAerosolComponents; ++i) {
        if (component_code(static_cast<AerosolComponent>(i)) == a.component->name()) return i;
      }
      return kAerosolComponents;
    });
  }

  // In the unit of the component's own table.
  static double amount_of(const Table& given, std::string_view key, std::string_view name,
                          const MixtureComponent& of, double value) {
    const std::optional<double> mass = of.dry_mass_ug_per_m3();
    const auto need_mass = [&] {
      if (mass) return *mass;
      given.refuse(name, fmt::format("= {}: its mass per particle is not known; give the component "
                                     "density_g_cm3",
                                     value));
    };
    if (of.per() == OpticsPer::kExtinctionAt550nm) {
      if (key == "extinction_550nm_per_km") return value;
      given.refuse(name, fmt::format("= {}: its table has no absolute scale; give "
                                     "extinction_550nm_per_km",
                                     value));
    }
    if (key == "extinction_550nm_per_km") {
      given.refuse(name, fmt::format("= {}: must be given as number_per_cm3 or mass_ug_m3", value));
    }
    const bool by_number = key == "number_per_cm3";
    if (of.per() == OpticsPer::kParticlePerCm3) return by_number ? value : value / need_mass();
    return by_number ? value * need_mass() : value;
  }

  fs::path path_;
  std::string name_;
  Components components_;
  MixtureFile result_;
};

}  // namespace

MixtureFile read_mixture_file(const fs::path& path) { return Reader(path).run(); }

}  // namespace twilight
