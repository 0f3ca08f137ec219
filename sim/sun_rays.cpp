#include "sim/sun_rays.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "atmosphere/refraction.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kPerShell = 3;  // intervals of a shell's cubic
constexpr std::size_t kSteep = 128;   // intervals of rays from the ground
constexpr std::size_t kBins = 2048;
constexpr double kLeastRise = 1e-3;  // of n r over r, where refraction would duct rays
// Below this solar zenith angle sin(a) / sin(chi) is da/dchi, to 1e-7.
constexpr double kNearZenithRad = 0.01;

// Weights of Lagrange's cubic through 0, 1, 2, 3.
struct Cubic {
  double w[4];
  explicit Cubic(double t)
      : w{-(t - 1) * (t - 2) * (t - 3) / 6, t * (t - 2) * (t - 3) / 2, -t * (t - 1) * (t - 3) / 2,
          t * (t - 1) * (t - 2) / 6} {}
};

// Lagrange's cubic through four values of a monotonic function, between those next to t (0..3), as
// the function is: where a thin opaque layer lies on a clear one the cubic would swing below 0.
double monotonic_cubic(double t, const float* value) {
  const Cubic c(t);
  const auto k = static_cast<std::size_t>(std::clamp(t, 0.0, 2.0));
  const double least = std::min(value[k], value[k + 1]), most = std::max(value[k], value[k + 1]);
  return std::clamp(c.w[0] * value[0] + c.w[1] * value[1] + c.w[2] * value[2] + c.w[3] * value[3],
                    least, most);
}

// First of the four nodes about a position in a row of n.
std::size_t stencil(double position, std::size_t n) {
  const auto cell = static_cast<std::size_t>(std::max(position, 0.0));
  return std::min(cell > 0 ? cell - 1 : 0, n - 4);
}

}  // namespace

SunRays::SunRays(const Medium& medium, std::size_t wavelength, BendingTable bending,
                 bool refractive_spreading)
    : radius_km_(medium.earth_radius_km),
      top_km_(medium.top_km()),
      bending_(std::move(bending)),
      spreading_(refractive_spreading) {
  tabulate_depth(medium, wavelength);
  if (!medium.vertical_filter_optical_depth.empty()) {
    filter_depth_ = medium.vertical_filter_optical_depth[wavelength];
  }
}

double SunRays::x_km(double v_km, double perigee_v_km) const {
  return std::sqrt(std::max(0.0, (v_km - perigee_v_km) * (v_km + perigee_v_km + 2 * radius_km_)));
}

void SunRays::tabulate_depth(const Medium& medium, std::size_t wavelength) {
  const RefractedRays rays(medium, wavelength);
  const auto boundaries = rays.boundaries();
  const auto shells = rays.shells();
  std::size_t n = 0;
  while (n < shells.size() && shells[n].layer != RefractedRays::kAboveModel) ++n;
  shell_.resize(n + 1);
  double v = boundaries[0].v_km;
  for (std::size_t j = 0; j < n; ++j) {
    const double r = radius_km_ + boundaries[j].height_km;
    const double thick = boundaries[j + 1].height_km - boundaries[j].height_km;
    const double log_r = std::log1p(thick / r);
    double m = shells[j].exponent, length = shells[j].length_factor;
    double next = v + (radius_km_ + v) * std::expm1(m * log_r);
    if (!(next - v >= kLeastRise * thick) || v != boundaries[j].v_km) {
      next = std::max(boundaries[j + 1].v_km, v + kLeastRise * thick);
      const double n_index = shells[j].length_factor * m;  // 1 / n
      m = std::log1p((next - v) / (radius_km_ + v)) / log_r;
      length = n_index / m;
    } else {
      next = boundaries[j + 1].v_km;
    }
    shell_[j] = {v, r, m, medium.extinction_per_km(shells[j].layer, wavelength) * length};
    v = next;
  }
  shell_[n] = {v, radius_km_ + boundaries[n].height_km, 1.0, 0.0};

  // Cumulative depth of one ray, from the top down to the lowest boundary above its perigee.
  const std::size_t grazing = n * kPerShell + 1;
  grazing_.assign((n + 1) * grazing, 0.0F);
  steep_.assign((n + 1) * (kSteep + 1), 0.0F);
  const auto fill = [&](double perigee_v, std::size_t lowest, std::vector<float>& table,
                        std::size_t width, std::size_t node) {
    double depth = 0, above = x_km(shell_[n].v_km, perigee_v);
    for (std::size_t j = n; j-- > lowest;) {
      const double x = x_km(shell_[j].v_km, perigee_v);
      const double dv = shell_[j + 1].v_km - shell_[j].v_km;
      if (x + above > 0) {
        depth += shell_[j].depth * dv * (shell_[j + 1].v_km + shell_[j].v_km + 2 * radius_km_) /
                 (x + above);
      }
      table[j * width + node] = static_cast<float>(std::min(depth, 1e6));
      above = x;
    }
  };
  for (std::size_t j = 0; j < n; ++j) {
    const double top = shell_[j + 1].v_km, thick = top - shell_[j].v_km;
    for (std::size_t s = 0; s < kPerShell; ++s) {
      const double q = 1 - static_cast<double>(s) / kPerShell;
      fill(s == 0 ? shell_[j].v_km : top - q * q * thick, s == 0 ? j : j + 1, grazing_, grazing,
           j * kPerShell + s);
    }
  }
  fill(shell_[n].v_km, n, grazing_, grazing, n * kPerShell);
  const double ground = radius_km_ + shell_[0].v_km;
  for (std::size_t s = 0; s <= kSteep; ++s) {
    const double root = static_cast<double>(s) / kSteep;
    const double cosine = root * root;
    const double sine = std::sqrt((1 - cosine) * (1 + cosine));
    fill(shell_[0].v_km - ground * cosine * cosine / (1 + sine), 0, steep_, kSteep + 1, s);
  }

  altitude_bin_.assign(kBins, 0);
  v_bin_.assign(kBins, 0);
  const double v0 = shell_[0].v_km, dv = shell_[n].v_km - v0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const double f = static_cast<double>(bin) / kBins;
    unsigned& a = altitude_bin_[bin];
    a = bin > 0 ? altitude_bin_[bin - 1] : 0;
    while (a + 1 < n && shell_[a + 1].r_km <= radius_km_ + f * top_km_) ++a;
    unsigned& b = v_bin_[bin];
    b = bin > 0 ? v_bin_[bin - 1] : 0;
    while (b + 1 < n && shell_[b + 1].v_km <= v0 + f * dv) ++b;
  }
}

