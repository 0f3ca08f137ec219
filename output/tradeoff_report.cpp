#include "output/tradeoff_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "output/atomic_file.h"
#include "output/command_line.h"
#include "output/csv_table.h"
#include "output/pareto_front.h"
#include "output/svg_plot.h"
#include "output/tradeoff_rows.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// ---------------------------------------------------------------- CSV and JSON

std::string one_line(const std::vector<std::string>& overrides) {
  return fmt::format("{}", fmt::join(overrides, " "));
}

void write_csv(const fs::path& path, const std::vector<TradeoffRow>& rows,
               const TradeoffOutcome& outcome) {
  std::vector<std::string> columns = {"rung",
                                      "group",
                                      "kind",
                                      "method",
                                      "settings",
                                      "baseline",
                                      "sun_elevation_deg",
                                      "seconds",
                                      "most_seconds",
                                      "cpu_seconds",
                                      "peak_mib",
                                      "seconds_all_suns"};
  for (const ErrorMeasure& m : kErrorMeasures) {
    for (const char* figure : {"mean", "p95", "max"}) {
      columns.push_back(fmt::format("{}_{}", m.name, figure));
    }
  }
  for (const char* more : {"radiance_bias", "luminance_bias", "reference_standard_error",
                           "front_radiance", "front_luminance", "front_ciede2000"}) {
    columns.emplace_back(more);
  }
  CsvTable table(columns);
  for (const TradeoffRow& row : rows) {
    const Rung& rung = row.rung->planned.rung;
    const SunSample* reference = sun_of(outcome.reference, row.sun_elevation_deg);
    std::vector<CsvTable::Cell> cells = {rung.name,
                                         rung.group,
                                         std::string(rung_kind_name(rung.kind)),
                                         rung.method,
                                         one_line(rung.overrides),
                                         row.baseline,
                                         row.sun_elevation_deg,
                                         row.cost.seconds,
                                         row.cost.most_seconds,
                                         row.cost.cpu_seconds,
                                         row.cost.peak_mib,
                                         row.rung->run->seconds};
    for (const ErrorMeasure& m : kErrorMeasures) {
      const std::optional<Spread>& spread = row.difference.*m.of_row;
      for (double Spread::*const figure : {&Spread::mean, &Spread::p95, &Spread::largest}) {
        cells.push_back(spread ? CsvTable::Cell(*spread.*figure) : CsvTable::Cell(""));
      }
    }
    cells.push_back(row.difference.radiance ? CsvTable::Cell(row.difference.radiance_bias)
                                            : CsvTable::Cell(""));
    cells.push_back(row.difference.luminance ? CsvTable::Cell(row.difference.luminance_bias)
                                             : CsvTable::Cell(""));
    cells.emplace_back(mean_relative_noise(*reference));
    for (const ErrorMeasure& m : kErrorMeasures) cells.emplace_back(row.*m.row_front ? 1.0 : 0.0);
    table.add_row(cells);
  }
  table.write(path, std::cout);
}

json json_of(const Spread& spread) {
  return {{"mean", spread.mean}, {"p95", spread.p95}, {"max", spread.largest}};
}

json json_of(const Machine& machine) {
  return {{"processor", machine.processor}, {"cores", machine.cores}, {"simd", machine.simd}};
}

json row_json(const TradeoffRow& row) {
  json j = {{"baseline", row.baseline},
            {"sun_elevation_deg", row.sun_elevation_deg},
            {"seconds", row.cost.seconds},
            {"most_seconds", row.cost.most_seconds},
            {"cpu_seconds", row.cost.cpu_seconds},
            {"peak_mib", row.cost.peak_mib},
            {"radiance_bias", row.difference.radiance_bias},
            {"luminance_bias", row.difference.luminance_bias}};
  for (const ErrorMeasure& m : kErrorMeasures) {
    if (const auto& spread = row.difference.*m.of_row) j[m.name] = json_of(*spread);
    j[std::string("front_") + m.name] = row.*m.row_front;
  }
  return j;
}

