#include "tests/validation/preetham_refit.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "output/scene_colour.h"
#include "sim/models/turbidity.h"
#include "sim/scene_model.h"

namespace twilight::validation {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;

double sun_zenith_rad(const RefitSky& s) { return (90 - s.sun_elevation_deg) * kRadPerDeg; }

const std::vector<double>& channel_of(const RefitSky& s, std::size_t channel) {
  return channel == 0 ? s.sky.luminance : channel == 1 ? s.sky.x : s.sky.y;
}

/// ln(form / value) of one sky, less its mean, by the slopes and intercepts of A..E.
class ShapeResiduals : public ceres::SizedCostFunction<ceres::DYNAMIC, 10> {
 public:
  ShapeResiduals(const RefitSky& sky, std::size_t channel)
      : turbidity_(sky.turbidity),
        samples_(fit_samples(twilight::validation::sun_zenith_rad(sky))) {
    for (std::size_t v = 0; v < samples_.size(); ++v) {
      samples_[v].value = channel_of(sky, channel)[v];
    }
    set_num_residuals(static_cast<int>(samples_.size()));
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  double turbidity_;
  std::vector<FormSample> samples_;
};

bool ShapeResiduals::Evaluate(const double* const* parameters, double* residuals,
                              double** jacobians) const {
  std::array<double, 5> k{};
  for (std::size_t i = 0; i < 5; ++i) {
    k[i] = parameters[0][2 * i] * turbidity_ + parameters[0][2 * i + 1];
  }
  double mean = 0;
  std::array<double, 5> mean_slope{};
  std::vector<std::array<double, 5>> slopes(samples_.size());
  for (std::size_t v = 0; v < samples_.size(); ++v) {
    const FormSample& s = samples_[v];
    const double cos_gamma = std::cos(s.sun_angle_rad);
    const double falling = std::exp(k[1] / s.cos_zenith), glow = std::exp(k[3] * s.sun_angle_rad);
    const double first = 1 + k[0] * falling;
    const double second = 1 + k[2] * glow + k[4] * cos_gamma * cos_gamma;
    if (!(first > 0 && second > 0)) return false;
    slopes[v] = {falling / first, k[0] * falling / s.cos_zenith / first, glow / second,
                 k[2] * s.sun_angle_rad * glow / second, cos_gamma * cos_gamma / second};
    residuals[v] = std::log(first * second / s.value);
    mean += s.weight * residuals[v];
    for (std::size_t i = 0; i < 5; ++i) mean_slope[i] += s.weight * slopes[v][i];
  }
  for (std::size_t v = 0; v < samples_.size(); ++v) {
    const double root = std::sqrt(samples_[v].weight);
    residuals[v] = root * (residuals[v] - mean);
    if (!std::isfinite(residuals[v])) return false;
    if (jacobians == nullptr || jacobians[0] == nullptr) continue;
    for (std::size_t i = 0; i < 5; ++i) {
      const double slope = root * (slopes[v][i] - mean_slope[i]);
      jacobians[0][v * 10 + 2 * i] = slope * turbidity_;
      jacobians[0][v * 10 + 2 * i + 1] = slope;
    }
  }
  return true;
}

std::array<double, 4> luminance_terms(double turbidity, double theta) {
  const double chi = (4.0 / 9 - turbidity / 120) * (std::numbers::pi - 2 * theta);
  return {1e3 * turbidity * std::tan(chi), 1e3 * std::tan(chi), 1e3 * turbidity, 1e3};
}

std::array<double, 12> chromaticity_terms(double turbidity, double theta) {
  std::array<double, 12> terms{};
  const double of_turbidity[] = {turbidity * turbidity, turbidity, 1};
  const double of_sun[] = {theta * theta * theta, theta * theta, theta, 1};
  for (std::size_t i = 0; i < 12; ++i) terms[i] = of_turbidity[i / 4] * of_sun[i % 4];
  return terms;
}

// Linear least squares of terms . k / value - 1.
template <std::size_t N, class Terms>
std::array<double, N> least_relative_squares(const std::vector<RefitSky>& skies,
                                             const std::vector<double>& values, Terms terms) {
  Eigen::MatrixXd matrix(skies.size(), N);
  for (std::size_t s = 0; s < skies.size(); ++s) {
    const std::array<double, N> row = terms(skies[s].turbidity, sun_zenith_rad(skies[s]));
    for (std::size_t i = 0; i < N; ++i) {
      matrix(static_cast<Eigen::Index>(s), static_cast<Eigen::Index>(i)) = row[i] / values[s];
    }
  }
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(skies.size()));
  const Eigen::VectorXd solution = matrix.colPivHouseholderQr().solve(ones);
  std::array<double, N> k{};
  for (std::size_t i = 0; i < N; ++i) k[i] = solution(static_cast<Eigen::Index>(i));
  return k;
}

}  // namespace

