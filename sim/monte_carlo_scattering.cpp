#include "sim/monte_carlo_scattering.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kInv4Pi = 1 / (4 * kPi);
constexpr std::size_t kBuckets = 2048;

double henyey_greenstein_per_sr(double g, double cosine) {
  const double base = (1 - g) * (1 - g) + 2 * g * (1 - cosine);
  return kInv4Pi * (1 - g * g) / (base * std::sqrt(base));
}

double sample_henyey_greenstein(double g, double u) {
  if (std::abs(g) < 1e-4) return 2 * u - 1;
  const double s = (1 - g * g) / (1 - g + 2 * g * u);
  return std::clamp((1 + g * g - s * s) / (2 * g), -1.0, 1.0);
}

// Cosine distributed as 3/8 (1 + c^2): Cardano's root.
double sample_rayleigh(double u) {
  const double z = 4 * u - 2;
  const double root = std::sqrt(z * z + 1);
  return std::clamp(std::cbrt(z + root) + std::cbrt(z - root), -1.0, 1.0);
}

double rayleigh_per_sr(double cosine) { return 0.75 * kInv4Pi * (1 + cosine * cosine); }

// integral of (linear from a at t0 to b at t1) sin(t) dt
double linear_sine_integral(double t0, double t1, double a, double b) {
  const double h = t1 - t0;
  if (h < 1e-3) {  // the closed form cancels; this is exact to h^4
    return h / 6 * (a * std::sin(t0) + 2 * (a + b) * std::sin((t0 + t1) / 2) + b * std::sin(t1));
  }
  const double slope = (b - a) / h;
  return a * std::cos(t0) - b * std::cos(t1) + slope * (std::sin(t1) - std::sin(t0));
}

}  // namespace

std::size_t MonteCarloScattering::Kind::interval(double angle) const {
  const double part = angle * (kBuckets / kPi);
  const std::size_t b = std::min(static_cast<std::size_t>(std::max(0.0, part)), kBuckets - 1);
  const auto begin = angle_rad.begin() + static_cast<std::ptrdiff_t>(bucket[b]) + 1;
  const auto end = angle_rad.begin() +
                   static_cast<std::ptrdiff_t>(std::min(bucket[b + 1] + 2, angle_rad.size() - 1));
  return static_cast<std::size_t>(std::upper_bound(begin, end, angle) - angle_rad.begin()) - 1;
}

