#include "sim/orders_gather.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/angular_moments.h"
#include "sim/orders_kernel.h"
#include "sim/piece_point.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kRadPerDeg = pi / 180;
constexpr double kFine_rad = ZenithGrid::kFineStep_deg * kRadPerDeg;
constexpr double kDark = 1e-30;
// Steps of single scattering: the Earth's shadow moves 0.1 degrees of zenith angle, sunlight
// changes by a few percent.
constexpr double kSingleStep_rad = 0.1 * kRadPerDeg, kSingleStep_km = 0.5;
constexpr double kMultipleStep_rad = 0.4 * kRadPerDeg;
// Rays bent by more than this are followed colour by colour: blue light bends 2 % more than red,
// which at 5 degrees of elevation is 0.2 arc minutes.
constexpr double kDispersedDeflection_rad = 8.0 / 60 * kRadPerDeg;
// Refractivities, relative, that share a ray.
constexpr double kSharedRefractivity = 0.008;

}  // namespace

OrdersGather::OrdersGather(const Inputs& inputs)
    : in_(inputs),
      lanes_(inputs.optics->lanes),
      zenith_(inputs.field->zenith_step_deg),
      kinds_(aerosol_kinds(*inputs.medium)),
      full_(kinds_, *inputs.optics, inputs.options, false),
      truncated_(kinds_, *inputs.optics, inputs.options, true),
      sunlit_(*inputs.sunlight, inputs.options, inputs.medium->wavelength_nm,
              inputs.medium->top_km(), inputs.options.sunlight_nodes / 2,
              inputs.solar_zenith_rad - inputs.reach_rad,
              inputs.solar_zenith_rad + inputs.reach_rad) {
  const Medium& m = *in_.medium;
  const OrdersField& field = *in_.field;
  for (std::size_t w = 0; w < m.wavelengths();) {
    std::size_t end = w + 1;
    while (end < m.wavelengths() && std::abs(m.refractivity(0, end) - m.refractivity(0, w)) <=
                                        kSharedRefractivity * m.refractivity(0, w)) {
      ++end;
    }
    if (w <= m.wavelengths() / 2) middle_ = colours_.size();
    colours_.push_back({w, end, RefractedRays(m, (w + end) / 2)});
    w = end;
  }
  const std::size_t layers = m.layers(), W = m.wavelengths(), K = kinds_.scattering_per_km.size();
  air_per_km_.assign(layers * lanes_, 0.0F);
  kind_per_km_.assign(layers * K * lanes_, 0.0F);
  for (std::size_t i = 0; i < layers; ++i) {
    for (std::size_t w = 0; w < W; ++w) {
      air_per_km_[i * lanes_ + w] = static_cast<float>(m.air_scattering_per_km(i, w));
      for (std::size_t q = 0; q < K; ++q) {
        kind_per_km_[(i * K + q) * lanes_ + w] =
            static_cast<float>(kinds_.scattering_per_km[q](i, w));
      }
    }
  }

  const std::size_t nodes = field.solar_zenith_rad.size(), levels = field.altitude_km.size();
  const double from = std::max(0.0, in_.solar_zenith_rad - in_.reach_rad);
  const double to = std::min(pi, in_.solar_zenith_rad + in_.reach_rad);
  first_fine_ = static_cast<std::size_t>(std::max(0.0, std::floor(from / kFine_rad) - 1));
  fine_count_ =
      std::min(static_cast<std::size_t>(std::ceil(to / kFine_rad)) + 3, ZenithGrid::kFineSize) -
      first_fine_;
  coherency_.assign(levels * nodes * 4 * lanes_, 0.0F);
  const std::size_t moments = field.moments_per_node;
  moments_.assign(field.aerosol_levels * nodes * moments * lanes_, 0.0F);
  reference_.assign(levels * fine_count_ * lanes_, 0.0F);
  ground_.assign(fine_count_ * lanes_, 0.0F);
  const auto refine = [&](const std::vector<double>& value, float* fine) {
    for (std::size_t k = 0; k < fine_count_; ++k) {
      const ZenithGrid::Stencil s =
          ZenithGrid::stencil(zenith_.fine_position()[first_fine_ + k], nodes);
      for (std::size_t w = 0; w < W; ++w) {
        double log_sum = 0, sum = 0;
        bool dark = false;
        for (std::size_t q = 0; q < 4; ++q) {
          const double v = value[(s.first + q) * W + w];
          dark = dark || !(v > kDark);
          sum += s.weight[q] * v;
          if (!dark) log_sum += s.weight[q] * std::log(v);
        }
        fine[k * lanes_ + w] = static_cast<float>(dark ? std::max(sum, 0.0) : std::exp(log_sum));
      }
    }
  };
  tbb::parallel_for(std::size_t{0}, levels, [&](std::size_t i) {
    std::vector<double> trace(nodes * W, 0.0);
    for (std::size_t j = 0; j < nodes; ++j) {
      for (std::size_t w = 0; w < W; ++w) {
        const float* C = &field.coherency[(i * nodes + j) * 4 * W + w];
        const double xx = C[0], yy = C[W], zz = C[2 * W];
        const double sum = xx + yy + zz;
        // Cubic paths may leave a trace of either sign where it is all but dark.
        if (!(sum > kDark) || std::min({xx, yy, zz}) < 0) continue;
        trace[j * W + w] = sum;
        const double share = in_.optics->anisotropic_share[w] / sum, mean = (1 - share * sum) / 3;
        float* out = &coherency_[(i * nodes + j) * 4 * lanes_ + w];
        out[0] = static_cast<float>(share * xx + mean);
        out[lanes_] = static_cast<float>(share * yy + mean);
        out[2 * lanes_] = static_cast<float>(share * zz + mean);
        out[3 * lanes_] = static_cast<float>(share * static_cast<double>(C[3 * W]));
        if (i >= field.aerosol_levels) continue;
        for (std::size_t k = 0; k < moments; ++k) {
          const std::size_t at = (i * nodes + j) * moments + k;
          moments_[at * lanes_ + w] =
              static_cast<float>(static_cast<double>(field.aerosol_moments[at * W + w]) / sum);
        }
      }
    }
    refine(trace, &reference_[i * fine_count_ * lanes_]);
  });
  refine({field.ground_irradiance.begin(), field.ground_irradiance.end()}, ground_.data());
}

