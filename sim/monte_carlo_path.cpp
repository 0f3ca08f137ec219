#include "sim/monte_carlo_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
// First leg: share drawn by the expected light, the rest by scattering alone.
constexpr double kFirstLit = 0.85;
constexpr double kFirstPieceKm = 5, kFirstPieceDepth = 0.1, kFirstMostParts = 200;
// Later legs, and directions.
constexpr double kLaterLit = 0.75;
constexpr double kGuided = 0.6, kAureole = 0.12;
// Paths expected to bring less than this share of the view's radiance are thinned out.
constexpr double kRoulette = 0.25, kLeastSurvival = 0.03;
constexpr double kLeastGround = 0.05;
constexpr int kEndlessOrders = 100000;

}  // namespace

MonteCarloView::MonteCarloView(const MonteCarloWorld& world, double elevation_rad,
                               double azimuth_rad)
    : world_(&world), zenith_rad_(kPi / 2 - elevation_rad) {
  horizontal_ = {std::cos(azimuth_rad), -std::sin(azimuth_rad), 0};
  const Medium& m = *world.medium;
  const std::size_t W = m.wavelengths();
  middle_ = W / 2;
  bool same_fate = true;
  for (std::size_t w = 0; w < W; ++w) {
    ray_.push_back(world.sunlight->rays(w).trace(world.observer_height_km, zenith_rad_));
    one_ray_ = one_ray_ && (W == 1 || !world.sunlight->rays(w).refracting());
    const BentRays::Trace& ray = ray_.back();
    same_fate = same_fate && ray.hits_ground == ray_[0].hits_ground &&
                (ray.length_km > 0) == (ray_[0].length_km > 0);
  }
  if (!same_fate) {
    one_ray_ = true;
    for (std::size_t w = 0; w < W; ++w) {
      if (w != middle_) ray_[w] = ray_[middle_];
    }
  }
  for (std::size_t w = 0; w < W; ++w) {
    const BentRays::Trace& ray = ray_[w];
    std::vector<double> depth;
    double sum = 0;
    for (const BentPiece& p : ray.pieces) {
      depth.push_back(sum);
      if (p.layer != BentRays::kOutside) sum += p.length_km * m.extinction_per_km(p.layer, w);
    }
    depth.push_back(sum);
    depth_.push_back(std::move(depth));
    empty_ = empty_ && !(ray.length_km > 0) && !ray.hits_ground;
  }
  if (!empty_) weigh_pieces();
}

MonteCarloView::Point MonteCarloView::point(std::size_t w, double path_km) const {
  const BentRays::Trace& ray = ray_[w];
  Point p{};
  double x = 0, bend = 0;
  if (ray.pieces.empty()) {  // the observer stands on the ground and looks down
    p.height_km = 0;
    p.layer = 0;
    const double v = world_->sunlight->rays(w).nr_km(0);
    x = v * std::cos(zenith_rad_);
  } else {
    const auto after =
        std::upper_bound(ray.pieces.begin() + 1, ray.pieces.end(), path_km,
                         [](double s, const BentPiece& piece) { return s < piece.path0_km; });
    auto i = static_cast<std::size_t>(after - ray.pieces.begin()) - 1;
    while (i > 0 && ray.pieces[i].layer == BentRays::kOutside) --i;
    while (ray.pieces[i].layer == BentRays::kOutside && i + 1 < ray.pieces.size()) ++i;
    const BentPiece& piece = ray.pieces[i];
    const double s = std::clamp(path_km - piece.path0_km, 0.0, piece.length_km);
    x = std::clamp(piece.x0_km + s / piece.path_per_x, piece.x0_km, piece.x1_km);
    bend = piece.bend0_rad + piece.bend_rad_per_km * (x - piece.x0_km);
    const double nr = std::sqrt(x * x + ray.impact_km * ray.impact_km);
    const auto& b = world_->medium->boundary_km;
    p.layer = piece.layer;
    p.height_km = std::clamp(piece.height_km + (nr - piece.nr_km) * piece.path_per_x, b[p.layer],
                             b[p.layer + 1]);
    p.optical_depth = depth_[w][i] + s * world_->medium->extinction_per_km(p.layer, w);
  }
  const double here = std::atan2(ray.impact_km, x);
  const double turned = zenith_rad_ + bend;
  const double central = turned - here;
  const Vec3 vertical{0, 0, 1};
  p.up = vertical * std::cos(central) + horizontal_ * std::sin(central);
  p.position = p.up * (world_->medium->earth_radius_km + p.height_km);
  p.direction = vertical * std::cos(turned) + horizontal_ * std::sin(turned);
  p.axis = vertical * std::sin(turned) - horizontal_ * std::cos(turned);
  p.cos_chi = dot(p.up, world_->sun);
  return p;
}

