#include "sim/sky_column.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/angular_moments.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kRadPerDeg = pi / 180;
constexpr double kFine_rad = ZenithGrid::kFineStep_deg * kRadPerDeg;
// Single scattering fainter than this share of the multiply scattered light is not told from none.
constexpr float kFaintShare = 1e-6F;

}  // namespace

SkyColumns::SkyColumns(const OrdersAtmosphere& atmosphere, const OrdersGather& gather,
                       double solar_zenith_rad, bool ground_light)
    : air_(atmosphere),
      gather_(gather),
      solar_zenith_rad_(solar_zenith_rad),
      ground_light_(ground_light && atmosphere.options.ground_light),
      L_(atmosphere.lanes()),
      scatterers_(1 + atmosphere.kind_count()),
      block_((1 + 3 * scatterers_) * L_),
      anisotropic_share_(atmosphere.optics.anisotropic_share.begin(),
                         atmosphere.optics.anisotropic_share.end()) {}

SkyPoint SkyColumns::point(double elevation_rad, double azimuth) const {
  SkyPoint p;
  p.scatterers = scatterers_;
  p.lanes = L_;
  const double ct = std::sin(elevation_rad), st = std::cos(elevation_rad);
  const double cs = std::cos(solar_zenith_rad_), ss = std::sin(solar_zenith_rad_);
  const double cf = std::cos(azimuth), sf = std::sin(azimuth);
  p.along = static_cast<float>(ct * cs + st * ss * cf);
  p.below = static_cast<float>(ss * ct * cf - cs * st);
  p.across = static_cast<float>(-ss * sf);
  p.anisotropic_share = anisotropic_share_.data();
  p.phase = air_.phase->values();
  return p;
}

std::vector<float> SkyColumns::at(const ObserverRay& ray, std::span<const double> azimuths) const {
  std::vector<float> out(azimuths.size() * block_, 0.0F);
  std::vector<float> light(azimuths.size() * L_, 0.0F);
  add_multiple(ray, azimuths, light.data());
  if (ray.hits_ground && ground_light_) add_ground(ray, azimuths, light.data());
  for (std::size_t a = 0; a < azimuths.size(); ++a) {
    std::copy_n(&light[a * L_], L_, &out[a * block_]);
  }
  add_single(ray, azimuths, out);
  for (std::size_t a = 0; a < azimuths.size(); ++a) {
    float* node = &out[a * block_];
    for (std::size_t w = 0; w < L_; ++w) {
      constexpr float kNone = 1e-35F;
      const float multiple = std::max(node[w], 0.0F);
      for (std::size_t s = 0; s < scatterers_; ++s) {
        float& single = node[(1 + s) * L_ + w];
        const float sum = ray.scatter_sum[s * L_ + w];
        const float known = single + kNightBeam * sum + kNone;
        node[(1 + scatterers_ + s) * L_ + w] /= known;
        node[(1 + 2 * scatterers_ + s) * L_ + w] /= known;
        single = std::log(single + kFaintShare * multiple + 1e-16F * sum + kNone);
      }
      node[w] = std::log(multiple + kNone);
    }
  }
  return out;
}

