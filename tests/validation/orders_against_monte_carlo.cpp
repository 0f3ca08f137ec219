// The two solvers of one physical model, which share its description and no other code.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "output/csv_table.h"
#include "sim/monte_carlo_sky.h"
#include "sim/orders_sky.h"
#include "tests/validation/checks.h"

namespace twilight::validation {
namespace {

struct Grid {
  std::vector<double> suns_deg, heights_km;
  std::vector<ViewAngles> views;
  double bar = 0;  ///< relative
};

const Grid kUpToTwelveDown = {
    {30, 5, 0, -3, -6, -9, -12},
    {0, 3, 12},
    {{90, 0}, {45, 0}, {10, 0}, {10, 90}, {10, 180}, {2, 0}, {2, 90}, {2, 180}},
    0.005};
const Grid kDeep = {{-15, -18}, {0}, {{90, 0}, {10, 0}, {10, 180}}, 0.02};
const Grid kQuick = {{5, -3, -6}, {0, 12}, {{90, 0}, {10, 180}}, 0.005};

Scene scene_of(const std::string& aerosol, double albedo, const Settings& settings) {
  Scene scene;
  scene.sun.elevation_deg = 0;
  scene.earth.ground_albedo = albedo;
  scene.aerosols.type = aerosol;
  if (settings.quick) {
    scene.spectrum.wavelengths_nm = {550};
  } else {
    scene.spectrum.wavelengths_nm = {400, 550, 700};
  }
  scene.solver.method = "orders";
  scene = with_overrides(scene, settings);
  return scene;
}

// Tells media apart, so that no Monte Carlo result outlives the air it was computed in.
std::string fingerprint_of(const SceneModel& model) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  const auto mix = [&](double x) {
    // Nine digits: a change of rounding is no change of the air.
    for (const char c : fmt::format("{:.8e}", x)) {
      hash = (hash ^ static_cast<std::uint64_t>(static_cast<unsigned char>(c))) * 0x100000001b3ULL;
    }
  };
  const Medium& m = model.medium;
  mix(m.earth_radius_km);
  for (const double z : m.boundary_km) mix(z);
  for (const double d : m.depolarisation) mix(d);
  for (std::size_t i = 0; i < m.layers(); ++i) {
    for (std::size_t w = 0; w < m.wavelengths(); ++w) {
      mix(m.air_scattering_per_km(i, w));
      mix(m.aerosol_scattering_per_km(i, w));
      mix(m.aerosol_absorption_per_km(i, w));
      mix(m.gas_absorption_per_km(i, w));
      mix(m.refractivity(i, w));
      for (const LayerTable& kind : m.aerosol_kind_scattering_per_km) mix(kind(i, w));
    }
  }
  for (const double a : model.ground_albedo) mix(a);
  mix(disc_averaged(model.scene) ? 1 : 0);
  mix(polarised(model.scene) ? 1 : 0);
  mix(model.scene.atmosphere.refractive_spreading ? 1 : 0);
  return fmt::format("{:016x}", hash);
}

// One view by Monte Carlo, per unit solar irradiance, sr^-1, per wavelength.
struct Judged {
  std::vector<double> i, error;
  double photons = 0, seconds = 0;
};

struct PointKey {
  double sun_deg, height_km, elevation_deg, azimuth_deg;
  auto operator<=>(const PointKey&) const = default;
};

constexpr int kQuickPieces = 8;
// A point beyond the bar is judged a second time, by paths of its own and this many times the
// effort: of 500 true values noise alone puts one or two beyond three standard errors.
constexpr int kSecondEffort = 9, kSecondPieces = 1000000;

// Estimates of paths of their own (the seed of a path is a hash of the view, which is moved by
// 1e-12 rad), until the standard error or the time is reached.
Judged judge(const MonteCarloSky& sky, const ViewAngles& view, const Settings& settings,
             int first_piece = 0) {
  const Stopwatch watch;
  const std::span<const double> sun = sky.solar_irradiance();
  const std::size_t W = sun.size();
  std::vector<double> sum(W), variance(W);
  Judged result;
  for (int piece = first_piece;; ++piece) {
    ViewDirection direction = view.direction();
    direction.relative_azimuth_rad += 1e-12 * piece;
    const MonteCarloEstimate e = sky.estimate(direction);
    result.photons += e.photons;
    double worst = 0;
    for (std::size_t w = 0; w < W; ++w) {
      sum[w] += e.photons * e.i[w] / sun[w];
      variance[w] += std::pow(e.photons * e.i_error[w] / sun[w], 2);
      if (sum[w] > 0) worst = std::max(worst, std::sqrt(variance[w]) / sum[w]);
    }
    result.seconds = watch.seconds();
    if (worst <= settings.monte_carlo_relative) break;
    // A test must not depend on the machine's speed.
    const bool enough = settings.quick ? piece - first_piece + 1 >= kQuickPieces
                                       : result.seconds > settings.monte_carlo_seconds;
    if (enough) break;
  }
  for (std::size_t w = 0; w < W; ++w) {
    result.i.push_back(sum[w] / result.photons);
    result.error.push_back(std::sqrt(variance[w]) / result.photons);
  }
  return result;
}

// The Monte Carlo's results so far, kept in a file so that a run can go on where one stopped, and
// so that a change of the other solver costs no photons.
class JudgedPoints {
 public:
  JudgedPoints(const std::filesystem::path& file, const std::string& fingerprint,
               std::size_t wavelengths)
      : file_(file), wavelengths_(wavelengths) {
    if (file_.empty()) return;
    const std::string first = "# medium " + fingerprint;
    std::ifstream in(file_);
    std::string line;
    if (std::getline(in, line) && line == first) {
      while (std::getline(in, line)) read(line);
      return;
    }
    in.close();
    std::ofstream out(file_);
    out << first << "\nsun_deg,height_km,elevation_deg,relative_azimuth_deg,photons,seconds";
    for (std::size_t w = 0; w < wavelengths; ++w) {
      out << ",radiance_" << w << ",standard_error_" << w;
    }
    out << "\n";
    if (!out) throw std::runtime_error("cannot write " + file_.string());
  }

