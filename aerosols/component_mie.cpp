#include "aerosols/component_mie.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "aerosols/mie.h"

namespace twilight {

ComponentOptics integrate_spheres(const SizeDistribution& sizes, std::complex<double> index,
                                  double wavelength_nm, int radii_per_efold) {
  if (radii_per_efold < 1) {
    throw std::invalid_argument("radii per e-fold " + std::to_string(radii_per_efold) +
                                " must be at least 1");
  }
  require_sizes(sizes);
  if (!(wavelength_nm > 0.0)) {
    throw std::invalid_argument("wavelength " + std::to_string(wavelength_nm) +
                                " nm must be above 0");
  }
  // 1 um^2 cm^-3 = 1e-8 cm^-1 = 1e-3 km^-1.
  constexpr double kPerKmPerSquareUm = 1e-3;
  const double wave_number_per_um = 2.0 * std::numbers::pi / (wavelength_nm * 1e-3);
  const double log_span = std::log(sizes.largest_radius_um / sizes.smallest_radius_um);
  const int radii = static_cast<int>(std::ceil(log_span * radii_per_efold));
  const double step = log_span / radii;

  double scattering = 0.0, absorption = 0.0, cosine = 0.0;
  for (int i = 0; i < radii; ++i) {
    const double radius_um = sizes.smallest_radius_um * std::exp((i + 0.5) * step);
    const double number = sizes.per_log_radius(radius_um);
    const MieEfficiencies q = mie_efficiencies(wave_number_per_um * radius_um, index);
    const double area = std::numbers::pi * radius_um * radius_um * number;
    scattering += area * q.scattering;
    absorption += area * q.absorption;
    cosine += area * q.scattering * q.asymmetry;
  }
  if (!(scattering > 0.0)) {
    throw std::invalid_argument("the size distribution holds no particles that scatter");
  }
  return {.scattering_per_km = scattering * step * kPerKmPerSquareUm,
          .absorption_per_km = absorption * step * kPerKmPerSquareUm,
          .asymmetry = cosine / scattering};
}

ComponentOptics integrate_component(const ComponentState& state, double wavelength_nm,
                                    int radii_per_efold) {
  return integrate_spheres(state.sizes, refractive_index(state, wavelength_nm), wavelength_nm,
                           radii_per_efold);
}

}  // namespace twilight