json mean_json(const TradeoffMean& mean) {
  json j = {{"seconds", mean.cost.seconds},
            {"cpu_seconds", mean.cost.cpu_seconds},
            {"peak_mib", mean.cost.peak_mib}};
  for (const ErrorMeasure& m : kErrorMeasures) {
    if (const auto& spread = mean.*m.of_mean) j[m.name] = json_of(*spread);
    j[std::string("front_") + m.name] = mean.*m.mean_front;
  }
  return j;
}

json reference_json(const TradeoffPlan& plan, const TradeoffOutcome& outcome) {
  const RungRun& r = outcome.reference;
  json noise = json::array();
  for (const double sun : plan.suns_deg) noise.push_back(mean_relative_noise(*sun_of(r, sun)));
  return {{"source", plan.options.reference},
          {"settings", plan.reference.rung.overrides},
          {"scene", r.scene_toml},
          {"wavelengths_nm", r.sample.wavelength_nm},
          {"seconds_all_suns", r.seconds},
          {"cpu_seconds_all_suns", r.cpu_seconds},
          {"peak_mib", r.sample.peak_mib},
          {"date", r.date},
          {"machine", json_of(r.machine)},
          {"mean_relative_standard_error", std::move(noise)}};
}

void write_json(const fs::path& path, const TradeoffPlan& plan, const TradeoffOutcome& outcome,
                const std::vector<TradeoffRow>& rows, const std::vector<TradeoffMean>& means) {
  json rungs = json::array();
  for (const RungOutcome& rung : outcome.rungs) {
    const Rung& r = rung.planned.rung;
    json j = {{"name", r.name},
              {"group", r.group},
              {"label", r.label},
              {"kind", rung_kind_name(r.kind)},
              {"method", r.method},
              {"settings", r.overrides},
              {"state", rung_state_name(rung.state)}};
    if (!rung.reason.empty()) j["reason"] = rung.reason;
    if (rung.run) {
      j["inputs"] = rung.run->inputs;
      j["date"] = rung.run->date;
      j["machine"] = json_of(rung.run->machine);
      j["seconds_all_suns"] = rung.run->seconds;
      j["cpu_seconds_all_suns"] = rung.run->cpu_seconds;
      j["wavelengths_nm"] = rung.run->sample.wavelength_nm;
      json suns = json::array();
      for (const TradeoffRow& row : rows) {
        if (row.rung == &rung) suns.push_back(row_json(row));
      }
      j["rows"] = std::move(suns);
      for (const TradeoffMean& mean : means) {
        if (mean.rung == &rung) j["mean_over_suns"] = mean_json(mean);
      }
    }
    rungs.push_back(std::move(j));
  }
  const json manifest = {
      {"program", fmt::format("twilight {}", kVersion)},
      {"date", outcome.reference.date},
      {"machine", json_of(this_machine())},
      {"scene_file", plan.options.scene.string()},
      {"overrides", plan.options.overrides},
      {"quick", plan.options.quick},
      {"repeat", plan.options.repeat},
      {"scene", plan.scene_toml},
      {"suns_deg", plan.suns_deg},
      {"views",
       "12 Gauss-Legendre points in sin(elevation) over 0.01..1 times 8 midpoints in "
       "azimuth over half a turn, weighted by solid angle"},
      {"colour",
       "CIEDE2000 of CIE 1931 XYZ, white D65 at the luminance of the reference's brightest view"},
      {"reference", reference_json(plan, outcome)},
      {"rungs", std::move(rungs)}};
  write_text_file(path, manifest.dump(1) + "\n");
}

// ---------------------------------------------------------------- Markdown

std::string signed_percent(double share) {
  const double p = 100 * share;
  return std::abs(p) >= 9.95 ? fmt::format("{:+.0f}", p) : fmt::format("{:+.2g}", p);
}

