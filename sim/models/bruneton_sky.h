// The sky of Bruneton & Neyret (2008).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim/models/bruneton_tables.h"
#include "sim/models/model_sky.h"

namespace twilight {

/// Precomputed atmospheric scattering: views from any height, out to space, with few look-ups each
/// (Eqs. 16-18). Radiances in W m^-2 sr^-1 nm^-1, [wavelength]. The Sun is a point no lower than
/// the tables hold (-11.54 degrees).
class BrunetonSky : public ModelSky {
 public:
  /// Fills the tables. Throws std::invalid_argument where the model is undefined (see
  /// within_model_range), Cancelled when stopped.
  BrunetonSky(const SceneModel& model, const RunControl& control);
  /// With tables of the same air, ground and wavelengths.
  BrunetonSky(const SceneModel& model, std::shared_ptr<const BrunetonTables> tables);

  /// From the observer to the Sun; 1 from space where the air is not in the way.
  std::vector<double> sun_transmittance() const override;
  /// Shares the tables, which hold every Sun.
  std::unique_ptr<Sky> with_sun_at(double sun_elevation_rad) const override;

  /// A view's way through the air: where it enters (the observer, or the air's top from space) and
  /// how long it is, km. Length 0: it misses the air.
  struct Passage {
    BrunetonPoint start;
    double length_km = 0.0;
    double before_km = 0.0;  ///< from the observer to the start
  };
  Passage passage(const ViewDirection& view) const;

  /// Aerial perspective of an object at distance_km (from the observer; taken within the air): the
  /// transmittance T(x, x_s) and the light scattered in on the way, S|x - T S|x_s (Eq. 16).
  std::optional<AerialLight> aerial_light(const ViewDirection& view,
                                          double distance_km) const override;

  /// Light scattered into the whole view where terrain shadows `shadow_km` of it in all: the
  /// shadow is put at the far end of views to the ground, S|x - T(x, x_s) S|x_s with x_s = x_o - l
  /// v (Eq. 17), and at the near end of views to the sky, T(x, x_s) S|x_s with x_s = x + l v (Eq.
  /// 18). Length taken within 0..the view's.
  std::vector<double> shadowed_inscatter(const ViewDirection& view, double shadow_km) const;
  /// The same for a shadow between two distances from the observer, km (Sec. 5, lit segments): S|x
  /// without that of the segment in between.
  std::vector<double> shadowed_inscatter(const ViewDirection& view, double shadow_from_km,
                                         double shadow_to_km) const;

  const BrunetonTables& tables() const { return *tables_; }
  /// Light of the ground where the view meets it, before the air: alpha / pi (E_direct + E_sky).
  std::vector<double> ground_radiance(const BrunetonPoint& on_ground) const;

 protected:
  void spectrum(const ViewDirection& view, std::span<double> out) const override;

 private:
  void place_sun();
  // S at distance along a passage, and T from its start, in units of the Sun's irradiance.
  std::vector<double> inscatter_at(const Passage& way, double distance_km) const;
  std::vector<double> transmittance_to(const Passage& way, double distance_km) const;

  std::shared_ptr<const BrunetonTables> tables_;
  std::vector<double> sun_;  // irradiance that reaches the air, after the vertical ozone filter
  double mu_s_ = 1.0, radius_km_ = 6360.0;
};

}  // namespace twilight
