#include "output/study_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "output/checksum.h"
#include "output/command_line.h"
#include "output/scene_fingerprint.h"
#include "sim/cost_model.h"
#include "sim/scene_model.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

std::string case_text(const Scene& scene, const WantedQuantities& wanted, FileFingerprints& files) {
  return fmt::format("twilight {}, study format {}\n{}\n{}", kVersion, kStudyFormat,
                     settings_text(scene, files), canonical_text(wanted));
}

std::string atmosphere_text(const Scene& scene, FileFingerprints& files) {
  const PlacedSun sun = placed_sun(scene);
  Scene alike = scene;
  alike.observer = {};
  alike.observer.height_m = std::min(0.0, scene.observer.height_m);
  const std::optional<bool> disc = scene.sun.disc_average;
  alike.sun = {};
  alike.sun.elevation_deg = 0;
  alike.sun.disc_average = disc;
  alike.earth.radius_km = sun.earth_radius_km;
  alike.output = {};
  alike.camera = {};
  return fmt::format("Earth's radius {:a} km, Sun at {:a} au, ground {:a} km deep\n{}",
                     sun.earth_radius_km, sun.distance_au, ground_depth_km(scene),
                     settings_text(alike, files));
}

// What scattering matrices depend on, and some more: which particles there are.
std::string particles_text(const std::string& atmosphere) {
  constexpr std::string_view kTables[] = {"[aerosols]", "[volcanic_sulfate]", "[dust_layer]",
                                          "[spectrum]"};
  std::istringstream lines(atmosphere);
  std::string text;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('[')) inside = std::ranges::find(kTables, line) != std::end(kTables);
    if (inside && !line.starts_with("optical_depth_550nm")) text += line + '\n';
  }
  return text;
}

void require_study_of(const LoadedScene& loaded) {
  const BudgetOptions& budget = loaded.scene.budget;
  if (!budget.max_relative_error && !budget.max_seconds) return;
  const char* key = budget.max_seconds ? "budget.max_seconds" : "budget.max_relative_error";
  throw std::invalid_argument(
      loaded.complaint(key, "must not be given for twilight study; take a quality"));
}

bool same(const std::vector<StudyCoordinate>& a, const std::vector<StudyCoordinate>& b) {
  return std::ranges::equal(a, b, [](const StudyCoordinate& x, const StudyCoordinate& y) {
    return x.name == y.name && x.values == y.values && x.words == y.words;
  });
}

// Dimensions of the study and of its quantities stand in one file.
void require_distinct_names(const StudyPlan& plan) {
  for (const StudyDimension& dimension : plan.study.dimensions) {
    const StudyAxis& axis = plan.study.axes[dimension.axes.front()];
    const bool taken = std::ranges::any_of(
        plan.coordinates, [&](const StudyCoordinate& c) { return c.name == dimension.name; });
    const bool of_another =
        std::ranges::count(plan.study.dimensions, dimension.name, &StudyDimension::name) > 1;
    const bool of_axis = std::ranges::any_of(plan.study.axes, [&](const StudyAxis& other) {
      return axis_variable(other) == dimension.name && &other != &axis;
    });
    if (!taken && !of_another && !of_axis) continue;
    throw std::invalid_argument(
        fmt::format("{}: key 'axis.zip' = \"{}\": must not be the name of another dimension",
                    axis.origin, dimension.name));
  }
}

}  // namespace

std::size_t StudyPlan::saved_solves() const {
  std::size_t saved = 0;
  for (const CaseGroup& group : groups) saved += group.cases.size() - 1;
  return saved;
}

StudyPlan plan_study(const fs::path& file, std::span<const std::string> overrides) {
  StudyPlan plan;
  plan.study = load_study(file, overrides);
  plan.wanted = read_wanted_quantities(file);
  FileFingerprints files;
  std::map<std::string, std::size_t> known;  // fingerprint of an atmosphere -> group
  for (std::size_t node = 0; node < plan.study.nodes(); ++node) {
    const LoadedScene loaded = plan.study.scene_at(node);
    require_study_of(loaded);
    const Scene& scene = loaded.scene;
    const auto coordinates = quantity_coordinates(plan.wanted, scene);
    if (node == 0) plan.coordinates = coordinates;
    if (!same(coordinates, plan.coordinates)) {
      throw std::invalid_argument(fmt::format(
          "{}: case {} ({}): its wavelengths or other coordinates of [outputs] differ from those "
          "of case 1: must be the same for all",
          file.string(), node + 1, plan.study.place(node)));
    }
    plan.cases.push_back({fnv1a128(case_text(scene, plan.wanted, files)), plan.groups.size()});
    const bool shares = scene.solver.method == "orders";
    const std::string atmosphere = atmosphere_text(scene, files);
    if (shares) {
      const auto [group, fresh] = known.try_emplace(fnv1a128(atmosphere), plan.groups.size());
      plan.cases.back().group = group->second;
    }
    if (plan.cases.back().group == plan.groups.size()) {
      plan.groups.push_back({{}, shares, fnv1a128(particles_text(atmosphere))});
    }
    plan.groups[plan.cases.back().group].cases.push_back(node);
  }
  require_distinct_names(plan);
  // Groups of the same particles together, in the order in which particles first appear.
  std::map<std::string, std::size_t> first;
  for (const CaseGroup& group : plan.groups) first.try_emplace(group.particles, group.cases[0]);
  std::ranges::stable_sort(plan.groups, {},
                           [&](const CaseGroup& group) { return first.at(group.particles); });
  for (std::size_t g = 0; g < plan.groups.size(); ++g) {
    for (const std::size_t c : plan.groups[g].cases) plan.cases[c].group = g;
  }
  return plan;
}

