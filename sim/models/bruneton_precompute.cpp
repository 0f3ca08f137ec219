#include "sim/models/bruneton_precompute.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <numbers>
#include <string_view>
#include <utility>

#include "sim/gauss_legendre.h"
#include "sim/models/bruneton_path.h"
#include "sim/models/bruneton_source.h"

namespace twilight {
namespace {

using std::numbers::pi;

// Sunlight in single scattering is read from a finer table than the one kept for the run time.
constexpr BrunetonPlaneSize kFineTransmittance{128, 512};
// Where haze scatters less than this share of the molecules' light, its second and further
// scattering is left out.
constexpr double kNegligibleHaze = 1e-6;

class Precomputation {
 public:
  Precomputation(BrunetonTables& tables, const BrunetonOptions& options,
                 std::span<const double> albedo, const RunControl& control)
      : t_(tables),
        options_(options),
        albedo_(albedo),
        control_(control),
        size_(tables.rayleigh_and_multiple.size()),
        W_(tables.air.wavelengths()),
        fine_(tables.air, kFineTransmittance),
        rule_(gauss_legendre(options.view_samples, 0, 1)),
        source_(size_, W_),
        scattered_(size_, W_),
        delta_irradiance_(tables.irradiance.size()) {}

  void run(int orders) {
    single_scattering();
    for (int order = 1; order < orders; ++order) {
      source(order);
      irradiance(order);
      gather();
    }
  }

 private:
  // Runs work(k) for k < n, reporting progress and stopping where told.
  void each(std::string_view stage, std::size_t n, const std::function<void(std::size_t)>& work) {
    std::atomic<std::size_t> done = 0;
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n), [&](const auto& range) {
      for (std::size_t k = range.begin(); k < range.end(); ++k) {
        control_.check();
        work(k);
        control_.report(stage, static_cast<double>(++done) / static_cast<double>(n));
      }
    });
  }

  double radius(std::size_t i) const {
    return bruneton_radius_km(t_.air.sphere(), static_cast<double>(i), size_.r);
  }
  double mu_s(std::size_t l) const { return bruneton_mu_s(static_cast<double>(l), size_.mu_s); }
  double nu(std::size_t n) const { return bruneton_nu(static_cast<double>(n), size_.nu); }

  void single_scattering();
  void single_along(std::size_t i, std::size_t j);
  void source(int order);
  void source_at(int order, std::size_t i, std::size_t l);
  void light_before(int order, std::size_t i, std::size_t l, const BrunetonDirections& to,
                    std::vector<float>& light) const;
  void sky_before(int order, const TexelPair& r, const TexelPair& m, const TexelStencil& s,
                  double cosine, std::span<double> out) const;
  void ground_before(int order, double mu_s, std::span<double> out) const;
  void irradiance(int order);
  void gather();
  void gather_along(std::size_t i, std::size_t j);

  BrunetonTables& t_;
  const BrunetonOptions& options_;
  std::span<const double> albedo_;
  const RunControl& control_;
  BrunetonSize size_;
  std::size_t W_;
  BrunetonTransmittance fine_;
  std::vector<GaussNode> rule_;
  BrunetonScattering source_;     // dJ over the scattering coefficient: smoother than dJ
  BrunetonScattering scattered_;  // dS, from the second order on
  std::vector<float> delta_irradiance_;
};

void Precomputation::single_scattering() {
  each("single scattering", size_.r * size_.mu,
       [&](std::size_t k) { single_along(k / size_.mu, k % size_.mu); });
}

// Optical depths towards all Suns from one radius, looked up by the way to the top.
class SunRow {
 public:
  SunRow(const BrunetonSphere& sphere, const BrunetonTransmittance& table, std::size_t W)
      : sphere_(sphere), table_(table), wavelengths_(W), row_(table.size().cosine * W) {}

