#include "output/hemisphere.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "sim/gauss_legendre.h"

namespace twilight {

std::vector<WeightedView> hemisphere_views() {
  constexpr int kElevations = 12, kAzimuths = 8;
  constexpr double kLowestSine = 0.01, kStep = std::numbers::pi / kAzimuths;
  std::vector<WeightedView> views;
  for (const GaussNode& sine : gauss_legendre(kElevations, kLowestSine, 1.0)) {
    for (int k = 0; k < kAzimuths; ++k) {
      views.push_back({{std::asin(sine.x), (k + 0.5) * kStep}, sine.weight * 2 * kStep});
    }
  }
  return views;
}

Spread spread_of(std::span<const WeightedValue> values) {
  std::vector<WeightedValue> sorted(values.begin(), values.end());
  std::ranges::sort(sorted, {}, &WeightedValue::value);
  Spread spread;
  double weight = 0;
  for (const WeightedValue& v : sorted) {
    if (!std::isfinite(v.value) || !(v.weight >= 0)) {
      throw std::invalid_argument("value " + std::to_string(v.value) + " of weight " +
                                  std::to_string(v.weight) +
                                  ": must be finite, the weight 0 or more");
    }
    spread.mean += v.weight * v.value;
    weight += v.weight;
  }
  if (!(weight > 0)) throw std::invalid_argument("weights add to 0: must add to more");
  spread.mean /= weight;
  spread.largest = sorted.back().value;
  double below = 0;
  for (const WeightedValue& v : sorted) {
    below += v.weight;
    if (below < 0.95 * weight * (1 - 1e-12)) continue;
    spread.p95 = v.value;
    break;
  }
  return spread;
}

}  // namespace twilight