void MonteCarloView::weigh_pieces() {
  const MonteCarloImportance& importance = *world_->importance;
  const Medium& m = *world_->medium;
  const std::size_t G = importance.references();
  const BentRays::Trace& ray = ray_[middle_];
  std::vector<ReferenceValues> lit, analogue;
  ReferenceValues depth{}, lit_sum{}, analogue_sum{};
  for (const BentPiece& bent : ray.pieces) {
    if (bent.layer == BentRays::kOutside || !(bent.length_km > 0)) continue;
    double thickest = 0;
    for (const std::size_t w : importance.reference()) {
      thickest = std::max(thickest, m.extinction_per_km(bent.layer, w));
    }
    const double parts = std::clamp(
        std::ceil(bent.length_km * std::max(1 / kFirstPieceKm, thickest / kFirstPieceDepth)), 1.0,
        kFirstMostParts);
    const double step = bent.length_km / parts;
    for (int i = 0; i < static_cast<int>(parts); ++i) {
      const double start = bent.path0_km + i * step;
      const Point p = point(middle_, start + 0.5 * step);
      const double cosine = dot(p.direction, world_->sun);
      const ReferenceValues aerosol = importance.aerosol_phase(cosine);
      const double air = 0.75 * (1 + cosine * cosine);
      ReferenceValues light{}, scatter{};
      double f = 0;
      const float* s = importance.source(p.layer, p.cos_chi, f);
      for (std::size_t g = 0; g < G; ++g) {
        const std::size_t w = importance.reference()[g];
        const double beta = m.extinction_per_km(p.layer, w),
                     beta_air = m.air_scattering_per_km(p.layer, w);
        const double scattering = importance.scattering_per_km(p.layer, g);
        const double sun =
            static_cast<double>(s[2 * g]) + f * static_cast<double>(s[2 * (G + g)] - s[2 * g]);
        const double rest = static_cast<double>(s[2 * g + 1]) +
                            f * static_cast<double>(s[2 * (G + g) + 1] - s[2 * g + 1]);
        const double t = std::exp(-depth[g] - 0.5 * beta * step);
        light[g] = t * step *
                   (sun * (beta_air * air + (scattering - beta_air) * aerosol[g]) / (4 * kPi) +
                    scattering * rest);
        scatter[g] = t * step * scattering;
        depth[g] += beta * step;
        lit_sum[g] += light[g];
        analogue_sum[g] += scatter[g];
      }
      lit.push_back(light);
      analogue.push_back(scatter);
      piece_.push_back({start, step, p.layer, 0, 0});
    }
  }
  ReferenceValues expected = lit_sum;
  if (ray.hits_ground) {
    const Point p = point(middle_, ray.length_km);
    for (std::size_t g = 0; g < G; ++g) {
      const std::size_t w = importance.reference()[g];
      double irradiance = 0, cosine = 0;
      world_->sunlight->at_one(w, 0, 0, p.cos_chi, &irradiance, &cosine);
      expected[g] +=
          std::exp(-depth[g]) * world_->ground_albedo[w] *
          (irradiance * std::max(0.0, cosine) / kPi + importance.ground_scattered(p.cos_chi, g));
    }
  }
  double brightest = 0;
  for (std::size_t g = 0; g < G; ++g) brightest = std::max(brightest, expected[g]);
  for (std::size_t g = 0; g < G; ++g) {
    weight_[g] = expected[g] > 1e-30 ? 1 / (expected[g] * static_cast<double>(G)) : 0;
    if (!(brightest > 1e-30)) weight_[g] = 1;
  }
  double sum = 0;
  for (std::size_t k = 0; k < piece_.size(); ++k) {
    double value = 0;
    for (std::size_t g = 0; g < G; ++g) {
      const double n = static_cast<double>(G);
      double lit_share = kFirstLit;
      if (!(lit_sum[g] > 1e-30)) lit_share = 0;
      if (lit_share > 0) value += lit_share * lit[k][g] / lit_sum[g] / n;
      if (analogue_sum[g] > 0) {
        value += (1 - lit_share) * analogue[k][g] / analogue_sum[g] / n;
      }
    }
    sum += value;
    piece_[k].lit_sum = sum;
  }
  if (!(sum > 0)) piece_.clear();
  for (LegPiece& p : piece_) p.lit_sum /= sum;
}