void SkyColumns::add_multiple(const ObserverRay& ray, std::span<const double> azimuths,
                              float* light) const {
  const OrdersField& field = *air_.field;
  const std::size_t nodes = field.solar_zenith_rad.size();
  const OrdersMedium& optics = air_.optics;
  const std::size_t degrees = static_cast<std::size_t>(optics.degree) + 1;
  const std::size_t most = std::max<std::size_t>(2, degrees - 1) + 1;
  std::vector<float> modes, air_weight(L_), a1(degrees * L_), b1(a1), p;
  std::vector<float> cosines(azimuths.size() * most);
  std::vector<EmissionTaps> taps(azimuths.size());
  std::vector<OrdersGather::Turn> azimuth;
  for (const double a : azimuths) azimuth.push_back({std::cos(a), std::sin(a)});
  p.resize(moment_count(optics.degree));
  for (std::size_t k = 0; k < ray.samples.size(); ++k) {
    const ObserverRay::Sample& sample = ray.samples[k];
    const float* weight = &ray.source_weight[k * scatterers_ * L_];
    // Zenith nodes that some azimuth's Sun lies among.
    const double psi = sample.central_angle_rad;
    const OrdersGather::Turn turn{std::cos(psi), std::sin(psi)};
    const double far = solar_zenith_rad_ + psi;
    const auto stencil = [&](double zenith_rad) {
      return ZenithGrid::stencil(air_.zenith.position(zenith_rad), nodes);
    };
    const std::size_t first = stencil(std::abs(solar_zenith_rad_ - psi)).first;
    const std::size_t end = stencil(std::min(far, 2 * pi - far)).first + 4;
    EmissionInput in;
    in.nodes = end - first;
    in.lanes = L_;
    in.cos_theta = sample.cos_zenith;
    in.sin_theta = sample.sin_zenith;
    in.coherency = &air_.coherency[(sample.level * nodes + first) * 4 * L_];
    for (std::size_t w = 0; w < L_; ++w) {
      air_weight[w] = static_cast<float>(3 / (8 * pi)) * weight[w];
    }
    in.air_weight = air_weight.data();
    if (sample.aerosol) {
      std::fill(a1.begin(), a1.end(), 0.0F);
      std::fill(b1.begin(), b1.end(), 0.0F);
      for (std::size_t q = 0; q + 1 < scatterers_; ++q) {
        const float* here = weight + (1 + q) * L_;
        if (std::all_of(here, here + L_, [](float x) { return x == 0; })) continue;
        const float* kind = &air_.kind_expansion[q * 2 * degrees * L_];
        for (std::size_t l = 0; l < degrees; ++l) {
          for (std::size_t w = 0; w < L_; ++w) {
            a1[l * L_ + w] += here[w] * kind[l * L_ + w];
            b1[l * L_ + w] += here[w] * kind[(degrees + l) * L_ + w];
          }
        }
      }
      air_.emission_basis(sample.zenith_rad, p.data());
      in.degree = optics.degree;
      in.moments = &air_.moments[(sample.level * nodes + first) * field.moments_per_node * L_];
      in.moments_per_node = field.moments_per_node;
      in.e_offset = field.polarised ? moment_count(optics.degree) : 0;
      in.p = p.data();
      in.a1 = a1.data();
      in.b1 = b1.data();
    }
    const std::size_t count = static_cast<std::size_t>(std::max(2, in.degree)) + 1;
    modes.resize(in.nodes * count * L_);
    emission_modes(in, modes.data());
    for (std::size_t a = 0; a < azimuths.size(); ++a) {
      const OrdersGather::SunHere sun = gather_.sun_at(turn, azimuth[a]);
      const ZenithGrid::Stencil s = stencil(sun.zenith_rad);
      EmissionTaps& t = taps[a];
      t.modes = &modes[(std::clamp(s.first, first, end - 4) - first) * count * L_];
      for (std::size_t q = 0; q < 4; ++q) t.weight[q] = static_cast<float>(s.weight[q]);
      float* c = &cosines[a * most];
      double now = 1, previous = sun.cos_azimuth;
      for (std::size_t m = 0; m < count; ++m) {
        c[m] = static_cast<float>(now);
        const double next = 2 * sun.cos_azimuth * now - previous;
        previous = now;
        now = next;
      }
      t.cosines = c;
      const double u =
          std::min(sun.zenith_rad / kFine_rad, static_cast<double>(ZenithGrid::kFineSize) - 1.001);
      const auto fine = static_cast<std::size_t>(u);
      t.share = static_cast<float>(u - static_cast<double>(fine));
      t.share_per_rad = static_cast<float>(-sun.cos_azimuth / kFine_rad);
      t.reference = &air_.reference[(sample.level * ZenithGrid::kFineSize + fine) * L_];
    }
    add_emission(taps.data(), azimuths.size(), count, L_, &ray.sample_angle_shift_rad[k * L_],
                 light);
  }
}

