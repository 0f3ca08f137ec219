// The light of one view elevation, taken apart into what azimuth changes smoothly.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "sim/observer_ray.h"
#include "sim/orders_gather.h"
#include "sim/sky_table_kernel.h"

namespace twilight {

/// Light of one Sun along one observer's rays, azimuth by azimuth, in the blocks that
/// sky_radiance() puts together (SkyPoint::node): logarithms of multiply scattered light and, for
/// air and every kind of aerosol, of the single scattering's path integral without the phase
/// function; then the mean change of the Sun's place against the view by refraction, weighted like
/// that integral.
class SkyColumns {
 public:
  /// Everything given outlives the object; the gather is of the same Sun (geometric zenith angle at
  /// the observer). ground_light: the light that the ground sends up the view ray itself; the air
  /// is lit by the ground either way.
  SkyColumns(const OrdersAtmosphere& atmosphere, const OrdersGather& gather,
             double solar_zenith_rad, bool ground_light);

  /// Floats per azimuth: (1 + 3 (1 + kinds)) lanes.
  std::size_t block() const { return block_; }
  /// [azimuth][quantity][lane]; azimuths from the Sun's, rad, 0..pi.
  std::vector<float> at(const ObserverRay& ray, std::span<const double> azimuths) const;
  /// A view (apparent elevation) without its nodes.
  SkyPoint point(double elevation_rad, double azimuth) const;

 private:
  void add_multiple(const ObserverRay& ray, std::span<const double> azimuths, float* light) const;
  void add_ground(const ObserverRay& ray, std::span<const double> azimuths, float* light) const;
  void add_single(const ObserverRay& ray, std::span<const double> azimuths,
                  std::vector<float>& out) const;

  const OrdersAtmosphere& air_;
  const OrdersGather& gather_;
  double solar_zenith_rad_;
  bool ground_light_;
  std::size_t L_, scatterers_, block_;
  std::vector<float> anisotropic_share_;
};

}  // namespace twilight
