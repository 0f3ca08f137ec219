// The sky by the paper's method: observer-centred cells (solver.method = "cells").
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sim/cell_gather.h"
#include "sim/cell_grid.h"
#include "sim/direct_sunlight.h"
#include "sim/exchange.h"
#include "sim/scene_model.h"
#include "sim/view_ray.h"

namespace twilight {

struct SolverArena;

/// Solves the exchange between cells once; then answers for any view.
/// Haber et al. 2005, Sec. 4 and 5. Results do not depend on the number of threads.
class CellSky : public Sky {
 public:
  /// Throws Cancelled when stopped, std::invalid_argument for an invalid model.
  CellSky(const SceneModel& model, const RunControl& control);
  ~CellSky() override;

  std::span<const double> wavelength_nm() const override;
  std::span<const double> solar_irradiance() const override;
  std::vector<double> radiance(std::span<const ViewDirection> views) const override;
  Irradiance irradiance() const override;
  double apparent_sun_elevation_rad() const override { return apparent_elevation_rad_; }
  std::vector<double> sun_transmittance() const override { return sun_transmittance_; }
  const RunSummary& summary() const override { return summary_; }

  const ExchangeReport& exchange_report() const { return exchange_.report; }
  const CellGrid& grid() const { return *grid_; }
  /// Single scattering alone, as radiance().
  std::vector<double> single_scattering(std::span<const ViewDirection> views) const;

 private:
  std::vector<double> gather(std::span<const ViewDirection> views, ViewGather::Light light) const;
  void find_direct_sun();
  void summarise(double total_seconds);

  SceneModel model_;
  ExchangeOptions options_;
  ExchangeOptics optics_;
  Medium beam_;
  SunGeometry sun_;
  std::unique_ptr<DirectSunlight> sunlight_;
  std::unique_ptr<CellGrid> grid_;
  ExchangeResult exchange_;
  std::unique_ptr<ViewGather> view_gather_;
  std::unique_ptr<CellGather> cell_gather_;
  double apparent_elevation_rad_ = 0;
  std::vector<double> sun_transmittance_;
  std::vector<double> beam_transmittance_;  // with the delta-M forward peak left in
  double observer_height_km_ = 0;
  RunSummary summary_;
  std::unique_ptr<SolverArena> arena_;
};

}  // namespace twilight
