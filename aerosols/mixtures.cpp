#include "aerosols/mixtures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "aerosols/component_optics.h"
#include "aerosols/component_phase.h"
#include "aerosols/components.h"

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

// One layer of a type before its optics are known.
struct Mixture {
  NumberDensities per_cm3;
  double humidity_percent;
  double bottom_km, top_km, scale_height_km;
};

std::vector<Mixture> mixtures_above_ground(std::string_view type, double humidity_percent) {
  check_humidity(humidity_percent);
  if (type == "none") return {};
  const AerosolType& mixing = find_type(type);
  const double top_km = mixing.mixing_layer_top_km;
  return {
      {mixing.per_cm3, humidity_percent, 0.0, top_km, mixing.scale_height_km},
      {kFreeTroposphere_per_cm3, kTroposphereHumidity_percent, top_km, kTroposphereTop_km,
       kTroposphereScaleHeight_km},
      {kStratosphere_per_cm3, 0.0, kTroposphereTop_km, kStratosphereTop_km,
       std::numeric_limits<double>::infinity()},
  };
}

AerosolLayer layer_of(const Mixture& mixture, std::span<const double> wavelength_nm) {
  AerosolLayer layer;
  layer.bottom_km = mixture.bottom_km;
  layer.top_km = mixture.top_km;
  layer.scale_height_km = mixture.scale_height_km;
  for (const double wavelength : wavelength_nm) {
    double scattering = 0.0, absorption = 0.0, cosine = 0.0;
    for (std::size_t i = 0; i < kAerosolComponents; ++i) {
      const double number = mixture.per_cm3[i];
      if (number == 0.0) continue;
      const ComponentOptics optics =
          component_optics(static_cast<AerosolComponent>(i), mixture.humidity_percent, wavelength);
      scattering += number * optics.scattering_per_km;
      absorption += number * optics.absorption_per_km;
      cosine += number * optics.scattering_per_km * optics.asymmetry;
    }
    layer.scattering_per_km.push_back(scattering);
    layer.absorption_per_km.push_back(absorption);
    layer.asymmetry.push_back(cosine / scattering);
  }
  return layer;
}

// The share of a component state in the scattering of a mixture.
struct StateShare {
  std::size_t state;
  double share;
};

std::vector<StateShare> state_shares(const Mixture& mixture, double wavelength_nm) {
  std::vector<StateShare> shares;
  double total = 0.0;
  for (std::size_t i = 0; i < kAerosolComponents; ++i) {
    const double number = mixture.per_cm3[i];
    if (number == 0.0) continue;
    const auto component = static_cast<AerosolComponent>(i);
    const double humidity = mixture.humidity_percent;
    const double scattering =
        number * component_optics(component, humidity, wavelength_nm).scattering_per_km;
    const auto [low, high, fraction] = humidity_classes(component, humidity);
    if (fraction < 1.0) shares.push_back({low, scattering * (1.0 - fraction)});
    if (fraction > 0.0) shares.push_back({high, scattering * fraction});
    total += scattering;
  }
  for (StateShare& s : shares) s.share /= total;
  return shares;
}

void add_scaled(std::vector<double>& sum, const std::vector<double>& values, double factor) {
  sum.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) sum[i] += factor * values[i];
}

// Integral of the profile over [z0, z1] in km.
double profile_integral_km(const AerosolLayer& layer, double z0_km, double z1_km) {
  const double from = std::max(z0_km, layer.bottom_km);
  const double to = std::min(z1_km, layer.top_km);
  if (to <= from) return 0.0;
  const double scale = layer.scale_height_km;
  if (std::isinf(scale)) return to - from;
  // expm1 keeps thin slices exact.
  return -scale * std::exp(-from / scale) * std::expm1(-(to - from) / scale);
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

std::vector<AerosolLayer> opac_aerosol_layers(std::string_view type,
                                              double relative_humidity_percent,
                                              std::span<const double> wavelength_nm) {
  std::vector<AerosolLayer> layers;
  for (const Mixture& mixture : mixtures_above_ground(type, relative_humidity_percent)) {
    layers.push_back(layer_of(mixture, wavelength_nm));
  }
  return layers;
}

std::vector<std::vector<PhaseMatrix>> opac_aerosol_phases(std::string_view type,
                                                          double relative_humidity_percent,
                                                          std::span<const double> wavelength_nm) {
  const std::vector<Mixture> mixtures = mixtures_above_ground(type, relative_humidity_percent);
  // Layers share states: each (state, wavelength) is integrated once.
  std::vector<StateAtWavelength> wanted;
  const auto place_of = [&](std::size_t state, double wavelength) {
    const auto same = [&](const StateAtWavelength& w) {
      return w.state == state && w.wavelength_nm == wavelength;
    };
    return static_cast<std::size_t>(std::ranges::find_if(wanted, same) - wanted.begin());
  };
  for (const double wavelength : wavelength_nm) {
    for (const Mixture& mixture : mixtures) {
      for (const StateShare& s : state_shares(mixture, wavelength)) {
        if (place_of(s.state, wavelength) == wanted.size()) wanted.push_back({s.state, wavelength});
      }
    }
  }
  const std::vector<PhaseMatrix> integrated = component_phases(wanted);

  std::vector<std::vector<PhaseMatrix>> phases(mixtures.size());
  for (std::size_t i = 0; i < mixtures.size(); ++i) {
    for (const double wavelength : wavelength_nm) {
      PhaseMatrix sum;
      for (const StateShare& s : state_shares(mixtures[i], wavelength)) {
        const PhaseMatrix& of_state = integrated[place_of(s.state, wavelength)];
        sum.angle_rad = of_state.angle_rad;
        add_scaled(sum.p11, of_state.p11, s.share);
        add_scaled(sum.p12, of_state.p12, s.share);
        add_scaled(sum.p33, of_state.p33, s.share);
        add_scaled(sum.p34, of_state.p34, s.share);
      }
      phases[i].push_back(std::move(sum));
    }
  }
  return phases;
}

double mean_profile(const AerosolLayer& layer, double z0_km, double z1_km) {
  if (!(std::isfinite(z0_km) && std::isfinite(z1_km) && z0_km < z1_km)) {
    throw std::invalid_argument("height interval " + std::to_string(z0_km) + ".." +
                                std::to_string(z1_km) +
                                " km must be finite with its lower end below its upper end");
  }
  return profile_integral_km(layer, z0_km, z1_km) / (z1_km - z0_km);
}

double optical_depth_between(const AerosolLayer& layer, std::size_t wavelength, double z0_km,
                             double z1_km) {
  if (!(z0_km <= z1_km)) {
    throw std::invalid_argument("height interval " + std::to_string(z0_km) + ".." +
                                std::to_string(z1_km) + " km must have its lower end first");
  }
  const double extinction =
      layer.scattering_per_km.at(wavelength) + layer.absorption_per_km.at(wavelength);
  return extinction * profile_integral_km(layer, z0_km, z1_km);
}

double optical_depth(const AerosolLayer& layer, std::size_t wavelength) {
  return optical_depth_between(layer, wavelength, layer.bottom_km, layer.top_km);
}

}  // namespace twilight
