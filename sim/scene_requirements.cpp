#include "sim/scene_requirements.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "sim/orders_sky.h"
#include "sim/spectral_sky.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kRadPerDeg = pi / 180;
constexpr std::array<double, 6> kEverySun_deg = {30, 5, 0, -4, -8, -12};
// Wavelengths of the pilot, where the scene has some nearby: its ends, ozone.
constexpr double kPilotNm[] = {600};
constexpr std::size_t kMostViews = 24;
constexpr int kMostLayers = 50;

// Steps coarse enough to take a tenth of a second, fine enough to tell a change by a factor of 1.3.
void set_pilot_steps(SolverOptions& solver) {
  solver.method = "orders";
  solver.zenith_step_deg = 3;
  solver.altitude_levels = 16;
  solver.polar_directions = 12;
  solver.azimuth_directions = 4;
  solver.phase_degree = 8;
  solver.order_tolerance = 0.01;
  solver.coarse_orders = true;
  solver.single_precision = true;
  solver.sunlight_nodes = 64;
}

std::vector<double> pilot_wavelengths(const std::vector<double>& all) {
  std::vector<double> chosen = {all.front(), all.back()};
  for (const double nm : kPilotNm) {
    chosen.push_back(
        *std::ranges::min_element(all, {}, [&](double own) { return std::abs(own - nm); }));
  }
  std::ranges::sort(chosen);
  const auto repeated = std::ranges::unique(chosen);
  chosen.erase(repeated.begin(), repeated.end());
  return chosen;
}

WeightedViews pilot_views(const WantedSky& wanted) {
  if (wanted.views.views.size() <= kMostViews) return wanted.views;
  return coarse_hemisphere(6, 4);
}

// Many variants of a scene side by side, each wavelength of each a lane of one medium.
struct Stack {
  SceneModel model;
  std::vector<std::size_t> lane;  // [variant][wavelength]
};

// The kind of a medium that scatters like this.
std::optional<std::size_t> kind_like(const Medium& medium, const PhaseMatrix& phase,
                                     std::size_t wavelength) {
  for (std::size_t q = 0; q < medium.aerosol_phase.size(); ++q) {
    if (medium.aerosol_phase[q][wavelength].p11 == phase.p11) return q;
  }
  return std::nullopt;
}

// Of variants with the same layers; kinds of aerosol as the first has them. Variants of one colour
// stand together, for they share their rays; the ones without refraction are the last.
Stack stack(const std::vector<SceneModel>& variants) {
  const Medium& base = variants.front().medium;
  const std::size_t V = variants.size(), W = base.wavelengths(), layers = base.layers();
  std::vector<std::pair<std::size_t, std::size_t>> order;  // variant, wavelength
  for (const bool bent : {true, false}) {
    for (std::size_t w = 0; w < W; ++w) {
      for (std::size_t v = 0; v < V; ++v) {
        if ((variants[v].medium.refractivity(0, w) > 0) == bent) order.emplace_back(v, w);
      }
    }
  }
  Stack result;
  result.model = variants.front();
  result.lane.resize(V * W);
  Medium& m = result.model.medium;
  m.wavelength_nm.resize(V * W);
  m.zero_tables();
  m.depolarisation.clear();
  m.vertical_filter_optical_depth.clear();
  for (LayerTable& kind : m.aerosol_kind_scattering_per_km) kind = LayerTable(layers, V * W);
  for (auto& kind : m.aerosol_phase) kind.clear();
  result.model.solar_irradiance.clear();
  result.model.ground_albedo.clear();
  const auto copy = [&](std::size_t lane, std::size_t v, std::size_t w) {
    const Medium& from = variants[v].medium;
    m.wavelength_nm[lane] = base.wavelength_nm[w];
    result.model.solar_irradiance.push_back(variants[v].solar_irradiance[w]);
    result.model.ground_albedo.push_back(variants[v].ground_albedo[w]);
    if (!from.depolarisation.empty()) m.depolarisation.push_back(from.depolarisation[w]);
    if (!from.vertical_filter_optical_depth.empty()) {
      m.vertical_filter_optical_depth.push_back(from.vertical_filter_optical_depth[w]);
    }
    for (std::size_t i = 0; i < layers; ++i) {
      for (const auto table : {&Medium::air_scattering_per_km, &Medium::aerosol_scattering_per_km,
                               &Medium::aerosol_absorption_per_km, &Medium::gas_absorption_per_km,
                               &Medium::refractivity}) {
        (m.*table)(i, lane) = (from.*table)(i, w);
      }
      m.aerosol_asymmetry(i, lane) = base.aerosol_asymmetry(i, w);
    }
    for (std::size_t q = 0; q < m.aerosol_phase.size(); ++q) {
      m.aerosol_phase[q].push_back(base.aerosol_phase[q][w]);
      const auto own = kind_like(from, base.aerosol_phase[q][w], w);
      for (std::size_t i = 0; own && i < layers; ++i) {
        m.aerosol_kind_scattering_per_km[q](i, lane) =
            from.aerosol_kind_scattering_per_km[*own](i, w);
      }
    }
  };
  for (std::size_t lane = 0; lane < order.size(); ++lane) {
    const auto [v, w] = order[lane];
    result.lane[v * W + w] = lane;
    copy(lane, v, w);
  }
  return result;
}

