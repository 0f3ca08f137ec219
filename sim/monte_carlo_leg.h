// A straight leg of a photon's path, cut at the shells.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace twilight {

/// One crossing of a shell by a straight leg: where it ends (km from the leg's start) and the
/// layer.
struct LegCrossing {
  double end_km;
  std::size_t layer;
};

/// Cuts straight lines at the boundaries of spherical shells.
class LegCutter {
 public:
  LegCutter() = default;
  LegCutter(std::span<const double> boundary_km, double radius_km)
      : boundary_km_(boundary_km.begin(), boundary_km.end()), radius_km_(radius_km) {
    crossings_.reserve(2 * boundary_km_.size());
  }

  /// The leg from an altitude inside a layer along the cosine of its zenith angle, to the ground
  /// (returns true) or out of the top. Result in crossings().
  bool cut(double height_km, std::size_t layer, double cosine) {
    crossings_.clear();
    const double r = radius_km_ + height_km;
    const double x0 = r * cosine;
    // (r_k^2 - b^2) without cancellation
    const auto squared = [&](std::size_t k) {
      const double dh = boundary_km_[k] - height_km;
      return x0 * x0 + dh * (boundary_km_[k] + height_km + 2 * radius_km_);
    };
    std::size_t k = layer;
    double end = 0;
    if (cosine < 0) {
      for (;;) {
        const double s = squared(k);
        if (s <= 0) break;
        end = std::max(end, -std::sqrt(s) - x0);
        crossings_.push_back({end, k});
        if (k == 0) return true;
        --k;
      }
    }
    for (; k + 1 < boundary_km_.size(); ++k) {
      end = std::max(end, std::sqrt(std::max(0.0, squared(k + 1))) - x0);
      crossings_.push_back({end, k});
    }
    return false;
  }

  std::span<const LegCrossing> crossings() const { return crossings_; }

 private:
  std::vector<double> boundary_km_;
  double radius_km_ = 0;
  std::vector<LegCrossing> crossings_;
};

}  // namespace twilight
