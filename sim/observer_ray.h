// View rays of one observer, cut where light is sampled along them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "sim/orders_atmosphere.h"

namespace twilight {

/// A refracted view ray and what each of its points adds to the light that arrives, per unit of
/// source: neither Sun nor azimuth changes it. Colours that bend differently follow their own rays;
/// where these pass the same shells they share the points, whose places differ by small shifts per
/// lane.
struct ObserverRay {
  double zenith_rad = 0;  ///< apparent, at the observer
  bool hits_ground = false;

  /// Points of single scattering: middles of the steps that OrdersGather takes.
  struct Window {
    SunlitAir::Place place;
    double central_angle_rad, sin_angle, cos_angle;
    double sin_zenith, cos_zenith;  ///< of the look direction, at the point
  };
  std::vector<Window> windows;
  /// Integral of transmittance times scattering coefficient over the step, over 4 pi:
  /// [window][air, kinds][lane]; its sum over windows, [air, kinds][lane].
  std::vector<float> scatter, scatter_sum;
  /// Of the colours' own points, [window][lane]: SunlitAir::Place::above, and central angle.
  std::vector<float> above_shift, angle_shift_rad;

  /// Points of multiple scattering, as SampledPath.
  struct Sample {
    std::size_t level;
    double central_angle_rad;
    float sin_zenith, cos_zenith;
    double zenith_rad;
    bool aerosol;
  };
  std::vector<Sample> samples;
  std::vector<float> source_weight;           ///< [sample][air, kinds][lane]
  std::vector<float> sample_angle_shift_rad;  ///< [sample][lane]

  double ground_angle_rad = 0;
  std::vector<float> ground_transmittance;  ///< [lane], 0 for colours that miss the ground
};

/// Rays by elevation, made when first asked for. Safe to share between threads.
class ObserverRays {
 public:
  /// `atmosphere` outlives the object.
  ObserverRays(const OrdersAtmosphere& atmosphere, double altitude_km)
      : air_(atmosphere), altitude_km_(altitude_km) {}

  std::shared_ptr<const ObserverRay> at(double elevation_rad) const;
  double altitude_km() const { return altitude_km_; }

 private:
  ObserverRay make(double elevation_rad) const;

  const OrdersAtmosphere& air_;
  double altitude_km_;
  mutable std::mutex mutex_;
  mutable std::unordered_map<std::uint64_t, std::shared_ptr<const ObserverRay>> rays_;
};

}  // namespace twilight
