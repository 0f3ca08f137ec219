#include "sim/observer_ray.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "sim/orders_gather.h"
#include "sim/piece_point.h"

namespace twilight {
namespace {

using std::numbers::pi;

bool descends(const PathPiece& piece) { return piece.end_altitude_km < piece.start_altitude_km; }

bool same_shells(const RayPath& a, const RayPath& b) {
  return a.hits_ground == b.hits_ground &&
         std::ranges::equal(a.pieces, b.pieces, [](const PathPiece& x, const PathPiece& y) {
           return x.layer == y.layer && descends(x) == descends(y);
         });
}

// Central angle on one ray where another one through the same shells has a given one.
double matching_angle(const RayPath& from, const RayPath& to, double angle_rad) {
  auto piece = std::ranges::upper_bound(from.pieces, angle_rad, {}, &PathPiece::start_angle_rad);
  const auto k =
      static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, piece - from.pieces.begin() - 1));
  const PathPiece &a = from.pieces[k], &b = to.pieces[k];
  const double span = a.end_angle_rad - a.start_angle_rad;
  const double f = span > 0 ? std::clamp((angle_rad - a.start_angle_rad) / span, 0.0, 1.0) : 0.0;
  return std::lerp(b.start_angle_rad, b.end_angle_rad, f);
}

struct Lanes {
  std::size_t first, last;
};

class RayPacker {
 public:
  RayPacker(const OrdersAtmosphere& air, ObserverRay& out)
      : air_(air), out_(out), L_(air.lanes()), columns_(1 + air.kind_count()) {
    out_.scatter_sum.assign(columns_ * L_, 0.0F);
    out_.ground_transmittance.assign(L_, 0.0F);
  }

  // Adds the lanes of one colour: on the points of `guide`, which passes the same shells and has
  // been added first, or on its own.
  void add(const Lanes& colours, const RayPath& ray, const RayPath* guide) {
    add_windows(colours, ray, guide);
    add_samples(colours, ray, guide);
    out_.hits_ground = out_.hits_ground || ray.hits_ground;
    if (ray.hits_ground && !ray.pieces.empty() && guide == nullptr) {
      out_.ground_angle_rad = ray.pieces.back().end_angle_rad;
    }
  }

 private:
  void add_windows(const Lanes& colours, const RayPath& ray, const RayPath* guide) {
    const double R = air_.optics.optics.earth_radius_km;
    if (guide == nullptr) guide_windows_ = out_.windows.size();
    std::size_t at = guide_windows_;
    std::vector<double> transmittance(L_, 1.0);
    for (std::size_t k = 0; k < ray.pieces.size(); ++k) {
      const PathPiece& piece = ray.pieces[k];
      const int steps = std::max(
          1, static_cast<int>(std::ceil(single_scattering_steps(
                 guide != nullptr ? guide->pieces[k] : piece, air_.single_step_km[piece.layer]))));
      const double length = piece.length_km / steps;
      const std::size_t layer = piece.layer;
      const double* extinction = &air_.optics.optics.extinction_per_km[layer * L_];
      for (int step = 0; step < steps; ++step, ++at) {
        const PiecePoint here = point_on(piece, (step + 0.5) / steps, R);
        if (guide == nullptr) {
          out_.windows.push_back({air_.sunlit->place(here.altitude_km), here.angle_rad,
                                  std::sin(here.angle_rad), std::cos(here.angle_rad),
                                  std::sin(here.zenith_rad), std::cos(here.zenith_rad)});
          altitude_km_.push_back(here.altitude_km);
          out_.scatter.resize(out_.windows.size() * columns_ * L_, 0.0F);
          out_.above_shift.resize(out_.windows.size() * L_, 0.0F);
          out_.angle_shift_rad.resize(out_.windows.size() * L_, 0.0F);
        }
        const ObserverRay::Window& window = out_.windows[at];
        for (std::size_t w = colours.first; w < colours.last; ++w) {
          const double x = extinction[w] * length, e = std::exp(-x);
          const double mean = x > 1e-6 ? (1 - e) / x : 1 - 0.5 * x;
          const double weight = transmittance[w] * length * mean / (4 * pi);
          transmittance[w] *= e;
          for (std::size_t s = 0; s < columns_; ++s) {
            const float per_km = s == 0
                                     ? air_.air_per_km[layer * L_ + w]
                                     : air_.kind_per_km[(layer * (columns_ - 1) + s - 1) * L_ + w];
            const auto value = static_cast<float>(weight * static_cast<double>(per_km));
            out_.scatter[(at * columns_ + s) * L_ + w] = value;
            out_.scatter_sum[s * L_ + w] += value;
          }
          out_.above_shift[at * L_ + w] =
              static_cast<float>((here.altitude_km - altitude_km_[at]) * window.place.per_km);
          out_.angle_shift_rad[at * L_ + w] =
              static_cast<float>(here.angle_rad - window.central_angle_rad);
        }
      }
    }
    if (!ray.hits_ground) return;
    for (std::size_t w = colours.first; w < colours.last; ++w) {
      out_.ground_transmittance[w] = static_cast<float>(transmittance[w]);
    }
  }

