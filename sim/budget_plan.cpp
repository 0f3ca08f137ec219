#include "sim/budget_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "sim/cost_model.h"
#include "sim/elapsed_time.h"
#include "sim/quality.h"

namespace twilight {
namespace {

// Effects this far below the budget cannot matter.
constexpr double kNegligibleShare = 0.02;
// Of what the budget leaves for leaving out, the share that wavelengths may have.
constexpr double kSpectralShare = 0.4;
// A saving below this share of the run is none.
constexpr double kNoSaving = 0.005;
// The series of orders may use this share of the budget.
constexpr double kOrdersShare = 0.05;

struct Candidate {
  Scene scene;
  std::vector<LeftOut> left_out;
  std::vector<LeftOut> kept;
  double error = 0;  // of what is left out
  double cost = 0;   // processor seconds of the machine the model was measured on
};

// Errors of the levels are those of two of the aerosols; against full models of 16 random scenes
// they came out up to 2.2 times as large.
constexpr double kOtherAerosols = 2;
// A layer aloft with sharp edges asks more of the steps. Measured against finer levels: 17 % where
// 4.6 % was expected (0.1 of droplets at 18..23 km, Sun -4.5, draft) and 5.6 % where 1.2 % was (0.5
// of dust at 2..5 km, Sun 5, fair; below the Sun).
constexpr double kAddedLayers = 4 * kOtherAerosols;

// Of a field, the largest of every Sun.
double level_error(const Scene& scene, const QualityLevel& level, const WantedSky& wanted,
                   const SceneRequirements& required) {
  // Sea salt and dust scatter forward more than the aerosols that the levels were measured in: as
  // the most turbid of those.
  const bool large = scene.aerosols.mixture || scene.dust_layer.optical_depth_550nm > 0 ||
                     scene.aerosols.type.starts_with("maritime") ||
                     scene.aerosols.type.starts_with("desert");
  const double depth = large && required.aerosol_optical_depth > 0
                           ? std::max(required.aerosol_optical_depth, kTurbidOpticalDepth)
                           : required.aerosol_optical_depth;
  double error = 0;
  for (const double sun : kQualitySun_deg) {
    error = std::max(error, discretisation_error(
                                level, wanted.every_sun ? sun : required.sun_elevation_deg, depth));
  }
  if (replaces_profile(scene) || depth <= 0) return depth > 0 ? kOtherAerosols * error : error;
  const bool added =
      scene.dust_layer.optical_depth_550nm > 0 || scene.volcanic_sulfate.optical_depth_550nm > 0;
  return (added ? kAddedLayers : kOtherAerosols) * error;
}

class Planner {
 public:
  Planner(const Scene& scene, const WantedSky& wanted, const SceneRequirements& required)
      : scene_(scene), wanted_(wanted), required_(required), views_(wanted.views.views.size()) {
    scene_.budget = {};
    scene_.quality.reset();
  }

  Scene at_level(const QualityLevel& level) const {
    Scene scene = scene_;
    apply_quality(
        level, [](std::string_view) { return true; }, scene.solver);
    return scene;
  }

  double cost(const Scene& scene) const { return predict_run(scene, views_).reference_seconds; }

  // Leaves out what fits into `allowance`, the sum of the estimated errors.
  Candidate fit(const QualityLevel& level, double budget, double allowance) const {
    Candidate c;
    c.scene = at_level(level);
    leave_orders(c, kOrdersShare * budget, allowance);
    leave_dark_air(c, allowance);
    leave_wavelengths(c, kSpectralShare * allowance);
    leave_negligible(c, budget, allowance);
    leave_costly(c, allowance);
    c.cost = cost(c.scene);
    for (const EffectError& e : required_.effects) {
      if (can_leave_out(c.scene, e.effect)) {
        c.kept.push_back({std::string(effect_name(e.effect)), e.error});
      }
    }
    return c;
  }

 private:
  // A lower top moves the levels, which at coarse steps changes the sky by more than the air above.
  static bool may_leave_out(const Scene& scene, Effect effect) {
    const bool above = effect == Effect::kAirAbove80 || effect == Effect::kAirAbove60;
    return can_leave_out(scene, effect) &&
           !(above && scene.solver.zenith_step_deg > quality_level("standard").zenith_step_deg);
  }

