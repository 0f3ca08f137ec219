#include "sim/orders_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/angular_moments.h"
#include "sim/gauss_legendre.h"
#include "sim/orders_kernel.h"

namespace twilight {

using std::numbers::pi;

std::vector<PolarDirection> polar_directions(double radius_km, double altitude_km, int count) {
  std::vector<PolarDirection> directions;
  const double sine = std::min(1.0, radius_km / (radius_km + altitude_km));
  const double dip = std::acos(sine);  // of the horizon below the horizontal
  const bool limb = altitude_km > 1e-3;
  // However few, enough above and below that moments of the light integrate to what they are: with
  // two directions in the upper half, thick white haze scattered more than arrived.
  const int down = std::max(count < 12 ? 3 : 4, count / 6);
  const int middle = limb ? std::max(2, std::min(5 * count / 12, (count - 6) / 2)) : 0;
  const int up = count - down - middle;
  for (const GaussNode& g : gauss_legendre(up, 0, 1)) {
    directions.push_back({std::acos(g.x * g.x), 2 * g.x * g.weight});
  }
  if (limb) {
    for (const GaussNode& g : gauss_legendre(middle, 0, dip)) {
      directions.push_back({pi / 2 + g.x, std::cos(g.x) * g.weight});
    }
  }
  const double edge = limb ? std::sin(dip) : 0.0;
  for (const GaussNode& g : gauss_legendre(down, 0, 1)) {
    const double cosine = edge + (1 - edge) * g.x * g.x;
    directions.push_back({std::acos(-cosine), 2 * g.x * (1 - edge) * g.weight});
  }
  std::ranges::sort(directions, {}, &PolarDirection::zenith_rad);
  return directions;
}

std::vector<double> orders_levels(double top_km, int levels) {
  std::vector<double> altitudes;
  for (int i = 0; i < levels; ++i) {
    const double v = static_cast<double>(i) / (levels - 1);
    altitudes.push_back(top_km * v * v * (0.6 + 0.4 * v));
  }
  altitudes.front() = 0;
  altitudes.back() = top_km;
  return altitudes;
}

namespace {

// Depth below the edge of a layer at which a grazing ray has crossed an optical depth of 2 of it,
// sqrt(2 R depth) long.
double edge_depth_km(double radius_km, double extinction_step_per_km) {
  const double length_km = 2 / extinction_step_per_km;
  return length_km * length_km / (2 * radius_km);
}

}  // namespace

std::vector<double> orders_levels(const OrdersMedium& medium, int levels) {
  constexpr double kSharp = 0.1, kLeast_km = 0.002, kGrowth = 3;
  std::vector<double> altitudes = orders_levels(medium.truncated.top_km(), levels);
  const PathOptics& optics = medium.optics;
  for (std::size_t i = 1; i + 1 < optics.boundary_km.size(); ++i) {
    double step = 0;  // of extinction, upwards; the largest of all wavelengths
    for (std::size_t w = 0; w < optics.lanes; ++w) {
      const double here = optics.extinction_per_km[(i - 1) * optics.lanes + w] -
                          optics.extinction_per_km[i * optics.lanes + w];
      if (std::abs(here) > std::abs(step)) step = here;
    }
    const double edge = optics.boundary_km[i];
    const auto above = std::ranges::upper_bound(altitudes, edge);
    const double gap = *above - *(above - 1);
    const double depth = edge_depth_km(optics.earth_radius_km, std::abs(step));
    // Steps of the layers that a smooth profile is cut into are not edges.
    if (!(depth < kSharp * gap) || std::abs(step) * gap < kSharp) continue;
    std::vector<double> near{edge};
    double distance = std::max(depth, kLeast_km);
    for (; distance < gap; distance *= kGrowth) {
      near.push_back(edge - std::copysign(distance, step));
    }
    // These take the place of the levels among them, ground and top stay.
    const auto [low, high] = std::ranges::minmax(near);
    const double margin = 0.3 * distance / kGrowth;
    std::erase_if(altitudes, [&](double z) {
      return z > 0 && z < medium.truncated.top_km() && z > low - margin && z < high + margin;
    });
    for (const double z : near) {
      if (z > kLeast_km && z < medium.truncated.top_km() - kLeast_km) altitudes.push_back(z);
    }
    std::ranges::sort(altitudes);
  }
  return altitudes;
}

template <class T>
OrdersGrid<T>::OrdersGrid(const OrdersMedium& medium, double zenith_step_deg,
                          std::vector<double> levels, int polar, int azimuth_count, int degree,
                          bool with_polarisation, std::size_t levels_above_aerosol)
    : zenith(zenith_step_deg),
      level_km(std::move(levels)),
      levels_above(std::max<std::size_t>(levels_above_aerosol, 4)),
      polar_count(polar),
      moment_degree(std::min(medium.degree, degree)),
      polarised(with_polarisation),
      stokes(with_polarisation ? 3 : 1),
      lanes(medium.lanes) {
  const std::vector<double>& chi = zenith.zenith_rad();
  const double darkest = medium.darkest_zenith_deg * pi / 180;
  nodes = static_cast<std::size_t>(std::ranges::upper_bound(chi, darkest) - chi.begin());
  nodes = std::clamp<std::size_t>(nodes + 1, std::min<std::size_t>(4, chi.size()), chi.size());
  if (moment_degree > 0) {
    moments = stokes * moment_count(moment_degree);
    const auto above = std::ranges::lower_bound(level_km, medium.aerosol_top_km - 1e-9);
    aerosol_levels = std::min(static_cast<std::size_t>(above - level_km.begin()) + levels_above,
                              level_km.size());
  }
  for (int q = 0; q < azimuth_count; ++q) {
    const double phi = (q + 0.5) * pi / azimuth_count;
    cos_azimuth.push_back(static_cast<T>(std::cos(phi)));
    sin_azimuth.push_back(static_cast<T>(std::sin(phi)));
  }
  pairs = nodes * azimuths();
  const auto day = std::ranges::upper_bound(chi, kDayZenith_deg * pi / 180) - chi.begin();
  day_pairs = static_cast<std::size_t>(day) * azimuths();
  for (auto* v : {&cos_chi, &sin_chi, &cos_phi, &sin_phi})
    v->assign(padded_pairs(pairs) + 16, T(0));
  for (std::size_t j = 0; j < nodes; ++j) {
    for (std::size_t q = 0; q < azimuths(); ++q) {
      const std::size_t i = j * azimuths() + q;
      cos_chi[i] = static_cast<T>(std::cos(chi[j]));
      sin_chi[i] = static_cast<T>(std::sin(chi[j]));
      cos_phi[i] = cos_azimuth[q];
      sin_phi[i] = sin_azimuth[q];
    }
  }
  fine_position.assign(zenith.fine_position().begin(), zenith.fine_position().end());
  const auto last = std::ranges::upper_bound(fine_position, static_cast<T>(nodes - 1));
  fine_end =
      std::min(static_cast<std::size_t>(last - fine_position.begin()), ZenithGrid::kFineSize - 1);
}

template <class T>
IncomingLight<T>::IncomingLight(const OrdersGrid<T>& grid)
    : coherency(grid.level_km.size() * grid.zenith.size() * 4 * grid.lanes),
      moments(grid.aerosol_levels * grid.zenith.size() * grid.moments * grid.lanes),
      ground(grid.zenith.size() * grid.lanes) {}

template <class T>
double IncomingLight<T>::trace(std::size_t point, std::size_t lanes, std::size_t w) const {
  const T* C = &coherency[point * 4 * lanes + w];
  return static_cast<double>(C[0]) + static_cast<double>(C[lanes]) +
         static_cast<double>(C[2 * lanes]);
}

template struct OrdersGrid<float>;
template struct OrdersGrid<double>;
template struct IncomingLight<float>;
template struct IncomingLight<double>;

}  // namespace twilight
