#include "output/bruneton2017_layout.h"

#include <algorithm>
#include <cmath>

namespace twilight {
namespace {

double intervals(std::size_t texels) { return static_cast<double>(texels - 1); }

}  // namespace

Bruneton2017Layout::Bruneton2017Layout(const LayoutSizes& sizes, const LayoutGeometry& geometry)
    : TableLayout(sizes, geometry) {}

double Bruneton2017Layout::to_top_km(double r, double mu) const {
  const double top = geometry().top_radius_km;
  // The larger root, in the form that does not cancel for views upwards.
  const double root = std::sqrt(std::max(0.0, r * r * mu * mu + (top - r) * (top + r)));
  const double d = mu > 0 ? (top - r) * (top + r) / (r * mu + root) : root - r * mu;
  return std::max(0.0, d);
}

double Bruneton2017Layout::mu_of_top(double r, double d) const {
  const double top = geometry().top_radius_km;
  if (d <= 0) return 1.0;
  return std::clamp(((top - r) * (top + r) - d * d) / (2 * r * d), -1.0, 1.0);
}

RadiusCosine Bruneton2017Layout::transmittance_at(TexelPoint texel) const {
  const double rho = horizon_km() * texel.y / intervals(sizes().transmittance_r);
  const double bottom = geometry().bottom_radius_km;
  const double r = std::min(std::sqrt(rho * rho + bottom * bottom), geometry().top_radius_km);
  const double least = geometry().top_radius_km - r, most = rho + horizon_km();
  const double x = texel.x / intervals(sizes().transmittance_mu);
  return {r, mu_of_top(r, least + x * (most - least))};
}

TexelPoint Bruneton2017Layout::transmittance_texel(RadiusCosine view) const {
  const double rho = rho_km(view.r_km);
  const double least = geometry().top_radius_km - view.r_km, most = rho + horizon_km();
  const double x = (to_top_km(view.r_km, view.cosine) - least) / (most - least);
  return {x * intervals(sizes().transmittance_mu),
          rho / horizon_km() * intervals(sizes().transmittance_r)};
}

RadiusCosine Bruneton2017Layout::irradiance_at(TexelPoint texel) const {
  const auto& [bottom, top, mu_s_min] = geometry();
  return {std::lerp(bottom, top, texel.y / intervals(sizes().irradiance_r)),
          std::clamp(2 * texel.x / intervals(sizes().irradiance_mu_s) - 1, -1.0, 1.0)};
}

TexelPoint Bruneton2017Layout::irradiance_texel(RadiusCosine sun) const {
  const auto& [bottom, top, mu_s_min] = geometry();
  return {0.5 * (sun.cosine + 1) * intervals(sizes().irradiance_mu_s),
          (sun.r_km - bottom) / (top - bottom) * intervals(sizes().irradiance_r)};
}

double Bruneton2017Layout::scattering_mu(double r, double j) const {
  const double half = 0.5 * static_cast<double>(sizes().mu), rho = rho_km(r);
  if (meets_ground_texel(j)) {
    const double least = r - geometry().bottom_radius_km;
    const double d = least + (rho - least) * (1 - j / (half - 1));
    if (d <= 0) return -1.0;
    return std::clamp(-(rho * rho + d * d) / (2 * r * d), -1.0, 1.0);
  }
  const double least = geometry().top_radius_km - r, most = rho + horizon_km();
  return mu_of_top(r, least + (most - least) * (j - half) / (half - 1));
}

double Bruneton2017Layout::scattering_mu_texel(double r, double mu, bool meets_ground) const {
  const double half = 0.5 * static_cast<double>(sizes().mu), rho = rho_km(r);
  if (meets_ground) {
    const double bottom = geometry().bottom_radius_km;
    const double least = r - bottom;
    const double root = std::sqrt(std::max(0.0, r * r * (mu * mu - 1) + bottom * bottom));
    const double d = -r * mu - root;
    const double x = rho > least ? (d - least) / (rho - least) : 0.0;
    return (half - 1) * (1 - x);
  }
  const double least = geometry().top_radius_km - r, most = rho + horizon_km();
  return half + (half - 1) * (to_top_km(r, mu) - least) / (most - least);
}

double Bruneton2017Layout::largest_a() const {
  const auto& [bottom, top, mu_s_min] = geometry();
  return (to_top_km(bottom, mu_s_min) - (top - bottom)) / (horizon_km() - (top - bottom));
}

double Bruneton2017Layout::scattering_mu_s(double k) const {
  const auto& [bottom, top, mu_s_min] = geometry();
  const double x = k / intervals(sizes().mu_s), A = largest_a();
  const double a = std::min((A - x * A) / (1 + x * A), A);
  return mu_of_top(bottom, top - bottom + a * (horizon_km() - (top - bottom)));
}

double Bruneton2017Layout::scattering_mu_s_texel(double mu_s) const {
  const auto& [bottom, top, mu_s_min] = geometry();
  const double a = (to_top_km(bottom, mu_s) - (top - bottom)) / (horizon_km() - (top - bottom));
  return std::max(1 - a / largest_a(), 0.0) / (1 + a) * intervals(sizes().mu_s);
}

std::vector<std::pair<std::string, std::string>> Bruneton2017Layout::formulas() const {
  return {
      {"texels", "texel i of n stands at the unit coordinate u = i / (n - 1), i = 0 .. n - 1"},
      {"H", "sqrt(top_radius^2 - bottom_radius^2); rho = sqrt(r^2 - bottom_radius^2)"},
      {"transmittance u_mu",
       "(d - (top_radius - r)) / (rho + H - (top_radius - r)), d = distance "
       "from r under mu to top_radius"},
      {"transmittance u_r", "rho / H"},
      {"irradiance u_mu_s", "(mu_s + 1) / 2"},
      {"irradiance u_r", "(r - bottom_radius) / (top_radius - bottom_radius)"},
      {"scattering u_r", "rho / H"},
      {"scattering u_mu, rays that meet the ground",
       "texel (n_mu / 2 - 1) (1 - (d - d_min) / (d_max - d_min)), d = distance to the ground, "
       "d_min "
       "= r - bottom_radius, d_max = rho"},
      {"scattering u_mu, other rays",
       "texel n_mu / 2 + (n_mu / 2 - 1) (d - d_min) / (d_max - d_min), d = distance to top_radius, "
       "d_min = top_radius - r, d_max = rho + H"},
      {"scattering u_mu_s",
       "max(1 - a / A, 0) / (1 + a), a = (d - d_min) / (d_max - d_min), d = distance from "
       "bottom_radius under mu_s to top_radius, d_min = top_radius - bottom_radius, d_max = H, A = "
       "the a of mu_s_min (the public code of today; its first version had A = -2 mu_s_min "
       "bottom_radius / (d_max - d_min))"},
      {"scattering u_nu", "(nu + 1) / 2"},
      {"scattering texture", "x = i_nu n_mu_s + i_mu_s, y = i_mu, z = i_r; x runs fastest"}};
}

}  // namespace twilight