MonteCarloPath::MonteCarloPath(const MonteCarloWorld& world)
    : world_(&world),
      W_(world.medium->wavelengths()),
      G_(world.importance->references()),
      rows_(world.polarised ? 3 : 1),
      columns_(!world.polarised               ? 1
               : world.scattering->circular() ? 4
                                              : 3),
      weights_(W_),
      irradiance_(W_),
      cosine_(W_),
      limb_(W_, 1.0),
      depth_(W_),
      air_factor_(W_),
      ground_factor_(W_),
      m_(6 * W_),
      matrices_{&m_[0], &m_[W_], &m_[2 * W_], &m_[3 * W_], &m_[4 * W_], &m_[5 * W_]},
      cutter_(world.medium->boundary_km, world.medium->earth_radius_km) {
  const Medium& m = *world.medium;
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < W_; ++w) {
      extinction_.push_back(m.extinction_per_km(i, w));
      scattering_.push_back(m.air_scattering_per_km(i, w) + m.aerosol_scattering_per_km(i, w));
    }
  }
  for (const double a : world.ground_albedo) any_albedo_ = any_albedo_ || a > 0;
  light_.pieces.reserve(4 * m.layers() + 64);
}

Vec3 MonteCarloPath::random_sun(PathRandom& random) {
  if (!(world_->sun_radius_rad > 0)) return world_->sun;
  const double u = random.next(), around = 2 * kPi * random.next();
  const double mu = std::sqrt(1 - u);
  for (std::size_t w = 0; w < W_; ++w) limb_[w] = world_->limb[w](mu);
  const double angle = world_->sun_radius_rad * std::sqrt(u);
  const Vec3 a = any_normal(world_->sun), b = cross(world_->sun, a);
  return world_->sun * std::cos(angle) +
         (a * std::cos(around) + b * std::sin(around)) * std::sin(angle);
}

Vec3 MonteCarloPath::apparent_sun(const Vec3& up, const Vec3& sun, double cos_chi,
                                  double cos_apparent) const {
  Vec3 level = sun - up * cos_chi;
  const double size = norm(level);
  if (size < 1e-12) return sun;
  level = level * (1 / size);
  return up * cos_apparent + level * std::sqrt(std::max(0.0, 1 - cos_apparent * cos_apparent));
}

