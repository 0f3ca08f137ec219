#include "output/sky_tables.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <numbers>
#include <numeric>

#include "atmosphere/rayleigh.h"
#include "atmosphere/refraction.h"
#include "sim/elapsed_time.h"
#include "sim/horizontal_quadrature.h"
#include "sim/observer_ray.h"
#include "sim/sky_column.h"
#include "sim/solver_arena.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kDegree = pi / 180;
// Views keep this clear of grazing the ground.
constexpr double kClear_rad = 1e-7;
constexpr std::size_t kAzimuths = 13;  // of the columns, evenly over half a turn
constexpr std::size_t kScaleTexels = 256;
// Samples at cosines that a view and a Sun cannot have lose weight with the distance from those
// that they can have: neighbouring texels can.
constexpr double kBeyond = 0.01, kLeastWeight = 0.0001;

double geometric_horizon_rad(const TableLayout& layout, double r_km) {
  return -std::acos(std::min(1.0, layout.geometry().bottom_radius_km / r_km));
}

OrdersSky at_altitude(const TableSource& source, double altitude_km) {
  SceneModel model = source.model;
  model.scene.observer.height_m = 1e3 * altitude_km;
  return {model, source.sky.atmosphere(), RunControl{}};
}

ChannelTriple not_negative(ChannelTriple value) {
  for (double& v : value) v = std::max(v, 0.0);
  return value;
}

// Rounds to float without leaving its range.
float stored(double value) {
  constexpr double kMost = 3e38;
  return static_cast<float>(std::clamp(value, 0.0, kMost));
}

// Fills slices of the scattering table at one altitude.
class SliceFiller {
 public:
  SliceFiller(const TableSource& source, const TableLayout& layout, const ScatteringFit& fit,
              std::size_t slice)
      : source_(source),
        layout_(layout),
        fit_(fit),
        slice_(slice),
        r_km_(layout.scattering_r_km(static_cast<double>(slice))),
        altitude_km_(std::clamp(r_km_ - layout.geometry().bottom_radius_km, 0.0,
                                source.model.medium.top_km())),
        air_(*source.sky.atmosphere()),
        rays_(air_, altitude_km_) {
    const auto& middle = air_.colours[air_.middle_colour].rays;
    horizon_rad_ = pi / 2 - middle.horizon_apparent_zenith_rad(altitude_km_);
    std::vector<double> nodes;
    for (std::size_t k = 0; k < kAzimuths; ++k) {
      nodes.push_back(pi * static_cast<double>(k) / (kAzimuths - 1));
    }
    azimuths_ = CubicNodes(nodes, true);
    for (const double texel : fit.sample_sun()) {
      mu_s_.push_back(layout.scattering_mu_s(texel));
      gathers_.emplace_back(air_, std::acos(mu_s_.back()), altitude_km_);
      columns_.emplace_back(air_, gathers_.back(), std::acos(mu_s_.back()), false);
      // The view of the Sun's own elevation sees most angles from it. A Sun near the zenith is
      // seen at few: a lower one lends its shape.
      constexpr double kHighest_rad = pi / 4;
      const double elevation = std::clamp(std::asin(mu_s_.back()), 0.1, kHighest_rad);
      const double sun = std::min(std::asin(mu_s_.back()), kHighest_rad);
      const OrdersGather gather(air_, pi / 2 - sun, altitude_km_);
      reference_.push_back(SkyColumns(air_, gather, pi / 2 - sun, false)
                               .at(*rays_.at(elevation), azimuths_.nodes()));
      reference_mu_.push_back(std::sin(elevation));
      reference_mu_s_.push_back(std::sin(sun));
    }
  }

