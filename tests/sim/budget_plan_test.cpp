// What a scene requires, and the settings chosen for a budget.
#include "sim/budget_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/cost_model.h"
#include "sim/quality.h"
#include "sim/scene_file.h"

namespace twilight {
namespace {

Scene scene_at(double sun_deg) {
  Scene scene;
  scene.sun.elevation_deg = sun_deg;
  scene.solver.method = "orders";
  scene.spectrum.wavelengths_nm = {440, 500, 560, 620, 680};
  return scene;
}

Scene at_draft(Scene scene) {
  apply_quality(
      quality_level("draft"), [](std::string_view) { return true; }, scene.solver);
  return scene;
}

constexpr Effect kEvery[] = {Effect::kRefraction,      Effect::kRefractiveSpreading,
                             Effect::kPolarisation,    Effect::kSunDisc,
                             Effect::kMixingLayer,     Effect::kFreeTroposphere,
                             Effect::kStratosphere,    Effect::kOzone,
                             Effect::kNitrogenDioxide, Effect::kGroundLight,
                             Effect::kAirAbove80,      Effect::kAirAbove60};

double error_of(const SceneRequirements& required, Effect effect) {
  for (const EffectError& e : required.effects) {
    if (e.effect == effect) return e.error;
  }
  ADD_FAILURE() << effect_name(effect) << " was not looked at";
  return -1;
}

TEST(SceneRequirements, WhatIsLeftOutCannotBeLeftOutAgain) {
  for (const Effect effect : kEvery) {
    Scene scene = scene_at(-4);
    ASSERT_TRUE(can_leave_out(scene, effect)) << effect_name(effect);
    leave_out(effect, scene);
    EXPECT_FALSE(can_leave_out(scene, effect)) << effect_name(effect);
    EXPECT_FALSE(validate(scene).has_value()) << effect_name(effect);
  }
}

TEST(SceneRequirements, WhatTheUserAsksForByNameIsKept) {
  Scene scene = scene_at(-4);
  scene.solver.polarisation = true;
  scene.sun.disc_average = true;
  EXPECT_FALSE(can_leave_out(scene, Effect::kPolarisation));
  EXPECT_FALSE(can_leave_out(scene, Effect::kSunDisc));
}

TEST(SceneRequirements, GroundWithoutAlbedoAndPolarisationAreKnown) {
  Scene scene = scene_at(30);
  scene.earth.ground_albedo = 0;
  scene.aerosols.type = "none";
  KnownPhases known;
  const SceneRequirements required = estimate_requirements(scene, {}, known, {});
  EXPECT_EQ(error_of(required, Effect::kGroundLight), 0);
  // Scalar air is wrong by several per cent (Chandrasekhar 1950; Kattawar & Adams 1990).
  EXPECT_GT(error_of(required, Effect::kPolarisation), 0.02);
  EXPECT_LT(error_of(required, Effect::kPolarisation), 0.15);
  EXPECT_LT(error_of(required, Effect::kAirAbove80), 1e-4);
}

// Ozone takes blue twilight's light on its long slant, a few per cent at noon.
TEST(SceneRequirements, OzoneMattersInTwilight) {
  KnownPhases known;
  Scene scene = scene_at(60);
  scene.aerosols.type = "none";
  const double day = error_of(estimate_requirements(scene, {}, known, {}), Effect::kOzone);
  scene.sun.elevation_deg = -6;
  const double twilight = error_of(estimate_requirements(scene, {}, known, {}), Effect::kOzone);
  EXPECT_LT(day, 0.3);
  EXPECT_GT(twilight, 1.0);
}

TEST(SceneRequirements, FewerWavelengthsAreWorse) {
  Scene scene = scene_at(-4);
  scene.spectrum.wavelengths_nm.clear();
  for (int nm = 400; nm <= 700; nm += 20) scene.spectrum.wavelengths_nm.push_back(nm);
  KnownPhases known;
  const SceneRequirements required = estimate_requirements(scene, {}, known, {});
  ASSERT_GT(required.spectra.size(), 5U);
  EXPECT_EQ(required.spectra.front().error, 0);
  for (std::size_t k = 1; k < required.spectra.size(); ++k) {
    EXPECT_EQ(required.spectra[k].solved_nm.size() + 1, required.spectra[k - 1].solved_nm.size());
    EXPECT_GE(required.spectra[k].error, required.spectra[k - 1].error);
    Scene fewer = scene;
    fewer.spectrum.solved_nm = required.spectra[k].solved_nm;
    EXPECT_FALSE(validate(fewer).has_value());
  }
}

TEST(SceneRequirements, AirThatIsTooDarkDoesNotMatter) {
  KnownPhases known;
  const WeightedViews views = coarse_hemisphere();
  for (const auto& [sun, height_m] :
       {std::pair{60.0, 0.0}, std::pair{43.0, 5500.0}, std::pair{15.0, 0.0},
        std::pair{5.0, 11000.0}, std::pair{-2.0, 0.0}, std::pair{-8.0, 3000.0}}) {
    Scene scene = scene_at(sun);
    scene.aerosols.type = "none";
    scene.observer.height_m = height_m;
    scene.spectrum.wavelengths_nm = {450, 650};
    const double darkest = estimate_requirements(scene, {}, known, {}).darkest_zenith_deg;
    Scene converged = at_draft(scene);  // to the last order: the darkest air decides how many
    converged.solver.order_tolerance = 1e-5;
    const SceneModel whole = build_scene_model(converged, &known);
    SceneModel part = whole;
    part.scene.solver.darkest_zenith_deg = darkest;
    EXPECT_LT(
        relative_difference(views, whole.solar_irradiance, solve_sky(whole)->radiance(views.views),
                            solve_sky(part)->radiance(views.views))
            .percentile_95,
        kDarkAirError)
        << sun << ", " << height_m << " m, " << darkest;
  }
}

TEST(BudgetPlan, DependsOnNeitherThreadsNorMachine) {
  Scene scene = scene_at(-4);
  scene.budget.max_relative_error = 0.05;
  std::string first;
  for (const int threads : {1, 2}) {
    scene.solver.threads = threads;
    KnownPhases known;
    BudgetPlan plan = plan_budget(scene, {}, known, {});
    plan.scene.solver.threads = 0;
    std::string text = to_toml(plan.scene);
    for (const auto& [label, value] : plan.attributes()) text += label + value;
    if (first.empty()) first = text;
    EXPECT_EQ(text, first);
  }
}

TEST(BudgetPlan, LooserBudgetsAreCheaperAndStayWithin) {
  Scene scene = scene_at(20);
  KnownPhases known;
  double last = 1e9;
  for (const double budget : {0.003, 0.01, 0.03, 0.1, 0.3}) {
    scene.budget.max_relative_error = budget;
    const BudgetPlan plan = plan_budget(scene, {}, known, {});
    EXPECT_LE(plan.estimated_error, budget);
    EXPECT_FALSE(plan.scene.budget.max_relative_error || plan.scene.quality);
    EXPECT_EQ(plan.scene.solver.method, "orders");
    const double seconds = predict_run(plan.scene, 48).reference_seconds;
    EXPECT_LE(seconds, last * 1.0001);
    last = seconds;
    double sum = plan.discretisation_error;
    for (const LeftOut& e : plan.left_out) sum += e.error;
    EXPECT_NEAR(sum, plan.estimated_error, 1e-12);
  }
}

TEST(BudgetPlan, TimeChoosesTheFinestThatFits) {
  Scene scene = scene_at(20);
  KnownPhases known;
  double error = 0;
  for (const double seconds : {1e6, 20.0, 2.0, 0.1}) {
    scene.budget.max_seconds = seconds;
    const BudgetPlan plan = plan_budget(scene, {}, known, {});
    EXPECT_GE(plan.estimated_error, error);
    error = plan.estimated_error;
    if (seconds == 1e6) {
      EXPECT_EQ(plan.quality, "reference");
    }
  }
}

// Draft misses this sky by up to 17 %, against finer levels.
TEST(BudgetPlan, LayersAloftAskForFinerSteps) {
  Scene scene = scene_at(-4.5);
  scene.aerosols.type = "continental_clean";
  scene.volcanic_sulfate.optical_depth_550nm = 0.1;
  scene.budget.max_relative_error = 0.05;
  KnownPhases known;
  const BudgetPlan plan = plan_budget(scene, {}, known, {});
  EXPECT_NE(plan.quality, "draft");
  EXPECT_LE(plan.estimated_error, 0.05);
}

TEST(BudgetPlan, PrintedSceneLoadsAsTheSame) {
  Scene scene = scene_at(30);
  scene.budget.max_relative_error = 0.1;
  KnownPhases known;
  const std::string text = to_toml(plan_budget(scene, {}, known, {}).scene);
  EXPECT_EQ(to_toml(parse_scene(text, "plan")), text);
}

TEST(CostModel, RefusesWhatTheMachineCannotHold) {
  Scene scene = scene_at(-4);
  scene.solver.altitude_levels = 400;
  scene.solver.phase_degree = 64;
  scene.solver.zenith_step_deg = 0.1;
  const RunCost cost = predict_run(scene, 1);
  EXPECT_GT(cost.peak_bytes, 50e9);
  EXPECT_NO_THROW(require_memory(scene, cost, 2 * cost.peak_bytes));
  EXPECT_NO_THROW(require_memory(scene, cost, std::nullopt));
  try {
    require_memory(scene, cost, 4e9);
    ADD_FAILURE() << "was not refused";
  } catch (const std::invalid_argument& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("3815 MiB"), std::string::npos) << message;
    EXPECT_NE(message.find("solver.altitude_levels = "), std::string::npos) << message;
  }
}

TEST(CostModel, MoreWorkCostsMore) {
  const Scene scene = at_draft(scene_at(-4));
  const double seconds = predict_run(scene, 1).reference_seconds;
  for (const auto& [name, change] :
       {std::pair<const char*, void (*)(Scene&)>{"levels",
                                                 [](Scene& s) { s.solver.altitude_levels *= 2; }},
        {"zenith step", [](Scene& s) { s.solver.zenith_step_deg /= 2; }},
        {"polar", [](Scene& s) { s.solver.polar_directions *= 2; }},
        {"azimuths", [](Scene& s) { s.solver.azimuth_directions *= 2; }},
        {"sunlight", [](Scene& s) { s.solver.sunlight_nodes *= 2; }},
        {"wavelengths", [](Scene& s) {
           s.spectrum.wavelengths_nm = {400, 420, 440, 460, 480, 500, 520, 540, 560, 580};
         }}}) {
    Scene more = scene;
    change(more);
    EXPECT_GT(predict_run(more, 1).reference_seconds, seconds) << name;
    EXPECT_GE(predict_run(more, 1).peak_bytes, predict_run(scene, 1).peak_bytes) << name;
  }
  for (const auto& [name, change] :
       {std::pair<const char*, void (*)(Scene&)>{"polarisation",
                                                 [](Scene& s) { s.solver.polarisation = false; }},
        {"aerosols", [](Scene& s) { s.aerosols.type = "none"; }},
        {"dark air", [](Scene& s) { s.solver.darkest_zenith_deg = 100; }}}) {
    Scene less = scene;
    change(less);
    EXPECT_LT(predict_run(less, 1).reference_seconds, seconds) << name;
  }
}

TEST(CostModel, MonteCarloIsUnknownBeforeItsPhotons) {
  Scene scene = scene_at(-4);
  scene.solver.method = "monte-carlo";
  EXPECT_FALSE(predict_run(scene, 1).known);
}

}  // namespace
}  // namespace twilight
