#include "output/exr_reader.h"

#include <ImfChannelList.h>
#include <ImfDoubleAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <stdexcept>

namespace twilight {
namespace {

void read_attributes(const Imf::Header& header, StoredMap& map) {
  for (auto it = header.begin(); it != header.end(); ++it) {
    const Imf::Attribute& a = it.attribute();
    if (const auto* real = dynamic_cast<const Imf::DoubleAttribute*>(&a)) {
      map.numbers[it.name()] = real->value();
    } else if (const auto* single = dynamic_cast<const Imf::FloatAttribute*>(&a)) {
      map.numbers[it.name()] = static_cast<double>(single->value());
    } else if (const auto* whole = dynamic_cast<const Imf::IntAttribute*>(&a)) {
      map.numbers[it.name()] = whole->value();
    } else if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a);
               text != nullptr && std::string_view(it.name()) == "projection") {
      try {
        map.image.projection = projection_from_name(text->value());
      } catch (const std::invalid_argument&) {
        // Another program's word: the caller has to know.
      }
    }
  }
  if (map.image.projection && map.image.projection->kind == Projection::kCamera) {
    constexpr double kRadPerDeg = std::numbers::pi / 180;
    CameraView camera;
    camera.azimuth_rad = kRadPerDeg * map.numbers["cameraAzimuth"];
    camera.elevation_rad = kRadPerDeg * map.numbers["cameraElevation"];
    camera.field_of_view_rad = kRadPerDeg * map.numbers["cameraFieldOfView"];
    camera.aspect_ratio = static_cast<double>(map.image.width) / map.image.height;
    map.image.projection = camera;
  }
  if (Imf::hasWhiteLuminance(header)) {
    map.white_luminance_cd_m2 = static_cast<double>(Imf::whiteLuminance(header));
  }
}

}  // namespace

StoredMap read_exr_map(const std::filesystem::path& path) {
  const std::string name = path.string();
  if (!std::filesystem::is_regular_file(path)) {
    throw std::invalid_argument(fmt::format("{}: there is no such image", name));
  }
  StoredMap map;
  try {
    Imf::InputFile file(name.c_str());
    const Imf::Header& header = file.header();
    const auto holds = [&](std::initializer_list<const char*> channels) {
      return std::ranges::all_of(
          channels, [&](const char* c) { return header.channels().findChannel(c) != nullptr; });
    };
    if (holds({"R", "G", "B"})) {
      map.image.channels = {"R", "G", "B"};
    } else if (holds({"X", "Y", "Z"})) {
      map.image.channels = {"X", "Y", "Z"};
    } else {
      throw std::invalid_argument(
          fmt::format("{}: must have the channels R, G, B or X, Y, Z", name));
    }
    const auto window = header.dataWindow();
    map.image.width = window.max.x - window.min.x + 1;
    map.image.height = window.max.y - window.min.y + 1;
    read_attributes(header, map);
    const auto width = static_cast<std::size_t>(map.image.width);
    map.image.pixels.resize(3 * width * static_cast<std::size_t>(map.image.height));
    Imf::FrameBuffer frame;
    const std::size_t row = 3 * sizeof(float) * width;
    for (std::size_t c = 0; c < 3; ++c) {
      frame.insert(map.image.channels[c], Imf::Slice::Make(Imf::FLOAT, map.image.pixels.data() + c,
                                                           window, 3 * sizeof(float), row));
    }
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
  } catch (const std::invalid_argument&) {
    throw;
  } catch (const std::exception& error) {
    throw std::invalid_argument(
        fmt::format("{}: is no EXR image that can be read: {}", name, error.what()));
  }
  for (std::size_t i = 0; i < map.image.pixels.size(); ++i) {
    const float value = map.image.pixels[i];
    if (std::isfinite(value)) continue;
    const std::size_t pixel = i / 3, width = static_cast<std::size_t>(map.image.width);
    throw std::invalid_argument(fmt::format("{}: pixel ({}, {}), channel {}, is {}: must be finite",
                                            name, pixel % width, pixel / width,
                                            map.image.channels[i % 3], value));
  }
  return map;
}

std::optional<std::string> text_of_whole_exr(const std::filesystem::path& path,
                                             const std::string& attribute) {
  try {
    Imf::InputFile file(path.c_str());
    const Imf::Header& header = file.header();
    const auto* text = header.findTypedAttribute<Imf::StringAttribute>(attribute);
    if (text == nullptr) return std::nullopt;
    // One row of each channel, in memory of its own, takes every row: reading is all that counts.
    const auto window = header.dataWindow();
    const auto width = static_cast<std::size_t>(window.max.x - window.min.x + 1);
    std::deque<std::vector<float>> rows;
    Imf::FrameBuffer frame;
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
      char* const row = reinterpret_cast<char*>(rows.emplace_back(width).data());
      frame.insert(c.name(), Imf::Slice(Imf::FLOAT, row - window.min.x * 4, sizeof(float), 0));
    }
    file.setFrameBuffer(frame);
    file.readPixels(window.min.y, window.max.y);
    return text->value();
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace twilight
