#include "sim/monte_carlo_sky.h"

#include <fmt/format.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/elapsed_time.h"
#include "sim/solver_arena.h"

namespace twilight {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kBatch = 256, kFirstBatches = 32, kRound = 2048;
constexpr double kMostPaths = 2e9, kDark = 1e-15;
constexpr std::size_t kFewestBatches = 16;
// Irradiance: directions per batch and paths per direction.
constexpr std::size_t kDirections = 64, kPathsPerDirection = 4, kMostIrradianceBatches = 4096;
constexpr double kIrradianceGuided = 0.7;

void check_model(const SceneModel& model) {
  const Medium& m = model.medium;
  if (m.layers() == 0 || m.wavelengths() == 0) {
    throw std::invalid_argument("the medium must have a layer and a wavelength");
  }
  if (model.solar_irradiance.size() != m.wavelengths()) {
    throw std::invalid_argument("solar_irradiance: one value per wavelength");
  }
  if (!model.ground_albedo.empty() && model.ground_albedo.size() != m.wavelengths()) {
    throw std::invalid_argument("ground_albedo: one value per wavelength");
  }
}

}  // namespace

// Sums over batches of equal size, in their order.
class MonteCarloSky::Statistics {
 public:
  explicit Statistics(std::size_t values) : sum_(values), squares_(values) {}
  void add(const double* batch_mean) {
    ++batches_;
    for (std::size_t k = 0; k < sum_.size(); ++k) {
      sum_[k] += batch_mean[k];
      squares_[k] += batch_mean[k] * batch_mean[k];
    }
  }
  double mean(std::size_t k) const { return sum_[k] / static_cast<double>(batches_); }
  double error(std::size_t k) const {
    const double n = static_cast<double>(batches_);
    if (batches_ < 2) return std::abs(mean(k));
    return std::sqrt(std::max(0.0, squares_[k] / n - mean(k) * mean(k)) / (n - 1));
  }
  std::size_t batches() const { return batches_; }

 private:
  std::vector<double> sum_, squares_;
  std::size_t batches_ = 0;
};

MonteCarloSky::~MonteCarloSky() = default;

MonteCarloSky::MonteCarloSky(const SceneModel& model, const RunControl& control)
    : model_(model), control_(control) {
  check_model(model_);
  const Scene& scene = model_.scene;
  const std::size_t W = model_.medium.wavelengths();
  if (!scene.atmosphere.refraction) {
    model_.medium.refractivity = LayerTable(model_.medium.layers(), W);
  }
  arena_ = std::make_unique<SolverArena>(scene.solver.threads);
  world_.medium = &model_.medium;
  world_.ground_albedo = model_.ground_albedo.empty()
                             ? std::vector<double>(W, scene.earth.ground_albedo)
                             : model_.ground_albedo;
  world_.sun = {std::cos(model_.sun_elevation_rad), 0, std::sin(model_.sun_elevation_rad)};
  if (disc_averaged(scene)) {
    world_.sun_radius_rad = kSunAngularRadiusRad / model_.sun_distance_au;
    for (const double nm : model_.medium.wavelength_nm) world_.limb.emplace_back(nm);
  }
  world_.polarised = polarised(scene);
  world_.most_orders = scene.solver.scattering_orders.value_or(0);
  world_.observer_height_km = observer_altitude_km(scene);

  std::vector<std::size_t> reference{0};
  if (W == 2) reference = {0, 1};
  if (W > 2) reference = {0, W / 2, W - 1};
  arena_->arena.execute([&] {
    control_.report("sunlight", 0.0);
    auto stage = Clock::now();
    sunlight_ =
        std::make_unique<MonteCarloSunlight>(model_.medium, scene.atmosphere.refractive_spreading);
    summary_.stage_seconds.emplace_back("sunlight", seconds_since(stage));
    control_.check();
    stage = Clock::now();
    scattering_ = std::make_unique<MonteCarloScattering>(model_.medium, reference);
    importance_ = std::make_unique<MonteCarloImportance>(
        model_.medium, reference, world_.ground_albedo, *sunlight_, *scattering_,
        std::sin(model_.sun_elevation_rad), [this] { control_.check(); });
    summary_.stage_seconds.emplace_back("importance", seconds_since(stage));
  });
  world_.sunlight = sunlight_.get();
  world_.scattering = scattering_.get();
  world_.importance = importance_.get();
  find_direct_sun();
}