MonteCarloScattering::MonteCarloScattering(const Medium& m, std::span<const std::size_t> reference)
    : wavelengths_(m.wavelengths()), reference_(reference.begin(), reference.end()) {
  const std::size_t W = wavelengths_, N = m.layers(), G = reference_.size();
  for (std::size_t w = 0; w < W; ++w) {
    const double rho = m.depolarisation.empty() ? 0.0 : m.depolarisation[w];
    const double delta = (1 - rho) / (1 + rho / 2);
    rayleigh_.push_back(delta);
    isotropic_.push_back(1 - delta);
    circular_.push_back((1 - 2 * rho) / (1 - rho));
  }
  const bool tabulated = !m.aerosol_phase.empty();
  if (tabulated && m.aerosol_kind_scattering_per_km.size() != m.aerosol_phase.size()) {
    throw std::invalid_argument("aerosol_kind_scattering_per_km: one table per aerosol_phase");
  }
  air_.resize(N * W);
  aerosol_.resize(N * W);
  asymmetry_.resize(N * W);
  for (std::size_t i = 0; i < N; ++i) {
    for (std::size_t w = 0; w < W; ++w) {
      air_[i * W + w] = m.air_scattering_per_km(i, w);
      aerosol_[i * W + w] = m.aerosol_scattering_per_km(i, w);
      asymmetry_[i * W + w] = m.aerosol_asymmetry(i, w);
      has_aerosol_ |= aerosol_[i * W + w] > 0;
    }
  }
  if (tabulated) {
    for (std::size_t k = 0; k < m.aerosol_phase.size(); ++k) {
      Kind kind;
      for (const PhaseMatrix& p : m.aerosol_phase[k]) {
        kind.angle_rad.insert(kind.angle_rad.end(), p.angle_rad.begin(), p.angle_rad.end());
      }
      std::sort(kind.angle_rad.begin(), kind.angle_rad.end());
      kind.angle_rad.erase(std::unique(kind.angle_rad.begin(), kind.angle_rad.end()),
                           kind.angle_rad.end());
      const std::size_t A = kind.angle_rad.size();
      kind.value.resize(A * 4 * W);
      for (std::size_t w = 0; w < W; ++w) {
        const PhaseMatrix& p = m.aerosol_phase[k][w];
        std::size_t at = 0;
        for (std::size_t a = 0; a < A; ++a) {
          const double t = kind.angle_rad[a];
          while (at + 2 < p.angle_rad.size() && t >= p.angle_rad[at + 1]) ++at;
          const double f = (t - p.angle_rad[at]) / (p.angle_rad[at + 1] - p.angle_rad[at]);
          const auto mix = [&](const std::vector<double>& v) {
            return v[at] + f * (v[at + 1] - v[at]);
          };
          double* out = &kind.value[a * 4 * W + w];
          out[0] = mix(p.p11);
          out[W] = mix(p.p12);
          out[2 * W] = mix(p.p33);
          out[3 * W] = mix(p.p34);
        }
      }
      for (const double t : kind.angle_rad) kind.cosine.push_back(std::cos(t));
      std::size_t at = 0;
      for (std::size_t b = 0; b <= kBuckets; ++b) {
        const double t = kPi * static_cast<double>(b) / kBuckets;
        while (at + 2 < A && kind.angle_rad[at + 1] <= t) ++at;
        kind.bucket.push_back(at);
      }
      for (std::size_t g = 0; g < G; ++g) {
        double sum = 0;
        const std::size_t first = kind.cumulative.size();
        kind.cumulative.push_back(0);
        for (std::size_t a = 0; a + 1 < A; ++a) {
          sum += linear_sine_integral(kind.angle_rad[a], kind.angle_rad[a + 1],
                                      kind.value[a * 4 * W + reference_[g]],
                                      kind.value[(a + 1) * 4 * W + reference_[g]]);
          kind.cumulative.push_back(sum);
        }
        for (std::size_t a = first; a < kind.cumulative.size(); ++a) kind.cumulative[a] /= sum;
      }
      kinds_.push_back(std::move(kind));
      std::vector<double> scattering(N * W);
      for (std::size_t i = 0; i < N; ++i) {
        for (std::size_t w = 0; w < W; ++w) {
          scattering[i * W + w] = m.aerosol_kind_scattering_per_km[k](i, w);
        }
      }
      kind_scattering_.push_back(std::move(scattering));
    }
  } else {
    kind_scattering_.push_back(aerosol_);
  }
  constituents_ = 1 + kind_scattering_.size();
  share_.resize(N * G * constituents_);
  column_share_.resize(G * (constituents_ - 1));
  column_asymmetry_.resize(G);
  for (std::size_t g = 0; g < G; ++g) {
    std::vector<double> column(constituents_ - 1);
    double scattering = 0, forward = 0;
    for (std::size_t i = 0; i < N; ++i) {
      const std::size_t at = i * W + reference_[g];
      const double dz = m.boundary_km[i + 1] - m.boundary_km[i];
      double sum = air_[at];
      double* share = &share_[(i * G + g) * constituents_];
      share[0] = sum;
      for (std::size_t k = 0; k + 1 < constituents_; ++k) {
        sum += kind_scattering_[k][at];
        share[k + 1] = sum;
        column[k] += kind_scattering_[k][at] * dz;
      }
      for (std::size_t c = 0; c < constituents_; ++c) share[c] = sum > 0 ? share[c] / sum : 1;
      scattering += aerosol_[at] * dz;
      forward += aerosol_[at] * asymmetry_[at] * dz;
    }
    double sum = 0;
    for (std::size_t k = 0; k < column.size(); ++k) {
      sum += column[k];
      column_share_[g * column.size() + k] = sum;
    }
    for (std::size_t k = 0; k < column.size(); ++k) {
      double& s = column_share_[g * column.size() + k];
      s = sum > 0 ? s / sum : 1;
    }
    column_asymmetry_[g] = scattering > 0 ? forward / scattering : 0;
  }
}