OrdersGather::SunHere OrdersGather::sun_at(double psi, double azimuth) const {
  const double c = std::cos(in_.solar_zenith_rad), s = std::sin(in_.solar_zenith_rad);
  const double cp = std::cos(psi), sp = std::sin(psi), cf = std::cos(azimuth);
  const double x = c * cp + s * sp * cf;
  const double along = cp * s * cf - sp * c, across = std::sin(azimuth) * s;
  const double sine = std::hypot(along, across);
  if (sine < 1e-12) return {x > 0 ? 0 : pi, 1, 0};
  return {std::atan2(sine, x), along / sine, across / sine};
}

void OrdersGather::add_single(const RayPath& ray, double azimuth, Light light,
                              Spectrum& out) const {
  const Medium& m = *in_.medium;
  const PathOptics& optics = in_.optics->optics;
  const std::size_t K = kinds_.scattering_per_km.size(), W = m.wavelengths();
  const PhaseTable& table = light == Light::kTruncated ? truncated_ : full_;
  std::vector<double> transmittance(lanes_, 1.0);
  std::vector<float> beam(lanes_), p11(lanes_), p12(lanes_), aerosol_i(lanes_), aerosol_q(lanes_);
  for (const PathPiece& piece : ray.pieces) {
    const double turn = std::abs(piece.end_angle_rad - piece.start_angle_rad);
    const int steps = std::max(
        1, static_cast<int>(std::ceil(std::max(
               turn / kSingleStep_rad,
               std::abs(piece.end_altitude_km - piece.start_altitude_km) / kSingleStep_km))));
    const double length = piece.length_km / steps;
    const double* extinction = &optics.extinction_per_km[piece.layer * lanes_];
    for (int k = 0; k < steps; ++k) {
      const double f = (k + 0.5) / steps;
      const auto [altitude, psi, theta] = point_on(piece, f, optics.earth_radius_km);
      const SunHere sun = sun_at(psi, azimuth);
      const bool lit = sunlit_.beam(altitude, sun.zenith_rad, beam.data());
      double cos_scatter = 1, cos_2a = 1, sin_2a = 0;
      if (lit) {
        const double a = in_.sunlight->apparent_zenith_rad(altitude, sun.zenith_rad);
        // Sun and look direction in the local frame; e_theta, e_phi of the look direction.
        const double ct = std::cos(theta), st = std::sin(theta);
        const double ca = std::cos(a), sa = std::sin(a);
        cos_scatter = std::clamp(ct * ca + st * sa * sun.cos_azimuth, -1.0, 1.0);
        const double on_theta = sa * ct * sun.cos_azimuth - ca * st;
        const double on_phi = -sa * sun.sin_azimuth;
        const double n2 = on_theta * on_theta + on_phi * on_phi;
        if (n2 > 1e-24) {
          cos_2a = (on_theta * on_theta - on_phi * on_phi) / n2;
          sin_2a = 2 * on_theta * on_phi / n2;
        }
        std::fill(aerosol_i.begin(), aerosol_i.end(), 0.0F);
        std::fill(aerosol_q.begin(), aerosol_q.end(), 0.0F);
        const double angle = std::acos(cos_scatter);
        for (std::size_t q = 0; q < K; ++q) {
          if (optics.kind_present[piece.layer * K + q] == 0) continue;
          table.at(q, angle, p11.data(), p12.data());
          const float* per_km = &kind_per_km_[(piece.layer * K + q) * lanes_];
          for (std::size_t w = 0; w < W; ++w) {
            aerosol_i[w] += per_km[w] * p11[w];
            aerosol_q[w] += per_km[w] * p12[w];
          }
        }
      }
      const double c2 = cos_scatter * cos_scatter;
      for (std::size_t w = 0; w < W; ++w) {
        const double x = extinction[w] * length, e = std::exp(-x);
        if (lit && beam[w] > 0) {
          const double mean = x > 1e-6 ? (1 - e) / x : 1 - 0.5 * x;
          const double weight =
              transmittance[w] * length * mean * static_cast<double>(beam[w]) / (4 * pi);
          const double air = air_per_km_[piece.layer * lanes_ + w];
          const double share = in_.optics->anisotropic_share[w];
          const double i =
              air * (share * 0.75 * (1 + c2) + 1 - share) + static_cast<double>(aerosol_i[w]);
          out.i[w] += weight * i;
          if (in_.options.polarised) {
            const double along =
                weight * (static_cast<double>(aerosol_q[w]) - air * share * 0.75 * (1 - c2));
            out.q[w] += along * cos_2a;
            out.u[w] += along * sin_2a;
          }
        }
        transmittance[w] *= e;
      }
    }
  }
  if (!ray.hits_ground || !in_.options.ground_light) return;
  const double psi = ray.pieces.empty() ? 0.0 : ray.pieces.back().end_angle_rad;
  const SunHere sun = sun_at(psi, azimuth);
  if (!sunlit_.beam(0, sun.zenith_rad, beam.data())) return;
  const double sine = std::max(0.0, std::cos(in_.sunlight->apparent_zenith_rad(0, sun.zenith_rad)));
  for (std::size_t w = 0; w < W; ++w) {
    out.i[w] +=
        transmittance[w] * in_.optics->ground_albedo[w] / pi * sine * static_cast<double>(beam[w]);
  }
}