void MonteCarloPath::add_scattered(const State& at, const Vec3& sun, std::size_t first,
                                   std::size_t last, int order, double* sums) {
  const double cos_chi = dot(at.up, sun);
  if (last - first == 1) {
    if (!world_->sunlight->at_one(first, at.height_km, at.layer, cos_chi, &irradiance_[first],
                                  &cosine_[first])) {
      return;
    }
  } else if (!world_->sunlight->at(at.height_km, at.layer, cos_chi, irradiance_.data(),
                                   cosine_.data())) {
    return;
  }
  const Vec3 from = apparent_sun(at.up, sun, cos_chi, cosine_[(first + last) / 2]);
  const double cosine = std::clamp(dot(at.direction, from), -1.0, 1.0);
  world_->scattering->matrices(at.layer, cosine, first, last, !world_->polarised, matrices_);
  if (!world_->polarised) {
    const double* a = weights_.at(0, 0);
    for (std::size_t w = first; w < last; ++w) {
      add(0, w, a[w] * matrices_.a1[w] * irradiance_[w] * limb_[w] * air_factor_[w], order, sums);
    }
    return;
  }
  const ScatteringFrame frame = scattering_frame(at.direction, at.axis, from);
  for (std::size_t row = 0; row < 3; ++row) {
    const double *i = weights_.at(row, 0), *q = weights_.at(row, 1), *u = weights_.at(row, 2);
    for (std::size_t w = first; w < last; ++w) {
      const double light = irradiance_[w] * limb_[w] * air_factor_[w];
      const double value =
          i[w] * matrices_.a1[w] + (q[w] * frame.cos2 + u[w] * frame.sin2) * matrices_.b1[w];
      add(row, w, light * value, order, sums);
    }
  }
}

void MonteCarloPath::add_ground(const Vec3& up, const Vec3& sun, std::size_t first,
                                std::size_t last, int order, double* sums) {
  const double cos_chi = dot(up, sun);
  for (std::size_t w = first; w < last; ++w) {
    if (!world_->sunlight->at_one(w, 0, 0, cos_chi, &irradiance_[w], &cosine_[w])) continue;
    const double light = irradiance_[w] * limb_[w] * std::max(0.0, cosine_[w]) *
                         world_->ground_albedo[w] / kPi * ground_factor_[w];
    for (std::size_t row = 0; row < rows_; ++row) {
      add(row, w, weights_.at(row, 0)[w] * light, order, sums);
    }
  }
}

void MonteCarloPath::scale(const std::vector<double>& factor, double common) {
  for (std::size_t row = 0; row < rows_; ++row) {
    for (std::size_t column = 0; column < columns_; ++column) {
      double* a = weights_.at(row, column);
      for (std::size_t w = 0; w < W_; ++w) a[w] *= factor[w] * common;
    }
  }
}

bool MonteCarloPath::choose_continuation(const MonteCarloView& view, State& air,
                                         const State& ground, bool has_air, bool has_ground,
                                         PathRandom& random) {
  if (!has_air && !has_ground) return false;
  const MonteCarloImportance& importance = *world_->importance;
  double from_air = 0, from_ground = 0;
  for (std::size_t g = 0; g < G_; ++g) {
    const std::size_t w = importance.reference()[g];
    const double weight = view.weight_[g] * std::max(0.0, weights_.at(0, 0)[w]);
    if (has_air) {
      from_air += weight * air_factor_[w] * scattering_[air.layer * W_ + w] *
                  importance.scattered(air.layer, air.cos_chi, g);
    }
    if (has_ground) {
      from_ground += weight * ground_factor_[w] * world_->ground_albedo[w] *
                     importance.ground_scattered(ground.cos_chi, g);
    }
  }
  const double expected = from_air + from_ground;
  double survival = std::clamp(expected / kRoulette, kLeastSurvival, 1.0);
  if (!std::isfinite(survival)) survival = 1;
  double ground_probability = has_air ? 0.0 : 1.0;
  if (has_air && has_ground) {
    ground_probability =
        kLeastGround + (1 - 2 * kLeastGround) * (expected > 0 ? from_ground / expected : 0.5);
  }
  double u = random.next();
  if (u >= survival) return false;
  u /= survival;
  if (u < ground_probability) {
    air = ground;
    scale(ground_factor_, 1 / (survival * ground_probability));
  } else {
    scale(air_factor_, 1 / (survival * (1 - ground_probability)));
  }
  return true;
}