std::string scene_inputs(const Scene& scene) {
  FileFingerprints files;
  return settings_text(scene, files);
}

std::string case_inputs(const Scene& scene, const WantedQuantities& wanted) {
  FileFingerprints files;
  return case_text(scene, wanted, files);
}

std::string atmosphere_inputs(const Scene& scene) {
  FileFingerprints files;
  return atmosphere_text(scene, files);
}

std::vector<std::size_t> shard_cases(const StudyPlan& plan, std::size_t index, std::size_t count) {
  // Pieces of work in order, cut where equal shares end; whole numbers, so that every machine
  // cuts alike.
  constexpr std::size_t kSolve = 20;
  const bool whole_groups = plan.groups.size() >= count;
  std::size_t total = 0;
  for (const CaseGroup& group : plan.groups) {
    total += group.cases.size() + (whole_groups ? kSolve : 0);
  }
  std::vector<std::size_t> chosen;
  std::size_t before = 0;
  const auto shard_of = [&](std::size_t work) {
    const std::size_t shard = (2 * before + work) * count / (2 * total);
    before += work;
    return shard + 1;
  };
  for (const CaseGroup& group : plan.groups) {
    if (whole_groups) {
      if (shard_of(group.cases.size() + kSolve) != index) continue;
      chosen.insert(chosen.end(), group.cases.begin(), group.cases.end());
      continue;
    }
    for (const std::size_t c : group.cases) {
      if (shard_of(1) == index) chosen.push_back(c);
    }
  }
  std::ranges::sort(chosen);
  return chosen;
}

namespace {

// Processor seconds of what is measured of a solved sky, on the machine of the cost model's
// constants.
double look_seconds(const WantedQuantities& wanted, const Scene& scene) {
  constexpr double kViewSeconds = 1.2e-3, kMapSeconds = 0.2;  // per 8 wavelengths
  constexpr double kIrradianceViews = 384, kDurationSuns = 10;
  const bool irradiance = wanted.wants(SkyQuantity::kIrradiance) ||
                          wanted.wants(SkyQuantity::kIlluminance) ||
                          wanted.wants(SkyQuantity::kChromaticity);
  double views = static_cast<double>(wanted.views.size());
  if (irradiance) views += kIrradianceViews;
  if (wanted.wants(SkyQuantity::kTwilightDuration)) views += kDurationSuns * kIrradianceViews;
  if (wanted.wants(SkyQuantity::kPolarisation)) {
    views += static_cast<double>(polarisation_views(0).size());
  }
  const bool map = wanted.wants(SkyQuantity::kTexture) || wanted.picture_size > 0;
  const double maps = (map ? 1 : 0) + (wanted.exr_size > 0 ? 1 : 0);
  const double wavelengths = static_cast<double>(solved_wavelengths_nm(scene.spectrum).size());
  return std::ceil(wavelengths / 8) * (views * kViewSeconds + maps * kMapSeconds);
}

}  // namespace

StudyCost predict_study(const StudyPlan& plan, std::span<const std::size_t> cases) {
  StudyCost cost;
  const double slowness = machine_slowness();
  std::set<std::size_t> solved;
  for (const std::size_t c : cases) {
    const std::size_t g = plan.cases[c].group;
    const bool shared = plan.groups[g].shares && !solved.insert(g).second;
    const Scene scene = plan.study.scene_at(c).scene;
    const RunCost run = predict_run(scene, 0);
    if (!run.known) {
      cost.known = false;
      continue;
    }
    const double look = plan.groups[g].shares ? look_seconds(plan.wanted, scene) : 0;
    const double seconds = look + (shared ? 0 : run.reference_seconds);
    cost.seconds += wall_seconds(seconds * slowness, scene);
    cost.peak_bytes = std::max(cost.peak_bytes, run.peak_bytes);
  }
  return cost;
}

}  // namespace twilight
