#include "sim/view_ray.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
std::size_t idx(int i) { return static_cast<std::size_t>(i); }

}  // namespace

ViewPath trace_view(const Medium& medium, const RefractedRays& rays, double observer_height_km,
                    double elevation_rad, double max_step_km) {
  const double R = medium.earth_radius_km;
  const auto& b = medium.boundary_km;
  const RayPath ray = rays.follow(observer_height_km, kPi / 2 - elevation_rad);
  ViewPath path;
  path.steps.reserve(medium.layers() + 64);
  path.hits_ground = ray.hits_ground;
  if (ray.hits_ground) {
    path.ground_cosine = -std::sin(elevation_rad);
    if (!ray.pieces.empty()) {
      path.ground_angle_rad = ray.pieces.back().end_angle_rad;
      path.ground_cosine = -std::cos(ray.pieces.back().end_zenith_rad);
    }
  }
  // Height above the observer, the Earth's curvature without cancellation.
  const auto z_km = [&](double altitude, double angle) {
    const double half = std::sin(0.5 * angle);
    return altitude - observer_height_km - 2 * (R + altitude) * half * half;
  };
  // The pieces of a layer, one per shell, are cut anew into steps of equal length; a piece
  // is a chord with its sagitta.
  for (auto piece = ray.pieces.begin(); piece != ray.pieces.end();) {
    auto end = piece;
    double length = 0;
    for (; end != ray.pieces.end() && end->layer == piece->layer; ++end) length += end->length_km;
    const int parts = std::max(1, static_cast<int>(std::ceil(length / max_step_km)));
    const std::size_t layer = piece->layer;
    double before = 0;
    for (int i = 0; i < parts; ++i) {
      const double along = length * (i + 0.5) / parts;
      while (piece + 1 != end && before + piece->length_km < along) {
        before += piece->length_km;
        ++piece;
      }
      const double f = std::min(1.0, (along - before) / piece->length_km);
      const double x0 = (R + piece->start_altitude_km) * std::sin(piece->start_angle_rad);
      const double x1 = (R + piece->end_altitude_km) * std::sin(piece->end_angle_rad);
      const double z0 = z_km(piece->start_altitude_km, piece->start_angle_rad);
      const double z1 = z_km(piece->end_altitude_km, piece->end_angle_rad);
      const double d0 = piece->start_zenith_rad + piece->start_angle_rad;
      const double d1 = piece->end_zenith_rad + piece->end_angle_rad;
      const double direction = d0 + f * (d1 - d0);
      const double sagitta = 0.5 * f * (1 - f) * piece->length_km * (d1 - d0);
      ViewStep step;
      step.layer = static_cast<int>(layer);
      step.length_km = length / parts;
      step.dir_r = std::sin(direction);
      step.dir_z = std::cos(direction);
      step.rho_km = x0 + f * (x1 - x0) - sagitta * step.dir_z;
      step.z_km = z0 + f * (z1 - z0) + sagitta * step.dir_r;
      step.altitude_km = std::clamp(std::hypot(step.rho_km, R + observer_height_km + step.z_km) - R,
                                    b[layer], b[layer + 1]);
      path.steps.push_back(step);
    }
    piece = end;
  }
  return path;
}

ViewPath trace_view(const Medium& medium, std::size_t wavelength, bool refraction,
                    double observer_height_km, double elevation_rad, double max_step_km) {
  return trace_view(medium, RefractedRays(medium, wavelength, refraction), observer_height_km,
                    elevation_rad, max_step_km);
}

ViewGather::ViewGather(const GatherInputs& inputs)
    : in_(inputs), rays_(*inputs.medium, inputs.medium->wavelengths() / 2, inputs.refraction) {
  const auto& shells = in_.grid->shells();
  const auto& rings = in_.grid->rings();
  for (const CellShell& shell : shells) {
    if (shell.rings == 0) continue;
    ShellRows rows;
    rows.log_r = std::log(shell.r_km);
    rows.altitude_bands = shell.altitude_bands;
    rows.first = shell.first_ring;
    for (std::size_t i = 0; i < shell.rings; ++i) {
      const CellRing& ring = rings[shell.first_ring + i];
      rows.coordinate.push_back(shell.altitude_bands ? ring.altitude_km : ring.elevation_rad);
    }
    shells_.push_back(std::move(rows));
  }
  const Medium& m = *in_.medium;
  const std::size_t L = in_.optics->lanes;
  beam_extinction_.assign(m.layers() * L, 0.0F);
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      beam_extinction_[i * L + w] = static_cast<float>(in_.optics->beam_extinction(i, w));
    }
  }
}

