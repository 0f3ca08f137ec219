#include "output/retrieval.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>
#include <tuple>

namespace twilight {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNormal95 = 1.959963984540054;  // of the normal distribution, two-sided
// Searches agree where chi squared differs by less and every parameter by less than its error.
constexpr double kSameChiSquared = 0.5;
constexpr int kMostCorrections = 4;
// A profile only has to tell chi squared + 4 from less. A search that ends too early raises it,
// which the tolerance keeps below a tenth for as many data as a hundred.
constexpr double kProfileTolerance = 1e-3;
constexpr int kMostProfileSteps = 10;
// A profile below the best by more (of chi squared over error_scale^2) has found another minimum.
constexpr double kLowerMinimum = 0.1;
constexpr int kMostNewStarts = 3;   // from profiles
constexpr double kShiftLeft = 0.1;  // of an error, after which the correction stands
// A singular value below this share of the largest is rounding.
constexpr double kNoEffect = 1e-9;

using Unit = std::vector<double>;  // parameters as shares of their ranges, 0..1

double from_unit(const FreeParameter& p, double t) {
  if (t <= 0) return p.low;
  if (t >= 1) return p.high;
  return p.logarithmic ? p.low * std::pow(p.high / p.low, t) : std::lerp(p.low, p.high, t);
}

double to_unit(const FreeParameter& p, double value) {
  const double t = p.logarithmic ? std::log(value / p.low) / std::log(p.high / p.low)
                                 : (value - p.low) / (p.high - p.low);
  return std::clamp(t, 0.0, 1.0);
}

// d value / d t.
double unit_slope(const FreeParameter& p, double t) {
  return p.logarithmic ? from_unit(p, t) * std::log(p.high / p.low) : p.high - p.low;
}

void require(bool holds, const std::string& complaint) {
  if (!holds) throw std::invalid_argument(complaint);
}

void check(const RetrievalProblem& problem) {
  require(!problem.parameters.empty(), "no parameter is free");
  require(problem.measured.size() == problem.standard_error.size(),
          "there must be as many errors as data");
  require(problem.measured.size() >= problem.parameters.size(),
          fmt::format("{} data cannot tell {} parameters: must be as many at least",
                      problem.measured.size(), problem.parameters.size()));
  for (const FreeParameter& p : problem.parameters) {
    const bool range = std::isfinite(p.low) && std::isfinite(p.high) && p.low < p.high;
    require(range && (!p.logarithmic || p.low > 0),
            fmt::format("range {}..{} of {}: must be finite and rise, from above 0 for a logarithm",
                        p.low, p.high, p.name));
    require(p.start >= p.low && p.start <= p.high,
            fmt::format("start {} of {}: must be in {}..{}", p.start, p.name, p.low, p.high));
  }
  for (std::size_t k = 0; k < problem.measured.size(); ++k) {
    require(std::isfinite(problem.measured[k]) && std::isfinite(problem.standard_error[k]) &&
                problem.standard_error[k] > 0,
            fmt::format("datum {}: value and error must be finite, the error above 0", k));
  }
}

/// The problem in shares of the ranges, with the correction of its model.
class UnitProblem {
 public:
  UnitProblem(const RetrievalProblem& problem, const RetrievalOptions& options,
              const RunControl& control)
      : problem_(problem), options_(options), control_(control) {}

  const RetrievalProblem& problem() const { return problem_; }
  const RetrievalOptions& options() const { return options_; }
  const RunControl& control() const { return control_; }
  std::size_t parameters() const { return problem_.parameters.size(); }
  std::size_t data() const { return problem_.measured.size(); }
  std::size_t evaluations() const { return evaluations_; }

