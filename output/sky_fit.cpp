#include "output/sky_fit.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "output/csv_table.h"
#include "output/photometry.h"
#include "output/scene_colour.h"
#include "sim/scene_model.h"
#include "sim/solver_arena.h"

namespace twilight {
namespace {

/// The fit while it is made.
class SkyFitter {
 public:
  SkyFitter(const Study& study, const SkyFitOptions& options, const RunControl& control)
      : study_(study), options_(options), control_(control) {}
  SkyFit run();

 private:
  void begin(const SceneModel& model);
  void fit_channel(const std::vector<FitSky>& skies, std::size_t first, std::size_t channel);
  void keep(const std::vector<FitSky>& skies, std::size_t first);
  std::string place(std::size_t node) const;
  std::size_t suns() const { return study_.axes.back().values.size(); }

  const Study& study_;
  const SkyFitOptions& options_;
  const RunControl& control_;
  std::unique_ptr<ColourIntegrator> colour_;
  SkyFit fit_;
};

// The values of the axes but the Sun's.
std::string SkyFitter::place(std::size_t node) const {
  std::string text;
  const std::vector<double> values = study_.values_at(node);
  for (std::size_t a = 0; a + 1 < values.size(); ++a) {
    text += fmt::format(", {} = {}", study_.axes[a].key, values[a]);
  }
  return text;
}

void SkyFitter::begin(const SceneModel& model) {
  FitCoefficients& c = fit_.coefficients;
  c.form = options_.form;
  c.quantity = options_.quantity;
  for (const StudyAxis& axis : study_.axes) c.axes.push_back({axis.key, axis.values});
  c.wavelength_nm = model.scene.spectrum.wavelengths_nm;
  c.solar_spectrum = model.scene.sun.spectrum;
  if (options_.quantity == FitQuantity::kSpectral) {
    for (const double nm : c.wavelength_nm) fit_.channel_names.push_back(shortest_number(nm));
  } else {
    fit_.channel_names = {"Y", "x", "y"};
  }
  fit_.channels.resize(c.nodes() * c.channels());
  fit_.luminance.resize(c.nodes());
}

// From the highest Sun down, each start the neighbour's end.
void SkyFitter::fit_channel(const std::vector<FitSky>& skies, std::size_t first,
                            std::size_t channel) {
  const std::size_t C = fit_.coefficients.channels();
  std::vector<std::vector<double>> starts;
  for (std::size_t s = suns(); s-- > 0;) {
    const double sun_zenith = fit_.coefficients.sun_zenith_rad(first + s);
    const std::vector<double> values = channel_values(skies[s], options_.quantity, channel);
    std::vector<FormSample> sky = fit_samples(sun_zenith);
    for (std::size_t v = 0; v < sky.size(); ++v) sky[v].value = values[v];
    ChannelFit& result = fit_.channels[(first + s) * C + channel];
    result.fit = fit_form(options_.form, sky, sun_zenith, starts, options_.most_iterations);
    starts = {result.fit.parameters};
    control_.check();
  }
}

// Puts what one combination's fits found into the tables, and measures them as a reader of the
// coefficients will see them.
void SkyFitter::keep(const std::vector<FitSky>& skies, std::size_t first) {
  FitCoefficients& c = fit_.coefficients;
  const std::size_t C = c.channels();
  for (std::size_t node = first; node < first + suns(); ++node) {
    bool converged = true;
    for (std::size_t k = 0; k < C; ++k) {
      const FormFit& fit = fit_.channels[node * C + k].fit;
      c.coefficients.insert(c.coefficients.end(), fit.coefficients.begin(), fit.coefficients.end());
      c.normalisation.push_back(fit.normalisation);
      converged = converged && fit.converged;
    }
    c.converged.push_back(converged);
    const FitSky& sky = skies[node - first];
    c.sun_transmittance.insert(c.sun_transmittance.end(), sky.sun_transmittance.begin(),
                               sky.sun_transmittance.end());
    const std::vector<FormSample> at = fit_samples(c.sun_zenith_rad(node));
    std::vector<std::vector<double>> form(C);
    for (std::size_t k = 0; k < C; ++k) {
      for (const FormSample& s : at) {
        form[k].push_back(c.value(node, k, s.cos_zenith, s.sun_angle_rad));
      }
      fit_.channels[node * C + k].error =
          fit_error(form[k], channel_values(sky, options_.quantity, k));
    }
    if (options_.quantity == FitQuantity::kLuminanceChromaticity) {
      fit_.luminance[node] = fit_.channels[node * C].error;
      continue;
    }
    std::vector<double> luminance, spectrum(C);
    for (std::size_t v = 0; v < at.size(); ++v) {
      for (std::size_t k = 0; k < C; ++k) spectrum[k] = form[k][v];
      luminance.push_back(luminance_cd_m2(*colour_, spectrum, c.solar_irradiance));
    }
    fit_.luminance[node] = fit_error(luminance, sky.luminance);
  }
}

SkyFit SkyFitter::run() {
  KnownPhases phases;
  for (std::size_t first = 0; first < study_.nodes(); first += suns()) {
    Scene scene = study_.scene.scene;
    const std::vector<double> values = study_.values_at(first);
    for (std::size_t a = 0; a + 1 < study_.axes.size(); ++a) {
      set_number(scene, study_.axes[a].key, values[a]);
    }
    const SceneModel model = build_scene_model(scene, &phases);
    if (first == 0) {
      begin(model);
      colour_ =
          std::make_unique<ColourIntegrator>(colour_integrator(model, ColourObserver::kCie1931));
    }
    const std::vector<FitSky> skies = simulate_suns(
        model, study_.axes.back().values, *colour_, place(first), control_, [&](std::size_t s) {
          control_.report("skies",
                          static_cast<double>(first + s) / static_cast<double>(study_.nodes()));
        });
    if (first == 0) fit_.coefficients.solar_irradiance = skies.front().solar_irradiance;
    control_.report("fits", static_cast<double>(first) / static_cast<double>(study_.nodes()));
    SolverArena arena(scene.solver.threads);
    arena.arena.execute([&] {
      tbb::parallel_for(std::size_t{0}, fit_.coefficients.channels(),
                        [&](std::size_t channel) { fit_channel(skies, first, channel); });
    });
    keep(skies, first);
  }
  Scene scene = study_.scene.scene;
  scene.solver.threads = SolverOptions().threads;  // the file does not depend on them
  fit_.scene_toml = to_toml(scene);
  double sum = 0;
  for (const ChannelFit& c : fit_.channels) {
    sum += c.error.rms * c.error.rms;
    fit_.not_converged += c.fit.converged ? 0 : 1;
  }
  fit_.rms_of_all = std::sqrt(sum / static_cast<double>(fit_.channels.size()));
  return std::move(fit_);
}

// Keys that say what sky it is, not how it is computed or shown.
bool is_of_the_sky(const std::string& key) {
  if (key == kSunElevationKey) return true;
  Scene probe;
  const auto keys = scene_keys();
  const auto known = std::ranges::find(keys, key, &SceneKey::name);
  if (known == keys.end()) return false;
  const SceneField field = known->field(probe);
  const bool real = std::holds_alternative<double*>(field) ||
                    std::holds_alternative<std::optional<double>*>(field);
  return real && (key.starts_with("aerosols.") || key.starts_with("atmosphere.") ||
                  key.starts_with("earth.") || key.starts_with("two_constituent_air."));
}

}  // namespace

std::vector<double> usual_fit_suns_deg() {
  return {60, 45, 30, 20, 15, 10, 7, 5, 3, 1, 0, -1, -2, -3, -4, -5, -6, -7, -8, -9, -10, -11, -12};
}

Study study_for_fit(Study study, const std::vector<double>& suns_deg) {
  LoadedScene& loaded = study.scene;
  if (loaded.scene.budget.max_relative_error || loaded.scene.budget.max_seconds) {
    const char* key =
        loaded.scene.budget.max_relative_error ? "budget.max_relative_error" : "budget.max_seconds";
    throw std::invalid_argument(
        loaded.complaint(key, "must not be given for twilight fit; take a quality"));
  }
  if (loaded.scene.observer.height_m > 0) {
    throw std::invalid_argument(loaded.complaint(
        "observer.height_m", fmt::format("= {}: must be 0 or less for twilight fit: the forms are "
                                         "of skies seen from the ground",
                                         loaded.scene.observer.height_m)));
  }
  if (!loaded.origin.contains("solver.method") && !loaded.scene.quality) {
    loaded.scene.solver.method = "orders";
  }
  if (!study.crossed()) {
    throw std::invalid_argument(fmt::format(
        "{}: must cross its axes for twilight fit: no zip, no sampling", study.file.string()));
  }
  for (StudyAxis& axis : study.axes) {
    if (!axis.words.empty()) {
      throw std::invalid_argument(
          fmt::format("{}: key 'axis.key' = \"{}\": must have numbers as values for twilight fit",
                      axis.origin, axis.key));
    }
    if (!is_of_the_sky(axis.key)) {
      throw std::invalid_argument(fmt::format(
          "{}: key 'axis.key' = \"{}\": must be sun.elevation_deg or a number in [earth], "
          "[atmosphere], [aerosols] or [two_constituent_air] for twilight fit",
          axis.origin, axis.key));
    }
    std::ranges::sort(axis.values);
  }
  const auto sun = std::ranges::find(study.axes, kSunElevationKey, &StudyAxis::key);
  if (sun != study.axes.end()) {
    std::rotate(sun, sun + 1, study.axes.end());
  } else {
    StudyAxis axis{kSunElevationKey, suns_deg.empty() ? usual_fit_suns_deg() : suns_deg, "--suns"};
    std::ranges::sort(axis.values);
    study.axes.push_back(std::move(axis));
  }
  study.cross();
  return study;
}

SkyFit fit_skies(const Study& study, const SkyFitOptions& options, const RunControl& control) {
  if (study.dimensions.size() != study.axes.size() || !study.crossed()) {
    throw std::invalid_argument("axes of a study must be crossed for a fit (Study::cross)");
  }
  return SkyFitter(study, options, control).run();
}

}  // namespace twilight