StepCells ViewGather::cells_about(const ViewStep& step) const {
  StepCells cells;
  if (shells_.empty() || in_.exchange->field.values.empty()) return cells;
  const double log_r =
      0.5 * std::log(std::max(step.rho_km * step.rho_km + step.z_km * step.z_km, 1e-18));
  const auto it = std::upper_bound(shells_.begin(), shells_.end(), log_r,
                                   [](double v, const ShellRows& s) { return v < s.log_r; });
  const auto hi = static_cast<std::size_t>(it - shells_.begin());
  std::size_t a = hi == 0 ? 0 : hi - 1;
  std::size_t b = std::min(hi, shells_.size() - 1);
  const double t =
      a == b ? 0.0
             : std::clamp((log_r - shells_[a].log_r) / (shells_[b].log_r - shells_[a].log_r), 0.0,
                          1.0);
  const auto add = [&](const ShellRows& s, double weight) {
    if (weight <= 0) return;
    const auto& c = s.coordinate;
    const double x = s.altitude_bands ? step.altitude_km : std::atan2(step.z_km, step.rho_km);
    const auto up = static_cast<std::size_t>(std::upper_bound(c.begin(), c.end(), x) - c.begin());
    const std::size_t lo = up == 0 ? 0 : up - 1;
    const std::size_t hi_row = std::min(up, c.size() - 1);
    const double u = lo == hi_row ? 0.0 : (x - c[lo]) / (c[hi_row] - c[lo]);
    const auto put = [&](std::size_t row, double w) {
      if (w <= 0) return;
      cells.ring[cells.count] = s.first + row;
      cells.weight[cells.count++] = static_cast<float>(w);
    };
    put(lo, weight * (1 - u));
    if (hi_row != lo) put(hi_row, weight * u);
  };
  add(shells_[a], 1 - t);
  if (b != a) add(shells_[b], t);
  return cells;
}

// Light travels towards the observer: against the ray's tangent.
void ViewGather::add_emission(const ViewStep& step, const StepCells& cells, int j0, int j1, float f,
                              float* out) const {
  const CellField& field = in_.exchange->field;
  const float* fields[8];
  float weights[8];
  int n = 0;
  for (int k = 0; k < cells.count; ++k) {
    fields[n] = field.at(cells.ring[k], j0);
    weights[n++] = cells.weight[k] * (1 - f);
    if (f <= 0) continue;
    fields[n] = field.at(cells.ring[k], j1);
    weights[n++] = cells.weight[k] * f;
  }
  const ExchangeOptics& o = *in_.optics;
  const std::size_t at = idx(step.layer) * o.lanes;
  cell_emission(fields, weights, n, field.moments, o.lanes, &o.s0[at], &o.s1[at], &o.s2[at],
                static_cast<float>(-step.dir_r), static_cast<float>(-step.dir_z), out);
}

void ViewGather::multiple_emission(const ViewStep& step, int node, float* out) const {
  const StepCells cells = cells_about(step);
  if (cells.count == 0) {
    std::fill(out, out + in_.optics->lanes, 0.0F);
    return;
  }
  add_emission(step, cells, node, node, 0.0F, out);
}

ViewGather::Ray ViewGather::ray(double elevation_rad) const {
  const std::size_t L = in_.optics->lanes;
  Ray ray;
  ray.elevation_rad = elevation_rad;
  ray.path = trace_view(*in_.medium, rays_, in_.observer_height_km, elevation_rad, in_.max_step_km);
  const std::size_t steps = ray.path.steps.size();
  ray.march.lanes = L;
  ray.march.steps = static_cast<int>(steps);
  for (const ViewStep& step : ray.path.steps) {
    ray.march.length_km.push_back(static_cast<float>(step.length_km));
    ray.march.layer.push_back(step.layer);
    ray.cells.push_back(cells_about(step));
    ray.level.push_back(in_.sunlight->level(step.altitude_km));
  }
  ray.march.lit.assign(steps, 0);
  ray.march.sun_depth.assign(steps * L, 0.0F);
  ray.march.multiple.assign(steps * L, 0.0F);
  return ray;
}