  void set_radius(double radius_km) {
    const BrunetonPlaneSize& size = table_.size();
    const TexelPair r = texel_pair(bruneton_r_texel(sphere_, radius_km, size.r), size.r);
    const float* low = &table_.values()[size.index(r.low, 0) * wavelengths_];
    const float* high = low + row_.size();
    const auto share = static_cast<float>(r.share);
    for (std::size_t k = 0; k < row_.size(); ++k) row_[k] = low[k] + share * (high[k] - low[k]);
    radius_ = radius_km;
    rho_ = sphere_.rho_km(radius_km);
    const double H = sphere_.horizon_km();
    rise_ = (H - rho_) * (H + rho_);
    shortest_ = sphere_.top_radius_km - radius_km;
    texels_per_km_ = static_cast<double>(size.cosine - 1) / (rho_ + H - shortest_);
  }
  // Depths at both texels and the second one's share; null behind the Earth.
  const float* find(double mu_s, float& share) const {
    const double b = radius_ * mu_s;
    if (b < -rho_) return nullptr;
    const double d = std::sqrt(b * b + rise_) - b;
    const TexelPair m = texel_pair((d - shortest_) * texels_per_km_, table_.size().cosine);
    share = static_cast<float>(m.share);
    return &row_[m.low * wavelengths_];
  }

 private:
  const BrunetonSphere& sphere_;
  const BrunetonTransmittance& table_;
  std::size_t wavelengths_;
  std::vector<float> row_;
  double radius_ = 0, rho_ = 0, rise_ = 0, shortest_ = 0, texels_per_km_ = 0;
};

void Precomputation::single_along(std::size_t i, std::size_t j) {
  const double r = radius(i);
  const BrunetonRay ray = bruneton_continued_ray(t_.air.sphere(), r, j, size_.mu);
  const BrunetonPath path = bruneton_path(t_.air, r, ray, rule_);
  std::vector<double> rayleigh(size_.nu * size_.mu_s * W_), mie(rayleigh.size());
  SunRow sun(t_.air.sphere(), fine_, W_);
  for (std::size_t k = 0; k < path.nodes(); ++k) {
    sun.set_radius(path.radius_km[k]);
    for (std::size_t at = 0; at < size_.nu * size_.mu_s; ++at) {
      const double cosine =
          (r * mu_s(at % size_.mu_s) + path.distance_km[k] * nu(at / size_.mu_s)) /
          path.radius_km[k];
      float share = 0;
      const float* depth = sun.find(std::clamp(cosine, -1.0, 1.0), share);
      if (depth == nullptr) continue;
      for (std::size_t w = 0; w < W_; ++w) {
        const double light = std::exp(-(depth[w] + share * (depth[w + W_] - depth[w])));
        rayleigh[at * W_ + w] += path.rayleigh[k * W_ + w] * light;
        mie[at * W_ + w] += path.mie[k * W_ + w] * light;
      }
    }
  }
  // [nu][mu_s] is the table's own order.
  const std::size_t first = size_.index(i, j, 0, 0);
  std::ranges::transform(rayleigh, t_.rayleigh_and_multiple.at(first),
                         [](double v) { return static_cast<float>(v); });
  std::ranges::transform(mie, t_.single_mie.at(first),
                         [](double v) { return static_cast<float>(v); });
}

// Radiance of the sky by the light of one order: the first from the terms kept apart, with their
// phase functions.
void Precomputation::sky_before(int order, const TexelPair& r, const TexelPair& m,
                                const TexelStencil& s, double cosine, std::span<double> out) const {
  const TexelPair n = texel_pair(bruneton_nu_texel(cosine, size_.nu), size_.nu);
  const double rayleigh = bruneton_rayleigh_phase(cosine);
  std::ranges::fill(out, 0.0);
  std::vector<double> haze_phase(W_);
  if (order == 1) {
    for (std::size_t w = 0; w < W_; ++w) haze_phase[w] = t_.air.mie_phase(w, cosine);
  }
  for (std::size_t corner = 0; corner < 32; ++corner) {
    const std::size_t a = corner & 1, b = corner >> 1 & 1, d = corner >> 2 & 1, c = corner >> 3;
    const double weight = (a ? r.share : 1 - r.share) * (b ? m.share : 1 - m.share) * s.weight[c] *
                          (d ? n.share : 1 - n.share);
    if (weight == 0) continue;
    const std::size_t at = size_.index(r.low + a, m.low + b, s.first + c, n.low + d);
    if (order == 1) {
      const float *single = t_.rayleigh_and_multiple.at(at), *haze = t_.single_mie.at(at);
      for (std::size_t w = 0; w < W_; ++w) {
        out[w] += weight * (rayleigh * single[w] + haze_phase[w] * haze[w]);
      }
    } else {
      const float* light = scattered_.at(at);
      for (std::size_t w = 0; w < W_; ++w) out[w] += weight * light[w];
    }
  }
  for (double& value : out) value = std::max(0.0, value);
}