double aerosol_depth(const Medium& m) {
  const auto w = static_cast<std::size_t>(
      std::ranges::min_element(m.wavelength_nm, {}, [](double nm) { return std::abs(nm - 550); }) -
      m.wavelength_nm.begin());
  double depth = 0;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    depth += (m.aerosol_scattering_per_km(i, w) + m.aerosol_absorption_per_km(i, w)) *
             (m.boundary_km[i + 1] - m.boundary_km[i]);
  }
  return depth;
}

// The model without what is above an altitude.
SceneModel without_air_above(SceneModel model, double top_km) {
  Medium& m = model.medium;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    if (m.boundary_km[i] < top_km) continue;
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      m.air_scattering_per_km(i, w) = m.aerosol_scattering_per_km(i, w) = 0;
      m.aerosol_absorption_per_km(i, w) = m.gas_absorption_per_km(i, w) = 0;
    }
  }
  return model;
}

double top_after(Effect effect) { return effect == Effect::kAirAbove80 ? 80.0 : 60.0; }

// The levels below stay as dense as they were (they stand at top v^2 (0.6 + 0.4 v)).
void lower_top(Scene& scene, double top_km) {
  double v = 1;
  while (scene.atmosphere.top_km * v * v * (0.6 + 0.4 * v) > top_km) v -= 1e-3;
  scene.solver.altitude_levels =
      std::max(4, static_cast<int>(std::ceil(v * scene.solver.altitude_levels)));
  scene.atmosphere.top_km = top_km;
}

bool is_air_above(Effect effect) {
  return effect == Effect::kAirAbove80 || effect == Effect::kAirAbove60;
}

class Pilot {
 public:
  Pilot(const Scene& scene, const WantedSky& wanted, KnownPhases& known, const RunControl& control)
      : scene_(scene), known_(known), control_(control), views_(pilot_views(wanted)) {
    set_pilot_steps(scene_.solver);
    scene_.solver.polarisation = false;
    scene_.sun.disc_average = false;  // a third of the pilot's work
    scene_.atmosphere.layers = std::min(scene_.atmosphere.layers, kMostLayers);
    scene_.quality.reset();
    scene_.budget = {};
    scene_.spectrum.solved_nm.clear();
    Scene one = scene_;
    one.spectrum.wavelengths_nm = {scene.spectrum.wavelengths_nm.front()};
    one.aerosols.phase.reset();
    remove_aerosols(one);
    const SceneModel where = build_scene_model(one);
    if (wanted.every_sun) {
      scene_.observer.height_m = 0;  // the field knows no observer
      for (const double sun : kEverySun_deg) sun_rad_.push_back(sun * kRadPerDeg);
    } else {
      sun_rad_.push_back(where.sun_elevation_rad);
      darkest_deg_ = darkest_zenith_deg(where);
      scene_.solver.darkest_zenith_deg = std::min(scene_.solver.darkest_zenith_deg, darkest_deg_);
    }
  }

