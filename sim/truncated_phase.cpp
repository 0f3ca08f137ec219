#include "sim/truncated_phase.h"

#include <cmath>

#include "aerosols/phase_expansion.h"

namespace twilight {

AerosolKinds aerosol_kinds(const Medium& medium) {
  AerosolKinds kinds;
  const std::size_t layers = medium.layers(), wavelengths = medium.wavelengths();
  if (!medium.aerosol_phase.empty()) {
    kinds.scattering_per_km = medium.aerosol_kind_scattering_per_km;
    for (const auto& kind : medium.aerosol_phase) {
      auto& pointers = kinds.phase.emplace_back();
      for (const PhaseMatrix& matrix : kind) pointers.push_back(&matrix);
    }
    return kinds;
  }
  for (std::size_t i = 0; i < layers; ++i) {
    std::vector<double> asymmetry(wavelengths);
    bool scatters = false;
    for (std::size_t w = 0; w < wavelengths; ++w) {
      asymmetry[w] = medium.aerosol_asymmetry(i, w);
      scatters = scatters || medium.aerosol_scattering_per_km(i, w) > 0;
    }
    if (!scatters) continue;
    std::size_t kind = 0;
    const auto same = [&](const std::vector<double>& other) {
      for (std::size_t w = 0; w < wavelengths; ++w) {
        if (std::abs(other[w] - asymmetry[w]) > 1e-12) return false;
      }
      return true;
    };
    while (kind < kinds.asymmetry.size() && !same(kinds.asymmetry[kind])) ++kind;
    if (kind == kinds.asymmetry.size()) {
      kinds.asymmetry.push_back(asymmetry);
      kinds.scattering_per_km.emplace_back(layers, wavelengths);
    }
    for (std::size_t w = 0; w < wavelengths; ++w) {
      kinds.scattering_per_km[kind](i, w) = medium.aerosol_scattering_per_km(i, w);
    }
  }
  return kinds;
}

std::vector<TruncatedPhase> truncate_phases(const AerosolKinds& kinds, int degree,
                                            std::size_t lanes) {
  std::vector<TruncatedPhase> result;
  const auto degrees = static_cast<std::size_t>(degree) + 1;
  for (std::size_t q = 0; q < kinds.scattering_per_km.size(); ++q) {
    TruncatedPhase& phase = result.emplace_back();
    for (auto* v : {&phase.a1, &phase.b1, &phase.a2, &phase.a3}) v->assign(degrees * lanes, 0.0);
    phase.peak.assign(lanes, 0.0);
    const bool table = q < kinds.phase.size();
    const std::size_t wavelengths = table ? kinds.phase[q].size() : kinds.asymmetry[q].size();
    for (std::size_t w = 0; w < wavelengths; ++w) {
      std::vector<double> a1(degrees + 1), a2(degrees + 1), a3(degrees + 1), b1(degrees + 1);
      if (table) {
        const PhaseExpansion full = expand(*kinds.phase[q][w], degree + 1);
        a1 = full.alpha1;
        a2 = full.alpha2;
        a3 = full.alpha3;
        // P^l_02 = -d^l_02.
        for (std::size_t l = 0; l <= degrees; ++l) b1[l] = -full.beta1[l];
      } else {
        for (std::size_t l = 0; l <= degrees; ++l) {
          a1[l] = (2 * static_cast<double>(l) + 1) *
                  std::pow(kinds.asymmetry[q][w], static_cast<double>(l));
        }
      }
      const double f = a1[degrees] / (2 * static_cast<double>(degrees) + 1);
      const bool depolarises = !table;
      phase.peak[w] = f;
      for (std::size_t l = 0; l < degrees; ++l) {
        const double delta = f * (2 * static_cast<double>(l) + 1);
        phase.a1[l * lanes + w] = (a1[l] - delta) / (1 - f);
        if (depolarises || l < 2) continue;
        phase.b1[l * lanes + w] = b1[l] / (1 - f);
        phase.a2[l * lanes + w] = (a2[l] - delta) / (1 - f);
        phase.a3[l * lanes + w] = (a3[l] - delta) / (1 - f);
      }
    }
  }
  return result;
}

}  // namespace twilight
