#include "output/perez_fit.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "sim/models/hosek.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kHosekZenith = 1.0 / 1.01;

// The first factor must not vanish at the zenith. b as small as -1e-4 with p close to -1 is the
// limit of thin air, whose brightness grows as 1 / cos theta.
constexpr double kLowestP = -0.9999, kHighestP = 1e3;
constexpr double kLowestB = -20, kHighestB = -1e-4;
// The glow about the Sun and the peak in it are at least 0.05 rad wide, half of the directions'
// spacing: what is narrower would only take over the single one that looks into the Sun.
constexpr double kLowestRate = -20, kHighestRate = 3;  // per rad
constexpr double kHighestH = 0.95;

// Values are fitted over their geometric mean, so that factors of about 1 are expected.
constexpr FormParameter kPerez[] = {
    {"p", kLowestP, kHighestP},       {"b", kLowestB, kHighestB}, {"k", 1e-4, 1e5}, {"c k", 0, 1e6},
    {"d", kLowestRate, kHighestRate}, {"f", 1e-7, 1e6},
};
constexpr FormParameter kHosek[] = {
    {"p", kLowestP, kHighestP},
    {"b", kLowestB, kHighestB},
    {"c'", 1e-8, 1e3},
    {"d", 0, 1e4},
    {"e", kLowestRate, -1e-3},
    {"f'", 1e-8, 1e3},
    {"g", 0, 1e3},
    {"h", 0, kHighestH},
    {"i", 0, 1e3},
};

// ln(1 + p exp(b m)) and its derivatives by p and b.
double log_gradation(double p, double b, double m, double* gradient) {
  const double falling = std::exp(b * m), value = 1 + p * falling;
  if (gradient != nullptr) {
    gradient[0] = falling / value;
    gradient[1] = p * m * falling / value;
  }
  return std::log(value);
}

double log_perez(const double* x, double cos_zenith, double gamma, double* gradient) {
  const double m = 1 / std::max(cos_zenith, 1e-4) - 1;
  const double glow = std::exp(x[4] * gamma), cos_gamma = std::cos(gamma);
  const double cos2 = cos_gamma * cos_gamma;
  const double value = x[2] * (1 - cos2) + x[5] * cos2 + x[3] * glow;
  if (gradient != nullptr) {
    gradient[2] = (1 - cos2) / value;
    gradient[3] = glow / value;
    gradient[4] = x[3] * gamma * glow / value;
    gradient[5] = cos2 / value;
  }
  return log_gradation(x[0], x[1], m, gradient) + std::log(value);
}

double log_hosek(const double* x, double cos_zenith, double gamma, double* gradient) {
  const double m = 1 / (cos_zenith + 0.01) - kHosekZenith;
  const double cos_gamma = std::cos(gamma), cos2 = cos_gamma * cos_gamma;
  const double glow = std::exp(x[4] * gamma), last_glow = std::exp(x[4] * kPi);
  const double chi = hosek_chi(x[7], cos_gamma), root = std::sqrt(cos_zenith);
  const double value =
      x[2] * (1 - cos2) + x[5] * cos2 + x[3] * (glow - last_glow) + x[6] * chi + x[8] * root;
  if (gradient != nullptr) {
    gradient[2] = (1 - cos2) / value;
    gradient[3] = (glow - last_glow) / value;
    gradient[4] = x[3] * (gamma * glow - kPi * last_glow) / value;
    gradient[5] = cos2 / value;
    gradient[6] = chi / value;
    gradient[7] =
        x[6] * chi * -3 * (x[7] - cos_gamma) / (1 + x[7] * x[7] - 2 * x[7] * cos_gamma) / value;
    gradient[8] = root / value;
  }
  return log_gradation(x[0], x[1], m, gradient) + std::log(value);
}

