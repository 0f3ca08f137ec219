#include "output/table_layout.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "output/bruneton2008_layout.h"
#include "output/bruneton2017_layout.h"
#include "output/twilight_layout.h"

namespace twilight {

LayoutSizes LayoutSizes::scaled(double factor) const {
  const auto times = [&](std::size_t n) {
    return std::max<std::size_t>(
        4, static_cast<std::size_t>(std::lround(factor * static_cast<double>(n))));
  };
  LayoutSizes s;
  s.transmittance_mu = times(transmittance_mu);
  s.transmittance_r = times(transmittance_r);
  s.r = times(r);
  s.mu = 2 * (times(mu) / 2);
  s.mu_s = times(mu_s);
  s.nu = factor == 1.0 ? nu : times(nu - 1) + 1;
  s.irradiance_mu_s = times(irradiance_mu_s);
  s.irradiance_r = times(irradiance_r);
  return s;
}

TableLayout::TableLayout(const LayoutSizes& sizes, const LayoutGeometry& geometry)
    : sizes_(sizes), geometry_(geometry) {
  const auto& [bottom, top, mu_s_min] = geometry;
  if (!(bottom > 0 && top > bottom && mu_s_min >= -1 && mu_s_min < 0)) {
    throw std::invalid_argument(fmt::format(
        "table geometry {} km, {} km, mu_s_min {}: radii must increase, mu_s_min be in [-1, 0)",
        bottom, top, mu_s_min));
  }
  for (const std::size_t n : {sizes.transmittance_mu, sizes.transmittance_r, sizes.r, sizes.mu / 2,
                              sizes.mu_s, sizes.nu, sizes.irradiance_mu_s, sizes.irradiance_r}) {
    if (n < 2 || n > 4096) {
      throw std::invalid_argument("table sizes: each axis must have 2..4096 texels (mu 4)");
    }
  }
  if (sizes.mu % 2 != 0) throw std::invalid_argument("table sizes: mu must be even");
  horizon_km_ = std::sqrt((top - bottom) * (top + bottom));
}

double TableLayout::rho_km(double r_km) const {
  const double bottom = geometry_.bottom_radius_km;
  return std::sqrt(std::max(0.0, (r_km - bottom) * (r_km + bottom)));
}

double TableLayout::scattering_r_km(double k) const {
  const double rho = horizon_km_ * k / static_cast<double>(sizes_.r - 1);
  const double bottom = geometry_.bottom_radius_km;
  return std::min(std::sqrt(rho * rho + bottom * bottom), geometry_.top_radius_km);
}

double TableLayout::scattering_r_texel(double r_km) const {
  return rho_km(r_km) / horizon_km_ * static_cast<double>(sizes_.r - 1);
}

double TableLayout::scattering_nu(double l) const {
  return std::clamp(2 * l / static_cast<double>(sizes_.nu - 1) - 1, -1.0, 1.0);
}

double TableLayout::scattering_nu_texel(double nu) const {
  return 0.5 * (nu + 1) * static_cast<double>(sizes_.nu - 1);
}

bool TableLayout::meets_ground(double r_km, double mu) const {
  return mu < 0 &&
         r_km * r_km * (mu * mu - 1) + geometry_.bottom_radius_km * geometry_.bottom_radius_km >= 0;
}

const std::vector<std::string>& layout_names() {
  static const std::vector<std::string> names = {"bruneton2008", "bruneton2017", "twilight"};
  return names;
}

std::unique_ptr<TableLayout> make_layout(std::string_view name, const LayoutSizes& sizes,
                                         double bottom_radius_km, double top_radius_km,
                                         double largest_solar_zenith_deg) {
  const double limit = largest_solar_zenith_deg;
  if (limit != 0 && !(limit > 90 && limit <= 120)) {
    throw std::invalid_argument(fmt::format(
        "--mu-s-min-deg {}: must be a solar zenith angle above 90 and up to 120", limit));
  }
  const auto cosine = [&](double own) {
    return std::cos((limit == 0 ? own : limit) * std::numbers::pi / 180);
  };
  const LayoutGeometry geometry{bottom_radius_km, top_radius_km, cosine(102)};
  if (name == "bruneton2017") return std::make_unique<Bruneton2017Layout>(sizes, geometry);
  if (name == "bruneton2008") {
    if (limit != 0) {
      throw std::invalid_argument(
          "--mu-s-min-deg: the formula of bruneton2008 has its limit, mu_s = -0.2, built in");
    }
    return std::make_unique<Bruneton2008Layout>(sizes, bottom_radius_km, top_radius_km);
  }
  if (name == "twilight") {
    return std::make_unique<TwilightLayout>(
        sizes, LayoutGeometry{bottom_radius_km, top_radius_km, cosine(108.5)});
  }
  throw std::invalid_argument(
      fmt::format("layout '{}': must be one of {}", name, fmt::join(layout_names(), ", ")));
}

}  // namespace twilight
