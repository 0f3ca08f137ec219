#include "output/linear_image.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "output/image_module.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

// Beside the program, or where it was built. It stays loaded.
ReadModuleImage* module_reader() {
  const std::filesystem::path built = TWILIGHT_IMAGE_MODULE;
  std::error_code none;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", none);
  for (const auto& file : {program.parent_path() / built.filename(), built}) {
    void* const module = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr) continue;
    void* const function = ::dlsym(module, kReadModuleImage);
    if (function != nullptr) return reinterpret_cast<ReadModuleImage*>(function);
  }
  const char* const reason = ::dlerror();
  throw std::runtime_error(fmt::format("cannot load {}, which reads images: {}",
                                       built.filename().string(),
                                       reason != nullptr ? reason : "no reason given"));
}

ModuleImage read_image(const std::filesystem::path& file, const std::vector<std::string>& names) {
  if (!std::filesystem::is_regular_file(file)) {
    throw std::invalid_argument(fmt::format("{}: there is no such image", file.string()));
  }
  ModuleImage image;
  module_reader()(file.c_str(), names, image);
  if (image.error.empty()) return image;
  throw std::invalid_argument(
      fmt::format("{}: cannot read this image: {}", file.string(), image.error));
}

}  // namespace

LinearImage read_linear_image(const std::filesystem::path& file) {
  const ModuleImage raw =
      read_image(file, {"whiteLuminance", "cameraAzimuth", "cameraElevation", "cameraFieldOfView"});
  if (raw.bytes_per_value < 2) {
    throw std::invalid_argument(fmt::format(
        "{}: has 8 bits per value: must be a linear image of 16 bits or floats, as EXR, "
        "HDR or TIFF",
        file.string()));
  }
  LinearImage image;
  image.width = raw.width;
  image.height = raw.height;
  std::vector<std::size_t> taken;
  for (std::size_t c = 0; c < raw.channels.size(); ++c) {
    if (static_cast<int>(c) == raw.alpha_channel) continue;
    taken.push_back(c);
    image.channels.push_back(raw.channels[c]);
  }
  const std::size_t channels = raw.channels.size();
  for (std::size_t at = 0; at < raw.pixels.size(); at += channels) {
    for (const std::size_t c : taken) {
      if (!std::isfinite(raw.pixels[at + c])) {
        const std::size_t pixel = at / channels, width = static_cast<std::size_t>(raw.width);
        throw std::invalid_argument(fmt::format("{}: pixel ({}, {}), channel {}: must be finite",
                                                file.string(), pixel % width, pixel / width,
                                                raw.channels[c]));
      }
      image.pixels.push_back(raw.pixels[at + c]);
    }
  }
  const auto number = [&](const char* name) -> std::optional<double> {
    const auto found = raw.numbers.find(name);
    if (found == raw.numbers.end()) return std::nullopt;
    return found->second;
  };
  image.white_luminance_cd_m2 = number("whiteLuminance");
  const auto azimuth = number("cameraAzimuth"), elevation = number("cameraElevation"),
             field = number("cameraFieldOfView");
  if (azimuth && elevation && field) {
    image.pose =
        CameraPose{*azimuth * kRadPerDeg, *elevation * kRadPerDeg, 0.0, *field * kRadPerDeg};
  }
  return image;
}

std::vector<char> read_mask(const std::filesystem::path& file, int width, int height) {
  const ModuleImage raw = read_image(file, {});
  if (raw.width != width || raw.height != height) {
    throw std::invalid_argument(
        fmt::format("{}: is {} x {} pixels: must be {} x {}, as the photograph", file.string(),
                    raw.width, raw.height, width, height));
  }
  std::vector<char> mask;
  for (std::size_t at = 0; at < raw.pixels.size(); at += raw.channels.size()) {
    mask.push_back(raw.pixels[at] != 0.0f ? 1 : 0);
  }
  return mask;
}

}  // namespace twilight
