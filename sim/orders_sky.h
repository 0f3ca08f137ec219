// The sky by successive orders of scattering (solver.method = "orders").
#pragma once

#include <memory>

#include "sim/orders.h"
#include "sim/orders_field.h"
#include "sim/orders_gather.h"
#include "sim/scene_model.h"

namespace twilight {

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
  ~OrdersSky() override;

  std::span<const double> wavelength_nm() const override;
  std::span<const double> solar_irradiance() const override;
  std::vector<double> radiance(std::span<const ViewDirection> views) const override;
  StokesRadiance stokes(std::span<const ViewDirection> views) const override;
  Irradiance irradiance() const override;
  double apparent_sun_elevation_rad() const override { return apparent_elevation_rad_; }
  std::vector<double> sun_transmittance() const override { return sun_transmittance_; }
  const RunSummary& summary() const override { return summary_; }

  std::shared_ptr<const OrdersField> field() const { return field_; }
  /// Single scattering alone, as stokes().
  StokesRadiance single_scattering(std::span<const ViewDirection> views) const;

 private:
  void prepare(const RunControl& control);
  StokesRadiance gather(std::span<const ViewDirection> views, OrdersGather::Light light) const;

  SceneModel model_;
  OrdersOptions options_;
  std::shared_ptr<const OrdersField> field_;
  OrdersMedium optics_;
  std::unique_ptr<DirectSunlight> sunlight_;
  std::unique_ptr<OrdersGather> gather_;
  double apparent_elevation_rad_ = 0;
  std::vector<double> sun_transmittance_;
  RunSummary summary_;
  struct Arena;
  std::unique_ptr<Arena> arena_;
};

}  // namespace twilight
