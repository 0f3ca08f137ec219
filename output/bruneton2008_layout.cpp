#include "output/bruneton2008_layout.h"

#include <algorithm>
#include <cmath>

namespace twilight {
namespace {

constexpr double kLeastMuS = kBrunetonLowestMuS;
// Of the transmittance table: mu from -0.15, and the angle whose tangent stretches it.
constexpr double kLeastMu = -0.15, kStretch = 1.5;

double centre(double texel, std::size_t size) { return (texel + 0.5) / static_cast<double>(size); }
double texel(double u, std::size_t size) { return u * static_cast<double>(size) - 0.5; }

}  // namespace

Bruneton2008Layout::Bruneton2008Layout(const LayoutSizes& sizes, double bottom_radius_km,
                                       double top_radius_km)
    : TableLayout(sizes, {bottom_radius_km, top_radius_km, kLeastMuS}) {}

BrunetonSphere Bruneton2008Layout::sphere() const {
  return {geometry().bottom_radius_km, geometry().top_radius_km};
}

RadiusCosine Bruneton2008Layout::transmittance_at(TexelPoint at) const {
  const auto& [bottom, top, mu_s_min] = geometry();
  const double v = centre(at.y, sizes().transmittance_r);
  const double u = centre(at.x, sizes().transmittance_mu);
  const double mu = kLeastMu + std::tan(kStretch * u) / std::tan(kStretch) * (1 - kLeastMu);
  return {bottom + v * v * (top - bottom), std::clamp(mu, -1.0, 1.0)};
}

TexelPoint Bruneton2008Layout::transmittance_texel(RadiusCosine view) const {
  const auto& [bottom, top, mu_s_min] = geometry();
  const double u =
      std::atan((view.cosine - kLeastMu) / (1 - kLeastMu) * std::tan(kStretch)) / kStretch;
  return {texel(u, sizes().transmittance_mu),
          texel(std::sqrt(std::max(0.0, view.r_km - bottom) / (top - bottom)),
                sizes().transmittance_r)};
}

RadiusCosine Bruneton2008Layout::irradiance_at(TexelPoint at) const {
  const auto& [bottom, top, mu_s_min] = geometry();
  return {std::lerp(bottom, top, centre(at.y, sizes().irradiance_r)),
          kLeastMuS + (1 - kLeastMuS) * centre(at.x, sizes().irradiance_mu_s)};
}

TexelPoint Bruneton2008Layout::irradiance_texel(RadiusCosine sun) const {
  const auto& [bottom, top, mu_s_min] = geometry();
  return {texel((sun.cosine - kLeastMuS) / (1 - kLeastMuS), sizes().irradiance_mu_s),
          texel((sun.r_km - bottom) / (top - bottom), sizes().irradiance_r)};
}

double Bruneton2008Layout::scattering_mu(double r, double j) const {
  return bruneton_view(sphere(), r, j, sizes().mu).mu;
}

double Bruneton2008Layout::scattering_mu_texel(double r, double mu, bool meets_ground) const {
  return bruneton_mu_texel(sphere(), r, {mu, meets_ground}, sizes().mu);
}

double Bruneton2008Layout::scattering_mu_s(double k) const {
  return bruneton_mu_s(k, sizes().mu_s);
}

double Bruneton2008Layout::scattering_mu_s_texel(double mu_s) const {
  return bruneton_mu_s_texel(mu_s, sizes().mu_s);
}

std::vector<std::pair<std::string, std::string>> Bruneton2008Layout::formulas() const {
  return {{"texels",
           "scattering: texel i of n stands at u = i / (n - 1); transmittance and irradiance: at u "
           "= (i "
           "+ 1/2) / n"},
          {"H", "sqrt(top_radius^2 - bottom_radius^2); rho = sqrt(r^2 - bottom_radius^2)"},
          {"transmittance u_mu", "atan((mu + 0.15) / 1.15 tan(1.5)) / 1.5"},
          {"transmittance u_r", "sqrt((r - bottom_radius) / (top_radius - bottom_radius))"},
          {"irradiance u_mu_s", "(mu_s + 0.2) / 1.2"},
          {"irradiance u_r", "(r - bottom_radius) / (top_radius - bottom_radius)"},
          {"scattering u_r", "rho / H"},
          {"scattering u_mu, rays that meet the ground",
           "texel (n_mu / 2 - 1) (1 - d / rho), d = distance to the ground"},
          {"scattering u_mu, other rays",
           "texel n_mu / 2 + (n_mu / 2 - 1) d / (rho + H), d = distance to top_radius"},
          {"scattering u_mu_s", "(1 - exp(-3 mu_s - 0.6)) / (1 - exp(-3.6))"},
          {"scattering u_nu", "(nu + 1) / 2"},
          {"scattering texture", "x = i_nu n_mu_s + i_mu_s, y = i_mu, z = i_r; x runs fastest"}};
}

}  // namespace twilight