  // Light of every Sun and angle from it along one view; empty where there is no air in between.
  std::vector<ScatteringSample> samples(std::size_t j) {
    const bool ground = layout_.meets_ground_texel(static_cast<double>(j));
    if (ground && altitude_km_ <= 0) return {};
    const double mu = layout_.scattering_mu(r_km_, static_cast<double>(j));
    double elevation =
        apparent_elevation_rad(std::asin(mu), geometric_horizon_rad(layout_, r_km_), horizon_rad_);
    elevation = ground ? std::min(elevation, horizon_rad_ - kClear_rad)
                       : std::max(elevation, altitude_km_ > 0 ? horizon_rad_ + kClear_rad : 0.0);
    const auto ray = rays_.at(elevation);
    std::vector<ScatteringSample> out;
    for (std::size_t s = 0; s < mu_s_.size(); ++s) add_samples(*ray, mu, elevation, s, out);
    return out;
  }

  void fill(std::size_t j, std::span<const ChannelTriple> sun_scale, SkyTables& out) {
    const std::vector<ScatteringSample> light = samples(j);
    if (light.empty()) return;
    const ScatteringTexels texels = fit_.texels(light, sun_scale);
    negative_ += texels.clamped;
    const std::size_t suns = layout_.sizes().mu_s, nus = layout_.sizes().nu;
    for (std::size_t s = 0; s < suns; ++s) {
      for (std::size_t l = 0; l < nus; ++l) {
        float* star = out.scattering.at(l * suns + s, j, slice_);
        const std::size_t t = s * nus + l;
        for (std::size_t c = 0; c < 3; ++c) star[c] = stored(texels.star[t][c]);
        star[3] = stored(texels.mie[t][0]);
        if (!out.single_mie) continue;
        float* mie = out.single_mie->at(l * suns + s, j, slice_);
        for (std::size_t c = 0; c < 3; ++c) mie[c] = stored(texels.mie[t][c]);
      }
    }
  }

  std::size_t negative() const { return negative_; }
  std::size_t outside() const { return outside_; }

 private:
  void add_samples(const ObserverRay& ray, double mu, double elevation, std::size_t s,
                   std::vector<ScatteringSample>& out) {
    const SkyColumns& light = columns_[s];
    const std::vector<float> column = light.at(ray, azimuths_.nodes());
    const double mu_s = mu_s_[s];
    const double product = std::sqrt(std::max(0.0, (1 - mu * mu) * (1 - mu_s * mu_s)));
    const std::size_t L = air_.lanes(), W = air_.wavelengths(), kinds = air_.kind_count();
    std::vector<float> seen(L);
    std::vector<double> mie(W), smooth(W);
    for (const double nu : fit_.sample_nu()) {
      const double beyond = std::max(0.0, std::abs(nu - mu * mu_s) - product);
      const double cos_azimuth = product > 1e-9 ? (nu - mu * mu_s) / product : 0.0;
      const double azimuth = std::acos(std::clamp(cos_azimuth, -1.0, 1.0));
      SkyPoint p = light.point(elevation, azimuth);
      const double edge = nu - std::copysign(beyond, nu - mu * mu_s);
      if (beyond > 1e-9) {
        p.along = static_cast<float>(nu);
        p.below = 0;
        p.across = static_cast<float>(std::sqrt(std::max(0.0, 1 - nu * nu)));
      }
      const CubicNodes::Stencil at = azimuths_.at(azimuth);
      p.nodes = 4;
      for (std::size_t k = 0; k < 4; ++k) {
        p.node[k] = &column[at.node[k] * light.block()];
        p.weight[k] = static_cast<float>(at.weight[k]);
      }
      sky_radiance(p, seen.data());
      std::fill(mie.begin(), mie.end(), 0.0);
      const auto interpolated = [&](std::size_t quantity, std::size_t w) {
        double logarithm = 0;
        for (std::size_t k = 0; k < 4; ++k) {
          logarithm += at.weight[k] * static_cast<double>(p.node[k][quantity * L + w]);
        }
        return std::exp(logarithm);
      };
      for (std::size_t w = 0; w < W; ++w) {
        const double change = beyond > 1e-9 ? multiple(s, nu, w) - multiple(s, edge, w) : 0.0;
        const double scattered = interpolated(0, w);
        seen[w] += static_cast<float>(scattered * std::expm1(change));
        smooth[w] = scattered * std::exp(change) +
                    interpolated(1, w) * 4 * pi * rayleigh_phase_per_sr(nu, 0.0);
      }
      for (std::size_t q = 1; q <= kinds; ++q) {
        for (std::size_t w = 0; w < W; ++w) {
          mie[w] += 4 * pi * interpolated(1 + q, w);
        }
      }
      ScatteringSample sample;
      sample.weight = std::max(kLeastWeight, std::exp(-beyond / kBeyond));
      sample.radiance =
          source_.channels.radiance(std::span<const float>(seen.data(), air_.wavelengths()));
      for (const double value : sample.radiance) outside_ += value < 0 ? 1 : 0;
      sample.radiance = not_negative(sample.radiance);
      sample.mie = not_negative(source_.channels.radiance<double>(mie));
      sample.smooth = not_negative(source_.channels.radiance<double>(smooth));
      out.push_back(sample);
    }
  }

