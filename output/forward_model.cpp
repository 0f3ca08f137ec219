#include "output/forward_model.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "output/spectral_shares.h"
#include "output/study_axes.h"
#include "sim/solver_arena.h"
#include "solar/solar_spectrum.h"

namespace twilight {
namespace {

constexpr double kSameWavelength_nm = 1e-6;

double sensitivity_at(const SpectralResponse& response, double nm) {
  const std::vector<double>& x = response.sensitivity_nm;
  if (x.empty() || nm < x.front() || nm > x.back()) return 0.0;
  const auto above = std::ranges::upper_bound(x, nm);
  if (above == x.end()) return response.sensitivity.back();
  const auto i = static_cast<std::size_t>(above - x.begin());
  const double t = (nm - x[i - 1]) / (x[i] - x[i - 1]);
  return std::lerp(response.sensitivity[i - 1], response.sensitivity[i], t);
}

}  // namespace

std::vector<double> response_weights(const SpectralResponse& response,
                                     std::span<const double> wavelength_nm,
                                     const std::string& solar_spectrum) {
  const std::size_t W = wavelength_nm.size();
  std::vector<double> weights(W, 0.0);
  if (response.single_nm) {
    for (std::size_t w = 0; w < W; ++w) {
      if (std::abs(wavelength_nm[w] - *response.single_nm) > kSameWavelength_nm) continue;
      weights[w] = solar_irradiance_w_m2_nm(solar_spectrum, wavelength_nm[w]);
      return weights;
    }
    throw std::invalid_argument(
        fmt::format("the sky is not solved at {} nm, where it was measured", *response.single_nm));
  }
  // The Sun's spectra begin at 200 nm and a visible response ends where V(lambda) does.
  constexpr int kFirst_nm = 280, kLast_nm = 1100;
  double whole = 0, held = 0;
  for (int nm = kFirst_nm; nm <= kLast_nm; ++nm) {
    const double share = std::abs(sensitivity_at(response, nm));
    whole += share;
    if (nm >= wavelength_nm.front() && nm <= wavelength_nm.back()) held += share;
  }
  if (held < response.least_held * whole) {
    throw std::invalid_argument(fmt::format(
        "key 'spectrum.wavelengths_nm' = {}..{}: must hold {:g} % of {}, {}..{} nm: holds {:.3g} %",
        wavelength_nm.front(), wavelength_nm.back(), 100 * response.least_held, response.name,
        response.sensitivity_nm.front(), response.sensitivity_nm.back(), 100 * held / whole));
  }
  for (int nm = kFirst_nm; nm <= kLast_nm; ++nm) {
    const double sensitivity = sensitivity_at(response, nm);
    if (sensitivity == 0) continue;
    const double energy = sensitivity * solar_irradiance_w_m2_nm(solar_spectrum, nm);
    add_spectral_shares(wavelength_nm, nm,
                        [&](std::size_t i, double share) { weights[i] += share * energy; });
  }
  return weights;
}

Scene scene_for(Scene scene, const Measurement& measured) {
  std::vector<double> nm;
  for (const SpectralResponse& response : measured.responses) {
    if (response.single_nm) nm.push_back(*response.single_nm);
  }
  if (nm.empty()) return scene;
  std::ranges::sort(nm);
  constexpr std::size_t kMost = 64;
  if (nm.size() > kMost) {
    throw std::invalid_argument(fmt::format("{}: has {} wavelengths: must be 1..{}",
                                            measured.file.string(), nm.size(), kMost));
  }
  scene.spectrum.wavelengths_nm = nm;
  scene.spectrum.solved_nm.clear();
  return scene;
}

SkyForwardModel::SkyForwardModel(Scene scene, std::vector<std::string> keys,
                                 const Measurement& measured, std::shared_ptr<KnownPhases> phases,
                                 RunControl control)
    : scene_(std::move(scene)),
      keys_(std::move(keys)),
      measured_(measured),
      phases_(std::move(phases)),
      control_(std::move(control)) {
  for (const SpectralResponse& response : measured_.responses) {
    weights_.push_back(
        response_weights(response, scene_.spectrum.wavelengths_nm, scene_.sun.spectrum));
  }
}

SceneModel SkyForwardModel::model_of(std::span<const double> keys) {
  Scene scene = scene_;
  for (std::size_t k = 0; k < keys_.size(); ++k) set_number(scene, keys_[k], keys[k]);
  return build_scene_model(scene, phases_.get());
}

// The solved sky at every Sun and view.
std::vector<double> SkyForwardModel::look(SceneModel model) const {
  model.sun_elevation_rad = measured_.suns.front().elevation_rad;
  // The solver's own stages would drown the search's.
  RunControl quiet;
  quiet.cancel = control_.cancel;
  const std::unique_ptr<Sky> first = solve_sky(model, quiet);
  const std::size_t W = first->wavelength_nm().size();
  std::vector<double> data(measured_.values.size());
  for (std::size_t s = 0; s < measured_.suns.size(); ++s) {
    control_.check();
    std::unique_ptr<Sky> other;
    if (s > 0) {
      const double elevation = measured_.suns[s].elevation_rad;
      other = first->with_sun_at(elevation);
      if (!other) {
        model.sun_elevation_rad = elevation;
        other = solve_sky(model, quiet);
      }
    }
    const Sky& sky = s > 0 ? *other : *first;
    std::vector<std::size_t> place(measured_.views.size(), measured_.views.size());
    std::vector<ViewDirection> views;
    for (const MeasuredValue& value : measured_.values) {
      if (value.sun != s) continue;
      for (const auto& [view, share] : value.views) {
        if (place[view] < measured_.views.size()) continue;
        place[view] = views.size();
        views.push_back(measured_.views[view]);
      }
    }
    const std::vector<double> radiance = sky.radiance(views);
    const double distance = measured_.suns[s].distance_au;
    for (std::size_t k = 0; k < data.size(); ++k) {
      const MeasuredValue& value = measured_.values[k];
      if (value.sun != s) continue;
      for (const auto& [view, share] : value.views) {
        for (std::size_t w = 0; w < W; ++w) {
          data[k] += share * weights_[value.response][w] * radiance[place[view] * W + w] /
                     (sky.solar_irradiance()[w] * distance * distance);
        }
      }
    }
  }
  return data;
}

void SkyForwardModel::solve_ahead(std::span<const std::vector<double>> parameters) {
  std::vector<std::vector<double>> keys;
  std::vector<SceneModel> models;
  for (const std::vector<double>& p : parameters) {
    std::vector<double> own(p.begin(), p.begin() + static_cast<std::ptrdiff_t>(keys_.size()));
    if (known_.contains(own) || std::ranges::find(keys, own) != keys.end()) continue;
    control_.check();
    // One after the other: they share the phases.
    models.push_back(model_of(own));
    models.back().scene.solver.threads = 1;
    keys.push_back(std::move(own));
  }
  if (models.size() < 2) return;
  std::vector<std::vector<double>> data(models.size());
  SolverArena arena(scene_.solver.threads);
  arena.arena.execute([&] {
    tbb::parallel_for(
        std::size_t{0}, models.size(), [&](std::size_t k) { data[k] = look(models[k]); },
        tbb::simple_partitioner());
  });
  for (std::size_t k = 0; k < keys.size(); ++k) {
    known_.emplace(std::move(keys[k]), std::move(data[k]));
  }
}

std::vector<double> SkyForwardModel::operator()(std::span<const double> parameters) {
  const std::vector<double> keys(parameters.begin(),
                                 parameters.begin() + static_cast<std::ptrdiff_t>(keys_.size()));
  auto it = known_.find(keys);
  if (it == known_.end()) it = known_.emplace(keys, look(model_of(keys))).first;
  std::vector<double> data = it->second;
  const double exposure = measured_.free_exposure ? parameters[keys_.size()] : 1.0;
  for (double& value : data) {
    value *= exposure;
    if (!measured_.magnitudes) continue;
    if (!(value > 0)) throw std::runtime_error("the sky is dark where a magnitude was measured");
    value = -2.5 * std::log10(value);
  }
  return data;
}

}  // namespace twilight