void MonteCarloScattering::matrices(std::size_t layer, double cosine, std::size_t first,
                                    std::size_t last, bool scalar,
                                    const ScatteringMatrices& out) const {
  const std::size_t W = wavelengths_;
  const double* air = &air_[layer * W];
  const double plus = 0.75 * (1 + cosine * cosine), minus = 0.75 * (1 - cosine * cosine);
  if (scalar) {
    for (std::size_t w = first; w < last; ++w) {
      out.a1[w] = kInv4Pi * air[w] * (rayleigh_[w] * plus + isotropic_[w]);
    }
  } else {
    for (std::size_t w = first; w < last; ++w) {
      const double s = kInv4Pi * air[w], r = s * rayleigh_[w];
      out.a1[w] = r * plus + s * isotropic_[w];
      out.a2[w] = r * plus;
      out.a3[w] = r * 1.5 * cosine;
      out.a4[w] = r * 1.5 * cosine * circular_[w];
      out.b1[w] = -r * minus;
      out.b2[w] = 0;
    }
  }
  if (!has_aerosol_) return;
  if (kinds_.empty()) {
    for (std::size_t w = first; w < last; ++w) {
      const double s = aerosol_[layer * W + w];
      if (s > 0) out.a1[w] += s * henyey_greenstein_per_sr(asymmetry_[layer * W + w], cosine);
    }
    return;
  }
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    const Kind& kind = kinds_[k];
    const double* scattering = &kind_scattering_[k][layer * W];
    bool any = false;
    for (std::size_t w = first; w < last; ++w) any |= scattering[w] > 0;
    if (!any) continue;
    const std::size_t a = kind.interval(angle);
    const double f = (angle - kind.angle_rad[a]) / (kind.angle_rad[a + 1] - kind.angle_rad[a]);
    const double* low = &kind.value[a * 4 * W];
    const double* high = low + 4 * W;
    for (std::size_t w = first; w < last; ++w) {
      const double s = kInv4Pi * scattering[w];
      const double p11 = s * (low[w] + f * (high[w] - low[w]));
      out.a1[w] += p11;
      if (scalar) continue;
      const double p12 = s * (low[W + w] + f * (high[W + w] - low[W + w]));
      const double p33 = s * (low[2 * W + w] + f * (high[2 * W + w] - low[2 * W + w]));
      const double p34 = s * (low[3 * W + w] + f * (high[3 * W + w] - low[3 * W + w]));
      out.a2[w] += p11;
      out.b1[w] += p12;
      out.a3[w] += p33;
      out.a4[w] += p33;
      out.b2[w] += p34;
    }
  }
}

double MonteCarloScattering::kind_sample(const Kind& kind, std::size_t g, double u) const {
  const std::size_t A = kind.angle_rad.size();
  const double* c = &kind.cumulative[g * A];
  auto i = static_cast<std::size_t>(std::upper_bound(c + 1, c + A - 1, u) - c) - 1;
  const double width = c[i + 1] - c[i];
  const double f = width > 0 ? std::clamp((u - c[i]) / width, 0.0, 1.0) : 0.5;
  return kind.cosine[i] + f * (kind.cosine[i + 1] - kind.cosine[i]);
}

double MonteCarloScattering::kind_density(const Kind& kind, std::size_t g, std::size_t i) const {
  const double* c = &kind.cumulative[g * kind.angle_rad.size()];
  return (c[i + 1] - c[i]) / (2 * kPi * (kind.cosine[i] - kind.cosine[i + 1]));
}

double MonteCarloScattering::sample_cosine(std::size_t layer, std::size_t g, double u,
                                           double v) const {
  const double* share = &share_[(layer * reference_.size() + g) * constituents_];
  if (u < share[0]) return sample_rayleigh(v);
  if (kinds_.empty()) {
    return sample_henyey_greenstein(asymmetry_[layer * wavelengths_ + reference_[g]], v);
  }
  std::size_t k = 0;
  while (k + 1 < kinds_.size() && u >= share[k + 1]) ++k;
  return kind_sample(kinds_[k], g, v);
}

double MonteCarloScattering::density_per_sr(std::size_t layer, std::size_t g, double cosine) const {
  const double* share = &share_[(layer * reference_.size() + g) * constituents_];
  double density = share[0] * rayleigh_per_sr(cosine);
  if (share[0] >= 1) return density;
  if (kinds_.empty()) {
    return density + (1 - share[0]) * henyey_greenstein_per_sr(
                                          asymmetry_[layer * wavelengths_ + reference_[g]], cosine);
  }
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    const double part = share[k + 1] - share[k];
    if (part > 0) density += part * kind_density(kinds_[k], g, kinds_[k].interval(angle));
  }
  return density;
}

double MonteCarloScattering::sample_aureole_cosine(std::size_t g, double u, double v) const {
  if (kinds_.empty()) return sample_henyey_greenstein(column_asymmetry_[g], v);
  std::size_t k = 0;
  while (k + 1 < kinds_.size() && u >= column_share_[g * kinds_.size() + k]) ++k;
  return kind_sample(kinds_[k], g, v);
}

double MonteCarloScattering::aureole_density_per_sr(std::size_t g, double cosine) const {
  if (kinds_.empty()) return henyey_greenstein_per_sr(column_asymmetry_[g], cosine);
  const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
  double density = 0, before = 0;
  for (std::size_t k = 0; k < kinds_.size(); ++k) {
    const double share = column_share_[g * kinds_.size() + k] - before;
    before += share;
    if (share > 0) density += share * kind_density(kinds_[k], g, kinds_[k].interval(angle));
  }
  return density;
}

}  // namespace twilight
