#include "sim/monte_carlo_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace twilight {
namespace {

constexpr double kDepthKm = 3.0;
constexpr double kThinKm = 0.1, kMiddleKm = 0.5, kThickKm = 1.0;
constexpr double kThinBelowKm = 30.0, kMiddleBelowKm = 60.0;
constexpr double kFaint = 1e-9;
constexpr double kSmoothingKm = 2.0;

// Solves the symmetric 3 x 3 system of a least-squares parabola for its constant; false if it is
// all but singular.
bool parabola_constant(std::array<std::array<double, 4>, 3> a, double& constant) {
  const double size = a[0][0] * a[1][1] * a[2][2];
  double determinant = 1;
  // Gauss elimination from the highest power down, which leaves the constant for the last row.
  for (const std::size_t pivot : {std::size_t{2}, std::size_t{1}, std::size_t{0}}) {
    determinant *= a[pivot][pivot];
    if (!(std::abs(a[pivot][pivot]) > 0)) return false;
    for (std::size_t row = 0; row < pivot; ++row) {
      const double f = a[row][pivot] / a[pivot][pivot];
      for (std::size_t k = 0; k < 4; ++k) a[row][k] -= f * a[pivot][k];
    }
  }
  constant = a[0][3] / a[0][0];
  return determinant > 1e-9 * size;
}

// The shared continuous index, as documented in atmosphere/refraction.h: nodes at the layers'
// means, smoothed by parabolas of the logarithm over 2 km on either side, a natural cubic spline of
// the logarithm through them (here by its second derivatives), a line beyond.
class IndexProfile {
 public:
  IndexProfile(const Medium& m, std::size_t w) {
    const std::size_t n = m.layers();
    const auto middle = [&](std::size_t i) {
      return (m.boundary_km[i] + m.boundary_km[i + 1]) / 2;
    };
    for (std::size_t i = 0; i < n; ++i) {
      const double value = m.refractivity(i, w);
      if (!(value > 0)) continue;
      const std::size_t a = i == 0 ? 0 : i - 1, b = i + 1 == n ? i : i + 1;
      double inverse_scale = 1 / 8.0;
      if (a != b) {
        const double ratio = m.refractivity(a, w) / m.refractivity(b, w);
        inverse_scale =
            ratio > 0 && std::isfinite(ratio) ? std::log(ratio) / (middle(b) - middle(a)) : 0;
      }
      const double x = inverse_scale * (m.boundary_km[i + 1] - m.boundary_km[i]) / 2;
      // mean of exp(-z / H) over +-x scale heights: sinh(x) / x
      const double lift = std::abs(x) < 1e-4 ? 0 : std::log(std::sinh(x) / x) / inverse_scale;
      height_km_.push_back(middle(i) - lift);
      log_.push_back(std::log(value));
    }
    if (height_km_.empty()) return;
    if (height_km_.size() == 1) {
      height_km_.push_back(height_km_[0] + 8);
      log_.push_back(log_[0] - 1);
    }
    if (n == 1 || height_km_.size() == n) smooth();
    bend();
  }

  double operator()(double h) const {
    if (height_km_.empty()) return 0;
    const std::size_t last = height_km_.size() - 1;
    if (h <= height_km_[0]) return std::exp(log_[0] + slope_at_start(0) * (h - height_km_[0]));
    if (h >= height_km_[last]) {
      const double step = height_km_[last] - height_km_[last - 1];
      const double slope = (log_[last] - log_[last - 1]) / step + curvature_[last - 1] * step / 6;
      return std::exp(log_[last] + slope * (h - height_km_[last]));
    }
    const auto above = std::upper_bound(height_km_.begin() + 1, height_km_.end() - 1, h);
    const auto i = static_cast<std::size_t>(above - height_km_.begin()) - 1;
    const double step = height_km_[i + 1] - height_km_[i];
    const double b = (h - height_km_[i]) / step, a = 1 - b;
    return std::exp(a * log_[i] + b * log_[i + 1] +
                    step * step / 6 *
                        ((a * a * a - a) * curvature_[i] + (b * b * b - b) * curvature_[i + 1]));
  }

  double top_scale_km() const {
    const std::size_t k = height_km_.size() - 1;
    const double fall = log_[k - 1] - log_[k];
    return fall > 0 ? std::clamp((height_km_[k] - height_km_[k - 1]) / fall, 2.0, 20.0) : 8.0;
  }

 private:
  double slope_at_start(std::size_t i) const {
    const double step = height_km_[i + 1] - height_km_[i];
    return (log_[i + 1] - log_[i]) / step - step / 6 * (2 * curvature_[i] + curvature_[i + 1]);
  }

