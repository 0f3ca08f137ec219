// The sky of one Sun and one observer, interpolated between few directions.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/observer_ray.h"
#include "sim/orders_gather.h"
#include "sim/sky_column.h"

namespace twilight {

/// Cubic interpolation among nodes that stand at any distances.
class CubicNodes {
 public:
  struct Stencil {
    std::size_t node[4];
    double weight[4];
  };
  CubicNodes() = default;
  /// At least 2 nodes, strictly increasing. mirrored: the function is even about both ends.
  CubicNodes(std::vector<double> nodes, bool mirrored);
  /// Lagrange weights at x, clamped to the nodes' range.
  Stencil at(double x) const;
  const std::vector<double>& nodes() const { return nodes_; }

 private:
  struct Interval {
    std::size_t node[4];
    double at[4], inverse[4];
  };
  std::vector<double> nodes_;
  std::vector<Interval> intervals_;
};

/// Radiance (I alone) in every direction, interpolated between nodes of elevation and azimuth.
///
/// Interpolated are the logarithms of multiply scattered light and, for air and every kind of
/// aerosol, of the single scattering's path integral without the phase function, both smooth; and
/// the mean change of the Sun's place against the view by refraction, weighted like that integral.
/// Every direction then has the phase functions of its own scattering angle, so that the aureole
/// stays sharp. Views that meet the ground and those above the horizontal are interpolated apart,
/// in coordinates in which the light is smooth: dense at the horizon. Observers above the ground
/// see air below the horizontal, too, a narrow belt with a kink wherever a view grazes a layer,
/// which is left to the gather. Nodes are chosen by bisection: each interval's middle is gathered,
/// and halves are bisected on where it was interpolated worse than kTolerance. So the nodes depend
/// on the sky alone, not on threads.
class SkyTable {
 public:
  /// Relative error of an interval's middle, before it becomes a node itself, at which its halves
  /// are bisected too. The error left is a tenth of it, see sim/README.md.
  static constexpr double kTolerance = 3e-4;
  /// Aerosols of more kinds are looked at direction by direction.
  static constexpr std::size_t kMostKinds = 12;

  /// Everything given outlives the object. Runs on the current oneTBB arena.
  SkyTable(const OrdersAtmosphere& atmosphere, const ObserverRays& rays, const OrdersGather& gather,
           double solar_zenith_rad);

  /// Per unit solar irradiance, sr^-1, [lane]. False, radiance untouched, between the ground's
  /// horizon and the horizontal (from above the air: its top): there views have to be gathered.
  bool radiance(double elevation_rad, double relative_azimuth_rad, float* radiance) const;

  std::size_t elevations() const { return columns_.size(); }
  std::size_t azimuths() const { return azimuth_.nodes().size(); }
  /// Largest error of the middles of the last intervals, before they became nodes.
  double largest_error() const { return largest_error_; }

 private:
  // A range of elevations in which light is smooth in the coordinate x, 0..1, growing with
  // elevation.
  enum class Shape { kGround, kUp };
  struct Segment {
    Shape shape;
    double low_rad, high_rad, cos_high;
    CubicNodes nodes;
    std::vector<std::size_t> column;
    double x(double elevation_rad) const;
    double elevation_rad(double x) const;
  };
  using Column = std::vector<float>;  // [azimuth][quantity][lane]

  void lay_out();
  void choose_azimuths();
  void fill();
  Column evaluate(double elevation_rad, std::span<const double> azimuths) const {
    return light_.at(*rays_.at(elevation_rad), azimuths);
  }
  double error(double elevation_rad, double azimuth, const float* truth, const float* const* nodes,
               const double* weights) const;

  const OrdersAtmosphere& air_;
  const ObserverRays& rays_;
  SkyColumns light_;
  double solar_zenith_rad_;
  std::size_t L_, block_;          // block: floats per node
  double highest_air_rad_ = 10;    // no air beyond
  std::vector<Segment> segments_;  // from below upwards
  CubicNodes azimuth_;
  std::vector<Column> columns_;
  double largest_error_ = 0;
};

}  // namespace twilight
