#include "sim/orders.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>
#include <vector>

#include "sim/angular_moments.h"
#include "sim/field_reference.h"
#include "sim/orders_coarse.h"
#include "sim/orders_grid.h"
#include "sim/orders_source.h"
#include "sim/orders_sweep.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;
constexpr int kMostOrders = 500;
// Degrees to which light scattered once, and twice or more, is scattered on between the field's
// points; the last scattering, into the view, has all.
constexpr int kFirstDegree = 16, kSmoothDegree = 8;
// No order from this one on may be brighter than so many times all the earlier ones: over the
// random scenes of tests/property light that goes on to fall has grown by at most 1.02 of them.
constexpr int kFirstFallingOrder = 5;
constexpr double kMostGrowth = 1.5;
// Of an order to the one before it, in the series after them.
constexpr double kMostRatio = 0.9999;
// Grids of light scattered twice, and more often.
constexpr int kTwicePolar = 24, kTwiceAzimuths = 12;
constexpr int kOftenPolar = 20, kOftenAzimuths = 8, kOftenDegree = 12;
// Levels above the aerosol take part in the interpolation, three where it is cubic.
constexpr std::size_t kLevelsAbove = 4;

template <class T>
double trace(const OrdersGrid<T>& grid, const IncomingLight<T>& light, std::size_t level,
             std::size_t node, std::size_t w) {
  return light.trace(level * grid.zenith.size() + node, grid.lanes, w);
}

template <class T>
class Solver {
 public:
  Solver(const OrdersMedium& medium, const DirectSunlight& sunlight, const OrdersOptions& options,
         const RunControl& control)
      : medium_(medium),
        sunlight_(sunlight),
        options_(options),
        control_(control),
        most_(options.scattering_orders.value_or(kMostOrders)),
        fine_(medium, options.zenith_step_deg, orders_levels(medium, options.altitude_levels),
              options.polar_directions, options.azimuth_directions, options.phase_degree,
              options.polarised, options.coarse_orders ? 2 * kLevelsAbove : kLevelsAbove) {}

  OrdersField solve() {
    IncomingLight<T> total(fine_), last;
    if (most_ > 1) {
      const BeamSource<T> beam = beam_source(fine_, medium_, sunlight_, options_);
      report();
      IncomingLight<T> light = sweep(fine_, medium_, beam, options_.ground_light, control_);
      take(fine_, std::move(light), last, total);
    }
    if (!options_.coarse_orders) {
      continue_series(fine_, last, total);
    } else if (most_ > 2) {
      continue_coarsely(last, total);
    }
    return field(total);
  }

 private:
  void report() const {
    control_.check();
    control_.report("orders", 1 - std::pow(0.7, orders_ - 1));
  }

  // Counts an order in; the largest relative error of any value if the orders left out are taken
  // for a geometric series.
  double take(const OrdersGrid<T>& grid, IncomingLight<T>&& light, IncomingLight<T>& last,
              IncomingLight<T>& total) {
    add(light.coherency, total.coherency);
    add(light.moments, total.moments);
    add(light.ground, total.ground);
    const double rest = series_error(grid, light, last, total);
    shares_.push_back(mean_radiance(grid, light));
    before_ = std::exchange(last, std::move(light));
    ++orders_;
    return rest;
  }

  static void add(const std::vector<T>& more, std::vector<T>& sum) {
    for (std::size_t i = 0; i < more.size(); ++i) sum[i] += more[i];
  }

  // One order more, from the light of the order before; true when the series has ended.
  bool next_order(const OrdersGrid<T>& grid, IncomingLight<T>& last, IncomingLight<T>& total) {
    report();
    // Light of order 1 still carries the aerosol's forward scattering; later ones are smooth.
    const int degree = orders_ == 2 ? kFirstDegree : kSmoothDegree;
    IncomingLight<T> light = sweep(grid, medium_, scattered_source(grid, medium_, last, degree),
                                   options_.ground_light, control_);
    // Light gathers in thick white haze for a few orders and then falls: one that goes on growing
    // is the error of a grid too coarse for its air, and the series ends before it.
    const double brightest = brightest_light(grid, light);
    if (orders_ < kFirstFallingOrder) {
      brightest_ = std::max(brightest_, brightest);
    } else if (brightest > kMostGrowth * brightest_) {
      return true;
    }
    const double error = take(grid, std::move(light), last, total);
    if (options_.scattering_orders || error >= options_.order_tolerance) return false;
    add_series(grid, last, before_, total);
    return true;
  }

  void continue_series(const OrdersGrid<T>& grid, IncomingLight<T>& last, IncomingLight<T>& total) {
    while (orders_ < most_) {
      if (next_order(grid, last, total)) return;
    }
    if (!options_.scattering_orders) add_series(grid, last, before_, total);
  }