  void smooth() {
    const std::vector<double> raw = log_;
    const std::size_t n = raw.size();
    for (std::size_t i = 0; i < n; ++i) {
      std::array<std::array<double, 4>, 3> normal{};
      int members = 0;
      for (std::size_t k = 0; k < n; ++k) {
        const double x = (height_km_[k] - height_km_[i]) / kSmoothingKm;
        if (!(std::abs(x) < 1)) continue;
        ++members;
        const double tricube = std::pow(1 - std::pow(std::abs(x), 3), 3);
        const double share = (k > 0 ? height_km_[k] - height_km_[k - 1] : 0.0) +
                             (k + 1 < n ? height_km_[k + 1] - height_km_[k] : 0.0);
        const std::array<double, 4> row{1, x, x * x, raw[k] - raw[i]};
        for (std::size_t a = 0; a < 3; ++a) {
          for (std::size_t b = 0; b < 4; ++b) normal[a][b] += tricube * share * row[a] * row[b];
        }
      }
      double change = 0;
      if (members >= 4 && parabola_constant(normal, change)) log_[i] = raw[i] + change;
    }
  }

  // Second derivatives of the natural cubic spline.
  void bend() {
    const std::size_t n = log_.size();
    curvature_.assign(n, 0.0);
    std::vector<double> c(n, 0.0), d(n, 0.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
      const double below = height_km_[i] - height_km_[i - 1];
      const double above = height_km_[i + 1] - height_km_[i];
      const double pivot = 2 * (below + above) - below * c[i - 1];
      const double known = 6 * ((log_[i + 1] - log_[i]) / above - (log_[i] - log_[i - 1]) / below);
      c[i] = above / pivot;
      d[i] = (known - below * d[i - 1]) / pivot;
    }
    for (std::size_t i = n - 1; i-- > 1;) curvature_[i] = d[i] - c[i] * curvature_[i + 1];
  }

  std::vector<double> height_km_, log_, curvature_;
};

double shell_thickness_km(double h) {
  return h < kThinBelowKm ? kThinKm : h < kMiddleBelowKm ? kMiddleKm : kThickKm;
}

}  // namespace

BentRays::BentRays(const Medium& m, std::size_t w) : radius_km_(m.earth_radius_km) {
  for (std::size_t i = 0; i < m.layers(); ++i)
    refracting_ = refracting_ || m.refractivity(i, w) > 0;
  const IndexProfile index(m, w);
  const auto push = [&](double h, double refractivity, std::size_t layer) {
    if (!height_km_.empty()) layer_.push_back(layer);
    height_km_.push_back(h);
    // r + r (n - 1) keeps the digits of the refractivity.
    nr_km_.push_back(radius_km_ + h + (radius_km_ + h) * refractivity);
  };
  if (refracting_) {
    constexpr int kDeep = static_cast<int>(kDepthKm / kThinKm + 0.5);
    for (int k = kDeep; k > 0; --k) push(-kThinKm * k, index(-kThinKm * k), kOutside);
  } else {
    push(-kDepthKm, 0, kOutside);
  }
  ground_ = height_km_.size();
  push(0, index(0), kOutside);
  for (std::size_t i = 0; i < m.layers(); ++i) {
    const double a = m.boundary_km[i], b = m.boundary_km[i + 1];
    int parts = 1;
    if (refracting_ && index(a) > kFaint) {
      parts = static_cast<int>(std::ceil((b - a) / shell_thickness_km(a)));
    }
    for (int p = 1; p <= parts; ++p) {
      const double h = p == parts ? b : a + (b - a) * p / parts;
      push(h, index(h), i);
    }
  }
  if (refracting_) {
    const double scale = index.top_scale_km(), top = m.top_km();
    const double at_top = index(top);
    for (int k = 1; at_top * std::exp(-(k - 1) / 16.0) > kFaint; ++k) {
      push(top + scale * k / 16, at_top * std::exp(-k / 16.0), kOutside);
    }
    push(height_km_.back() + scale, 0, kOutside);
  }
  for (std::size_t k = 0; k + 1 < height_km_.size(); ++k) {
    const double dnr = nr_km_[k + 1] - nr_km_[k], dr = height_km_[k + 1] - height_km_[k];
    if (!(dnr > 0.02 * dr)) {
      std::ostringstream s;
      s << "refractive index at " << height_km_[k] << " km falls by " << (1 - dnr / dr)
        << " of the curvature of the Earth, radius " << radius_km_
        << " km: the Monte Carlo follows rays below 0.98";
      throw std::invalid_argument(s.str());
    }
    // ds = dr / cos; with dx = nr d(nr) / x and cos = x / nr that is ds = dr / d(nr) dx.
    dr_dnr_.push_back(dr / dnr);
  }
  // d(bending) = -(n'/n) tan dr = b c dx with c = -n' / (n nr d(nr)/dr): linear in r in a shell, so
  // that its slope against b, sunlight's spreading, does not step from shell to shell.
  const auto coefficient = [&](double h) {
    constexpr double kStep = 0.01;
    const double slope = (index(h + kStep) - index(h - kStep)) / (2 * kStep);
    const double r = radius_km_ + h, n = 1 + index(h);
    return -slope / (n * n * r * (n + r * slope));
  };
  const double top = m.top_km(), above_top = refracting_ ? index.top_scale_km() : 1;
  const auto end_coefficient = [&](std::size_t k) {
    if (!refracting_ || k + 1 == height_km_.size()) return 0.0;
    if (height_km_[k] <= top) return coefficient(height_km_[k]);
    return coefficient(top) * std::exp(-(height_km_[k] - top) / above_top);
  };
  for (std::size_t k = 0; k + 1 < height_km_.size(); ++k) {
    const double low = end_coefficient(k), high = end_coefficient(k + 1);
    const double v = (nr_km_[k] + nr_km_[k + 1]) / 2;
    bend_.push_back((low + high) / 2);
    // r - r_mid = (nr^2 - nr_mid^2) / (2 nr d(nr)/dr)
    bend_slope_.push_back((high - low) / (nr_km_[k + 1] - nr_km_[k]) / (2 * v));
    middle_squared_.push_back(v * v);
  }
  nr_squared_.resize(nr_km_.size());
  for (std::size_t k = 0; k < nr_km_.size(); ++k) nr_squared_[k] = nr_km_[k] * nr_km_[k];
}

