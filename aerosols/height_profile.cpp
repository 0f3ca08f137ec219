#include "aerosols/height_profile.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace twilight {
namespace {

// Index of the interval of a table that holds z; z lies within the table.
std::size_t interval(const std::vector<double>& heights_km, double z_km) {
  const auto above = std::upper_bound(heights_km.begin() + 1, heights_km.end() - 1, z_km);
  return static_cast<std::size_t>(above - heights_km.begin()) - 1;
}

double tabulated_at(const HeightProfile& p, double z_km) {
  const std::size_t i = interval(p.heights_km, z_km);
  const double t = (z_km - p.heights_km[i]) / (p.heights_km[i + 1] - p.heights_km[i]);
  return std::lerp(p.relative_density[i], p.relative_density[i + 1], t);
}

double tabulated_integral(const HeightProfile& p, double from_km, double to_km) {
  double sum = 0.0;
  for (std::size_t i = interval(p.heights_km, from_km); i + 1 < p.heights_km.size(); ++i) {
    const double a = std::max(from_km, p.heights_km[i]);
    const double b = std::min(to_km, p.heights_km[i + 1]);
    if (b > a) sum += (b - a) * tabulated_at(p, 0.5 * (a + b));  // exact for a line
    if (p.heights_km[i + 1] >= to_km) break;
  }
  return sum;
}

}  // namespace

double HeightProfile::at(double z_km) const {
  if (!(z_km >= bottom_km && z_km < top_km)) return 0.0;
  if (!heights_km.empty()) return tabulated_at(*this, z_km);
  return std::exp(-z_km / scale_height_km);
}

double HeightProfile::integral_km(double z0_km, double z1_km) const {
  const double from = std::max(z0_km, bottom_km);
  const double to = std::min(z1_km, top_km);
  if (to <= from) return 0.0;
  if (!heights_km.empty()) return tabulated_integral(*this, from, to);
  const double scale = scale_height_km;
  if (std::isinf(scale)) return to - from;
  // expm1 keeps thin slices exact.
  return -scale * std::exp(-from / scale) * std::expm1(-(to - from) / scale);
}

double HeightProfile::mean(double z0_km, double z1_km) const {
  if (!(std::isfinite(z0_km) && std::isfinite(z1_km) && z0_km < z1_km)) {
    throw std::invalid_argument("height interval " + std::to_string(z0_km) + ".." +
                                std::to_string(z1_km) +
                                " km must be finite with its lower end below its upper end");
  }
  return integral_km(z0_km, z1_km) / (z1_km - z0_km);
}

HeightProfile tabulated_profile(std::vector<double> heights_km,
                                std::vector<double> relative_density) {
  if (heights_km.size() < 2 || heights_km.size() != relative_density.size()) {
    throw std::invalid_argument("a height profile has " + std::to_string(heights_km.size()) +
                                " heights and " + std::to_string(relative_density.size()) +
                                " densities: must have two or more, as many of both");
  }
  for (std::size_t i = 0; i < heights_km.size(); ++i) {
    if (!std::isfinite(heights_km[i]) || (i > 0 && !(heights_km[i] > heights_km[i - 1]))) {
      throw std::invalid_argument("height " + std::to_string(heights_km[i]) +
                                  " km of a profile must be finite and above the one before it");
    }
    if (!(std::isfinite(relative_density[i]) && relative_density[i] >= 0.0)) {
      throw std::invalid_argument("relative density " + std::to_string(relative_density[i]) +
                                  " of a height profile must be finite and at least 0");
    }
  }
  if (!(*std::ranges::max_element(relative_density) > 0.0)) {
    throw std::invalid_argument("a height profile must hold a relative density above 0");
  }
  HeightProfile profile;
  profile.bottom_km = heights_km.front();
  profile.top_km = heights_km.back();
  profile.heights_km = std::move(heights_km);
  profile.relative_density = std::move(relative_density);
  return profile;
}

}  // namespace twilight