  void add_samples(const Lanes& colours, const RayPath& ray, const RayPath* guide) {
    if (air_.field->orders < 2) return;
    // The colour's own lengths and air at the guide's angles: the same points, other weights.
    RayPath path = ray;
    for (std::size_t k = 0; guide != nullptr && k < path.pieces.size(); ++k) {
      const double length = path.pieces[k].length_km;
      path.pieces[k] = guide->pieces[k];
      path.pieces[k].length_km = length;
    }
    SampledPath sampled;
    sample_path(air_.optics.optics, air_.field->altitude_km, path, OrdersGather::kMultipleStep_rad,
                SourceShape::kCubic, sampled);
    const std::size_t count = sampled.samples.size();
    std::size_t at = guide_samples_;
    bool joins = guide != nullptr && at + count <= out_.samples.size();
    for (std::size_t k = 0; joins && k < count; ++k) {
      const ObserverRay::Sample& there = out_.samples[at + k];
      joins = there.level == static_cast<std::size_t>(sampled.samples[k].level) &&
              std::abs(there.central_angle_rad - sampled.samples[k].central_angle_rad) < 1e-4;
    }
    if (!joins) {
      at = out_.samples.size();
      if (guide == nullptr) guide_samples_ = at;
      for (const PathSample& s : sampled.samples) {
        out_.samples.push_back({static_cast<std::size_t>(s.level), s.central_angle_rad,
                                static_cast<float>(std::sin(s.zenith_rad)),
                                static_cast<float>(std::cos(s.zenith_rad)), s.zenith_rad, false});
      }
      out_.source_weight.resize(out_.samples.size() * columns_ * L_, 0.0F);
      out_.sample_angle_shift_rad.resize(out_.samples.size() * L_, 0.0F);
    }
    for (std::size_t k = 0; k < count; ++k) {
      ObserverRay::Sample& sample = out_.samples[at + k];
      const double shift =
          guide != nullptr
              ? matching_angle(*guide, ray, sample.central_angle_rad) - sample.central_angle_rad
              : 0.0;
      for (std::size_t w = colours.first; w < colours.last; ++w) {
        out_.sample_angle_shift_rad[(at + k) * L_ + w] = static_cast<float>(shift);
        for (std::size_t s = 0; s < columns_; ++s) {
          const double weight = sampled.weight[(k * columns_ + s) * L_ + w];
          out_.source_weight[((at + k) * columns_ + s) * L_ + w] = static_cast<float>(weight);
          sample.aerosol = sample.aerosol || (s > 0 && weight != 0);
        }
      }
      sample.aerosol = sample.aerosol && sample.level < air_.field->aerosol_levels;
    }
  }

  const OrdersAtmosphere& air_;
  ObserverRay& out_;
  std::size_t L_, columns_;
  std::size_t guide_windows_ = 0, guide_samples_ = 0;
  std::vector<double> altitude_km_;
};

}  // namespace

std::shared_ptr<const ObserverRay> ObserverRays::at(double elevation_rad) const {
  const auto key = std::bit_cast<std::uint64_t>(elevation_rad);
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = rays_.find(key); found != rays_.end()) return found->second;
  }
  auto ray = std::make_shared<const ObserverRay>(make(elevation_rad));
  const std::lock_guard lock(mutex_);
  return rays_.try_emplace(key, std::move(ray)).first->second;
}

ObserverRay ObserverRays::make(double elevation_rad) const {
  ObserverRay out;
  out.zenith_rad = pi / 2 - elevation_rad;
  RayPacker packer(air_, out);
  const auto follow = [&](const ColourRays& colours) {
    return colours.rays.follow(altitude_km_, out.zenith_rad);
  };
  const ColourRays& middle = air_.colours[air_.middle_colour];
  const RayPath guide = follow(middle);
  if (std::abs(guide.deflection_rad) < OrdersGather::kDispersedDeflection_rad) {
    packer.add({0, air_.wavelengths()}, guide, nullptr);
    return out;
  }
  packer.add({middle.first, middle.last}, guide, nullptr);
  std::vector<std::size_t> others;
  for (std::size_t k = 0; k < air_.colours.size(); ++k) {
    if (k == air_.middle_colour) continue;
    const RayPath ray = follow(air_.colours[k]);
    if (same_shells(guide, ray)) {
      packer.add({air_.colours[k].first, air_.colours[k].last}, ray, &guide);
    } else {
      others.push_back(k);
    }
  }
  for (const std::size_t k : others) {
    packer.add({air_.colours[k].first, air_.colours[k].last}, follow(air_.colours[k]), nullptr);
  }
  return out;
}

}  // namespace twilight
