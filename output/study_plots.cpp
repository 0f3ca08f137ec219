#include "output/study_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "output/svg_plot.h"
#include "output/xml_text.h"

namespace twilight {
namespace {

constexpr double kTwoDecades = 100;

using Columns = std::vector<const StudyColumn*>;

const StudyColumn* column_of(const std::vector<StudyColumn>& columns, const std::string& name) {
  const auto found = std::ranges::find(columns, name, &StudyColumn::name);
  return found == columns.end() ? nullptr : &*found;
}

std::string base_of(const std::string& name) { return name.substr(0, name.find('[')); }

std::string short_name(const StudyColumn& axis) {
  return axis.name.substr(axis.name.rfind('.') + 1);
}

std::string label_of(const std::string& name, const std::string& unit) {
  // UDUNITS, which netCDF files speak, knows no magnitude.
  const std::string base = base_of(name);
  const bool magnitude = base == "magnitude" || base == "zenith_magnitude";
  const std::string shown = magnitude ? "mag arcsec-2" : unit == "1" ? "" : unit;
  return xml_escaped(shown.empty() ? name : fmt::format("{} ({})", name, shown));
}

// Distinct texts in the order of the cases.
std::vector<std::string> values_of(const StudyColumn& column, std::size_t cases) {
  std::vector<std::string> values;
  std::set<std::string> seen;
  for (std::size_t k = 0; k < cases; ++k) {
    std::string text = text_of(column, k);
    if (seen.insert(text).second) values.push_back(std::move(text));
  }
  return values;
}

// At even distances, the first and last among them.
std::vector<std::string> some_of(const std::vector<std::string>& values, std::size_t most) {
  if (values.size() <= most) return values;
  std::vector<std::string> some;
  for (std::size_t k = 0; k < most; ++k) {
    some.push_back(values[(k * (values.size() - 1) + (most - 1) / 2) / (most - 1)]);
  }
  return some;
}

/// What one plot shows.
struct Request {
  const StudyColumn* x = nullptr;
  std::string y;
  Columns columns;                      ///< y, or its numbers
  const StudyColumn* series = nullptr;  ///< none: one curve, or one for each column
  bool series_said = false;
  std::optional<bool> logarithmic = {};
};

/// Of numbers that are shown.
struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  double low_positive = low;
};

void set_ends(PlotAxis& axis, const Range& r, double margin) {
  if (axis.logarithmic) {
    axis.first = r.low_positive / 1.15;
    axis.last = r.high * 1.15;
    return;
  }
  const double scale = std::max(std::abs(r.low), std::abs(r.high));
  const double beyond = r.high > r.low ? margin * (r.high - r.low) : scale > 0 ? 0.1 * scale : 1.0;
  axis.first = r.low - beyond;
  axis.last = r.high + beyond;
}

/// Points of a plot by panel and curve.
class PlotMaker {
 public:
  PlotMaker(const StudyTable& table, const Request& request) : table_(table), ask_(request) {}

  /// Nothing where there is no point.
  std::optional<StudyPlot> make();

 private:
  struct Point {
    std::string panel, curve;
    double x, y;
  };

  bool lines() const { return !table_.crossed_sizes.empty() && is_axis(*ask_.x); }
  bool is_axis(const StudyColumn& column) const {
    return column_of(table_.axes, column.name) == &column;
  }
  bool curve_each() const { return ask_.columns.size() > 1 && !ask_.series_said; }

  void gather();
  void drop_repeated();
  std::string panel_text(std::size_t row, const StudyColumn& column) const;
  PlotPanel panel(const std::string& key, const PlotAxis& x, const PlotAxis& y) const;
  Range range(bool of_y, const std::string* panel) const;
  PlotAxis axis(const std::string& label, bool of_y) const;
  std::vector<PlotAxis> panel_axes(const PlotAxis& shared) const;
  void keep_some();

