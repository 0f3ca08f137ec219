#include "sim/models/fitted_sky.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "sim/scene_file.h"

namespace twilight {
namespace {

// Refraction lifts the Sun by 0.6 degrees at the horizon, its disc reaches 0.27 higher.
constexpr double kLowestSightRad = -std::numbers::pi / 180;

// The number that a scene says for a key, or nothing where it is unset.
std::optional<double> number_of(const Scene& scene, const std::string& name) {
  const auto keys = scene_keys();
  const auto key = std::ranges::find(keys, name, &SceneKey::name);
  if (key == keys.end()) return std::nullopt;
  Scene copy = scene;
  const SceneField field = key->field(copy);
  if (const auto* value = std::get_if<double*>(&field)) return **value;
  if (const auto* value = std::get_if<std::optional<double>*>(&field)) return **value;
  return std::nullopt;
}

const FitCoefficients& checked(const SceneModel& model, const FitCoefficients& fit) {
  const std::string& method = model.scene.solver.method;
  for (const double nm : model.medium.wavelength_nm) {
    if (nm >= fit.wavelength_nm.front() && nm <= fit.wavelength_nm.back()) continue;
    throw std::invalid_argument(
        fmt::format("key 'spectrum.wavelengths_nm' = {}: must be within {}..{}, the wavelengths of "
                    "\"{}\"",
                    nm, fit.wavelength_nm.front(), fit.wavelength_nm.back(), method));
  }
  return fit;
}

}  // namespace

std::vector<FitCorner> fit_corners(const FitCoefficients& fit, const std::vector<double>& values) {
  std::vector<FitCorner> corners = {{0, 1.0}};
  for (std::size_t a = 0; a < fit.axes.size(); ++a) {
    const std::vector<double>& at = fit.axes[a].values;
    const auto above = std::ranges::upper_bound(at, values[a]);
    const std::size_t below =
        above == at.begin() ? 0 : static_cast<std::size_t>(above - at.begin()) - 1;
    double fraction = 0;
    if (below + 1 < at.size()) fraction = (values[a] - at[below]) / (at[below + 1] - at[below]);
    constexpr double kOnNode = 1e-9;
    if (fraction < kOnNode) fraction = 0;
    if (fraction > 1 - kOnNode) fraction = 1;
    std::vector<FitCorner> next;
    for (const FitCorner& c : corners) {
      const std::size_t node = c.node * at.size() + below;
      if (fraction < 1) next.push_back({node, c.weight * (1 - fraction)});
      if (fraction > 0) next.push_back({node + 1, c.weight * fraction});
    }
    corners = std::move(next);
  }
  return corners;
}

FittedSky::FittedSky(const SceneModel& model, FitCoefficients fit)
    : HemisphereSky(model),
      fit_(std::move(fit)),
      interpolation_(checked(model, fit_).wavelength_nm, model.medium.wavelength_nm),
      daylight_(model.medium.wavelength_nm) {
  corners_ = fit_corners(fit_, place());
  const bool spectral = fit_.quantity == FitQuantity::kSpectral;
  std::size_t flagged = 0;
  for (const FitCorner& c : corners_) {
    for (std::size_t w = 0; w < fit_.channels(); ++w) {
      const double unit = spectral ? fit_.solar_irradiance[w] : 1.0;
      log_scale_.push_back(std::log(fit_.scale(c.node, w) / unit));
    }
    flagged += fit_.converged[c.node] ? 0 : 1;
  }
  if (!spectral) record_clipped();
  summary_.figures.emplace_back(
      "fitted sky",
      fmt::format("{}, {} of {} nodes", sky_form_name(fit_.form), corners_.size(), fit_.nodes()));
  if (flagged > 0) {
    summary_.figures.emplace_back("nodes whose fit did not converge", fmt::format("{}", flagged));
  }
}

FittedSky::~FittedSky() = default;

std::vector<double> FittedSky::place() {
  std::vector<double> values;
  for (const FitAxis& axis : fit_.axes) {
    std::optional<double> given = axis.key == kSunElevationKey
                                      ? model_.sun_elevation_rad * 180 / std::numbers::pi
                                      : number_of(model_.scene, axis.key);
    const double low = axis.values.front(), high = axis.values.back();
    if (!given && axis.values.size() == 1) given = low;
    if (!given) {
      throw std::invalid_argument(
          fmt::format("key '{}' is not set: must be {}..{}, an axis of \"{}\"", axis.key, low, high,
                      model_.scene.solver.method));
    }
    // What degrees lose on their way through radians is not out of range.
    for (const double edge : {low, high}) {
      if (std::abs(*given - edge) <= 1e-9 * std::max(1.0, std::abs(edge))) given = edge;
    }
    values.push_back(within_model_range(model_, axis.key, *given, low, high, summary_));
    const bool clamped = values.back() != *given;
    if (clamped && axis.key == kSunElevationKey) {
      model_.sun_elevation_rad = values.back() * std::numbers::pi / 180;
    }
  }
  return values;
}

// Looked for on a grid, so that it is said alike whatever is looked at.
void FittedSky::record_clipped() {
  constexpr int kSteps = 18;
  std::vector<double> out(model_.medium.wavelengths());
  int clipped = 0, views = 0;
  for (int e = 0; e <= kSteps; ++e) {
    for (int a = 0; a <= 2 * kSteps; ++a, ++views) {
      constexpr double kStep = std::numbers::pi / 2 / kSteps;
      clipped += spectrum_clipped({e * kStep, a * kStep}, out) ? 1 : 0;
    }
  }
  if (clipped == 0) return;
  summary_.clamps.emplace_back(
      "radiance",
      fmt::format("negative daylight spectra taken as 0 in {} of {} directions", clipped, views));
}

void FittedSky::spectrum(const ViewDirection& view, std::span<double> out) const {
  spectrum_clipped(view, out);
}

bool FittedSky::spectrum_clipped(const ViewDirection& view, std::span<double> out) const {
  const double cos_zenith = std::max(0.0, std::sin(view.elevation_rad));
  const double sun_angle = std::acos(cos_sun_angle(view));
  const std::size_t C = fit_.channels();
  std::vector<double> share(C);
  for (std::size_t w = 0; w < C; ++w) {
    double log_share = 0;
    for (std::size_t c = 0; c < corners_.size(); ++c) {
      const double f = sky_form_value(fit_.form, fit_.coefficients_at(corners_[c].node, w),
                                      cos_zenith, sun_angle);
      log_share += corners_[c].weight * (log_scale_[c * C + w] + std::log(f));
    }
    share[w] = std::exp(log_share);
  }
  if (fit_.quantity == FitQuantity::kLuminanceChromaticity) {
    return daylight_.radiance(share[0], share[1], share[2], out);
  }
  interpolation_.logarithmic(share, out);
  for (std::size_t w = 0; w < out.size(); ++w) out[w] *= model_.solar_irradiance[w];
  return false;
}

std::vector<double> FittedSky::sun_transmittance() const {
  const std::size_t W = fit_.wavelength_nm.size();
  std::vector<double> solved(W), out(model_.medium.wavelengths());
  for (std::size_t w = 0; w < W; ++w) {
    double sum = 0, log_sum = 0;
    for (const FitCorner& c : corners_) {
      const double t = fit_.sun_transmittance[c.node * W + w];
      sum += c.weight * t;
      log_sum += c.weight * std::log(t);  // -infinity: behind the Earth
    }
    const bool up = model_.sun_elevation_rad > kLowestSightRad;
    solved[w] = std::isfinite(log_sum) ? std::exp(log_sum) : up ? sum : 0.0;
  }
  interpolation_.logarithmic(solved, out);
  for (double& t : out) t = std::clamp(t, 0.0, 1.0);
  return out;
}

std::unique_ptr<Sky> make_fitted_sky(const SceneModel& model) {
  const std::string file = model.scene.solver.method.substr(kFitMethodPrefix.size());
  return std::make_unique<FittedSky>(model, read_fit_coefficients(file));
}

}  // namespace twilight