std::vector<double> refit_suns_deg() {
  std::vector<double> suns;
  for (int k = 0; k < 12; ++k) suns.push_back(90 - 8 * k);
  return suns;
}

PerezCoefficients at_turbidity(const LinearCoefficients& k, double t) {
  const auto value = [&](std::size_t i) { return k[i][0] * t + k[i][1]; };
  return {value(0), value(1), value(2), value(3), value(4)};
}

LinearCoefficients published_coefficients(std::size_t channel) {
  const auto of = [&](double turbidity) {
    const PreethamDistribution d = preetham_distribution(turbidity);
    const PerezCoefficients& k = channel == 0 ? d.luminance : channel == 1 ? d.x : d.y;
    return std::array<double, 5>{k.a, k.b, k.c, k.d, k.e};
  };
  const auto none = of(0), one = of(1);
  LinearCoefficients k{};
  for (std::size_t i = 0; i < 5; ++i) k[i] = {one[i] - none[i], none[i]};
  return k;
}

std::vector<RefitSky> refit_skies(const Scene& scene, const RunControl& control) {
  std::vector<RefitSky> skies;
  KnownPhases phases;
  const std::vector<double> suns = refit_suns_deg();
  for (const double turbidity : kRefitTurbidities) {
    Scene hazy = scene;
    hazy.sun.elevation_deg = suns.front();
    hazy.earth.ground_albedo = 0;  // they ignored the ground
    hazy.aerosols.optical_depth_550nm = (turbidity - 1) * turbidity_depths(scene).molecules;
    const SceneModel model = build_scene_model(hazy, &phases);
    const ColourIntegrator colour = colour_integrator(model, ColourObserver::kCie1931);
    control.report(fmt::format("turbidity {}", turbidity), 0);
    auto under = simulate_suns(model, suns, colour, fmt::format(", turbidity {}", turbidity),
                               {{}, control.cancel});
    for (std::size_t s = 0; s < suns.size(); ++s) {
      skies.push_back({turbidity, suns[s], std::move(under[s])});
    }
  }
  return skies;
}

LinearCoefficients fit_linear_in_turbidity(const std::vector<RefitSky>& skies, std::size_t channel,
                                           bool& converged) {
  LinearCoefficients k = published_coefficients(channel);
  ceres::Problem problem;
  for (const RefitSky& sky : skies) {
    problem.AddResidualBlock(new ShapeResiduals(sky, channel), nullptr, k[0].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 2000;
  options.function_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  converged = summary.termination_type == ceres::CONVERGENCE;
  return k;
}

ZenithFit fit_zenith(const std::vector<RefitSky>& skies,
                     const std::array<LinearCoefficients, 3>& linear) {
  std::array<std::vector<double>, 3> zenith;
  for (const RefitSky& sky : skies) {
    for (std::size_t c = 0; c < 3; ++c) {
      const PerezCoefficients k = at_turbidity(linear[c], sky.turbidity);
      const double scale = best_scale(form_over_views(k, sun_zenith_rad(sky)), channel_of(sky, c));
      zenith[c].push_back(scale * perez(k, 1.0, sun_zenith_rad(sky)));
    }
  }
  return {least_relative_squares<4>(skies, zenith[0], luminance_terms),
          least_relative_squares<12>(skies, zenith[1], chromaticity_terms),
          least_relative_squares<12>(skies, zenith[2], chromaticity_terms)};
}

double zenith_value(const ZenithFit& fit, std::size_t channel, double turbidity, double theta) {
  double sum = 0;
  if (channel == 0) {
    const auto terms = luminance_terms(turbidity, theta);
    for (std::size_t i = 0; i < terms.size(); ++i) sum += fit.luminance[i] * terms[i];
    return sum;
  }
  const auto terms = chromaticity_terms(turbidity, theta);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    sum += (channel == 1 ? fit.x : fit.y)[i] * terms[i];
  }
  return sum;
}

std::vector<double> form_over_views(const PerezCoefficients& k, double theta) {
  std::vector<double> form;
  for (const FormSample& s : fit_samples(theta)) {
    form.push_back(perez(k, s.cos_zenith, s.sun_angle_rad));
  }
  return form;
}

double best_scale(const std::vector<double>& form, const std::vector<double>& value) {
  const std::vector<WeightedView> views = fit_views();
  double sum = 0, weight = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!(form[v] > 0)) continue;  // published forms turn negative at T < 1.7 alone
    sum += views[v].solid_angle_sr * std::log(value[v] / form[v]);
    weight += views[v].solid_angle_sr;
  }
  return std::exp(sum / weight);
}

}  // namespace twilight::validation