// dE on the ground: of direct sunlight, or of the sky of the order before.
void Precomputation::ground_before(int order, double cosine, std::span<double> out) const {
  if (order == 1) {
    fine_.sunlight(t_.air.sphere().ground_radius_km, cosine, out);
    for (double& value : out) value *= std::max(0.0, cosine);
    return;
  }
  const BrunetonPlaneSize& size = t_.irradiance_size;
  const TexelStencil s = texel_stencil(bruneton_mu_s_texel(cosine, size.cosine), size.cosine, true);
  std::ranges::fill(out, 0.0);
  for (std::size_t c = 0; c < 4; ++c) {
    if (s.weight[c] == 0) continue;
    const float* at = &delta_irradiance_[size.index(0, s.first + c) * W_];
    for (std::size_t w = 0; w < W_; ++w) out[w] += s.weight[c] * at[w];
  }
}

void Precomputation::light_before(int order, std::size_t i, std::size_t l,
                                  const BrunetonDirections& to, std::vector<float>& light) const {
  const BrunetonSphere& sphere = t_.air.sphere();
  const double r = radius(i), sun = mu_s(l), sun_sine = std::sqrt(std::max(0.0, 1 - sun * sun));
  const TexelPair at_r{i, 0.0};
  const TexelStencil at_sun{l, {1, 0, 0, 0}};
  std::vector<double> sky(W_), ground(W_);
  BrunetonAir::Columns columns;
  for (std::size_t p = 0; p < to.mu.size(); ++p) {
    const BrunetonView view{to.mu[p], p < to.mu.size() / 2};
    const double d = bruneton_distance_km(sphere, r, view);
    const TexelPair m = mu_texel_pair(bruneton_distance_texel(sphere, r, d, view.ground, size_.mu),
                                      size_.mu, view.ground);
    if (view.ground) t_.air.columns(r, view.mu, 0, d, columns);
    const double sine = std::sqrt(std::max(0.0, 1 - view.mu * view.mu));
    for (std::size_t a = 0; a < to.cos_azimuth.size(); ++a) {
      const double cosine =
          std::clamp(view.mu * sun + sine * sun_sine * to.cos_azimuth[a], -1.0, 1.0);
      sky_before(order, at_r, m, at_sun, cosine, sky);
      if (view.ground) {
        ground_before(order, (r * sun + d * cosine) / sphere.ground_radius_km, ground);
        for (std::size_t w = 0; w < W_; ++w) {
          sky[w] += std::exp(-columns.extinction[w]) * albedo_[w] / pi * ground[w];
        }
      }
      const std::size_t k = p * to.cos_azimuth.size() + a;
      const double weight = to.polar_weight[p] * pi / static_cast<double>(to.cos_azimuth.size());
      for (std::size_t w = 0; w < W_; ++w) {
        light[w * to.size() + k] = static_cast<float>(weight * sky[w]);
      }
    }
  }
}

void Precomputation::source(int order) {
  each("scattered light", size_.r * size_.mu_s,
       [&](std::size_t k) { source_at(order, k / size_.mu_s, k % size_.mu_s); });
}

void Precomputation::source_at(int order, std::size_t i, std::size_t l) {
  const double r = radius(i), sun = mu_s(l), sun_sine = std::sqrt(std::max(0.0, 1 - sun * sun));
  const BrunetonDirections directions(t_.air.sphere(), r, options_.polar_directions,
                                      options_.azimuth_directions);
  std::vector<float> light(directions.size() * W_);
  light_before(order, i, l, directions, light);
  const BrunetonSource scatter(t_.air, directions, light);
  std::vector<double> rayleigh(W_), mie(W_), by_molecules(W_), by_haze(W_, 0.0);
  t_.air.scattering(r, rayleigh, mie);
  bool hazy = false;
  for (std::size_t w = 0; w < W_; ++w) hazy = hazy || mie[w] > kNegligibleHaze * rayleigh[w];
  for (std::size_t j = 0; j < size_.mu; ++j) {
    const double mu = bruneton_continued_ray(t_.air.sphere(), r, j, size_.mu).mu;
    const double sine = std::sqrt(std::max(0.0, 1 - mu * mu));
    for (std::size_t n = 0; n < size_.nu; ++n) {
      // Far beyond the angles that meet, no interpolation needs it.
      const double b =
          sun_sine > 0 ? std::clamp((nu(n) - mu * sun) / sun_sine, -sine - 1, sine + 1) : 0.0;
      scatter.rayleigh(mu, b, by_molecules);
      if (hazy) scatter.mie(std::clamp(mu, -1.0, 1.0), b, by_haze);
      float* out = source_.at(size_.index(i, j, l, n));
      for (std::size_t w = 0; w < W_; ++w) {
        const double all = rayleigh[w] + mie[w];
        out[w] =
            all > 0
                ? static_cast<float>((rayleigh[w] * by_molecules[w] + mie[w] * by_haze[w]) / all)
                : 0.0F;
      }
    }
  }
}

