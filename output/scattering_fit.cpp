#include "output/scattering_fit.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "aerosols/cornette_shanks.h"
#include "atmosphere/rayleigh.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kForward = 0.1;  // least weight of a sample of the aureole
constexpr int kBetween = 6;       // samples inside an interval of nu
constexpr int kAureole = 16;      // inside the one that holds the Sun, even in angle
// The fit stays near the solver's own values where samples do not tell.
constexpr double kRidge = 1e-5;
// Of what is not single Mie scattering, this share stays in C_*,r of a combined table.
constexpr double kLeastStar = 0.5;

// Solves with rows and columns of `held` left out (x there is 0). False where the matrix is not
// positive definite.
bool solve(const BandedSystem& a, const std::vector<char>& held, std::vector<double>& x) {
  const std::size_t n = a.size, w = a.band;
  std::vector<double> l(n * w, 0.0);
  const auto first = [&](std::size_t i) { return i + 1 >= w ? i + 1 - w : 0; };
  x.assign(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    double* own = &l[i * w + w - 1] - i;  // own[j], j in first(i)..i
    const double* given = &a.lower[i * w + w - 1] - i;
    if (held[i] != 0) {
      own[i] = 1;
      continue;
    }
    for (std::size_t j = first(i); j <= i; ++j) {
      if (held[j] != 0) continue;
      const double* other = &l[j * w + w - 1] - j;
      double sum = given[j];
      for (std::size_t k = std::max(first(i), first(j)); k < j; ++k) sum -= own[k] * other[k];
      if (i != j) {
        own[j] = sum / other[j];
        continue;
      }
      if (!(sum > 0)) return false;
      own[i] = std::sqrt(sum);
    }
    double sum = a.right[i];
    for (std::size_t k = first(i); k < i; ++k) sum -= own[k] * x[k];
    x[i] = sum / own[i];
  }
  for (std::size_t i = n; i-- > 0;) {
    const double* own = &l[i * w + w - 1] - i;
    x[i] = held[i] != 0 ? 0.0 : x[i] / own[i];
    for (std::size_t k = first(i); k < i; ++k) x[k] -= own[k] * x[i];
  }
  return true;
}

}  // namespace