void ViewGather::radiance(Ray& ray, double relative_azimuth_rad, float* out, Light light) const {
  const bool multiple = light != Light::kSingle;
  const Medium& m = *in_.medium;
  const ExchangeOptics& o = *in_.optics;
  const std::size_t L = o.lanes;
  const double R = m.earth_radius_km;
  // The Sun's plane is a mirror.
  const double azimuth = std::abs(std::remainder(relative_azimuth_rad, 2 * kPi));
  const int S = in_.grid->azimuth_divisions();
  const double node = azimuth / (2 * kPi) * S;
  const int j0 = std::min(static_cast<int>(node), S / 2);
  const int j1 = std::min(j0 + 1, S / 2);
  const auto f = static_cast<float>(std::clamp(node - j0, 0.0, 1.0));

  GatherMarch& march_ray = ray.march;
  const double sun_up = std::sin(in_.sun.elevation_rad);
  const double towards_sun = std::cos(in_.sun.elevation_rad) * std::cos(azimuth);
  march_ray.cosine = static_cast<float>(std::clamp(
      towards_sun * std::cos(ray.elevation_rad) + sun_up * std::sin(ray.elevation_rad), -1.0, 1.0));
  for (std::size_t i = 0; i < ray.path.steps.size(); ++i) {
    const ViewStep& step = ray.path.steps[i];
    const double cos_z =
        std::clamp((towards_sun * step.rho_km + sun_up * (R + in_.observer_height_km + step.z_km)) /
                       (R + step.altitude_km),
                   -1.0, 1.0);
    march_ray.lit[i] =
        in_.sunlight->attenuation(ray.level[i], std::acos(cos_z), &march_ray.sun_depth[i * L]);
    float* emission = &march_ray.multiple[i * L];
    if (multiple && ray.cells[i].count > 0) {
      add_emission(step, ray.cells[i], j0, j1, f, emission);
    } else {
      std::fill(emission, emission + L, 0.0F);
    }
  }
  std::fill(out, out + L, 0.0F);
  ray.transmittance.assign(L, 1.0F);
  GatherOptics coefficients{beam_extinction_.data(), o.air.data(), o.aerosol.data(),
                            o.asymmetry.data(), o.rayleigh_x2.data()};
  if (light == Light::kTruncated) {
    coefficients.s0 = o.s0.data();
    coefficients.s1 = o.s1.data();
    coefficients.s2 = o.s2.data();
  }
  march(march_ray, coefficients, out, ray.transmittance.data());
  if (ray.path.hits_ground && !in_.ground_albedo.empty()) {
    add_ground(ray, azimuth, j0, j1, f, multiple, out);
  }
  for (std::size_t w = m.wavelengths(); w < L; ++w) out[w] = 0.0F;
}

// Light that the ground reflects up the ray.
void ViewGather::add_ground(const Ray& ray, double azimuth, int j0, int j1, float f, bool multiple,
                            float* out) const {
  const Medium& m = *in_.medium;
  const std::size_t L = in_.optics->lanes;
  const double R = m.earth_radius_km;
  const double rho = R * std::sin(ray.path.ground_angle_rad);
  const double half = std::sin(ray.path.ground_angle_rad / 2);
  const double z = -in_.observer_height_km - 2 * R * half * half;
  const double cos_z = cos_solar_zenith(in_.sun, R, in_.observer_height_km, rho, azimuth, z);
  std::vector<float> exitance(L, 0.0F), depth(L, 0.0F);
  if (cos_z > 0 && in_.sunlight->attenuation(0.0, std::acos(cos_z), depth.data())) {
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      exitance[w] = static_cast<float>(in_.ground_albedo[w]) * static_cast<float>(cos_z) *
                    std::exp(-depth[w]);
    }
  }
  const auto& rings = in_.grid->rings();
  const std::size_t n_air = in_.grid->air_rings();
  if (multiple && rings.size() > n_air && !in_.exchange->ground_exitance.empty()) {
    std::size_t g = n_air;
    while (g + 1 < rings.size() && rings[g].rho_km < rho) ++g;
    const std::size_t g0 = g > n_air ? g - 1 : g;
    const double span = rings[g].rho_km - rings[g0].rho_km;
    const auto u =
        static_cast<float>(span > 0 ? std::clamp((rho - rings[g0].rho_km) / span, 0.0, 1.0) : 0.0);
    const std::size_t nodes = idx(in_.grid->azimuth_divisions() / 2 + 1);
    const auto at = [&](std::size_t ring, int j) {
      return &in_.exchange->ground_exitance[((ring - n_air) * nodes + idx(j)) * L];
    };
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      exitance[w] += (1 - u) * ((1 - f) * at(g0, j0)[w] + f * at(g0, j1)[w]) +
                     u * ((1 - f) * at(g, j0)[w] + f * at(g, j1)[w]);
    }
  }
  for (std::size_t w = 0; w < m.wavelengths(); ++w) {
    out[w] += ray.transmittance[w] * exitance[w] * static_cast<float>(1 / kPi);
  }
}

}  // namespace twilight