  const StudyTable& table_;
  const Request& ask_;
  Columns panel_axes_;
  std::vector<Point> points_;
  std::vector<std::string> panels_, curves_;
  bool one_curve_ = false;  // the series changes nothing
  std::string left_out_;
};

std::string PlotMaker::panel_text(std::size_t row, const StudyColumn& column) const {
  std::string text;
  if (ask_.columns.size() > 1 && !curve_each()) text = column.name;
  for (const StudyColumn* a : panel_axes_) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", short_name(*a), text_of(*a, row));
  }
  return text;
}

void PlotMaker::gather() {
  if (lines()) {
    for (const StudyColumn& a : table_.axes) {
      const bool taken = &a == ask_.x || (&a == ask_.series && !curve_each());
      if (!taken && values_of(a, table_.cases()).size() > 1) panel_axes_.push_back(&a);
    }
  }
  std::set<std::string> panels, curves;
  const auto note = [](std::vector<std::string>& keys, std::set<std::string>& seen,
                       const std::string& key) {
    if (seen.insert(key).second) keys.push_back(key);
  };
  for (const StudyColumn* column : ask_.columns) {
    for (std::size_t k = 0; k < table_.cases(); ++k) {
      Point p{panel_text(k, *column), {}, ask_.x->values.at(k), column->values.at(k)};
      if (!table_.errors[k].empty()) p.y = std::numeric_limits<double>::quiet_NaN();
      if (curve_each()) {
        p.curve = column->name.substr(ask_.y.size());
      } else if (ask_.series != nullptr) {
        p.curve = text_of(*ask_.series, k);
      }
      note(panels_, panels, p.panel);
      note(curves_, curves, p.curve);
      points_.push_back(std::move(p));
    }
  }
}

// A quantity that an axis does not change (the end of twilight under any Sun) is one curve, one
// panel.
void PlotMaker::drop_repeated() {
  if (!lines() || curve_each()) return;
  const auto repeats = [&](std::string Point::*other) {  // along all that is not `other`
    std::map<std::pair<std::string, double>, double> first;
    return std::ranges::all_of(points_, [&](const Point& p) {
      const double y = first.try_emplace({p.*other, p.x}, p.y).first->second;
      return y == p.y || (std::isnan(y) && std::isnan(p.y));
    });
  };
  const auto keep_first = [&](std::vector<std::string>& keys, std::string Point::*key) {
    keys.resize(1);
    std::erase_if(points_, [&](const Point& p) { return p.*key != keys.front(); });
  };
  if (curves_.size() > 1 && repeats(&Point::panel)) {
    keep_first(curves_, &Point::curve);
    one_curve_ = true;
  }
  if (panels_.size() > 1 && repeats(&Point::curve)) {
    keep_first(panels_, &Point::panel);
    for (Point& p : points_) p.panel.clear();
    panels_ = {""};
  }
}

void PlotMaker::keep_some() {
  const auto keep = [&](std::vector<std::string>& keys, std::size_t most, const char* what) {
    if (keys.size() <= most) return;
    left_out_ +=
        fmt::format("{}{} of {} {}", left_out_.empty() ? " (" : ", ", most, keys.size(), what);
    keys = some_of(keys, most);
  };
  keep(curves_, kMostPlotCurves, "curves");
  keep(panels_, kMostPlotPanels, "panels");
  if (!left_out_.empty()) left_out_ += ")";
  const std::set<std::string> curves(curves_.begin(), curves_.end());
  const std::set<std::string> panels(panels_.begin(), panels_.end());
  std::erase_if(points_, [&](const Point& p) {
    return !curves.contains(p.curve) || !panels.contains(p.panel);
  });
}

Range PlotMaker::range(bool of_y, const std::string* panel) const {
  Range r;
  for (const Point& p : points_) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) continue;
    if (panel != nullptr && p.panel != *panel) continue;
    const double v = of_y ? p.y : p.x;
    r.low = std::min(r.low, v);
    r.high = std::max(r.high, v);
    if (v > 0) r.low_positive = std::min(r.low_positive, v);
  }
  return r;
}

