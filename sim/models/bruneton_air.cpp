#include "sim/models/bruneton_air.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "aerosols/cornette_shanks.h"
#include "aerosols/henyey_greenstein.h"

namespace twilight {

double bruneton_rayleigh_phase(double cos_angle) {
  return 3.0 / (16.0 * std::numbers::pi) * (1.0 + cos_angle * cos_angle);
}

BrunetonAir::BrunetonAir(const SceneModel& model) : two_(model.two_constituent_air) {
  const Medium& m = model.medium;
  const std::size_t W = m.wavelengths();
  sphere_.ground_radius_km = m.earth_radius_km;
  sphere_.top_radius_km = m.earth_radius_km + m.top_km();
  if (two_) {
    constexpr int kShells = 64;
    for (int i = 0; i <= kShells; ++i) {
      const double x = static_cast<double>(i) / kShells;
      shell_radius_.push_back(m.earth_radius_km + m.top_km() * x * x);
    }
    for (const double nm : m.wavelength_nm) {
      rayleigh_.push_back(two_->rayleigh_per_km(nm));
      mie_.push_back(two_->mie_per_km(nm));
    }
    asymmetry_.assign(W, two_->mie_asymmetry);
    return;
  }
  medium_ = m;
  boundaries_are_free_ = false;
  for (const double z : m.boundary_km) shell_radius_.push_back(m.earth_radius_km + z);
  for (std::size_t w = 0; w < W; ++w) {
    rayleigh_.push_back(m.air_scattering_per_km(0, w));
    mie_.push_back(m.aerosol_scattering_per_km(0, w));
    double scattering = 0, forward = 0;
    for (std::size_t i = 0; i < m.layers(); ++i) {
      const double s =
          m.aerosol_scattering_per_km(i, w) * (m.boundary_km[i + 1] - m.boundary_km[i]);
      scattering += s;
      forward += s * m.aerosol_asymmetry(i, w);
    }
    asymmetry_.push_back(scattering > 0 ? forward / scattering : 0.0);
  }
}

double BrunetonAir::mie_phase(std::size_t wavelength, double cos_angle) const {
  const double g = asymmetry_[wavelength];
  return two_ ? cornette_shanks(cos_angle, g) : henyey_greenstein(cos_angle, g);
}

void BrunetonAir::scattering(double radius_km, std::span<double> rayleigh,
                             std::span<double> mie) const {
  const double z = std::max(0.0, radius_km - sphere_.ground_radius_km);
  if (two_) {
    const double molecules = std::exp(-z / two_->rayleigh_scale_height_km);
    const double haze = std::exp(-z / two_->mie_scale_height_km);
    for (std::size_t w = 0; w < wavelengths(); ++w) {
      rayleigh[w] = molecules * rayleigh_[w];
      mie[w] = haze * mie_[w];
    }
    return;
  }
  const auto above = std::ranges::upper_bound(medium_.boundary_km, z) - medium_.boundary_km.begin();
  const auto layer = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(above, 1, static_cast<std::ptrdiff_t>(medium_.layers())) - 1);
  for (std::size_t w = 0; w < wavelengths(); ++w) {
    rayleigh[w] = medium_.air_scattering_per_km(layer, w);
    mie[w] = medium_.aerosol_scattering_per_km(layer, w);
  }
}

// A piece of a ray inside one shell: t is the distance from the ray's lowest point, and the squared
// radius is impact_squared + t^2.
void BrunetonAir::add_piece(double impact_squared, double from, double to, std::size_t shell,
                            std::span<double, 2> densities, Columns& out) const {
  if (!two_) {
    for (std::size_t w = 0; w < wavelengths(); ++w) {
      out.rayleigh[w] += (to - from) * medium_.air_scattering_per_km(shell, w);
      out.mie[w] += (to - from) * medium_.aerosol_scattering_per_km(shell, w);
      out.extinction[w] += (to - from) * medium_.extinction_per_km(shell, w);
    }
    return;
  }
  // Gauss-Legendre, three points.
  constexpr std::array<double, 3> kNode = {-0.7745966692414834, 0.0, 0.7745966692414834};
  constexpr std::array<double, 3> kWeight = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  for (std::size_t i = 0; i < 3; ++i) {
    const double t = 0.5 * (from + to) + 0.5 * (to - from) * kNode[i];
    const double z = std::sqrt(std::max(0.0, impact_squared + t * t)) - sphere_.ground_radius_km;
    densities[0] += kWeight[i] * (to - from) * std::exp(-z / two_->rayleigh_scale_height_km);
    densities[1] += kWeight[i] * (to - from) * std::exp(-z / two_->mie_scale_height_km);
  }
}

void BrunetonAir::columns(double radius_km, double mu, double from_km, double to_km,
                          Columns& out) const {
  const std::size_t W = wavelengths();
  for (std::vector<double>* v : {&out.rayleigh, &out.mie, &out.extinction}) v->assign(W, 0.0);
  std::array<double, 2> densities{};
  const double impact_squared = radius_km * radius_km * (1.0 - mu * mu);
  const double t0 = radius_km * mu + from_km, t1 = radius_km * mu + to_km;
  // Both sides of the lowest point, each from its low end to its high one.
  const std::array<std::array<double, 2>, 2> sides = {
      {{std::max(0.0, t0), std::max(0.0, t1)}, {std::max(0.0, -t1), std::max(0.0, -t0)}}};
  for (const auto& [low, high] : sides) {
    if (high <= low) continue;
    const double r = std::sqrt(std::max(0.0, impact_squared + low * low));
    const auto above = std::upper_bound(shell_radius_.begin(), shell_radius_.end(), r);
    auto shell = static_cast<std::size_t>(std::max<std::ptrdiff_t>(
        0, std::min<std::ptrdiff_t>(above - shell_radius_.begin(),
                                    static_cast<std::ptrdiff_t>(shell_radius_.size()) - 1) -
               1));
    for (double t = low; t < high; ++shell) {
      double end = high;
      if (shell + 2 < shell_radius_.size()) {
        const double q = shell_radius_[shell + 1];
        end = std::min(high, std::sqrt(std::max(0.0, q * q - impact_squared)));
      }
      if (end > t) add_piece(impact_squared, t, end, shell, densities, out);
      t = std::max(t, end);
      if (shell + 2 >= shell_radius_.size()) break;
    }
  }
  if (!two_) return;
  for (std::size_t w = 0; w < W; ++w) {
    out.rayleigh[w] = densities[0] * rayleigh_[w];
    out.mie[w] = densities[1] * mie_[w];
    out.extinction[w] = out.rayleigh[w] + out.mie[w] / two_->mie_single_scattering_albedo;
  }
}

}  // namespace twilight
