#include "output/retrieval_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "output/atomic_file.h"
#include "output/false_colour.h"
#include "output/png_file.h"
#include "output/svg_plot.h"

namespace twilight {
namespace {

using Json = nlohmann::ordered_json;
constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kFullRatio = 1.25;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json matrix(const std::vector<std::vector<double>>& rows) {
  Json json = Json::array();
  for (const auto& row : rows) {
    Json line = Json::array();
    for (const double value : row) line.push_back(number(value));
    json.push_back(std::move(line));
  }
  return json;
}

double residual_sigma(const Measurement& measured, const Retrieval& retrieval, std::size_t k) {
  const MeasuredValue& value = measured.values[k];
  return (retrieval.predicted[k] - value.value) / value.standard_error;
}

// Mean direction of a datum's views; azimuths within half a turn of the first.
ViewDirection mean_view(const Measurement& measured, const MeasuredValue& value) {
  ViewDirection mean;
  const double first = measured.views[value.views.front().first].relative_azimuth_rad;
  for (const auto& [view, share] : value.views) {
    mean.elevation_rad += share * measured.views[view].elevation_rad;
    mean.relative_azimuth_rad +=
        share *
        std::remainder(measured.views[view].relative_azimuth_rad - first, 2 * std::numbers::pi);
  }
  mean.relative_azimuth_rad =
      std::remainder(first + mean.relative_azimuth_rad, 2 * std::numbers::pi);
  return mean;
}

Json parameter_json(const RetrievedParameter& p) {
  Json json = {{"key", p.parameter.name},
               {"value", p.value},
               {"claimed", p.claimed},
               {"standard_error", number(p.standard_error)},
               {"interval_95", {p.low_95, p.high_95}},
               {"interval_by", p.profiled ? "profile" : "linearised model"},
               {"allowed_range", {p.parameter.low, p.parameter.high}},
               {"searched_in_logarithm", p.parameter.logarithmic},
               {"not_claimed_because", p.reasons}};
  Json trades = Json::array();
  for (const auto& [name, correlation] : p.trades_off_with) {
    trades.push_back({{"key", name}, {"correlation", correlation}});
  }
  json["trades_off_with"] = std::move(trades);
  json["bound_hit"] = p.bound_hit.empty() ? Json(nullptr) : Json(p.bound_hit);
  for (const auto& [name, end] : {std::pair("at_lowest", p.low_end), {"at_highest", p.high_end}}) {
    if (end) json[name] = {{"value", end->value}, {"chi_squared_rise", number(end->rise)}};
  }
  return json;
}

std::string remark(const RetrievedParameter& p) {
  std::vector<std::string> parts;
  if (!p.claimed) {
    parts.push_back(fmt::format("cannot be told from these data: {}", fmt::join(p.reasons, "; ")));
  }
  for (const auto& [name, correlation] : p.trades_off_with) {
    parts.push_back(fmt::format("trades off with {} (correlation {:.3f})", name, correlation));
  }
  if (!p.bound_hit.empty()) parts.push_back("ended at the " + p.bound_hit + " allowed value");
  return fmt::format("{}", fmt::join(parts, "; "));
}

// Residuals in errors: of a zenith curve by the Sun, else by the view's elevation; a series per
// response.
std::string residual_plot(const Measurement& measured, const Retrieval& retrieval) {
  const bool zenith = measured.kind == MeasuredKind::kZenithCurve;
  std::map<std::size_t, PlotSeries> series;
  for (std::size_t k = 0; k < measured.values.size(); ++k) {
    const MeasuredValue& value = measured.values[k];
    PlotSeries& s = series[value.response];
    s.label = measured.responses[value.response].name;
    s.dots = true;
    const double x = zenith ? measured.suns[value.sun].elevation_rad * kDegrees
                            : mean_view(measured, value).elevation_rad * kDegrees;
    s.points.emplace_back(x, residual_sigma(measured, retrieval, k));
  }
  std::vector<PlotSeries> all;
  for (auto& [response, s] : series) all.push_back(std::move(s));
  const PlotPanel panel{
      "predicted less measured over standard error",
      {zenith ? "elevation of the Sun / degrees" : "elevation of the view / degrees"},
      {"residual / standard errors"},
      std::move(all)};
  return svg_plot("Residuals of the retrieval", {panel}, 1);
}

// The photograph with every block in the colour of its ratio; grey where there is none.
std::vector<std::uint8_t> residual_map(const Measurement& measured, const Retrieval& retrieval,
                                       std::size_t response) {
  const auto width = static_cast<std::size_t>(measured.width);
  const Rgb8 none = ratio_colour(std::nan(""), kFullRatio);
  std::vector<std::uint8_t> rgb;
  for (std::size_t p = 0; p < width * static_cast<std::size_t>(measured.height); ++p) {
    rgb.insert(rgb.end(), none.begin(), none.end());
  }
  for (std::size_t k = 0; k < measured.values.size(); ++k) {
    const MeasuredValue& v = measured.values[k];
    if (v.response != response) continue;
    const Rgb8 colour = ratio_colour(retrieval.predicted[k] / v.value, kFullRatio);
    for (int y = v.top; y < v.bottom; ++y) {
      for (int x = v.left; x < v.right; ++x) {
        std::ranges::copy(
            colour, &rgb[3 * (static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x))]);
      }
    }
  }
  return rgb;
}

}  // namespace

