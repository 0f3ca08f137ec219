#include "aerosols/known_phases.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <set>
#include <stdexcept>

namespace twilight {
namespace {

void add_scaled(std::vector<double>& sum, const std::vector<double>& values, double factor) {
  sum.resize(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) sum[i] += factor * values[i];
}

HumidityClasses classes_of(const MixtureComponent& component, double humidity_percent) {
  const std::span<const double> held = component.humidities_percent();
  if (held.size() > 1 && !(humidity_percent >= held.front() && humidity_percent <= held.back())) {
    throw std::invalid_argument(
        fmt::format("component '{}': relative humidity {} % is outside its own, {}..{} %",
                    component.name(), humidity_percent, held.front(), held.back()));
  }
  return humidity_classes(held, humidity_percent);
}

}  // namespace

const ComponentOptics& KnownPhases::integral(const MixtureComponent& component, std::size_t state,
                                             double wavelength_nm) {
  const Key key{component.identity(), state, wavelength_nm};
  const auto it = integrals_.find(key);
  if (it != integrals_.end()) return it->second;
  return integrals_.emplace(key, component.integrate(state, wavelength_nm)).first->second;
}

ComponentOptics KnownPhases::component(const MixtureComponent& component, double humidity_percent,
                                       double wavelength_nm) {
  const HumidityClasses c = classes_of(component, humidity_percent);
  if (const auto known = component.tabulated(humidity_percent, wavelength_nm)) return *known;
  const ComponentOptics low = integral(component, c.low, wavelength_nm);
  if (c.low == c.high || c.fraction == 0.0) return low;
  return between_humidities(low, integral(component, c.high, wavelength_nm), c.fraction,
                            component.humidities_percent()[c.low] == 0.0);
}

MixtureOptics KnownPhases::optics(const Mixture& mixture, std::span<const double> wavelength_nm) {
  MixtureOptics sum;
  for (const double wavelength : wavelength_nm) {
    double scattering = 0.0, absorption = 0.0, cosine = 0.0;
    for (const auto& [component_ptr, amount] : mixture.amounts) {
      if (amount == 0.0) continue;
      const ComponentOptics optics =
          component(*component_ptr, mixture.relative_humidity_percent, wavelength);
      scattering += amount * optics.scattering_per_km;
      absorption += amount * optics.absorption_per_km;
      cosine += amount * optics.scattering_per_km * optics.asymmetry;
    }
    sum.scattering_per_km.push_back(scattering);
    sum.absorption_per_km.push_back(absorption);
    sum.asymmetry.push_back(scattering > 0.0 ? cosine / scattering : 0.0);
  }
  return sum;
}

void KnownPhases::prepare(std::span<const Mixture> mixtures,
                          std::span<const double> wavelength_nm) {
  std::map<Key, const MixtureComponent*> wanted;
  for (const Mixture& mixture : mixtures) {
    for (const auto& [component, amount] : mixture.amounts) {
      const HumidityClasses c = classes_of(*component, mixture.relative_humidity_percent);
      for (const double nm : wavelength_nm) {
        if (component->tabulated(mixture.relative_humidity_percent, nm)) continue;
        for (const std::size_t state : {c.low, c.high}) {
          const Key key{component->identity(), state, nm};
          if (!integrals_.contains(key)) wanted[key] = component.get();
        }
      }
    }
  }
  const std::vector<std::pair<Key, const MixtureComponent*>> all(wanted.begin(), wanted.end());
  std::vector<ComponentOptics> computed(all.size());
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
    computed[i] = all[i].second->integrate(std::get<1>(all[i].first), std::get<2>(all[i].first));
  });
  for (std::size_t i = 0; i < all.size(); ++i) integrals_.emplace(all[i].first, computed[i]);
}

std::vector<KnownPhases::StateShare> KnownPhases::state_shares(const Mixture& mixture,
                                                               double wavelength_nm) {
  std::vector<StateShare> shares;
  double total = 0.0;
  const double humidity = mixture.relative_humidity_percent;
  for (const auto& [component_ptr, amount] : mixture.amounts) {
    if (amount == 0.0) continue;
    const double scattering =
        amount * component(*component_ptr, humidity, wavelength_nm).scattering_per_km;
    const auto [low, high, fraction] = classes_of(*component_ptr, humidity);
    if (fraction < 1.0) shares.push_back({component_ptr.get(), low, scattering * (1.0 - fraction)});
    if (fraction > 0.0) shares.push_back({component_ptr.get(), high, scattering * fraction});
    total += scattering;
  }
  if (!(total > 0.0)) throw std::invalid_argument("a mixture without particles that scatter");
  for (StateShare& s : shares) s.share /= total;
  return shares;
}

void KnownPhases::learn_phases(std::span<const Mixture> mixtures,
                               std::span<const double> wavelength_nm) {
  std::set<Key> seen;
  std::vector<Key> keys;
  std::vector<SpheresAtWavelength> spheres;
  for (const double wavelength : wavelength_nm) {
    for (const Mixture& mixture : mixtures) {
      for (const StateShare& s : state_shares(mixture, wavelength)) {
        Key key{s.component->identity(), s.state, wavelength};
        if (phases_.contains(key) || !seen.insert(key).second) continue;
        if (auto phase = s.component->tabulated_phase(s.state, wavelength)) {
          phases_.emplace(std::move(key), std::move(*phase));
        } else {
          keys.push_back(std::move(key));
          spheres.push_back(s.component->spheres(s.state, wavelength));
        }
      }
    }
  }
  std::vector<PhaseMatrix> computed = sphere_phases(spheres);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    phases_.emplace(std::move(keys[i]), std::move(computed[i]));
  }
}

std::vector<std::vector<PhaseMatrix>> KnownPhases::phases(std::span<const Mixture> mixtures,
                                                          std::span<const double> wavelength_nm) {
  prepare(mixtures, wavelength_nm);
  learn_phases(mixtures, wavelength_nm);
  std::vector<std::vector<PhaseMatrix>> result(mixtures.size());
  for (std::size_t i = 0; i < mixtures.size(); ++i) {
    for (const double wavelength : wavelength_nm) {
      PhaseMatrix sum;
      for (const StateShare& s : state_shares(mixtures[i], wavelength)) {
        const PhaseMatrix& of_state = phases_.at(Key{s.component->identity(), s.state, wavelength});
        sum.angle_rad = of_state.angle_rad;
        add_scaled(sum.p11, of_state.p11, s.share);
        add_scaled(sum.p12, of_state.p12, s.share);
        add_scaled(sum.p33, of_state.p33, s.share);
        add_scaled(sum.p34, of_state.p34, s.share);
      }
      result[i].push_back(std::move(sum));
    }
  }
  return result;
}

std::string mixture_text(const Mixture& mixture) {
  std::string text;
  double first = 0.0;
  for (const auto& [component, amount] : mixture.amounts) {
    if (amount == 0.0) continue;
    if (first == 0.0) first = amount;
    const HumidityClasses c = classes_of(*component, mixture.relative_humidity_percent);
    text += fmt::format("{} {:.11e} {} {} {:.11e}\n", component->identity(), amount / first, c.low,
                        c.high, c.fraction);
  }
  return text;
}

}  // namespace twilight
