#include "sim/orders_gather.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/aerosol_emission.h"
#include "sim/angular_moments.h"
#include "sim/emission_kernel.h"
#include "sim/piece_point.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kRadPerDeg = pi / 180;
constexpr double kFine_rad = ZenithGrid::kFineStep_deg * kRadPerDeg;
constexpr double kSingleStep_rad = 0.1 * kRadPerDeg;

}  // namespace

double single_scattering_steps(const PathPiece& piece, double step_km) {
  return std::max(std::abs(piece.end_angle_rad - piece.start_angle_rad) / kSingleStep_rad,
                  std::abs(piece.end_altitude_km - piece.start_altitude_km) / step_km);
}

OrdersGather::OrdersGather(const OrdersAtmosphere& atmosphere, double solar_zenith_rad,
                           double observer_altitude_km)
    : air_(atmosphere),
      lanes_(atmosphere.lanes()),
      solar_zenith_{std::cos(solar_zenith_rad), std::sin(solar_zenith_rad)},
      observer_altitude_km_(observer_altitude_km) {}

OrdersGather::SunHere OrdersGather::sun_at(double psi, double azimuth) const {
  return sun_at({std::cos(psi), std::sin(psi)}, {std::cos(azimuth), std::sin(azimuth)});
}

OrdersGather::SunHere OrdersGather::sun_at(const Turn& psi, const Turn& azimuth) const {
  const auto [c, s] = solar_zenith_;
  const double x = c * psi.cosine + s * psi.sine * azimuth.cosine;
  const double along = psi.cosine * s * azimuth.cosine - psi.sine * c, across = azimuth.sine * s;
  const double sine = std::sqrt(along * along + across * across);
  if (sine < 1e-12) return {x > 0 ? 0 : pi, x > 0 ? 1.0 : -1.0, 0, 1, 0};
  return {std::atan2(sine, x), x, sine, along / sine, across / sine};
}

