// The project's table of Rayleigh skies: both solvers, sums and orders.
#include "tests/golden/open_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "output/csv_table.h"
#include "sim/monte_carlo_sky.h"
#include "sim/orders_sky.h"
#include "tests/validation/checks.h"

namespace twilight::validation {
namespace {

// The table's medium; its Sun is set by the caller.
SceneModel open_case_model(const Settings& settings) {
  constexpr int kLayers = 200;
  constexpr double kStepKm = 0.5, kScaleKm = 8, kGroundPerKm = 0.0116;
  SceneModel model;
  Scene& scene = model.scene;
  scene.solver.method = "orders";
  scene.solver.polarisation = false;
  scene.sun.disc_average = false;
  scene.earth.ground_albedo = 0;
  scene.atmosphere.refraction = false;
  scene.atmosphere.refractive_spreading = false;
  scene.aerosols.type = "none";
  scene = with_overrides(scene, settings);
  Medium& m = model.medium;
  m.earth_radius_km = 6371;
  m.wavelength_nm = {550};
  for (int i = 0; i <= kLayers; ++i) m.boundary_km.push_back(kStepKm * i);
  m.zero_tables();
  for (std::size_t i = 0; i < m.layers(); ++i) {
    m.air_scattering_per_km(i, 0) =
        kGroundPerKm * kScaleKm / kStepKm *
        (std::exp(-m.boundary_km[i] / kScaleKm) - std::exp(-m.boundary_km[i + 1] / kScaleKm));
  }
  m.depolarisation = {0};
  model.solar_irradiance = {1};
  model.ground_albedo = {0};
  return model;
}

std::string name_of(const OpenCase& c) {
  return fmt::format("Sun {:g}, view {:g}/{:g}", c.sun_elevation_deg, c.view_elevation_deg,
                     c.relative_azimuth_deg);
}

// Every row by orders with at most so many scattering events (none given: until the rest is small).
std::vector<double> orders_rows(std::optional<int> most, const Settings& settings) {
  SceneModel model = open_case_model(settings);
  model.scene.solver.scattering_orders = most;
  std::shared_ptr<const OrdersField> field;
  std::unique_ptr<OrdersSky> sky;
  std::vector<double> values;
  for (const OpenCase& c : kAllOpenCases) {
    const double sun = c.sun_elevation_deg * kRadPerDeg;
    if (!sky || model.sun_elevation_rad != sun) {
      model.sun_elevation_rad = sun;
      sky = std::make_unique<OrdersSky>(model, field, RunControl{});
      field = sky->field();
    }
    const ViewDirection view = ViewAngles{c.view_elevation_deg, c.relative_azimuth_deg}.direction();
    values.push_back(sky->radiance({&view, 1})[0]);
  }
  return values;
}

std::vector<Check> rows_by_orders(const Settings& settings) {
  constexpr double kBar = 0.004;
  const Stopwatch watch;
  const std::vector<double> values = orders_rows(std::nullopt, settings);
  std::vector<double> differences;
  std::size_t failures = 0;
  CsvTable table({"sun_deg", "elevation_deg", "relative_azimuth_deg", "orders_per_sr",
                  "reference_per_sr", "standard_error_per_sr", "difference_percent", "sigmas"});
  for (std::size_t k = 0; k < values.size(); ++k) {
    const OpenCase& c = kAllOpenCases[k];
    const double difference = values[k] / c.radiance - 1;
    differences.push_back(difference);
    const bool holds = std::abs(difference) <= kBar + 2 * c.standard_error / c.radiance;
    failures += holds ? 0 : 1;
    table.add_row({c.sun_elevation_deg, c.view_elevation_deg, c.relative_azimuth_deg, values[k],
                   c.radiance, c.standard_error, 100 * difference,
                   (values[k] - c.radiance) / c.standard_error});
    if (!holds) {
      say(settings, fmt::format("open cases, {}: orders {:.5e}, table {:.5e}, {:+.2f} %, s.e. "
                                "{:.2f} % FAIL",
                                name_of(c), values[k], c.radiance, 100 * difference,
                                100 * c.standard_error / c.radiance));
    }
  }
  if (!settings.directory.empty()) {
    table.write(settings.directory / "open-cases-orders.csv", std::cout);
  }
  return {{"open cases by orders", "every row within 0.4 % + 2 s.e.",
           fmt::format("{}; {} rows beyond the bar", text_of(spread_of(differences)), failures),
           failures == 0, watch.seconds()}};
}

// Each order's share, from solves that stop after 1, 2, ... events. The table gives no standard
// error of a share: that of a part cannot be much more than that of the whole.
std::vector<Check> shares_by_orders(const Settings& settings) {
  constexpr double kBar = 0.004;
  const Stopwatch watch;
  std::vector<Check> checks;
  std::vector<double> before(kAllOpenCases.size());
  for (int order = 1; order <= (settings.quick ? 3 : 5); ++order) {
    const Stopwatch one;
    const std::vector<double> sums = orders_rows(order, settings);
    double worst = 0, worst_of_share = 0;
    std::size_t failures = 0;
    for (std::size_t k = 0; k < sums.size(); ++k) {
      const OpenCase& c = kAllOpenCases[k];
      const double share = sums[k] - before[k];
      const double wanted = c.order(static_cast<std::size_t>(order));
      const double difference = (share - wanted) / c.radiance;
      const bool holds = std::abs(difference) <= kBar + 2 * c.standard_error / c.radiance;
      failures += holds ? 0 : 1;
      if (std::abs(difference) > std::abs(worst)) worst = difference;
      if (c.sun_elevation_deg >= 0) {
        worst_of_share = std::max(worst_of_share, std::abs(share / wanted - 1));
      }
      if (!holds) {
        say(settings, fmt::format("open cases, {}: order {} {:.4e}, table {:.4e}: {:+.2f} % of the "
                                  "radiance FAIL",
                                  name_of(c), order, share, wanted, 100 * difference));
      }
    }
    checks.push_back({fmt::format("open cases, order {} alone", order),
                      "within 0.4 % of the radiance + 2 s.e. of it",
                      fmt::format("largest {:+.2f} % of the radiance; of the share itself {:.1f} % "
                                  "(Sun 30 to 0); {} rows beyond the bar",
                                  100 * worst, 100 * worst_of_share, failures),
                      failures == 0, one.seconds()});
    before = sums;
  }
  return checks;
}

std::vector<Check> rows_by_monte_carlo(const Settings& settings) {
  const Stopwatch watch;
  SceneModel model = open_case_model(settings);
  model.scene.solver.method = "monte-carlo";
  model.scene.solver.target_relative_error = settings.quick ? 0.01 : 0.003;
  std::unique_ptr<MonteCarloSky> sky;
  std::size_t rows = 0, within = 0, index = 0;
  std::vector<double> differences;
  double largest = 0, squares = 0;
  CsvTable table({"sun_deg", "elevation_deg", "relative_azimuth_deg", "monte_carlo_per_sr",
                  "standard_error_per_sr", "reference_per_sr", "reference_standard_error_per_sr",
                  "sigmas"});
  for (const OpenCase& c : kAllOpenCases) {
    if (settings.quick && index++ % 6 != 0) continue;
    const double sun = c.sun_elevation_deg * kRadPerDeg;
    if (!sky || model.sun_elevation_rad != sun) {
      model.sun_elevation_rad = sun;
      sky = std::make_unique<MonteCarloSky>(model, RunControl{});
    }
    const Stopwatch one;
    const MonteCarloEstimate e =
        sky->estimate(ViewAngles{c.view_elevation_deg, c.relative_azimuth_deg}.direction());
    const double error = std::hypot(e.i_error[0], c.standard_error);
    const double sigmas = (e.i[0] - c.radiance) / error;
    ++rows;
    within += std::abs(sigmas) <= 3 ? 1 : 0;
    largest = std::max(largest, std::abs(sigmas));
    squares += sigmas * sigmas;
    differences.push_back(e.i[0] / c.radiance - 1);
    table.add_row({c.sun_elevation_deg, c.view_elevation_deg, c.relative_azimuth_deg, e.i[0],
                   e.i_error[0], c.radiance, c.standard_error, sigmas});
    say(settings, fmt::format("open cases by Monte Carlo, {}: {:+.2f} % ({:+.1f} s.e.), {:.1f} s",
                              name_of(c), 100 * differences.back(), sigmas, one.seconds()));
  }
  if (!settings.directory.empty()) {
    table.write(settings.directory / "open-cases-monte-carlo.csv", std::cout);
  }
  const double part = static_cast<double>(within) / static_cast<double>(rows);
  return {{"open cases by Monte Carlo", "within 3 s.e. in at least 98 % of rows",
           fmt::format("{:.0f} % of {} rows, largest {:.1f} s.e., rms {:.2f} s.e.; {}", 100 * part,
                       rows, largest, std::sqrt(squares / static_cast<double>(rows)),
                       text_of(spread_of(differences))),
           part >= 0.98, watch.seconds()}};
}

}  // namespace

std::vector<Section> open_cases_sections() {
  return {{"open-cases-orders", "48 Rayleigh skies by orders", rows_by_orders},
          {"open-cases-shares", "the share of every order in them", shares_by_orders},
          {"open-cases-mc", "the same skies by our Monte Carlo", rows_by_monte_carlo}};
}

}  // namespace twilight::validation