  static void take(Candidate& c, Scene without, std::string what, double error) {
    c.scene = std::move(without);
    c.left_out.push_back({std::move(what), error});
    c.error += error;
  }

  // Of the steps' own error the level's tolerance is a part.
  static void leave_orders(Candidate& c, double tolerance, double allowance) {
    constexpr double kCoarsest = 0.02;
    tolerance = std::min(tolerance, kCoarsest);
    if (c.scene.solver.scattering_orders || tolerance <= c.scene.solver.order_tolerance ||
        tolerance > allowance) {
      return;
    }
    Scene without = c.scene;
    without.solver.order_tolerance = tolerance;
    take(c, without, "orders of scattering once all that follow add less", tolerance);
  }

  void leave_dark_air(Candidate& c, double allowance) const {
    if (wanted_.every_sun || kDarkAirError > 0.25 * allowance) return;
    if (required_.darkest_zenith_deg >= c.scene.solver.darkest_zenith_deg) return;
    Scene without = c.scene;
    without.solver.darkest_zenith_deg = required_.darkest_zenith_deg;
    take(c, without,
         fmt::format("air under a Sun further than {} deg from the zenith",
                     required_.darkest_zenith_deg),
         kDarkAirError);
  }

  void leave_wavelengths(Candidate& c, double allowance) const {
    const SpectrumChoice* best = nullptr;
    double least = cost(c.scene) * (1 - kNoSaving);
    for (const SpectrumChoice& choice : required_.spectra) {
      if (choice.error > allowance ||
          choice.solved_nm.size() == c.scene.spectrum.wavelengths_nm.size()) {
        continue;
      }
      Scene fewer = c.scene;
      fewer.spectrum.solved_nm = choice.solved_nm;
      const double seconds = cost(fewer);
      if (seconds >= least) continue;
      least = seconds;
      best = &choice;
    }
    if (best == nullptr) return;
    Scene fewer = c.scene;
    fewer.spectrum.solved_nm = best->solved_nm;
    take(c, fewer,
         fmt::format("{} of {} wavelengths",
                     c.scene.spectrum.wavelengths_nm.size() - best->solved_nm.size(),
                     c.scene.spectrum.wavelengths_nm.size()),
         best->error);
  }

  void leave_negligible(Candidate& c, double budget, double allowance) const {
    for (const EffectError& e : required_.effects) {
      if (!may_leave_out(c.scene, e.effect)) continue;
      if (kBudgetSafety * e.error > kNegligibleShare * budget || c.error + e.error > allowance) {
        continue;
      }
      Scene without = c.scene;
      leave_out(e.effect, without);
      take(c, without, std::string(effect_name(e.effect)), e.error);
    }
  }

  // The largest saving over error first.
  void leave_costly(Candidate& c, double allowance) const {
    for (;;) {
      const double now = cost(c.scene);
      const EffectError* best = nullptr;
      double most = 0;
      for (const EffectError& e : required_.effects) {
        if (!may_leave_out(c.scene, e.effect) || c.error + e.error > allowance) continue;
        Scene without = c.scene;
        leave_out(e.effect, without);
        const double saving = now - cost(without);
        const double worth = saving / std::max(e.error, 1e-9);
        if (saving < kNoSaving * now || worth <= most) continue;
        most = worth;
        best = &e;
      }
      if (best == nullptr) return;
      Scene without = c.scene;
      leave_out(best->effect, without);
      take(c, without, std::string(effect_name(best->effect)), best->error);
    }
  }

