#include "sim/orders_paths.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/piece_point.h"

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

// Integrals over 0..1 of x^n exp(-depth x), n = 0..3.
void attenuated_powers(double depth, double e, double m[4]) {
  if (depth < 0.5) {
    // sum over k of (-depth)^k / (k! (n + k + 1))
    double term = 1;
    for (int n = 0; n < 4; ++n) m[n] = 0;
    for (int k = 0; k < 14; ++k) {
      for (int n = 0; n < 4; ++n) m[n] += term / (n + k + 1);
      term *= -depth / (k + 1);
    }
    return;
  }
  m[0] = (1 - e) / depth;
  for (int n = 1; n < 4; ++n) m[n] = (n * m[n - 1] - e) / depth;
}

// Lagrange polynomials through up to four nodes, as coefficients of powers.
struct Basis {
  int count = 2;
  std::array<std::size_t, 4> node{};                   ///< which sample each belongs to
  std::array<std::array<double, 4>, 4> coefficient{};  ///< [polynomial][power]
};

Basis lagrange(std::span<const double> at) {
  Basis basis;
  basis.count = static_cast<int>(at.size());
  for (std::size_t k = 0; k < at.size(); ++k) {
    std::array<double, 4> c{1, 0, 0, 0};
    double scale = 1;
    for (std::size_t j = 0; j < at.size(); ++j) {
      if (j == k) continue;
      for (std::size_t n = 3; n > 0; --n) c[n] = c[n - 1] - at[j] * c[n];
      c[0] *= -at[j];
      scale *= at[k] - at[j];
    }
    for (double& x : c) x /= scale;
    basis.coefficient[k] = c;
  }
  return basis;
}

// A neighbour this near or far, over the stretch's own length, would only make a cubic swing.
bool fits(double gap, double span) {
  constexpr double kNearest = 0.15, kFurthest = 4;
  return gap > kNearest * span && gap < kFurthest * span;
}

// Polynomials for the stretch between samples k and k + 1 in u = 0..1 between them: cubic through
// their neighbours too, where these are neither too near nor too far for it.
Basis stretch_basis(const std::vector<double>& at, std::size_t k, bool cubic) {
  const double span = at[k + 1] - at[k];
  std::array<double, 4> nodes{};
  std::array<std::size_t, 4> which{};
  std::size_t count = 0;
  const auto take = [&](std::size_t sample) {
    nodes[count] = (at[sample] - at[k]) / span;
    which[count++] = sample;
  };
  if (cubic && k > 0 && fits(at[k] - at[k - 1], span)) take(k - 1);
  take(k);
  take(k + 1);
  if (cubic && k + 2 < at.size() && fits(at[k + 2] - at[k + 1], span)) take(k + 2);
  Basis basis = lagrange(std::span(nodes).first(count));
  basis.node = which;
  return basis;
}

// Levels about an altitude and their shares in what is there: cubic, or linear.
void share_levels(std::span<const double> level_km, double altitude_km, bool cubic,
                  std::array<int, 4>& level, std::array<double, 4>& share, int& count) {
  const double z = std::clamp(altitude_km, level_km.front(), level_km.back());
  const auto last = static_cast<std::ptrdiff_t>(level_km.size()) - 1;
  const auto at = [&](std::ptrdiff_t i) { return level_km[static_cast<std::size_t>(i)]; };
  const std::ptrdiff_t low = std::clamp<std::ptrdiff_t>(
      std::ranges::upper_bound(level_km, z) - level_km.begin() - 1, 0, last - 1);
  std::ptrdiff_t first = low, end = low + 2;
  if (cubic) {
    const double span = at(low + 1) - at(low);
    if (low > 0 && fits(at(low) - at(low - 1), span)) --first;
    if (low + 2 <= last && fits(at(low + 2) - at(low + 1), span)) ++end;
    // At the ends of the levels the other side helps out.
    if (low == 0 && end - first == 3 && end <= last && fits(at(end) - at(end - 1), span)) ++end;
    if (low + 1 == last && end - first == 3 && first > 0 && fits(at(first) - at(first - 1), span)) {
      --first;
    }
  }
  count = static_cast<int>(end - first);
  for (int k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    level[i] = static_cast<int>(first) + k;
    share[i] = 1;
    for (int j = 0; j < count; ++j) {
      if (j != k) share[i] *= (z - at(first + j)) / (at(first + k) - at(first + j));
    }
  }
}