  SceneRequirements run() {
    SceneRequirements result;
    result.darkest_zenith_deg = darkest_deg_;
    result.sun_elevation_deg = sun_rad_.front() / kRadPerDeg;
    const std::vector<double> all = scene_.spectrum.wavelengths_nm;
    scene_.spectrum.wavelengths_nm = pilot_wavelengths(all);
    estimate_effects(result);
    scene_.spectrum.wavelengths_nm = all;
    choose_wavelengths(result);
    return result;
  }

 private:
  // The furthest air that views reach, and that lights it: a scattering more; and two nodes of the
  // zenith grid, whose steps are coarse by day, for the interpolation.
  static double darkest_zenith_deg(const SceneModel& model) {
    constexpr double kTopKm = 70, kSpareDeg = 9, kDayStepDeg = 4, kFineFromDeg = 79;
    const double R = model.medium.earth_radius_km;
    const double height_km = observer_altitude_km(model.scene);
    const double reach = std::acos(R / (R + height_km)) + std::acos(R / (R + kTopKm));
    const double lit = (pi / 2 - model.sun_elevation_rad + reach) / kRadPerDeg + kSpareDeg;
    const double nodes = 2 * kDayStepDeg * std::clamp((kFineFromDeg + 8 - lit) / 8, 0.0, 1.0);
    return std::clamp(std::ceil(lit + nodes), 60.0, 126.0);
  }

  using Look = std::function<std::vector<double>(const OrdersSky&)>;

  // Radiances under every Sun, [Sun][view][lane].
  std::vector<std::vector<double>> solve(SceneModel model, const Look& look) const {
    control_.check();
    std::vector<std::vector<double>> radiance;
    model.sun_elevation_rad = sun_rad_.front();
    const OrdersSky first(model, quiet());
    radiance.push_back(look(first));
    for (std::size_t k = 1; k < sun_rad_.size(); ++k) {
      radiance.push_back(look(*first.under(sun_rad_[k])));
    }
    return radiance;
  }

  RunControl quiet() const { return {nullptr, control_.cancel}; }

  std::vector<std::vector<double>> all_light(const SceneModel& model) const {
    return solve(model, [&](const OrdersSky& sky) { return sky.radiance(views_.views); });
  }

  std::vector<std::vector<double>> single(Scene scene) const {
    scene.solver.scattering_orders = 1;
    return solve(build_scene_model(scene, &known_),
                 [&](const OrdersSky& sky) { return sky.single_scattering(views_.views).i; });
  }