  std::vector<double> values(const Unit& t) const {
    std::vector<double> x(t.size());
    for (std::size_t i = 0; i < t.size(); ++i) x[i] = from_unit(problem_.parameters[i], t[i]);
    return x;
  }
  std::vector<double> predict(const Unit& t) {
    std::vector<double> y = checked(problem_.model(values(t)));
    ++evaluations_;
    for (std::size_t k = 0; k < factor_.size(); ++k) y[k] = factor_[k] * y[k] + offset_[k];
    return y;
  }
  std::vector<double> residuals(const Unit& t) {
    std::vector<double> r = predict(t);
    for (std::size_t k = 0; k < r.size(); ++k) {
      r[k] = (r[k] - problem_.measured[k]) / problem_.standard_error[k];
    }
    return r;
  }
  double chi_squared(const Unit& t) {
    const std::vector<double> r = residuals(t);
    return std::inner_product(r.begin(), r.end(), r.begin(), 0.0);
  }
  /// Tells the model of the places that derivatives by `which` at t need, and of t.
  void foretell(const Unit& t, const std::vector<std::size_t>& which, bool one_sided) const {
    if (!problem_.forecast) return;
    std::vector<std::vector<double>> places = {values(t)};
    for (const std::size_t i : which) {
      const double h = options_.difference_step;
      for (const double step : {h, -h}) {
        if (one_sided && (step > 0) != (t[i] + h <= 1)) continue;
        Unit there = t;
        there[i] = std::clamp(t[i] + step, 0.0, 1.0);
        places.push_back(values(there));
      }
    }
    problem_.forecast(places);
  }
  /// Derivatives of residuals() by parameter i; `here` are the residuals at t for one-sided ones.
  std::vector<double> derivative(const Unit& t, std::size_t i, const std::vector<double>* here) {
    const double h = options_.difference_step;
    Unit up = t, down = t;
    if (here != nullptr) {
      (t[i] + h <= 1 ? up : down)[i] += t[i] + h <= 1 ? h : -h;
    } else {
      up[i] = std::min(1.0, t[i] + h);
      down[i] = std::max(0.0, t[i] - h);
    }
    const std::vector<double> high = up[i] == t[i] && here != nullptr ? *here : residuals(up);
    const std::vector<double> low = down[i] == t[i] && here != nullptr ? *here : residuals(down);
    std::vector<double> slope(high.size());
    for (std::size_t k = 0; k < slope.size(); ++k)
      slope[k] = (high[k] - low[k]) / (up[i] - down[i]);
    return slope;
  }
  /// What correct_at() has found: factors and offsets of the data; empty before.
  using Correction = std::pair<std::vector<double>, std::vector<double>>;
  Correction correction() const { return {factor_, offset_}; }
  void set_correction(Correction c) { std::tie(factor_, offset_) = std::move(c); }
  /// Makes predict() the accurate model's at t; returns the rms change over the data's errors.
  double correct_at(const Unit& t) {
    const std::vector<double> before = predict(t);
    const std::vector<double> coarse = checked(problem_.model(values(t)));
    const std::vector<double> fine = checked(problem_.accurate_model(values(t)));
    factor_.assign(data(), 1.0);
    offset_.assign(data(), 0.0);
    double sum = 0;
    for (std::size_t k = 0; k < data(); ++k) {
      if (coarse[k] > 0 && fine[k] > 0) {
        factor_[k] = fine[k] / coarse[k];
      } else {
        offset_[k] = fine[k] - coarse[k];
      }
      sum += std::pow((fine[k] - before[k]) / problem_.standard_error[k], 2);
    }
    return std::sqrt(sum / static_cast<double>(data()));
  }

 private:
  std::vector<double> checked(std::vector<double> y) const {
    control_.check();
    if (y.size() != data()) throw std::logic_error("the forward model gives other data");
    for (const double value : y) {
      if (!std::isfinite(value)) throw std::runtime_error("the forward model is not finite");
    }
    return y;
  }

