#include "output/colour_temperature.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <vector>

namespace twilight {
namespace {

using Point = std::array<double, 2>;

// CIE 1960 u, v.
Point uv_of(const Tristimulus& xyz) {
  const double sum = xyz[0] + 15 * xyz[1] + 3 * xyz[2];
  return {4 * xyz[0] / sum, 6 * xyz[1] / sum};
}

constexpr double kFirstMired = 1e6 / kHighestColourTemperature_K;
constexpr std::size_t kSteps = 999;  // to 1000 mired
static_assert(kFirstMired + kSteps == 1e6 / kLowestColourTemperature_K);

// The Planckian locus at kFirstMired, kFirstMired + 1, ...
const std::vector<Point>& locus() {
  static const std::vector<Point> points = [] {
    std::vector<Point> p;
    for (std::size_t k = 0; k <= kSteps; ++k) {
      p.push_back(uv_of(black_body_xyz(1e6 / (kFirstMired + static_cast<double>(k)))));
    }
    return p;
  }();
  return points;
}

}  // namespace

Tristimulus black_body_xyz(double temperature_K) {
  if (!(temperature_K > 0)) {
    throw std::invalid_argument(
        fmt::format("temperature of a black body is {} K; it must be > 0", temperature_K));
  }
  constexpr double kC2_nm_K = 1.4388e7;
  const auto table = colour_matching_table(ColourObserver::kCie1931);
  Tristimulus sum = {0, 0, 0};
  for (std::size_t row = 0; row < kObserverRows; ++row) {
    const double nm = kFirstObserverWavelength_nm + static_cast<double>(row);
    const double power = std::pow(nm / 560, -5) / std::expm1(kC2_nm_K / (nm * temperature_K)) *
                         std::expm1(kC2_nm_K / (560 * temperature_K));
    for (std::size_t c = 0; c < 3; ++c) sum[c] += power * table[row][c];
  }
  return sum;
}

double correlated_colour_temperature_K(const std::array<double, 2>& xy) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const double below = -2 * xy[0] + 12 * xy[1] + 3;
  if (!std::isfinite(below) || !(below > 0)) return kNone;
  const Point light = {4 * xy[0] / below, 6 * xy[1] / below};
  const std::vector<Point>& path = locus();
  double nearest = std::numeric_limits<double>::infinity(), mired = kNone;
  for (std::size_t k = 0; k < kSteps; ++k) {
    const double du = path[k + 1][0] - path[k][0], dv = path[k + 1][1] - path[k][1];
    const double u = light[0] - path[k][0], v = light[1] - path[k][1];
    double t = (u * du + v * dv) / (du * du + dv * dv);
    // Nearest to an end: of the whole locus outside its range, of a step between two steps.
    const bool outside = (k == 0 && t < 0) || (k + 1 == kSteps && t > 1);
    t = std::fmin(std::fmax(t, 0.0), 1.0);
    const double away = std::hypot(u - t * du, v - t * dv);
    if (!(away < nearest)) continue;
    nearest = away;
    mired = outside ? kNone : kFirstMired + static_cast<double>(k) + t;
  }
  return nearest <= kFarthestFromPlanck_uv ? 1e6 / mired : kNone;
}

}  // namespace twilight
