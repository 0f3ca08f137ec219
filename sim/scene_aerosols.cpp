#include "sim/scene_aerosols.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "aerosols/mixture_file.h"

namespace twilight {
namespace {

using Source = LayerHumidity::Source;

constexpr double k440nm = 440.0, k550nm = 550.0, k870nm = 870.0;
// Between two of these one kind of scattering matrix serves: OPAC's humidities, and 25 %.
constexpr std::array<double, 9> kHumidityClasses = {0, 25, 50, 70, 80, 90, 95, 98, 99};

// A layer of `component` of unit amount, at the humidity of OPAC's stratosphere (dry; dust takes
// up no water at all).
SceneAerosolLayer added_layer(AerosolComponent component, const AddedLayerOptions& options) {
  SceneAerosolLayer added;
  added.added = true;
  added.layer.profile.bottom_km = options.bottom_km;
  added.layer.profile.top_km = options.top_km;
  added.layer.humidity.source = Source::kPercent;
  added.layer.amounts = {{opac_component(component), 1.0}};
  added.layer.optical_depth_550nm = options.optical_depth_550nm;
  return added;
}

double at_height(const LayerHumidity& table, double z_km) {
  const auto& z = table.heights_km;
  if (z_km <= z.front()) return table.percents.front();
  if (z_km >= z.back()) return table.percents.back();
  const auto i = static_cast<std::size_t>(std::ranges::upper_bound(z, z_km) - z.begin());
  return std::lerp(table.percents[i - 1], table.percents[i], (z_km - z[i - 1]) / (z[i] - z[i - 1]));
}

// One layer of particles, seen from the medium's layers of air.
class LayerInAir {
 public:
  LayerInAir(const SceneAerosolLayer& described, const Scene& scene, const Medium& medium)
      : described_(described), medium_(medium) {
    const LayerHumidity& humidity = described_.layer.humidity;
    const bool follows = !described.added && (scene.aerosols.humidity == "profile" ||
                                              humidity.source == Source::kAtmosphere);
    uniform_ = !follows && humidity.source != Source::kTable;
    if (uniform_) {
      uniform_percent_ = humidity.source == Source::kScene
                             ? scene.aerosols.relative_humidity_percent
                             : humidity.percent;
      return;
    }
    for (std::size_t i = 0; i < medium.layers(); ++i) {
      // Of the part of the layer of air that lies within.
      const double bottom = std::max(medium.boundary_km[i], profile().bottom_km);
      const double top = std::min(medium.boundary_km[i + 1], profile().top_km);
      const double percent =
          follows ? 100.0 * medium.relative_humidity[i] : at_height(humidity, 0.5 * (bottom + top));
      percent_.push_back(std::clamp(percent, 0.0, kLargestAerosolHumidity_percent));
    }
  }

  bool added() const { return described_.added; }
  bool takes_part() const { return described_.takes_part; }
  bool uniform() const { return uniform_; }
  const HeightProfile& profile() const { return described_.layer.profile; }
  const std::optional<double>& wanted_depth() const { return described_.layer.optical_depth_550nm; }
  std::vector<ComponentAmount>& amounts() { return described_.layer.amounts; }
  const std::vector<ComponentAmount>& amounts() const { return described_.layer.amounts; }
  double humidity_percent(std::size_t air_layer) const {
    return uniform_ ? uniform_percent_ : percent_[air_layer];
  }

  Mixture mixture(std::size_t air_layer) const { return {amounts(), humidity_percent(air_layer)}; }

  bool within(std::size_t air_layer) const {
    return medium_.boundary_km[air_layer + 1] > profile().bottom_km &&
           medium_.boundary_km[air_layer] < profile().top_km;
  }

  double mean_profile(std::size_t air_layer, bool centre) const {
    const double z0 = medium_.boundary_km[air_layer], z1 = medium_.boundary_km[air_layer + 1];
    return centre ? profile().at(0.5 * (z0 + z1)) : profile().mean(z0, z1);
  }