  const RetrievalProblem& problem_;
  const RetrievalOptions& options_;
  const RunControl& control_;
  std::vector<double> factor_, offset_;
  std::size_t evaluations_ = 0;
};

/// Residuals of the parameters that move, for Ceres, through which nothing may be thrown.
class Residuals : public ceres::CostFunction {
 public:
  Residuals(UnitProblem& problem, Unit at, std::vector<std::size_t> moving)
      : problem_(problem), at_(std::move(at)), moving_(std::move(moving)) {
    set_num_residuals(static_cast<int>(problem.data()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(moving_.size()));
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    try {
      if (error) return nothing(residuals, jacobians);
      Unit t = at_;
      for (std::size_t j = 0; j < moving_.size(); ++j) t[moving_[j]] = parameters[0][j];
      // Ceres asks again, with derivatives, where it has taken a step.
      if (t != last_) {
        last_residuals_ = problem_.residuals(t);
        last_ = t;
      }
      std::ranges::copy(last_residuals_, residuals);
      if (jacobians == nullptr || jacobians[0] == nullptr) return true;
      problem_.foretell(t, moving_, true);
      for (std::size_t j = 0; j < moving_.size(); ++j) {
        const std::vector<double> slope = problem_.derivative(t, moving_[j], &last_residuals_);
        for (std::size_t k = 0; k < slope.size(); ++k) {
          jacobians[0][k * moving_.size() + j] = slope[k];
        }
      }
      return true;
    } catch (...) {
      error = std::current_exception();
      return nothing(residuals, jacobians);
    }
  }
  mutable std::exception_ptr error;

 private:
  // A flat place, where the search ends at once; a failure Ceres would log.
  bool nothing(double* residuals, double** jacobians) const {
    std::fill_n(residuals, problem_.data(), 0.0);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      std::fill_n(jacobians[0], problem_.data() * moving_.size(), 0.0);
    }
    return true;
  }

  UnitProblem& problem_;
  Unit at_;
  std::vector<std::size_t> moving_;
  mutable Unit last_;
  mutable std::vector<double> last_residuals_;
};

struct Minimum {
  Unit at;
  double chi_squared = 0;
  int iterations = 0;
  bool converged = false;
  std::string termination;
};

/// Reports every step.
class StepReport : public ceres::IterationCallback {
 public:
  StepReport(const RunControl& control, std::string stage, int most)
      : control_(control), stage_(std::move(stage)), most_(most) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& s) override {
    if (control_.cancel != nullptr && *control_.cancel) return ceres::SOLVER_ABORT;
    control_.report(fmt::format("{}, step {}: chi^2 {:.5g}", stage_, s.iteration, 2 * s.cost),
                    static_cast<double>(s.iteration) / most_);
    return ceres::SOLVER_CONTINUE;
  }

 private:
  const RunControl& control_;
  std::string stage_;
  int most_;
};

// Lets the parameters move except `fixed` (any that does not exist: all move).
Minimum minimise(UnitProblem& problem, const Unit& from, std::size_t fixed,
                 const std::string& stage) {
  std::vector<std::size_t> moving;
  for (std::size_t i = 0; i < from.size(); ++i) {
    if (i != fixed) moving.push_back(i);
  }
  if (moving.empty()) return {from, problem.chi_squared(from), 0, true, "nothing moves"};
  std::vector<double> t(moving.size());
  for (std::size_t j = 0; j < t.size(); ++j) t[j] = from[moving[j]];

  Residuals residuals(problem, from, moving);
  ceres::Problem::Options owns;
  owns.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem ceres_problem(owns);
  ceres_problem.AddResidualBlock(&residuals, nullptr, t.data());
  for (std::size_t j = 0; j < t.size(); ++j) {
    ceres_problem.SetParameterLowerBound(t.data(), static_cast<int>(j), 0.0);
    ceres_problem.SetParameterUpperBound(t.data(), static_cast<int>(j), 1.0);
  }
  StepReport report(problem.control(), stage, problem.options().most_iterations);
  ceres::Solver::Options options;
  const bool profile = fixed < from.size();
  options.max_num_iterations = profile
                                   ? std::min(kMostProfileSteps, problem.options().most_iterations)
                                   : problem.options().most_iterations;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  // A step that changes chi squared by 1e-4 of itself changes nothing that is claimed; where it
  // falls towards 0 (data without noise) the parameters' own steps end the search.
  options.function_tolerance = profile ? kProfileTolerance : 1e-4;
  options.parameter_tolerance = 1e-6;
  options.gradient_tolerance = 1e-10;
  options.update_state_every_iteration = false;
  options.callbacks.push_back(&report);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  if (residuals.error) std::rethrow_exception(residuals.error);

  Minimum found;
  found.at = from;
  for (std::size_t j = 0; j < t.size(); ++j) found.at[moving[j]] = std::clamp(t[j], 0.0, 1.0);
  found.chi_squared = 2 * summary.final_cost;
  found.iterations = static_cast<int>(summary.iterations.size()) - 1;
  found.converged = summary.termination_type == ceres::CONVERGENCE;
  found.termination = summary.message;
  return found;
}