std::size_t SunRays::shell_of_altitude(double altitude_km) const {
  const auto bin = static_cast<std::size_t>(altitude_km / top_km_ * kBins);
  std::size_t j = altitude_bin_[std::min(bin, kBins - 1)];
  while (j > 0 && shell_[j].r_km > radius_km_ + altitude_km) --j;
  while (j + 2 < shell_.size() && shell_[j + 1].r_km <= radius_km_ + altitude_km) ++j;
  return j;
}

std::size_t SunRays::shell_of_v(double v_km) const {
  const double v0 = shell_.front().v_km, dv = shell_.back().v_km - v0;
  const auto bin = static_cast<std::size_t>(std::max(0.0, (v_km - v0) / dv * kBins));
  std::size_t j = v_bin_[std::min(bin, kBins - 1)];
  while (j > 0 && shell_[j].v_km > v_km) --j;
  while (j + 2 < shell_.size() && shell_[j + 1].v_km <= v_km) ++j;
  return j;
}

double SunRays::depth_above(std::size_t row, std::size_t perigee_shell, double perigee_v) const {
  if (row + 1 == shell_.size()) return 0;
  if (perigee_v < shell_[0].v_km) {
    const double ground = radius_km_ + shell_[0].v_km;
    const double cosine = x_km(shell_[0].v_km, perigee_v) / ground;
    const double f = std::sqrt(std::min(cosine, 1.0)) * kSteep;
    const std::size_t i = stencil(f, kSteep + 1);
    return monotonic_cubic(f - static_cast<double>(i), &steep_[row * (kSteep + 1) + i]);
  }
  const Shell& s = shell_[perigee_shell];
  const double top = shell_[perigee_shell + 1].v_km;
  const double q = std::sqrt(std::clamp((top - perigee_v) / (top - s.v_km), 0.0, 1.0));
  const std::size_t width = (shell_.size() - 1) * kPerShell + 1;
  static_assert(kPerShell == 3);
  return monotonic_cubic((1 - q) * kPerShell, &grazing_[row * width + perigee_shell * kPerShell]);
}

double SunRays::shadow_zenith_rad(double altitude_km) const {
  const double f = std::sqrt(std::clamp(altitude_km / top_km_, 0.0, 1.0)) *
                   static_cast<double>(bending_.rows - 1);
  if (!bending_.refracting()) {
    return kPi - std::asin(radius_km_ / (radius_km_ + std::clamp(altitude_km, 0.0, top_km_)));
  }
  const std::size_t i = stencil(f, bending_.rows);
  const Cubic c(f - static_cast<double>(i));
  const double* h = &bending_.horizon_rad[i];
  return c.w[0] * h[0] + c.w[1] * h[1] + c.w[2] * h[2] + c.w[3] * h[3];
}

