#include "aerosols/mixtures.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>

#include "aerosols/component_optics.h"
#include "aerosols/components.h"
#include "aerosols/known_phases.h"

namespace twilight {
namespace {

// Particles per cm^3 of every component, in the order of AerosolComponent.
using NumberDensities = std::array<double, kAerosolComponents>;

struct AerosolType {
  std::string_view name;
  double mixing_layer_top_km;
  double scale_height_km;
  NumberDensities per_cm3;  // at the ground
};

// Number densities and layers of OPAC (Hess, Koepke & Schult 1998), as carried by the
// programs illumina (combination_types), AeroMix (layer tops, background) and libRadtran 2.0.2
// (mixing-layer scale heights). Desert: 2 km as libRadtran; AeroMix has 8 km. Arctic: 99 km.
// The MITR layer of OPAC has no thickness in its ten types.
//      INSO  WASO  SOOT  SSAM  SSCM  MINM  MIAM  MICM  MITR  SUSO
constexpr std::array<AerosolType, 10> kTypes = {{
    {"continental_clean", 2.0, 8.0, {0.15, 2600, 0, 0, 0, 0, 0, 0, 0, 0}},
    {"continental_average", 2.0, 8.0, {0.4, 7000, 8300, 0, 0, 0, 0, 0, 0, 0}},
    {"continental_polluted", 2.0, 8.0, {0.6, 15700, 34300, 0, 0, 0, 0, 0, 0, 0}},
    {"urban", 2.0, 8.0, {1.5, 28000, 130000, 0, 0, 0, 0, 0, 0, 0}},
    {"desert", 6.0, 2.0, {0, 2000, 0, 0, 0, 269.5, 30.5, 0.142, 0, 0}},
    {"maritime_clean", 2.0, 1.0, {0, 1500, 0, 20, 0.0032, 0, 0, 0, 0, 0}},
    {"maritime_polluted", 2.0, 1.0, {0, 3800, 5180, 20, 0.0032, 0, 0, 0, 0, 0}},
    {"maritime_tropical", 2.0, 1.0, {0, 590, 0, 10, 0.0013, 0, 0, 0, 0, 0}},
    {"arctic", 2.0, 99.0, {0.01, 1300, 5300, 1.9, 0, 0, 0, 0, 0, 0}},
    {"antarctic", 10.0, 8.0, {0, 0, 0, 0.047, 0, 0, 0, 0, 0.0053, 42.9}},
}};

// The background above every mixing layer; free-tropospheric densities extrapolated to z = 0.
constexpr double kTroposphereTop_km = 12.0;
constexpr double kTroposphereScaleHeight_km = 8.0;
constexpr double kTroposphereHumidity_percent = 50.0;
constexpr NumberDensities kFreeTroposphere_per_cm3 = {0.0013, 438, 294, 0, 0, 0, 0, 0, 0, 0};
constexpr double kStratosphereTop_km = 35.0;
constexpr NumberDensities kStratosphere_per_cm3 = {0, 0, 0, 0, 0, 0, 0, 0, 0, 3};

const AerosolType& find_type(std::string_view name) {
  const auto found = std::ranges::find(kTypes, name, &AerosolType::name);
  if (found != kTypes.end()) return *found;
  std::string message = "unknown aerosol type '" + std::string(name) + "'; known: none";
  for (const AerosolType& type : kTypes) message += ", " + std::string(type.name);
  throw std::invalid_argument(message);
}

void check_humidity(double percent) {
  if (!(percent >= 0.0 && percent <= kTableLargestHumidity_percent)) {
    throw std::invalid_argument("relative humidity " + std::to_string(percent) +
                                " % of the aerosol is outside 0..99 %");
  }
}

MixtureLayer layer_of(const NumberDensities& per_cm3, double bottom_km, double top_km,
                      double scale_height_km) {
  MixtureLayer layer;
  layer.profile.bottom_km = bottom_km;
  layer.profile.top_km = top_km;
  layer.profile.scale_height_km = scale_height_km;
  for (std::size_t i = 0; i < kAerosolComponents; ++i) {
    if (per_cm3[i] == 0.0) continue;
    layer.amounts.push_back({opac_component(static_cast<AerosolComponent>(i)), per_cm3[i]});
  }
  return layer;
}

MixtureLayer at_humidity(MixtureLayer layer, double percent) {
  layer.humidity.source = LayerHumidity::Source::kPercent;
  layer.humidity.percent = percent;
  return layer;
}

std::vector<Mixture> mixtures_of(std::string_view type, double humidity_percent) {
  check_humidity(humidity_percent);
  std::vector<Mixture> mixtures;
  for (MixtureLayer& layer : opac_mixture_layers(type)) {
    const bool scene = layer.humidity.source == LayerHumidity::Source::kScene;
    mixtures.push_back(
        {std::move(layer.amounts), scene ? humidity_percent : layer.humidity.percent});
  }
  return mixtures;
}

}  // namespace

std::vector<std::string_view> aerosol_types() {
  std::vector<std::string_view> names;
  for (const AerosolType& type : kTypes) names.push_back(type.name);
  return names;
}

std::array<double, kAerosolComponents> ground_number_densities_per_cm3(std::string_view type) {
  return find_type(type).per_cm3;
}

std::vector<MixtureLayer> opac_mixture_layers(std::string_view type) {
  if (type == "none") return {};
  const AerosolType& mixing = find_type(type);
  const double top_km = mixing.mixing_layer_top_km;
  return {layer_of(mixing.per_cm3, 0.0, top_km, mixing.scale_height_km),
          at_humidity(layer_of(kFreeTroposphere_per_cm3, top_km, kTroposphereTop_km,
                               kTroposphereScaleHeight_km),
                      kTroposphereHumidity_percent),
          at_humidity(layer_of(kStratosphere_per_cm3, kTroposphereTop_km, kStratosphereTop_km,
                               std::numeric_limits<double>::infinity()),
                      0.0)};
}

std::vector<AerosolLayer> opac_aerosol_layers(std::string_view type,
                                              double relative_humidity_percent,
                                              std::span<const double> wavelength_nm) {
  const std::vector<Mixture> mixtures = mixtures_of(type, relative_humidity_percent);
  const std::vector<MixtureLayer> described = opac_mixture_layers(type);
  std::vector<AerosolLayer> layers(mixtures.size());
  KnownPhases known;
  for (std::size_t k = 0; k < mixtures.size(); ++k) {
    static_cast<MixtureOptics&>(layers[k]) = known.optics(mixtures[k], wavelength_nm);
    layers[k].profile = described[k].profile;
  }
  return layers;
}

std::vector<std::vector<PhaseMatrix>> opac_aerosol_phases(std::string_view type,
                                                          double relative_humidity_percent,
                                                          std::span<const double> wavelength_nm) {
  return KnownPhases().phases(mixtures_of(type, relative_humidity_percent), wavelength_nm);
}

double optical_depth_between(const AerosolLayer& layer, std::size_t wavelength, double z0_km,
                             double z1_km) {
  if (!(z0_km <= z1_km)) {
    throw std::invalid_argument("height interval " + std::to_string(z0_km) + ".." +
                                std::to_string(z1_km) + " km must have its lower end first");
  }
  const double extinction =
      layer.scattering_per_km.at(wavelength) + layer.absorption_per_km.at(wavelength);
  return extinction * layer.profile.integral_km(z0_km, z1_km);
}

double optical_depth(const AerosolLayer& layer, std::size_t wavelength) {
  return optical_depth_between(layer, wavelength, layer.profile.bottom_km, layer.profile.top_km);
}

}  // namespace twilight