CsvTable parameter_table(const Retrieval& retrieval) {
  CsvTable table({"key", "value", "standard_error", "low_95", "high_95", "claimed", "remark"});
  for (const RetrievedParameter& p : retrieval.parameters) {
    table.add_row(
        {p.parameter.name, p.value,
         std::isfinite(p.standard_error) ? CsvTable::Cell(p.standard_error) : CsvTable::Cell(""),
         p.low_95, p.high_95, p.claimed ? "yes" : "no", remark(p)});
  }
  return table;
}

CsvTable residual_table(const Measurement& measured, const Retrieval& retrieval) {
  CsvTable table({"sun_elevation_deg", "view_elevation_deg", "relative_azimuth_deg", "response",
                  "measured", "standard_error", "predicted", "residual_sigma", "line", "left_px",
                  "top_px"});
  const bool photograph = measured.kind == MeasuredKind::kPhotograph;
  const auto cell = [](bool there, int value) {
    return there ? CsvTable::Cell(static_cast<double>(value)) : CsvTable::Cell("");
  };
  for (std::size_t k = 0; k < measured.values.size(); ++k) {
    const MeasuredValue& value = measured.values[k];
    const ViewDirection view = mean_view(measured, value);
    table.add_row({measured.suns[value.sun].elevation_rad * kDegrees, view.elevation_rad * kDegrees,
                   view.relative_azimuth_rad * kDegrees, measured.responses[value.response].name,
                   value.value, value.standard_error, retrieval.predicted[k],
                   residual_sigma(measured, retrieval, k), cell(!photograph, value.line),
                   cell(photograph, value.left), cell(photograph, value.top)});
  }
  return table;
}

std::string retrieval_json(const RetrievalPlan& plan, const Retrieval& retrieval) {
  constexpr const char* kKinds[] = {"radiances", "zenith_curve", "photograph"};
  Json parameters = Json::array(), starts = Json::array();
  for (const RetrievedParameter& p : retrieval.parameters) parameters.push_back(parameter_json(p));
  for (const RetrievalStart& s : retrieval.starts) {
    starts.push_back({{"from", s.from},
                      {"to", s.to},
                      {"chi_squared", number(s.chi_squared)},
                      {"iterations", s.iterations},
                      {"converged", s.converged},
                      {"termination", s.termination}});
  }
  const std::vector<double>& singular = retrieval.singular_values;
  const Json json = {{"measured", plan.options.measured.string()},
                     {"kind", kKinds[static_cast<int>(plan.measured.kind)]},
                     {"data", plan.measured.values.size()},
                     {"converged", retrieval.converged},
                     {"parameters", std::move(parameters)},
                     {"chi_squared", retrieval.chi_squared},
                     {"degrees_of_freedom", retrieval.degrees_of_freedom},
                     {"error_scale", retrieval.error_scale},
                     {"covariance", matrix(retrieval.covariance)},
                     {"correlation", matrix(retrieval.correlation)},
                     {"singular_values", singular},
                     {"condition_number", number(singular.front() / singular.back())},
                     {"starts", std::move(starts)},
                     {"best_start", retrieval.best_start},
                     {"search_quality", plan.corrects ? plan.options.search_quality : "scene"},
                     {"grid_correction",
                      {{"rms_of_data_over_errors", retrieval.correction_rms_sigma},
                       {"largest_shift_over_error", number(retrieval.correction_shift_sigma)}}},
                     {"evaluations", retrieval.evaluations}};
  return json.dump(2) + "\n";
}

