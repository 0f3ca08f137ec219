// The TOML file that describes a photograph.
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <stdexcept>

#include "output/photograph.h"
#include "output/scene_map.h"
#include "solar/star_position.h"
#include "solar/time_point.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

/// A table of the file: numbers with ranges, words, and complaints with lines.
struct TableReader {
  std::string file;
  const toml::table& table;
  std::string prefix;

  [[noreturn]] void refuse(std::string_view key, const std::string& message) const {
    const toml::node* node = table.get(key);
    const auto line = (node != nullptr ? node : &table)->source().begin.line;
    throw std::invalid_argument(fmt::format("{}:{}: key '{}{}': {}", file,
                                            std::max<toml::source_index>(1, line), prefix, key,
                                            message));
  }
  void allow(std::initializer_list<std::string_view> known) const {
    for (const auto& [name, node] : table) {
      if (std::ranges::find(known, name.str()) == known.end()) {
        refuse(name.str(), fmt::format("unknown: must be one of {}", fmt::join(known, ", ")));
      }
    }
  }
  std::optional<double> number(std::string_view key, double low, double high) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) return std::nullopt;
    const auto value = node->is_number() ? node->value<double>() : std::nullopt;
    if (!value || !(*value >= low && *value <= high)) {
      refuse(key, fmt::format("must be a number in {:g}..{:g}", low, high));
    }
    return value;
  }
  double required(std::string_view key, double low, double high) const {
    if (const auto value = number(key, low, high)) return *value;
    refuse(key, "must be given");
  }
  std::optional<std::string> word(std::string_view key) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) return std::nullopt;
    if (!node->is_string()) refuse(key, "must be a string");
    return node->value<std::string>();
  }
};

MeasuredSun sun_of_photograph(const TableReader& reader, const Scene& scene) {
  if (const auto time = reader.word("time")) {
    try {
      return sun_at(scene, *time);
    } catch (const std::invalid_argument& error) {
      reader.refuse("time", error.what());
    }
  }
  MeasuredSun sun = sun_of(scene);
  if (const auto elevation = reader.number("sun_elevation_deg", -90, 90)) {
    sun.elevation_rad = *elevation * kRadPerDeg;
  }
  if (const auto azimuth = reader.number("sun_azimuth_deg", -360, 360)) {
    sun.azimuth_rad = *azimuth * kRadPerDeg;
  }
  return sun;
}

std::vector<StarPlace> read_stars(const TableReader& reader, const toml::array& stars,
                                  const Scene& scene, const LinearImage& image) {
  std::vector<StarPlace> places;
  for (const toml::node& node : stars) {
    if (!node.is_table()) reader.refuse("star", "must be tables, [[star]]");
    const TableReader star{reader.file, *node.as_table(), "star."};
    star.allow(
        {"x", "y", "azimuth_deg", "elevation_deg", "right_ascension_deg", "declination_deg"});
    StarPlace place;
    place.position = {star.required("x", 0, image.width), star.required("y", 0, image.height)};
    if (star.table.contains("right_ascension_deg")) {
      const double ra = star.required("right_ascension_deg", 0, 360);
      const double dec = star.required("declination_deg", -90, 90);
      const auto site = place_of(scene);
      auto time = reader.word("star_time");
      if (!time) time = reader.word("time");
      if (!time) time = scene.observer.time;
      if (!site || !time) star.refuse("right_ascension_deg", "needs a place and a time");
      const StarPosition seen = star_position(*site, parse_offset_date_time(*time), ra, dec);
      place.direction = {seen.elevation_deg * kRadPerDeg, seen.azimuth_deg * kRadPerDeg};
    } else {
      place.direction = {star.required("elevation_deg", -90, 90) * kRadPerDeg,
                         star.required("azimuth_deg", -360, 360) * kRadPerDeg};
    }
    places.push_back(place);
  }
  return places;
}

CameraPose read_camera(const TableReader& reader) {
  const toml::table* table = reader.table["camera"].as_table();
  if (table == nullptr) reader.refuse("camera", "must be a table, [camera]");
  const TableReader camera{reader.file, *table, "camera."};
  camera.allow({"azimuth_deg", "elevation_deg", "roll_deg", "field_of_view_deg"});
  return {camera.required("azimuth_deg", -360, 360) * kRadPerDeg,
          camera.required("elevation_deg", -90, 90) * kRadPerDeg,
          camera.number("roll_deg", -180, 180).value_or(0.0) * kRadPerDeg,
          camera.required("field_of_view_deg", 0.1, 170) * kRadPerDeg};
}