// Weights of the samples among the cuts, which are in order along the ray.
void weigh(const PathOptics& optics, std::span<const double> level_km, std::vector<Cut>& cuts,
           SourceShape shape, SampledPath& path) {
  path.samples.clear();
  path.weight.clear();
  const bool cubic = shape == SourceShape::kCubic;
  const std::size_t lanes = optics.lanes, columns = 1 + optics.kinds;
  path.ground_transmittance.assign(lanes, 1.0);
  if (cuts.empty()) return;
  // Samples at one place are one sample.
  const double same = 1e-9 * (1 + cuts.back().distance_km);
  std::vector<std::size_t> sample;  // cuts that are samples
  std::vector<double> at;
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    if (!cuts[k].sample) continue;
    if (!sample.empty() && cuts[k].distance_km - at.back() < same) {
      Cut& kept = cuts[sample.back()];
      if (kept.level < 0) kept.level = cuts[k].level;
      cuts[k].sample = false;
      continue;
    }
    sample.push_back(k);
    at.push_back(cuts[k].distance_km);
  }
  if (path.hits_ground) path.ground_angle_rad = cuts.back().angle_rad;
  if (sample.size() < 2) return;

  std::vector<double>& transmittance = path.ground_transmittance;
  path.scratch.assign(sample.size() * columns * lanes, 0.0);
  for (std::size_t j = 0; j + 1 < sample.size(); ++j) {
    const Basis basis = stretch_basis(at, j, cubic);
    const double span = at[j + 1] - at[j];
    const std::size_t last = j + 2 < sample.size() ? sample[j + 1] : cuts.size() - 1;
    for (std::size_t k = sample[j]; k < last; ++k) {
      const double length = cuts[k + 1].distance_km - cuts[k].distance_km;
      if (!(length > 0)) continue;
      const double middle = 0.5 * (cuts[k].altitude_km + cuts[k + 1].altitude_km);
      const auto upper = std::ranges::upper_bound(optics.boundary_km, middle);
      const auto layer = static_cast<std::size_t>(
          std::clamp<std::ptrdiff_t>(upper - optics.boundary_km.begin() - 1, 0,
                                     static_cast<std::ptrdiff_t>(optics.boundary_km.size()) - 2));
      // The polynomials in x = 0..1 along this piece.
      const double u = (cuts[k].distance_km - at[j]) / span, du = length / span;
      double piece[4][4];
      for (int b = 0; b < basis.count; ++b) {
        const auto& c = basis.coefficient[static_cast<std::size_t>(b)];
        piece[b][0] = c[0] + u * (c[1] + u * (c[2] + u * c[3]));
        piece[b][1] = du * (c[1] + u * (2 * c[2] + 3 * u * c[3]));
        piece[b][2] = du * du * (c[2] + 3 * u * c[3]);
        piece[b][3] = du * du * du * c[3];
      }
      const double* extinction = &optics.extinction_per_km[layer * lanes];
      for (std::size_t w = 0; w < lanes; ++w) {
        const double depth = extinction[w] * length, e = std::exp(-depth);
        double m[4];
        attenuated_powers(depth, e, m);
        const double scale = transmittance[w] * length;
        transmittance[w] *= e;
        const double* scattering = &optics.scattering_per_km[layer * columns * lanes + w];
        for (int b = 0; b < basis.count; ++b) {
          const double weight = scale * (piece[b][0] * m[0] + piece[b][1] * m[1] +
                                         piece[b][2] * m[2] + piece[b][3] * m[3]);
          double* out =
              &path.scratch[basis.node[static_cast<std::size_t>(b)] * columns * lanes + w];
          for (std::size_t q = 0; q < columns; ++q) {
            if (q > 0 && optics.kind_present[layer * optics.kinds + q - 1] == 0) continue;
            out[q * lanes] += scattering[q * lanes] * weight;
          }
        }
      }
    }
  }
  for (std::size_t j = 0; j < sample.size(); ++j) {
    const Cut& cut = cuts[sample[j]];
    const double* weights = &path.scratch[j * columns * lanes];
    if (std::all_of(weights, weights + columns * lanes, [](double x) { return x == 0; })) continue;
    std::array<int, 4> level{cut.level};
    std::array<double, 4> share{1.0};
    int count = 1;
    if (cut.level < 0) share_levels(level_km, cut.altitude_km, cubic, level, share, count);
    for (std::size_t n = 0; n < static_cast<std::size_t>(count); ++n) {
      if (std::abs(share[n]) < 1e-6) continue;
      path.samples.push_back({level[n], cut.angle_rad, cut.zenith_rad});
      for (std::size_t i = 0; i < columns * lanes; ++i) {
        path.weight.push_back(share[n] * weights[i]);
      }
    }
  }
}

}  // namespace

void sample_path(const PathOptics& optics, std::span<const double> level_km, double altitude_km,
                 double zenith_rad, double max_angle_rad, SourceShape shape, SampledPath& path) {
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
  weigh(optics, level_km, cuts, shape, path);
}

void sample_path(const PathOptics& optics, std::span<const double> level_km, const RayPath& ray,
                 double max_angle_rad, SourceShape shape, SampledPath& path) {
  std::vector<Cut> cuts;
  double distance = 0;
  const auto push = [&](const PathPiece& piece, double f, int level, bool sample) {
    const PiecePoint at = point_on(piece, f, optics.earth_radius_km);
    cuts.push_back({distance + f * piece.length_km, level, sample, at.altitude_km, at.angle_rad,
                    at.zenith_rad});
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
      push(piece, share_at(piece, *level, optics.earth_radius_km),
           static_cast<int>(level - level_km.begin()), true);
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
  weigh(optics, level_km, cuts, shape, path);
}

}  // namespace twilight