  const Judged* find(const PointKey& key) const {
    const auto at = points_.find(key);
    return at == points_.end() ? nullptr : &at->second;
  }

  const Judged& add(const PointKey& key, Judged judged) {
    if (!file_.empty()) {
      std::ofstream out(file_, std::ios::app);
      out << fmt::format("{},{},{},{},{},{:.3g}", key.sun_deg, key.height_km, key.elevation_deg,
                         key.azimuth_deg, judged.photons, judged.seconds);
      for (std::size_t w = 0; w < wavelengths_; ++w) {
        out << fmt::format(",{:.9e},{:.4e}", judged.i[w], judged.error[w]);
      }
      out << "\n";
      if (!out) throw std::runtime_error("cannot write " + file_.string());
    }
    return points_[key] = std::move(judged);
  }

 private:
  void read(const std::string& line) {
    std::vector<double> v;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) {
      if (cell.empty() || std::isalpha(static_cast<unsigned char>(cell[0]))) return;
      v.push_back(std::stod(cell));
    }
    // A line cut short by a stopped run is computed again.
    if (v.size() != 6 + 2 * wavelengths_) return;
    Judged judged;
    judged.photons = v[4];
    judged.seconds = v[5];
    for (std::size_t w = 0; w < wavelengths_; ++w) {
      judged.i.push_back(v[6 + 2 * w]);
      judged.error.push_back(v[7 + 2 * w]);
    }
    points_[{v[0], v[1], v[2], v[3]}] = std::move(judged);
  }

  std::filesystem::path file_;
  std::size_t wavelengths_;
  std::map<PointKey, Judged> points_;
};

struct Comparison {
  PointKey at;
  double wavelength_nm, orders, q, u, monte_carlo, error;
  double difference() const { return orders / monte_carlo - 1; }
  double sigmas() const { return (orders - monte_carlo) / error; }
  bool holds(double bar) const { return std::abs(difference()) <= bar || std::abs(sigmas()) <= 3; }
};

std::string text_of_point(const Comparison& c) {
  return fmt::format(
      "Sun {:g}, view {:g}/{:g}, {:g} nm, {:g} km up: orders {:.4e}, Monte Carlo {:.4e} +- "
      "{:.2f} %, {:+.2f} % ({:+.1f} s.e.)",
      c.at.sun_deg, c.at.elevation_deg, c.at.azimuth_deg, c.wavelength_nm, c.at.height_km, c.orders,
      c.monte_carlo, 100 * c.error / c.monte_carlo, 100 * c.difference(), c.sigmas());
}

