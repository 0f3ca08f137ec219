// Retrieval: the parameters of a forward model that explain measured data best, and what the data
// cannot tell.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sim/run_control.h"

namespace twilight {

/// A parameter that the data shall tell.
struct FreeParameter {
  std::string name;
  double low = 0.0, high = 1.0;  ///< allowed range, finite, low < high
  double start = 0.5;            ///< within it
  bool logarithmic = false;      ///< searched in its logarithm; low > 0
};

/// The data that parameters (within their ranges) would give; as many as there are measured. Smooth
/// to much better than the data's errors.
using ForwardModel = std::function<std::vector<double>(std::span<const double>)>;

/// Told of several sets of parameters that the forward model is asked for next, so that it can
/// work on them side by side. May do nothing.
using ModelForecast = std::function<void(std::span<const std::vector<double>>)>;

struct RetrievalProblem {
  std::vector<FreeParameter> parameters;  ///< one or more, no more than data
  std::vector<double> measured;           ///< finite
  std::vector<double> standard_error;     ///< of each, one sigma, > 0; independent of each other
  ForwardModel model;                     ///< for the search
  /// A slower and better one for the last word, or none. The search's is corrected by the ratio of
  /// both at the best parameters (where one of them is not positive, by the difference) and the fit
  /// repeated until that moves it no more than a tenth of its error.
  ForwardModel accurate_model;
  ModelForecast forecast;  ///< of the search's model; may be empty
};

struct RetrievalOptions {
  /// Searches at most: the first from the parameters' own starts, the others from a Latin
  /// hypercube. Two that agree are enough.
  int starts = 4;
  int most_iterations = 30;  ///< of a search
  unsigned seed = 1;         ///< of the hypercube
  /// Step of the derivatives' differences, share of a parameter's range.
  double difference_step = 0.01;
  /// Intervals by profiles for parameters that may not be told: with an error above 2 % of their
  /// range, or that trade off.
  bool profiles = true;
};

/// One search.
struct RetrievalStart {
  std::vector<double> from, to;
  double chi_squared = 0.0;
  int iterations = 0;
  bool converged = false;
  std::string termination;
};

/// The other parameters fitted anew while one stands at an end of its range.
struct ProfileEnd {
  double value = 0.0;  ///< the end
  double rise = 0.0;   ///< of chi squared (over error_scale^2) above the best
};

struct RetrievedParameter {
  FreeParameter parameter;
  double value = 0.0;
  /// One sigma, the other parameters being free too; infinite where the data say nothing.
  double standard_error = 0.0;
  /// 95 % interval, cut off at the allowed range: of the linearised model, or, `profiled`, where
  /// chi squared rises by 3.84 with the other parameters fitted anew.
  double low_95 = 0.0, high_95 = 0.0;
  bool profiled = false;
  bool claimed = true;               ///< whether the data tell it
  std::vector<std::string> reasons;  ///< why not
  /// Parameters whose error is correlated with this one's by more than kTradeOff.
  std::vector<std::pair<std::string, double>> trades_off_with;
  std::string bound_hit;  ///< "lowest", "highest" or empty
  std::optional<ProfileEnd> low_end, high_end;
};

/// Correlations above this are named.
inline constexpr double kTradeOff = 0.95;
/// A parameter is claimed only where its 95 % interval is narrower than this share of its range ...
inline constexpr double kWidestClaim = 0.5;
/// ... and where no end of the range that is farther away than that share of it explains the data
/// as well: chi squared has to rise by this much (two sigma of one parameter).
inline constexpr double kProfileRise = 4.0;
/// Nothing is claimed where the model misses the data by more than so many of their errors
/// (error_scale): the sky is not one of the model's, and neither are its parameters.
inline constexpr double kWorstClaim = 5.0;

struct Retrieval {
  std::vector<RetrievedParameter> parameters;
  /// (J'J)^-1 times error_scale^2 in the parameters' units, and correlations, [i][j]. A variance is
  /// infinite where the data say nothing at all.
  std::vector<std::vector<double>> covariance, correlation;
  /// Singular values of the Jacobian of data over errors by parameters over ranges, falling.
  std::vector<double> singular_values;
  double chi_squared = 0.0;
  std::size_t degrees_of_freedom = 0;
  /// max(1, sqrt(chi squared / degrees of freedom)): what all errors are multiplied with where the
  /// model does not explain the data within theirs.
  double error_scale = 1.0;
  std::vector<double> predicted;       ///< data at the best parameters
  std::vector<RetrievalStart> starts;  ///< those from profiles last
  std::size_t best_start = 0;
  /// The best search, and the correction if there is one, and no profile has ended below it.
  bool converged = false;
  /// By how much the accurate model has moved the parameters: largest |shift| over its error; and
  /// the rms of its correction over the data's errors. Zero without.
  double correction_shift_sigma = 0.0, correction_rms_sigma = 0.0;
  std::size_t evaluations = 0;  ///< of the search's model
};

/// Weighted least squares, the sum of ((model - measured) / error)^2, by Levenberg-Marquardt
/// (Ceres) inside the ranges; one-sided differences as derivatives in the search, central ones for
/// the errors. Errors are those of the model linearised at the best (Gauss): intervals of
/// parameters searched in logarithms are symmetric there. Where a profile ends below the best, a
/// search starts from there and all is judged anew, three times at most; after that nothing is
/// claimed. Where the accurate model does not agree that it is lower the best stays, its profiles
/// as wide as the search's model has them. No search knows that there is no lower minimum
/// elsewhere. Deterministic; calls the models from this
/// thread alone. Throws std::invalid_argument for a problem that is not as said above, Cancelled
/// when told to stop, and whatever the models throw.
Retrieval retrieve(const RetrievalProblem& problem, const RetrievalOptions& options,
                   const RunControl& control = {});

}  // namespace twilight