PlotAxis PlotMaker::axis(const std::string& label, bool of_y) const {
  const Range r = range(of_y, nullptr);
  PlotAxis axis{.label = label};
  const bool decades = r.high >= kTwoDecades * r.low_positive && (of_y ? r.low >= 0 : r.low > 0);
  axis.logarithmic = (of_y ? ask_.logarithmic : std::nullopt).value_or(decades) && r.high > 0;
  set_ends(axis, r, of_y ? 0.05 : 0.02);
  return axis;
}

// Panels share their y unless none of them would fill a quarter of it.
std::vector<PlotAxis> PlotMaker::panel_axes(const PlotAxis& shared) const {
  const auto span = [](const PlotAxis& a) {
    return a.logarithmic ? std::log(*a.last / *a.first) : *a.last - *a.first;
  };
  std::vector<PlotAxis> own;
  double widest = 0;
  for (const std::string& key : panels_) {
    const Range r = range(true, &key);
    const bool any = shared.logarithmic ? r.low_positive <= r.high : r.low <= r.high;
    own.push_back(shared);
    if (!any) continue;
    set_ends(own.back(), r, 0.05);
    widest = std::max(widest, span(own.back()));
  }
  if (widest >= 0.25 * span(shared)) own.assign(panels_.size(), shared);
  return own;
}

PlotPanel PlotMaker::panel(const std::string& key, const PlotAxis& x, const PlotAxis& y) const {
  PlotPanel panel{xml_escaped(key), x, y, {}};
  for (std::size_t c = 0; c < curves_.size(); ++c) {
    std::vector<std::pair<double, double>> points;
    for (const Point& p : points_) {
      const bool here = p.panel == key && p.curve == curves_[c];
      if (here && std::isfinite(p.x)) points.emplace_back(p.x, p.y);
    }
    std::ranges::stable_sort(points, {}, &std::pair<double, double>::first);
    PlotSeries dots{.label = {}, .points = points, .dots = true, .colour = series_colour(c)};
    for (const auto& [u, v] : points) dots.tooltips.push_back(fmt::format("{:.6g}, {:.6g}", u, v));
    std::string label = curves_.size() > 1 ? curves_[c] : "";
    const bool number = ask_.series != nullptr && ask_.series->words.empty() && !curve_each();
    if (!label.empty() && number) label = short_name(*ask_.series) + " " + label;
    if (lines()) {
      panel.series.push_back(
          {.label = xml_escaped(label), .points = points, .colour = series_colour(c)});
    } else {
      dots.label = xml_escaped(label);
    }
    panel.series.push_back(std::move(dots));
  }
  return panel;
}

std::optional<StudyPlot> PlotMaker::make() {
  gather();
  drop_repeated();
  keep_some();
  const bool any = std::ranges::any_of(
      points_, [](const Point& p) { return std::isfinite(p.x) && std::isfinite(p.y); });
  if (!any) return std::nullopt;
  const PlotAxis x = axis(label_of(ask_.x->name, ask_.x->unit), false);
  const PlotAxis y = axis(label_of(ask_.y, ask_.columns.front()->unit), true);
  std::vector<PlotPanel> panels;
  const std::vector<PlotAxis> ys = panel_axes(y);
  for (std::size_t k = 0; k < panels_.size(); ++k) panels.push_back(panel(panels_[k], x, ys[k]));
  std::string title = fmt::format("{} against {}", ask_.y, ask_.x->name);
  if (ask_.series != nullptr && !curve_each() && !one_curve_) title += " by " + ask_.series->name;
  const int columns = panels.size() == 1 ? 1 : panels.size() <= 4 ? 2 : 3;
  return StudyPlot{
      {}, ask_.x->name, ask_.y, svg_plot(xml_escaped(title + left_out_), panels, columns)};
}

