// Views of a solved field of the "orders" method.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "atmosphere/refraction.h"
#include "sim/orders.h"
#include "sim/orders_source.h"
#include "sim/phase_table.h"
#include "sim/sunlit_air.h"
#include "sim/zenith_grid.h"

namespace twilight {

/// The light of one Sun seen along refracted rays: single scattering with the full phase functions
/// marched along the ray, multiple scattering from the field (the correction of first order of
/// Nakajima & Tanaka 1988 to delta-M).
class OrdersGather {
 public:
  struct Inputs {
    const Medium* medium = nullptr;  ///< as given, not truncated
    const OrdersMedium* optics = nullptr;
    const OrdersField* field = nullptr;
    const DirectSunlight* sunlight = nullptr;
    OrdersOptions options;
    double solar_zenith_rad = 0;  ///< geometric, at the observer
    double observer_altitude_km = 0;
    /// Solar zenith angles of the air that views can see, about the observer's.
    double reach_rad = 0.45;
  };
  explicit OrdersGather(const Inputs& inputs);

  enum class Light {
    kAll,        ///< single scattering by the full phase functions, and multiple
    kSingle,     ///< single scattering and the ground's reflection of direct light alone
    kTruncated,  ///< as kAll, by the truncated phase functions: it carries the field's energy
  };
  struct Spectrum {
    std::vector<double> i, q, u;  ///< [lane], per unit solar irradiance, sr^-1
  };
  /// Elevation apparent; azimuth from the Sun's, clockwise. Q, U as StokesRadiance.
  Spectrum view(double elevation_rad, double relative_azimuth_rad, Light light) const;

 private:
  Spectrum along(const RayPath& ray, double azimuth, Light light) const;
  void add_single(const RayPath& ray, double azimuth, Light light, Spectrum& out) const;
  void add_multiple(const RayPath& ray, double azimuth, Spectrum& out) const;
  struct SunHere {
    double zenith_rad, cos_azimuth, sin_azimuth;  // of the ray from the Sun's azimuth
  };
  SunHere sun_at(double central_angle_rad, double azimuth) const;

  Inputs in_;
  std::size_t lanes_;
  ZenithGrid zenith_;
  // Colours bend differently: wavelengths [first, last) share the rays of one of them.
  struct Colours {
    std::size_t first, last;
    RefractedRays rays;
  };
  std::vector<Colours> colours_;
  std::size_t middle_ = 0;  // of colours_
  AerosolKinds kinds_;
  PhaseTable full_, truncated_;
  SunlitAir sunlit_;
  std::vector<float> air_per_km_, kind_per_km_;  // [layer][lane], [layer][kind][lane]
  // The field relative to its trace, and the trace on the fine scale, within reach.
  std::vector<float> coherency_, moments_;  // [level][node][..][lane]
  std::vector<float> reference_;            // [level][fine - first_fine_][lane]
  std::vector<float> ground_;               // [fine - first_fine_][lane]
  std::size_t first_fine_ = 0, fine_count_ = 0;
};

}  // namespace twilight