PhotographOptions read_options(const TableReader& reader, const LinearImage& image) {
  PhotographOptions options;
  options.samples = static_cast<int>(reader.number("samples", 1, 20000).value_or(options.samples));
  options.relative_error =
      reader.number("relative_error", 1e-6, 10).value_or(options.relative_error);
  options.lowest_elevation_deg =
      reader.number("lowest_elevation_deg", -90, 89).value_or(options.lowest_elevation_deg);
  options.sun_distance_deg =
      reader.number("sun_distance_deg", 0, 180).value_or(options.sun_distance_deg);
  options.saturation = reader.number("saturation", 1e-30, 1e30).value_or(options.saturation);
  options.value_scale = reader.number("value_scale", 1e-30, 1e30)
                            .value_or(image.white_luminance_cd_m2.value_or(683.0) / 683.0);
  const std::string exposure =
      reader.word("exposure").value_or(image.white_luminance_cd_m2 ? "calibrated" : "free");
  if (exposure != "free" && exposure != "calibrated") {
    reader.refuse("exposure", "must be \"free\" or \"calibrated\"");
  }
  options.free_exposure = exposure == "free";
  return options;
}

std::vector<SpectralResponse> read_responses(const TableReader& reader,
                                             const std::filesystem::path& folder,
                                             const LinearImage& image) {
  const auto named = reader.word("sensitivities");
  if (!named) {
    try {
      return standard_responses(image.channels);
    } catch (const std::invalid_argument& error) {
      reader.refuse("file", error.what());
    }
  }
  const std::vector<SpectralResponse> known = read_sensitivities(folder / *named);
  std::vector<SpectralResponse> responses;
  for (const std::string& channel : image.channels) {
    const auto found = std::ranges::find(known, channel, &SpectralResponse::name);
    if (found == known.end()) {
      reader.refuse(
          "sensitivities",
          fmt::format("'{}' must have a column '{}', a channel of the image", *named, channel));
    }
    responses.push_back(*found);
  }
  return responses;
}

}  // namespace

Measurement read_photograph(const std::filesystem::path& file, const Scene& scene,
                            std::optional<double> relative_error) {
  std::ifstream stream(file, std::ios::binary);
  const toml::table root = toml::parse(stream, file.string());  // was parsed before
  const TableReader reader{file.string(), root, ""};
  reader.allow({"kind", "file", "mask", "sensitivities", "exposure", "value_scale",
                "relative_error", "samples", "lowest_elevation_deg", "sun_distance_deg",
                "saturation", "time", "sun_elevation_deg", "sun_azimuth_deg", "star_time", "camera",
                "star"});
  const std::filesystem::path folder = file.parent_path();
  const auto named = reader.word("file");
  if (!named || named->empty()) reader.refuse("file", "must be given");
  const LinearImage image = read_linear_image(folder / *named);

  CameraPose pose;
  std::vector<std::pair<std::string, std::string>> figures;
  if (const toml::node* node = root.get("star")) {
    if (!node->is_array()) reader.refuse("star", "must be tables, [[star]]");
    if (root.contains("camera")) reader.refuse("camera", "must not be given beside stars");
    FittedPose fitted;
    try {
      fitted =
          fit_pose(read_stars(reader, *node->as_array(), scene, image), image.width, image.height);
    } catch (const std::invalid_argument& error) {
      if (std::string_view(error.what()).starts_with(file.string())) throw;
      reader.refuse("star", error.what());
    }
    pose = fitted.pose;
    figures.emplace_back(
        "pose by stars",
        fmt::format("{} stars, rms {:.3g} pixels, worst {:.3g}", fitted.residual_pixels.size(),
                    fitted.rms_pixels, std::ranges::max(fitted.residual_pixels)));
  } else if (root.contains("camera")) {
    pose = read_camera(reader);
  } else if (image.pose) {
    pose = *image.pose;
  } else {
    reader.refuse("camera", "must be given, or two stars or more");
  }
  PhotographOptions options = read_options(reader, image);
  if (relative_error) options.relative_error = *relative_error;
  std::vector<char> mask;
  if (const auto name = reader.word("mask")) {
    mask = read_mask(folder / *name, image.width, image.height);
  }
  try {
    Measurement measured = photograph_data(image, mask, pose, sun_of_photograph(reader, scene),
                                           read_responses(reader, folder, image), options);
    measured.file = folder / *named;
    measured.figures.insert(measured.figures.end(), figures.begin(), figures.end());
    return measured;
  } catch (const std::invalid_argument& error) {
    const std::string what = error.what();
    if (what.starts_with(file.string()) || what.find(".csv") != std::string::npos) throw;
    throw std::invalid_argument(fmt::format("{}: {}", file.string(), what));
  }
}

}  // namespace twilight