void Precomputation::irradiance(int order) {
  const BrunetonPlaneSize& size = t_.irradiance_size;
  std::vector<float> next(delta_irradiance_.size());
  each("irradiance", size.texels(), [&](std::size_t k) {
    const BrunetonSphere& sphere = t_.air.sphere();
    const double r = bruneton_radius_km(sphere, static_cast<double>(k / size.cosine), size.r);
    const double sun = bruneton_mu_s(static_cast<double>(k % size.cosine), size.cosine);
    const double sun_sine = std::sqrt(std::max(0.0, 1 - sun * sun));
    const TexelPair at_r = texel_pair(bruneton_r_texel(sphere, r, size_.r), size_.r);
    const TexelStencil at_sun =
        texel_stencil(bruneton_mu_s_texel(sun, size_.mu_s), size_.mu_s, true);
    std::vector<double> sky(W_), sum(W_, 0.0);
    // Upper hemisphere, crowding at the horizon.
    for (const GaussNode& g : gauss_legendre(options_.polar_directions / 2, 0, 1)) {
      const double mu = g.x * g.x, sine = std::sqrt(1 - mu * mu);
      const TexelPair m =
          mu_texel_pair(bruneton_mu_texel(sphere, r, {mu, false}, size_.mu), size_.mu, false);
      for (int a = 0; a < options_.azimuth_directions; ++a) {
        const double azimuth = (a + 0.5) * pi / options_.azimuth_directions;
        const double cosine = std::clamp(mu * sun + sine * sun_sine * std::cos(azimuth), -1.0, 1.0);
        sky_before(order, at_r, m, at_sun, cosine, sky);
        const double weight = 2 * g.x * g.weight * mu * 2 * pi / options_.azimuth_directions;
        for (std::size_t w = 0; w < W_; ++w) sum[w] += weight * sky[w];
      }
    }
    for (std::size_t w = 0; w < W_; ++w) {
      next[k * W_ + w] = static_cast<float>(sum[w]);
      t_.irradiance[k * W_ + w] += next[k * W_ + w];
    }
  });
  delta_irradiance_ = std::move(next);
}

void Precomputation::gather() {
  each("light along views", size_.r * size_.mu,
       [&](std::size_t k) { gather_along(k / size_.mu, k % size_.mu); });
}