bool SunRays::bending(double altitude_km, double solar_zenith_rad, Bending& out) const {
  const double horizon = shadow_zenith_rad(altitude_km);
  const double x2 = 1 - solar_zenith_rad / horizon;
  const bool lit = x2 >= 0;
  out = {0.0, 1.0};
  if (!bending_.refracting()) return lit;
  const double f = std::sqrt(std::clamp(altitude_km / top_km_, 0.0, 1.0)) *
                   static_cast<double>(bending_.rows - 1);
  const double g = (lit ? std::sqrt(x2) : 0.0) * static_cast<double>(bending_.columns - 1);
  const std::size_t i = stencil(f, bending_.rows), k = stencil(g, bending_.columns);
  const Cubic row(f - static_cast<double>(i)), column(g - static_cast<double>(k));
  double bent = 0, derivative = 0;
  for (std::size_t a = 0; a < 4; ++a) {
    const float* p = &bending_.bending_rad[(i + a) * bending_.columns + k];
    const float* d = &bending_.derivative[(i + a) * bending_.columns + k];
    double row_bent = 0, row_derivative = 0;
    for (std::size_t b = 0; b < 4; ++b) {
      row_bent += column.w[b] * p[b];
      row_derivative += column.w[b] * d[b];
    }
    bent += row.w[a] * row_bent;
    derivative += row.w[a] * row_derivative;
  }
  out = {bent,
         std::clamp(derivative, BendingTable::kLeastDerivative, BendingTable::kMostDerivative)};
  return lit;
}

double SunRays::apparent_zenith_rad(double altitude_km, double solar_zenith_rad) const {
  Bending b;
  const bool lit = bending(altitude_km, solar_zenith_rad, b);
  const double chi = lit ? solar_zenith_rad : shadow_zenith_rad(altitude_km);
  return std::clamp(chi - b.bending_rad, 0.0, kPi);
}

double SunRays::v_km(double altitude_km, std::size_t shell) const {
  const Shell& s = shell_[shell];
  // (1 + t)^m - 1 to the third order: t < 0.003 wherever m is not 1.
  const double t = (radius_km_ + altitude_km - s.r_km) / s.r_km;
  const double m = s.exponent;
  return s.v_km +
         (radius_km_ + s.v_km) * t * m * (1 + (m - 1) * t * (0.5 + (m - 2) * t * (1.0 / 6)));
}

bool SunRays::attenuation(double altitude_km, double solar_zenith_rad, double& attenuation) const {
  const double h = std::clamp(altitude_km, 0.0, top_km_);
  Bending b;
  if (!bending(h, solar_zenith_rad, b)) return false;
  const double apparent = std::clamp(solar_zenith_rad - b.bending_rad, 0.0, kPi);

  const std::size_t j = shell_of_altitude(h);
  const Shell& here = shell_[j];
  const double v = v_km(h, j);
  const double u = radius_km_ + v;
  const double sine = std::sin(apparent), cosine = std::cos(apparent);
  const double x = u * std::abs(cosine);
  double perigee_v = v - x * x / (u * (1 + sine));
  const bool down = cosine < 0;
  if (down) perigee_v = std::max(perigee_v, shell_[0].v_km);
  const std::size_t i = perigee_v < shell_[0].v_km ? 0 : std::min(shell_of_v(perigee_v), j);

  const double next = shell_[j + 1].v_km;
  const double x_next = x_km(next, perigee_v);
  const double rise = next - v;
  double depth = depth_above(j + 1, i, perigee_v);
  if (x_next + x > 0) depth += here.depth * rise * (next + v + 2 * radius_km_) / (x_next + x);
  if (down) {
    const double to_perigee =
        depth_above(i + 1, i, perigee_v) + shell_[i].depth * x_km(shell_[i + 1].v_km, perigee_v);
    depth = std::max(depth, 2 * to_perigee - depth);
  }
  attenuation = depth + filter_depth_;
  if (spreading_ && bending_.refracting()) {
    attenuation -= std::log(spreading(u / (radius_km_ + h), solar_zenith_rad, b));
  }
  return true;
}

double SunRays::spreading(double index, double solar_zenith_rad, const Bending& b) const {
  const double sine = std::sin(std::clamp(solar_zenith_rad - b.bending_rad, 0.0, kPi));
  const double sines =
      solar_zenith_rad < kNearZenithRad ? b.derivative : sine / std::sin(solar_zenith_rad);
  return index * index * std::max(sines * b.derivative, 1e-30);
}

double SunRays::spreading(double altitude_km, double solar_zenith_rad) const {
  const double h = std::clamp(altitude_km, 0.0, top_km_);
  Bending b;
  if (!bending(h, solar_zenith_rad, b)) return 0.0;
  if (!bending_.refracting()) return 1.0;
  return spreading((radius_km_ + v_km(h, shell_of_altitude(h))) / (radius_km_ + h),
                   solar_zenith_rad, b);
}

}  // namespace twilight