MonteCarloSky::DirectBeam MonteCarloSky::direct_beam(std::size_t w, double true_zenith) const {
  DirectBeam beam;
  const BentRays& rays = sunlight_->rays(w);
  const double h = world_.observer_height_km;
  beam.apparent_zenith_rad = true_zenith;
  const auto bending = [&](double a, bool& hits) {
    const BentRays::Trace t = rays.trace(h, a);
    hits = t.hits_ground;
    return t.bending_rad;
  };
  // a + bending(a) rises with a; rays into the ground lie beyond.
  double low = 0, high = true_zenith;
  for (int i = 0; i < 60; ++i) {
    const double a = i == 0 ? true_zenith : 0.5 * (low + high);
    bool hits = false;
    const double bend = bending(a, hits);
    (hits || a + bend > true_zenith ? high : low) = a;
    if (i == 0 && !hits && bend == 0) {
      low = high = true_zenith;
      break;
    }
  }
  const double a = low;
  bool hits = false;
  if (std::abs(a + bending(a, hits) - true_zenith) > 1e-6 || hits) return beam;
  beam.apparent_zenith_rad = a;
  if (rays.refracting() && model_.scene.atmosphere.refractive_spreading && true_zenith > 1e-6) {
    const double step = std::min(1e-5, 0.1 * a);
    bool below = false;
    double upper = a + step;
    double beyond = bending(upper, below);
    if (below) {
      upper = a;
      beyond = bending(a, below);
    }
    const double slope = 1 + (beyond - bending(a - step, below)) / (upper - a + step);
    const double n = rays.nr_km(h) / (model_.medium.earth_radius_km + h);
    beam.spreading = n * n * std::sin(a) / std::sin(true_zenith) / slope;
  }
  double depth = model_.medium.vertical_filter_optical_depth.empty()
                     ? 0
                     : model_.medium.vertical_filter_optical_depth[w];
  for (const BentPiece& p : rays.trace(h, a).pieces) {
    if (p.layer != BentRays::kOutside) {
      depth += p.length_km * model_.medium.extinction_per_km(p.layer, w);
    }
  }
  beam.transmittance = std::exp(-depth);
  return beam;
}

void MonteCarloSky::find_direct_sun() {
  const std::size_t W = model_.medium.wavelengths();
  sun_transmittance_.assign(W, 0.0);
  apparent_elevation_rad_ = model_.sun_elevation_rad;
  for (std::size_t w = 0; w < W; ++w) {
    const DirectBeam beam = direct_beam(w, kPi / 2 - model_.sun_elevation_rad);
    sun_transmittance_[w] = beam.transmittance;
    if (w == W / 2) apparent_elevation_rad_ = kPi / 2 - beam.apparent_zenith_rad;
  }
}

void MonteCarloSky::run_batches(const MonteCarloView& view, std::uint64_t view_key,
                                std::size_t first, std::size_t last, std::size_t paths,
                                Statistics& statistics) const {
  const std::size_t values = kPathQuantities * model_.medium.wavelengths();
  tbb::enumerable_thread_specific<MonteCarloPath> workers(
      [this] { return MonteCarloPath(world_); });
  std::vector<double> means;
  for (std::size_t begin = first; begin < last; begin += kRound) {
    const std::size_t end = std::min(last, begin + kRound);
    means.assign((end - begin) * values, 0.0);
    tbb::parallel_for(begin, end, [&](std::size_t batch) {
      control_.check();
      MonteCarloPath& path = workers.local();
      double* sums = &means[(batch - begin) * values];
      const std::uint64_t key = combine_keys(view_key, batch);
      const ShiftedLattice lattice(key);
      for (std::size_t p = 0; p < paths; ++p) {
        PathRandom random(lattice, p, combine_keys(key, p));
        path.follow(view, random, sums);
      }
      for (std::size_t k = 0; k < values; ++k) sums[k] /= static_cast<double>(paths);
    });
    for (std::size_t batch = begin; batch < end; ++batch) {
      statistics.add(&means[(batch - begin) * values]);
    }
  }
}

