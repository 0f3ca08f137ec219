#include "output/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "output/atomic_file.h"

namespace twilight {
namespace {

constexpr double kWidth = 760, kHeight = 520, kLeft = 78, kRight = 20, kTop = 40, kBottom = 50;
constexpr double kLegendRow = 16, kTitle = 34;
constexpr double kMarkSize = 10, kMarkWidth = 5.4;  // height and mean width of a letter
constexpr double kDot = 3.5, kRing = 6.5;
constexpr const char* kColours[] = {"#1b6ca8", "#c8553d", "#588b3b", "#7a4fa3",
                                    "#b8860b", "#2f4f4f", "#d1498b", "#555555"};

struct Box {
  double x0, y0, x1, y1;
};

double overlap(const Box& a, const Box& b) {
  return std::max(0.0, std::min(a.x1, b.x1) - std::max(a.x0, b.x0)) *
         std::max(0.0, std::min(a.y1, b.y1) - std::max(a.y0, b.y0));
}

// Letters that a text shows: an XML entity is one.
double letters_of(const std::string& text) {
  double letters = 0;
  for (std::size_t i = 0; i < text.size(); ++i, ++letters) {
    if (text[i] != '&') continue;
    const std::size_t end = text.find(';', i);
    if (end != std::string::npos) i = end;
  }
  return letters;
}

// 1, 2 or 5 times a power of ten, some ten of them in the range.
double round_step(double range) {
  const double power = std::pow(10.0, std::floor(std::log10(range / 10)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power * 10 >= range) return factor * power;
  }
  return 10 * power;
}

/// An axis with its range decided, and where its values lie.
class Scale {
 public:
  /// `values` of all points; `from`, `to` in pixels.
  Scale(const PlotAxis& axis, const std::vector<double>& values, double from, double to)
      : logarithmic_(axis.logarithmic), from_(from), to_(to) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const double v : values) {
      if (!shows(v)) continue;
      low = std::min(low, v);
      high = std::max(high, v);
    }
    if (!(low <= high)) low = logarithmic_ ? 0.1 : 0, high = 1;
    if (logarithmic_) {
      // Whole decades where there are many; else 1, 2, 5 of each.
      low = axis.first ? *axis.first : round_down(low * 0.97);
      high = axis.last ? *axis.last : round_up(high * 1.03);
      first_ = std::log10(low);
      last_ = std::log10(high);
    } else {
      first_ = axis.first.value_or(low);
      last_ = axis.last.value_or(high);
      if (!(first_ < last_)) last_ = first_ + 1;
      step_ = axis.step > 0 ? axis.step : round_step(last_ - first_);
    }
  }

  bool shows(double v) const { return std::isfinite(v) && (!logarithmic_ || v > 0); }

  double pixel(double v) const {
    const double u = logarithmic_ ? std::log10(v) : v;
    return from_ + (u - first_) / (last_ - first_) * (to_ - from_);
  }

  /// Values of the grid lines, each with its text.
  std::vector<std::pair<double, std::string>> grid() const {
    std::vector<std::pair<double, std::string>> lines;
    if (!logarithmic_) {
      for (double v = std::ceil(first_ / step_ - 1e-9) * step_; v <= last_ + 1e-9; v += step_) {
        const double clean = std::abs(v) < 1e-9 ? 0.0 : v;
        lines.emplace_back(v, fmt::format("{:.4g}", clean));
      }
      return lines;
    }
    const bool few = last_ - first_ < 3.5;
    for (double decade = std::floor(first_); decade <= last_ + 1e-9; ++decade) {
      for (const double factor : {1.0, 2.0, 5.0}) {
        if (factor > 1 && !few) break;
        const double u = decade + std::log10(factor);
        if (u < first_ - 1e-9 || u > last_ + 1e-9) continue;
        const double v = factor * std::pow(10.0, decade);
        const bool plain = v > 0.9e-4 && v < 1.1e5;
        lines.emplace_back(v, plain ? fmt::format("{:g}", v) : fmt::format("{:.0e}", v));
      }
    }
    return lines;
  }

