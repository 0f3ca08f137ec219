#include "sim/cell_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;

// Altitude of a point at distance r and elevation el from an observer at height h0,
// written so that it does not cancel for small r.
double altitude_km(double earth_radius, double h0, double r, double sin_el) {
  const double q = earth_radius + h0;
  const double d2 = r * r + 2 * q * r * sin_el;
  return h0 + d2 / (std::sqrt(std::max(0.0, q * q + d2)) + q);
}

// Sine of the elevation at which altitude h is met at distance r; may lie outside [-1, 1].
double sin_elevation(double earth_radius, double h0, double r, double h) {
  return ((h - h0) * (2 * earth_radius + h + h0) - r * r) / (2 * (earth_radius + h0) * r);
}

}  // namespace

int layer_at(const Medium& medium, double altitude_km) {
  const auto& b = medium.boundary_km;
  const auto it = std::upper_bound(b.begin(), b.end(), altitude_km);
  const auto i = static_cast<int>(it - b.begin()) - 1;
  return std::clamp(i, 0, static_cast<int>(medium.layers()) - 1);
}

int shells_to_cover(int azimuth_divisions, double inner_radius_km, double outer_radius_km) {
  const double d = 2 * kPi / azimuth_divisions;
  const double q = (1 + d / 2) / (1 - d / 2);
  const double n = std::log(outer_radius_km / inner_radius_km) / std::log(q);
  return std::max(1, static_cast<int>(std::ceil(n - 1e-12)));
}

int shell_count(int azimuth_divisions, double inner_radius_km, double outer_radius_km) {
  const int n = shells_to_cover(azimuth_divisions, inner_radius_km, outer_radius_km);
  const double d = 2 * kPi / azimuth_divisions;
  const double q = (1 + d / 2) / (1 - d / 2);
  const double last_centre = inner_radius_km * std::pow(q, n - 1) * 0.5 * (1 + q);
  return std::max(1, last_centre > outer_radius_km ? n - 1 : n);
}

double outer_radius_km(const Medium& medium, double observer_height_km) {
  const double R = medium.earth_radius_km;
  const double top = medium.top_km();
  const double to_top = std::sqrt(top * top + 2 * R * top);
  const double to_observer =
      std::sqrt(observer_height_km * observer_height_km + 2 * R * observer_height_km);
  return to_top + to_observer;
}