bool numeric(const StudyColumn& column) { return column.words.empty(); }

// An axis of words, else the one of fewest values; two values at least, another than x.
const StudyColumn* chosen_series(const StudyTable& table, const StudyColumn* x) {
  const StudyColumn* best = nullptr;
  std::size_t fewest = 0;
  for (const StudyColumn& a : table.axes) {
    const std::size_t values = values_of(a, table.cases()).size();
    if (&a == x || values < 2) continue;
    // Cases in a list rarely share a number: only words tell them apart.
    if (table.crossed_sizes.empty() && numeric(a)) continue;
    const bool words = !numeric(a);
    const bool better = best == nullptr || (words && numeric(*best)) ||
                        (words != numeric(*best) && values < fewest);
    if (better) best = &a, fewest = values;
  }
  return best;
}

Columns columns_of(const StudyTable& table, const std::string& y) {
  if (const StudyColumn* one = column_of(table.quantities, y)) return {one};
  if (const StudyColumn* one = column_of(table.axes, y)) return {one};
  Columns several;
  for (const StudyColumn& c : table.quantities) {
    if (c.name.starts_with(y + "[")) several.push_back(&c);
  }
  return several;
}

std::vector<Request> requests_of(const StudyTable& table, const WantedQuantities& wanted) {
  std::vector<Request> all;
  for (const WantedPlot& plot : wanted.plots) {
    Request r;
    r.x = column_of(table.axes, plot.x);
    if (r.x == nullptr) r.x = column_of(table.quantities, plot.x);
    r.y = plot.y;
    r.columns = columns_of(table, plot.y);
    if (r.x == nullptr || !numeric(*r.x) || r.columns.empty()) continue;
    if (!std::ranges::all_of(r.columns, [](const StudyColumn* c) { return numeric(*c); })) continue;
    r.series_said = !plot.series.empty();
    r.series = r.series_said ? column_of(table.axes, plot.series) : chosen_series(table, r.x);
    r.logarithmic = plot.logarithmic;
    all.push_back(std::move(r));
  }
  if (!wanted.plots.empty()) return all;
  // Short lists without a choice of views or wavelengths in them.
  constexpr std::string_view kLists[] = {"zenith_magnitude", "twilight_sun_depression",
                                         "twilight_duration"};
  for (const StudyColumn& y : table.quantities) {
    const std::string base = base_of(y.name);
    const bool single = base == y.name || std::ranges::find(kLists, base) != std::end(kLists);
    if (!numeric(y) || !single) continue;
    for (const StudyColumn& x : table.axes) {
      if (!numeric(x) || values_of(x, table.cases()).size() < 2) continue;
      all.push_back({&x, y.name, {&y}, chosen_series(table, &x), false, {}});
    }
  }
  return all;
}

std::string file_name(const StudyPlot& plot, std::set<std::string>& taken) {
  std::string name;
  for (const char c : plot.y + "-against-" + plot.x) {
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '_';
    if (plain || name.empty() || name.back() != '-') name += plain ? c : '-';
  }
  std::string unique = name;
  for (int k = 2; !taken.insert(unique).second; ++k) unique = fmt::format("{}-{}", name, k);
  return unique;
}

}  // namespace

std::string text_of(const StudyColumn& column, std::size_t row) {
  if (!column.words.empty()) return column.words.at(row);
  const double value = column.values.at(row);
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : "";
}

std::vector<StudyPlot> study_plots(const StudyTable& table, const WantedQuantities& wanted) {
  std::vector<StudyPlot> plots;
  std::set<std::string> taken;
  for (const Request& request : requests_of(table, wanted)) {
    std::optional<StudyPlot> plot = PlotMaker(table, request).make();
    if (!plot) continue;
    plot->name = file_name(*plot, taken);
    plots.push_back(std::move(*plot));
  }
  return plots;
}

}  // namespace twilight