std::string spread_text(const std::optional<Spread>& s, double factor) {
  if (!s) return "-";
  const double unit = factor / 100;  // percent() multiplies by 100
  return fmt::format("{} / {} / {}", percent(unit * s->mean), percent(unit * s->p95),
                     percent(unit * s->largest));
}

std::string seconds_text(double seconds) {
  return seconds >= 9.95 ? fmt::format("{:.0f}", seconds) : fmt::format("{:.2g}", seconds);
}

// What the rung sets beside what any scene of its method needs; an approximation in words.
std::string settings_text(const Rung& rung) {
  if (rung.kind == RungKind::kApproximation) return rung.label;
  std::string text;
  for (const std::string& override : rung.overrides) {
    if (override.starts_with("solver.method=") || override.ends_with("=auto")) continue;
    text += fmt::format("{}`{}`", text.empty() ? "" : " ", override);
  }
  return text.empty() ? rung.label : text;
}

std::string measured_on(const TradeoffPlan& plan, const TradeoffOutcome& outcome) {
  const RungRun& r = outcome.reference;
  double noise = 0;
  for (const double sun : plan.suns_deg) {
    noise = std::max(noise, mean_relative_noise(*sun_of(r, sun)));
  }
  std::string text = fmt::format(
      "`{}`, twilight {}, {}, {} threads, {}, {}. Reference: {}", plan.options.scene.string(),
      kVersion, r.machine.processor, r.machine.cores, r.machine.simd, r.date,
      plan.reference_file ? plan.options.reference : plan.reference.rung.label);
  if (!plan.reference_file) text += fmt::format(" ({})", settings_text(plan.reference.rung));
  if (noise > 0) text += fmt::format(", mean standard error at most {} %", percent(noise));
  return text + ".\n\n";
}

std::string sun_columns(const TradeoffPlan& plan, std::string* rule) {
  std::string header;
  for (const double sun : plan.suns_deg) {
    header += fmt::format(" {:g}° |", sun);
    *rule += "---|";
  }
  return header;
}

void write_front(const fs::path& path, const TradeoffPlan& plan, const TradeoffOutcome& outcome,
                 const std::vector<TradeoffRow>& rows, std::vector<TradeoffMean> means) {
  std::ranges::stable_sort(means, {}, [](const TradeoffMean& m) { return m.cost.seconds; });
  std::string text = "# The front of seconds and error\n\n" + measured_on(plan, outcome);
  const std::string repeats =
      plan.options.repeat > 1 ? fmt::format(" (the least of {} runs)", plan.options.repeat) : "";
  text += fmt::format(
      "Seconds and peak memory of one sky, process start to end{}, mean over the Suns; error "
      "against the reference over the hemisphere, mean over the Suns of mean / 95th percentile / "
      "maximum.\n",
      repeats);
  for (const ErrorMeasure& m : {kRadianceError, kColourError}) {
    std::string rule = "|---|---|---|---|---|---|---|";
    const std::string suns = sun_columns(plan, &rule);
    text += fmt::format(
        "\n## By {}\n\nIn the last columns the mean by Sun elevation{}.\n\n"
        "| rung | settings | seconds | MiB | radiance, % | luminance, % | CIEDE2000 |{}\n{}\n",
        m.title, m.factor == 1 ? "" : ", per cent", suns, rule);
    for (const TradeoffMean& mean : means) {
      if (!(mean.*m.mean_front)) continue;
      const Rung& rung = mean.rung->planned.rung;
      text += fmt::format("| {} | {} | {} | {:.0f} | {} | {} | {} |", rung.name,
                          settings_text(rung), seconds_text(mean.cost.seconds), mean.cost.peak_mib,
                          spread_text(mean.radiance, 100), spread_text(mean.luminance, 100),
                          spread_text(mean.ciede2000, 1));
      for (const TradeoffRow& row : rows) {
        if (row.rung != mean.rung || row.baseline != kReferenceBaseline) continue;
        const std::optional<Spread>& s = row.difference.*m.of_row;
        text += fmt::format(" {} |", s ? percent(m.factor / 100 * s->mean) : "-");
      }
      text += "\n";
    }
  }
  write_text_file(path, text);
}

