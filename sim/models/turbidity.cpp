#include "sim/models/turbidity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <vector>

#include "sim/scene_model.h"

namespace twilight {
namespace {

constexpr double kTurbidityNm = 550.0;

TurbidityDepths depths_at(const Medium& medium, std::size_t wavelength) {
  TurbidityDepths depth;
  for (std::size_t i = 0; i < medium.layers(); ++i) {
    const double km = medium.boundary_km[i + 1] - medium.boundary_km[i];
    depth.molecules += km * medium.air_scattering_per_km(i, wavelength);
    depth.haze += km * (medium.aerosol_scattering_per_km(i, wavelength) +
                        medium.aerosol_absorption_per_km(i, wavelength));
  }
  return depth;
}

double between(double low, double high, double share) {
  if (!(low > 0 && high > 0)) return std::lerp(low, high, share);
  return std::exp(std::lerp(std::log(low), std::log(high), share));
}

}  // namespace

TurbidityDepths turbidity_depths(const Scene& scene) {
  Scene air = scene;
  air.solver = SolverOptions{};
  air.solver.method = "orders";  // the scene's own air, and no model that asks for its turbidity
  air.quality.reset();
  air.budget = BudgetOptions{};
  air.sun.disc_average.reset();
  air.aerosols.phase = "henyey-greenstein";  // scattering matrices are not asked for
  air.spectrum.solved_nm.clear();
  if (!air.atmosphere.optical_layers) {
    air.spectrum.wavelengths_nm = {kTurbidityNm};
    return depths_at(build_scene_model(air).medium, 0);
  }
  const std::vector<double>& nm = air.spectrum.wavelengths_nm;
  const auto above = std::ranges::lower_bound(nm, kTurbidityNm);
  if (above == nm.end() || (above == nm.begin() && *above != kTurbidityNm)) {
    throw std::invalid_argument(fmt::format(
        "key 'preetham.turbidity' = auto: must be given (1..100) where spectrum.wavelengths_nm, {}"
        "..{}, does not enclose {} nm, at which it is defined",
        nm.front(), nm.back(), kTurbidityNm));
  }
  const Medium medium = build_scene_model(air).medium;
  const auto high = static_cast<std::size_t>(above - nm.begin());
  if (*above == kTurbidityNm) return depths_at(medium, high);
  const TurbidityDepths a = depths_at(medium, high - 1), b = depths_at(medium, high);
  const double share = std::log(kTurbidityNm / nm[high - 1]) / std::log(nm[high] / nm[high - 1]);
  return {between(a.molecules, b.molecules, share), between(a.haze, b.haze, share)};
}

double scene_turbidity(const Scene& scene) {
  const TurbidityDepths depth = turbidity_depths(scene);
  if (!(depth.molecules > 0)) {
    throw std::invalid_argument(
        "key 'preetham.turbidity' = auto: must be given (1..100) where the air has no molecules");
  }
  return (depth.molecules + depth.haze) / depth.molecules;
}

}  // namespace twilight
