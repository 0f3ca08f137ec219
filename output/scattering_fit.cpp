#include "output/scattering_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "aerosols/cornette_shanks.h"
#include "atmosphere/rayleigh.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr int kBetween = 6;   // samples inside an interval of nu
constexpr int kAureole = 16;  // inside the one that holds the Sun, even in angle
// The fit stays near the solver's own values where samples do not tell.
constexpr double kRidge = 1e-5;
// Single Mie scattering leaves C_* of the nodes at least this share of the light.
constexpr double kLeastStar = 0.02;

// Solves the symmetric positive definite system in place, rows and columns of `held` left out (x
// there is 0). False where it is not positive definite.
bool solve(const std::vector<double>& a, const std::vector<double>& b,
           const std::vector<char>& held, std::vector<double>& x) {
  const std::size_t n = b.size();
  std::vector<double> l(n * n, 0.0);
  x.assign(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    if (held[i] != 0) continue;
    for (std::size_t j = 0; j <= i; ++j) {
      if (held[j] != 0) continue;
      double sum = a[i * n + j];
      for (std::size_t k = 0; k < j; ++k) sum -= l[i * n + k] * l[j * n + k];
      if (i == j) {
        if (!(sum > 0)) return false;
        l[i * n + i] = std::sqrt(sum);
      } else {
        l[i * n + j] = sum / l[j * n + j];
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (held[i] != 0) continue;
    double sum = b[i];
    for (std::size_t k = 0; k < i; ++k) sum -= l[i * n + k] * x[k];
    x[i] = sum / l[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    if (held[i] != 0) continue;
    double sum = x[i];
    for (std::size_t k = i + 1; k < n; ++k) sum -= l[k * n + i] * x[k];
    x[i] = sum / l[i * n + i];
  }
  return true;
}

}  // namespace

std::vector<double> nonnegative_least_squares(std::vector<double> normal, std::vector<double> right,
                                              std::span<const double> start, double ridge) {
  const std::size_t n = right.size();
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i) largest = std::max(largest, normal[i * n + i]);
  for (std::size_t i = 0; i < n; ++i) {
    const double add = ridge * normal[i * n + i] + 1e-30 * largest + 1e-300;
    normal[i * n + i] += add;
    right[i] += add * start[i];
  }
  std::vector<char> held(n, 0);
  std::vector<double> x;
  for (std::size_t round = 0; round <= n; ++round) {
    if (!solve(normal, right, held, x)) return {start.begin(), start.end()};
    bool negative = false;
    for (std::size_t i = 0; i < n; ++i) {
      if (held[i] != 0 || x[i] >= 0) continue;
      held[i] = 1;
      negative = true;
    }
    if (!negative) break;
  }
  for (double& value : x) value = std::max(value, 0.0);
  return x;
}

ScatteringFit::ScatteringFit(std::vector<double> nu_nodes, double mie_g, MieStorage storage,
                             TableFilling filling, const std::array<double, 3>& proportionality)
    : nodes_(std::move(nu_nodes)),
      sample_nu_(nodes_),
      storage_(storage),
      filling_(filling),
      proportionality_(proportionality) {
  if (filling_ == TableFilling::kFitted) {
    for (std::size_t k = 0; k + 1 < nodes_.size(); ++k) {
      const bool sun = k + 2 == nodes_.size();
      const int count = sun ? kAureole : kBetween;
      const double far = std::acos(nodes_[k]);
      for (int i = 0; i < count; ++i) {
        const double f = (i + 0.5) / count;
        sample_nu_.push_back(sun ? std::cos(far * (1 - f))
                                 : std::lerp(nodes_[k], nodes_[k + 1], f));
      }
    }
  }
  for (const double nu : sample_nu_) {
    const auto above = std::upper_bound(nodes_.begin() + 1, nodes_.end() - 1, nu);
    const auto node = static_cast<std::size_t>(above - nodes_.begin() - 1);
    Place place{};
    place.node = node;
    place.share = (nu - nodes_[node]) / (nodes_[node + 1] - nodes_[node]);
    place.rayleigh = rayleigh_phase_per_sr(nu, 0.0);
    place.mie = cornette_shanks(nu, mie_g);
    places_.push_back(place);
  }
}

void ScatteringFit::at_nodes(std::span<const ScatteringSample> samples,
                             ScatteringTexels& out) const {
  out.star.assign(nodes_.size(), {});
  out.mie.assign(nodes_.size(), {});
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    const Place& place = places_[k];
    const ScatteringSample& s = samples[k];
    for (std::size_t c = 0; c < 3; ++c) {
      double& star = out.star[k][c];
      double& mie = out.mie[k][c];
      if (storage_ == MieStorage::kCombined && c > 0) {
        const double red = out.star[k][0];
        const double ratio = red > 0 ? out.mie[k][0] / red * proportionality_[c] : 0.0;
        star = s.radiance[c] / (place.rayleigh + place.mie * ratio);
        mie = star * ratio;
        continue;
      }
      mie = s.mie[c];
      star = (s.radiance[c] - place.mie * mie) / place.rayleigh;
      const double least =
          storage_ == MieStorage::kCombined ? kLeastStar * s.radiance[c] / place.rayleigh : 0.0;
      if (star >= least) continue;
      // The renderer's phase function says more than there is.
      ++out.clamped;
      star = least;
      mie = (s.radiance[c] - place.rayleigh * star) / place.mie;
    }
  }
}

