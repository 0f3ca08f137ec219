// Prints the table of the validation as Markdown, the whole of it or parts.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/validation/validation.h"

namespace {

namespace v = twilight::validation;

bool wanted(const std::string& name, const std::vector<std::string>& only) {
  if (only.empty()) return true;
  for (const std::string& o : only) {
    if (name == o || name.starts_with(o + "-")) return true;
  }
  return false;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Whole skies against published and independently computed figures");
  std::vector<std::string> only;
  v::Settings settings;
  settings.progress = true;
  std::string directory;
  bool list = false, silent = false;
  app.add_option("--only", only, "sections, or the first words of their names");
  app.add_option("--csv", directory,
                 "folder for every single comparison (CSV), each section's rows (Markdown) and "
                 "plots (SVG); Monte Carlo results found there are taken over");
  app.add_flag("--quick", settings.quick, "a subset of the points");
  app.add_flag("--list", list, "names of the sections");
  app.add_flag("--silent", silent, "no progress on standard error");
  app.add_option("--set", settings.overrides,
                 "KEY=VALUE of a scene file in place of the checks' own, e.g. "
                 "solver.phase_degree=16");
  app.add_option("--mc-seconds", settings.monte_carlo_seconds,
                 "Monte Carlo time per view, at most about");
  app.add_option("--mc-error", settings.monte_carlo_relative,
                 "relative standard error at which the Monte Carlo stops");
  CLI11_PARSE(app, argc, argv);
  settings.progress = !silent;
  settings.directory = directory;

  bool all_hold = true, any = false;
  try {
    if (!directory.empty()) std::filesystem::create_directories(directory);
    if (!list) fmt::print("{}", v::markdown_header());
    for (const v::Section& section : v::sections()) {
      if (!wanted(section.name, only)) continue;
      any = true;
      if (list) {
        fmt::print("{:32} {}\n", section.name, section.about);
        continue;
      }
      v::say(settings, fmt::format("== {}: {}", section.name, section.about));
      std::string rows;
      for (const v::Check& check : section.run(settings)) {
        all_hold = all_hold && check.holds;
        rows += v::markdown_row(check);
      }
      fmt::print("{}", rows);
      std::fflush(stdout);
      if (!directory.empty()) {
        std::ofstream(settings.directory / (section.name + ".md")) << v::markdown_header() << rows;
      }
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "validation_table: {}\n", error.what());
    return 2;
  }
  if (!any) {
    fmt::print(stderr, "validation_table: no such section; see --list\n");
    return 2;
  }
  return all_hold ? 0 : 1;
}