std::size_t BentRays::shell_at(double h) const {
  const auto it = std::upper_bound(height_km_.begin() + 1, height_km_.end() - 1, h);
  return static_cast<std::size_t>(it - height_km_.begin()) - 1;
}

double BentRays::nr_km(double h) const {
  if (h >= height_km_.back()) return radius_km_ + h;
  const std::size_t k = shell_at(h);
  return nr_km_[k] + (h - height_km_[k]) / dr_dnr_[k];
}

double BentRays::bent(std::size_t k, double x0, double x1, double b2) const {
  const double dx = x1 - x0;
  return dx * (bend_[k] +
               bend_slope_[k] * ((x0 * x0 + x0 * x1 + x1 * x1) / 3 + b2 - middle_squared_[k]));
}

double BentRays::bending_rad(double h, double cosine, double sine) const {
  if (!refracting_ || h >= height_km_.back()) return 0;
  const std::size_t start = shell_at(h);
  const double v = nr_km(h);
  const double b = v * sine;
  const double b2 = b * b;
  double x = v * std::abs(cosine);
  double up = 0;
  {
    double before = x;
    for (std::size_t k = start; k < bend_.size(); ++k) {
      const double next = std::sqrt(std::max(0.0, nr_squared_[k + 1] - b2));
      up += bent(k, before, next, b2);
      before = next;
    }
  }
  double down = 0;
  if (cosine < 0) {
    for (std::size_t k = start + 1; k-- > 0;) {
      const double d2 = nr_squared_[k] - b2;
      const double next = d2 > 0 ? std::sqrt(d2) : 0;
      down += bent(k, next, x, b2);
      x = next;
      if (d2 <= 0) break;
    }
  }
  return b * (up + 2 * down);
}

BentRays::Trace BentRays::trace(double h, double zenith) const {
  Trace t;
  const double v = nr_km(h), sine = std::sin(zenith), cosine = std::cos(zenith);
  t.impact_km = v * sine;
  const double b = t.impact_km, b2 = b * b;
  double x = v * cosine;
  std::size_t k = 0;
  bool up = cosine >= 0;
  if (h >= height_km_.back()) {
    const double entry = nr_squared_.back() - b2;
    if (up || entry <= 0) return t;
    x = -std::sqrt(entry);
    k = bend_.size() - 1;
  } else {
    k = shell_at(h);
    if (!up && h <= height_km_[k]) {
      if (k == ground_) {
        t.hits_ground = true;
        return t;
      }
      --k;
    }
  }
  for (;;) {
    double next = 0;
    bool turned = false;
    if (!up) {
      const double d2 = nr_squared_[k] - b2;
      if (d2 >= 0) {
        next = -std::sqrt(d2);
      } else {
        up = turned = true;
      }
    }
    if (up) next = std::sqrt(std::max(0.0, nr_squared_[k + 1] - b2));
    next = std::max(next, x);
    const bool inside = layer_[k] != kOutside;
    const double length = inside ? (next - x) * dr_dnr_[k] : 0;
    // Down and up through the turning shell: the integrand is even in x.
    const double bending = b * bent(k, x, next, b2);
    t.pieces.push_back({layer_[k], x, next, t.length_km, length, t.bending_rad,
                        next > x ? bending / (next - x) : 0.0, dr_dnr_[k], height_km_[k],
                        nr_km_[k]});
    t.length_km += length;
    t.bending_rad += bending;
    x = next;
    if (up) {
      if (++k == bend_.size()) return t;
    } else if (k == ground_) {
      t.hits_ground = true;
      return t;
    } else {
      --k;
    }
  }
}

}  // namespace twilight
