#include "output/wanted_quantities.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "sim/toml_shown.h"

namespace twilight {
namespace {

constexpr std::array<std::pair<SkyQuantity, std::string_view>, 8> kQuantities = {{
    {SkyQuantity::kTexture, "texture"},
    {SkyQuantity::kRadiance, "radiance"},
    {SkyQuantity::kIrradiance, "irradiance"},
    {SkyQuantity::kIlluminance, "illuminance"},
    {SkyQuantity::kChromaticity, "chromaticity"},
    {SkyQuantity::kMagnitudes, "magnitudes"},
    {SkyQuantity::kPolarisation, "polarisation"},
    {SkyQuantity::kTwilightDuration, "twilight_duration"},
}};
constexpr std::array<std::pair<TextureContent, std::string_view>, 3> kTextures = {{
    {TextureContent::kSpectral, "spectral"},
    {TextureContent::kRgb, "rgb"},
    {TextureContent::kXyz, "xyz"},
}};

template <class Key, std::size_t N>
std::string_view name_in(const std::array<std::pair<Key, std::string_view>, N>& table, Key key) {
  return std::ranges::find(table, key, &std::pair<Key, std::string_view>::first)->second;
}

template <class Key, std::size_t N>
std::optional<Key> key_in(const std::array<std::pair<Key, std::string_view>, N>& table,
                          std::string_view name) {
  const auto found = std::ranges::find(table, name, &std::pair<Key, std::string_view>::second);
  if (found == table.end()) return std::nullopt;
  return found->first;
}

template <class Table>
std::string names_of(const Table& table) {
  std::string text;
  for (const auto& [key, name] : table)
    text += (text.empty() ? "\"" : ", \"") + std::string(name) + '"';
  return text;
}

/// The table [outputs] while it is read.
class OutputsReader {
 public:
  OutputsReader(const toml::table& table, std::string file)
      : table_(table), file_(std::move(file)) {}

  WantedQuantities read() const;

 private:
  std::string origin(const toml::node& node) const {
    return fmt::format("{}:{}", file_, node.source().begin.line);
  }
  [[noreturn]] void refuse(const toml::node& node, std::string_view name,
                           std::string_view message) const {
    throw std::invalid_argument(
        fmt::format("{}: key 'outputs.{}' = {}: {}", origin(node), name, shown(node), message));
  }
  void refuse_unknown(const toml::table& table, std::string_view prefix,
                      std::initializer_list<std::string_view> known) const {
    for (const auto& [key, node] : table) {
      if (std::ranges::find(known, key.str()) != known.end()) continue;
      throw std::invalid_argument(fmt::format(
          "{}:{}: key 'outputs.{}{}' = {}: unknown key; must be one of {}", file_,
          key.source().begin.line, prefix, key.str(), shown(node), fmt::join(known, ", ")));
    }
  }
  const toml::array& array(const toml::node& node, std::string_view name, std::size_t least,
                           std::size_t most, std::string_view what) const {
    const toml::array* list = node.as_array();
    if (list == nullptr || list->size() < least || list->size() > most) {
      refuse(node, name, fmt::format("must be an array of {}..{} {}", least, most, what));
    }
    return *list;
  }
  double number(const toml::node& node, std::string_view name, double least, double most) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !(*value >= least) || !(*value <= most)) {
      refuse(node, name, fmt::format("must be a number, {:g}..{:g}", least, most));
    }
    return *value;
  }
  int integer(const toml::node& node, std::string_view name, int least, int most,
              bool or_zero = false) const {
    const auto value = node.is_integer() ? node.value<std::int64_t>() : std::nullopt;
    const bool fits = value && ((*value >= least && *value <= most) || (or_zero && *value == 0));
    if (!fits) {
      refuse(node, name,
             fmt::format("must be an integer, {}{}..{}", or_zero ? "0 or " : "", least, most));
    }
    return static_cast<int>(*value);
  }
  std::string word(const toml::node& node, std::string_view name, std::string_view what) const {
    if (!node.is_string() || node.value_or(std::string()).empty()) {
      refuse(node, name, fmt::format("must be a string, {}", what));
    }
    return node.value_or(std::string());
  }

  std::vector<SkyQuantity> quantities(const toml::node& node) const;
  std::vector<WantedView> views(const toml::node& node) const;
  std::vector<double> thresholds(const toml::node& node) const;
  WantedPlot plot(const toml::node& node) const;

