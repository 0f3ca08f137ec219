#include "sim/monte_carlo_sunlight.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/monte_carlo_slant_sum.h"

namespace twilight {
namespace {

constexpr std::size_t kAltitudes = 96, kAngles = 352;
constexpr double kMarginRad = 1e-4;
constexpr double kThickShellKm = 1.0;

// Weights of the cubic through four neighbouring nodes 0..3 at position t, and of its derivative.
void cubic_weights(double t, double* w, double* dw) {
  const double a = t, b = t - 1, c = t - 2, d = t - 3;
  w[0] = -b * c * d / 6;
  w[1] = a * c * d / 2;
  w[2] = -a * b * d / 2;
  w[3] = a * b * c / 6;
  if (dw == nullptr) return;
  dw[0] = -(c * d + b * d + b * c) / 6;
  dw[1] = (c * d + a * d + a * c) / 2;
  dw[2] = -(b * d + a * d + a * b) / 2;
  dw[3] = (b * c + a * c + a * b) / 6;
}

std::size_t stencil(double position, std::size_t nodes) {
  const double first = std::floor(position) - 1;
  return static_cast<std::size_t>(std::clamp(first, 0.0, static_cast<double>(nodes - 4)));
}

}  // namespace

struct MonteCarloSunlight::Interpolation {
  std::size_t altitude = 0, angle = 0;
  std::array<double, 4> altitude_weight{}, angle_weight{}, angle_slope{};
  double slope_factor = 0;  // d(coordinate) / d(cos chi)
};

MonteCarloSunlight::MonteCarloSunlight(const Medium& m, bool spreading)
    : radius_km_(m.earth_radius_km),
      top_km_(m.top_km()),
      wavelengths_(m.wavelengths()),
      spreading_(spreading) {
  for (std::size_t w = 0; w < wavelengths_; ++w) {
    rays_.emplace_back(m, w);
    refracting_ = refracting_ || rays_.back().refracting();
    filter_.push_back(m.vertical_filter_optical_depth.empty()
                          ? 1.0
                          : std::exp(-m.vertical_filter_optical_depth[w]));
  }
  shell_height_km_.push_back(0);
  std::vector<std::size_t> layer_of_shell;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    layer_shell_.push_back(layer_of_shell.size());
    const double a = m.boundary_km[i], b = m.boundary_km[i + 1];
    double refractivity = 0;
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      refractivity = std::max(refractivity, m.refractivity(i, w));
    }
    const int parts =
        refractivity > 1e-6 ? static_cast<int>(std::ceil((b - a) / kThickShellKm)) : 1;
    for (int p = 1; p <= parts; ++p) {
      shell_height_km_.push_back(p == parts ? b : a + (b - a) * p / parts);
      layer_of_shell.push_back(i);
    }
  }
  shells_ = layer_of_shell.size();
  layer_shell_.push_back(shells_);
  nr_km_.resize(wavelengths_ * (shells_ + 1));
  nr_squared_.resize(nr_km_.size());
  weight_.resize(nr_km_.size());
  density_.resize(wavelengths_ * shells_);
  for (std::size_t w = 0; w < wavelengths_; ++w) {
    double* nr = &nr_km_[w * (shells_ + 1)];
    double* density = &density_[w * shells_];
    for (std::size_t k = 0; k <= shells_; ++k) {
      nr[k] = rays_[w].nr_km(shell_height_km_[k]);
      nr_squared_[w * (shells_ + 1) + k] = nr[k] * nr[k];
    }
    for (std::size_t k = 0; k < shells_; ++k) {
      density[k] = m.extinction_per_km(layer_of_shell[k], w) *
                   (shell_height_km_[k + 1] - shell_height_km_[k]) / (nr[k + 1] - nr[k]);
    }
    double* weight = &weight_[w * (shells_ + 1)];
    for (std::size_t k = 1; k <= shells_; ++k) {
      weight[k] = density[k - 1] - (k < shells_ ? density[k] : 0.0);
    }
  }
  if (refracting_) fill_table();
}