  // Light scattered twice on fewer directions, all that follows on half the levels too.
  void continue_coarsely(IncomingLight<T>& last, IncomingLight<T>& total) {
    std::vector<std::size_t> every(fine_.level_km.size());
    std::iota(every.begin(), every.end(), std::size_t{0});
    const Coarsening twice{every, kTwicePolar, kTwiceAzimuths, kFirstDegree};
    const Coarsening often{coarse_levels(fine_.level_km, medium_.optics), kOftenPolar,
                           kOftenAzimuths, kOftenDegree};
    on_coarse_grid(fine_, twice, last, total,
                   [&](const OrdersGrid<T>& grid, IncomingLight<T>& light, IncomingLight<T>& sum) {
                     if (next_order(grid, light, sum) || orders_ >= most_) return;
                     on_coarse_grid(grid, often, light, sum,
                                    [&](const OrdersGrid<T>& coarse, IncomingLight<T>& coarse_light,
                                        IncomingLight<T>& coarse_sum) {
                                      continue_series(coarse, coarse_light, coarse_sum);
                                    });
                   });
  }

  // Lets `orders` add to the total on a coarser grid, and brings back what it has added.
  template <class Orders>
  void on_coarse_grid(const OrdersGrid<T>& grid, const Coarsening& coarsening,
                      const IncomingLight<T>& last, IncomingLight<T>& total, const Orders& orders) {
    const OrdersGrid<T> coarse = coarse_grid(grid, coarsening, medium_, options_.zenith_step_deg);
    IncomingLight<T> light = restrict_light(grid, coarse, coarsening.kept, last);
    const IncomingLight<T> known = restrict_light(grid, coarse, coarsening.kept, total);
    IncomingLight<T> sum = known;
    before_ = IncomingLight<T>();
    expected_.clear();
    orders(coarse, light, sum);
    for (auto [whole, part] :
         {std::pair{&sum.coherency, &known.coherency}, std::pair{&sum.moments, &known.moments},
          std::pair{&sum.ground, &known.ground}}) {
      for (std::size_t i = 0; i < whole->size(); ++i) (*whole)[i] -= (*part)[i];
    }
    add_prolonged(coarse, grid, coarsening.kept, sum, last, total);
  }

  double brightest_light(const OrdersGrid<T>& grid, const IncomingLight<T>& light) const {
    double most = 0;
    for (std::size_t i = 0; i < grid.level_km.size(); ++i) {
      for (std::size_t j = 0; j < grid.nodes; ++j) {
        for (std::size_t w = 0; w < medium_.truncated.wavelengths(); ++w) {
          most = std::max(most, trace(grid, light, i, j, w));
        }
      }
    }
    return most;
  }

  // The series after an order, now = r past, is now r / (1 - r). How far an order and its series
  // come out from the series of the order before is that one's error, in every value; it goes on
  // falling as it has just fallen, though no faster than light does in clear air.
  double series_error(const OrdersGrid<T>& grid, const IncomingLight<T>& light,
                      const IncomingLight<T>& before, const IncomingLight<T>& total) {
    constexpr double kDeepest = 109 * kRadPerDeg, kFastest = 0.35, kSlowest = 0.95;
    const std::size_t wavelengths = medium_.truncated.wavelengths();
    const std::size_t values = grid.level_km.size() * grid.nodes * wavelengths;
    const bool first = expected_.size() != values;
    if (first) {
      expected_.assign(values, 0.0);
      surprise_.assign(values, 0.0);
    }
    double error = first ? 1.0 : 0.0;
    for (std::size_t i = 0; i < grid.level_km.size(); ++i) {
      for (std::size_t j = 0; j < grid.nodes; ++j) {
        if (grid.zenith.zenith_rad()[j] > kDeepest) continue;
        for (std::size_t w = 0; w < wavelengths; ++w) {
          const double now = trace(grid, light, i, j, w), sum = trace(grid, total, i, j, w);
          if (!(sum > kDarkTrace)) continue;
          const double past = before.coherency.empty() ? 0 : trace(grid, before, i, j, w);
          const double ratio = past > 0 ? std::min(now / past, kMostRatio) : 0.9;
          const double series = now * ratio / (1 - ratio);
          const std::size_t at = (i * grid.nodes + j) * wavelengths + w;
          const double surprise = std::abs(now + series - std::exchange(expected_[at], series));
          const double last = std::exchange(surprise_[at], surprise);
          if (first) continue;
          const double fall = last > 0 ? std::clamp(surprise / last, kFastest, kSlowest) : kSlowest;
          error = std::max(error, surprise * fall / (1 - fall) / sum);
        }
      }
    }
    return error;
  }