  // Of the amounts given, which are this layer's or some of them, up to the model's top.
  double depth(const std::vector<ComponentAmount>& amounts, double nm, KnownPhases& known) const {
    const std::span<const double> at(&nm, 1);
    const auto extinction = [&](double percent) {
      const MixtureOptics optics = known.optics({amounts, percent}, at);
      return optics.scattering_per_km[0] + optics.absorption_per_km[0];
    };
    if (amounts.empty()) return 0.0;
    if (uniform_) {
      const double top_km = std::max(profile().bottom_km, medium_.top_km());
      return extinction(uniform_percent_) * profile().integral_km(0.0, top_km);
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < medium_.layers(); ++i) {
      if (!within(i)) continue;
      sum += extinction(percent_[i]) *
             profile().integral_km(medium_.boundary_km[i], medium_.boundary_km[i + 1]);
    }
    return sum;
  }

  // Mixtures at every humidity the layer has.
  std::vector<Mixture> mixtures() const {
    std::vector<Mixture> all;
    for (std::size_t i = 0; i < medium_.layers(); ++i) {
      if (uniform_ || within(i)) all.push_back(mixture(i));
      if (uniform_) break;
    }
    return all;
  }

 private:
  SceneAerosolLayer described_;
  const Medium& medium_;
  bool uniform_ = true;
  double uniform_percent_ = 0.0;
  std::vector<double> percent_;  ///< per layer of air
};

void scale(std::vector<ComponentAmount>& amounts, double factor) {
  for (ComponentAmount& a : amounts) a.amount *= factor;
}

// Scales each layer that has a target of its own.
void meet_layer_targets(std::vector<LayerInAir>& layers, const Medium& medium, KnownPhases& known) {
  for (LayerInAir& layer : layers) {
    if (!layer.wanted_depth()) continue;
    const double wanted = *layer.wanted_depth();
    const double depth = layer.depth(layer.amounts(), k550nm, known);
    if (wanted > 0.0 && !(depth > 0.0)) {
      throw std::invalid_argument(fmt::format(
          "an aerosol layer at {}..{} km must lie below the top of the atmosphere, {} km, to have "
          "the optical depth {}",
          layer.profile().bottom_km, layer.profile().top_km, medium.top_km(), wanted));
    }
    scale(layer.amounts(), depth > 0.0 ? wanted / depth : 0.0);
  }
}

std::vector<ComponentAmount> of_size(const std::vector<ComponentAmount>& amounts, bool coarse) {
  std::vector<ComponentAmount> result;
  for (const ComponentAmount& a : amounts) {
    if (a.component->coarse() == coarse && a.amount > 0.0) result.push_back(a);
  }
  return result;
}

double column_depth(const std::vector<LayerInAir>& layers, bool coarse, double nm,
                    KnownPhases& known) {
  double sum = 0.0;
  for (const LayerInAir& layer : layers) {
    if (!layer.added()) sum += layer.depth(of_size(layer.amounts(), coarse), nm, known);
  }
  return sum;
}

// Scales the coarse against the fine particles of the column, see add_aerosols().
void meet_angstrom_exponent(std::vector<LayerInAir>& layers, double exponent, KnownPhases& known) {
  const auto depth = [&](bool coarse, double nm) {
    return column_depth(layers, coarse, nm, known);
  };
  const double f440 = depth(false, k440nm), f550 = depth(false, k550nm),
               f870 = depth(false, k870nm), c440 = depth(true, k440nm), c550 = depth(true, k550nm),
               c870 = depth(true, k870nm);
  const double ratio = std::pow(k440nm / k870nm, -exponent);
  const double fine = f440 - ratio * f870, coarse = ratio * c870 - c440;
  // Both of one sign: the exponent lies between those of the fine and of the coarse alone.
  if (f870 > 0.0 && c870 > 0.0 && fine * coarse >= 0.0 && (fine != 0.0 || coarse != 0.0)) {
    // x : y = coarse : fine.
    const double norm = (f550 + c550) / (coarse * f550 + fine * c550);
    for (LayerInAir& layer : layers) {
      if (layer.added()) continue;
      for (ComponentAmount& a : layer.amounts()) {
        a.amount *= norm * (a.component->coarse() ? fine : coarse);
      }
    }
    return;
  }
  const auto own = [](double blue, double red) {
    return std::log(blue / red) / std::log(k870nm / k440nm);
  };
  std::string reach = "the aerosol has no particles";
  if (f870 > 0.0 && c870 > 0.0) {
    const double a = own(f440, f870), b = own(c440, c870);
    reach = fmt::format("must be {:.4f}..{:.4f}, of the coarse particles alone to the fine alone",
                        std::min(a, b), std::max(a, b));
  } else if (f870 > 0.0 || c870 > 0.0) {
    const double only = f870 > 0.0 ? own(f440, f870) : own(c440, c870);
    if (std::abs(exponent - only) < 1e-9) return;
    reach = fmt::format("must be {:.4f} or unset: all particles are {}", only,
                        f870 > 0.0 ? "fine" : "coarse");
  }
  throw std::invalid_argument(
      fmt::format("key 'aerosols.angstrom_exponent' = {}: {}", exponent, reach));
}

// What the column is multiplied with to have the scene's optical depth.
double column_factor(const std::vector<LayerInAir>& layers, const Scene& scene,
                     KnownPhases& known) {
  const std::optional<double>& wanted = scene.aerosols.optical_depth_550nm;
  if (!wanted) return 1.0;
  double depth = 0.0;
  bool any = false;
  for (const LayerInAir& layer : layers) {
    if (layer.added()) continue;
    any = true;
    depth += layer.depth(layer.amounts(), k550nm, known);
  }
  if (!any) return 1.0;
  if (depth > 0.0) return *wanted / depth;
  if (*wanted == 0.0) return 0.0;
  throw std::invalid_argument(
      fmt::format("key 'aerosols.optical_depth_550nm' = {}: must be 0 or unset where the aerosol "
                  "has no particles below atmosphere.top_km",
                  *wanted));
}

// The kinds of scattering matrix that the layers make, found by what they are made of.
struct Kinds {
  struct Kind {
    Mixture mixture;
    LayerTable scattering_per_km;
    bool scatters = false;
  };
  std::vector<Kind> kinds;
  std::map<std::string, std::size_t> by_text;

