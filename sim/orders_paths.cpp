#include "sim/orders_paths.h"

#include <algorithm>
#include <cmath>

namespace twilight {
namespace {

// A place along a ray; `level` >= 0 where it is exactly on a level.
struct Cut {
  double distance_km;
  int level;
  bool sample;
  double altitude_km = 0, angle_rad = 0, zenith_rad = 0;
};

bool before(const Cut& a, const Cut& b) {
  return a.distance_km < b.distance_km || (a.distance_km == b.distance_km && a.sample > b.sample);
}

// (1 - exp(-x)) / x and (1 - (1 + x) exp(-x)) / x^2.
void attenuated_means(double x, double e, double& h0, double& h1) {
  if (x < 1e-3) {
    h0 = 1 - x * (0.5 - x * (1.0 / 6 - x / 24));
    h1 = 0.5 - x * (1.0 / 3 - x * (0.125 - x / 30));
    return;
  }
  h0 = (1 - e) / x;
  h1 = (1 - (1 + x) * e) / (x * x);
}

// Weights of the samples among the cuts, which are in order along the ray.
void weigh(const PathOptics& optics, std::span<const double> level_km, const std::vector<Cut>& cuts,
           SampledPath& path) {
  path.samples.clear();
  path.weight.clear();
  const std::size_t lanes = optics.lanes, columns = 1 + optics.kinds;
  path.ground_transmittance.assign(lanes, 1.0);
  std::vector<double>& transmittance = path.ground_transmittance;
  // Weights of the current sample pair, [end][column][lane].
  path.scratch.assign(2 * columns * lanes, 0.0);
  double* near = path.scratch.data();
  double* far = near + columns * lanes;
  const auto put = [&](const Cut& cut, const double* weights) {
    if (std::all_of(weights, weights + columns * lanes, [](double x) { return x == 0; })) return;
    const auto add = [&](int level, double share) {
      path.samples.push_back({level, cut.angle_rad, cut.zenith_rad});
      for (std::size_t i = 0; i < columns * lanes; ++i) path.weight.push_back(share * weights[i]);
    };
    if (cut.level >= 0) return add(cut.level, 1.0);
    const double z = std::clamp(cut.altitude_km, level_km.front(), level_km.back());
    const auto upper = std::ranges::upper_bound(level_km, z);
    const auto hi = std::clamp<std::ptrdiff_t>(upper - level_km.begin(), 1,
                                               static_cast<std::ptrdiff_t>(level_km.size()) - 1);
    const auto i = static_cast<std::size_t>(hi);
    const double f = (z - level_km[i - 1]) / (level_km[i] - level_km[i - 1]);
    if (f < 1 - 1e-6) add(static_cast<int>(i) - 1, f > 1e-6 ? 1 - f : 1.0);
    if (f > 1e-6) add(static_cast<int>(i), f < 1 - 1e-6 ? f : 1.0);
  };

  std::size_t a = 0;
  while (a + 1 < cuts.size()) {
    std::size_t b = a + 1;
    while (!cuts[b].sample) ++b;
    const double sa = cuts[a].distance_km, span = cuts[b].distance_km - sa;
    for (std::size_t k = a; k < b; ++k) {
      const double s1 = cuts[k].distance_km, s2 = cuts[k + 1].distance_km;
      const double length = s2 - s1;
      if (!(length > 0)) continue;
      const double middle = 0.5 * (cuts[k].altitude_km + cuts[k + 1].altitude_km);
      const auto upper = std::ranges::upper_bound(optics.boundary_km, middle);
      const auto layer = static_cast<std::size_t>(
          std::clamp<std::ptrdiff_t>(upper - optics.boundary_km.begin() - 1, 0,
                                     static_cast<std::ptrdiff_t>(optics.boundary_km.size()) - 2));
      const double u1 = (s1 - sa) / span, du = length / span;
      const double* extinction = &optics.extinction_per_km[layer * lanes];
      for (std::size_t w = 0; w < lanes; ++w) {
        const double x = extinction[w] * length, e = std::exp(-x);
        double h0, h1;
        attenuated_means(x, e, h0, h1);
        const double all = transmittance[w] * length * h0;
        const double late = u1 * all + du * transmittance[w] * length * h1;
        transmittance[w] *= e;
        const double* scattering = &optics.scattering_per_km[layer * columns * lanes + w];
        for (std::size_t q = 0; q < columns; ++q) {
          if (q > 0 && optics.kind_present[layer * optics.kinds + q - 1] == 0) continue;
          near[q * lanes + w] += scattering[q * lanes] * (all - late);
          far[q * lanes + w] += scattering[q * lanes] * late;
        }
      }
    }
    put(cuts[a], near);
    std::copy(far, far + columns * lanes, near);
    std::fill(far, far + columns * lanes, 0.0);
    a = b;
  }
  if (cuts.size() > 1 && cuts.back().distance_km > 0) put(cuts[a], near);
  if (path.hits_ground) path.ground_angle_rad = cuts.back().angle_rad;
}

}  // namespace

void sample_path(const PathOptics& optics, std::span<const double> level_km, double altitude_km,
                 double zenith_rad, double max_angle_rad, SampledPath& path) {
  const double R = optics.earth_radius_km;
  const double r0 = R + altitude_km;
  const double c = std::cos(zenith_rad), s = std::sin(zenith_rad);
  const double rp = r0 * s;     // perigee radius of the line
  const double foot = -r0 * c;  // distance of the perigee, negative when it lies behind
  path.hits_ground = false;

  const auto half_chord = [&](double altitude) {
    // sqrt(r^2 - rp^2) with the small difference kept exact near the start's own altitude.
    const double q = (altitude - altitude_km) * (2 * R + altitude + altitude_km) + foot * foot;
    return q > 0 ? std::sqrt(q) : 0.0;
  };
  const double perigee_km = rp - R;
  double end;
  if (foot > 0 && perigee_km < 0) {
    path.hits_ground = true;
    end = foot - half_chord(0.0);
  } else {
    end = foot + half_chord(optics.boundary_km.back());
  }
  if (altitude_km <= 0 && c <= 0 && path.hits_ground) end = 0;
  end = std::max(end, 0.0);

  std::vector<Cut> cuts;
  cuts.reserve(2 * (optics.boundary_km.size() + level_km.size()) + 64);
  const double tiny = 1e-9 * (1 + altitude_km);
  const auto crossings = [&](double altitude, int level) {
    if (altitude < perigee_km) return;
    const double h = half_chord(altitude);
    for (const double d : {foot - h, foot + h}) {
      if (d > tiny && d < end - tiny) cuts.push_back({d, level, level >= 0});
    }
  };
  for (std::size_t k = 0; k < level_km.size(); ++k) crossings(level_km[k], static_cast<int>(k));
  for (const double boundary : optics.boundary_km) crossings(boundary, -1);
  if (foot > tiny && foot < end - tiny) cuts.push_back({foot, -1, true});
  cuts.push_back({0.0, -1, true});
  cuts.push_back({end, -1, true});
  std::ranges::sort(cuts, before);
  const auto angle_at = [&](double d) { return std::atan2(d * s, r0 + d * c); };
  // Long stretches between samples are divided evenly.
  const std::size_t natural = cuts.size();
  for (std::size_t k = 0, last = 0; k < natural; ++k) {
    if (!cuts[k].sample) continue;
    const double from = cuts[last].distance_km, to = cuts[k].distance_km;
    const int parts =
        static_cast<int>(std::ceil((angle_at(to) - angle_at(from)) / max_angle_rad - 1e-9));
    for (int p = 1; p < parts; ++p) cuts.push_back({from + (to - from) * p / parts, -1, true});
    last = k;
  }
  if (cuts.size() > natural) std::ranges::sort(cuts, before);

  const auto altitude_at = [&](double d) {
    // r - R without cancellation: (r^2 - r0^2) / (r + r0) + altitude.
    const double r = std::sqrt(r0 * r0 + d * (d + 2 * r0 * c));
    return altitude_km + d * (d + 2 * r0 * c) / (r + r0);
  };
  for (Cut& cut : cuts) {
    cut.altitude_km = altitude_at(cut.distance_km);
    cut.angle_rad = angle_at(cut.distance_km);
    cut.zenith_rad = zenith_rad - cut.angle_rad;
  }
  weigh(optics, level_km, cuts, path);
}

void sample_path(const PathOptics& optics, std::span<const double> level_km, const RayPath& ray,
                 double max_angle_rad, SampledPath& path) {
  std::vector<Cut> cuts;
  double distance = 0;
  const auto push = [&](const PathPiece& piece, double f, int level, bool sample) {
    cuts.push_back({distance + f * piece.length_km, level, sample,
                    std::lerp(piece.start_altitude_km, piece.end_altitude_km, f),
                    std::lerp(piece.start_angle_rad, piece.end_angle_rad, f),
                    std::lerp(piece.start_zenith_rad, piece.end_zenith_rad, f)});
  };
  for (std::size_t k = 0; k < ray.pieces.size(); ++k) {
    const PathPiece& piece = ray.pieces[k];
    const double z0 = piece.start_altitude_km, z1 = piece.end_altitude_km;
    const bool turns = k > 0 && (ray.pieces[k - 1].end_altitude_km <
                                 ray.pieces[k - 1].start_altitude_km) != (z1 < z0);
    push(piece, 0, -1, k == 0 || turns);
    const auto low = std::ranges::lower_bound(level_km, std::min(z0, z1));
    const auto high = std::ranges::upper_bound(level_km, std::max(z0, z1));
    const std::size_t first = cuts.size();
    for (auto level = low; level != high; ++level) {
      if (z1 == z0) break;
      const double f = (*level - z0) / (z1 - z0);
      push(piece, std::clamp(f, 0.0, 1.0), static_cast<int>(level - level_km.begin()), true);
    }
    if (z1 < z0) std::reverse(cuts.begin() + static_cast<std::ptrdiff_t>(first), cuts.end());
    const int parts = static_cast<int>(
        std::ceil((piece.end_angle_rad - piece.start_angle_rad) / max_angle_rad - 1e-9));
    for (int p = 1; p < parts; ++p) push(piece, static_cast<double>(p) / parts, -1, true);
    distance += piece.length_km;
    if (k + 1 == ray.pieces.size()) {
      distance -= piece.length_km;
      push(piece, 1, -1, true);
    }
  }
  path.hits_ground = ray.hits_ground;
  std::ranges::stable_sort(cuts, before);
  // Samples of thin pieces add up to long stretches too.
  if (cuts.empty()) {
    path.samples.clear();
    path.weight.clear();
    path.ground_transmittance.assign(optics.lanes, 1.0);
    return;
  }
  double last = cuts.front().angle_rad;
  for (std::size_t k = 1; k + 1 < cuts.size(); ++k) {
    if (!cuts[k].sample && cuts[k + 1].angle_rad - last > max_angle_rad) cuts[k].sample = true;
    if (cuts[k].sample) last = cuts[k].angle_rad;
  }
  weigh(optics, level_km, cuts, path);
}

}  // namespace twilight