  const toml::table& table_;
  std::string file_;
};

std::vector<SkyQuantity> OutputsReader::quantities(const toml::node& node) const {
  const std::string what = "of " + names_of(kQuantities);
  std::vector<SkyQuantity> wanted;
  for (const toml::node& element : array(node, "quantities", 1, kQuantities.size(), what)) {
    const auto quantity = key_in(kQuantities, element.value_or(std::string()));
    if (!quantity) refuse(element, "quantities", "must be one " + what);
    if (std::ranges::find(wanted, *quantity) != wanted.end()) {
      refuse(element, "quantities", "is named twice: must be once");
    }
    wanted.push_back(*quantity);
  }
  std::ranges::sort(wanted);
  return wanted;
}

std::vector<WantedView> OutputsReader::views(const toml::node& node) const {
  constexpr std::size_t kMost = 1000;
  std::vector<WantedView> views;
  for (const toml::node& element :
       array(node, "views", 1, kMost, "pairs [elevation, azimuth from the Sun's] in degrees")) {
    const toml::array* pair = element.as_array();
    if (pair == nullptr || pair->size() != 2) {
      refuse(element, "views", "must be a pair [elevation, azimuth from the Sun's] in degrees");
    }
    const WantedView view{number(*pair->get(0), "views", -90, 90),
                          number(*pair->get(1), "views", -360, 360)};
    for (const WantedView& other : views) {
      if (other.elevation_deg == view.elevation_deg && other.azimuth_deg == view.azimuth_deg) {
        refuse(element, "views", "is given twice: must be once");
      }
    }
    views.push_back(view);
  }
  return views;
}

std::vector<double> OutputsReader::thresholds(const toml::node& node) const {
  constexpr std::string_view kName = "twilight_thresholds_lux";
  std::vector<double> lux;
  for (const toml::node& element : array(node, kName, 1, 100, "illuminances in lux")) {
    lux.push_back(number(element, kName, 1e-6, 1e5));
    if (lux.size() > 1 && !(lux.back() < lux[lux.size() - 2])) {
      refuse(element, kName, "must be below the one before it: illuminances decrease");
    }
  }
  return lux;
}

WantedPlot OutputsReader::plot(const toml::node& node) const {
  const toml::table* table = node.as_table();
  if (table == nullptr) {
    refuse(node, "plots",
           "must be tables {x = \"...\", y = \"...\", series = \"...\", log = true}");
  }
  refuse_unknown(*table, "plots.", {"x", "y", "series", "log"});
  WantedPlot plot;
  plot.origin = origin(node);
  for (const auto& [name, text] : {std::pair{"x", &plot.x}, std::pair{"y", &plot.y}}) {
    const toml::node* given = table->get(name);
    if (given == nullptr) {
      throw std::invalid_argument(
          fmt::format("{}: key 'outputs.plots.{}' = (none): must be given", origin(node), name));
    }
    *text = word(*given, fmt::format("plots.{}", name), "a column of the study's table");
  }
  if (const toml::node* series = table->get("series")) {
    plot.series = word(*series, "plots.series", "the key of an axis");
  }
  if (const toml::node* log = table->get("log")) {
    if (!log->is_boolean()) refuse(*log, "plots.log", "must be true or false");
    plot.logarithmic = log->value<bool>();
  }
  return plot;
}

WantedQuantities OutputsReader::read() const {
  refuse_unknown(table_, "",
                 {"quantities", "views", "texture", "texture_size", "picture_size", "exr_size",
                  "twilight_thresholds_lux", "plots"});
  WantedQuantities wanted;
  if (const auto* node = table_.get("quantities")) wanted.quantities = quantities(*node);
  if (const auto* node = table_.get("views")) wanted.views = views(*node);
  if (const auto* node = table_.get("texture")) {
    const auto content = key_in(kTextures, node->value_or(std::string()));
    if (!content) refuse(*node, "texture", "must be one of " + names_of(kTextures));
    wanted.texture = *content;
  }
  if (const auto* node = table_.get("texture_size")) {
    wanted.texture_size = integer(*node, "texture_size", 4, 4096);
  }
  if (const auto* node = table_.get("picture_size")) {
    wanted.picture_size = integer(*node, "picture_size", 16, 1024, true);
  }
  if (const auto* node = table_.get("exr_size")) {
    wanted.exr_size = integer(*node, "exr_size", 4, 4096, true);
  }
  if (const auto* node = table_.get("twilight_thresholds_lux")) {
    wanted.twilight_thresholds_lux = thresholds(*node);
  }
  if (const auto* node = table_.get("plots")) {
    for (const toml::node& element : array(*node, "plots", 0, 1000, "tables")) {
      wanted.plots.push_back(plot(element));
    }
  }
  return wanted;
}