void MonteCarloSunlight::fill_table() {
  table_.assign(kAltitudes * kAngles * wavelengths_, 0.0F);
  last_cos_chi_.resize(kAltitudes);
  const double pi = std::acos(-1.0);
  tbb::parallel_for(std::size_t{0}, kAltitudes, [&](std::size_t i) {
    const double u = static_cast<double>(i) / (kAltitudes - 1);
    const double h = top_km_ * u * u;
    double last = 0;
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      const double sine = std::min(1.0, rays_[w].nr_km(0) / rays_[w].nr_km(h));
      const double cosine = -std::sqrt(1 - sine * sine);
      last = std::max(last, std::atan2(sine, cosine) + rays_[w].bending_rad(h, cosine, sine));
    }
    last_cos_chi_[i] = std::cos(std::min(pi, last + kMarginRad));
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      double bend = 0, slope = 0, chi_before = 0;
      for (std::size_t j = kAngles; j-- > 0;) {
        const double eta = static_cast<double>(j) / (kAngles - 1);
        const double cos_chi = last_cos_chi_[i] + (1 - last_cos_chi_[i]) * eta * eta;
        const double chi = std::acos(std::min(1.0, cos_chi));
        const auto error = [&](double a) {
          return a + rays_[w].bending_rad(h, std::cos(a), std::sin(a)) - chi;
        };
        // Secant, from the neighbouring angle's bending.
        double a0 = chi - bend - slope * (chi - chi_before), e0 = error(a0);
        double a1 = a0 - 0.8 * e0, e1 = error(a1);
        for (int n = 0; n < 30 && std::abs(e1) > 1e-11 && e1 != e0; ++n) {
          const double a2 = a1 - e1 * (a1 - a0) / (e1 - e0);
          a0 = a1;
          e0 = e1;
          a1 = a2;
          e1 = error(a1);
        }
        const double now = chi - a1;
        slope = chi > chi_before ? (now - bend) / (chi - chi_before) : 0;
        bend = now;
        chi_before = chi;
        table_[(i * kAngles + j) * wavelengths_ + w] =
            static_cast<float>(2 * std::sin(0.5 * (chi + a1)) * std::sin(0.5 * (chi - a1)));
      }
    }
  });
}

bool MonteCarloSunlight::locate(double h, double cos_chi, Interpolation& at) const {
  const double q = std::sqrt(std::clamp(h / top_km_, 0.0, 1.0)) * (kAltitudes - 1);
  at.altitude = stencil(q, kAltitudes);
  cubic_weights(q - static_cast<double>(at.altitude), at.altitude_weight.data(), nullptr);
  double last = 0;
  for (std::size_t i = 0; i < 4; ++i)
    last += at.altitude_weight[i] * last_cos_chi_[at.altitude + i];
  const double t = (cos_chi - last) / (1 - last);
  if (!(t > 0)) return false;
  const double eta = std::sqrt(std::min(1.0, t));
  const double position = eta * (kAngles - 1);
  at.angle = stencil(position, kAngles);
  cubic_weights(position - static_cast<double>(at.angle), at.angle_weight.data(),
                at.angle_slope.data());
  at.slope_factor = (kAngles - 1) / (2 * eta * (1 - last));
  return true;
}

