#include "output/fit_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace twilight {

CsvTable fit_goodness_table(const SkyFit& fit) {
  const FitCoefficients& c = fit.coefficients;
  std::vector<std::string> columns;
  for (const FitAxis& axis : c.axes) columns.push_back(axis.key);
  for (const char* name :
       {"channel", "rms_relative_error", "p95_relative_error", "largest_relative_error",
        "relative_bias", "converged", "iterations", "gradient_norm", "bounds_hit"}) {
    columns.emplace_back(name);
  }
  CsvTable table(columns);
  const std::size_t C = c.channels();
  const auto row = [&](std::size_t node, const std::string& channel, const FitError& e,
                       const FormFit* search) {
    std::vector<CsvTable::Cell> cells;
    for (std::size_t a = 0; a < c.axes.size(); ++a) cells.emplace_back(c.axis_value(node, a));
    cells.emplace_back(channel);
    for (const double value : {e.rms, e.p95, e.largest, e.bias}) cells.emplace_back(value);
    cells.emplace_back(c.converged[node] ? "true" : "false");
    if (search == nullptr) {
      for (int k = 0; k < 3; ++k) cells.emplace_back("");
    } else {
      cells[cells.size() - 1] = search->converged ? "true" : "false";
      cells.emplace_back(static_cast<double>(search->iterations));
      cells.emplace_back(search->gradient_norm);
      cells.emplace_back(fmt::format("{}", fmt::join(search->bounds_hit, "; ")));
    }
    table.add_row(cells);
  };
  for (std::size_t n = 0; n < c.nodes(); ++n) {
    for (std::size_t k = 0; k < C; ++k) {
      const ChannelFit& f = fit.channels[n * C + k];
      row(n, fit.channel_names[k], f.error, &f.fit);
    }
    if (c.quantity == FitQuantity::kSpectral) row(n, "luminance", fit.luminance[n], nullptr);
  }
  return table;
}

std::vector<std::pair<std::string, std::string>> fit_figures(const SkyFit& fit) {
  const FitCoefficients& c = fit.coefficients;
  std::size_t worst = 0, bounded = 0;
  double sum = 0;
  for (std::size_t n = 0; n < c.nodes(); ++n) {
    if (fit.luminance[n].rms > fit.luminance[worst].rms) worst = n;
    sum += fit.luminance[n].rms * fit.luminance[n].rms;
  }
  for (const ChannelFit& f : fit.channels) bounded += f.fit.bounds_hit.empty() ? 0 : 1;
  std::string place;
  for (std::size_t a = 0; a < c.axes.size(); ++a) {
    place += fmt::format("{}{} = {}", a > 0 ? ", " : "", c.axes[a].key, c.axis_value(worst, a));
  }
  const std::size_t searches = fit.channels.size();
  return {
      {"fit",
       fmt::format("{}, {} nodes x {} channels", sky_form_name(c.form), c.nodes(), c.channels())},
      {"rms relative error", fmt::format("{:.2f} %", 100 * fit.rms_of_all)},
      {"rms relative error of luminance",
       fmt::format("{:.2f} %, worst {:.2f} % at {}",
                   100 * std::sqrt(sum / static_cast<double>(c.nodes())),
                   100 * fit.luminance[worst].rms, place)},
      {"searches that ended on a bound", fmt::format("{} of {}", bounded, searches)},
      {"searches that did not converge", fmt::format("{} of {}", fit.not_converged, searches)},
  };
}

}  // namespace twilight
