#include "output/air_retrieval.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <memory>
#include <stdexcept>

#include "atmosphere/csv_line.h"
#include "output/forward_model.h"
#include "output/study_axes.h"
#include "sim/quality.h"

namespace twilight {
namespace {

/// Ranges of the usual keys: what the air of the Earth has been seen to have, or what the scene can
/// hold.
struct UsualRange {
  std::string_view key;
  double low, high;
};
constexpr UsualRange kUsualRanges[] = {
    {"aerosols.optical_depth_550nm", 0.005, 2.0},
    {"aerosols.relative_humidity_percent", 0.0, 99.0},
    // None for aerosols.angstrom_exponent: each mixture reaches its own.
    {"atmosphere.ozone_du", 100.0, 600.0},
    {"atmosphere.nitrogen_dioxide_du", 0.0, 3.0},
    {"earth.ground_albedo", 0.0, 1.0},
    {"volcanic_sulfate.optical_depth_550nm", 0.0005, 0.5},
    {"dust_layer.optical_depth_550nm", 0.001, 2.0},
    {"preetham.turbidity", 2.0, 6.0},
};
// A range that spans more than this is searched in the logarithm.
constexpr double kLogarithmicSpan = 10.0;
constexpr std::string_view kNotOfTheAir[] = {"sun",    "observer", "spectrum", "solver",
                                             "output", "camera",   "budget",   "quality"};

[[noreturn]] void refuse(const std::string& item, const std::string& message) {
  throw std::invalid_argument(fmt::format("--free {}: {}", item, message));
}

double bound(const std::string& item, std::string_view text) {
  double value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size() || !std::isfinite(value)) {
    refuse(item, "must be KEY or KEY=LOW..HIGH, two finite numbers");
  }
  return value;
}

// "KEY=LOW..HIGH".
FreeParameter parse_free(const std::string& item) {
  FreeParameter p;
  const std::size_t equals = item.find('=');
  p.name = item.substr(0, equals);
  const std::string table = p.name.substr(0, p.name.find('.'));
  try {
    Scene probe;
    set_number(probe, p.name, 1.5);
  } catch (const std::invalid_argument& error) {
    refuse(item, error.what());
  }
  if (std::ranges::find(kNotOfTheAir, table) != std::end(kNotOfTheAir)) {
    refuse(item, "must be a key of the air, the ground or the aerosols");
  }
  if (equals != std::string::npos) {
    const std::string range = item.substr(equals + 1);
    const std::size_t dots = range.find("..");
    if (dots == std::string::npos) refuse(item, "must be KEY or KEY=LOW..HIGH");
    p.low = bound(item, std::string_view(range).substr(0, dots));
    p.high = bound(item, std::string_view(range).substr(dots + 2));
    if (!(p.low < p.high)) refuse(item, "must have LOW below HIGH");
    // At 0 the layer and its boundaries are gone: the sky jumps there, and a search cannot leave
    // it.
    const bool layer = table == "volcanic_sulfate" || table == "dust_layer";
    if (layer && p.name.ends_with("optical_depth_550nm") && !(p.low > 0)) {
      refuse(item, "must have LOW above 0, where there is a layer");
    }
  } else {
    const auto usual = std::ranges::find(kUsualRanges, p.name, &UsualRange::key);
    if (usual == std::end(kUsualRanges)) {
      refuse(item, fmt::format("has no usual range: must be given as {}=LOW..HIGH", p.name));
    }
    p.low = usual->low;
    p.high = usual->high;
  }
  p.logarithmic = p.low > 0 && p.high / p.low >= kLogarithmicSpan;
  return p;
}

std::optional<double> value_of(const Scene& scene, const std::string& name) {
  Scene copy = scene;
  const auto key = std::ranges::find(scene_keys(), name, &SceneKey::name);
  const SceneField field = key->field(copy);
  if (auto* const* real = std::get_if<double*>(&field)) return **real;
  if (auto* const* optional = std::get_if<std::optional<double>*>(&field)) return **optional;
  return std::nullopt;
}

// Both ends must be valid in the scene.
void check_ends(const Scene& scene, const FreeParameter& p, const std::string& item) {
  for (const double end : {p.low, p.high}) {
    Scene probe = scene;
    set_number(probe, p.name, end);
    const auto problem = validate(probe);
    if (!problem) continue;
    refuse(item, problem->key == p.name
                     ? problem->message
                     : fmt::format("at {}: key '{}' {}", end, problem->key, problem->message));
  }
}

Scene search_scene(const Scene& scene, const std::string& quality) {
  Scene search = scene;
  if (quality == "scene" || scene.solver.method != "orders") return search;
  apply_quality(
      quality_level(quality), [](std::string_view) { return true; }, search.solver);
  search.quality.reset();
  return search;
}

bool same_grids(const Scene& a, const Scene& b) {
  const SolverOptions &s = a.solver, &t = b.solver;
  return s.zenith_step_deg == t.zenith_step_deg && s.altitude_levels == t.altitude_levels &&
         s.polar_directions == t.polar_directions && s.azimuth_directions == t.azimuth_directions &&
         s.phase_degree == t.phase_degree && s.order_tolerance == t.order_tolerance &&
         s.coarse_orders == t.coarse_orders && s.sunlight_nodes == t.sunlight_nodes;
}

}  // namespace

