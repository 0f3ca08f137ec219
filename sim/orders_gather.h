// Views of a solved field of the "orders" method.
#pragma once

#include <cstddef>
#include <memory>
#include <numbers>
#include <vector>

#include "atmosphere/refraction.h"
#include "sim/orders_atmosphere.h"

namespace twilight {

/// Steps that single scattering takes through a piece of a ray, 1 where the Earth's shadow moves
/// 0.1 degrees of zenith angle or the altitude step_km (OrdersAtmosphere::single_step_km): sunlight
/// changes by a few percent.
double single_scattering_steps(const PathPiece& piece, double step_km);

/// The light of one Sun seen along refracted rays: single scattering with the full phase functions
/// marched along the ray, multiple scattering from the field (the correction of first order of
/// Nakajima & Tanaka 1988 to delta-M).
class OrdersGather {
 public:
  /// `atmosphere` outlives the object. The Sun's zenith angle is geometric, at the observer.
  OrdersGather(const OrdersAtmosphere& atmosphere, double solar_zenith_rad,
               double observer_altitude_km);

  enum class Light {
    kAll,        ///< single scattering by the full phase functions, and multiple
    kSingle,     ///< single scattering and the ground's reflection of direct light alone
    kScattered,  ///< as kAll, without what the ground itself sends up the view ray
    kTruncated,  ///< as kAll, by the truncated phase functions: it carries the field's energy
  };
  struct Spectrum {
    std::vector<double> i, q, u;  ///< [lane], per unit solar irradiance, sr^-1
  };
  /// Elevation apparent; azimuth from the Sun's, clockwise. Q, U as StokesRadiance.
  Spectrum view(double elevation_rad, double relative_azimuth_rad, Light light) const;

  /// The Sun above a point of a ray.
  struct SunHere {
    double zenith_rad, cos_zenith, sin_zenith;
    double cos_azimuth, sin_azimuth;  ///< of the ray from the Sun's azimuth
  };
  SunHere sun_at(double central_angle_rad, double azimuth) const;
  /// The same, cosine and sine of either angle given.
  struct Turn {
    double cosine, sine;
  };
  SunHere sun_at(const Turn& central_angle, const Turn& azimuth) const;

  /// Sources of multiple scattering stand no further apart than this central angle.
  static constexpr double kMultipleStep_rad = 0.4 * std::numbers::pi / 180;
  /// Rays bent by more than this are followed colour by colour: blue light bends 2 % more than red,
  /// which at 5 degrees of elevation is 0.2 arc minutes.
  static constexpr double kDispersedDeflection_rad = 8.0 / 60 * std::numbers::pi / 180;

 private:
  Spectrum along(const RayPath& ray, double azimuth, Light light) const;
  void add_single(const RayPath& ray, double azimuth, Light light, Spectrum& out) const;
  void add_multiple(const RayPath& ray, double azimuth, Light light, Spectrum& out) const;

  const OrdersAtmosphere& air_;
  std::size_t lanes_;
  Turn solar_zenith_;
  double observer_altitude_km_;
};

}  // namespace twilight
