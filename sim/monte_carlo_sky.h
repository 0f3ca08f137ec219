// The sky by backward Monte Carlo (solver.method = "monte-carlo"): the independent judge.
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <vector>

#include "sim/monte_carlo_path.h"
#include "sim/scene_model.h"

namespace twilight {

struct SolverArena;

/// One view's Stokes parameters with standard errors (one sigma), W m^-2 sr^-1 nm^-1, per
/// wavelength.
struct MonteCarloEstimate {
  std::vector<double> i, q, u;
  std::vector<double> i_error, q_error, u_error;
  /// Contributions to i by scattering order 1..5, and 6 and more: [order - 1][wavelength].
  std::array<std::vector<double>, 6> order, order_error;
  double photons = 0;  ///< paths followed
};

/// Backward, polarised (or scalar), spherical, refracting Monte Carlo with a local estimate of the
/// sunlight at every scattering and ground reflection. Paths are drawn towards the light by a rough
/// solution of its own (MonteCarloImportance) and are shared by all wavelengths. Shares
/// SceneModel and Medium with the other solvers and nothing else.
///
/// Work is done in radiance(), stokes() and irradiance(), on the solver's threads; results depend
/// on scene, seed and view alone: not on threads, nor on which other views are asked for.
class MonteCarloSky : public Sky {
 public:
  /// Builds the sunlight and importance tables. What control refers to must outlive the sky, which
  /// reports and asks while it works. Throws Cancelled
  /// when stopped (as do the others), std::invalid_argument for an invalid model or where
  /// refraction would duct rays.
  MonteCarloSky(const SceneModel& model, const RunControl& control);
  ~MonteCarloSky() override;

  std::span<const double> wavelength_nm() const override { return model_.medium.wavelength_nm; }
  std::span<const double> solar_irradiance() const override { return model_.solar_irradiance; }
  std::vector<double> radiance(std::span<const ViewDirection> views) const override;
  /// q^2 + u^2 is cut to i^2 where the noise goes beyond.
  StokesRadiance stokes(std::span<const ViewDirection> views) const override;
  /// diffuse: downward, its standard error goes to the summary; direct: over the Sun's disc where
  /// the scene asks for it.
  Irradiance irradiance() const override;
  double apparent_sun_elevation_rad() const override { return apparent_elevation_rad_; }
  /// Of the beam of the Sun's centre.
  std::vector<double> sun_transmittance() const override { return sun_transmittance_; }
  const RunSummary& summary() const override { return summary_; }

  /// Paths are followed until every wavelength's radiance (those below 1e-15 of the solar
  /// irradiance sr^-1 aside) has the scene's target_relative_error, in batches of 256, at most
  /// 2e9 paths; or as many as solver.photons says.
  MonteCarloEstimate estimate(const ViewDirection& view) const;

 private:
  class Statistics;
  void run_batches(const MonteCarloView& view, std::uint64_t view_key, std::size_t first,
                   std::size_t last, std::size_t paths, Statistics& statistics) const;
  MonteCarloEstimate estimate_here(const ViewDirection& view) const;
  void find_direct_sun();
  struct DirectBeam {
    double apparent_zenith_rad = 0, transmittance = 0, spreading = 1;
  };
  DirectBeam direct_beam(std::size_t wavelength, double true_zenith_rad) const;

  SceneModel model_;
  RunControl control_;
  MonteCarloWorld world_;
  std::unique_ptr<MonteCarloSunlight> sunlight_;
  std::unique_ptr<MonteCarloScattering> scattering_;
  std::unique_ptr<MonteCarloImportance> importance_;
  double apparent_elevation_rad_ = 0;
  std::vector<double> sun_transmittance_;
  mutable RunSummary summary_;
  mutable std::mutex summary_mutex_;
  std::unique_ptr<SolverArena> arena_;
};

}  // namespace twilight