CellGrid::CellGrid(const Medium& medium, const CellGridOptions& options) : options_(options) {
  const double R = medium.earth_radius_km;
  const double top = medium.top_km();
  const double h0 = options.observer_height_km;
  const int S = options.azimuth_divisions;
  if (S < 4 || S % 2 != 0) throw std::invalid_argument("azimuth_divisions must be even and >= 4");
  earth_radius_km_ = R;
  outer_radius_km_ = twilight::outer_radius_km(medium, h0);
  const double d = 2 * kPi / S;
  const double q = (1 + d / 2) / (1 - d / 2);
  const double inner = std::min(options.inner_radius_km, 0.5 * outer_radius_km_);
  all_shells_ = shell_count(S, inner, outer_radius_km_);
  const int stride = std::clamp(options.active_shell_stride, 1, all_shells_);

  const auto shell_edge = [&](int j) { return j == 0 ? inner : inner * std::pow(q, j); };
  outer_radius_km_ = shell_edge(all_shells_);
  for (int first = 0; first < all_shells_; first += stride) {
    const int last = std::min(first + stride, all_shells_);
    CellShell shell;
    if (options.group_shells) {
      shell.r_min_km = shell_edge(first);
      shell.r_max_km = shell_edge(last);
    } else {
      // The middle of each group is the active shell.
      const int active = std::min(first + stride / 2, all_shells_ - 1);
      shell.r_min_km = shell_edge(active);
      shell.r_max_km = shell_edge(active + 1);
    }
    shell.r_km = 0.5 * (shell.r_min_km + shell.r_max_km);
    shells_.push_back(shell);
  }

  for (std::size_t s = 0; s < shells_.size(); ++s) {
    CellShell& shell = shells_[s];
    shell.first_ring = rings_.size();
    const double r = shell.r_km;
    shell.altitude_bands = options.cell_height_km > 0 && r * d > options.cell_height_km;
    if (shell.altitude_bands) {
      const double reach = altitude_km(R, h0, shell.r_max_km, 1.0);
      shell.lower_edge = std::max(0.0, altitude_km(R, h0, shell.r_max_km, -1.0));
      shell.upper_edge = std::min(top, reach);
      const double height = shell.upper_edge - shell.lower_edge;
      const int n = std::max(1, static_cast<int>(std::ceil(height / options.cell_height_km)));
      for (int k = 0; k < n; ++k) {
        ring_lower_.push_back(shell.lower_edge + height * k / n);
        ring_upper_.push_back(shell.lower_edge + height * (k + 1) / n);
        CellRing ring;
        ring.shell = static_cast<int>(s);
        rings_.push_back(ring);
      }
    } else {
      const int half = S / 2;
      for (int k = 0; k < half; ++k) {
        const double lower = -kPi / 2 + d * k;
        const double upper = lower + d;
        const double h = altitude_km(R, h0, r, std::sin(0.5 * (lower + upper)));
        // The paper's rule: a cell counts when its centre is above the ground
        // (and within the air). Means also keep cells that are partly so.
        double lowest = h, highest = h;
        if (options.cell_means) {
          for (const double re : {shell.r_min_km, shell.r_max_km}) {
            lowest = std::min(lowest, altitude_km(R, h0, re, std::sin(lower)));
            highest = std::max(highest, altitude_km(R, h0, re, std::sin(upper)));
          }
        }
        if (highest <= 0 || lowest >= top) continue;
        ring_lower_.push_back(lower);
        ring_upper_.push_back(upper);
        CellRing ring;
        ring.shell = static_cast<int>(s);
        rings_.push_back(ring);
      }
    }
    shell.rings = rings_.size() - shell.first_ring;
  }

  // Reference point, volume and size of each ring's cell.
  std::vector<char> keep(rings_.size(), 1);
  for (std::size_t i = 0; i < rings_.size(); ++i) {
    CellRing& ring = rings_[i];
    const CellShell& shell = shells_[static_cast<std::size_t>(ring.shell)];
    const double lo = ring_lower_[i], hi = ring_upper_[i];
    const double mid = 0.5 * (lo + hi);
    const double sin_mid = shell.altitude_bands
                               ? std::clamp(sin_elevation(R, h0, shell.r_km, mid), -1.0, 1.0)
                               : std::sin(mid);
    ring.radius_km = shell.r_km;
    ring.elevation_rad = std::asin(sin_mid);
    ring.rho_km = shell.r_km * std::sqrt(std::max(0.0, 1 - sin_mid * sin_mid));
    ring.z_km = shell.r_km * sin_mid;
    ring.altitude_km = altitude_km(R, h0, shell.r_km, sin_mid);
    const double full =
        shell.altitude_bands
            ? d * 0.5 * (shell.r_max_km * shell.r_max_km - shell.r_min_km * shell.r_min_km) *
                  (hi - lo) * (R + mid) / (R + h0)
            : d * (std::pow(shell.r_max_km, 3) - std::pow(shell.r_min_km, 3)) / 3 *
                  (std::sin(hi) - std::sin(lo));
    if (options.cell_means) {
      const auto points = samples(ring, medium);
      double volume = 0, rho = 0, z = 0, weight = 0;
      for (const auto& p : points) {
        volume += p.volume_km3;
        // The reference point is where the scattering air of the cell is.
        const double air = p.volume_km3 * std::exp(-(p.altitude_km - ring.altitude_km) / 8.0);
        rho += air * p.rho_km;
        z += air * p.z_km;
        weight += air;
        auto& share = ring.layer_volume_km3;
        if (!share.empty() && share.back().first == p.layer) {
          share.back().second += p.volume_km3;
        } else {
          const auto found = std::find_if(share.begin(), share.end(),
                                          [&](const auto& e) { return e.first == p.layer; });
          if (found != share.end()) {
            found->second += p.volume_km3;
          } else {
            share.emplace_back(p.layer, p.volume_km3);
          }
        }
      }
      if (volume <= 1e-6 * full) {
        keep[i] = 0;
        continue;
      }
      ring.volume_km3 = volume;
      ring.rho_km = rho / weight;
      ring.z_km = z / weight;
      ring.radius_km = std::hypot(ring.rho_km, ring.z_km);
      ring.elevation_rad = std::atan2(ring.z_km, ring.rho_km);
      const double h = altitude_km(R, h0, ring.radius_km, std::sin(ring.elevation_rad));
      ring.altitude_km = std::clamp(h, 0.0, top);
      if (h != ring.altitude_km) {
        // The mean of a cell that bends with the Earth may lie below ground: moved up to it.
        const double lift = (R + ring.altitude_km) / (R + h);
        ring.z_km = ring.z_km * lift + (R + h0) * (lift - 1);
        ring.rho_km *= lift;
        ring.radius_km = std::hypot(ring.rho_km, ring.z_km);
        ring.elevation_rad = std::atan2(ring.z_km, ring.rho_km);
      }
    } else {
      if (ring.altitude_km <= 0 || ring.altitude_km >= top) {
        keep[i] = 0;
        continue;
      }
      ring.volume_km3 = full;
    }
    ring.layer = layer_at(medium, ring.altitude_km);
    if (!options.cell_means) ring.layer_volume_km3 = {{ring.layer, ring.volume_km3}};
    const double radial = shell.r_max_km - shell.r_min_km;
    const double azimuthal = std::max(d * ring.rho_km, 1e-9);
    const double vertical = ring.volume_km3 / (radial * azimuthal);
    ring.half_chord_km = radial * azimuthal * vertical /
                         (radial * azimuthal + azimuthal * vertical + radial * vertical);
    ring.radial_km = radial;
    ring.azimuthal_km = azimuthal;
    ring.third_km = vertical;
  }
  {
    std::vector<CellRing> kept;
    std::vector<double> lower, upper;
    for (auto& shell : shells_) {
      const std::size_t first = shell.first_ring;
      const std::size_t n = shell.rings;
      shell.first_ring = kept.size();
      for (std::size_t i = first; i < first + n; ++i) {
        if (!keep[i]) continue;
        kept.push_back(rings_[i]);
        lower.push_back(ring_lower_[i]);
        upper.push_back(ring_upper_[i]);
      }
      shell.rings = kept.size() - shell.first_ring;
    }
    rings_ = std::move(kept);
    ring_lower_ = std::move(lower);
    ring_upper_ = std::move(upper);
  }
  air_rings_ = rings_.size();

  // Ground rings: annuli cut by the same shells, the innermost from the nadir.
  double previous_angle = 0.0;
  for (std::size_t s = 0; s < shells_.size(); ++s) {
    // Consecutive annuli must tile the ground even where only single shells are active.
    const double r_edge = s + 1 < shells_.size()
                              ? 0.5 * (shells_[s].r_max_km + shells_[s + 1].r_min_km)
                              : outer_radius_km_;
    if (r_edge <= h0 * (1 + 1e-12)) continue;
    // chord^2 = R^2 + (R+h0)^2 - 2 R (R+h0) cos(angle)
    const double half = std::sqrt((r_edge * r_edge - h0 * h0) / (4 * R * (R + h0)));
    if (half >= 1) break;
    const double angle = 2 * std::asin(half);
    if (angle <= previous_angle) continue;
    CellRing ring;
    ring.ground = true;
    ring.shell = static_cast<int>(s);
    const double mean = 0.5 * (angle + previous_angle);
    ring.rho_km = R * std::sin(mean);
    ring.z_km = -h0 - 2 * R * std::sin(mean / 2) * std::sin(mean / 2);
    ring.radius_km = std::hypot(ring.rho_km, ring.z_km);
    ring.elevation_rad = std::atan2(ring.z_km, ring.rho_km);
    ring.altitude_km = 0;
    ring.layer = 0;
    ring.volume_km3 = d * R * R * 2 * std::sin(mean) * std::sin(0.5 * (angle - previous_angle));
    ring.radial_km = R * (angle - previous_angle);
    ring.azimuthal_km = d * ring.rho_km;
    ring.slope_r = std::sin(mean);
    ring.slope_z = std::cos(mean);
    rings_.push_back(ring);
    previous_angle = angle;
  }
}

