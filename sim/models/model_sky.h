// What the skies of the published models have in common.
#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/run_control.h"
#include "sim/scene_model.h"
#include "sim/sky.h"

namespace twilight {

struct SolverArena;

/// Where a model is defined: throws std::invalid_argument naming key, value and range, or, with
/// models.out_of_range = "clamp", returns the nearest edge and records so in `summary.clamps`.
double within_model_range(const SceneModel& model, std::string_view key, double value, double low,
                          double high, RunSummary& summary);

/// A sky that a model gives view by view. Derived classes say what one view's spectrum is; this
/// class looks at many on the solver's threads, integrates irradiance and keeps the promises of
/// Sky.
class ModelSky : public Sky {
 public:
  ~ModelSky() override;
  std::span<const double> wavelength_nm() const override { return model_.medium.wavelength_nm; }
  std::span<const double> solar_irradiance() const override { return model_.solar_irradiance; }
  /// Throws std::runtime_error if the model gives a value that is not finite or negative.
  std::vector<double> radiance(std::span<const ViewDirection> views) const override;
  /// direct = E0 times sun_transmittance() times the sine of the elevation; diffuse by
  /// Gauss-Legendre quadrature of the upper hemisphere (24 elevations, crowding at the horizon, x
  /// 16 azimuths of half a turn): 1e-3 of it for smooth skies.
  Irradiance irradiance() const override;
  /// The models know no refraction: the geometric elevation.
  double apparent_sun_elevation_rad() const override { return model_.sun_elevation_rad; }
  const RunSummary& summary() const override { return summary_; }

 protected:
  explicit ModelSky(const SceneModel& model);
  /// Radiance of one view, W m^-2 sr^-1 nm^-1, at every wavelength; called from many threads.
  virtual void spectrum(const ViewDirection& view, std::span<double> out) const = 0;
  /// Cosine of the angle between a view and the Sun.
  double cos_sun_angle(const ViewDirection& view) const;

  SceneModel model_;
  mutable RunSummary summary_;
  std::unique_ptr<SolverArena> arena_;
};

/// A model of the upper hemisphere alone, seen from the ground. Below the horizon lies the scene's
/// Lambertian ground, lit by the model's own Sun and sky: albedo / pi times the global irradiance.
class HemisphereSky : public ModelSky {
 public:
  std::vector<double> radiance(std::span<const ViewDirection> views) const override;

 protected:
  /// Refuses (or clamps) observers above the ground.
  explicit HemisphereSky(const SceneModel& model);

 private:
  mutable std::once_flag ground_made_;
  mutable std::vector<double> ground_;
};

/// The sky of a published model: solver.method other than "cells", "orders" and "monte-carlo".
/// Throws std::invalid_argument where the model is undefined (see within_model_range).
std::unique_ptr<Sky> make_model_sky(const SceneModel& model, const RunControl& control);

}  // namespace twilight