RetrievalPlan plan_retrieval(const LoadedScene& loaded, const RetrieveOptions& options) {
  RetrievalPlan plan;
  plan.options = options;
  Scene scene = loaded.scene;
  if (!loaded.origin.contains("solver.method") && !scene.quality) scene.solver.method = "orders";
  if (scene.solver.method == "monte-carlo") {
    throw std::invalid_argument(loaded.complaint(
        "solver.method",
        "= \"monte-carlo\": must be one without noise, whose derivatives are known"));
  }
  if (scene.budget.max_relative_error || scene.budget.max_seconds) {
    throw std::invalid_argument(loaded.complaint(
        scene.budget.max_seconds ? "budget.max_seconds" : "budget.max_relative_error",
        "must not be given: the search has grids of its own (--search)"));
  }
  // Sum of the items that commas separate.
  std::vector<std::string> items;
  for (const std::string& list : options.free) {
    for (const std::string_view item : split_at_commas(list)) items.emplace_back(item);
  }
  for (const std::string& item : items) {
    FreeParameter p = parse_free(item);
    if (std::ranges::find(plan.keys, p.name) != plan.keys.end()) refuse(item, "is given twice");
    check_ends(scene, p, item);
    const auto own = value_of(scene, p.name);
    const double middle = p.logarithmic ? std::sqrt(p.low * p.high) : 0.5 * (p.low + p.high);
    p.start = own && *own >= p.low && *own <= p.high ? *own : middle;
    plan.keys.push_back(p.name);
    plan.parameters.push_back(std::move(p));
  }
  if (plan.keys.empty()) throw std::invalid_argument("--free: must name a key at least");
  plan.measured = read_measurement(options.measured, scene, options.relative_error);
  const std::size_t unknowns = plan.keys.size() + (plan.measured.free_exposure ? 1 : 0);
  if (plan.measured.values.size() < unknowns) {
    throw std::invalid_argument(
        fmt::format("{}: {} data cannot tell {} parameters: must be as many "
                    "at least",
                    options.measured.string(), plan.measured.values.size(), unknowns));
  }
  plan.scene = scene_for(std::move(scene), plan.measured);
  if (const auto problem = validate(plan.scene)) {
    throw std::invalid_argument(loaded.complaint(problem->key, problem->message));
  }
  plan.search_scene = search_scene(plan.scene, options.search_quality);
  plan.corrects = !same_grids(plan.scene, plan.search_scene);
  return plan;
}

Retrieval run_retrieval(const RetrievalPlan& plan, const RunControl& control) {
  const auto phases = std::make_shared<KnownPhases>();
  SkyForwardModel coarse(plan.search_scene, plan.keys, plan.measured, phases, control);
  SkyForwardModel fine(plan.scene, plan.keys, plan.measured, phases, control);
  RetrievalProblem problem;
  problem.parameters = plan.parameters;
  for (const MeasuredValue& value : plan.measured.values) {
    problem.measured.push_back(value.value);
    problem.standard_error.push_back(value.standard_error);
  }
  if (plan.measured.free_exposure) {
    // The best factor of the first sky, with a thousand to either side.
    std::vector<double> first;
    for (const FreeParameter& p : plan.parameters) first.push_back(p.start);
    first.push_back(1.0);
    const std::vector<double> sky = coarse(first);
    double both = 0, own = 0;
    for (std::size_t k = 0; k < sky.size(); ++k) {
      const double weight = 1 / (problem.standard_error[k] * problem.standard_error[k]);
      both += weight * sky[k] * problem.measured[k];
      own += weight * sky[k] * sky[k];
    }
    constexpr double kWidth = 1e3;
    const double factor = both > 0 && own > 0 ? both / own : 1.0;
    problem.parameters.push_back({kExposureName, factor / kWidth, factor * kWidth, factor, true});
  }
  problem.model = [&](std::span<const double> x) { return coarse(x); };
  problem.forecast = [&](std::span<const std::vector<double>> x) { coarse.solve_ahead(x); };
  if (plan.corrects) problem.accurate_model = [&](std::span<const double> x) { return fine(x); };
  return retrieve(problem, plan.options.search, control);
}

Scene retrieved_scene(const RetrievalPlan& plan, const Retrieval& retrieval) {
  Scene scene = plan.scene;
  for (std::size_t k = 0; k < plan.keys.size(); ++k) {
    set_number(scene, plan.keys[k], retrieval.parameters[k].value);
  }
  return scene;
}

}  // namespace twilight
