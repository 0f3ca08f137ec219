#include "output/photograph.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "output/colour.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

double sun_angle_rad(MapDirection d, const MeasuredSun& sun) {
  const double c = std::sin(d.elevation_rad) * std::sin(sun.elevation_rad) +
                   std::cos(d.elevation_rad) * std::cos(sun.elevation_rad) *
                       std::cos(d.azimuth_rad - sun.azimuth_rad);
  return std::acos(std::clamp(c, -1.0, 1.0));
}

/// Sums over the pixels of sky of one block.
struct Block {
  struct Quarter {
    double x = 0, y = 0, count = 0;
  };
  std::array<Quarter, 4> quarters;
  std::vector<double> sum, squares;
  double count = 0;
  bool usable = true;
};

/// What the blocks are taken from.
struct Picture {
  const LinearImage& image;
  const std::vector<char>& mask;
  const CameraPose& pose;
  const MeasuredSun& sun;
  const PhotographOptions& options;

  bool sky_at(int x, int y) const {
    const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                    static_cast<std::size_t>(x);
    if (!mask.empty() && mask[at] == 0) return false;
    const MapDirection d = direction_at(pose, image.width, image.height, {x + 0.5, y + 0.5});
    return d.elevation_rad >= options.lowest_elevation_deg * kRadPerDeg &&
           sun_angle_rad(d, sun) >= options.sun_distance_deg * kRadPerDeg;
  }

  Block block(int left, int top, int right, int bottom) const {
    const std::size_t channels = image.channels.size();
    Block b;
    b.sum.assign(channels, 0.0);
    b.squares.assign(channels, 0.0);
    for (int y = top; y < bottom; ++y) {
      for (int x = left; x < right; ++x) {
        if (!sky_at(x, y)) continue;
        const std::size_t at =
            (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
             static_cast<std::size_t>(x)) *
            channels;
        for (std::size_t c = 0; c < channels; ++c) {
          const double value = static_cast<double>(image.pixels[at + c]);
          if (!(value > 0 && value < options.saturation)) b.usable = false;
          b.sum[c] += value;
          b.squares[c] += value * value;
        }
        Block::Quarter& q =
            b.quarters[(2 * x >= left + right ? 1u : 0u) + (2 * y >= top + bottom ? 2u : 0u)];
        q.x += x + 0.5;
        q.y += y + 0.5;
        q.count += 1;
        b.count += 1;
      }
    }
    return b;
  }
};

}  // namespace

std::vector<SpectralResponse> standard_responses(const std::vector<std::string>& channels) {
  std::vector<SpectralResponse> responses;
  constexpr std::string_view kRgb = "RGB", kXyz = "XYZ";
  for (const std::string& channel : channels) {
    const std::size_t rgb = channel.size() == 1 ? kRgb.find(channel) : std::string_view::npos;
    const std::size_t xyz = channel.size() == 1 ? kXyz.find(channel) : std::string_view::npos;
    if (rgb == std::string_view::npos && xyz == std::string_view::npos) {
      throw std::invalid_argument(
          fmt::format("channel '{}' has no sensitivity: must be R, G, B or X, Y, Z, or named in "
                      "`sensitivities`",
                      channel));
    }
    SpectralResponse response{channel, std::nullopt, {}, {}};
    for (int nm = kFirstObserverWavelength_nm; nm <= kLastObserverWavelength_nm; ++nm) {
      const Tristimulus cmf = colour_matching(ColourObserver::kCie1931, nm);
      double value = 0;
      if (xyz != std::string_view::npos) {
        value = cmf[xyz];
      } else {
        for (std::size_t c = 0; c < 3; ++c) value += rec709_from_xyz()[rgb][c] * cmf[c];
      }
      response.sensitivity_nm.push_back(nm);
      response.sensitivity.push_back(value);
    }
    responses.push_back(std::move(response));
  }
  return responses;
}

Measurement photograph_data(const LinearImage& image, const std::vector<char>& mask,
                            const CameraPose& pose, const MeasuredSun& sun,
                            std::vector<SpectralResponse> responses,
                            const PhotographOptions& options) {
  Measurement measured;
  measured.kind = MeasuredKind::kPhotograph;
  measured.suns = {sun};
  measured.responses = std::move(responses);
  measured.free_exposure = options.free_exposure;
  measured.width = image.width;
  measured.height = image.height;
  const Picture picture{image, mask, pose, sun, options};
  const double area = static_cast<double>(image.width) * image.height;
  const int side = std::max(1, static_cast<int>(std::ceil(std::sqrt(area / options.samples))));
  std::size_t blocks = 0, cut = 0;
  for (int top = 0; top < image.height; top += side) {
    for (int left = 0; left < image.width; left += side) {
      const int right = std::min(image.width, left + side);
      const int bottom = std::min(image.height, top + side);
      const Block b = picture.block(left, top, right, bottom);
      if (2 * b.count < static_cast<double>(side) * side) continue;
      if (!b.usable) {
        ++cut;
        continue;
      }
      ++blocks;
      std::vector<std::pair<std::size_t, double>> views;
      for (const Block::Quarter& q : b.quarters) {
        if (q.count == 0) continue;
        const MapDirection d =
            direction_at(pose, image.width, image.height, {q.x / q.count, q.y / q.count});
        views.emplace_back(measured.views.size(), q.count / b.count);
        measured.views.push_back({d.elevation_rad, d.azimuth_rad - sun.azimuth_rad});
      }
      for (std::size_t c = 0; c < image.channels.size(); ++c) {
        const double mean = b.sum[c] / b.count;
        const double variance = std::max(0.0, b.squares[c] / b.count - mean * mean);
        const double noise = std::sqrt(variance / b.count);
        MeasuredValue value{0,   views, c,     mean * options.value_scale, 0.0, 0, left,
                            top, right, bottom};
        value.standard_error =
            options.value_scale * std::hypot(noise, options.relative_error * mean);
        measured.values.push_back(std::move(value));
      }
    }
  }
  if (blocks == 0) {
    throw std::invalid_argument(fmt::format(
        "no block of {} x {} pixels is left of the sky ({} had values that were cut off)", side,
        side, cut));
  }
  measured.figures = {
      {"photograph", fmt::format("{} x {} pixels, {} blocks of {} x {} of sky, {} cut off left out",
                                 image.width, image.height, blocks, side, side, cut)},
      {"camera", fmt::format("azimuth {:.4f} deg, elevation {:.4f} deg, roll {:.4f} deg, field of "
                             "view {:.4f} deg",
                             pose.azimuth_rad / kRadPerDeg, pose.elevation_rad / kRadPerDeg,
                             pose.roll_rad / kRadPerDeg, pose.field_of_view_rad / kRadPerDeg)}};
  return measured;
}

}  // namespace twilight