double MonteCarloSunlight::optical_depth(std::size_t w, double h, std::size_t layer,
                                         double cosine) const {
  std::size_t shell = layer_shell_[layer];
  while (shell + 1 < layer_shell_[layer + 1] && h >= shell_height_km_[shell + 1]) ++shell;
  const double* nr = &nr_km_[w * (shells_ + 1)];
  const double* squared = &nr_squared_[w * (shells_ + 1)];
  const double* weight = &weight_[w * (shells_ + 1)];
  const double thickness = shell_height_km_[shell + 1] - shell_height_km_[shell];
  const double v =
      nr[shell] + (h - shell_height_km_[shell]) * (nr[shell + 1] - nr[shell]) / thickness;
  const double x = v * cosine;
  const double b2 = v * v - x * x;
  double sum = -density_[w * shells_ + shell] * x +
               sum_weighted_roots(weight + shell + 1, squared + shell + 1, shells_ - shell, b2);
  if (cosine < 0) {
    // Boundaries between the perigee and the point are crossed twice.
    const auto begin = squared, end = squared + shell + 1;
    const auto first = std::lower_bound(begin, end, b2);
    const auto k = static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, first - begin));
    if (k <= shell) sum += 2 * sum_weighted_roots(weight + k, squared + k, shell + 1 - k, b2);
  }
  return std::max(0.0, sum);
}

bool MonteCarloSunlight::finish(std::size_t w, double h, std::size_t layer, double cosine,
                                double slope, double* irradiance, double* cos_apparent) const {
  cosine = std::clamp(cosine, -1.0, 1.0);
  *cos_apparent = cosine;
  *irradiance = 0;
  const double v = refracting_ ? rays_[w].nr_km(h) : radius_km_ + h;
  if (cosine < 0) {
    const double ground = nr_km_[w * (shells_ + 1)];
    if (v * v * (1 - cosine * cosine) < ground * ground) return false;
  }
  double spread = 1;
  if (spreading_ && refracting_) {
    const double n = v / (radius_km_ + h);
    spread = std::max(0.0, n * n * slope);
  }
  *irradiance = spread * filter_[w] * std::exp(-optical_depth(w, h, layer, cosine));
  return true;
}

bool MonteCarloSunlight::at(double h, std::size_t layer, double cos_chi, double* irradiance,
                            double* cos_apparent) const {
  bool lit = false;
  if (!refracting_) {
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      if (!finish(w, h, layer, cos_chi, 1, irradiance + w, cos_apparent + w)) return false;
    }
    return true;
  }
  Interpolation i;
  if (!locate(h, cos_chi, i)) return false;
  for (std::size_t w = 0; w < wavelengths_; ++w) {
    double value = 0, slope = 0;
    for (std::size_t a = 0; a < 4; ++a) {
      const float* row = &table_[((i.altitude + a) * kAngles + i.angle) * wavelengths_ + w];
      double sum = 0, change = 0;
      for (std::size_t b = 0; b < 4; ++b) {
        const double node = static_cast<double>(row[b * wavelengths_]);
        sum += i.angle_weight[b] * node;
        change += i.angle_slope[b] * node;
      }
      value += i.altitude_weight[a] * sum;
      slope += i.altitude_weight[a] * change;
    }
    lit |= finish(w, h, layer, cos_chi + value, 1 + slope * i.slope_factor, irradiance + w,
                  cos_apparent + w);
  }
  return lit;
}

bool MonteCarloSunlight::at_one(std::size_t w, double h, std::size_t layer, double cos_chi,
                                double* irradiance, double* cos_apparent) const {
  if (!refracting_) return finish(w, h, layer, cos_chi, 1, irradiance, cos_apparent);
  Interpolation i;
  if (!locate(h, cos_chi, i)) return false;
  double value = 0, slope = 0;
  for (std::size_t a = 0; a < 4; ++a) {
    const float* row = &table_[((i.altitude + a) * kAngles + i.angle) * wavelengths_ + w];
    for (std::size_t b = 0; b < 4; ++b) {
      const double node = static_cast<double>(row[b * wavelengths_]);
      value += i.altitude_weight[a] * i.angle_weight[b] * node;
      slope += i.altitude_weight[a] * i.angle_slope[b] * node;
    }
  }
  return finish(w, h, layer, cos_chi + value, 1 + slope * i.slope_factor, irradiance, cos_apparent);
}

}  // namespace twilight
