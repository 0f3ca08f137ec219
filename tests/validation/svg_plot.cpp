#include "tests/validation/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace twilight::validation {

void write_svg_plot(const std::filesystem::path& file, const std::string& title,
                    const std::string& x_label, const std::string& y_label,
                    const std::vector<SvgSeries>& series) {
  constexpr double kWidth = 720, kHeight = 480, kLeft = 80, kRight = 20, kTop = 40, kBottom = 50;
  constexpr const char* kColours[] = {"#1b6ca8", "#c8553d", "#588b3b", "#7a4fa3",
                                      "#b8860b", "#2f4f4f", "#d1498b", "#555555"};
  double x0 = std::numeric_limits<double>::infinity(), x1 = -x0, y0 = x0, y1 = -x0;
  for (const SvgSeries& s : series) {
    for (const auto& [x, y] : s.points) {
      if (!(y > 0)) continue;
      x0 = std::min(x0, x);
      x1 = std::max(x1, x);
      y0 = std::min(y0, std::log10(y));
      y1 = std::max(y1, std::log10(y));
    }
  }
  if (!(x0 < x1)) x1 = x0 + 1;
  y0 = std::floor(y0);
  y1 = std::max(y0 + 1, std::ceil(y1));
  const auto px = [&](double x) {
    return kLeft + (x - x0) / (x1 - x0) * (kWidth - kLeft - kRight);
  };
  const auto py = [&](double log_y) {
    return kHeight - kBottom - (log_y - y0) / (y1 - y0) * (kHeight - kTop - kBottom);
  };
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      "<text x=\"{}\" y=\"24\" font-size=\"15\" text-anchor=\"middle\">{}</text>\n",
      kWidth, kHeight, kWidth / 2, title);
  for (double decade = y0; decade <= y1; ++decade) {
    out += fmt::format(
        "<path d=\"M{:.1f} {:.1f}H{:.1f}\" stroke=\"#ddd\"/>"
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">1e{:g}</text>\n",
        kLeft, py(decade), kWidth - kRight, kLeft - 6, py(decade) + 4, decade);
  }
  const double step = x1 - x0 > 100 ? 30 : x1 - x0 > 30 ? 10 : x1 - x0 > 12 ? 2 : 1;
  for (double x = std::ceil(x0 / step) * step; x <= x1 + 1e-9; x += step) {
    out += fmt::format(
        "<path d=\"M{:.1f} {:.1f}V{:.1f}\" stroke=\"#ddd\"/>"
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:g}</text>\n",
        px(x), kTop, kHeight - kBottom, px(x), kHeight - kBottom + 16, x);
  }
  out += fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n"
      "<text transform=\"translate(16 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      kWidth / 2, kHeight - 12, x_label, kHeight / 2, y_label);
  for (std::size_t k = 0; k < series.size(); ++k) {
    const char* colour = kColours[k % std::size(kColours)];
    std::string path;
    for (const auto& [x, y] : series[k].points) {
      if (!(y > 0)) continue;
      const double u = px(x), v = py(std::log10(y));
      if (series[k].dots) {
        out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>\n", u, v,
                           colour);
      } else {
        path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", u, v);
      }
    }
    if (!path.empty()) {
      out += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"/>\n",
                         path, colour);
    }
    out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"{}\">{} {}</text>\n", kLeft + 12,
                       kTop + 18 + 16 * static_cast<double>(k), colour,
                       series[k].dots ? "&#9679;" : "&#8212;", series[k].label);
  }
  out += "</svg>\n";
  std::ofstream stream(file);
  stream << out;
  if (!stream) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace twilight::validation