void write_approximations(const fs::path& path, const TradeoffPlan& plan,
                          const TradeoffOutcome& outcome, const std::vector<TradeoffRow>& rows) {
  std::string text = "# What the paper's choice costs you\n\n" + measured_on(plan, outcome);
  text +=
      "Error over the hemisphere by Sun elevation: mean |L/L_ref - 1| of the spectral radiance in "
      "per cent, in brackets its signed mean, and the mean CIEDE2000. \"against\": the reference, "
      "or "
      "the same method without the approximation.\n\n";
  std::string rule = "|---|---|---|";
  const std::string suns = sun_columns(plan, &rule);
  text += fmt::format("| choice | method | against |{}\n{}\n", suns, rule);
  const auto line = [&](const RungOutcome& rung, const std::string& label,
                        const std::string& baseline) {
    std::string cells;
    for (const TradeoffRow& row : rows) {
      if (row.rung != &rung || row.baseline != baseline) continue;
      const SkyDifference& d = row.difference;
      const std::string radiance = d.radiance ? fmt::format("{} ({})", percent(d.radiance->mean),
                                                            signed_percent(d.radiance_bias))
                                              : "-";
      cells +=
          fmt::format(" {}, {} |", radiance, d.ciede2000 ? percent(d.ciede2000->mean / 100) : "-");
    }
    if (cells.empty()) return;
    text += fmt::format("| {} | {} | {} |{}\n", label, rung.planned.rung.method, baseline, cells);
  };
  for (const RungOutcome& rung : outcome.rungs) {
    if (rung.planned.rung.name == rung.planned.rung.method) {
      line(rung, "(none)", kReferenceBaseline);
    }
  }
  for (const RungOutcome& rung : outcome.rungs) {
    const Rung& r = rung.planned.rung;
    if (r.kind != RungKind::kApproximation) continue;
    line(rung, r.label, kReferenceBaseline);
    line(rung, r.label, r.baseline);
  }
  write_text_file(path, text);
}

// ---------------------------------------------------------------- plots

struct PlotPoint {
  const RungOutcome* rung;
  double cost, error;
  bool front;
};

/// Points of one panel by method and kind, and the front through them.
PlotPanel tradeoff_panel(const std::string& title, const PlotAxis& cost, const PlotAxis& error,
                         const std::vector<PlotPoint>& points) {
  struct Family {
    const char* method;
    bool approximation;
    const char* label;
    const char* colour;
  };
  constexpr Family kFamilies[] = {{"orders", false, "orders: settings", "#1b6ca8"},
                                  {"orders", true, "orders: approximations", "#5fa3d0"},
                                  {"cells", false, "cells: settings", "#c8553d"},
                                  {"cells", true, "cells: approximations", "#d98f78"},
                                  {"monte-carlo", false, "Monte Carlo", "#588b3b"}};
  PlotPanel panel{title, cost, error, {}};
  PlotSeries front{.label = "Pareto front", .dashed = true, .colour = "#222222"};
  PlotSeries rings{.label = "", .dots = true, .colour = "#222222", .hollow = true};
  std::vector<PlotPoint> sorted = points;
  std::ranges::stable_sort(sorted, {}, &PlotPoint::cost);
  for (const Family& family : kFamilies) {
    PlotSeries series{
        .label = family.label, .dots = true, .colour = family.colour, .optional_marks = true};
    for (const PlotPoint& p : sorted) {
      const Rung& rung = p.rung->planned.rung;
      if (rung.method != family.method ||
          (rung.kind == RungKind::kApproximation) != family.approximation) {
        continue;
      }
      if (!p.front) series.marks.emplace_back(static_cast<int>(series.points.size()), rung.name);
      series.points.emplace_back(p.cost, p.error);
      series.tooltips.push_back(
          fmt::format("{}: {:.3g}, error {:.3g}", rung.name, p.cost, p.error));
    }
    if (!series.points.empty()) panel.series.push_back(std::move(series));
  }
  for (const PlotPoint& p : sorted) {
    if (!p.front) continue;
    rings.marks.emplace_back(static_cast<int>(rings.points.size()), p.rung->planned.rung.name);
    rings.points.emplace_back(p.cost, p.error);
  }
  front.points = rings.points;
  panel.series.push_back(std::move(rings));
  panel.series.push_back(std::move(front));
  return panel;
}