std::vector<double> nonnegative_least_squares(BandedSystem system, std::span<const double> start,
                                              double ridge) {
  constexpr int kRounds = 12;
  const std::size_t n = system.size;
  double largest = 0;
  for (std::size_t i = 0; i < n; ++i) largest = std::max(largest, system.at(i, i));
  for (std::size_t i = 0; i < n; ++i) {
    const double add = ridge * system.at(i, i) + 1e-30 * largest + 1e-300;
    system.at(i, i) += add;
    system.right[i] += add * start[i];
  }
  std::vector<char> held(n, 0);
  std::vector<double> x;
  for (int round = 0; round < kRounds; ++round) {
    if (!solve(system, held, x)) return {start.begin(), start.end()};
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

// What one sample reads: four texels, their weights, and the phase functions.
struct ScatteringFit::Row {
  std::array<std::size_t, 4> texel;  // [mu_s][nu]
  std::array<double, 4> weight;
};

ScatteringFit::ScatteringFit(const std::vector<int>& suns_between, std::vector<double> nu_nodes,
                             double mie_g, MieStorage storage, TableFilling filling,
                             const std::array<double, 3>& proportionality)
    : suns_(suns_between.size() + 1),
      nodes_(std::move(nu_nodes)),
      sample_nu_(nodes_),
      storage_(storage),
      filling_(filling),
      proportionality_(proportionality) {
  const bool between = filling_ == TableFilling::kFitted;
  for (std::size_t k = 0; k < suns_; ++k) {
    const std::size_t node = std::min(k, suns_ - 2);
    node_sun_.push_back(sample_sun_.size());
    sample_sun_.push_back(static_cast<double>(k));
    sun_place_.push_back({node, static_cast<double>(k - node)});
    if (!between || k + 1 == suns_) continue;
    for (int i = 1; i <= suns_between[k]; ++i) {
      const double share = i / (suns_between[k] + 1.0);
      sample_sun_.push_back(static_cast<double>(k) + share);
      sun_place_.push_back({k, share});
    }
  }
  nu_weight_.assign(nodes_.size(), 1.0);
  nu_weight_.back() = kForward;
  for (std::size_t k = 0; between && k + 1 < nodes_.size(); ++k) {
    const bool sun = k + 2 == nodes_.size();
    const int count = sun ? kAureole : kBetween;
    const double far = std::acos(nodes_[k]);
    for (int i = 0; i < count; ++i) {
      const double f = (i + 0.5) / count;
      sample_nu_.push_back(sun ? std::cos(far * (1 - f)) : std::lerp(nodes_[k], nodes_[k + 1], f));
      const double share =
          std::sin(far * (1 - f)) * far / count * kBetween / (nodes_[k + 1] - nodes_[k]);
      nu_weight_.push_back(sun ? std::max(kForward, share) : 1.0);
    }
  }
  for (const double nu : sample_nu_) {
    const auto above = std::upper_bound(nodes_.begin() + 1, nodes_.end() - 1, nu);
    const auto node = static_cast<std::size_t>(above - nodes_.begin() - 1);
    nu_place_.push_back({node, (nu - nodes_[node]) / (nodes_[node + 1] - nodes_[node])});
    rayleigh_.push_back(rayleigh_phase_per_sr(nu, 0.0));
    mie_.push_back(cornette_shanks(nu, mie_g));
  }
}

ScatteringFit::Row ScatteringFit::row(std::size_t sun, std::size_t nu) const {
  const Place &s = sun_place_[sun], &v = nu_place_[nu];
  const std::size_t n = nodes_.size(), at = s.node * n + v.node;
  return {{at, at + 1, at + n, at + n + 1},
          {(1 - s.share) * (1 - v.share), (1 - s.share) * v.share, s.share * (1 - v.share),
           s.share * v.share}};
}

void ScatteringFit::at_nodes(std::span<const ScatteringSample> samples,
                             ScatteringTexels& out) const {
  const std::size_t n = nodes_.size();
  out.star.assign(suns_ * n, {});
  out.mie.assign(suns_ * n, {});
  for (std::size_t t = 0; t < suns_ * n; ++t) {
    const std::size_t k = t % n;
    const ScatteringSample& s = samples[node_sun_[t / n] * sample_nu_.size() + k];
    for (std::size_t c = 0; c < 3; ++c) {
      double& star = out.star[t][c];
      double& mie = out.mie[t][c];
      if (storage_ == MieStorage::kCombined && c > 0) {
        const double red = out.star[t][0];
        const double ratio = red > 0 ? out.mie[t][0] / red * proportionality_[c] : 0.0;
        star = s.radiance[c] / (rayleigh_[k] + mie_[k] * ratio);
        mie = star * ratio;
        continue;
      }
      mie = s.mie[c];
      star = (s.radiance[c] - mie_[k] * mie) / rayleigh_[k];
      const double least =
          storage_ == MieStorage::kCombined ? kLeastStar * s.smooth[c] / rayleigh_[k] : 0.0;
      if (star >= least) continue;
      // The renderer's phase function says more than there is.
      ++out.clamped;
      star = least;
      mie = (s.radiance[c] - rayleigh_[k] * star) / mie_[k];
    }
  }
}

void ScatteringFit::fit(std::span<const ScatteringSample> samples, std::size_t c, bool with_mie,
                        ScatteringTexels& out) const {
  const std::size_t n = nodes_.size(), per_texel = with_mie ? 2 : 1, nus = sample_nu_.size();
  BandedSystem system(suns_ * n * per_texel, (n + 2) * per_texel);
  std::vector<double> start(system.size), least(system.size, 0.0);
  for (std::size_t t = 0; t < suns_ * n; ++t) {
    const ScatteringSample& node = samples[node_sun_[t / n] * nus + t % n];
    const double star = node.smooth[c] / rayleigh_[t % n];
    // The proportionality rule divides by C_*,r: some of it has to stay.
    if (with_mie && storage_ == MieStorage::kCombined) least[2 * t] = kLeastStar * star;
    start[t * per_texel] = (with_mie ? star : out.star[t][c]) - least[t * per_texel];
    if (with_mie) start[t * per_texel + 1] = node.mie[c];
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!(samples[i].radiance[c] > 0) || samples[i].weight <= 0) continue;
    const Row r = row(i / nus, i % nus);
    const double per = 1 / samples[i].radiance[c];
    const double weight = samples[i].weight * nu_weight_[i % nus];
    double phase = rayleigh_[i % nus];
    if (!with_mie) {
      double red = 0, mie = 0;
      for (std::size_t a = 0; a < 4; ++a) {
        red += r.weight[a] * out.star[r.texel[a]][0];
        mie += r.weight[a] * out.mie[r.texel[a]][0];
      }
      if (red > 0) phase += mie_[i % nus] * proportionality_[c] * mie / red;
    }
    std::array<std::size_t, 8> at;
    std::array<double, 8> value;
    std::size_t count = 0;
    for (std::size_t a = 0; a < 4; ++a) {
      if (r.weight[a] == 0) continue;
      at[count] = r.texel[a] * per_texel;
      value[count++] = r.weight[a] * phase * per;
      if (!with_mie) continue;
      at[count] = r.texel[a] * 2 + 1;
      value[count++] = r.weight[a] * mie_[i % nus] * per;
    }
    double wanted = 1;
    for (std::size_t a = 0; a < count; ++a) wanted -= value[a] * least[at[a]];
    for (std::size_t a = 0; a < count; ++a) {
      const double weighted = weight * value[a];
      system.right[at[a]] += weighted * wanted;
      for (std::size_t b = 0; b <= a; ++b) system.at(at[a], at[b]) += weighted * value[b];
    }
  }
  std::vector<double> x = nonnegative_least_squares(std::move(system), start, kRidge);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += least[i];
  for (std::size_t t = 0; t < suns_ * n; ++t) {
    out.star[t][c] = x[t * per_texel];
    if (with_mie) {
      out.mie[t][c] = x[t * 2 + 1];
    } else {
      const double red = out.star[t][0];
      out.mie[t][c] = red > 0 ? x[t] * proportionality_[c] * out.mie[t][0] / red : 0.0;
    }
  }
}

ScatteringTexels ScatteringFit::texels(std::span<const ScatteringSample> given,
                                       std::span<const std::array<double, 3>> sun_scale) const {
  std::vector<ScatteringSample> samples(given.begin(), given.end());
  for (std::size_t i = 0; i < samples.size() && !sun_scale.empty(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      samples[i].radiance[c] /= sun_scale[i / sample_nu_.size()][c];
      samples[i].mie[c] /= sun_scale[i / sample_nu_.size()][c];
      samples[i].smooth[c] /= sun_scale[i / sample_nu_.size()][c];
    }
  }
  ScatteringTexels out;
  at_nodes(samples, out);
  if (filling_ == TableFilling::kNodes) return out;
  // Without haze alpha's light would be red's alone to bend: the rule would colour it.
  const bool haze = std::ranges::any_of(samples, [](const auto& s) { return s.mie[0] > 0; });
  fit(samples, 0, haze || storage_ == MieStorage::kSeparate, out);
  for (std::size_t c = 1; c < 3; ++c) fit(samples, c, storage_ == MieStorage::kSeparate, out);
  return out;
}

double ScatteringFit::error(std::span<const ScatteringSample> samples,
                            const ScatteringTexels& texels) const {
  double sum = 0, weight = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t nu = i % sample_nu_.size();
    const Row r = row(i / sample_nu_.size(), nu);
    std::array<double, 3> star{}, mie{};
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t c = 0; c < 3; ++c) {
        star[c] += r.weight[a] * texels.star[r.texel[a]][c];
        mie[c] += r.weight[a] * texels.mie[r.texel[a]][c];
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      if (storage_ == MieStorage::kCombined && c > 0) {
        mie[c] = star[0] > 0 ? star[c] * proportionality_[c] * mie[0] / star[0] : 0.0;
      }
      if (!(samples[i].radiance[c] > 0)) continue;
      const double e = (rayleigh_[nu] * star[c] + mie_[nu] * mie[c]) / samples[i].radiance[c] - 1;
      sum += samples[i].weight * nu_weight_[nu] * e * e;
      weight += samples[i].weight * nu_weight_[nu];
    }
  }
  return weight > 0 ? std::sqrt(sum / weight) : 0.0;
}

}  // namespace twilight