 private:
  static double round_down(double v) {
    const double power = std::pow(10.0, std::floor(std::log10(v)));
    return v >= 5 * power ? 5 * power : v >= 2 * power ? 2 * power : power;
  }
  static double round_up(double v) {
    const double power = std::pow(10.0, std::floor(std::log10(v)));
    return v <= power       ? power
           : v <= 2 * power ? 2 * power
           : v <= 5 * power ? 5 * power
                            : 10 * power;
  }

  bool logarithmic_;
  double from_, to_, first_ = 0, last_ = 1, step_ = 1;
};

/// Draws one panel with its origin at the top left.
class PanelDrawing {
 public:
  PanelDrawing(const PlotPanel& panel, int number)
      : panel_(panel),
        number_(number),
        x_(panel.x, values(panel, false), kLeft, kWidth - kRight),
        y_(panel.y, values(panel, true), kHeight - kBottom, kTop) {}

  std::string svg() {
    for (const PlotSeries& s : panel_.series) check_marks(s);
    frame();
    // The legend's place is taken before texts are laid out.
    std::string legend = draw_legend();
    for (std::size_t s = 0; s < panel_.series.size(); ++s) take_dots(panel_.series[s]);
    out_ += fmt::format("<g clip-path=\"url(#axes{})\">\n", number_);
    for (std::size_t s = 0; s < panel_.series.size(); ++s) draw_series(s);
    // Texts that must be there choose their places first.
    for (const bool optional : {false, true}) {
      for (std::size_t s = 0; s < panel_.series.size(); ++s) {
        if (panel_.series[s].optional_marks == optional) draw_marks(s);
      }
    }
    out_ += "</g>\n" + legend;
    return std::move(out_);
  }

 private:
  static void check_marks(const PlotSeries& s) {
    const int points = static_cast<int>(s.points.size());
    for (const auto& [index, text] : s.marks) {
      if (index >= 0 && index < points) continue;
      throw std::invalid_argument(
          fmt::format("mark '{}' is at point {}: must be 0..{}", text, index, points - 1));
    }
  }

  static std::vector<double> values(const PlotPanel& panel, bool y) {
    std::vector<double> all;
    for (const PlotSeries& s : panel.series) {
      for (const auto& [u, v] : s.points) {
        if ((panel.x.logarithmic && !(u > 0)) || (panel.y.logarithmic && !(v > 0))) continue;
        if (std::isfinite(u) && std::isfinite(v)) all.push_back(y ? v : u);
      }
    }
    return all;
  }

  bool shows(const std::pair<double, double>& p) const {
    return x_.shows(p.first) && y_.shows(p.second);
  }

  std::string colour(std::size_t series) const {
    std::size_t next = 0;
    for (std::size_t s = 0; s < series; ++s) next += panel_.series[s].colour.empty() ? 1 : 0;
    const std::string& own = panel_.series[series].colour;
    return own.empty() ? series_colour(next) : own;
  }

  void frame() {
    out_ += fmt::format(
        "<clipPath id=\"axes{0}\"><rect x=\"{1}\" y=\"{2}\" width=\"{3}\" height=\"{4}\"/>"
        "</clipPath>\n<text x=\"{5}\" y=\"24\" font-size=\"15\" "
        "text-anchor=\"middle\">{6}</text>\n",
        number_, kLeft, kTop, kWidth - kLeft - kRight, kHeight - kTop - kBottom, kWidth / 2,
        panel_.title);
    for (const auto& [v, text] : x_.grid()) {
      out_ += fmt::format(
          "<path d=\"M{0:.1f} {1}V{2}\" stroke=\"#ddd\"/>"
          "<text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4}</text>\n",
          x_.pixel(v), kTop, kHeight - kBottom, kHeight - kBottom + 16, text);
    }
    for (const auto& [v, text] : y_.grid()) {
      out_ += fmt::format(
          "<path d=\"M{1} {0:.1f}H{2}\" stroke=\"#ddd\"/>"
          "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>\n",
          y_.pixel(v), kLeft, kWidth - kRight, kLeft - 6, y_.pixel(v) + 4, text);
    }
    out_ += fmt::format(
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n"
        "<text transform=\"translate(18 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
        kWidth / 2, kHeight - 12, panel_.x.label, kHeight / 2, panel_.y.label);
  }