  // Adds what follows an order when every one is to the order before as this one is to the last.
  void add_series(const OrdersGrid<T>& grid, const IncomingLight<T>& light,
                  const IncomingLight<T>& before, IncomingLight<T>& total) const {
    if (before.coherency.empty()) return;
    const std::size_t all = grid.zenith.size(), lanes = grid.lanes;
    const auto factor = [](double now, double past) {
      const double ratio = past > 0 ? std::clamp(now / past, 0.0, kMostRatio) : 0.0;
      return static_cast<T>(ratio / (1 - ratio));
    };
    tbb::parallel_for(std::size_t{0}, grid.level_km.size(), [&](std::size_t i) {
      for (std::size_t j = 0; j < grid.nodes; ++j) {
        const std::size_t C = (i * all + j) * 4 * lanes;
        const std::size_t M = (i * all + j) * grid.moments * lanes;
        for (std::size_t w = 0; w < lanes; ++w) {
          const T more = factor(trace(grid, light, i, j, w), trace(grid, before, i, j, w));
          for (std::size_t k = 0; k < 4; ++k) {
            total.coherency[C + k * lanes + w] += more * light.coherency[C + k * lanes + w];
          }
          if (i >= grid.aerosol_levels) continue;
          for (std::size_t k = 0; k < grid.moments; ++k) {
            total.moments[M + k * lanes + w] += more * light.moments[M + k * lanes + w];
          }
        }
      }
    });
    for (std::size_t k = 0; k < light.ground.size(); ++k) {
      total.ground[k] +=
          factor(static_cast<double>(light.ground[k]), static_cast<double>(before.ground[k])) *
          light.ground[k];
    }
  }

  // At the ground, at the node nearest to a Sun 6 degrees below the horizon, times 4 pi, [lane].
  std::vector<double> mean_radiance(const OrdersGrid<T>& grid,
                                    const IncomingLight<T>& light) const {
    const auto node = static_cast<std::size_t>(std::lround(grid.zenith.position(96 * kRadPerDeg)));
    std::vector<double> mean(grid.lanes);
    for (std::size_t w = 0; w < grid.lanes; ++w) mean[w] = trace(grid, light, 0, node, w);
    return mean;
  }

  OrdersField field(const IncomingLight<T>& total) const {
    OrdersField field;
    field.wavelength_nm = medium_.truncated.wavelength_nm;
    field.altitude_km = fine_.level_km;
    field.solar_zenith_rad = fine_.zenith.zenith_rad();
    field.zenith_step_deg = options_.zenith_step_deg;
    field.phase_degree = medium_.degree;
    field.polarised = options_.polarised;
    field.aerosol_levels = fine_.aerosol_levels;
    field.moments_per_node = fine_.moments;
    field.orders = orders_;
    const std::size_t wavelengths = field.wavelength_nm.size();
    const std::vector<double> sum = mean_radiance(fine_, total);
    for (const auto& share : shares_) {
      for (std::size_t w = 0; w < wavelengths; ++w) {
        field.order_share.push_back(sum[w] > 0 ? share[w] / sum[w] : 0.0);
      }
    }
    const auto unpad = [&](const std::vector<T>& padded) {
      std::vector<float> values;
      values.reserve(padded.size() / fine_.lanes * wavelengths);
      for (std::size_t i = 0; i < padded.size(); i += fine_.lanes) {
        for (std::size_t w = 0; w < wavelengths; ++w) {
          values.push_back(static_cast<float>(padded[i + w]));
        }
      }
      return values;
    };
    field.coherency = unpad(total.coherency);
    field.aerosol_moments = unpad(total.moments);
    field.ground_irradiance = unpad(total.ground);
    return field;
  }

  const OrdersMedium& medium_;
  const DirectSunlight& sunlight_;
  const OrdersOptions& options_;
  const RunControl& control_;
  int most_, orders_ = 1;  // scattering events
  OrdersGrid<T> fine_;
  IncomingLight<T> before_;       // of the order before the last
  std::vector<double> expected_;  // of the orders left, [level][node][wavelength] of the trace
  std::vector<double> surprise_;  // how far the last order came out from it
  double brightest_ = 0;          // of the orders 2 to 4
  std::vector<std::vector<double>> shares_;  // mean radiance of every order, [lane]
};

}  // namespace

OrdersField solve_orders(const OrdersMedium& medium, const DirectSunlight& sunlight,
                         const OrdersOptions& options, const RunControl& control) {
  if (options.single_precision) return Solver<float>(medium, sunlight, options, control).solve();
  return Solver<double>(medium, sunlight, options, control).solve();
}

}  // namespace twilight
