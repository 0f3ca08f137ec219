#include "output/twilight_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace twilight {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kDaySlope = 1.0 / 3;

double t_of(double zenith_deg) {
  const double dusk = TwilightLayout::kDusk_deg;
  return zenith_deg < dusk ? kDaySlope * zenith_deg : kDaySlope * dusk + (zenith_deg - dusk);
}

}  // namespace

double TwilightLayout::largest_t() const { return t_of(std::acos(geometry().mu_s_min) / kDegree); }

double TwilightLayout::scattering_mu_s(double k) const {
  const double t = (1 - k / static_cast<double>(sizes().mu_s - 1)) * largest_t();
  const double dusk = kDaySlope * kDusk_deg;
  const double zenith_deg = t < dusk ? t / kDaySlope : kDusk_deg + (t - dusk);
  return std::cos(zenith_deg * kDegree);
}

double TwilightLayout::scattering_mu_s_texel(double mu_s) const {
  const double t = t_of(std::acos(std::clamp(mu_s, -1.0, 1.0)) / kDegree);
  return std::max(0.0, 1 - t / largest_t()) * static_cast<double>(sizes().mu_s - 1);
}

std::vector<std::pair<std::string, std::string>> TwilightLayout::formulas() const {
  auto all = Bruneton2017Layout::formulas();
  for (auto& [what, formula] : all) {
    if (what != "scattering u_mu_s") continue;
    formula = fmt::format(
        "max(0, 1 - t(z) / t(acos(mu_s_min))), z = acos(mu_s) in degrees, t(z) = z / 3 for z < "
        "{0}, "
        "{1} + (z - {0}) beyond",
        kDusk_deg, kDaySlope * kDusk_deg);
  }
  return all;
}

}  // namespace twilight
