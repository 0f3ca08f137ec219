#include "sim/sunlit_air.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/orders_source.h"
#include "sim/zenith_grid.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr double kFine_rad = ZenithGrid::kFineStep_deg * kRadPerDeg;
// Level paths from near a sharp edge lengthen as the root of the distance from it.
constexpr double kBesideEdge_km[] = {0.001, 0.008, 0.025, 0.06, 0.11};
constexpr double kSameRow_km = 1e-5;

}  // namespace

SunlitAir::SunlitAir(const DirectSunlight& sunlight, const OrdersOptions& options,
                     std::span<const double> wavelength_nm, double top_km, int rows,
                     double from_rad, double to_rad, std::span<const double> edges_km)
    : lanes_(sunlight.lanes()), top_km_(top_km) {
  const double last = std::numbers::pi / kFine_rad;
  first_ = static_cast<std::size_t>(std::clamp(std::floor(from_rad / kFine_rad) - 2, 0.0, last));
  const auto end =
      static_cast<std::size_t>(std::clamp(std::ceil(to_rad / kFine_rad) + 3, 0.0, last + 1));
  count_ = std::max<std::size_t>(2, end + 1 - first_);
  first_ = std::min(first_, ZenithGrid::kFineSize - count_);
  for (int i = 0; i < rows; ++i) {
    const double v = static_cast<double>(i) / (rows - 1);
    altitude_km_.push_back(top_km * v * v);
  }
  for (const double edge : edges_km) {
    for (const double beside : kBesideEdge_km) {
      for (const double z : {edge - beside, edge + beside}) {
        if (z > 0 && z < top_km) altitude_km_.push_back(z);
      }
    }
  }
  std::ranges::sort(altitude_km_);
  const auto repeated =
      std::ranges::unique(altitude_km_, [](double a, double b) { return b - a < kSameRow_km; });
  altitude_km_.erase(repeated.begin(), repeated.end());
  const std::size_t n = altitude_km_.size();
  shadow_rad_.resize(n);
  logarithm_.assign(n * count_ * lanes_, kNight);
  bending_.assign(n * count_, 0.0F);
  const BeamRows beams(sunlight, options, wavelength_nm);
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
    shadow_rad_[i] = sunlight.shadow_zenith_rad(altitude_km_[i]);
    std::vector<float> row(ZenithGrid::kFineSize * lanes_);
    beams.row(altitude_km_[i], row);
    for (std::size_t k = 0; k < count_; ++k) {
      const double chi = std::min(static_cast<double>(first_ + k) * kFine_rad, std::numbers::pi);
      bending_[i * count_ + k] =
          static_cast<float>(chi - sunlight.apparent_zenith_rad(altitude_km_[i], chi));
    }
    for (std::size_t k = 0; k < count_ * lanes_; ++k) {
      const float value = row[first_ * lanes_ + k];
      if (value > 1e-30F) logarithm_[i * count_ * lanes_ + k] = std::log(value);
    }
  });
}

double SunlitAir::step_rad() { return kFine_rad; }

SunlitAir::Place SunlitAir::place(double altitude_km) const {
  const std::size_t n = altitude_km_.size();
  const double z = std::clamp(altitude_km, 0.0, top_km_);
  const auto above = std::ranges::upper_bound(altitude_km_, z) - altitude_km_.begin();
  const auto i = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(above - 1, 0, static_cast<std::ptrdiff_t>(n) - 2));
  Place place;
  place.row = i;
  place.per_km = 1 / (altitude_km_[i + 1] - altitude_km_[i]);
  const double f = place.above = (z - altitude_km_[i]) * place.per_km;
  // The Earth's shadow at this altitude, from the nearly quadratic law of its dip.
  const double d0 = shadow_rad_[i] - shadow_rad_[0], d1 = shadow_rad_[i + 1] - shadow_rad_[0];
  const double shadow = shadow_rad_[0] + std::sqrt(std::max(0.0, (1 - f) * d0 * d0 + f * d1 * d1));
  for (std::size_t r = 0; r < 2; ++r) place.shift_rad[r] = shadow_rad_[i + r] - shadow;
  return place;
}

SunlitAir::Taps SunlitAir::taps(const Place& place, double solar_zenith_rad) const {
  const double low_sun = std::clamp((solar_zenith_rad / kRadPerDeg - 80) / 8, 0.0, 1.0);
  const double shift = low_sun * low_sun * (3 - 2 * low_sun);
  Taps taps;
  double bending[2];
  for (std::size_t r = 0; r < 2; ++r) {
    const double chi = solar_zenith_rad + shift * place.shift_rad[r];
    const double u = std::clamp(chi / kFine_rad - static_cast<double>(first_), 0.0,
                                static_cast<double>(count_) - 1.000001);
    const auto k = static_cast<std::size_t>(u);
    const double g = u - static_cast<double>(k);
    const std::size_t at = (place.row + r) * count_ + k;
    taps.share[r] = static_cast<float>(g);
    const float* here = &logarithm_[at * lanes_];
    taps.logarithm[r][0] = k > 0 ? here - lanes_ : here;
    taps.logarithm[r][1] = here;
    taps.logarithm[r][2] = here + lanes_;
    taps.logarithm[r][3] = k + 2 < count_ ? here + 2 * lanes_ : here + lanes_;
    bending[r] =
        std::lerp(static_cast<double>(bending_[at]), static_cast<double>(bending_[at + 1]), g);
  }
  taps.bending_rad = std::lerp(bending[0], bending[1], place.above);
  return taps;
}

bool SunlitAir::beam(double altitude_km, double solar_zenith_rad, float* beam) const {
  const Place here = place(altitude_km);
  const Taps t = taps(here, solar_zenith_rad);
  const auto f1 = static_cast<float>(here.above), f0 = 1 - f1;
  const float* g = t.share;
  bool lit = false;
  for (std::size_t w = 0; w < lanes_; ++w) {
    const float a = t.logarithm[0][1][w], b = t.logarithm[0][2][w];
    const float c = t.logarithm[1][1][w], e = t.logarithm[1][2][w];
    if (std::min(std::min(a, b), std::min(c, e)) > kNight) {
      beam[w] = std::exp(f0 * (a + g[0] * (b - a)) + f1 * (c + g[1] * (e - c)));
      lit = true;
      continue;
    }
    const auto linear = [](float x) { return x > kNight ? std::exp(x) : 0.0F; };
    beam[w] = f0 * (linear(a) * (1 - g[0]) + linear(b) * g[0]) +
              f1 * (linear(c) * (1 - g[1]) + linear(e) * g[1]);
    lit = lit || beam[w] > 0;
  }
  return lit;
}

}  // namespace twilight