  std::size_t of(const Mixture& mixture, const Medium& medium) {
    const auto [it, fresh] = by_text.emplace(mixture_text(mixture), kinds.size());
    if (fresh) {
      kinds.push_back({mixture, LayerTable(medium.layers(), medium.wavelengths()), false});
    }
    return it->second;
  }
};

std::size_t humidity_class(double percent) {
  const auto above =
      std::upper_bound(kHumidityClasses.begin() + 1, kHumidityClasses.end() - 1, percent);
  return static_cast<std::size_t>(above - kHumidityClasses.begin());
}

// The kind of a layer in each layer of air: one for a uniform humidity, else one per class at the
// mean humidity there.
std::vector<std::size_t> kinds_in_air(const LayerInAir& layer, const Medium& medium, bool centre,
                                      Kinds& kinds) {
  std::vector<std::size_t> kind(medium.layers(), 0);
  if (layer.uniform()) {
    std::ranges::fill(kind, kinds.of(layer.mixture(0), medium));
    return kind;
  }
  std::map<std::size_t, std::pair<double, double>> classes;  // weight, weight times humidity
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    const double weight =
        layer.mean_profile(i, centre) * (medium.boundary_km[i + 1] - medium.boundary_km[i]);
    if (!(weight > 0.0)) continue;
    auto& [sum, moment] = classes[humidity_class(layer.humidity_percent(i))];
    sum += weight;
    moment += weight * layer.humidity_percent(i);
  }
  std::map<std::size_t, std::size_t> kind_of_class;
  for (const auto& [index, sums] : classes) {
    kind_of_class[index] = kinds.of({layer.amounts(), sums.second / sums.first}, medium);
  }
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    const auto it = kind_of_class.find(humidity_class(layer.humidity_percent(i)));
    if (it != kind_of_class.end()) kind[i] = it->second;
  }
  return kind;
}

// Adds one layer of particles to the sums; aerosol_asymmetry holds scattering times g.
void add_layer(Medium& medium, const LayerInAir& layer, double factor, bool centre, Kinds* kinds,
               KnownPhases& known) {
  std::vector<std::size_t> kind;
  if (kinds != nullptr) kind = kinds_in_air(layer, medium, centre, *kinds);
  MixtureOptics optics;
  double optics_percent = -1.0;
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    const double p = factor * layer.mean_profile(i, centre);
    if (!(p > 0.0)) continue;
    if (layer.humidity_percent(i) != optics_percent) {
      optics_percent = layer.humidity_percent(i);
      optics = known.optics(layer.mixture(i), medium.wavelength_nm);
    }
    for (std::size_t w = 0; w < medium.wavelengths(); ++w) {
      const double scattering = p * optics.scattering_per_km[w];
      medium.aerosol_scattering_per_km(i, w) += scattering;
      medium.aerosol_absorption_per_km(i, w) += p * optics.absorption_per_km[w];
      medium.aerosol_asymmetry(i, w) += scattering * optics.asymmetry[w];
      if (kinds == nullptr) continue;
      Kinds::Kind& own = kinds->kinds[kind[i]];
      own.scattering_per_km(i, w) += scattering;
      if (scattering > 0.0) own.scatters = true;
    }
  }
}

}  // namespace

