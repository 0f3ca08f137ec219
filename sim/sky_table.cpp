#include "sim/sky_table.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "sim/angular_moments.h"
#include "sim/sky_table_kernel.h"

namespace twilight {
namespace {

using std::numbers::pi;
constexpr double kRadPerDeg = pi / 180;
constexpr double kFine_rad = ZenithGrid::kFineStep_deg * kRadPerDeg;
// Rays that shall meet the ground, or miss it, keep this clear of grazing it.
constexpr double kClear_rad = 1e-7;
// Single scattering fainter than this share of the multiply scattered light is not told from none.
constexpr float kFaintShare = 1e-6F;
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
      gather_(gather),
      solar_zenith_rad_(solar_zenith_rad),
      L_(atmosphere.lanes()),
      scatterers_(1 + atmosphere.kind_count()),
      block_((1 + 3 * scatterers_) * L_),
      anisotropic_share_(atmosphere.optics.anisotropic_share.begin(),
                         atmosphere.optics.anisotropic_share.end()) {
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

SkyPoint SkyTable::point(double elevation_rad, double azimuth) const {
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

// Largest relative error, over the wavelengths, of interpolating four nodes where the truth is
// known.
double SkyTable::error(double elevation_rad, double azimuth, const float* truth,
                       const float* const* nodes, const double* weights) const {
  SkyPoint p = point(elevation_rad, azimuth);
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

SkyTable::Column SkyTable::evaluate(double elevation_rad, std::span<const double> azimuths) const {
  const auto ray = rays_.at(elevation_rad);
  Column out(azimuths.size() * block_, 0.0F);
  std::vector<float> light(azimuths.size() * L_, 0.0F);
  add_multiple(*ray, azimuths, light.data());
  if (ray->hits_ground) add_ground(*ray, azimuths, light.data());
  for (std::size_t a = 0; a < azimuths.size(); ++a) {
    std::copy_n(&light[a * L_], L_, &out[a * block_]);
  }
  add_single(*ray, azimuths, out);
  for (std::size_t a = 0; a < azimuths.size(); ++a) {
    float* node = &out[a * block_];
    for (std::size_t w = 0; w < L_; ++w) {
      constexpr float kNone = 1e-35F;
      const float multiple = std::max(node[w], 0.0F);
      for (std::size_t s = 0; s < scatterers_; ++s) {
        float& single = node[(1 + s) * L_ + w];
        const float sum = ray->scatter_sum[s * L_ + w];
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

void SkyTable::add_multiple(const ObserverRay& ray, std::span<const double> azimuths,
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

void SkyTable::add_ground(const ObserverRay& ray, std::span<const double> azimuths,
                          float* light) const {
  if (!air_.options.ground_light) return;
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

void SkyTable::add_single(const ObserverRay& ray, std::span<const double> azimuths,
                          Column& out) const {
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
  SkyPoint p = point(elevation_rad, azimuth);
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