MonteCarloEstimate MonteCarloSky::estimate_here(const ViewDirection& direction) const {
  const std::size_t W = model_.medium.wavelengths();
  const SolverOptions& solver = model_.scene.solver;
  const MonteCarloView view(world_, direction.elevation_rad, direction.relative_azimuth_rad);
  Statistics statistics(kPathQuantities * W);
  std::uint64_t key = combine_keys(0x7477696c69676874ULL, static_cast<std::uint64_t>(solver.seed));
  key = combine_keys(key, std::bit_cast<std::uint64_t>(direction.elevation_rad));
  key = combine_keys(key, std::bit_cast<std::uint64_t>(direction.relative_azimuth_rad));

  std::size_t paths = kBatch;
  if (view.empty()) {
    paths = 1;
    run_batches(view, key, 0, 2, paths, statistics);
  } else if (solver.photons) {
    const double batches = std::max(static_cast<double>(kFewestBatches),
                                    std::ceil(*solver.photons / static_cast<double>(kBatch)));
    paths = static_cast<std::size_t>(std::ceil(*solver.photons / batches));
    run_batches(view, key, 0, static_cast<std::size_t>(batches), paths, statistics);
  } else {
    std::size_t wanted = kFirstBatches;
    const auto most = static_cast<std::size_t>(kMostPaths / static_cast<double>(kBatch));
    for (;;) {
      run_batches(view, key, statistics.batches(), wanted, paths, statistics);
      double worst = 0;
      for (std::size_t w = 0; w < W; ++w) {
        if (statistics.mean(w) > kDark) {
          worst = std::max(worst, statistics.error(w) / statistics.mean(w));
        }
      }
      if (worst <= solver.target_relative_error || wanted >= most) break;
      const double factor = 1.1 * std::pow(worst / solver.target_relative_error, 2);
      const double more = static_cast<double>(wanted) * std::clamp(factor, 1.2, 16.0);
      wanted = std::min(most, static_cast<std::size_t>(std::ceil(more)));
    }
  }

  MonteCarloEstimate e;
  e.photons = static_cast<double>(paths * statistics.batches());
  const auto take = [&](std::size_t quantity, std::vector<double>& value,
                        std::vector<double>& error) {
    for (std::size_t w = 0; w < W; ++w) {
      value.push_back(model_.solar_irradiance[w] * statistics.mean(quantity * W + w));
      error.push_back(model_.solar_irradiance[w] * statistics.error(quantity * W + w));
    }
  };
  take(0, e.i, e.i_error);
  take(1, e.q, e.q_error);
  take(2, e.u, e.u_error);
  for (std::size_t k = 0; k < e.order.size(); ++k) take(3 + k, e.order[k], e.order_error[k]);
  return e;
}

MonteCarloEstimate MonteCarloSky::estimate(const ViewDirection& view) const {
  MonteCarloEstimate e;
  arena_->arena.execute([&] { e = estimate_here(view); });
  return e;
}

StokesRadiance MonteCarloSky::stokes(std::span<const ViewDirection> views) const {
  const std::size_t W = model_.medium.wavelengths();
  StokesRadiance out;
  for (auto* v : {&out.i, &out.standard_error}) v->resize(views.size() * W);
  if (world_.polarised) {
    for (auto* v : {&out.q, &out.u}) v->resize(views.size() * W);
  }
  std::atomic<std::size_t> done = 0;
  arena_->arena.execute([&] {
    tbb::parallel_for(std::size_t{0}, views.size(), [&](std::size_t k) {
      const MonteCarloEstimate e = estimate_here(views[k]);
      for (std::size_t w = 0; w < W; ++w) {
        // Single paths may count negatively by rounding; never their mean, but for a dark sky's.
        const double i = std::max(0.0, e.i[w]);
        out.i[k * W + w] = i;
        out.standard_error[k * W + w] = e.i_error[w];
        if (!world_.polarised) continue;
        const double linear = std::hypot(e.q[w], e.u[w]);
        const double cut = linear > i ? i / linear * (1 - 1e-15) : 1;
        out.q[k * W + w] = cut * e.q[w];
        out.u[k * W + w] = cut * e.u[w];
      }
      const std::size_t n = ++done;
      control_.report("paths", static_cast<double>(n) / static_cast<double>(views.size()));
    });
  });
  return out;
}

std::vector<double> MonteCarloSky::radiance(std::span<const ViewDirection> views) const {
  return stokes(views).i;
}