void write_plot(const fs::path& path, const ErrorMeasure& m, bool memory, const TradeoffPlan& plan,
                const std::vector<TradeoffRow>& rows) {
  const PlotAxis cost{.label = memory ? "peak memory, MiB" : "seconds for one sky",
                      .logarithmic = true};
  const PlotAxis error{.label = m.axis, .logarithmic = true};
  std::vector<PlotPanel> panels;
  for (const double sun : plan.suns_deg) {
    std::vector<PlotPoint> points;
    std::vector<CostAndError> pairs;
    for (const TradeoffRow& row : rows) {
      const std::optional<Spread>& s = row.difference.*m.of_row;
      if (row.sun_elevation_deg != sun || row.baseline != kReferenceBaseline || !s) continue;
      points.push_back(
          {row.rung, memory ? row.cost.peak_mib : row.cost.seconds, m.factor * s->mean, false});
      pairs.push_back({points.back().cost, points.back().error});
    }
    for (const std::size_t i : pareto_front(pairs)) points[i].front = true;
    panels.push_back(tradeoff_panel(fmt::format("Sun {:g}&#176;", sun), cost, error, points));
  }
  write_svg_plot(path,
                 fmt::format("{} against error in {}", memory ? "Memory" : "Seconds", m.title),
                 panels, 2);
}

void write_front_plot(const fs::path& path, const std::vector<TradeoffMean>& means) {
  std::vector<PlotPanel> panels;
  for (const ErrorMeasure& m : {kRadianceError, kColourError}) {
    std::vector<PlotPoint> points;
    for (const TradeoffMean& mean : means) {
      const std::optional<Spread>& s = mean.*m.of_mean;
      if (!s) continue;
      points.push_back({mean.rung, mean.cost.seconds, m.factor * s->mean, mean.*m.mean_front});
    }
    panels.push_back(
        tradeoff_panel(fmt::format("Seconds against error in {}, mean over the Suns", m.title),
                       {.label = "seconds for one sky", .logarithmic = true},
                       {.label = m.axis, .logarithmic = true}, points));
  }
  write_svg_plot(path, "", panels, 1);
}

}  // namespace

std::vector<std::string> write_tradeoff_report(const TradeoffPlan& plan,
                                               const TradeoffOutcome& outcome) {
  const fs::path& directory = plan.options.directory;
  const std::vector<TradeoffRow> rows = tradeoff_rows(outcome);
  const std::vector<TradeoffMean> means = tradeoff_means(rows);
  write_csv(directory / "tradeoff.csv", rows, outcome);
  write_front(directory / "front.md", plan, outcome, rows, means);
  write_approximations(directory / "approximations.md", plan, outcome, rows);
  for (const ErrorMeasure& m : kErrorMeasures) {
    write_plot(directory / fmt::format("seconds_{}.svg", m.name), m, false, plan, rows);
  }
  write_plot(directory / "memory_radiance.svg", kRadianceError, true, plan, rows);
  write_front_plot(directory / "front.svg", means);
  // Last: where the manifest is, the rest is too.
  write_json(directory / "tradeoff.json", plan, outcome, rows, means);
  return {"tradeoff.csv",
          "tradeoff.json",
          "front.md",
          "approximations.md",
          "front.svg",
          "seconds_radiance.svg",
          "seconds_luminance.svg",
          "seconds_ciede2000.svg",
          "memory_radiance.svg"};
}

}  // namespace twilight