void ScatteringFit::fit_pair(std::span<const ScatteringSample> samples, std::size_t c,
                             ScatteringTexels& out) const {
  const std::size_t n = nodes_.size(), size = 2 * n;
  std::vector<double> normal(size * size, 0.0), right(size, 0.0), start(size);
  for (std::size_t k = 0; k < n; ++k) {
    start[k] = out.star[k][c];
    start[n + k] = out.mie[k][c];
  }
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Place& p = places_[i];
    if (!(samples[i].radiance[c] > 0) || samples[i].weight <= 0) continue;
    const double per = 1 / samples[i].radiance[c];
    const std::size_t at[4] = {p.node, p.node + 1, n + p.node, n + p.node + 1};
    const double row[4] = {p.rayleigh * (1 - p.share) * per, p.rayleigh * p.share * per,
                           p.mie * (1 - p.share) * per, p.mie * p.share * per};
    for (std::size_t a = 0; a < 4; ++a) {
      right[at[a]] += samples[i].weight * row[a];
      for (std::size_t b = 0; b < 4; ++b) {
        normal[at[a] * size + at[b]] += samples[i].weight * row[a] * row[b];
      }
    }
  }
  const std::vector<double> x =
      nonnegative_least_squares(std::move(normal), std::move(right), start, kRidge);
  for (std::size_t k = 0; k < n; ++k) {
    out.star[k][c] = x[k];
    out.mie[k][c] = x[n + k];
  }
}

void ScatteringFit::fit_star(std::span<const ScatteringSample> samples, std::size_t c,
                             ScatteringTexels& out) const {
  const std::size_t n = nodes_.size();
  std::vector<double> normal(n * n, 0.0), right(n, 0.0), start(n);
  for (std::size_t k = 0; k < n; ++k) start[k] = out.star[k][c];
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Place& p = places_[i];
    if (!(samples[i].radiance[c] > 0) || samples[i].weight <= 0) continue;
    const double red = std::lerp(out.star[p.node][0], out.star[p.node + 1][0], p.share);
    const double mie = std::lerp(out.mie[p.node][0], out.mie[p.node + 1][0], p.share);
    const double phase = p.rayleigh + (red > 0 ? p.mie * proportionality_[c] * mie / red : 0.0);
    const double per = phase / samples[i].radiance[c];
    const std::size_t at[2] = {p.node, p.node + 1};
    const double row[2] = {(1 - p.share) * per, p.share * per};
    for (std::size_t a = 0; a < 2; ++a) {
      right[at[a]] += samples[i].weight * row[a];
      for (std::size_t b = 0; b < 2; ++b) {
        normal[at[a] * n + at[b]] += samples[i].weight * row[a] * row[b];
      }
    }
  }
  const std::vector<double> x =
      nonnegative_least_squares(std::move(normal), std::move(right), start, kRidge);
  for (std::size_t k = 0; k < n; ++k) {
    out.star[k][c] = x[k];
    const double red = out.star[k][0];
    out.mie[k][c] = red > 0 ? x[k] * proportionality_[c] * out.mie[k][0] / red : 0.0;
  }
}

ScatteringTexels ScatteringFit::texels(std::span<const ScatteringSample> samples) const {
  ScatteringTexels out;
  at_nodes(samples, out);
  if (filling_ == TableFilling::kNodes) return out;
  fit_pair(samples, 0, out);
  if (storage_ == MieStorage::kCombined) {
    // The proportionality rule divides by C_*,r: some of it has to stay.
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      const double least = kLeastStar * samples[k].radiance[0] / places_[k].rayleigh;
      if (out.star[k][0] >= least) continue;
      ++out.clamped;
      out.star[k][0] = least;
    }
  }
  for (std::size_t c = 1; c < 3; ++c) {
    storage_ == MieStorage::kCombined ? fit_star(samples, c, out) : fit_pair(samples, c, out);
  }
  return out;
}

}  // namespace twilight