std::vector<SceneAerosolLayer> scene_aerosol_layers(const Scene& scene) {
  std::vector<SceneAerosolLayer> layers;
  const AerosolOptions& aerosols = scene.aerosols;
  if (aerosols.mixture) {
    for (MixtureLayer& layer : read_mixture_file(*aerosols.mixture).layers) {
      layers.push_back({std::move(layer), false, true});
    }
  } else {
    const bool kept[] = {aerosols.mixing_layer, aerosols.free_troposphere, aerosols.stratosphere};
    for (MixtureLayer& layer : opac_mixture_layers(aerosols.type)) {
      layers.push_back({std::move(layer), false, kept[layers.size()]});
    }
  }
  if (scene.dust_layer.optical_depth_550nm > 0.0) {
    layers.push_back(added_layer(AerosolComponent::kMineralTransported, scene.dust_layer));
  }
  if (scene.volcanic_sulfate.optical_depth_550nm > 0.0) {
    layers.push_back(added_layer(AerosolComponent::kSulfate, scene.volcanic_sulfate));
  }
  return layers;
}

std::vector<std::filesystem::path> aerosol_files(const Scene& scene) {
  if (!scene.aerosols.mixture || replaces_profile(scene)) return {};
  return read_mixture_file(*scene.aerosols.mixture).files;
}

std::vector<double> aerosol_boundaries_km(const std::vector<SceneAerosolLayer>& layers,
                                          double top_km) {
  std::vector<double> heights;
  const auto add = [&](double z_km) {
    const bool inside = z_km > 0.0 && z_km < top_km;
    if (inside && std::ranges::find(heights, z_km) == heights.end()) heights.push_back(z_km);
  };
  for (const SceneAerosolLayer& a : layers) add(a.layer.profile.top_km);
  for (const SceneAerosolLayer& a : layers) add(a.layer.profile.bottom_km);
  return heights;
}

void add_aerosols(Medium& medium, const Scene& scene, std::vector<SceneAerosolLayer> described,
                  bool centre, bool matrices, KnownPhases& known) {
  std::vector<LayerInAir> layers;
  layers.reserve(described.size());
  std::vector<Mixture> mixtures;
  for (const SceneAerosolLayer& layer : described) {
    layers.emplace_back(layer, scene, medium);
    for (Mixture& m : layers.back().mixtures()) mixtures.push_back(std::move(m));
  }
  known.prepare(mixtures, medium.wavelength_nm);
  meet_layer_targets(layers, medium, known);
  if (scene.aerosols.angstrom_exponent) {
    meet_angstrom_exponent(layers, *scene.aerosols.angstrom_exponent, known);
  }
  const double factor = column_factor(layers, scene, known);

  Kinds kinds;
  for (const LayerInAir& layer : layers) {
    if (!layer.takes_part()) continue;
    add_layer(medium, layer, layer.added() ? 1.0 : factor, centre, matrices ? &kinds : nullptr,
              known);
  }
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    for (std::size_t w = 0; w < medium.wavelengths(); ++w) {
      const double scattering = medium.aerosol_scattering_per_km(i, w);
      double& asymmetry = medium.aerosol_asymmetry(i, w);
      asymmetry = scattering > 0.0 ? asymmetry / scattering : 0.0;
    }
  }
  mixtures.clear();
  for (Kinds::Kind& kind : kinds.kinds) {
    if (!kind.scatters) continue;
    mixtures.push_back(std::move(kind.mixture));
    medium.aerosol_kind_scattering_per_km.push_back(std::move(kind.scattering_per_km));
  }
  medium.aerosol_phase = known.phases(mixtures, medium.wavelength_nm);
}

}  // namespace twilight
