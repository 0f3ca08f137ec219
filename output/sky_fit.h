// Forms fitted to simulated skies at every node of a study.
#pragma once

#include <string>
#include <vector>

#include "output/fit_sample.h"
#include "output/perez_fit.h"
#include "output/study_axes.h"
#include "sim/models/fit_coefficients.h"
#include "sim/run_control.h"

namespace twilight {

/// What `twilight fit` was asked for.
struct SkyFitOptions {
  SkyForm form = SkyForm::kPerez;
  FitQuantity quantity = FitQuantity::kSpectral;
  int most_iterations = kFormFitIterations;  ///< of a search, 1..100000
};

/// Elevations of the Sun of a study that names none, degrees.
std::vector<double> usual_fit_suns_deg();

/// One form, fitted to one channel at one node.
struct ChannelFit {
  FormFit fit;
  FitError error;
};

/// The skies of a study, fitted.
struct SkyFit {
  FitCoefficients coefficients;            ///< axes sorted; sun.elevation_deg is the last of them
  std::vector<ChannelFit> channels;        ///< [node][channel]
  std::vector<FitError> luminance;         ///< [node]
  std::vector<std::string> channel_names;  ///< wavelength in nm, or Y, x, y
  std::string scene_toml;         ///< of the study, in full but for its threads; axes replace
                                  ///< its values
  double rms_of_all = 0.0;        ///< over nodes and channels
  std::size_t not_converged = 0;  ///< channels
};

/// The study as a fit needs it: an axis of sun.elevation_deg among the axes, put last, method
/// "orders" where the scene names none. Throws std::invalid_argument where an axis is none of the
/// sky's (solver, spectrum, observer and output keys and integers), the scene has a budget, or its
/// observer is above the ground.
Study study_for_fit(Study study, const std::vector<double>& suns_deg);

/// Simulates the sky of every node (solver.method; "orders" solves one field per combination of the
/// other axes), and fits every channel, each node starting from its neighbour in Sun elevation too.
/// The same bytes for any number of threads. Throws as solve_sky; std::invalid_argument where a
/// sky is dark (0) in a direction, Cancelled when told to stop.
SkyFit fit_skies(const Study& study, const SkyFitOptions& options, const RunControl& control = {});

}  // namespace twilight
