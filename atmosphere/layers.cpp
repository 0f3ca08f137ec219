#include "atmosphere/layers.h"

#include <cmath>
#include <cstddef>
#include <sstream>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

constexpr double kGradedExponent = 0.25;
constexpr double kLeastLayerKm = 1e-3;  // a snapped boundary leaves at least this on either side

// The recursion of Sec. 4.1.2 summed up: exp(-H_i / 8) falls by M / 8 from layer to layer, so
// rounding does not pile up.
std::vector<double> equal_air_mass(double top_km, int layers) {
  const double whole = -std::expm1(-top_km / kHaberScaleHeightKm);
  std::vector<double> h(static_cast<std::size_t>(layers) + 1);
  for (int i = 0; i <= layers; ++i) {
    h[static_cast<std::size_t>(i)] = -kHaberScaleHeightKm * std::log1p(-whole * i / layers);
  }
  return h;
}

std::vector<double> graded(const Profile& profile, double top_km, int layers) {
  const auto measure = [&](double lo, double hi) {
    return profile.power_integral(&ProfileLevel::air_per_cm3, kGradedExponent, lo, hi);
  };
  const double step = measure(0.0, top_km) / layers;
  std::vector<double> h{0.0};
  for (int i = 1; i <= layers; ++i) {
    double lo = h.back();
    double hi = top_km;
    for (int bisection = 0; bisection < 60 && hi - lo > 1e-13 * top_km; ++bisection) {
      const double middle = 0.5 * (lo + hi);
      (measure(h.back(), middle) < step ? lo : hi) = middle;
    }
    h.push_back(0.5 * (lo + hi));
  }
  return h;
}

void snap(std::vector<double>& h, std::span<const double> heights_km) {
  std::vector<bool> taken(h.size(), false);
  for (const double height : heights_km) {
    std::size_t nearest = 0;
    for (std::size_t i = 1; i + 1 < h.size(); ++i) {
      if (!taken[i] && (nearest == 0 || std::abs(h[i] - height) < std::abs(h[nearest] - height))) {
        nearest = i;
      }
    }
    if (nearest == 0) continue;
    if (height - h[nearest - 1] >= kLeastLayerKm && h[nearest + 1] - height >= kLeastLayerKm) {
      h[nearest] = height;
      taken[nearest] = true;
    }
  }
}

}  // namespace

std::vector<double> layer_boundaries_km(const Profile& profile, std::string_view spacing,
                                        double top_km, int layers,
                                        std::span<const double> snap_km) {
  std::ostringstream problem;
  if (layers < 1 || layers > 500) {
    problem << "layers " << layers << " must be 1..500";
  } else if (!(top_km >= 1.0 && top_km <= profile.top_km())) {
    problem << "top_km " << top_km << " must be 1.." << profile.top_km() << " for profile "
            << profile.name();
  }
  for (const double height : snap_km) {
    if (!std::isfinite(height)) problem << "snap height " << height << " km must be finite";
  }
  if (!problem.str().empty()) throw std::invalid_argument(problem.str());

  std::vector<double> h;
  if (spacing == "equal-air-mass") {
    h = equal_air_mass(top_km, layers);
  } else if (spacing == "even") {
    for (int i = 0; i <= layers; ++i) h.push_back(top_km * i / layers);
  } else if (spacing == "graded") {
    h = graded(profile, top_km, layers);
  } else {
    throw std::invalid_argument("layer_spacing '" + std::string(spacing) +
                                "' must be one of graded, equal-air-mass, even");
  }
  h.front() = 0.0;
  h.back() = top_km;
  if (spacing != "equal-air-mass") snap(h, snap_km);
  return h;
}

}  // namespace twilight