void Precomputation::gather_along(std::size_t i, std::size_t j) {
  const BrunetonSphere& sphere = t_.air.sphere();
  const double r = radius(i);
  const BrunetonRay ray = bruneton_continued_ray(sphere, r, j, size_.mu);
  const BrunetonPath path = bruneton_path(t_.air, r, ray, rule_);
  const std::size_t row_size = size_.mu_s * W_;
  std::vector<float> row(row_size);
  std::vector<double> sum(size_.nu * row_size, 0.0), weight(W_), by_sun(size_.mu_s);
  const std::size_t cubic = size_.mu_s < 4 ? 2 : 4;
  const double suns = static_cast<double>(size_.mu_s - 1) / -std::expm1(-3.6);
  for (std::size_t k = 0; k < path.nodes(); ++k) {
    const double d = path.distance_km[k], radius_k = path.radius_km[k];
    const TexelPair a = texel_pair(bruneton_r_texel(sphere, radius_k, size_.r), size_.r);
    const TexelPair m = mu_texel_pair(
        bruneton_distance_texel(sphere, radius_k, ray.distance_km - d, ray.ground, size_.mu),
        size_.mu, ray.ground);
    const auto f00 = static_cast<float>((1 - a.share) * (1 - m.share));
    const auto f01 = static_cast<float>((1 - a.share) * m.share);
    const auto f10 = static_cast<float>(a.share * (1 - m.share));
    const auto f11 = static_cast<float>(a.share * m.share);
    for (std::size_t w = 0; w < W_; ++w) {
      weight[w] = path.rayleigh[k * W_ + w] + path.mie[k * W_ + w];
    }
    for (std::size_t l = 0; l < size_.mu_s; ++l) {
      by_sun[l] = std::exp(-3 * r * mu_s(l) / radius_k - 0.6);
    }
    for (std::size_t n = 0; n < size_.nu; ++n) {
      const float* s00 = source_.at(size_.index(a.low, m.low, 0, n));
      const float* s01 = source_.at(size_.index(a.low, m.low + 1, 0, n));
      const float* s10 = source_.at(size_.index(a.low + 1, m.low, 0, n));
      const float* s11 = source_.at(size_.index(a.low + 1, m.low + 1, 0, n));
      for (std::size_t q = 0; q < row_size; ++q) {
        row[q] = f00 * s00[q] + f01 * s01[q] + f10 * s10[q] + f11 * s11[q];
      }
      // u_mus of the Sun at this node, whose exponential is a product over Sun and angle.
      const double by_angle = std::exp(-3 * d * nu(n) / radius_k);
      for (std::size_t l = 0; l < size_.mu_s; ++l) {
        const double u = (1 - by_sun[l] * by_angle) * suns;
        const TexelStencil s = texel_stencil(u, size_.mu_s, true);
        double* to = &sum[n * row_size + l * W_];
        const float* from = &row[s.first * W_];
        for (std::size_t w = 0; w < W_; ++w) {
          double light = 0;
          for (std::size_t c = 0; c < cubic; ++c) light += s.weight[c] * from[c * W_ + w];
          to[w] += weight[w] * light;
        }
      }
    }
  }
  const std::size_t first = size_.index(i, j, 0, 0);
  float *delta = scattered_.at(first), *star = t_.rayleigh_and_multiple.at(first);
  for (double& value : sum) value = std::max(0.0, value);  // cubics may undershoot
  for (std::size_t n = 0; n < size_.nu; ++n) {
    const double phase = bruneton_rayleigh_phase(nu(n));
    for (std::size_t q = n * row_size; q < (n + 1) * row_size; ++q) {
      delta[q] = static_cast<float>(sum[q]);
      star[q] += static_cast<float>(sum[q] / phase);
    }
  }
}

std::size_t count(double value) { return static_cast<std::size_t>(value); }

// Leaves the Mie term of the wavelength nearest the paper's red alone.
void keep_red_mie(BrunetonTables& tables, std::span<const double> wavelength_nm) {
  constexpr double kRedNm = 680.0;
  const auto nearest =
      std::ranges::min_element(wavelength_nm, {}, [](double nm) { return std::abs(nm - kRedNm); });
  const auto kept = static_cast<std::size_t>(nearest - wavelength_nm.begin());
  BrunetonScattering red(tables.single_mie.size(), 1);
  for (std::size_t k = 0; k < red.size().texels(); ++k) *red.at(k) = tables.single_mie.at(k)[kept];
  tables.single_mie = std::move(red);
  tables.mie_wavelength = static_cast<int>(kept);
}

}  // namespace

int bruneton_orders(const SceneModel& model) {
  return model.scene.solver.scattering_orders.value_or(5);
}

std::shared_ptr<const BrunetonTables> bruneton_precompute(const SceneModel& model,
                                                          const BrunetonOptions& options,
                                                          int orders, const RunControl& control) {
  control.check();
  const auto& s = options.scattering_size;
  const BrunetonSize size{count(s[0]), count(s[1]), count(s[2]), count(s[3])};
  const std::size_t W = model.medium.wavelengths();
  BrunetonAir air(model);
  BrunetonTransmittance transmittance(
      air, {count(options.transmittance_size[0]), count(options.transmittance_size[1])});
  const BrunetonPlaneSize irradiance{count(options.irradiance_size[0]),
                                     count(options.irradiance_size[1])};
  auto tables = std::make_shared<BrunetonTables>(BrunetonTables{
      std::move(air), std::move(transmittance), irradiance,
      std::vector<float>(irradiance.texels() * W), BrunetonScattering(size, W),
      BrunetonScattering(size, W), orders, -1, options.sun_interpolation == "cubic"});
  Precomputation(*tables, options, model.ground_albedo, control).run(orders);
  if (options.proportional_mie) keep_red_mie(*tables, model.medium.wavelength_nm);
  return tables;
}

}  // namespace twilight