  // Logarithm of the multiply scattered light of the Sun's own elevation at a cosine from the Sun.
  double multiple(std::size_t s, double nu, std::size_t lane) const {
    const double mu = reference_mu_[s], mu_s = reference_mu_s_[s];
    const double product = std::sqrt(std::max(0.0, (1 - mu * mu) * (1 - mu_s * mu_s)));
    const double cosine = product > 1e-9 ? (nu - mu * mu_s) / product : 0.0;
    const CubicNodes::Stencil at = azimuths_.at(std::acos(std::clamp(cosine, -1.0, 1.0)));
    double logarithm = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const float* block = &reference_[s][at.node[k] * columns_[s].block()];
      logarithm += at.weight[k] * static_cast<double>(block[lane]);
    }
    return logarithm;
  }

  const TableSource& source_;
  const TableLayout& layout_;
  const ScatteringFit& fit_;
  std::size_t slice_;
  double r_km_, altitude_km_, horizon_rad_ = 0;
  const OrdersAtmosphere& air_;
  ObserverRays rays_;
  CubicNodes azimuths_;
  std::vector<double> mu_s_, reference_mu_, reference_mu_s_;
  std::vector<std::vector<float>> reference_;  // columns, [sun]
  std::deque<OrdersGather> gathers_;
  std::deque<SkyColumns> columns_;
  std::atomic<std::size_t> negative_{0}, outside_{0};
};

// Reference radiance of the Sun's axis: the geometric mean of three views from the ground.
Texture fill_sun_scale(const TableSource& source, const TableLayout& layout) {
  Texture out(kScaleTexels, 1);
  const std::vector<ViewDirection> views = {{pi / 2, 0.0}, {20 * kDegree, 0.0}, {20 * kDegree, pi}};
  const OrdersSky ground = at_altitude(source, 0.0);
  const std::span<const double> sun = source.model.solar_irradiance;
  const std::size_t W = sun.size();
  for (std::size_t i = 0; i < kScaleTexels; ++i) {
    const double u = static_cast<double>(i) / (kScaleTexels - 1);
    const double mu_s = layout.scattering_mu_s(u * static_cast<double>(layout.sizes().mu_s - 1));
    std::vector<double> light = ground.under(std::asin(mu_s))->radiance(views);
    float* texel = out.at(i, 0);
    for (std::size_t v = 0; v < views.size(); ++v) {
      for (std::size_t w = 0; w < W; ++w) light[v * W + w] /= sun[w];
      const ChannelTriple rgb = source.channels.radiance(std::span<const double>(&light[v * W], W));
      for (std::size_t c = 0; c < 3; ++c) {
        const double least = 1e-25 + 1e-3 * std::max({rgb[0], rgb[1], rgb[2]});
        texel[c] += static_cast<float>(std::log(std::max(rgb[c], least)) /
                                       static_cast<double>(views.size()));
      }
    }
    texel[3] = texel[0];
  }
  return out;
}

