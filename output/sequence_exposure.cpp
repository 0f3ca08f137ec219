#include "output/sequence_exposure.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

// The value at any frame: reflected in the end points outside 0..size-1.
double continued(std::span<const double> values, long at) {
  const long last = static_cast<long>(values.size()) - 1;
  if (last == 0) return values[0];
  double offset = 0.0, sign = 1.0;
  // Each reflection brings `at` closer to the frames by the sequence's length.
  while (at < 0 || at > last) {
    const bool before = at < 0;
    offset += sign * 2.0 * (before ? values.front() : values.back());
    sign = -sign;
    at = before ? -at : 2 * last - at;
  }
  return offset + sign * values[static_cast<std::size_t>(at)];
}

std::vector<double> gaussian(double sigma) {
  const long reach = static_cast<long>(std::ceil(4.0 * sigma));
  std::vector<double> weights;
  for (long j = -reach; j <= reach; ++j) {
    const double x = static_cast<double>(j) / sigma;
    weights.push_back(std::exp(-0.5 * x * x));
  }
  const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
  for (double& w : weights) w /= sum;
  return weights;
}

}  // namespace

double exposure_kernel_frames(std::size_t frames) {
  return std::max(1.0, static_cast<double>(frames) / 32.0);
}

std::vector<double> smooth_over_frames(std::span<const double> values, double sigma) {
  if (!(sigma > 0.0)) {
    throw std::invalid_argument("kernel width = " + std::to_string(sigma) + ": must be above 0");
  }
  const std::vector<double> weights = gaussian(sigma);
  const long reach = static_cast<long>(weights.size() / 2);
  std::vector<double> smooth(values.size(), 0.0);
  for (std::size_t k = 0; k < values.size(); ++k) {
    for (std::size_t j = 0; j < weights.size(); ++j) {
      const long at = static_cast<long>(k) + static_cast<long>(j) - reach;
      smooth[k] += weights[j] * continued(values, at);
    }
  }
  return smooth;
}

std::vector<ToneExposure> follow_exposures(std::span<const std::optional<ToneExposure>> own) {
  const auto lit = [](const auto& exposure) { return exposure.has_value(); };
  if (std::ranges::none_of(own, lit)) return std::vector<ToneExposure>(own.size());
  std::vector<double> grey, white;
  for (std::size_t k = 0; k < own.size(); ++k) {
    std::size_t distance = 0;
    const std::optional<ToneExposure>* nearest = nullptr;
    for (; nearest == nullptr; ++distance) {
      if (distance <= k && own[k - distance]) {
        nearest = &own[k - distance];
      } else if (k + distance < own.size() && own[k + distance]) {
        nearest = &own[k + distance];
      }
    }
    grey.push_back(std::log((*nearest)->grey));
    white.push_back(std::log((*nearest)->white));
  }
  const double sigma = exposure_kernel_frames(own.size());
  grey = smooth_over_frames(grey, sigma);
  white = smooth_over_frames(white, sigma);
  std::vector<ToneExposure> exposures;
  for (std::size_t k = 0; k < own.size(); ++k) {
    exposures.push_back({std::exp(grey[k]), std::exp(white[k])});
  }
  return exposures;
}

std::vector<ToneExposure> fixed_exposures(std::span<const std::optional<ToneExposure>> own,
                                          double ev, double white_luminance_cd_m2) {
  constexpr double kReflectedLight = 12.5;  // cd s m^-2
  ToneExposure all{std::exp2(ev) * kReflectedLight / 100.0 / white_luminance_cd_m2, 0.0};
  all.white = all.grey;
  for (const auto& exposure : own) {
    if (exposure) all.white = std::max(all.white, exposure->white);
  }
  return std::vector<ToneExposure>(own.size(), all);
}

}  // namespace twilight