  std::string draw_legend() {
    // In the corner that hides the fewest points.
    double rows = 0, letters = 0;
    for (const PlotSeries& s : panel_.series) {
      if (s.label.empty()) continue;
      ++rows;
      letters = std::max(letters, letters_of(s.label));
    }
    if (rows == 0) return {};
    const double width = 42 + 6.6 * letters, height = kLegendRow * rows + 6;
    Box best{};
    double least = std::numeric_limits<double>::infinity();
    for (const bool bottom : {false, true}) {
      for (const bool right : {false, true}) {
        const double x = right ? kWidth - kRight - 8 - width : kLeft + 8;
        const double y = bottom ? kHeight - kBottom - 8 - height : kTop + 6;
        const Box box{x, y, x + width, y + height};
        double hidden = 0;
        for (const PlotSeries& s : panel_.series) {
          for (const auto& p : s.points) {
            if (!shows(p)) continue;
            const double u = x_.pixel(p.first), v = y_.pixel(p.second);
            hidden += u > box.x0 && u < box.x1 && v > box.y0 && v < box.y1 ? 1 : 0;
          }
        }
        if (hidden < least) best = box, least = hidden;
      }
    }
    taken_.push_back(best);
    std::string out = fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"white\" "
        "fill-opacity=\"0.8\"/>\n",
        best.x0, best.y0, best.x1 - best.x0, best.y1 - best.y0);
    double y = best.y0 + 14;
    for (std::size_t k = 0; k < panel_.series.size(); ++k) {
      const PlotSeries& s = panel_.series[k];
      if (s.label.empty()) continue;
      const std::string shade = colour(k);
      if (s.dots) {
        out += dot(best.x0 + 16, y - 4, shade, s.hollow, {});
      } else {
        out += fmt::format("<path d=\"M{} {}h24\" stroke=\"{}\" stroke-width=\"1.8\"{}/>",
                           best.x0 + 4, y - 4, shade, s.dashed ? " stroke-dasharray=\"6 4\"" : "");
      }
      out += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"{}\">{}</text>\n", best.x0 + 34, y, shade,
                         s.label);
      y += kLegendRow;
    }
    return out;
  }

  static std::string dot(double u, double v, const std::string& shade, bool hollow,
                         const std::string& tooltip) {
    const std::string fill = hollow ? "none\" stroke-width=\"1.6\" stroke=\"" + shade : shade;
    const std::string title = tooltip.empty() ? "" : "<title>" + tooltip + "</title>";
    return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\">{}</circle>\n", u,
                       v, hollow ? kRing : kDot, fill, title);
  }

  void take_dots(const PlotSeries& s) {
    if (!s.dots && s.marks.empty()) return;
    const auto take = [&](const std::pair<double, double>& p) {
      if (!shows(p)) return;
      const double u = x_.pixel(p.first), v = y_.pixel(p.second);
      const double r = s.hollow ? kRing : kDot;
      taken_.push_back({u - r, v - r, u + r, v + r});
    };
    if (s.dots) {
      for (const auto& p : s.points) take(p);
    } else {
      for (const auto& [index, text] : s.marks) take(s.points.at(static_cast<std::size_t>(index)));
    }
  }

  void draw_series(std::size_t series) {
    const PlotSeries& s = panel_.series[series];
    const std::string shade = colour(series);
    std::string path;
    bool broken = true;
    for (std::size_t i = 0; i < s.points.size(); ++i) {
      if (!shows(s.points[i])) {
        broken = true;
        continue;
      }
      const double u = x_.pixel(s.points[i].first), v = y_.pixel(s.points[i].second);
      if (s.dots) {
        out_ += dot(u, v, shade, s.hollow, s.tooltips.empty() ? "" : s.tooltips.at(i));
      } else {
        path += fmt::format("{}{:.1f} {:.1f}", broken ? "M" : "L", u, v);
        broken = false;
      }
    }
    if (path.empty()) return;
    out_ += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"{}/>\n",
                        path, shade, s.dashed ? " stroke-dasharray=\"6 4\"" : "");
  }

  void draw_marks(std::size_t series) {
    const PlotSeries& s = panel_.series[series];
    const std::string shade = colour(series);
    for (const auto& [index, text] : s.marks) {
      const auto& p = s.points[static_cast<std::size_t>(index)];
      if (!shows(p)) continue;
      const double u = x_.pixel(p.first), v = y_.pixel(p.second);
      if (!s.dots) {
        out_ +=
            fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>", u, v, shade);
      }
      const auto place = free_place(u, v, text, s.optional_marks);
      if (!place) continue;
      taken_.push_back(*place);
      out_ +=
          fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\" fill=\"{}\">{}</text>\n",
                      place->x0, place->y1 - 2, kMarkSize, shade, text);
    }
  }

  // Where a text beside the dot at (u, v) hides least; nothing if it would hide something and
  // need not be there.
  std::optional<Box> free_place(double u, double v, const std::string& text, bool optional) const {
    const double width = kMarkWidth * letters_of(text), height = kMarkSize + 1;
    const Box frame{kLeft, kTop, kWidth - kRight, kHeight - kBottom};
    std::optional<Box> best;
    double least = std::numeric_limits<double>::infinity();
    for (const double away : {7.0, 14.0}) {
      const std::array<std::pair<double, double>, 8> corners = {{{u + away, v - height + 1},
                                                                 {u + away, v - 1},
                                                                 {u - away - width, v - height + 1},
                                                                 {u - away - width, v - 1},
                                                                 {u - width / 2, v - away - height},
                                                                 {u - width / 2, v + away},
                                                                 {u + away, v - away - height},
                                                                 {u + away, v + away}}};
      for (const auto& [x, y] : corners) {
        const Box box{x, y, x + width, y + height};
        double hidden = width * height - overlap(box, frame);
        for (const Box& other : taken_) hidden += overlap(box, other);
        if (hidden < 1e-6) return box;
        if (hidden < least) best = box, least = hidden;
      }
    }
    return optional ? std::nullopt : best;
  }

  const PlotPanel& panel_;
  int number_;
  Scale x_, y_;
  std::vector<Box> taken_;
  std::string out_;
};

}  // namespace