/// sqrt(weight) ln(form / value) of every sample, with its Jacobian.
class LogResiduals : public ceres::CostFunction {
 public:
  LogResiduals(SkyForm form, std::span<const FormSample> samples, std::span<const double> log_value)
      : form_(form), samples_(samples), log_value_(log_value) {
    set_num_residuals(static_cast<int>(samples.size()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(form_parameters(form).size()));
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    const std::size_t P = form_parameters(form_).size();
    double* row = jacobians == nullptr ? nullptr : jacobians[0];
    for (std::size_t k = 0; k < samples_.size(); ++k) {
      const FormSample& s = samples_[k];
      const double root = std::sqrt(s.weight);
      residuals[k] = root * (log_form(form_, parameters[0], s.cos_zenith, s.sun_angle_rad, row) -
                             log_value_[k]);
      if (!std::isfinite(residuals[k])) return false;
      if (row == nullptr) continue;
      for (std::size_t j = 0; j < P; ++j) row[j] *= root;
      row += P;
    }
    return true;
  }

 private:
  SkyForm form_;
  std::span<const FormSample> samples_;
  std::span<const double> log_value_;
};

/// One sky's problem: samples, and ln of their values over a value in the middle.
struct Problem {
  SkyForm form;
  std::span<const FormSample> samples;
  std::vector<double> log_value;
  int most_iterations = kFormFitIterations;
};

// Weighted mean of ln(value / form): what the form's scale has to be multiplied with.
double missing_log_scale(const Problem& problem, const std::vector<double>& x) {
  double sum = 0, weight = 0;
  for (std::size_t k = 0; k < problem.samples.size(); ++k) {
    const FormSample& s = problem.samples[k];
    sum += s.weight * (problem.log_value[k] -
                       log_form(problem.form, x.data(), s.cos_zenith, s.sun_angle_rad, nullptr));
    weight += s.weight;
  }
  return sum / weight;
}

// The parameters that are proportional to the form.
std::vector<std::size_t> scaled_parameters(SkyForm form) {
  if (form == SkyForm::kPerez) return {2, 3, 5};
  return {2, 3, 5, 6, 8};
}

void rescale(SkyForm form, std::vector<double>& x, double log_factor) {
  for (const std::size_t k : scaled_parameters(form)) x[k] *= std::exp(log_factor);
}

void into_bounds(SkyForm form, std::vector<double>& x) {
  const auto bounds = form_parameters(form);
  for (std::size_t k = 0; k < bounds.size(); ++k) {
    x[k] = std::clamp(x[k], bounds[k].lowest, bounds[k].highest);
  }
}

struct Descent {
  std::vector<double> x;
  ceres::Solver::Summary summary;
  double cost = std::numeric_limits<double>::infinity();
};

Descent descend(const Problem& problem, std::vector<double> x) {
  into_bounds(problem.form, x);
  rescale(problem.form, x, missing_log_scale(problem, x));
  into_bounds(problem.form, x);
  Descent result{std::move(x), {}};
  ceres::Problem ceres_problem;
  ceres_problem.AddResidualBlock(new LogResiduals(problem.form, problem.samples, problem.log_value),
                                 nullptr, result.x.data());
  const auto bounds = form_parameters(problem.form);
  for (std::size_t k = 0; k < bounds.size(); ++k) {
    const int index = static_cast<int>(k);
    ceres_problem.SetParameterLowerBound(result.x.data(), index, bounds[k].lowest);
    ceres_problem.SetParameterUpperBound(result.x.data(), index, bounds[k].highest);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = problem.most_iterations;
  options.function_tolerance = 1e-9;
  options.gradient_tolerance = 1e-13;
  options.parameter_tolerance = 1e-11;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solve(options, &ceres_problem, &result.summary);
  if (result.summary.IsSolutionUsable()) result.cost = result.summary.final_cost;
  return result;
}

// Skies of day and dusk to start from, A..E: CIE's clear sky (Preetham et al. 1999, Eq. 1),
// Preetham's luminance for turbidity 3, a chromaticity, a glow low above the Sun, a flat sky.
constexpr std::array<std::array<double, 5>, 5> kPerezStarts = {{{-1.0, -0.32, 10, -3, 0.45},
                                                                {-0.93, -0.64, 5.3, -2.2, 0.17},
                                                                {-0.3, -0.2, 0.2, -1.0, 0.05},
                                                                {0.5, -1.0, 50, -2.0, 0.1},
                                                                {-0.1, -0.5, 1, -0.5, 0.0}}};

// Perez coefficients as Hosek parameters, with a little of what that form has beyond: a term that
// is 0 has no slope in its own exponent.
std::vector<double> hosek_start(std::span<const double> k) {
  const std::array<double, 9> nine = {k[0], k[1], 1,   k[2], std::min(k[3], -0.01),
                                      k[4], 0.02, 0.6, 0.05};
  return form_parameters_of(SkyForm::kHosek, nine);
}

std::vector<std::vector<double>> own_starts(const Problem& problem) {
  std::vector<std::vector<double>> starts;
  if (problem.form == SkyForm::kHosek) {
    const FormFit simpler =
        fit_form(SkyForm::kPerez, problem.samples, 0.0, {}, problem.most_iterations);
    starts.push_back(hosek_start(simpler.coefficients));
  }
  for (const auto& k : kPerezStarts) {
    starts.push_back(problem.form == SkyForm::kPerez ? form_parameters_of(SkyForm::kPerez, k)
                                                     : hosek_start(k));
  }
  return starts;
}

void check(std::span<const FormSample> samples) {
  if (samples.empty()) throw std::invalid_argument("a sky of no directions cannot be fitted");
  for (const FormSample& s : samples) {
    const bool fits = s.cos_zenith >= 1e-3 && s.cos_zenith <= 1 && s.sun_angle_rad >= 0 &&
                      s.sun_angle_rad <= kPi && s.weight > 0 && s.value > 0 &&
                      std::isfinite(s.value);
    if (fits) continue;
    throw std::invalid_argument(fmt::format(
        "sample at cos(zenith angle) {}, angle to the Sun {} rad, weight {}, value {}: must be "
        "0.001..1, 0..pi, above 0, above 0",
        s.cos_zenith, s.sun_angle_rad, s.weight, s.value));
  }
}

double mean_log_value(std::span<const FormSample> samples) {
  double sum = 0, weight = 0;
  for (const FormSample& s : samples) {
    sum += s.weight * std::log(s.value);
    weight += s.weight;
  }
  return sum / weight;
}

// Coefficients and normalisation of the parameters, which are of values over exp(log_unit).
void normalise(SkyForm form, std::span<const FormSample> samples, double sun_zenith_rad,
               double log_unit, FormFit& fit) {
  fit.coefficients = form_coefficients_of(form, fit.parameters);
  if (form == SkyForm::kPerez) {
    fit.normalisation = std::exp(log_unit) * fit.parameters[2] *
                        sky_form_value(form, fit.coefficients, 1.0, sun_zenith_rad);
    return;
  }
  double mean = 0, weight = 0;
  for (const FormSample& s : samples) {
    mean += s.weight * sky_form_value(form, fit.coefficients, s.cos_zenith, s.sun_angle_rad);
    weight += s.weight;
  }
  mean /= weight;
  for (const std::size_t k : {2, 3, 5, 6, 8}) fit.coefficients[k] /= mean;
  fit.normalisation = std::exp(log_unit) * mean;
}

Descent best_descent(const Problem& problem, std::span<const std::vector<double>> starts,
                     int& winner) {
  std::vector<std::vector<double>> all(starts.begin(), starts.end());
  for (auto& own : own_starts(problem)) all.push_back(std::move(own));
  constexpr double kAsGood = 1 - 1e-6;
  Descent best;
  for (std::size_t k = 0; k < all.size(); ++k) {
    Descent next = descend(problem, all[k]);
    if (k > 0 && !(next.cost < kAsGood * best.cost)) continue;
    best = std::move(next);
    winner = static_cast<int>(k);
  }
  if (best.summary.termination_type != ceres::CONVERGENCE && std::isfinite(best.cost)) {
    // A shallow valley: once more from where it stands.
    Descent next = descend(problem, best.x);
    if (next.cost <= best.cost) best = std::move(next);
  }
  return best;
}

}  // namespace

std::span<const FormParameter> form_parameters(SkyForm form) {
  if (form == SkyForm::kPerez) return kPerez;
  return kHosek;
}

double log_form(SkyForm form, const double* parameters, double cos_zenith, double sun_angle_rad,
                double* gradient) {
  return form == SkyForm::kPerez ? log_perez(parameters, cos_zenith, sun_angle_rad, gradient)
                                 : log_hosek(parameters, cos_zenith, sun_angle_rad, gradient);
}

std::vector<double> form_parameters_of(SkyForm form, std::span<const double> k) {
  if (form == SkyForm::kPerez) return {k[0] * std::exp(k[1]), k[1], 1, k[2], k[3], 1 + k[4]};
  const double c = k[2] + k[3] * std::exp(k[4] * kPi);
  return {k[0] * std::exp(k[1] * kHosekZenith), k[1], c, k[3], k[4], k[5] + c, k[6], k[7], k[8]};
}

std::vector<double> form_coefficients_of(SkyForm form, std::span<const double> x) {
  if (form == SkyForm::kPerez) {
    return {x[0] * std::exp(-x[1]), x[1], x[3] / x[2], x[4], x[5] / x[2] - 1};
  }
  return {x[0] * std::exp(-x[1] * kHosekZenith),
          x[1],
          x[2] - x[3] * std::exp(x[4] * kPi),
          x[3],
          x[4],
          x[5] - x[2],
          x[6],
          x[7],
          x[8]};
}

FormFit fit_form(SkyForm form, std::span<const FormSample> samples, double sun_zenith_rad,
                 std::span<const std::vector<double>> starts, int most_iterations) {
  check(samples);
  const double log_unit = mean_log_value(samples);
  Problem problem{form, samples, {}, most_iterations};
  for (const FormSample& s : samples) problem.log_value.push_back(std::log(s.value) - log_unit);

  FormFit fit;
  Descent best = best_descent(problem, starts, fit.start);
  fit.parameters = std::move(best.x);
  fit.converged = best.summary.termination_type == ceres::CONVERGENCE;
  fit.termination =
      fmt::format("{}: {}", ceres::TerminationTypeToString(best.summary.termination_type),
                  best.summary.message);
  fit.iterations = static_cast<int>(best.summary.iterations.size());
  if (!best.summary.iterations.empty()) {
    fit.gradient_norm = best.summary.iterations.back().gradient_max_norm;
  }
  fit.rms_log = std::sqrt(2 * best.summary.final_cost);
  const auto bounds = form_parameters(form);
  for (std::size_t k = 0; k < bounds.size(); ++k) {
    const double x = fit.parameters[k];
    if (x <= bounds[k].lowest) fit.bounds_hit.push_back(std::string(bounds[k].name) + " lowest");
    if (x >= bounds[k].highest) fit.bounds_hit.push_back(std::string(bounds[k].name) + " highest");
  }
  normalise(form, samples, sun_zenith_rad, log_unit, fit);
  return fit;
}

}  // namespace twilight
