#include "sim/models/model_sky.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/horizontal_quadrature.h"
#include "sim/solver_arena.h"

namespace twilight {
namespace {

using std::numbers::pi;

}  // namespace

double within_model_range(const SceneModel& model, std::string_view key, double value, double low,
                          double high, RunSummary& summary) {
  if (value >= low && value <= high) return value;
  const std::string& method = model.scene.solver.method;
  if (model.scene.models.out_of_range != "clamp") {
    throw std::invalid_argument(
        fmt::format("key '{}' = {:.6g}: must be {}..{}, where the model \"{}\" is defined; "
                    "models.out_of_range = \"clamp\" takes its edge",
                    key, value, low, high, method));
  }
  const double edge = value > high ? high : low;
  summary.clamps.emplace_back(
      key, fmt::format("{:.6g} taken as {:.6g}, the edge of \"{}\"", value, edge, method));
  return edge;
}

ModelSky::ModelSky(const SceneModel& model)
    : model_(model), arena_(std::make_unique<SolverArena>(model.scene.solver.threads)) {}
ModelSky::~ModelSky() = default;

double ModelSky::cos_sun_angle(const ViewDirection& view) const {
  const double sun = model_.sun_elevation_rad;
  return std::clamp(
      std::sin(view.elevation_rad) * std::sin(sun) +
          std::cos(view.elevation_rad) * std::cos(sun) * std::cos(view.relative_azimuth_rad),
      -1.0, 1.0);
}

std::vector<double> ModelSky::radiance(std::span<const ViewDirection> views) const {
  const std::size_t W = model_.medium.wavelengths();
  std::vector<double> out(views.size() * W);
  arena_->arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, views.size(), 16), [&](const auto& range) {
      for (std::size_t k = range.begin(); k < range.end(); ++k) {
        spectrum(views[k], std::span(&out[k * W], W));
      }
    });
  });
  for (const double value : out) {
    if (!(std::isfinite(value) && value >= 0)) {
      throw std::runtime_error(fmt::format("the model \"{}\" gives a radiance of {}",
                                           model_.scene.solver.method, value));
    }
  }
  return out;
}

Irradiance ModelSky::irradiance() const {
  constexpr int kElevations = 24, kAzimuths = 16;
  const std::size_t W = model_.medium.wavelengths();
  const auto [views, weight] = horizontal_quadrature(kElevations, kAzimuths);
  const std::vector<double> sky = ModelSky::radiance(views);
  Irradiance result{sun_transmittance(), std::vector<double>(W)};
  for (std::size_t w = 0; w < W; ++w) {
    result.direct[w] *=
        model_.solar_irradiance[w] * std::max(0.0, std::sin(model_.sun_elevation_rad));
    for (std::size_t k = 0; k < views.size(); ++k) result.diffuse[w] += weight[k] * sky[k * W + w];
  }
  return result;
}

HemisphereSky::HemisphereSky(const SceneModel& model) : ModelSky(model) {
  within_model_range(model_, "observer.height_m", std::max(0.0, model_.scene.observer.height_m),
                     0.0, 0.0, summary_);
}

std::vector<double> HemisphereSky::radiance(std::span<const ViewDirection> views) const {
  const std::size_t W = model_.medium.wavelengths();
  std::vector<ViewDirection> above;
  for (const ViewDirection& v : views) {
    if (v.elevation_rad >= 0) above.push_back(v);
  }
  std::vector<double> sky = ModelSky::radiance(above);
  if (above.size() == views.size()) return sky;
  std::call_once(ground_made_, [&] {
    const Irradiance light = irradiance();
    ground_.resize(W);
    for (std::size_t w = 0; w < W; ++w) {
      ground_[w] = model_.ground_albedo[w] / pi * (light.direct[w] + light.diffuse[w]);
    }
  });
  std::vector<double> out(views.size() * W);
  std::size_t next = 0;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const double* from = views[k].elevation_rad >= 0 ? &sky[W * next++] : ground_.data();
    std::copy_n(from, W, &out[k * W]);
  }
  return out;
}

}  // namespace twilight