/// Linearised at a place.
struct Linearised {
  Eigen::MatrixXd covariance;  // of shares of the ranges, errors as given; infinite on the diagonal
  Eigen::VectorXd singular;
  std::vector<char> no_effect;

  double error(std::size_t i) const {
    const auto k = static_cast<Eigen::Index>(i);
    return std::sqrt(covariance(k, k));
  }
};

Linearised linearise(UnitProblem& problem, const Unit& t) {
  const auto n = static_cast<Eigen::Index>(problem.parameters());
  Eigen::MatrixXd jacobian(static_cast<Eigen::Index>(problem.data()), n);
  std::vector<std::size_t> all(problem.parameters());
  std::iota(all.begin(), all.end(), std::size_t{0});
  problem.foretell(t, all, false);
  for (Eigen::Index i = 0; i < n; ++i) {
    problem.control().report("errors", static_cast<double>(i) / static_cast<double>(n));
    const std::vector<double> slope = problem.derivative(t, static_cast<std::size_t>(i), nullptr);
    jacobian.col(i) =
        Eigen::Map<const Eigen::VectorXd>(slope.data(), static_cast<Eigen::Index>(slope.size()));
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(jacobian, Eigen::ComputeThinU | Eigen::ComputeThinV);
  Linearised result;
  result.singular = svd.singularValues();
  const double floor = kNoEffect * std::max(result.singular(0), 1e-300);
  result.covariance = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd unseen = Eigen::VectorXd::Zero(n);  // share of each parameter that no datum sees
  for (Eigen::Index k = 0; k < n; ++k) {
    const Eigen::VectorXd v = svd.matrixV().col(k);
    if (result.singular(k) > floor) {
      result.covariance += v * v.transpose() / (result.singular(k) * result.singular(k));
    } else {
      unseen += v.cwiseProduct(v);
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (unseen(i) > 1e-6) result.covariance(i, i) = kInfinity;
    result.no_effect.push_back(jacobian.col(i).norm() <= floor ? 1 : 0);
  }
  return result;
}

// Rows of the parameters in the order of a Latin hypercube, each in the middle of its cell.
std::vector<Unit> latin_hypercube(std::size_t count, std::size_t dimensions, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Unit> rows(count, Unit(dimensions));
  std::vector<std::size_t> order(count);
  for (std::size_t d = 0; d < dimensions; ++d) {
    std::iota(order.begin(), order.end(), std::size_t{0});
    // std::shuffle differs between libraries.
    for (std::size_t k = count; k > 1; --k) std::swap(order[k - 1], order[random() % k]);
    for (std::size_t k = 0; k < count; ++k) {
      rows[k][d] = (static_cast<double>(order[k]) + 0.5) / static_cast<double>(count);
    }
  }
  return rows;
}

bool agree(const Minimum& a, const Minimum& b, const Linearised& linear) {
  if (std::abs(a.chi_squared - b.chi_squared) > kSameChiSquared) return false;
  for (std::size_t i = 0; i < a.at.size(); ++i) {
    if (std::abs(a.at[i] - b.at[i]) > linear.error(i)) return false;
  }
  return true;
}

Minimum search(UnitProblem& problem, Retrieval& result) {
  const RetrievalOptions& options = problem.options();
  Unit own;
  for (const FreeParameter& p : problem.problem().parameters) own.push_back(to_unit(p, p.start));
  std::vector<Unit> from = {own};
  const auto more = static_cast<std::size_t>(std::max(0, options.starts - 1));
  std::ranges::move(latin_hypercube(more, own.size(), options.seed), std::back_inserter(from));
  Minimum best;
  for (std::size_t s = 0; s < from.size(); ++s) {
    const Minimum found = minimise(problem, from[s], from[s].size(),
                                   fmt::format("start {} of up to {}", s + 1, from.size()));
    result.starts.push_back({problem.values(from[s]), problem.values(found.at), found.chi_squared,
                             found.iterations, found.converged, found.termination});
    const bool agreed = s > 0 && found.converged && best.converged &&
                        agree(found, best, linearise(problem, best.at));
    const bool better = s == 0 || (found.converged && !best.converged) ||
                        (found.converged == best.converged && found.chi_squared < best.chi_squared);
    if (better) {
      best = found;
      result.best_start = s;
    }
    if (agreed) break;
  }
  return best;
}

// The accurate model's minimum.
Minimum corrected(UnitProblem& problem, Minimum best, Retrieval& result) {
  const Unit before = best.at;
  Linearised linear = linearise(problem, best.at);
  bool settled = false;
  for (int round = 0; round < kMostCorrections && !settled; ++round) {
    problem.control().report("the scene's own grids",
                             static_cast<double>(round) / kMostCorrections);
    const double rms = problem.correct_at(best.at);
    if (round == 0) result.correction_rms_sigma = rms;
    Minimum next = minimise(problem, best.at, best.at.size(), "corrected");
    settled = true;
    for (std::size_t i = 0; i < next.at.size(); ++i) {
      const double shift = std::abs(next.at[i] - best.at[i]);
      if (shift > 1e-4 && !(shift < kShiftLeft * linear.error(i))) settled = false;
    }
    next.converged = next.converged && best.converged;
    best = std::move(next);
  }
  for (std::size_t i = 0; i < before.size(); ++i) {
    result.correction_shift_sigma =
        std::max(result.correction_shift_sigma, std::abs(best.at[i] - before[i]) / linear.error(i));
  }
  best.converged = best.converged && settled;
  return best;
}

std::string wide_interval(double width) {
  return fmt::format("its 95 % interval covers {:.0f} % of the allowed range",
                     100 * std::min(1.0, width));
}

// What the linearised model says of every parameter.
void judge_linear(const UnitProblem& problem, const Unit& t, const Linearised& linear,
                  Retrieval& result) {
  const std::size_t n = t.size();
  const double scale = result.error_scale;
  result.covariance.assign(n, std::vector<double>(n));
  result.correlation = result.covariance;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      const double c =
          linear.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      result.covariance[i][j] = scale * scale * c *
                                unit_slope(problem.problem().parameters[i], t[i]) *
                                unit_slope(problem.problem().parameters[j], t[j]);
      result.correlation[i][j] = i == j ? 1.0 : c / (linear.error(i) * linear.error(j));
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    RetrievedParameter p;
    p.parameter = problem.problem().parameters[i];
    p.value = from_unit(p.parameter, t[i]);
    const double error = scale * linear.error(i);
    p.standard_error = error * unit_slope(p.parameter, t[i]);
    p.low_95 = from_unit(p.parameter, t[i] - kNormal95 * error);
    p.high_95 = from_unit(p.parameter, t[i] + kNormal95 * error);
    if (t[i] < 1e-6) p.bound_hit = "lowest";
    if (t[i] > 1 - 1e-6) p.bound_hit = "highest";
    for (std::size_t j = 0; j < n; ++j) {
      if (j == i || !(std::abs(result.correlation[i][j]) > kTradeOff)) continue;
      p.trades_off_with.emplace_back(problem.problem().parameters[j].name,
                                     result.correlation[i][j]);
    }
    const double width =
        std::min(1.0, t[i] + kNormal95 * error) - std::max(0.0, t[i] - kNormal95 * error);
    if (linear.no_effect[i] != 0) {
      p.claimed = false;
      p.reasons.push_back("has no effect on these data");
    } else if (!(width <= kWidestClaim)) {
      p.claimed = false;
      p.reasons.push_back(wide_interval(width));
    }
    if (scale > kWorstClaim) {
      p.claimed = false;
      p.reasons.push_back(fmt::format(
          "the model does not explain the data: it misses them by {:.2g} of their errors", scale));
    }
    result.parameters.push_back(std::move(p));
  }
}

/// The other parameters' best for values of one.
class Profile {
 public:
  Profile(UnitProblem& problem, const Minimum& best, const Linearised& linear, std::size_t i,
          double error_scale)
      : problem_(problem),
        best_(best),
        lowest_(best),
        linear_(linear),
        i_(i),
        scale_(error_scale) {}

  /// The lowest place seen, if that is below the best by more than a search's tolerance.
  std::optional<Minimum> lower() const {
    if (best_.chi_squared - lowest_.chi_squared <= kLowerMinimum * scale_ * scale_) return {};
    return lowest_;
  }

  /// By how much chi squared rises where the parameter is t; `near` is where the others start from.
  double rise(double t, Unit& near) {
    const FreeParameter& p = problem_.problem().parameters[i_];
    const auto k = static_cast<Eigen::Index>(i_);
    Unit from = near;
    from[i_] = t;
    for (std::size_t j = 0; j < from.size(); ++j) {
      if (j == i_ || !std::isfinite(linear_.covariance(k, k))) continue;
      // As the linearised model would have them follow.
      const double slope =
          linear_.covariance(static_cast<Eigen::Index>(j), k) / linear_.covariance(k, k);
      from[j] = std::clamp(near[j] + slope * (t - near[i_]), 0.0, 1.0);
    }
    const Minimum there =
        minimise(problem_, from, i_, fmt::format("{} = {:.4g}", p.name, from_unit(p, t)));
    near = there.at;
    if (there.chi_squared < lowest_.chi_squared) lowest_ = there;
    return std::max(0.0, (there.chi_squared - best_.chi_squared) / (scale_ * scale_));
  }

  /// Where chi squared has risen by that of a 95 % interval, going down (-1) or up (1): the
  /// linearised interval's end and on in doubled steps, then in between by the root of the rise,
  /// which is straight for a linear model. The end of the range where it does not rise so far.
  double interval_end(int direction) {
    constexpr int kMostProbes = 5;
    Unit near = best_.at;
    double inner = best_.at[i_], inner_root = 0.0;
    double step = std::clamp(kNormal95 * scale_ * linear_.error(i_), 0.01, 0.5);
    for (int probe = 0; probe < kMostProbes; ++probe, step *= 2) {
      const double t = std::clamp(inner + direction * step, 0.0, 1.0);
      if (t == inner) break;
      const double root = std::sqrt(rise(t, near));
      if (root >= kNormal95) {
        return inner + (t - inner) * (kNormal95 - inner_root) / (root - inner_root);
      }
      inner = t;
      inner_root = root;
    }
    return direction < 0 ? 0.0 : 1.0;
  }

 private:
  UnitProblem& problem_;
  const Minimum& best_;
  Minimum lowest_;
  const Linearised& linear_;
  std::size_t i_;
  double scale_;
};

// Parameters that may not be told are looked at beyond the linear model. If told to follow,
// stops at a profile that explains the data better than the best, and returns where.
std::optional<Minimum> judge_profiles(UnitProblem& problem, const Minimum& best,
                                      const Linearised& linear, bool follow, Retrieval& result) {
  for (std::size_t i = 0; i < best.at.size(); ++i) {
    RetrievedParameter& p = result.parameters[i];
    // An error this small of the range needs no second look.
    constexpr double kSureError = 0.02;
    const bool sure = result.error_scale * linear.error(i) < kSureError;
    if (linear.no_effect[i] != 0 || (sure && p.trades_off_with.empty())) continue;
    Profile profile(problem, best, linear, i, result.error_scale);
    const double low = profile.interval_end(-1), high = profile.interval_end(1);
    if (follow && profile.lower()) return profile.lower();
    p.low_95 = from_unit(p.parameter, low);
    p.high_95 = from_unit(p.parameter, high);
    p.profiled = true;
    if (high - low > kWidestClaim && p.claimed) {
      p.claimed = false;
      p.reasons.push_back(wide_interval(high - low));
    }
    // Another minimum may lie far away.
    const auto look_at = [&](double end, std::optional<ProfileEnd>& seen) {
      Unit near = best.at;
      seen = ProfileEnd{from_unit(p.parameter, end), profile.rise(end, near)};
      if (seen->rise >= kProfileRise || std::abs(end - best.at[i]) < kWidestClaim) return;
      p.claimed = false;
      p.reasons.push_back(fmt::format("{:.4g} explains the data as well (chi squared + {:.2g})",
                                      seen->value, seen->rise));
    };
    if (!p.claimed) continue;
    look_at(0.0, p.low_end);
    look_at(1.0, p.high_end);
    if (follow && profile.lower()) return profile.lower();
  }
  return std::nullopt;
}

// All about the best but the profiles.
Linearised judge(UnitProblem& problem, const Minimum& best, Retrieval& result) {
  const Linearised linear = linearise(problem, best.at);
  result.converged = best.converged;
  result.chi_squared = best.chi_squared;
  result.degrees_of_freedom = problem.data() - problem.parameters();
  result.error_scale = 1.0;
  if (result.degrees_of_freedom > 0) {
    result.error_scale =
        std::max(1.0, std::sqrt(best.chi_squared / static_cast<double>(result.degrees_of_freedom)));
  }
  result.singular_values.assign(linear.singular.begin(), linear.singular.end());
  result.predicted = problem.predict(best.at);
  result.parameters.clear();
  judge_linear(problem, best.at, linear, result);
  return linear;
}

// A search from a place that explains the data better than the best; whether it stays below it.
bool search_again(UnitProblem& problem, const Minimum& lower, Minimum& best, Retrieval& result) {
  const UnitProblem::Correction before = problem.correction();
  const double rms = result.correction_rms_sigma, shift = result.correction_shift_sigma;
  Minimum found = minimise(problem, lower.at, lower.at.size(), "start from a profile");
  result.starts.push_back({problem.values(lower.at), problem.values(found.at), found.chi_squared,
                           found.iterations, found.converged, found.termination});
  if (problem.problem().accurate_model) found = corrected(problem, std::move(found), result);
  if (found.chi_squared < best.chi_squared) {
    best = std::move(found);
    result.best_start = result.starts.size() - 1;
    return true;
  }
  // The accurate model says otherwise there.
  problem.set_correction(before);
  result.correction_rms_sigma = rms;
  result.correction_shift_sigma = shift;
  return false;
}

}  // namespace

Retrieval retrieve(const RetrievalProblem& problem, const RetrievalOptions& options,
                   const RunControl& control) {
  check(problem);
  UnitProblem unit(problem, options, control);
  Retrieval result;
  Minimum best = search(unit, result);
  if (problem.accurate_model) best = corrected(unit, std::move(best), result);
  Linearised linear = judge(unit, best, result);
  bool follow = true;
  for (int again = 0; options.profiles; ++again) {
    const std::optional<Minimum> lower = judge_profiles(unit, best, linear, follow, result);
    if (!lower) break;
    if (again == kMostNewStarts) {
      result.converged = false;
      for (RetrievedParameter& p : result.parameters) {
        p.claimed = false;
        p.reasons.push_back("other values explain the data better");
      }
      break;
    }
    follow = search_again(unit, *lower, best, result);
    linear = judge(unit, best, result);
  }
  result.evaluations = unit.evaluations();
  return result;
}

}  // namespace twilight