void OrdersGather::add_single(const RayPath& ray, double azimuth, Light light,
                              Spectrum& out) const {
  const Medium& m = air_.medium;
  const PathOptics& optics = air_.optics.optics;
  const std::size_t K = air_.kind_count(), W = m.wavelengths();
  const PhaseTable& table = light == Light::kTruncated ? *air_.truncated_phase : *air_.phase;
  std::vector<double> transmittance(lanes_, 1.0);
  std::vector<float> beam(lanes_), p11(lanes_), p12(lanes_), aerosol_i(lanes_), aerosol_q(lanes_);
  for (const PathPiece& piece : ray.pieces) {
    const int steps = std::max(1, static_cast<int>(std::ceil(single_scattering_steps(
                                      piece, air_.single_step_km[piece.layer]))));
    const double length = piece.length_km / steps;
    const double* extinction = &optics.extinction_per_km[piece.layer * lanes_];
    for (int k = 0; k < steps; ++k) {
      const double f = (k + 0.5) / steps;
      const auto [altitude, psi, theta] = point_on(piece, f, optics.earth_radius_km);
      const SunHere sun = sun_at(psi, azimuth);
      const bool lit = air_.sunlit->beam(altitude, sun.zenith_rad, beam.data());
      double cos_scatter = 1, cos_2a = 1, sin_2a = 0;
      if (lit) {
        const double a = air_.sunlight->apparent_zenith_rad(altitude, sun.zenith_rad);
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
          const float* per_km = &air_.kind_per_km[(piece.layer * K + q) * lanes_];
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
          const double air = air_.air_per_km[piece.layer * lanes_ + w];
          const double share = air_.optics.anisotropic_share[w];
          const double i =
              air * (share * 0.75 * (1 + c2) + 1 - share) + static_cast<double>(aerosol_i[w]);
          out.i[w] += weight * i;
          if (air_.options.polarised) {
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
  if (!ray.hits_ground || !air_.options.ground_light || light == Light::kScattered) return;
  const double psi = ray.pieces.empty() ? 0.0 : ray.pieces.back().end_angle_rad;
  const SunHere sun = sun_at(psi, azimuth);
  if (!air_.sunlit->beam(0, sun.zenith_rad, beam.data())) return;
  const double sine =
      std::max(0.0, std::cos(air_.sunlight->apparent_zenith_rad(0, sun.zenith_rad)));
  for (std::size_t w = 0; w < W; ++w) {
    out.i[w] +=
        transmittance[w] * air_.optics.ground_albedo[w] / pi * sine * static_cast<double>(beam[w]);
  }
}

void OrdersGather::add_multiple(const RayPath& ray, double azimuth, Light light,
                                Spectrum& out) const {
  const OrdersField& field = *air_.field;
  if (field.orders < 2) return;
  const OrdersMedium& optics = air_.optics;
  const std::size_t nodes = field.solar_zenith_rad.size();
  const std::size_t columns = 1 + optics.kinds.size();
  const std::size_t stokes = field.polarised ? 3 : 1;
  SampledPath path;
  sample_path(optics.optics, field.altitude_km, ray, kMultipleStep_rad, SourceShape::kCubic, path);
  std::vector<float> sum(stokes * lanes_, 0.0F), air_weight(lanes_);
  const int mode_degree = std::max(2, optics.degree);
  std::vector<float> modes(4 * stokes * mode_rows(mode_degree) * lanes_);
  std::vector<float> basis, kind_weight(lanes_);
  std::vector<float> scattered(4 * stokes * moment_count(optics.degree) * lanes_);
  const auto fine_at = [&](double zenith_rad, double& f) {
    const double u = std::clamp(zenith_rad / kFine_rad, 0.0,
                                static_cast<double>(ZenithGrid::kFineSize) - 1.000001);
    const auto k = static_cast<std::size_t>(u);
    f = u - static_cast<double>(k);
    return k;
  };
  for (std::size_t k = 0; k < path.samples.size(); ++k) {
    const PathSample& sample = path.samples[k];
    const double* weight = &path.weight[k * columns * lanes_];
    const auto level = static_cast<std::size_t>(sample.level);
    const SunHere sun = sun_at(sample.central_angle_rad, azimuth);
    const ZenithGrid::Stencil taps =
        ZenithGrid::stencil(air_.zenith.position(sun.zenith_rad), nodes);
    AirEmission<float> in;
    in.nodes = 4;
    in.lanes = lanes_;
    in.polarised = field.polarised;
    in.cos_theta = static_cast<float>(std::cos(sample.zenith_rad));
    in.sin_theta = static_cast<float>(std::sin(sample.zenith_rad));
    in.coherency = &air_.coherency[(level * nodes + taps.first) * 4 * lanes_];
    in.air_weight = air_weight.data();
    for (std::size_t w = 0; w < lanes_; ++w) {
      air_weight[w] = static_cast<float>(3 / (8 * pi) * weight[w]);
    }
    const auto present = [&](std::size_t kind) {
      const double* here = weight + (1 + kind) * lanes_;
      return std::any_of(here, here + lanes_, [](double x) { return x != 0; });
    };
    bool aerosol = false;
    for (std::size_t q = 0; q < optics.kinds.size(); ++q) aerosol = aerosol || present(q);
    aerosol = aerosol && level < field.aerosol_levels;
    in.degree = aerosol ? mode_degree : 2;
    air_modes(in, modes.data());
    if (aerosol) {
      fill_mode_basis(optics.degree, sample.zenith_rad, true, basis);
      const ArrivingMoments<float> arriving{
          4,
          lanes_,
          field.polarised,
          optics.degree,
          &air_.moments[(level * nodes + taps.first) * field.moments_per_node * lanes_],
          nullptr};
      AerosolPoints<float> points;
      points.nodes = 4;
      points.lanes = lanes_;
      points.polarised = field.polarised;
      points.degree = mode_degree;
      points.phase_degree = optics.degree;
      points.scattered = scattered.data();
      points.points = 1;
      points.basis[0] = basis.data();
      points.weight[0] = kind_weight.data();
      points.modes[0] = modes.data();
      for (std::size_t q = 0; q < optics.kinds.size(); ++q) {
        if (!present(q)) continue;
        for (std::size_t w = 0; w < lanes_; ++w) {
          kind_weight[w] = static_cast<float>(weight[(1 + q) * lanes_ + w]);
        }
        scatter_moments(arriving, optics.kinds[q], optics.degree, scattered.data());
        add_aerosol_modes(points);
      }
    }
    double f;
    const std::size_t fine = fine_at(sun.zenith_rad, f);
    const float* reference = &air_.reference[(level * ZenithGrid::kFineSize + fine) * lanes_];
    const std::size_t block = mode_rows(in.degree) * lanes_;
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
  if (!path.hits_ground || !air_.options.ground_light || light == Light::kScattered) return;
  const double psi = ray.pieces.empty() ? 0.0 : ray.pieces.back().end_angle_rad;
  const SunHere sun = sun_at(psi, azimuth);
  double f;
  const float* ground = &air_.ground[fine_at(sun.zenith_rad, f) * lanes_];
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
  if (light != Light::kSingle) add_multiple(ray, azimuth, light, out);
  // Here e_theta points down: a field along e_theta + e_phi lies anticlockwise of the vertical.
  for (double& u : out.u) u = -u;
  for (double& i : out.i) i = std::max(i, 0.0);
  return out;
}

OrdersGather::Spectrum OrdersGather::view(double elevation_rad, double relative_azimuth_rad,
                                          Light light) const {
  const auto follow = [&](const ColourRays& colours) {
    return colours.rays.follow(observer_altitude_km_, pi / 2 - elevation_rad);
  };
  const RayPath ray = follow(air_.colours[air_.middle_colour]);
  Spectrum out = along(ray, relative_azimuth_rad, light);
  if (std::abs(ray.deflection_rad) < kDispersedDeflection_rad) return out;
  for (std::size_t k = 0; k < air_.colours.size(); ++k) {
    if (k == air_.middle_colour) continue;
    const Spectrum part = along(follow(air_.colours[k]), relative_azimuth_rad, light);
    for (std::size_t w = air_.colours[k].first; w < air_.colours[k].last; ++w) {
      out.i[w] = part.i[w];
      out.q[w] = part.q[w];
      out.u[w] = part.u[w];
    }
  }
  return out;
}

}  // namespace twilight