// The reference at the Suns of samples, as a reader interpolates it.
std::vector<ChannelTriple> sun_scale_at(const Texture& scale, const ScatteringFit& fit,
                                        std::size_t suns) {
  std::vector<ChannelTriple> out;
  for (const double texel : fit.sample_sun()) {
    const double x = texel / static_cast<double>(suns - 1) * (kScaleTexels - 1);
    const auto i = std::min(static_cast<std::size_t>(x), kScaleTexels - 2);
    ChannelTriple factor{};
    for (std::size_t c = 0; c < 3; ++c) {
      factor[c] = std::exp(std::lerp(static_cast<double>(scale.at(i, 0)[c]),
                                     static_cast<double>(scale.at(i + 1, 0)[c]),
                                     x - static_cast<double>(i)));
    }
    out.push_back(factor);
  }
  return out;
}

ChannelTriple proportionality(const TableConstants& k) {
  ChannelTriple out = {1, 1, 1};
  if (!(k.mie_per_km[0] > 0 && k.rayleigh_per_km[1] > 0 && k.rayleigh_per_km[2] > 0)) return out;
  for (std::size_t c = 0; c < 3; ++c) {
    out[c] = k.rayleigh_per_km[0] / k.mie_per_km[0] * k.mie_per_km[c] / k.rayleigh_per_km[c];
  }
  return out;
}

// Suns that the fit looks at inside each interval of mu_s: the wide ones of a high Sun hold more.
std::vector<int> suns_between(const TableLayout& layout) {
  constexpr double kStep_rad = 0.035;  // 2 degrees
  constexpr int kFewest = 3, kMost = 20;
  std::vector<int> counts;
  for (std::size_t k = 0; k + 1 < layout.sizes().mu_s; ++k) {
    const auto elevation = [&](std::size_t node) {
      return std::asin(std::clamp(layout.scattering_mu_s(static_cast<double>(node)), -1.0, 1.0));
    };
    const double width = std::abs(elevation(k + 1) - elevation(k));
    counts.push_back(std::clamp(static_cast<int>(std::ceil(width / kStep_rad)), kFewest, kMost));
  }
  return counts;
}

// Chooses the constants that a renderer's evaluation takes by what they leave of the light over
// a few views from the ground.
void fit_constants(const TableSource& source, const TableLayout& layout,
                   const SkyTableOptions& options, const std::vector<double>& nodes,
                   TableConstants& constants) {
  if (options.filling != TableFilling::kFitted || source.sky.atmosphere()->kind_count() == 0)
    return;
  const auto fit_of = [&](const TableConstants& k) {
    return ScatteringFit(suns_between(layout), nodes, k.mie_g, options.storage, options.filling,
                         proportionality(k));
  };
  const ScatteringFit any = fit_of(constants);
  SliceFiller filler(source, layout, any, 0);
  std::vector<std::vector<ScatteringSample>> rows;
  const double half = 0.5 * static_cast<double>(layout.sizes().mu);
  for (const double share : {0.03, 0.15, 0.4, 0.7, 0.95}) {
    rows.push_back(filler.samples(static_cast<std::size_t>(half + (1 - share) * (half - 1))));
  }
  const auto error = [&](const TableConstants& k) {
    const ScatteringFit fit = fit_of(k);
    std::vector<double> squares(rows.size());
    tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) {
      squares[i] = std::pow(fit.error(rows[i], fit.texels(rows[i])), 2);
    });
    return std::accumulate(squares.begin(), squares.end(), 0.0);
  };
  double least = error(constants);
  const auto keep_better = [&](const TableConstants& k) {
    const double found = error(k);
    if (!(found < least)) return;
    least = found;
    constants = k;
  };
  const TableConstants given = constants;
  for (int i = 30; !options.mie_g && i <= 45; ++i) {
    TableConstants k = given;
    k.mie_g = 0.02 * i;
    keep_better(k);
  }
  if (options.storage != MieStorage::kCombined || !(given.mie_per_km[0] > 0)) return;
  const TableConstants best = constants;
  for (const double power : {-1.0, -0.5, 0.0, 0.5, 1.5, 2.0}) {
    TableConstants k = best;
    for (std::size_t c = 1; c < 3; ++c) {
      k.mie_per_km[c] =
          k.mie_per_km[0] * std::pow(given.mie_per_km[c] / given.mie_per_km[0], power);
    }
    keep_better(k);
  }
}

}  // namespace