  double difference(std::span<const double> sun, const std::vector<std::vector<double>>& truth,
                    const std::vector<std::vector<double>>& other) const {
    double error = 0;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      error = std::max(error, relative_difference(views_, sun, truth[k], other[k]).percentile_95);
    }
    return error;
  }

  void estimate_effects(SceneRequirements& result) {
    const SceneModel base = build_scene_model(scene_, &known_);
    const std::size_t W = base.medium.wavelengths();
    result.aerosol_optical_depth = aerosol_depth(base.medium);
    std::vector<SceneModel> variants = {base};
    std::vector<Effect> stacked;
    for (const Effect effect : {Effect::kRefraction, Effect::kMixingLayer, Effect::kFreeTroposphere,
                                Effect::kStratosphere, Effect::kOzone, Effect::kNitrogenDioxide,
                                Effect::kGroundLight, Effect::kAirAbove80, Effect::kAirAbove60}) {
      if (!can_leave_out(scene_, effect)) continue;
      Scene without = scene_;
      leave_out(effect, without);
      stacked.push_back(effect);
      if (is_air_above(effect)) {
        variants.push_back(without_air_above(base, top_after(effect)));
      } else if (effect == Effect::kGroundLight) {
        variants.push_back(base);
        std::ranges::fill(variants.back().ground_albedo, 0.0);
      } else {
        variants.push_back(build_scene_model(without, &known_));
      }
    }
    const Stack all = stack(variants);
    const std::size_t lanes = variants.size() * W;
    const auto light = all_light(all.model);
    const auto of_variant = [&](std::size_t v) {
      std::vector<std::vector<double>> radiance;
      for (const std::vector<double>& sun : light) {
        auto& own = radiance.emplace_back();
        for (std::size_t k = 0; k < views_.views.size(); ++k) {
          for (std::size_t w = 0; w < W; ++w) own.push_back(sun[k * lanes + all.lane[v * W + w]]);
        }
      }
      return radiance;
    };
    const auto truth = of_variant(0);
    for (std::size_t k = 0; k < stacked.size(); ++k) {
      result.effects.push_back(
          {stacked[k], difference(base.solar_irradiance, truth, of_variant(k + 1))});
    }
    if (can_leave_out(full_, Effect::kPolarisation)) {
      Scene polarised_scene = scene_;
      polarised_scene.solver.polarisation = true;
      result.effects.push_back(
          {Effect::kPolarisation,
           difference(base.solar_irradiance, all_light(build_scene_model(polarised_scene, &known_)),
                      truth)});
    }
    std::vector<std::vector<double>> once;
    for (const Effect effect : {Effect::kRefractiveSpreading, Effect::kSunDisc}) {
      if (!can_leave_out(full_, effect)) continue;
      if (once.empty()) once = single(scene_);
      Scene other = scene_;
      if (effect == Effect::kSunDisc) {
        other.sun.disc_average = true;
      } else {
        leave_out(effect, other);
      }
      result.effects.push_back({effect, difference(base.solar_irradiance, once, single(other))});
    }
    std::ranges::sort(result.effects, {}, &EffectError::effect);
  }

  // Takes wavelengths away one by one, the one that is missed least.
  void choose_wavelengths(SceneRequirements& result) {
    constexpr double kUseless = 0.3;
    const std::vector<double>& all = scene_.spectrum.wavelengths_nm;
    result.spectra.push_back({all, 0.0});
    if (all.size() < 4 || replaces_profile(scene_)) return;
    Scene clear = scene_;
    if (clear.aerosols.mixture) {
      remove_aerosols(clear);
    } else {
      clear.aerosols.mixing_layer = clear.aerosols.free_troposphere = false;
      clear.aerosols.stratosphere = false;
      clear.volcanic_sulfate.optical_depth_550nm = clear.dust_layer.optical_depth_550nm = 0;
    }
    clear.aerosols.phase = "henyey-greenstein";
    const SceneModel model = build_scene_model(clear);
    const auto truth = all_light(model);
    std::vector<double> kept = all;
    const auto error_of = [&](const std::vector<double>& solved) {
      const SpectralInterpolation rule(solved, all);
      std::vector<std::vector<double>> guess;
      std::vector<double> ratio;
      for (const std::vector<double>& sun : truth) {
        auto& own = guess.emplace_back(sun.size());
        for (std::size_t v = 0; v < views_.views.size(); ++v) {
          ratio.clear();
          for (std::size_t w = 0, k = 0; w < all.size(); ++w) {
            if (k == solved.size() || all[w] != solved[k]) continue;
            ratio.push_back(sun[v * all.size() + w] / model.solar_irradiance[w]);
            ++k;
          }
          const std::span<double> spectrum(&own[v * all.size()], all.size());
          rule.logarithmic(ratio, spectrum);
          for (std::size_t w = 0; w < all.size(); ++w) spectrum[w] *= model.solar_irradiance[w];
        }
      }
      return difference(model.solar_irradiance, truth, guess);
    };
    while (kept.size() > 3) {
      control_.check();
      double least = std::numeric_limits<double>::infinity();
      std::vector<double> best;
      for (std::size_t k = 1; k + 1 < kept.size(); ++k) {
        std::vector<double> fewer = kept;
        fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(k));
        const double error = error_of(fewer);
        if (error >= least) continue;
        least = error;
        best = std::move(fewer);
      }
      kept = std::move(best);
      result.spectra.push_back({kept, std::max(least, result.spectra.back().error)});
      if (least > kUseless) break;
    }
  }

  Scene scene_;
  Scene full_ = scene_;
  KnownPhases& known_;
  const RunControl& control_;
  WeightedViews views_;
  std::vector<double> sun_rad_;
  double darkest_deg_ = 126;
};

}  // namespace