std::vector<CellSample> CellGrid::samples(const CellRing& ring, const Medium& medium) const {
  const double R = earth_radius_km_;
  const double h0 = options_.observer_height_km;
  const double top = medium.top_km();
  const double d = 2 * kPi / options_.azimuth_divisions;
  const auto index = static_cast<std::size_t>(&ring - rings_.data());
  const CellShell& shell = shells_[static_cast<std::size_t>(ring.shell)];
  const double lo = ring_lower_[index], hi = ring_upper_[index];
  const double dr = shell.r_max_km - shell.r_min_km;
  const int n_r = std::max(2, static_cast<int>(std::ceil(dr / 25.0)));
  const double height = shell.altitude_bands ? hi - lo : shell.r_km * (hi - lo);
  const int n_e = std::clamp(static_cast<int>(std::ceil(height / 0.5)), 2, 12);
  std::vector<CellSample> points;
  points.reserve(static_cast<std::size_t>(n_r * n_e));
  for (int i = 0; i < n_r; ++i) {
    const double r0 = shell.r_min_km + dr * i / n_r;
    const double r1 = shell.r_min_km + dr * (i + 1) / n_r;
    const double r = 0.5 * (r0 + r1);
    for (int k = 0; k < n_e; ++k) {
      const double c0 = lo + (hi - lo) * k / n_e;
      const double c1 = lo + (hi - lo) * (k + 1) / n_e;
      const double c = 0.5 * (c0 + c1);
      double sin_el, h, volume;
      if (shell.altitude_bands) {
        sin_el = sin_elevation(R, h0, r, c);
        if (std::abs(sin_el) > 1) continue;
        h = c;
        volume = d * 0.5 * (r1 * r1 - r0 * r0) * (c1 - c0) * (R + c) / (R + h0);
      } else {
        sin_el = std::sin(c);
        h = altitude_km(R, h0, r, sin_el);
        if (h < 0 || h >= top) continue;
        volume = d * (r1 * r1 * r1 - r0 * r0 * r0) / 3 * (std::sin(c1) - std::sin(c0));
      }
      points.push_back(
          {r * std::sqrt(1 - sin_el * sin_el), r * sin_el, h, layer_at(medium, h), volume});
    }
  }
  return points;
}

}  // namespace twilight