void OrdersGather::add_multiple(const RayPath& ray, double azimuth, Spectrum& out) const {
  const OrdersField& field = *in_.field;
  if (field.orders < 2) return;
  const OrdersMedium& optics = *in_.optics;
  const std::size_t nodes = field.solar_zenith_rad.size();
  const std::size_t columns = 1 + optics.kinds.size();
  const std::size_t stokes = field.polarised ? 3 : 1;
  const std::size_t degrees = static_cast<std::size_t>(optics.degree) + 1;
  SampledPath path;
  sample_path(optics.optics, field.altitude_km, ray, kMultipleStep_rad, SourceShape::kCubic, path);
  std::vector<float> sum(stokes * lanes_, 0.0F), air_weight(lanes_);
  std::vector<float> a1(degrees * lanes_), b1(a1), a2(a1), a3(a1);
  std::vector<float> p(moment_count(optics.degree)), r(p), t(p);
  const int mode_degree = std::max(2, optics.degree);
  std::vector<float> modes(4 * stokes * static_cast<std::size_t>(mode_degree + 1) * lanes_);
  const auto fine_at = [&](double zenith_rad, double& f) {
    const double u = std::clamp(zenith_rad / kFine_rad - static_cast<double>(first_fine_), 0.0,
                                static_cast<double>(fine_count_) - 1.000001);
    const auto k = static_cast<std::size_t>(u);
    f = u - static_cast<double>(k);
    return k;
  };
  for (std::size_t k = 0; k < path.samples.size(); ++k) {
    const PathSample& sample = path.samples[k];
    const double* weight = &path.weight[k * columns * lanes_];
    const auto level = static_cast<std::size_t>(sample.level);
    const SunHere sun = sun_at(sample.central_angle_rad, azimuth);
    const ZenithGrid::Stencil taps = ZenithGrid::stencil(zenith_.position(sun.zenith_rad), nodes);
    SourceModesInput<float> in;
    in.nodes = 4;
    in.lanes = lanes_;
    in.polarised = field.polarised;
    in.cos_theta = static_cast<float>(std::cos(sample.zenith_rad));
    in.sin_theta = static_cast<float>(std::sin(sample.zenith_rad));
    in.coherency = &coherency_[(level * nodes + taps.first) * 4 * lanes_];
    in.air_weight = air_weight.data();
    for (std::size_t w = 0; w < lanes_; ++w) {
      air_weight[w] = static_cast<float>(3 / (8 * pi) * weight[w]);
    }
    bool aerosol = false;
    for (std::size_t q = 0; q + 1 < columns; ++q) {
      const double* here = weight + (1 + q) * lanes_;
      if (std::all_of(here, here + lanes_, [](double x) { return x == 0; })) continue;
      if (!aerosol) {
        for (auto* v : {&a1, &b1, &a2, &a3}) std::fill(v->begin(), v->end(), 0.0F);
      }
      aerosol = true;
      const TruncatedPhase& kind = optics.kinds[q];
      for (std::size_t i = 0; i < a1.size(); ++i) {
        const double x = here[i % lanes_];
        a1[i] += static_cast<float>(x * kind.a1[i]);
        b1[i] += static_cast<float>(x * kind.b1[i]);
        a2[i] += static_cast<float>(x * kind.a2[i]);
        a3[i] += static_cast<float>(x * kind.a3[i]);
      }
    }
    if (aerosol && level < field.aerosol_levels) {
      const AngularBasis basis = angular_basis(optics.degree, sample.zenith_rad);
      for (int l = 0; l <= optics.degree; ++l) {
        for (int m = 0; m <= l; ++m) {
          const double factor = (m > 0 ? 2 : 1) / (4 * pi);
          const std::size_t i = moment_index(l, m);
          p[i] = static_cast<float>(factor * basis.p[i]);
          r[i] = static_cast<float>(factor * basis.r[i]);
          t[i] = static_cast<float>(factor * basis.t[i]);
        }
      }
      in.degree = mode_degree;
      in.phase_degree = optics.degree;
      in.stored_phase_degree = optics.degree;
      in.moments = &moments_[(level * nodes + taps.first) * field.moments_per_node * lanes_];
      in.p = p.data();
      in.r = r.data();
      in.t = t.data();
      in.a1 = a1.data();
      in.b1 = b1.data();
      in.a2 = a2.data();
      in.a3 = a3.data();
    }
    source_modes(in, modes.data());
    double f;
    const std::size_t fine = fine_at(sun.zenith_rad, f);
    const float* reference = &reference_[(level * fine_count_ + fine) * lanes_];
    const std::size_t block = static_cast<std::size_t>(in.degree + 1) * lanes_;
    double c = 1, s = 0;
    for (int m = 0; m <= in.degree; ++m) {
      const std::size_t row = static_cast<std::size_t>(m) * lanes_;
      for (std::size_t q = 0; q < 4; ++q) {
        const float* mode = &modes[q * stokes * block + row];
        const auto wc = static_cast<float>(taps.weight[q] * c);
        const auto ws = static_cast<float>(taps.weight[q] * s);
        for (std::size_t w = 0; w < lanes_; ++w) {
          const float steep =
              reference[w] + static_cast<float>(f) * (reference[lanes_ + w] - reference[w]);
          sum[w] += steep * wc * mode[w];
          if (stokes == 1) continue;
          sum[lanes_ + w] += steep * wc * mode[block + w];
          sum[2 * lanes_ + w] += steep * ws * mode[2 * block + w];
        }
      }
      const double next = c * sun.cos_azimuth - s * sun.sin_azimuth;
      s = s * sun.cos_azimuth + c * sun.sin_azimuth;
      c = next;
    }
  }
  for (std::size_t w = 0; w < lanes_; ++w) {
    out.i[w] += static_cast<double>(sum[w]);
    if (stokes == 1) continue;
    out.q[w] += static_cast<double>(sum[lanes_ + w]);
    out.u[w] += static_cast<double>(sum[2 * lanes_ + w]);
  }
  if (!path.hits_ground || !in_.options.ground_light) return;
  const double psi = ray.pieces.empty() ? 0.0 : ray.pieces.back().end_angle_rad;
  const SunHere sun = sun_at(psi, azimuth);
  double f;
  const float* ground = &ground_[fine_at(sun.zenith_rad, f) * lanes_];
  for (std::size_t w = 0; w < lanes_; ++w) {
    out.i[w] +=
        path.ground_transmittance[w] * optics.ground_albedo[w] / pi *
        std::lerp(static_cast<double>(ground[w]), static_cast<double>(ground[lanes_ + w]), f);
  }
}