std::string_view effect_name(Effect effect) {
  switch (effect) {
    case Effect::kRefraction:
      return "refraction";
    case Effect::kRefractiveSpreading:
      return "refractive spreading";
    case Effect::kPolarisation:
      return "polarisation";
    case Effect::kSunDisc:
      return "the Sun's disc";
    case Effect::kMixingLayer:
      return "aerosols of the mixing layer";
    case Effect::kFreeTroposphere:
      return "aerosols of the free troposphere";
    case Effect::kStratosphere:
      return "aerosols of the stratosphere";
    case Effect::kOzone:
      return "ozone";
    case Effect::kNitrogenDioxide:
      return "nitrogen dioxide";
    case Effect::kGroundLight:
      return "ground light";
    case Effect::kAirAbove80:
      return "air above 80 km";
    case Effect::kAirAbove60:
      return "air above 60 km";
  }
  return "";
}

bool can_leave_out(const Scene& scene, Effect effect) {
  const AtmosphereOptions& air = scene.atmosphere;
  const AerosolOptions& aerosols = scene.aerosols;
  const bool own_layers = replaces_profile(scene);
  // A mixture file's layers are not known by name; layers asked for by name stay.
  const bool particles = !own_layers && !aerosols.mixture && aerosols.type != "none" &&
                         aerosols.optical_depth_550nm.value_or(1.0) > 0;
  const double added_top_km =
      std::max(scene.volcanic_sulfate.optical_depth_550nm > 0 ? scene.volcanic_sulfate.top_km : 0,
               scene.dust_layer.optical_depth_550nm > 0 ? scene.dust_layer.top_km : 0);
  const double height_km = observer_altitude_km(scene);
  switch (effect) {
    case Effect::kRefraction:
      return !own_layers && air.refraction;
    case Effect::kRefractiveSpreading:
      return !own_layers && air.refraction && air.refractive_spreading;
    case Effect::kPolarisation:
      return !scene.solver.polarisation.has_value();
    case Effect::kSunDisc:
      return !scene.sun.disc_average.has_value();
    case Effect::kMixingLayer:
      return particles && aerosols.mixing_layer;
    case Effect::kFreeTroposphere:
      return particles && aerosols.free_troposphere;
    case Effect::kStratosphere:
      return particles && aerosols.stratosphere && air.top_km > 12;
    case Effect::kOzone:
      return !own_layers && air.ozone_du.value_or(1.0) > 0;
    case Effect::kNitrogenDioxide:
      return !own_layers && air.nitrogen_dioxide_du.value_or(
                                air.profile == "exponential" && !air.profile_file ? 0.0 : 1.0) > 0;
    case Effect::kGroundLight:
      return scene.solver.ground_light;
    case Effect::kAirAbove80:
    case Effect::kAirAbove60:
      return !own_layers && air.top_km > top_after(effect) && 3 * height_km < top_after(effect) &&
             added_top_km <= top_after(effect);
  }
  return false;
}

void leave_out(Effect effect, Scene& scene) {
  switch (effect) {
    case Effect::kRefraction:
      scene.atmosphere.refraction = false;
      break;
    case Effect::kRefractiveSpreading:
      scene.atmosphere.refractive_spreading = false;
      break;
    case Effect::kPolarisation:
      scene.solver.polarisation = false;
      break;
    case Effect::kSunDisc:
      scene.sun.disc_average = false;
      break;
    case Effect::kMixingLayer:
      scene.aerosols.mixing_layer = false;
      break;
    case Effect::kFreeTroposphere:
      scene.aerosols.free_troposphere = false;
      break;
    case Effect::kStratosphere:
      scene.aerosols.stratosphere = false;
      break;
    case Effect::kOzone:
      scene.atmosphere.ozone_du = 0.0;
      break;
    case Effect::kNitrogenDioxide:
      scene.atmosphere.nitrogen_dioxide_du = 0.0;
      break;
    case Effect::kGroundLight:
      scene.solver.ground_light = false;
      break;
    case Effect::kAirAbove80:
    case Effect::kAirAbove60:
      lower_top(scene, top_after(effect));
      break;
  }
}

SceneRequirements estimate_requirements(const Scene& scene, const WantedSky& wanted,
                                        KnownPhases& known, const RunControl& control) {
  control.report("what the scene requires", 0.0);
  return Pilot(scene, wanted, known, control).run();
}

}  // namespace twilight
