#include "atmosphere/two_constituent_air.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "atmosphere/power_law.h"

namespace twilight {
namespace {

// Mean of exp(-z / scale) over a layer.
double mean_density(double bottom_km, double top_km, double scale_height_km) {
  const double x = (top_km - bottom_km) / scale_height_km;
  return std::exp(-bottom_km / scale_height_km) * -std::expm1(-x) / x;
}

// Angles crowd forward, where the function is steep: steps of 0.02 degrees there, 1 at the end.
std::vector<double> matrix_angles_rad() {
  constexpr int kSteps = 1440;
  std::vector<double> angles;
  for (int i = 0; i <= kSteps; ++i) {
    const double t = static_cast<double>(i) / kSteps;
    angles.push_back(std::numbers::pi * t * (0.16 + 0.84 * t));
  }
  angles.back() = std::numbers::pi;
  return angles;
}

PhaseMatrix cornette_shanks_matrix(double g) {
  PhaseMatrix m;
  m.angle_rad = matrix_angles_rad();
  for (const double angle : m.angle_rad) {
    const double mu = std::cos(angle);
    const double s = 1.0 + g * g - 2.0 * g * mu;
    m.p11.push_back(1.5 * (1.0 - g * g) * (1.0 + mu * mu) / ((2.0 + g * g) * s * std::sqrt(s)));
  }
  // Normalised as the linear interpolant.
  double sum = 0;
  for (std::size_t i = 1; i < m.angle_rad.size(); ++i) {
    const double a = m.angle_rad[i - 1], b = m.angle_rad[i], h = b - a;
    const double pa = m.p11[i - 1], slope = (m.p11[i] - pa) / h;
    // Integral of (pa + slope (x - a)) sin x.
    sum += pa * (std::cos(a) - std::cos(b)) + slope * (std::sin(b) - std::sin(a) - h * std::cos(b));
  }
  for (double& p : m.p11) p *= 2.0 / sum;
  m.p12.assign(m.p11.size(), 0.0);
  m.p33 = m.p11;
  m.p34.assign(m.p11.size(), 0.0);
  return m;
}

}  // namespace

double TwoConstituentAir::rayleigh_per_km(double wavelength_nm) const {
  const std::vector<double>&at = rayleigh_wavelength_nm, &beta = rayleigh_scattering_per_km;
  if (at.size() == 1) return beta[0] * std::pow(at[0] / wavelength_nm, 4.0);
  return power_law(at, beta, wavelength_nm);
}

double TwoConstituentAir::mie_per_km(double wavelength_nm) const {
  return mie_scattering_550nm_per_km * std::pow(wavelength_nm / 550.0, -mie_angstrom_exponent);
}

std::optional<TwoConstituentAir> published_air(std::string_view name) {
  TwoConstituentAir air;
  air.rayleigh_wavelength_nm = {440.0, 550.0, 680.0};
  if (name == "scratchapixel" || name == "scratchapixel_code") {
    air.rayleigh_scale_height_km = 7.994;
    air.rayleigh_scattering_per_km = {33.1e-3, 13.5e-3, name == "scratchapixel" ? 5.8e-3 : 3.8e-3};
    air.mie_scattering_550nm_per_km = 21e-3;
    air.mie_single_scattering_albedo = 1 / 1.1;
    return air;
  }
  if (name == "bruneton2008") {
    air.rayleigh_scattering_per_km = {33.1e-3, 13.5e-3, 5.8e-3};
    return air;
  }
  return std::nullopt;
}

Medium layered(const TwoConstituentAir& air, std::span<const double> wavelength_nm,
               std::vector<double> boundary_km, bool phase_matrix) {
  Medium m;
  m.earth_radius_km = air.ground_radius_km;
  m.wavelength_nm.assign(wavelength_nm.begin(), wavelength_nm.end());
  m.boundary_km = std::move(boundary_km);
  m.zero_tables();
  m.depolarisation.assign(m.wavelengths(), 0.0);
  const double g = air.mie_asymmetry;
  const double mean_cosine = 0.6 * g * (4 + g * g) / (2 + g * g);
  for (std::size_t i = 0; i < m.layers(); ++i) {
    const double z0 = m.boundary_km[i], z1 = m.boundary_km[i + 1];
    const double molecules = mean_density(z0, z1, air.rayleigh_scale_height_km);
    const double haze = mean_density(z0, z1, air.mie_scale_height_km);
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      m.air_scattering_per_km(i, w) = molecules * air.rayleigh_per_km(m.wavelength_nm[w]);
      const double scattering = haze * air.mie_per_km(m.wavelength_nm[w]);
      m.aerosol_scattering_per_km(i, w) = scattering;
      m.aerosol_absorption_per_km(i, w) = scattering * (1 / air.mie_single_scattering_albedo - 1);
      m.aerosol_asymmetry(i, w) = mean_cosine;
    }
  }
  if (phase_matrix && air.mie_scattering_550nm_per_km > 0) {
    m.aerosol_phase.assign(1, std::vector<PhaseMatrix>(m.wavelengths(), cornette_shanks_matrix(g)));
    m.aerosol_kind_scattering_per_km.push_back(m.aerosol_scattering_per_km);
  }
  return m;
}

}  // namespace twilight
