#include "sim/sky_table.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "sim/sky_table_kernel.h"

namespace twilight {
namespace {

using std::numbers::pi;
// Rays that shall meet the ground, or miss it, keep this clear of grazing it.
constexpr double kClear_rad = 1e-7;
constexpr int kFirstAzimuths = 13, kAzimuthBisections = 4, kElevationBisections = 5;

}  // namespace

CubicNodes::CubicNodes(std::vector<double> nodes, bool mirrored) : nodes_(std::move(nodes)) {
  const auto n = static_cast<std::ptrdiff_t>(nodes_.size());
  const std::ptrdiff_t width = mirrored ? 4 : std::min<std::ptrdiff_t>(4, n);
  for (std::ptrdiff_t i = 0; i + 1 < n; ++i) {
    Interval interval{};
    const std::ptrdiff_t first = mirrored ? i - 1 : std::clamp<std::ptrdiff_t>(i - 1, 0, n - width);
    for (std::ptrdiff_t k = 0; k < 4; ++k) {
      // Fewer than four nodes: the last is repeated without weight.
      std::ptrdiff_t at = first + std::min(k, width - 1);
      double x;
      if (at < 0) {
        at = -at;
        x = 2 * nodes_.front() - nodes_[static_cast<std::size_t>(at)];
      } else if (at >= n) {
        at = 2 * (n - 1) - at;
        x = 2 * nodes_.back() - nodes_[static_cast<std::size_t>(at)];
      } else {
        x = nodes_[static_cast<std::size_t>(at)];
      }
      interval.node[k] = static_cast<std::size_t>(at);
      interval.at[k] = x;
    }
    for (std::ptrdiff_t k = 0; k < width; ++k) {
      double product = 1;
      for (std::ptrdiff_t j = 0; j < width; ++j) {
        if (j != k) product *= interval.at[k] - interval.at[j];
      }
      interval.inverse[k] = 1 / product;
    }
    // Factors of nodes that are not there are 1: far away, with the distance taken out.
    for (std::ptrdiff_t k = width; k < 4; ++k) interval.inverse[k] = 0;
    intervals_.push_back(interval);
  }
}

CubicNodes::Stencil CubicNodes::at(double x) const {
  x = std::clamp(x, nodes_.front(), nodes_.back());
  const auto above = std::upper_bound(nodes_.begin() + 1, nodes_.end() - 1, x);
  const Interval& interval = intervals_[static_cast<std::size_t>(above - nodes_.begin() - 1)];
  Stencil stencil;
  double d[4];
  for (int k = 0; k < 4; ++k) {
    stencil.node[k] = interval.node[k];
    d[k] = interval.inverse[k] != 0 ? x - interval.at[k] : 1.0;
  }
  stencil.weight[0] = d[1] * d[2] * d[3] * interval.inverse[0];
  stencil.weight[1] = d[0] * d[2] * d[3] * interval.inverse[1];
  stencil.weight[2] = d[0] * d[1] * d[3] * interval.inverse[2];
  stencil.weight[3] = d[0] * d[1] * d[2] * interval.inverse[3];
  return stencil;
}

double SkyTable::Segment::x(double e) const {
  if (shape == Shape::kUp) return std::sqrt(std::max(0.0, e / high_rad));
  // The angle with which the view meets the ground, over 90 degrees.
  const double incidence = 2 / pi * std::asin(std::min(1.0, std::cos(e) / cos_high));
  return 1 - std::sqrt(1 - incidence);
}

double SkyTable::Segment::elevation_rad(double x) const {
  if (x <= 0) return low_rad;
  if (x >= 1) return high_rad;
  if (shape == Shape::kUp) return high_rad * x * x;
  const double incidence = 1 - (1 - x) * (1 - x);
  return -std::acos(cos_high * std::sin(pi / 2 * incidence));
}

SkyTable::SkyTable(const OrdersAtmosphere& atmosphere, const ObserverRays& rays,
                   const OrdersGather& gather, double solar_zenith_rad)
    : air_(atmosphere),
      rays_(rays),
      light_(atmosphere, gather, solar_zenith_rad, true),
      solar_zenith_rad_(solar_zenith_rad),
      L_(atmosphere.lanes()),
      block_(light_.block()) {
  lay_out();
  choose_azimuths();
  fill();
}

// Where segments begin and end.
void SkyTable::lay_out() {
  const double h = rays_.altitude_km(), R = air_.medium.earth_radius_km;
  const double top = air_.medium.top_km();
  const RefractedRays& middle = air_.colours[air_.middle_colour].rays;
  double lowest = 10;  // of the colours' horizons
  for (const ColourRays& colours : air_.colours) {
    lowest = std::min(lowest, pi / 2 - colours.rays.horizon_apparent_zenith_rad(h));
  }
  const bool raised = h > 0;
  const double ground = raised ? lowest - kClear_rad : -1e-12;
  if (highest_air_rad_ = 10; h > top) {
    // Shells of air bend light the least in blue: the middle colour's edge, with a margin.
    constexpr double kEdge_rad = 1e-5;
    highest_air_rad_ = -std::acos(std::min(1.0, (R + top) / (R + h) * middle.refractive_index(top) /
                                                    middle.refractive_index(h))) +
                       kEdge_rad;
  }
  segments_.push_back({Shape::kGround, -pi / 2, ground, std::cos(ground), {}, {}});
  if (h <= top) segments_.push_back({Shape::kUp, 0.0, pi / 2, 0.0, {}, {}});
}

// Largest relative error, over the wavelengths, of interpolating four nodes where the truth is
// known.
double SkyTable::error(double elevation_rad, double azimuth, const float* truth,
                       const float* const* nodes, const double* weights) const {
  SkyPoint p = light_.point(elevation_rad, azimuth);
  std::vector<float> wanted(L_), found(L_);
  p.nodes = 2;
  p.node[0] = p.node[1] = truth;
  p.weight[0] = 1;
  sky_radiance(p, wanted.data());
  p.nodes = 4;
  for (std::size_t k = 0; k < 4; ++k) {
    p.node[k] = nodes[k];
    p.weight[k] = static_cast<float>(weights[k]);
  }
  sky_radiance(p, found.data());
  double worst = 0;
  for (std::size_t w = 0; w < air_.wavelengths(); ++w) {
    if (!(wanted[w] > 1e-30F)) continue;
    worst = std::max(worst, std::abs(static_cast<double>(found[w] / wanted[w]) - 1));
  }
  return worst;
}

void SkyTable::choose_azimuths() {
  std::vector<double> elevations;
  for (const Segment& segment : segments_) {
    for (const double x : {0.02, 0.12, 0.25, 0.4, 0.6, 0.8}) {
      if (segment.shape == Shape::kGround && rays_.altitude_km() <= 0) break;
      elevations.push_back(segment.elevation_rad(x));
    }
    const double sun = pi / 2 - solar_zenith_rad_;
    if (segment.low_rad < sun && sun < segment.high_rad) elevations.push_back(sun);
  }
  std::vector<double> nodes;
  for (int k = 0; k < kFirstAzimuths; ++k) nodes.push_back(pi * k / (kFirstAzimuths - 1));
  std::vector<bool> open(nodes.size() - 1, true);
  std::vector<Column> known(elevations.size());
  tbb::parallel_for(std::size_t{0}, elevations.size(),
                    [&](std::size_t i) { known[i] = evaluate(elevations[i], nodes); });
  for (int round = 0; round < kAzimuthBisections; ++round) {
    std::vector<double> middles;
    std::vector<std::size_t> where;
    for (std::size_t k = 0; k < open.size(); ++k) {
      if (!open[k]) continue;
      where.push_back(k);
      middles.push_back(0.5 * (nodes[k] + nodes[k + 1]));
    }
    if (middles.empty()) break;
    const CubicNodes cubic(nodes, true);
    std::vector<Column> fresh(elevations.size());
    std::vector<std::vector<double>> errors(elevations.size());
    tbb::parallel_for(std::size_t{0}, elevations.size(), [&](std::size_t i) {
      fresh[i] = evaluate(elevations[i], middles);
      for (std::size_t k = 0; k < middles.size(); ++k) {
        const CubicNodes::Stencil s = cubic.at(middles[k]);
        const float* blocks[4];
        for (std::size_t q = 0; q < 4; ++q) blocks[q] = &known[i][s.node[q] * block_];
        errors[i].push_back(
            error(elevations[i], middles[k], &fresh[i][k * block_], blocks, s.weight));
      }
    });
    std::vector<double> next_nodes{nodes[0]};
    std::vector<bool> next_open;
    std::vector<Column> next(elevations.size());
    const auto copy = [&](const std::vector<Column>& from, std::size_t k) {
      for (std::size_t i = 0; i < elevations.size(); ++i) {
        next[i].insert(next[i].end(), from[i].begin() + static_cast<std::ptrdiff_t>(k * block_),
                       from[i].begin() + static_cast<std::ptrdiff_t>((k + 1) * block_));
      }
    };
    copy(known, 0);
    for (std::size_t k = 0, m = 0; k + 1 < nodes.size(); ++k) {
      if (m < where.size() && where[m] == k) {
        double worst = 0;
        for (const auto& e : errors) worst = std::max(worst, e[m]);
        next_nodes.push_back(middles[m]);
        copy(fresh, m);
        next_open.insert(next_open.end(), 2, worst > kTolerance);
        ++m;
      } else {
        next_open.push_back(false);
      }
      next_nodes.push_back(nodes[k + 1]);
      copy(known, k + 1);
    }
    nodes = std::move(next_nodes);
    open = std::move(next_open);
    known = std::move(next);
  }
  azimuth_ = CubicNodes(nodes, true);
}

void SkyTable::fill() {
  const std::vector<double>& azimuths = azimuth_.nodes();
  std::map<double, std::size_t> known;  // columns by elevation
  struct Open {
    std::vector<double> x;
    std::vector<bool> open;
  };
  std::vector<Open> axes;
  std::vector<double> wanted;
  const auto want = [&](double elevation) {
    const auto [at, fresh] = known.try_emplace(elevation, columns_.size() + wanted.size());
    if (fresh) wanted.push_back(elevation);
    return at->second;
  };
  const auto gather = [&] {
    const std::size_t first = columns_.size();
    columns_.resize(first + wanted.size());
    tbb::parallel_for(std::size_t{0}, wanted.size(),
                      [&](std::size_t k) { columns_[first + k] = evaluate(wanted[k], azimuths); });
    wanted.clear();
  };
  for (Segment& segment : segments_) {
    // The ground at one's feet is one from all sides.
    const int count = segment.shape == Shape::kUp ? 17 : rays_.altitude_km() > 0 ? 13 : 3;
    Open axis;
    for (int k = 0; k < count; ++k) {
      const double x = static_cast<double>(k) / (count - 1);
      axis.x.push_back(x);
      segment.column.push_back(want(segment.elevation_rad(x)));
    }
    axis.open.assign(axis.x.size() - 1, true);
    axes.push_back(std::move(axis));
  }
  gather();
  for (int round = 0; round < kElevationBisections; ++round) {
    struct Middle {
      std::size_t segment, interval, column;
      double x, error;
    };
    std::vector<Middle> middles;
    for (std::size_t s = 0; s < segments_.size(); ++s) {
      segments_[s].nodes = CubicNodes(axes[s].x, false);
      for (std::size_t k = 0; k < axes[s].open.size(); ++k) {
        if (!axes[s].open[k]) continue;
        const double x = 0.5 * (axes[s].x[k] + axes[s].x[k + 1]);
        middles.push_back({s, k, want(segments_[s].elevation_rad(x)), x, 0});
      }
    }
    if (middles.empty()) break;
    gather();
    tbb::parallel_for(std::size_t{0}, middles.size(), [&](std::size_t i) {
      Middle& middle = middles[i];
      const Segment& segment = segments_[middle.segment];
      const CubicNodes::Stencil s = segment.nodes.at(middle.x);
      for (std::size_t a = 0; a < azimuths.size(); ++a) {
        const float* blocks[4];
        for (std::size_t q = 0; q < 4; ++q) {
          blocks[q] = &columns_[segment.column[s.node[q]]][a * block_];
        }
        middle.error =
            std::max(middle.error, error(segment.elevation_rad(middle.x), azimuths[a],
                                         &columns_[middle.column][a * block_], blocks, s.weight));
      }
    });
    largest_error_ = 0;
    // From the back, so that intervals keep their places.
    for (auto middle = middles.rbegin(); middle != middles.rend(); ++middle) {
      Open& axis = axes[middle->segment];
      const auto at = static_cast<std::ptrdiff_t>(middle->interval);
      const bool open = middle->error > kTolerance;
      axis.x.insert(axis.x.begin() + at + 1, middle->x);
      axis.open[middle->interval] = open;
      axis.open.insert(axis.open.begin() + at, open);
      auto& column = segments_[middle->segment].column;
      column.insert(column.begin() + at + 1, middle->column);
      largest_error_ = std::max(largest_error_, middle->error);
    }
  }
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    segments_[s].nodes = CubicNodes(axes[s].x, false);
  }
}

bool SkyTable::radiance(double elevation_rad, double relative_azimuth_rad, float* radiance) const {
  if (elevation_rad > highest_air_rad_) {
    std::fill(radiance, radiance + L_, 0.0F);
    return true;
  }
  const auto segment = std::ranges::lower_bound(segments_, elevation_rad, {}, &Segment::high_rad);
  if (segment == segments_.end() || elevation_rad < segment->low_rad) return false;
  const double azimuth = std::abs(std::remainder(relative_azimuth_rad, 2 * pi));
  const CubicNodes::Stencil e = segment->nodes.at(segment->x(elevation_rad));
  const CubicNodes::Stencil f = azimuth_.at(azimuth);
  SkyPoint p = light_.point(elevation_rad, azimuth);
  p.nodes = 16;
  for (std::size_t i = 0; i < 4; ++i) {
    const Column& column = columns_[segment->column[e.node[i]]];
    for (std::size_t j = 0; j < 4; ++j) {
      p.node[4 * i + j] = &column[f.node[j] * block_];
      p.weight[4 * i + j] = static_cast<float>(e.weight[i] * f.weight[j]);
    }
  }
  sky_radiance(p, radiance);
  return true;
}

}  // namespace twilight