void SkyColumns::add_ground(const ObserverRay& ray, std::span<const double> azimuths,
                            float* light) const {
  std::vector<float> beam(L_);
  for (std::size_t a = 0; a < azimuths.size(); ++a) {
    const double zenith = gather_.sun_at(ray.ground_angle_rad, azimuths[a]).zenith_rad;
    std::fill(beam.begin(), beam.end(), 0.0F);
    air_.sunlit->beam(0, zenith, beam.data());
    const double sine = std::max(0.0, std::cos(air_.sunlight->apparent_zenith_rad(0, zenith)));
    const double u =
        std::min(zenith / kFine_rad, static_cast<double>(ZenithGrid::kFineSize) - 1.001);
    const auto fine = static_cast<std::size_t>(u);
    const double f = air_.field->orders < 2 ? 0 : u - static_cast<double>(fine);
    const double diffuse = air_.field->orders < 2 ? 0 : 1;
    const float* ground = &air_.ground[fine * L_];
    for (std::size_t w = 0; w < L_; ++w) {
      const double irradiance = sine * static_cast<double>(beam[w]) +
                                diffuse * std::lerp(static_cast<double>(ground[w]),
                                                    static_cast<double>(ground[L_ + w]), f);
      light[a * L_ + w] += static_cast<float>(static_cast<double>(ray.ground_transmittance[w]) *
                                              air_.optics.ground_albedo[w] / pi * irradiance);
    }
  }
}

void SkyColumns::add_single(const ObserverRay& ray, std::span<const double> azimuths,
                            std::vector<float>& out) const {
  const double cs = std::cos(solar_zenith_rad_), ss = std::sin(solar_zenith_rad_);
  const double ct = std::cos(ray.zenith_rad), st = std::sin(ray.zenith_rad);
  std::vector<BeamTaps> taps(ray.windows.size());
  for (std::size_t a = 0; a < azimuths.size(); ++a) {
    const double cf = std::cos(azimuths[a]), sf = std::sin(azimuths[a]);
    // The Sun in the view's vertical plane at the observer, unrefracted.
    const double along = ct * cs + st * ss * cf, below = ss * ct * cf - cs * st;
    for (std::size_t k = 0; k < ray.windows.size(); ++k) {
      const ObserverRay::Window& window = ray.windows[k];
      const OrdersGather::SunHere sun = gather_.sun_at(
          OrdersGather::Turn{window.cos_angle, window.sin_angle}, OrdersGather::Turn{cf, sf});
      BeamTaps& t = taps[k];
      t.sun = air_.sunlit->taps(window.place, sun.zenith_rad);
      t.above = static_cast<float>(window.place.above);
      t.share_per_rad = static_cast<float>(-sun.cos_azimuth / SunlitAir::step_rad());
      // The Sun lifted by refraction, at most 1.5 degrees.
      const double bend = t.sun.bending_rad, cb = 1 - 0.5 * bend * bend;
      const double sb = bend * (1 - bend * bend / 6);
      const double ca = sun.cos_zenith * cb + sun.sin_zenith * sb;
      const double sa = sun.sin_zenith * cb - sun.cos_zenith * sb;
      t.along = static_cast<float>(window.cos_zenith * ca +
                                   window.sin_zenith * sa * sun.cos_azimuth - along);
      t.below = static_cast<float>(sa * window.cos_zenith * sun.cos_azimuth -
                                   ca * window.sin_zenith - below);
    }
    BeamPath path;
    path.windows = ray.windows.size();
    path.scatterers = scatterers_;
    path.lanes = L_;
    path.taps = taps.data();
    path.scatter = ray.scatter.data();
    path.above_shift = ray.above_shift.data();
    path.angle_shift = ray.angle_shift_rad.data();
    float* node = &out[a * block_];
    add_beam(path, node + L_, node + (1 + scatterers_) * L_);
  }
}

}  // namespace twilight