TableConstants table_constants(const TableSource& source, const SkyTableOptions& options) {
  TableConstants out;
  const Medium& m = source.model.medium;
  std::vector<double> air, mie, mie_extinction;
  for (std::size_t w = 0; w < m.wavelengths(); ++w) {
    air.push_back(m.air_scattering_per_km(0, w));
    mie.push_back(m.aerosol_scattering_per_km(0, w));
    mie_extinction.push_back(mie.back() + m.aerosol_absorption_per_km(0, w));
  }
  out.solar_irradiance = source.channels.solar_irradiance();
  out.rayleigh_per_km = not_negative(source.channels.mean(air));
  out.mie_per_km = not_negative(source.channels.mean(mie));
  out.mie_extinction_per_km = not_negative(source.channels.mean(mie_extinction));
  out.ground_albedo = not_negative(source.channels.mean(source.model.ground_albedo));
  out.mie_g = options.mie_g.value_or(0.8);
  return out;
}

double apparent_elevation_rad(double e, double geometric_horizon, double apparent_horizon) {
  if (e >= 0 || geometric_horizon >= 0) return e;
  if (e >= geometric_horizon) return e * apparent_horizon / geometric_horizon;
  return -pi / 2 + (e + pi / 2) * (apparent_horizon + pi / 2) / (geometric_horizon + pi / 2);
}

double straight_elevation_rad(double apparent, double geometric_horizon, double apparent_horizon) {
  return apparent_elevation_rad(apparent, apparent_horizon, geometric_horizon);
}

Texture fill_transmittance(const TableSource& source, std::size_t width, std::size_t height,
                           const std::function<RadiusCosine(TexelPoint)>& at) {
  const Medium& m = source.model.medium;
  Texture out(width, height);
  std::vector<RefractedRays> rays;
  for (std::size_t w = 0; w < m.wavelengths(); ++w) rays.emplace_back(m, w);
  tbb::parallel_for(std::size_t{0}, height, [&](std::size_t y) {
    std::vector<double> path(m.layers()), t(m.wavelengths());
    for (std::size_t x = 0; x < width; ++x) {
      const auto [r, mu] = at({static_cast<double>(x), static_cast<double>(y)});
      const double h = std::clamp(r - m.earth_radius_km, 0.0, m.top_km());
      const double horizon = -std::acos(std::min(1.0, m.earth_radius_km / r));
      float* texel = out.at(x, y);
      texel[3] = 1;
      if (std::asin(mu) < horizon - 1e-9) continue;
      for (std::size_t w = 0; w < m.wavelengths(); ++w) {
        const double own = pi / 2 - rays[w].horizon_apparent_zenith_rad(h);
        const double e = std::max(apparent_elevation_rad(std::asin(mu), horizon, own),
                                  h > 0 ? own + kClear_rad : 0.0);
        rays[w].trace_outward(h, pi / 2 - e, path);
        t[w] = std::exp(-slant_optical_depth(m, w, path));
      }
      const ChannelTriple mean = source.channels.mean(t);
      for (std::size_t c = 0; c < 3; ++c) {
        texel[c] = static_cast<float>(std::clamp(mean[c], 0.0, 1.0));
      }
    }
  });
  return out;
}

