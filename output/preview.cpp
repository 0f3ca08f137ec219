#include "output/preview.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "output/atomic_file.h"
#include "output/colour.h"
#include "output/png_file.h"

namespace twilight {
namespace {

LinearRgb pixel_rgb(const SkyImage& image, std::size_t pixel, bool is_xyz) {
  std::array<double, 3> value;
  for (std::size_t c = 0; c < 3; ++c) {
    value[c] = image.pixels[pixel * 3 + c];
    if (!std::isfinite(value[c]) || value[c] < 0.0) {
      throw std::logic_error("channel " + image.channels[c] + " of pixel " + std::to_string(pixel) +
                             " is " + std::to_string(value[c]) + "; it must be finite and >= 0");
    }
  }
  return is_xyz ? into_gamut(linear_rec709(value)).rgb : value;
}

double percentile(const std::vector<double>& sorted, double fraction) {
  return sorted[static_cast<std::size_t>(fraction * static_cast<double>(sorted.size() - 1))];
}

/// Luminances > 0, above the horizon where the image says how it is laid out.
std::vector<double> sky_luminance(const SkyImage& image, const std::vector<double>& luminance) {
  std::vector<double> sky;
  for (std::size_t i = 0; i < luminance.size(); ++i) {
    if (image.projection) {
      const auto width = static_cast<std::size_t>(image.width);
      const auto direction =
          direction_of_pixel(*image.projection, image.height, static_cast<int>(i % width),
                             static_cast<int>(i / width));
      if (!direction || direction->elevation_rad < 0.0) continue;
    }
    if (luminance[i] > 0.0) sky.push_back(luminance[i]);
  }
  // From orbit, or with the camera down, all light comes from below.
  if (sky.empty()) {
    std::ranges::copy_if(luminance, std::back_inserter(sky), [](double y) { return y > 0.0; });
  }
  return sky;
}

std::optional<ToneExposure> exposure_of(std::vector<double> luminance) {
  if (luminance.empty()) return std::nullopt;
  std::sort(luminance.begin(), luminance.end());
  const double darkest = percentile(luminance, 0.01);
  const double brightest = percentile(luminance, 0.99);
  double sum = 0.0;
  for (double y : luminance) sum += std::log(std::clamp(y, darkest, brightest));
  return ToneExposure{std::exp(sum / static_cast<double>(luminance.size())),
                      percentile(luminance, 0.995)};
}

bool in_xyz(const SkyImage& image) {
  const bool is_xyz = image.channels == std::vector<std::string>{"X", "Y", "Z"};
  const std::size_t pixels =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if ((!is_xyz && image.channels != std::vector<std::string>{"R", "G", "B"}) ||
      image.pixels.size() != pixels * 3) {
    throw std::logic_error("a preview needs an image with channels R, G, B or X, Y, Z");
  }
  return is_xyz;
}

std::vector<double> luminance_of(const SkyImage& image, bool is_xyz) {
  std::vector<double> luminance(image.pixels.size() / 3);
  for (std::size_t i = 0; i < luminance.size(); ++i) {
    luminance[i] = rec709_luminance(pixel_rgb(image, i, is_xyz));
  }
  return luminance;
}

double srgb_transfer(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

}  // namespace

std::optional<ToneExposure> sky_exposure(const SkyImage& image) {
  return exposure_of(sky_luminance(image, luminance_of(image, in_xyz(image))));
}

std::vector<std::uint8_t> tone_map(const SkyImage& image, const PreviewSettings& settings) {
  if (!(settings.key > 0.0 && settings.key <= 1.0)) {
    throw std::invalid_argument("preview key is " + std::to_string(settings.key) +
                                "; it must be in (0, 1]");
  }
  if (const auto& given = settings.exposure) {
    for (const double level : {given->grey, given->white}) {
      if (std::isfinite(level) && level > 0.0) continue;
      throw std::invalid_argument("preview exposure is for the luminance " + std::to_string(level) +
                                  "; it must be above 0");
    }
  }
  const bool is_xyz = in_xyz(image);
  const std::vector<double> luminance = luminance_of(image, is_xyz);
  std::optional<ToneExposure> exposure = settings.exposure;
  if (!exposure) exposure = exposure_of(sky_luminance(image, luminance));
  const std::size_t pixels = luminance.size();
  const double scale = exposure ? settings.key / exposure->grey : 0.0;
  // At least 1: an even sky is shown at its key, not blown up to white.
  const double burn_out = exposure ? std::max(1.0, exposure->white * scale) : 1.0;

  std::vector<std::uint8_t> bytes(pixels * 3, 0);
  for (std::size_t i = 0; i < pixels; ++i) {
    if (luminance[i] <= 0.0) continue;
    const double scaled = luminance[i] * scale;
    const double curve = scaled * (1.0 + scaled / (burn_out * burn_out)) / (1.0 + scaled);
    double shown = std::min(1.0, curve);
    const LinearRgb scene = pixel_rgb(image, i, is_xyz);
    LinearRgb display;
    for (std::size_t c = 0; c < 3; ++c) display[c] = scene[c] * (shown / luminance[i]);
    double largest = *std::max_element(display.begin(), display.end());
    // A vivid colour that does not fit gives up light first and saturation for
    // the rest, so that a red glow is not bleached; near white all colours fade. What outshines
    // white, as the Sun does, gives up less: it must not look darker than the sky around it.
    if (largest > 1.0) {
      const double dimmed = std::pow(largest, -0.6 / std::max(1.0, curve));
      shown *= dimmed;
      largest *= dimmed;
      for (double& component : display) component *= dimmed;
    }
    double saturation = std::min(1.0, 3.0 * (1.0 - shown));
    if (largest > 1.0) saturation = std::min(saturation, (1.0 - shown) / (largest - shown));
    for (std::size_t c = 0; c < 3; ++c) {
      const double linear = std::clamp(shown + saturation * (display[c] - shown), 0.0, 1.0);
      bytes[i * 3 + c] = static_cast<std::uint8_t>(std::lround(255.0 * srgb_transfer(linear)));
    }
  }
  return bytes;
}

void write_preview_png(AtomicFile& file, const SkyImage& image, const PreviewSettings& settings) {
  write_png(file, image.width, image.height, tone_map(image, settings));
}

void write_preview_png(const std::filesystem::path& path, const SkyImage& image,
                       const PreviewSettings& settings) {
  AtomicFile file(path);
  write_preview_png(file, image, settings);
  file.commit();
}

}  // namespace twilight