std::string series_colour(std::size_t index) { return kColours[index % std::size(kColours)]; }

std::string svg_plot(const std::string& title, const std::vector<PlotPanel>& panels, int columns) {
  if (panels.empty()) throw std::invalid_argument("plot has 0 panels; at least 1 is needed");
  columns = std::clamp(columns, 1, static_cast<int>(panels.size()));
  const int rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  const double top = title.empty() ? 0 : kTitle;
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} "
      "{1}\" font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      columns * kWidth, rows * kHeight + top);
  if (!title.empty()) {
    // A glyph is 0.55 of the font's size wide on average; an entity is one.
    std::size_t glyphs = 0;
    for (std::size_t i = 0; i < title.size(); ++i, ++glyphs) {
      if (title[i] == '&') i = std::min(title.find(';', i), title.size() - 1);
    }
    const double size = std::min(18.0, columns * kWidth / (0.55 * static_cast<double>(glyphs)));
    out += fmt::format(
        "<text x=\"{}\" y=\"26\" font-size=\"{:.3g}\" text-anchor=\"middle\">{}</text>\n",
        columns * kWidth / 2, size, title);
  }
  for (std::size_t k = 0; k < panels.size(); ++k) {
    const int number = static_cast<int>(k);
    out += fmt::format("<g transform=\"translate({} {})\">\n{}</g>\n", number % columns * kWidth,
                       number / columns * kHeight + top, PanelDrawing(panels[k], number).svg());
  }
  return out + "</svg>\n";
}

void write_svg_plot(const std::filesystem::path& path, const std::string& title,
                    const std::vector<PlotPanel>& panels, int columns) {
  AtomicFile file(path);
  file.write(svg_plot(title, panels, columns));
  file.commit();
}

void write_svg_plot(const std::filesystem::path& path, const std::string& title, const PlotAxis& x,
                    const PlotAxis& y, const std::vector<PlotSeries>& series) {
  write_svg_plot(path, "", {{title, x, y, series}}, 1);
}

}  // namespace twilight