bool has_column(std::span<const std::string> columns, const std::string& name) {
  return std::ranges::find(columns, name) != columns.end();
}

// A study may have hundreds of columns: named are those of the same quantity, else the quantities.
[[noreturn]] void refuse_plot(const WantedPlot& plot, std::string_view key, std::string_view value,
                              std::string_view what, std::span<const std::string> known) {
  const std::string_view quantity = value.substr(0, value.find('['));
  std::vector<std::string> near, all;
  for (const std::string& name : known) {
    const std::size_t end = name.find('[');
    std::string plain = end == std::string::npos ? name : name.substr(0, end) + "[...]";
    if (name.starts_with(quantity) && name.substr(quantity.size()).starts_with("["))
      near.push_back(name);
    if (std::ranges::find(all, plain) == all.end()) all.push_back(std::move(plain));
  }
  throw std::invalid_argument(fmt::format("{}: key 'outputs.plots.{}' = \"{}\": must be {}: {}",
                                          plot.origin, key, value, what,
                                          fmt::join(near.empty() ? all : near, ", ")));
}

}  // namespace

bool WantedQuantities::wants(SkyQuantity quantity) const {
  return std::ranges::find(quantities, quantity) != quantities.end();
}

std::string_view name_of(SkyQuantity quantity) { return name_in(kQuantities, quantity); }
std::string_view name_of(TextureContent content) { return name_in(kTextures, content); }

WantedQuantities read_wanted_quantities(const std::filesystem::path& study_file) {
  std::ifstream stream(study_file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(study_file)) {
    throw std::runtime_error(fmt::format("{}: cannot read this file", study_file.string()));
  }
  toml::table root;
  try {
    root = toml::parse(stream, study_file.string());
  } catch (const toml::parse_error& error) {
    throw std::invalid_argument(fmt::format("{}:{}: not valid TOML: {}", study_file.string(),
                                            error.source().begin.line, error.description()));
  }
  const toml::node* node = root.get("outputs");
  if (node == nullptr) return {};
  if (!node->is_table()) {
    throw std::invalid_argument(fmt::format("{}:{}: key 'outputs' = {}: must be a table, [outputs]",
                                            study_file.string(), node->source().begin.line,
                                            shown(*node)));
  }
  return OutputsReader(*node->as_table(), study_file.string()).read();
}

std::string canonical_text(const WantedQuantities& wanted) {
  std::string text = "quantities";
  for (const SkyQuantity quantity : wanted.quantities)
    text += fmt::format(" {}", name_of(quantity));
  text += "\nviews";
  for (const WantedView& v : wanted.views)
    text += fmt::format(" {},{}", v.elevation_deg, v.azimuth_deg);
  text += fmt::format("\ntexture {}\ntexture_size {}\npicture_size {}\ntwilight_thresholds_lux",
                      name_of(wanted.texture), wanted.texture_size, wanted.picture_size);
  for (const double lux : wanted.twilight_thresholds_lux) text += fmt::format(" {}", lux);
  // Cases without one keep their names.
  if (wanted.exr_size > 0) text += fmt::format("\nexr_size {}", wanted.exr_size);
  return text + "\n";
}

void check_plots(const WantedQuantities& wanted, std::span<const std::string> columns,
                 std::size_t axes) {
  for (const WantedPlot& plot : wanted.plots) {
    if (!has_column(columns, plot.x)) refuse_plot(plot, "x", plot.x, "a column", columns);
    const bool several = std::ranges::any_of(
        columns, [&](const std::string& name) { return name.starts_with(plot.y + "["); });
    if (!several && !has_column(columns, plot.y)) {
      refuse_plot(plot, "y", plot.y, "a column, or a quantity of several", columns);
    }
    if (!plot.series.empty() && !has_column(columns.first(axes), plot.series)) {
      refuse_plot(plot, "series", plot.series, "an axis", columns.first(axes));
    }
  }
}

}  // namespace twilight
