#include "sim/models/preetham_aerial_perspective.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <stdexcept>

#include "sim/gauss_legendre.h"

namespace twilight {
namespace {

using std::numbers::pi;

// (1 - e^(-x)) / x.
double mean_decay(double x) { return x == 0 ? 1.0 : -std::expm1(-x) / x; }

// One constituent along a path: its density over that at the ground, and columns of it.
struct Constituent {
  double decay_per_km, ground_per_km, climb, start;  // climb: cos theta; start: u(0)

  Constituent(double decay, double ground, const AerialPath& path)
      : decay_per_km(decay),
        ground_per_km(ground),
        climb(std::sin(path.elevation_rad)),
        start(std::exp(-decay * path.height_km)) {}

  double density(double km) const { return start * std::exp(-decay_per_km * climb * km); }
  // The integral of density() from 0, km.
  double column_km(double km) const { return start * km * mean_decay(decay_per_km * climb * km); }
  // column_km(s) over density(0), and over density(s): no density of great heights, which is 0, is
  // divided by.
  double start_length_km(double s) const { return s * mean_decay(decay_per_km * climb * s); }
  double end_length_km(double s) const { return s * mean_decay(-decay_per_km * climb * s); }
  double depth(double km) const { return ground_per_km * column_km(km); }
};

struct BothConstituents {
  Constituent haze, molecules;
  BothConstituents(const AerialPath& path, const AerialAir& air)
      : haze(kHazeDecay_per_km, air.haze_per_km, path),
        molecules(kMoleculesDecay_per_km, air.molecules_per_km, path) {}
};

void check_path(const AerialPath& path) {
  const double end_km = path.height_km + path.length_km * std::sin(path.elevation_rad);
  constexpr double kRounding = 1e-9;
  if (!(path.height_km >= 0 && path.length_km >= 0 && std::isfinite(path.length_km) &&
        std::abs(path.elevation_rad) <= pi / 2 + kRounding && end_km >= -kRounding)) {
    throw std::invalid_argument(
        fmt::format("path of height_km {}, elevation_rad {}, length_km {}: it must be finite and "
                    "begin and end at or above the ground",
                    path.height_km, path.elevation_rad, path.length_km));
  }
}

// The integrals of e^(-tau t) t^n over 0..1, n = 0..3, for tau >= 0.
std::array<double, 4> decay_moments(double tau) {
  std::array<double, 4> moment{};
  if (tau < 1) {  // by the series, where the recursion would cancel
    for (int n = 0; n < 4; ++n) {
      double term = 1, sum = 0;
      for (int k = 0; k < 24; ++k) {
        sum += term / (n + 1 + k);
        term *= -tau / (k + 1);
      }
      moment[static_cast<std::size_t>(n)] = sum;
    }
    return moment;
  }
  const double end = std::exp(-tau);
  moment[0] = mean_decay(tau);
  for (std::size_t n = 1; n < 4; ++n) {
    moment[n] = (static_cast<double>(n) * moment[n - 1] - end) / tau;
  }
  return moment;
}

double level_integral(const Constituent& own, const Constituent& other, double length_km) {
  const double rate = own.decay_per_km * own.climb + own.ground_per_km * own.start +
                      other.ground_per_km * other.start;
  return own.start * length_km * mean_decay(rate * length_km);
}

// t runs over the share of the constituent's own column: dv = -(H - u(s)) dt.
double hermite_integral(const Constituent& own, const Constituent& other, double length_km) {
  const double column = own.column_km(length_km);
  const double f1 = std::exp(-other.depth(length_km));
  const double d0 = -other.ground_per_km * other.start * own.start_length_km(length_km);
  const double d1 =
      -other.ground_per_km * other.density(length_km) * own.end_length_km(length_km) * f1;
  const std::array<double, 4> m = decay_moments(own.ground_per_km * column);
  return column *
         (m[0] + d0 * m[1] + (3 * (f1 - 1) - 2 * d0 - d1) * m[2] + (2 * (1 - f1) + d0 + d1) * m[3]);
}

}  // namespace

double aerial_transmittance(const AerialPath& path, const AerialAir& air) {
  check_path(path);
  const BothConstituents both(path, air);
  return std::exp(-both.haze.depth(path.length_km) - both.molecules.depth(path.length_km));
}

AerialIntegrals aerial_integrals_level(const AerialPath& path, const AerialAir& air) {
  check_path(path);
  const BothConstituents both(path, air);
  return {level_integral(both.haze, both.molecules, path.length_km),
          level_integral(both.molecules, both.haze, path.length_km)};
}

AerialIntegrals aerial_integrals_hermite(const AerialPath& path, const AerialAir& air) {
  check_path(path);
  const BothConstituents both(path, air);
  return {hermite_integral(both.haze, both.molecules, path.length_km),
          hermite_integral(both.molecules, both.haze, path.length_km)};
}

AerialIntegrals aerial_integrals(const AerialPath& path, const AerialAir& air) {
  check_path(path);
  constexpr double kLevel = 1e-3, kClimb = 0.25, kDepth = 0.4, kDark = 1e-14;
  const BothConstituents whole(path, air);
  const double climb = kHazeDecay_per_km * std::abs(whole.haze.climb);
  if (climb * path.length_km < kLevel) return aerial_integrals_level(path, air);
  AerialIntegrals sum;
  AerialPath piece = path;
  double done_km = 0, light = 1;
  while (done_km < path.length_km && light > kDark) {
    piece.height_km = std::max(0.0, path.height_km + whole.haze.climb * done_km);
    const BothConstituents here(piece, air);
    const double left_km = path.length_km - done_km;
    double step_km = std::min(left_km, kClimb / climb);
    const auto extinction = [&](double km) {
      return air.haze_per_km * here.haze.density(km) +
             air.molecules_per_km * here.molecules.density(km);
    };
    const double most = std::max(extinction(0), extinction(step_km));
    if (most * step_km > kDepth) step_km = kDepth / most;
    const AerialIntegrals own = {hermite_integral(here.haze, here.molecules, step_km),
                                 hermite_integral(here.molecules, here.haze, step_km)};
    sum.haze_km += light * own.haze_km;
    sum.molecules_km += light * own.molecules_km;
    light *= std::exp(-here.haze.depth(step_km) - here.molecules.depth(step_km));
    if (step_km >= left_km) break;
    done_km += step_km;
  }
  return sum;
}

AerialIntegrals aerial_integrals_numeric(const AerialPath& path, const AerialAir& air) {
  check_path(path);
  const BothConstituents both(path, air);
  const auto nodes = gauss_legendre(8, 0, 1);
  const double s = path.length_km;
  const double start =
      air.haze_per_km * both.haze.start + air.molecules_per_km * both.molecules.start;
  const double end =
      air.haze_per_km * both.haze.density(s) + air.molecules_per_km * both.molecules.density(s);
  const double turns = s * (kHazeDecay_per_km * std::abs(both.haze.climb) + std::max(start, end));
  const int panels = 2 + static_cast<int>(std::min(2 * turns, 2e5));
  AerialIntegrals sum;
  for (int p = 0; p < panels; ++p) {
    for (const GaussNode& node : nodes) {
      const double x = s * (p + node.x) / panels;
      const double weight =
          s / panels * node.weight * std::exp(-both.haze.depth(x) - both.molecules.depth(x));
      sum.haze_km += weight * both.haze.density(x);
      sum.molecules_km += weight * both.molecules.density(x);
    }
  }
  return sum;
}

PreethamAerialPerspective::PreethamAerialPerspective(const Sky& sky, double turbidity) {
  constexpr int kElevations = 24, kAzimuths = 32;
  for (const double nm : sky.wavelength_nm()) air_.emplace_back(nm, turbidity);
  const std::size_t W = air_.size();
  std::vector<ViewDirection> views;
  std::vector<double> solid_angle;
  // Even in the square root of the elevation's sine: the sky changes most at the horizon.
  for (const GaussNode& g : gauss_legendre(kElevations, 0, 1)) {
    for (int k = 0; k < kAzimuths; ++k) {
      views.push_back({std::asin(g.x * g.x), (k + 0.5) * 2 * pi / kAzimuths});
      solid_angle.push_back(2 * g.x * g.weight * 2 * pi / kAzimuths);
    }
  }
  const std::vector<double> radiance = sky.radiance(views);
  for (std::size_t k = 0; k < views.size(); ++k) {
    Light light{views[k], std::vector<double>(W)};
    for (std::size_t w = 0; w < W; ++w) light.irradiance[w] = solid_angle[k] * radiance[k * W + w];
    lights_.push_back(std::move(light));
  }
  Light sun{{sky.apparent_sun_elevation_rad(), 0.0}, sky.sun_transmittance()};
  for (std::size_t w = 0; w < W; ++w) sun.irradiance[w] *= sky.solar_irradiance()[w];
  lights_.push_back(std::move(sun));
}

std::vector<double> PreethamAerialPerspective::transmittance(const AerialPath& path) const {
  std::vector<double> out;
  for (const PreethamScattering& air : air_) {
    out.push_back(aerial_transmittance(path, {air.haze_per_km(), air.molecules_per_km()}));
  }
  return out;
}

AerialSource PreethamAerialPerspective::source(const ViewDirection& direction) const {
  const std::size_t W = air_.size();
  AerialSource sum{std::vector<double>(W), std::vector<double>(W)};
  for (const Light& light : lights_) {
    const double cosine =
        std::sin(direction.elevation_rad) * std::sin(light.from.elevation_rad) +
        std::cos(direction.elevation_rad) * std::cos(light.from.elevation_rad) *
            std::cos(direction.relative_azimuth_rad - light.from.relative_azimuth_rad);
    const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
    for (std::size_t w = 0; w < W; ++w) {
      sum.haze[w] += light.irradiance[w] * air_[w].haze_per_km_sr(angle);
      sum.molecules[w] += light.irradiance[w] * air_[w].molecules_per_km_sr(angle);
    }
  }
  return sum;
}

std::vector<double> PreethamAerialPerspective::inscattered(const AerialPath& path,
                                                           double relative_azimuth_rad) const {
  return inscattered(path, source({path.elevation_rad, relative_azimuth_rad}));
}

std::vector<double> PreethamAerialPerspective::inscattered(const AerialPath& path,
                                                           const AerialSource& source) const {
  std::vector<double> out;
  for (std::size_t w = 0; w < air_.size(); ++w) {
    const AerialIntegrals i =
        aerial_integrals(path, {air_[w].haze_per_km(), air_[w].molecules_per_km()});
    out.push_back(source.haze[w] * i.haze_km + source.molecules[w] * i.molecules_km);
  }
  return out;
}

}  // namespace twilight