OrdersGather::Spectrum OrdersGather::along(const RayPath& ray, double azimuth, Light light) const {
  Spectrum out{std::vector<double>(lanes_), std::vector<double>(lanes_),
               std::vector<double>(lanes_)};
  add_single(ray, azimuth, light, out);
  if (light != Light::kSingle) add_multiple(ray, azimuth, out);
  // Here e_theta points down: a field along e_theta + e_phi lies anticlockwise of the vertical.
  for (double& u : out.u) u = -u;
  for (double& i : out.i) i = std::max(i, 0.0);
  return out;
}

OrdersGather::Spectrum OrdersGather::view(double elevation_rad, double relative_azimuth_rad,
                                          Light light) const {
  const auto follow = [&](const Colours& colours) {
    return colours.rays.follow(in_.observer_altitude_km, pi / 2 - elevation_rad);
  };
  const RayPath ray = follow(colours_[middle_]);
  Spectrum out = along(ray, relative_azimuth_rad, light);
  if (std::abs(ray.deflection_rad) < kDispersedDeflection_rad) return out;
  for (std::size_t k = 0; k < colours_.size(); ++k) {
    if (k == middle_) continue;
    const Spectrum part = along(follow(colours_[k]), relative_azimuth_rad, light);
    for (std::size_t w = colours_[k].first; w < colours_[k].last; ++w) {
      out.i[w] = part.i[w];
      out.q[w] = part.q[w];
      out.u[w] = part.u[w];
    }
  }
  return out;
}

}  // namespace twilight
