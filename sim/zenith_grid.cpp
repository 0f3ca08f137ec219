#include "sim/zenith_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

constexpr double kFineFrom_deg = 75, kFineTo_deg = 117, kTransition_deg = 4;
constexpr double kRadPerDeg = std::numbers::pi / 180;

double log_cosh(double x) { return std::abs(x) + std::log1p(std::exp(-2 * std::abs(x))); }

}  // namespace

// dt/dchi = 1 / coarse + (1 / step - 1 / coarse) [tanh((chi - from) / w) - tanh((chi - to) / w)] /
// 2
double ZenithGrid::raw_position(double zenith_deg) const {
  const double excess = 1 / step_deg_ - 1 / coarse_deg_;
  const auto primitive = [&](double x) {
    return 0.5 * kTransition_deg *
           (log_cosh((x - kFineFrom_deg) / kTransition_deg) -
            log_cosh((x - kFineTo_deg) / kTransition_deg));
  };
  return zenith_deg / coarse_deg_ + excess * (primitive(zenith_deg) - primitive(0));
}

double ZenithGrid::position(double zenith_rad) const {
  return scale_ * raw_position(std::clamp(zenith_rad / kRadPerDeg, 0.0, 180.0));
}

ZenithGrid::ZenithGrid(double step_deg, double coarse_deg)
    : step_deg_(step_deg), coarse_deg_(std::max(coarse_deg, step_deg)) {
  if (!(step_deg >= 0.05 && step_deg <= 5)) {
    throw std::invalid_argument("zenith step " + std::to_string(step_deg) +
                                " deg must be in 0.05..5");
  }
  const double intervals = std::ceil(raw_position(180));
  scale_ = intervals / raw_position(180);
  const auto nodes = static_cast<std::size_t>(intervals) + 1;
  zenith_rad_.resize(nodes);
  for (std::size_t j = 0; j < nodes; ++j) {
    double low = 0, high = 180;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      (scale_ * raw_position(middle) < static_cast<double>(j) ? low : high) = middle;
    }
    zenith_rad_[j] = 0.5 * (low + high) * kRadPerDeg;
  }
  zenith_rad_.front() = 0;
  zenith_rad_.back() = std::numbers::pi;
  fine_position_.resize(kFineSize);
  for (std::size_t k = 0; k < kFineSize; ++k) {
    fine_position_[k] = static_cast<float>(
        position(std::min(static_cast<double>(k) * kFineStep_deg, 180.0) * kRadPerDeg));
  }
}

ZenithGrid::Stencil ZenithGrid::stencil(double t, std::size_t size) {
  const double last = static_cast<double>(size) - 1;
  t = std::clamp(t, 0.0, last);
  const double first = std::clamp(std::floor(t) - 1, 0.0, last - 3);
  const double f = t - first - 1;  // -1..2
  return {static_cast<std::size_t>(first),
          {-f * (f - 1) * (f - 2) / 6, (f + 1) * (f - 1) * (f - 2) / 2, -(f + 1) * f * (f - 2) / 2,
           (f + 1) * f * (f - 1) / 6}};
}

}  // namespace twilight