std::vector<Check> compare(const std::string& name, const std::string& aerosol, double albedo,
                           const Grid& grid, const Settings& settings) {
  const Stopwatch watch;
  Scene scene = scene_of(aerosol, albedo, settings);
  SceneModel model = build_scene_model(scene);
  const std::vector<double> wavelengths = model.medium.wavelength_nm;
  const std::size_t W = wavelengths.size();
  const bool files = !settings.directory.empty();
  JudgedPoints points(files ? settings.directory / ("monte-carlo-" + name.substr(10) +
                                                    (settings.quick ? "-quick.csv" : ".csv"))
                            : std::filesystem::path(),
                      fingerprint_of(model), W);

  std::shared_ptr<const OrdersField> field;
  std::vector<Comparison> all;
  double orders_seconds = 0, judge_seconds = 0;
  std::size_t done = 0;
  int second_judgements = 0;
  const std::size_t total = grid.suns_deg.size() * grid.heights_km.size() * grid.views.size();
  for (const double sun_deg : grid.suns_deg) {
    model.sun_elevation_rad = sun_deg * kRadPerDeg;
    for (const double height_km : grid.heights_km) {
      model.scene.observer.height_m = 1e3 * height_km;
      const Stopwatch solving;
      const OrdersSky orders(model, field, RunControl{});
      if (!field) {
        say(settings, fmt::format("{}: field solved in {:.1f} s", name, solving.seconds()));
      }
      field = orders.field();
      std::unique_ptr<MonteCarloSky> monte_carlo;
      std::vector<ViewDirection> directions;
      for (const ViewAngles& v : grid.views) directions.push_back(v.direction());
      const StokesRadiance stokes = orders.stokes(directions);
      orders_seconds += solving.seconds();
      for (std::size_t k = 0; k < grid.views.size(); ++k) {
        const ViewAngles& v = grid.views[k];
        const PointKey key{sun_deg, height_km, v.elevation_deg, v.relative_azimuth_deg};
        const auto judging_sky = [&]() -> const MonteCarloSky& {
          if (!monte_carlo) {
            SceneModel its_model = model;
            its_model.scene.solver.method = "monte-carlo";
            // The first batches alone: judge() asks for more.
            its_model.scene.solver.photons = 16384;
            monte_carlo = std::make_unique<MonteCarloSky>(its_model, RunControl{});
          }
          return *monte_carlo;
        };
        const Judged* judged = points.find(key);
        if (judged == nullptr) judged = &points.add(key, judge(judging_sky(), v, settings));
        const auto holds = [&](const Judged& by) {
          for (std::size_t w = 0; w < W; ++w) {
            const Comparison c{key,        0, stokes.i[k * W + w] / model.solar_irradiance[w],
                               0,          0, by.i[w],
                               by.error[w]};
            if (!c.holds(grid.bar)) return false;
          }
          return true;
        };
        Judged again;
        if (!holds(*judged)) {
          ++second_judgements;
          Settings harder = settings;
          harder.monte_carlo_relative /= std::sqrt(static_cast<double>(kSecondEffort));
          harder.monte_carlo_seconds *= kSecondEffort;
          again = judge(judging_sky(), v, harder, kSecondPieces);
          judged = &again;
        }
        judge_seconds += judged->seconds;
        const Comparison* worst = nullptr;
        for (std::size_t w = 0; w < W; ++w) {
          const double sun = model.solar_irradiance[w];
          Comparison c{key,
                       wavelengths[w],
                       stokes.i[k * W + w] / sun,
                       stokes.q.empty() ? 0 : stokes.q[k * W + w] / sun,
                       stokes.u.empty() ? 0 : stokes.u[k * W + w] / sun,
                       judged->i[w],
                       judged->error[w]};
          all.push_back(c);
        }
        for (std::size_t w = 0; w < W; ++w) {
          const Comparison& c = all[all.size() - W + w];
          if (worst == nullptr || std::abs(c.difference()) > std::abs(worst->difference())) {
            worst = &c;
          }
        }
        ++done;
        say(settings, fmt::format("{} {}/{} ({:.1f} s): {}{}", name, done, total, judged->seconds,
                                  text_of_point(*worst), worst->holds(grid.bar) ? "" : " FAIL"));
      }
    }
  }

  std::vector<double> differences;
  std::size_t failures = 0, beyond_three = 0;
  double error = 0;
  for (const Comparison& c : all) {
    differences.push_back(c.difference());
    failures += c.holds(grid.bar) ? 0 : 1;
    beyond_three += std::abs(c.sigmas()) > 3 ? 1 : 0;
    error = std::max(error, c.error / c.monte_carlo);
  }
  std::string worst_ten;
  std::vector<Comparison> sorted = all;
  std::ranges::stable_sort(sorted, [](const Comparison& a, const Comparison& b) {
    return std::abs(a.difference()) > std::abs(b.difference());
  });
  for (std::size_t k = 0; k < std::min<std::size_t>(10, sorted.size()); ++k) {
    worst_ten +=
        fmt::format("- {}{}\n", text_of_point(sorted[k]), sorted[k].holds(grid.bar) ? "" : " FAIL");
  }
  say(settings, fmt::format("{}: the ten largest differences\n{}", name, worst_ten));
  if (files) {
    CsvTable table({"case", "sun_deg", "elevation_deg", "relative_azimuth_deg", "wavelength_nm",
                    "height_km", "air", "albedo", "orders_per_sr", "orders_q_per_sr",
                    "orders_u_per_sr", "monte_carlo_per_sr", "standard_error_per_sr",
                    "difference_percent", "sigmas", "holds"});
    table.add_comment("Radiances over the solar irradiance outside the atmosphere.");
    for (const Comparison& c : all) {
      table.add_row({name, c.at.sun_deg, c.at.elevation_deg, c.at.azimuth_deg, c.wavelength_nm,
                     c.at.height_km, aerosol, albedo, c.orders, c.q, c.u, c.monte_carlo, c.error,
                     100 * c.difference(), c.sigmas(), c.holds(grid.bar) ? 1.0 : 0.0});
    }
    std::ostringstream unused;
    table.write(settings.directory / (name + ".csv"), unused);
    std::ofstream list(settings.directory / (name + "-worst.md"));
    list << worst_ten;
  }
  Check check;
  check.name = fmt::format("orders against our Monte Carlo: {} air, albedo {:g}, Sun {:g} to {:g}",
                           aerosol == "none" ? "clear" : aerosol, albedo, grid.suns_deg.front(),
                           grid.suns_deg.back());
  check.bar = fmt::format("within {:g} % or 3 s.e.", 100 * grid.bar);
  check.measured = fmt::format(
      "{}; {} of {} views judged a second time; beyond the bar {}, beyond 3 s.e. {} ({:.1f} %); "
      "s.e. at most {:.2f} %; orders {:.0f} s, "
      "Monte Carlo {:.0f} s",
      text_of(spread_of(differences)), second_judgements, total, failures, beyond_three,
      100.0 * static_cast<double>(beyond_three) / static_cast<double>(all.size()), 100 * error,
      orders_seconds, judge_seconds);
  check.holds = failures == 0;
  check.seconds = watch.seconds();
  return {check};
}

}  // namespace

std::vector<Section> orders_against_monte_carlo_sections() {
  std::vector<Section> all;
  for (const bool deep : {false, true}) {
    for (const auto& [word, aerosol] :
         {std::pair{"clear", "none"}, {"average", "continental_average"}, {"urban", "urban"}}) {
      for (const double albedo : {0.0, 0.8}) {
        const std::string name =
            fmt::format("orders-mc-{}-{}-{:g}", deep ? "deep" : "grid", word, albedo);
        all.push_back(
            {name,
             fmt::format("orders against Monte Carlo, {}, albedo {:g}, Sun {}", aerosol, albedo,
                         deep ? "-15, -18" : "30 to -12"),
             [=, type = std::string(aerosol)](const Settings& settings) {
               const Grid& grid = settings.quick ? kQuick : deep ? kDeep : kUpToTwelveDown;
               return compare(name, type, albedo, grid, settings);
             }});
      }
    }
  }
  return all;
}

}  // namespace twilight::validation