bool MonteCarloPath::turn(const MonteCarloView& view, State& at, PathRandom& random) {
  const MonteCarloImportance& importance = *world_->importance;
  const MonteCarloScattering& scattering = *world_->scattering;
  ReferenceValues share{};
  double total = 0;
  for (std::size_t g = 0; g < G_; ++g) {
    const std::size_t w = importance.reference()[g];
    double value = view.weight_[g] * std::max(0.0, weights_.at(0, 0)[w]);
    value *= at.on_ground ? world_->ground_albedo[w] : scattering_[at.layer * W_ + w];
    share[g] = value;
    total += value;
  }
  for (std::size_t g = 0; g < G_; ++g) {
    share[g] = total > 0 ? share[g] / total : 1.0 / static_cast<double>(G_);
  }
  const auto choose_reference = [&] {
    if (G_ == 1) return std::size_t{0};
    double u = random.next();
    std::size_t g = 0;
    while (g + 1 < G_ && u >= share[g]) u -= share[g++];
    return g;
  };

  // The local frame: up, and the Sun's azimuth.
  Vec3 toward = world_->sun - at.up * at.cos_chi;
  const double size = norm(toward);
  toward = size > 1e-9 ? toward * (1 / size) : any_normal(at.up);
  const Vec3 side = cross(at.up, toward);
  const MonteCarloImportance::Guide guide =
      importance.guide(at.height_km, at.on_ground, at.cos_chi);

  double aureole = 0;
  Vec3 sun = world_->sun;
  const std::size_t middle = G_ / 2;
  if (scattering.has_aerosol()) {
    double irradiance = 0, cosine = at.cos_chi;
    if (world_->sunlight->at_one(importance.reference()[middle], at.height_km, at.layer, at.cos_chi,
                                 &irradiance, &cosine) &&
        irradiance > 0) {
      aureole = kAureole;
      sun = apparent_sun(at.up, world_->sun, at.cos_chi, cosine);
    }
  }
  const auto around = [](const Vec3& axis, double cosine, double angle) {
    const Vec3 a = any_normal(axis), b = cross(axis, a);
    const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
    return axis * cosine + (a * std::cos(angle) + b * std::sin(angle)) * sine;
  };

  Vec3 next{};
  const double pick = random.next();
  if (pick < kGuided) {
    const std::size_t g = choose_reference();
    double sine = 0, azimuth = 0;
    const double u = random.next(), v = random.next(), x = random.next();
    importance.sample_direction(guide, g, u, v, x, sine, azimuth);
    const double level = std::sqrt(std::max(0.0, 1 - sine * sine));
    next = at.up * sine + (toward * std::cos(azimuth) + side * std::sin(azimuth)) * level;
  } else if (pick < kGuided + aureole) {
    const double u = random.next(), v = random.next();
    const double cosine = scattering.sample_aureole_cosine(middle, u, v);
    next = around(sun, cosine, 2 * kPi * random.next());
  } else if (at.on_ground) {
    const double u = random.next();
    next = around(at.up, std::sqrt(u), 2 * kPi * random.next());
  } else {
    const std::size_t g = choose_reference();
    const double u = random.next(), v = random.next();
    const double cosine = scattering.sample_cosine(at.layer, g, u, v);
    next = around(at.direction, cosine, 2 * kPi * random.next());
  }
  next = unit(next);

  const double sine = std::clamp(dot(next, at.up), -1.0, 1.0);
  if (at.on_ground && sine <= 0) return false;
  const double level = std::sqrt(std::max(1e-300, 1 - sine * sine));
  const double cos_azimuth = std::clamp(dot(next, toward) / level, -1.0, 1.0);
  const double cosine = std::clamp(dot(next, at.direction), -1.0, 1.0);
  double density = 0;
  const ReferenceValues guided = importance.direction_density_per_sr(guide, sine, cos_azimuth);
  for (std::size_t g = 0; g < G_; ++g) {
    if (!(share[g] > 0)) continue;
    density += share[g] * kGuided * guided[g];
    const double plain = at.on_ground ? sine / kPi : scattering.density_per_sr(at.layer, g, cosine);
    density += share[g] * (1 - kGuided - aureole) * plain;
  }
  if (aureole > 0) {
    density +=
        aureole * scattering.aureole_density_per_sr(middle, std::clamp(dot(next, sun), -1.0, 1.0));
  }
  if (!(density > 0)) return false;
  const double inverse = 1 / density;

  if (at.on_ground) {
    for (std::size_t row = 0; row < rows_; ++row) {
      double* i = weights_.at(row, 0);
      for (std::size_t w = 0; w < W_; ++w) {
        i[w] *= world_->ground_albedo[w] * sine / kPi * inverse;
      }
      for (std::size_t column = 1; column < columns_; ++column) {
        std::fill_n(weights_.at(row, column), W_, 0.0);
      }
    }
    at.axis = any_normal(next);
  } else if (!world_->polarised) {
    scattering.matrices(at.layer, cosine, 0, W_, true, matrices_);
    double* i = weights_.at(0, 0);
    for (std::size_t w = 0; w < W_; ++w) i[w] *= matrices_.a1[w] * inverse;
  } else {
    scattering.matrices(at.layer, cosine, 0, W_, false, matrices_);
    const ScatteringFrame frame = scattering_frame(at.direction, at.axis, next);
    for (std::size_t row = 0; row < 3; ++row) {
      double *i = weights_.at(row, 0), *q = weights_.at(row, 1), *u = weights_.at(row, 2);
      if (columns_ == 4) {
        double* v = weights_.at(row, 3);
        for (std::size_t w = 0; w < W_; ++w) {
          const double qs = q[w] * frame.cos2 + u[w] * frame.sin2;
          const double us = u[w] * frame.cos2 - q[w] * frame.sin2;
          const double is = i[w], vs = v[w];
          i[w] = inverse * (is * matrices_.a1[w] + qs * matrices_.b1[w]);
          q[w] = inverse * (is * matrices_.b1[w] + qs * matrices_.a2[w]);
          u[w] = inverse * (us * matrices_.a3[w] - vs * matrices_.b2[w]);
          v[w] = inverse * (us * matrices_.b2[w] + vs * matrices_.a4[w]);
        }
      } else {
        for (std::size_t w = 0; w < W_; ++w) {
          const double qs = q[w] * frame.cos2 + u[w] * frame.sin2;
          const double us = u[w] * frame.cos2 - q[w] * frame.sin2;
          const double is = i[w];
          i[w] = inverse * (is * matrices_.a1[w] + qs * matrices_.b1[w]);
          q[w] = inverse * (is * matrices_.b1[w] + qs * matrices_.a2[w]);
          u[w] = inverse * us * matrices_.a3[w];
        }
      }
    }
    at.axis = frame.axis_in;
  }
  at.direction = next;
  return true;
}

