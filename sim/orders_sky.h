// The sky by successive orders of scattering (solver.method = "orders").
#pragma once

#include <memory>
#include <mutex>

#include "sim/orders.h"
#include "sim/orders_field.h"
#include "sim/orders_gather.h"
#include "sim/scene_model.h"
#include "sim/sky_table.h"

namespace twilight {

struct SolverArena;

/// The reference solver: solves, or takes, the field of an atmosphere and looks at it from one
/// place under one Sun. Results do not depend on the number of threads.
class OrdersSky : public Sky {
 public:
  /// Throws Cancelled when stopped, std::invalid_argument for an invalid model.
  OrdersSky(const SceneModel& model, const RunControl& control);
  /// With a field solved before for the same atmosphere, ground, wavelengths and grid.
  /// Throws std::invalid_argument where its sizes do not fit the model.
  OrdersSky(const SceneModel& model, std::shared_ptr<const OrdersField> field,
            const RunControl& control);
  /// From an atmosphere that another sky has made for this model's (its Sun and observer may
  /// differ): milliseconds.
  OrdersSky(const SceneModel& model, std::shared_ptr<const OrdersAtmosphere> atmosphere,
            const RunControl& control);
  ~OrdersSky() override;

  std::span<const double> wavelength_nm() const override;
  std::span<const double> solar_irradiance() const override;
  std::vector<double> radiance(std::span<const ViewDirection> views) const override;
  /// Interpolated (SkyTable, made by the first call) unless solver.view_interpolation is off; views
  /// that it does not cover are gathered.
  std::vector<double> map_radiance(std::span<const ViewDirection> views) const override;
  StokesRadiance stokes(std::span<const ViewDirection> views) const override;
  Irradiance irradiance() const override;
  double apparent_sun_elevation_rad() const override { return apparent_elevation_rad_; }
  std::vector<double> sun_transmittance() const override { return sun_transmittance_; }
  /// After map_radiance() with the interpolation's figures.
  const RunSummary& summary() const override { return summary_; }

  std::shared_ptr<const OrdersField> field() const { return atmosphere_->field; }
  std::shared_ptr<const OrdersAtmosphere> atmosphere() const { return atmosphere_; }
  /// The same atmosphere and observer under another Sun (geometric elevation; its azimuth, distance
  /// and irradiance stay): milliseconds.
  std::unique_ptr<OrdersSky> under(double sun_elevation_rad) const;
  /// As the sky in front of the path's end: the radiance here less the transmitted radiance that an
  /// observer there sees the same way, all orders. Geometry is straight: over long level paths
  /// refraction, which the radiances have, turns the ray by up to a sixth of the Earth's curve.
  std::optional<AerialLight> aerial_light(const ViewDirection& view,
                                          double distance_km) const override;
  std::unique_ptr<Sky> with_sun_at(double sun_elevation_rad) const override {
    return under(sun_elevation_rad);
  }
  /// As radiance(), without the light that the ground itself sends up a view ray.
  std::vector<double> scattered_radiance(std::span<const ViewDirection> views) const;
  /// Single scattering alone, as stokes().
  StokesRadiance single_scattering(std::span<const ViewDirection> views) const;

 private:
  void look(const RunControl& control);
  // I of views in rows of `azimuths` at one elevation, by the truncated phase functions, which
  // carry the field's energy; [view][wavelength].
  std::vector<double> energy_radiance(std::span<const ViewDirection> views,
                                      std::size_t azimuths) const;
  void tabulate() const;
  StokesRadiance gather(std::span<const ViewDirection> views, OrdersGather::Light light) const;

  SceneModel model_;
  std::shared_ptr<const OrdersAtmosphere> atmosphere_;
  std::unique_ptr<OrdersGather> gather_;
  double apparent_elevation_rad_ = 0;
  std::vector<double> sun_transmittance_;
  std::shared_ptr<const ObserverRays> rays_;
  mutable RunSummary summary_;
  mutable std::once_flag tabulated_;
  mutable std::unique_ptr<const SkyTable> table_;
  std::unique_ptr<SolverArena> arena_;
};

}  // namespace twilight