std::vector<std::pair<std::string, std::string>> retrieval_figures(const RetrievalPlan& plan,
                                                                   const Retrieval& retrieval) {
  auto figures = plan.measured.figures;
  figures.emplace_back("data, parameters", fmt::format("{}, {}", plan.measured.values.size(),
                                                       retrieval.parameters.size()));
  figures.emplace_back(
      "chi squared",
      fmt::format("{:.4g} with {} degrees of freedom{}", retrieval.chi_squared,
                  retrieval.degrees_of_freedom,
                  retrieval.error_scale > 1
                      ? fmt::format("; errors scaled by {:.3g}", retrieval.error_scale)
                      : ""));
  for (std::size_t s = 0; s < retrieval.starts.size(); ++s) {
    const RetrievalStart& start = retrieval.starts[s];
    figures.emplace_back(
        fmt::format("start {}{}", s + 1, s == retrieval.best_start ? " (the best)" : ""),
        fmt::format("{:.4g} -> {:.4g}, chi squared {:.5g}, {} steps{}", fmt::join(start.from, ", "),
                    fmt::join(start.to, ", "), start.chi_squared, start.iterations,
                    start.converged ? "" : ", not converged"));
  }
  if (plan.corrects) {
    figures.emplace_back(
        "grids of the scene against the search's",
        fmt::format("rms {:.2g} errors of the data; moved the result by {:.2g} of its error",
                    retrieval.correction_rms_sigma, retrieval.correction_shift_sigma));
  }
  for (const RetrievedParameter& p : retrieval.parameters) {
    std::string text = p.claimed ? fmt::format("{:.5g} +- {:.2g}, 95 % {:.4g}..{:.4g}", p.value,
                                               p.standard_error, p.low_95, p.high_95)
                                 : fmt::format("not claimed ({:.4g} fits best)", p.value);
    const std::string why = remark(p);
    figures.emplace_back(p.parameter.name, why.empty() ? text : text + "; " + why);
  }
  return figures;
}

std::vector<std::string> write_retrieval(const RetrievalPlan& plan, const Retrieval& retrieval) {
  const std::filesystem::path& folder = plan.options.directory;
  std::filesystem::create_directories(folder);
  std::deque<AtomicFile> files;
  std::vector<std::string> names;
  const auto text = [&](const std::string& name, const std::string& content) {
    names.push_back(name);
    files.emplace_back(folder / name).write(content);
  };
  text("retrieval.json", retrieval_json(plan, retrieval));
  text("residuals.csv", residual_table(plan.measured, retrieval).text());
  text("residuals.svg", residual_plot(plan.measured, retrieval));
  text("retrieved.toml", to_toml(retrieved_scene(plan, retrieval)));
  if (plan.measured.kind == MeasuredKind::kPhotograph) {
    for (std::size_t r = 0; r < plan.measured.responses.size(); ++r) {
      names.push_back("residuals_" + plan.measured.responses[r].name + ".png");
      write_png(files.emplace_back(folder / names.back()), plan.measured.width,
                plan.measured.height, residual_map(plan.measured, retrieval, r));
    }
  }
  for (AtomicFile& file : files) file.commit();
  return names;
}

}  // namespace twilight
