// The sky that a scene with some of its keys changed would show to an instrument.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "output/measurement.h"
#include "sim/run_control.h"
#include "sim/scene_model.h"

namespace twilight {

/// w_i such that the sum of w_i L_i / E0_i over the wavelengths of a sky is what the response makes
/// of its light, for the Sun at 1 au: E0 at a single wavelength, which must be among them; else, as
/// in ColourIntegrator, the integral in steps of 1 nm of E0 s(lambda) hat_i(lambda)
/// (lambda_i / lambda)^4. Throws std::invalid_argument for a single wavelength that is not there,
/// and for wavelengths that hold less of the response than its least_held.
std::vector<double> response_weights(const SpectralResponse& response,
                                     std::span<const double> wavelength_nm,
                                     const std::string& solar_spectrum);

/// The scene as the measurement needs it: for spectral radiances with their wavelengths, all of
/// them solved. Throws std::invalid_argument where they are more than a scene can have.
Scene scene_for(Scene scene, const Measurement& measured);

/// Data as functions of scene keys. One solution serves every Sun and view of the measurement.
class SkyForwardModel {
 public:
  /// `keys` hold numbers (set_number); a measurement with a free exposure takes one parameter more,
  /// the factor on its values. `phases` are shared with other models of the same air, used from one
  /// thread at a time.
  SkyForwardModel(Scene scene, std::vector<std::string> keys, const Measurement& measured,
                  std::shared_ptr<KnownPhases> phases, RunControl control);

  /// The data in the unit of the measured values. Solutions are kept: the same keys cost nothing.
  /// Throws as build_scene_model, std::runtime_error where the sky is dark in a magnitude's view,
  /// Cancelled.
  std::vector<double> operator()(std::span<const double> parameters);

  /// Solves for several sets of parameters side by side, each on one thread, where that has not
  /// been done: what operator() then gives are the same bytes.
  void solve_ahead(std::span<const std::vector<double>> parameters);

  std::size_t solutions() const { return known_.size(); }

 private:
  SceneModel model_of(std::span<const double> keys);
  std::vector<double> look(SceneModel model) const;

  Scene scene_;
  std::vector<std::string> keys_;
  const Measurement& measured_;
  std::shared_ptr<KnownPhases> phases_;
  RunControl control_;
  std::vector<std::vector<double>> weights_;  // [response][wavelength]
  std::map<std::vector<double>, std::vector<double>> known_;
};

}  // namespace twilight
