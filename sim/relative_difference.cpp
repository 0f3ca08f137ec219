#include "sim/relative_difference.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "sim/gauss_legendre.h"

namespace twilight {

WeightedViews coarse_hemisphere(int elevations, int azimuths) {
  if (elevations < 1 || azimuths < 2) {
    throw std::invalid_argument("coarse_hemisphere needs an elevation and two azimuths");
  }
  WeightedViews result;
  const double intervals = azimuths - 1;
  for (const GaussNode& sine : gauss_legendre(elevations, 0, 1)) {
    for (int k = 0; k < azimuths; ++k) {
      result.views.push_back({std::asin(sine.x), k * std::numbers::pi / intervals});
      result.weight.push_back(sine.weight * (k == 0 || k + 1 == azimuths ? 0.5 : 1.0) / intervals);
    }
  }
  return result;
}

WeightedViews listed_views(std::span<const ViewDirection> views) {
  WeightedViews result;
  result.views.assign(views.begin(), views.end());
  result.weight.assign(views.size(), 1.0 / static_cast<double>(views.size()));
  return result;
}

RelativeDifference relative_difference(const WeightedViews& views,
                                       std::span<const double> solar_irradiance,
                                       std::span<const double> truth,
                                       std::span<const double> radiance) {
  const std::size_t V = views.views.size(), W = solar_irradiance.size();
  if (truth.size() != V * W || radiance.size() != V * W) {
    throw std::invalid_argument("sky_difference: radiances must be [view][wavelength]");
  }
  std::vector<double> brightest(V, 0.0);
  for (std::size_t v = 0; v < V; ++v) {
    for (std::size_t w = 0; w < W; ++w) {
      brightest[v] = std::max(brightest[v], truth[v * W + w] / solar_irradiance[w]);
    }
  }
  RelativeDifference result;
  std::vector<std::pair<double, double>> errors(V);  // and weight
  for (std::size_t w = 0; w < W; ++w) {
    double mean = 0;
    for (std::size_t v = 0; v < V; ++v) {
      const double light =
          std::max(truth[v * W + w], kFaintShare * brightest[v] * solar_irradiance[w]);
      const double error =
          light > 0 ? std::abs(radiance[v * W + w] - truth[v * W + w]) / light : 0.0;
      errors[v] = {error, views.weight[v]};
      mean += views.weight[v] * error;
    }
    std::ranges::sort(errors, std::greater<>());
    constexpr double kBeyond = 0.05 * (1 + 1e-9);
    double beyond = 0;
    std::size_t at = 0;
    while (at + 1 < V && beyond + errors[at].second <= kBeyond) beyond += errors[at++].second;
    result.mean = std::max(result.mean, mean);
    result.percentile_95 = std::max(result.percentile_95, errors[at].first);
    result.largest = std::max(result.largest, errors.front().first);
  }
  return result;
}

}  // namespace twilight