  Scene scene_;
  const WantedSky& wanted_;
  const SceneRequirements& required_;
  std::size_t views_;
};

}  // namespace

BudgetPlan plan_budget(const Scene& scene, const WantedSky& wanted, KnownPhases& known,
                       const RunControl& control) {
  const double start = processor_seconds();
  const SceneRequirements required = estimate_requirements(scene, wanted, known, control);
  const Planner planner(scene, wanted, required);
  const std::optional<double> most_error = scene.budget.max_relative_error;
  const std::optional<double> most_seconds = scene.budget.max_seconds;
  const double speed = machine_slowness();
  const double elapsed = processor_seconds() - start;
  const auto seconds_of = [&](const Candidate& c) { return wall_seconds(c.cost * speed, scene); };

  BudgetPlan plan;
  std::optional<Candidate> chosen;
  if (most_error) {
    for (const QualityLevel& level : quality_levels()) {
      const double steps = level_error(scene, level, wanted, required);
      const double allowance = (*most_error - steps) / kBudgetSafety;
      if (!(allowance > 0)) continue;
      Candidate c = planner.fit(level, *most_error, allowance);
      if (chosen && c.cost >= chosen->cost) continue;
      chosen = std::move(c);
      plan.quality = level.name;
      plan.discretisation_error = steps;
    }
    if (!chosen) {
      const QualityLevel& finest = quality_levels().back();
      throw std::invalid_argument(fmt::format(
          "key 'budget.max_relative_error' = {}: must be above {:.2g}, the error of the finest "
          "steps, quality \"{}\", in this air with the Sun at {:.1f} deg",
          *most_error, level_error(scene, finest, wanted, required), finest.name,
          required.sun_elevation_deg));
    }
  } else {
    // From the finest level to the coarsest, then leaving out more and more.
    const auto levels = quality_levels();
    for (std::size_t k = levels.size(); k-- > 0 && !chosen;) {
      Candidate c = planner.fit(levels[k], 1e-3, 0.0);
      if (wall_seconds(elapsed, scene) + seconds_of(c) > *most_seconds) continue;
      chosen = std::move(c);
      plan.quality = levels[k].name;
      plan.discretisation_error = level_error(scene, levels[k], wanted, required);
    }
    for (double allowance = 1e-3; !chosen; allowance *= 1.5) {
      constexpr double kHalfTheLight = 0.5;
      Candidate c = planner.fit(levels.front(), allowance, allowance);
      plan.within_budget = wall_seconds(elapsed, scene) + seconds_of(c) <= *most_seconds;
      if (!plan.within_budget && allowance < kHalfTheLight) continue;
      chosen = std::move(c);
      plan.quality = levels.front().name;
      plan.discretisation_error = level_error(scene, levels.front(), wanted, required);
    }
  }
  plan.scene = std::move(chosen->scene);
  plan.left_out = std::move(chosen->left_out);
  plan.kept = std::move(chosen->kept);
  plan.estimated_error = chosen->error + plan.discretisation_error;
  plan.predicted_seconds = seconds_of(*chosen);
  if (most_seconds && most_error) plan.within_budget = plan.predicted_seconds <= *most_seconds;
  Candidate full;
  full.cost = planner.cost(planner.at_level(quality_level("standard")));
  plan.full_seconds = seconds_of(full);
  plan.pilot_seconds = processor_seconds() - start;
  return plan;
}

std::vector<std::pair<std::string, std::string>> BudgetPlan::attributes() const {
  std::vector<std::pair<std::string, std::string>> rows;
  const auto list = [](const std::vector<LeftOut>& effects) {
    std::string text;
    for (const LeftOut& e : effects) {
      text += fmt::format("{}{} ({:.2g} %)", text.empty() ? "" : ", ", e.what, 100 * e.error);
    }
    return text.empty() ? std::string("nothing") : text;
  };
  rows.emplace_back("quality", quality);
  rows.emplace_back("left out", list(left_out));
  rows.emplace_back("kept", list(kept));
  rows.emplace_back("error of the steps", fmt::format("{:.2g} %", 100 * discretisation_error));
  rows.emplace_back("estimated error", fmt::format("{:.2g} %", 100 * estimated_error));
  return rows;
}

std::vector<std::pair<std::string, std::string>> BudgetPlan::figures() const {
  std::vector<std::pair<std::string, std::string>> rows;
  for (const auto& [label, value] : attributes()) rows.emplace_back("budget: " + label, value);
  rows.emplace_back("budget: predicted",
                    fmt::format("{:.2g} s; {:.2g} s with everything at quality \"standard\"; "
                                "choosing took {:.2g} s of processor time{}",
                                predicted_seconds, full_seconds, pilot_seconds,
                                within_budget ? "" : "; longer than the budget"));
  return rows;
}

}  // namespace twilight
