// Nodes in solar zenith angle, dense about the terminator.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace twilight {

/// Solar zenith angles 0..pi, uniform in a smooth coordinate t that makes steps of step_deg
/// between about 78 and 114 degrees (the terminator, and the air that lights it) and coarse steps
/// on the day and night sides; interpolation between nodes is cubic in t.
class ZenithGrid {
 public:
  /// A step of the fine uniform scale on which t and the steep reference values are tabulated.
  static constexpr double kFineStep_deg = 0.05;
  static constexpr std::size_t kFineSize = 3602;  // 0..180 deg and one to spare

  /// step_deg in [0.05, 5]; coarse steps are at most coarse_deg.
  explicit ZenithGrid(double step_deg, double coarse_deg = 4.0);

  std::size_t size() const { return zenith_rad_.size(); }
  const std::vector<double>& zenith_rad() const { return zenith_rad_; }
  /// t of the fine scale's points, 0..size() - 1.
  const std::vector<float>& fine_position() const { return fine_position_; }

  /// Four neighbouring nodes and their weights.
  struct Stencil {
    std::size_t first;
    std::array<double, 4> weight;
  };
  /// Cubic Lagrange interpolation at t (0..size() - 1, clamped), one-sided at the ends.
  static Stencil stencil(double t, std::size_t size);
  /// t of an angle, 0..size() - 1.
  double position(double zenith_rad) const;

 private:
  double raw_position(double zenith_deg) const;
  double step_deg_, coarse_deg_, scale_ = 1;
  std::vector<double> zenith_rad_;
  std::vector<float> fine_position_;
};

}  // namespace twilight
