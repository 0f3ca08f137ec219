// Optics and scattering matrices of mixtures, computed once.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "aerosols/mixtures.h"
#include "atmosphere/phase_matrix.h"

namespace twilight {

/// Keeps the scattering matrices (and the Mie integrals of own components) of component states by
/// wavelength, for scenes that share components: they are what a scene takes longest for. One
/// thread at a time.
class KnownPhases {
 public:
  /// Optics of a mixture at each wavelength in nm: coefficients add up over components, asymmetry
  /// is weighted with scattering (0 where nothing scatters). Throws std::invalid_argument for a
  /// humidity or wavelength outside a component's tables.
  MixtureOptics optics(const Mixture& mixture, std::span<const double> wavelength_nm);

  /// Computes, on all threads, the Mie integrals that optics() would one by one.
  void prepare(std::span<const Mixture> mixtures, std::span<const double> wavelength_nm);

  /// Scattering matrices [mixture][wavelength]: those of the components' states weighted with
  /// scattering, from state to state as the asymmetry goes. Normalised, on phase_angles_rad(); the
  /// mean cosine is the asymmetry of optics() within 3e-4 for OPAC's components. Throws as
  /// optics(), and for a mixture that does not scatter. Takes 0.05 s per wavelength for
  /// continental, 0.5 s for maritime mixtures on one core, where nothing is known.
  std::vector<std::vector<PhaseMatrix>> phases(std::span<const Mixture> mixtures,
                                               std::span<const double> wavelength_nm);

  /// Matrices held.
  std::size_t size() const { return phases_.size(); }

 private:
  using Key = std::tuple<std::string, std::size_t, double>;  ///< identity, state, wavelength

  struct StateShare {
    const MixtureComponent* component;
    std::size_t state;
    double share;
  };

  ComponentOptics component(const MixtureComponent& component, double humidity_percent,
                            double wavelength_nm);
  const ComponentOptics& integral(const MixtureComponent& component, std::size_t state,
                                  double wavelength_nm);
  std::vector<StateShare> state_shares(const Mixture& mixture, double wavelength_nm);
  void learn_phases(std::span<const Mixture> mixtures, std::span<const double> wavelength_nm);

  std::map<Key, ComponentOptics> integrals_;
  std::map<Key, PhaseMatrix> phases_;
};

/// Mixtures of one text scatter alike: the same components in the same proportions between the same
/// states (to 12 digits), whatever their total amount.
std::string mixture_text(const Mixture& mixture);

}  // namespace twilight