void MonteCarloPath::follow(const MonteCarloView& view, PathRandom& random, double* sums) {
  const Medium& m = *world_->medium;
  if (view.empty()) return;
  for (std::size_t row = 0; row < rows_; ++row) {
    for (std::size_t column = 0; column < columns_; ++column) {
      std::fill_n(weights_.at(row, column), W_, row == column ? 1.0 : 0.0);
    }
  }
  const auto state_of = [](const MonteCarloView::Point& p, bool on_ground) {
    return State{p.position, p.up, p.direction, p.axis, p.height_km, p.cos_chi, p.layer, on_ground};
  };

  // The first leg, along the bent view ray.
  const std::size_t middle = view.middle_;
  const double length = view.ray_[middle].length_km;
  State at{}, ground{};
  const bool has_air = !view.piece_.empty();
  if (has_air) {
    const double u = random.next();
    const auto piece = std::lower_bound(view.piece_.begin(), view.piece_.end() - 1, u,
                                        [](const LegPiece& p, double x) { return p.lit_sum < x; });
    const double before = piece == view.piece_.begin() ? 0 : (piece - 1)->lit_sum;
    const double probability = piece->lit_sum - before;
    const double inside = std::clamp((u - before) / probability, 0.0, 1.0);
    const double s = piece->start_km + inside * piece->length_km;
    const double inverse_density = piece->length_km / probability;
    const Vec3 sun = random_sun(random);
    const MonteCarloView::Point middle_point = view.point(middle, s);
    at = state_of(middle_point, false);
    if (view.one_ray_) {
      const auto i = static_cast<std::size_t>(
          std::upper_bound(view.ray_[middle].pieces.begin() + 1, view.ray_[middle].pieces.end(), s,
                           [](double x, const BentPiece& p) { return x < p.path0_km; }) -
          view.ray_[middle].pieces.begin() - 1);
      const BentPiece& bent = view.ray_[middle].pieces[i];
      for (std::size_t w = 0; w < W_; ++w) {
        const double depth =
            view.depth_[w][i] + (s - bent.path0_km) * extinction_[at.layer * W_ + w];
        air_factor_[w] = std::exp(-depth) * inverse_density;
      }
      add_scattered(at, sun, 0, W_, 1, sums);
    } else {
      for (std::size_t w = 0; w < W_; ++w) {
        const double stretch = view.ray_[w].length_km / length;
        const MonteCarloView::Point p = view.point(w, s * stretch);
        air_factor_[w] = std::exp(-p.optical_depth) * inverse_density * stretch;
        add_scattered(state_of(p, false), sun, w, w + 1, 1, sums);
        // The path goes on from the middle wavelength's point with the scattering of its own.
        const double here = scattering_[at.layer * W_ + w];
        if (p.layer != at.layer && here > 0) {
          air_factor_[w] *= scattering_[p.layer * W_ + w] / here;
        }
      }
    }
  }
  bool has_ground = view.ray_[middle].hits_ground && any_albedo_;
  if (has_ground) {
    const Vec3 sun = random_sun(random);
    ground = state_of(view.point(middle, length), true);
    for (std::size_t w = 0; w < W_; ++w) {
      ground_factor_[w] = std::exp(-view.depth_[w].back());
      const Vec3 up = view.one_ray_ ? ground.up : view.point(w, view.ray_[w].length_km).up;
      add_ground(up, sun, w, w + 1, 1, sums);
    }
  }
  const int most = world_->most_orders > 0 ? world_->most_orders : kEndlessOrders;
  if (most == 1 || !choose_continuation(view, at, ground, has_air, has_ground, random)) return;

  const MonteCarloImportance& importance = *world_->importance;
  for (int order = 2; order <= most; ++order) {
    if (!turn(view, at, random)) return;
    const double up_cosine = dot(at.direction, at.up);
    const bool hits = cutter_.cut(at.height_km, at.layer, up_cosine);
    const double toward = dot(at.direction, world_->sun);
    ReferenceValues weight{};
    for (std::size_t g = 0; g < G_; ++g) {
      weight[g] = view.weight_[g] * std::max(0.0, weights_.at(0, 0)[importance.reference()[g]]);
    }
    // Far from 1 the sums would leave the range of float.
    double largest = 0;
    for (std::size_t g = 0; g < G_; ++g) largest = std::max(largest, weight[g]);
    if (!(largest > 0)) return;
    for (std::size_t g = 0; g < G_; ++g) weight[g] /= largest;
    importance.weigh(cutter_.crossings(), (m.earth_radius_km + at.height_km) * at.cos_chi, toward,
                     0.75 * (1 + toward * toward), importance.aerosol_phase(toward), weight,
                     light_);

    const double analogue = light_.analogue_total, lit = light_.lit_total;
    const bool air_here = !light_.pieces.empty() && (analogue > 0 || lit > 0);
    State from = at;
    if (air_here) {
      const double lit_share = lit > 0 ? (analogue > 0 ? kLaterLit : 1.0) : 0.0;
      double u = random.next();
      const bool by_light = u < lit_share;
      u = by_light ? u / lit_share : (u - lit_share) / (1 - lit_share);
      const auto sum_of = [by_light](const LegPiece& p) {
        return by_light ? p.lit_sum : p.analogue_sum;
      };
      const double target = u * (by_light ? lit : analogue);
      const auto& pieces = light_.pieces;
      const auto k = static_cast<std::size_t>(
          std::lower_bound(pieces.begin(), pieces.end() - 1, target,
                           [&](const LegPiece& p, double x) { return sum_of(p) < x; }) -
          pieces.begin());
      const LegPiece& piece = pieces[k];
      const double lit_before = k > 0 ? pieces[k - 1].lit_sum : 0;
      const double analogue_before = k > 0 ? pieces[k - 1].analogue_sum : 0;
      const double before = by_light ? lit_before : analogue_before;
      const double part = sum_of(piece) - before;
      const double inside = part > 0 ? std::clamp((target - before) / part, 0.0, 1.0) : 0.5;
      double probability = 0;
      if (lit > 0) probability += lit_share * (piece.lit_sum - lit_before) / lit;
      if (analogue > 0) {
        probability += (1 - lit_share) * (piece.analogue_sum - analogue_before) / analogue;
      }
      if (!(probability > 0)) return;
      const double s = piece.start_km + inside * piece.length_km;
      std::fill(depth_.begin(), depth_.end(), 0.0);
      double start = 0;
      for (const LegCrossing& c : cutter_.crossings()) {
        const double path = std::min(c.end_km, s) - start;
        const double* extinction = &extinction_[c.layer * W_];
        for (std::size_t w = 0; w < W_; ++w) depth_[w] += path * extinction[w];
        start = c.end_km;
        if (start >= s) break;
      }
      const double inverse_density = piece.length_km / probability;
      for (std::size_t w = 0; w < W_; ++w) air_factor_[w] = std::exp(-depth_[w]) * inverse_density;
      at.position = from.position + from.direction * s;
      const double r = norm(at.position);
      at.up = at.position * (1 / r);
      at.layer = piece.layer;
      at.height_km =
          std::clamp(r - m.earth_radius_km, m.boundary_km[at.layer], m.boundary_km[at.layer + 1]);
      at.cos_chi = dot(at.up, world_->sun);
      at.on_ground = false;
      add_scattered(at, random_sun(random), 0, W_, order, sums);
    }
    const bool ground_here = hits && any_albedo_;
    if (ground_here) {
      std::fill(depth_.begin(), depth_.end(), 0.0);
      double start = 0;
      for (const LegCrossing& c : cutter_.crossings()) {
        const double* extinction = &extinction_[c.layer * W_];
        for (std::size_t w = 0; w < W_; ++w) depth_[w] += (c.end_km - start) * extinction[w];
        start = c.end_km;
      }
      for (std::size_t w = 0; w < W_; ++w) ground_factor_[w] = std::exp(-depth_[w]);
      ground = from;
      ground.position = from.position + from.direction * start;
      ground.up = unit(ground.position);
      ground.height_km = 0;
      ground.layer = 0;
      ground.cos_chi = dot(ground.up, world_->sun);
      ground.on_ground = true;
      add_ground(ground.up, random_sun(random), 0, W_, order, sums);
    }
    if (order == most || !choose_continuation(view, at, ground, air_here, ground_here, random)) {
      return;
    }
  }
}

}  // namespace twilight
