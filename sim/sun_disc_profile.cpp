#include "sim/sun_disc_profile.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "sim/gauss_legendre.h"
#include "sim/zenith_grid.h"
#include "solar/limb_darkening.h"

namespace twilight {
namespace {

// Light of the strip at x (in radii, -1..1) across the disc, per unit x, over the whole disc's.
double strip(const LimbDarkening& limb, double x, const std::vector<GaussNode>& nodes) {
  const double half = std::sqrt(std::max(0.0, 1 - x * x));
  double sum = 0;
  for (const GaussNode& g : nodes) {
    const double y = half * std::sin(g.x);  // the substitution tames the limb
    sum += g.weight * half * std::cos(g.x) * limb(std::sqrt(std::max(0.0, 1 - x * x - y * y)));
  }
  return 2 * sum / std::numbers::pi;
}

}  // namespace

std::vector<GaussNode> disc_strips(double wavelength_nm, int strips) {
  const LimbDarkening limb(wavelength_nm);
  const std::vector<GaussNode> across = gauss_legendre(12, 0, std::numbers::pi / 2);
  std::vector<GaussNode> nodes = gauss_legendre(strips, -1, 1);
  double sum = 0;
  for (GaussNode& g : nodes) sum += g.weight *= strip(limb, g.x, across);
  for (GaussNode& g : nodes) g.weight /= sum;
  return nodes;
}

DiscAverage::DiscAverage(std::span<const double> wavelength_nm, double sun_distance_au,
                         std::size_t lanes)
    : lanes_(lanes) {
  const double radius_deg = kSunAngularRadiusRad / sun_distance_au * 180 / std::numbers::pi;
  const double radius = radius_deg / ZenithGrid::kFineStep_deg;  // in fine steps
  reach_ = static_cast<int>(std::ceil(radius)) + 1;
  // Weights of whole fine steps such that a linear function between them is averaged exactly.
  const std::size_t taps = 2 * static_cast<std::size_t>(reach_) + 1;
  weight_.assign(taps * lanes, 0.0F);
  for (std::size_t w = 0; w < wavelength_nm.size(); ++w) {
    std::vector<double> exact(taps, 0.0);
    const std::vector<GaussNode> strips = disc_strips(wavelength_nm[w], 64);
    double square = 0;
    for (const GaussNode& g : strips) square += g.weight * g.x * g.x * radius * radius;
    // Sharing light between two steps spreads it, by 1/6 of their square: the disc is shrunk by as
    // much, so that a parabola is averaged exactly too.
    const double shrunk = radius * std::sqrt(std::max(0.0, 1 - 1 / (6 * square)));
    for (const GaussNode& g : strips) {
      const double at = g.x * shrunk + reach_;
      const double low = std::floor(at), f = at - low;
      exact[static_cast<std::size_t>(low)] += g.weight * (1 - f);
      exact[static_cast<std::size_t>(low) + 1] += g.weight * f;
    }
    for (std::size_t k = 0; k < taps; ++k) {
      weight_[k * lanes + w] = static_cast<float>(exact[k]);
    }
  }
}

void DiscAverage::operator()(std::size_t end, std::span<float> value) const {
  const auto last = static_cast<std::ptrdiff_t>(std::lround(180 / ZenithGrid::kFineStep_deg));
  const std::vector<float> point(value.begin(), value.end());
  const auto stop = std::min<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(end) + reach_, last + 1);
  for (std::ptrdiff_t k = 0; k < stop; ++k) {
    float* out = &value[static_cast<std::size_t>(k) * lanes_];
    std::fill_n(out, lanes_, 0.0F);
    for (std::ptrdiff_t q = -reach_; q <= reach_; ++q) {
      std::ptrdiff_t from = std::abs(k + q);
      if (from > last) from = 2 * last - from;
      const float* in = &point[static_cast<std::size_t>(from) * lanes_];
      const float* weights = &weight_[static_cast<std::size_t>(q + reach_) * lanes_];
      for (std::size_t w = 0; w < lanes_; ++w) out[w] += weights[w] * in[w];
    }
  }
}

}  // namespace twilight