Irradiance MonteCarloSky::irradiance() const {
  const std::size_t W = model_.medium.wavelengths(), G = importance_->references();
  Irradiance result;
  result.direct.assign(W, 0.0);
  result.diffuse.assign(W, 0.0);

  // Direct: the disc's points where they are above the horizon.
  const bool disc = world_.sun_radius_rad > 0;
  const int rings = disc ? 8 : 1, spokes = disc ? 16 : 1;
  std::vector<double> disc_light(W, 0.0);  // normalises the midpoint rule
  for (int i = 0; i < rings; ++i) {
    for (std::size_t w = 0; w < W; ++w) {
      disc_light[w] += disc ? world_.limb[w](std::sqrt(1 - (i + 0.5) / rings)) : 1;
    }
  }
  for (int i = 0; i < rings; ++i) {
    const double area = (i + 0.5) / rings;
    for (int j = 0; j < spokes; ++j) {
      const double offset =
          disc ? world_.sun_radius_rad * std::sqrt(area) * std::cos(2 * kPi * (j + 0.5) / spokes)
               : 0;
      const double zenith = std::clamp(kPi / 2 - model_.sun_elevation_rad + offset, 0.0, kPi);
      for (std::size_t w = 0; w < W; ++w) {
        const DirectBeam beam = direct_beam(w, zenith);
        const double limb = disc ? world_.limb[w](std::sqrt(1 - area)) : 1;
        result.direct[w] += model_.solar_irradiance[w] * beam.transmittance * beam.spreading *
                            limb * std::max(0.0, std::cos(beam.apparent_zenith_rad)) /
                            (disc_light[w] * spokes);
      }
    }
  }

  // Diffuse: directions by the guide of the ground below, and by cosine.
  const MonteCarloImportance::Guide guide =
      importance_->guide(0, true, std::sin(model_.sun_elevation_rad));
  const auto seed = static_cast<std::uint64_t>(model_.scene.solver.seed);
  const std::uint64_t key = combine_keys(0x6972726164696e63ULL, seed);
  Statistics statistics(W);
  const std::size_t values = kPathQuantities * W;
  arena_->arena.execute([&] {
    tbb::enumerable_thread_specific<MonteCarloPath> workers(
        [this] { return MonteCarloPath(world_); });
    std::size_t wanted = kFirstBatches;
    for (;;) {
      const std::size_t first = statistics.batches();
      std::vector<double> means((wanted - first) * W, 0.0);
      tbb::parallel_for(first, wanted, [&](std::size_t batch) {
        control_.check();
        MonteCarloPath& path = workers.local();
        const std::uint64_t batch_key = combine_keys(key, batch);
        const ShiftedLattice lattice(batch_key);
        double* mean = &means[(batch - first) * W];
        std::vector<double> sums(values);
        for (std::size_t d = 0; d < kDirections; ++d) {
          const std::uint64_t direction_key = combine_keys(batch_key, d);
          PathRandom random(lattice, d, direction_key);
          const double pick = random.next(), u = random.next(), v = random.next();
          const double x = random.next();
          const auto g =
              std::min(G - 1, static_cast<std::size_t>(random.next() * static_cast<double>(G)));
          double sine = 0, azimuth = 0;
          if (pick < kIrradianceGuided) {
            importance_->sample_direction(guide, g, u, v, x, sine, azimuth);
          } else {
            sine = std::sqrt(u);
            azimuth = 2 * kPi * v;
          }
          if (!(sine > 0)) continue;
          double density = (1 - kIrradianceGuided) * sine / kPi;
          const ReferenceValues guided =
              importance_->direction_density_per_sr(guide, sine, std::cos(azimuth));
          for (std::size_t k = 0; k < G; ++k) {
            density += kIrradianceGuided / static_cast<double>(G) * guided[k];
          }
          const MonteCarloView view(world_, std::asin(std::min(1.0, sine)), azimuth);
          std::fill(sums.begin(), sums.end(), 0.0);
          const ShiftedLattice inner(combine_keys(direction_key, 1));
          for (std::size_t p = 0; p < kPathsPerDirection; ++p) {
            PathRandom inner_random(inner, p, combine_keys(direction_key, 2 + p));
            path.follow(view, inner_random, sums.data());
          }
          for (std::size_t w = 0; w < W; ++w) {
            mean[w] +=
                sums[w] * sine / density / static_cast<double>(kDirections * kPathsPerDirection);
          }
        }
      });
      for (std::size_t b = 0; b < wanted - first; ++b) statistics.add(&means[b * W]);
      double worst = 0;
      for (std::size_t w = 0; w < W; ++w) {
        if (statistics.mean(w) > kDark) {
          worst = std::max(worst, statistics.error(w) / statistics.mean(w));
        }
      }
      const double target = model_.scene.solver.target_relative_error;
      if (worst <= target || wanted >= kMostIrradianceBatches) break;
      const double more =
          static_cast<double>(wanted) * std::clamp(1.1 * std::pow(worst / target, 2), 1.2, 16.0);
      wanted = std::min(kMostIrradianceBatches, static_cast<std::size_t>(std::ceil(more)));
    }
  });
  std::string errors;
  for (std::size_t w = 0; w < W; ++w) {
    result.diffuse[w] = model_.solar_irradiance[w] * std::max(0.0, statistics.mean(w));
    errors += fmt::format("{}{:.2g}", w > 0 ? ", " : "",
                          statistics.mean(w) > 0 ? statistics.error(w) / statistics.mean(w) : 0.0);
  }
  const std::lock_guard lock(summary_mutex_);
  const char* label = "relative standard error of the diffuse irradiance";
  auto& figures = summary_.figures;
  std::erase_if(figures, [&](const auto& f) { return f.first == label; });
  figures.emplace_back(label, errors);
  return result;
}

}  // namespace twilight