Texture fill_irradiance(const TableSource& source, const TableLayout& layout,
                        const RunControl& control) {
  constexpr int kElevations = 12, kAngles = 8;
  const LayoutSizes& n = layout.sizes();
  const OrdersAtmosphere& air = *source.sky.atmosphere();
  const Medium& m = source.model.medium;
  const auto [views, weight] = horizontal_quadrature(kElevations, kAngles);
  std::vector<RefractedRays> rays;
  for (std::size_t w = 0; w < m.wavelengths(); ++w) rays.emplace_back(m, w);
  Texture out(n.irradiance_mu_s, n.irradiance_r);
  for (std::size_t y = 0; y < n.irradiance_r; ++y) {
    control.report("irradiance", static_cast<double>(y) / static_cast<double>(n.irradiance_r));
    const double r = layout.irradiance_at({0, static_cast<double>(y)}).r_km;
    const double h = std::clamp(r - layout.geometry().bottom_radius_km, 0.0, m.top_km());
    tbb::parallel_for(std::size_t{0}, n.irradiance_mu_s, [&](std::size_t x) {
      control.check();
      const double mu_s =
          layout.irradiance_at({static_cast<double>(x), static_cast<double>(y)}).cosine;
      const double zenith = std::acos(mu_s);
      const OrdersGather gather(air, zenith, h);
      std::vector<double> diffuse(m.wavelengths(), 0.0), path(m.layers());
      for (std::size_t v = 0; v < views.size(); ++v) {
        const auto light = gather.view(views[v].elevation_rad, views[v].relative_azimuth_rad,
                                       OrdersGather::Light::kTruncated);
        for (std::size_t w = 0; w < m.wavelengths(); ++w) diffuse[w] += weight[v] * light.i[w];
      }
      // What the truncated phase functions leave in the beam is diffuse light.
      for (std::size_t w = 0; w < m.wavelengths(); ++w) {
        const auto apparent = rays[w].apparent_zenith_rad(h, zenith);
        if (!apparent || std::cos(*apparent) <= 0) continue;
        if (rays[w].trace_outward(h, *apparent, path).hits_ground) continue;
        const double beam = std::exp(-slant_optical_depth(m, w, path));
        const double truncated = std::exp(-slant_optical_depth(air.optics.truncated, w, path));
        diffuse[w] += std::cos(*apparent) * std::max(0.0, truncated - beam);
      }
      const ChannelTriple rgb = source.channels.radiance<double>(diffuse);
      float* texel = out.at(x, y);
      for (std::size_t c = 0; c < 3; ++c) texel[c] = stored(rgb[c]);
      texel[3] = 1;
    });
  }
  return out;
}

SkyTables fill_sky_tables(const TableSource& source, const TableLayout& layout,
                          const SkyTableOptions& options, const RunControl& control,
                          const std::vector<std::size_t>& slices) {
  const auto start = Clock::now();
  const LayoutSizes& n = layout.sizes();
  SkyTables out;
  out.constants = table_constants(source, options);
  const std::size_t width = n.nu * n.mu_s;
  out.scattering = Texture(width, n.mu, n.r);
  if (options.storage == MieStorage::kSeparate) out.single_mie = Texture(width, n.mu, n.r);
  std::vector<double> nodes;
  for (std::size_t l = 0; l < n.nu; ++l) {
    nodes.push_back(layout.scattering_nu(static_cast<double>(l)));
  }
  SolverArena arena(source.model.scene.solver.threads);
  control.report("renderer's constants", 0);
  arena.arena.execute([&] { fit_constants(source, layout, options, nodes, out.constants); });
  const ScatteringFit fit(suns_between(layout), nodes, out.constants.mie_g, options.storage,
                          options.filling, proportionality(out.constants));
  std::vector<std::size_t> wanted = slices;
  if (wanted.empty()) {
    for (std::size_t k = 0; k < n.r; ++k) wanted.push_back(k);
  }
  arena.arena.execute([&] {
    std::vector<ChannelTriple> scale;
    if (options.sun_scale) {
      out.sun_scale = fill_sun_scale(source, layout);
      scale = sun_scale_at(*out.sun_scale, fit, n.mu_s);
    }
    out.transmittance =
        fill_transmittance(source, n.transmittance_mu, n.transmittance_r,
                           [&](TexelPoint texel) { return layout.transmittance_at(texel); });
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      control.report("scattering table",
                     static_cast<double>(i) / static_cast<double>(wanted.size()));
      SliceFiller filler(source, layout, fit, wanted[i]);
      tbb::parallel_for(std::size_t{0}, n.mu, [&](std::size_t j) {
        control.check();
        filler.fill(j, scale, out);
      });
      out.negative_star += filler.negative();
      out.outside_rec709 += filler.outside();
    }
  });
  if (slices.empty()) {
    arena.arena.execute([&] { out.irradiance = fill_irradiance(source, layout, control); });
  }
  out.seconds = seconds_since(start);
  return out;
}

}  // namespace twilight
