#include "tests/validation/validation.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <variant>

#include "sim/scene_file.h"
#include "tests/validation/checks.h"

namespace twilight::validation {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string without_pipes(std::string text) {
  std::ranges::replace(text, '|', '/');
  return text;
}

}  // namespace

std::vector<Section> sections() {
  std::vector<Section> all;
  for (auto* part :
       {&open_cases_sections, &libradtran_sections, &plane_parallel_sections,
        &orders_against_monte_carlo_sections, &refracted_sun_sections, &illuminance_sections,
        &koomen_sections, &paranal_sections, &grid_convergence_sections}) {
    for (Section& s : (*part)()) all.push_back(std::move(s));
  }
  return all;
}

Scene with_overrides(Scene scene, const Settings& settings) {
  for (const std::string& assignment : settings.overrides) {
    Scene given = parse_scene(assignment, "--set " + assignment);
    std::string name = assignment.substr(0, assignment.find('='));
    std::erase(name, ' ');
    for (const SceneKey& key : scene_keys()) {
      if (key.name != name) continue;
      std::visit(
          [&](auto* to) {
            using Pointer = decltype(to);
            *to = *std::get<Pointer>(key.field(given));
          },
          key.field(scene));
    }
  }
  return scene;
}

std::string markdown_header() {
  return "| case | bar | measured | holds | s |\n|---|---|---|---|---|\n";
}

std::string markdown_row(const Check& check) {
  return fmt::format("| {} | {} | {} | {} | {:.1f} |\n", without_pipes(check.name),
                     without_pipes(check.bar), without_pipes(check.measured),
                     check.holds ? "yes" : "**no**", check.seconds);
}

void say(const Settings& settings, std::string_view text) {
  if (!settings.progress) return;
  fmt::print(stderr, "{}\n", text);
  std::fflush(stderr);
}

Stopwatch::Stopwatch() : start_(now()) {}
double Stopwatch::seconds() const { return now() - start_; }

Spread spread_of(std::span<const double> differences) {
  std::vector<double> sizes;
  for (const double d : differences) sizes.push_back(std::abs(d));
  std::ranges::sort(sizes);
  Spread spread;
  spread.count = sizes.size();
  if (sizes.empty()) return spread;
  spread.median = sizes[sizes.size() / 2];
  spread.percentile_95 = sizes[std::min(sizes.size() - 1, sizes.size() * 95 / 100)];
  spread.worst = sizes.back();
  return spread;
}

std::string text_of(const Spread& spread) {
  return fmt::format("{} values: median {:.2f} %, 95 % within {:.2f} %, worst {:.2f} %",
                     spread.count, 100 * spread.median, 100 * spread.percentile_95,
                     100 * spread.worst);
}

}  // namespace twilight::validation
