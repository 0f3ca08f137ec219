#include "tests/validation/linear_plot.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace twilight::validation {

void write_linear_plot(const std::filesystem::path& file, const std::string& title,
                       const LinearAxis& x, const LinearAxis& y,
                       const std::vector<LinearSeries>& series) {
  constexpr double kWidth = 760, kHeight = 520, kLeft = 70, kRight = 20, kTop = 40, kBottom = 50;
  constexpr double kLegendRow = 16;
  constexpr const char* kColours[] = {"#1b6ca8", "#c8553d", "#588b3b", "#7a4fa3",
                                      "#b8860b", "#2f4f4f", "#d1498b", "#555555"};
  const auto px = [&](double v) {
    return kLeft + (v - x.first) / (x.last - x.first) * (kWidth - kLeft - kRight);
  };
  const auto py = [&](double v) {
    return kHeight - kBottom - (v - y.first) / (y.last - y.first) * (kHeight - kTop - kBottom);
  };
  const auto clean = [](double v) { return std::abs(v) < 1e-9 ? 0.0 : v; };
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} "
      "{1}\" font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
      "<clipPath id=\"axes\"><rect x=\"{2}\" y=\"{3}\" width=\"{4}\" height=\"{5}\"/></clipPath>\n"
      "<text x=\"{6}\" y=\"24\" font-size=\"15\" text-anchor=\"middle\">{7}</text>\n",
      kWidth, kHeight, kLeft, kTop, kWidth - kLeft - kRight, kHeight - kTop - kBottom, kWidth / 2,
      title);
  for (double v = std::ceil(x.first / x.step - 1e-9) * x.step; v <= x.last + 1e-9; v += x.step) {
    out += fmt::format(
        "<path d=\"M{0:.1f} {1}V{2}\" stroke=\"#ddd\"/>"
        "<text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4:.4g}</text>\n",
        px(v), kTop, kHeight - kBottom, kHeight - kBottom + 16, clean(v));
  }
  for (double v = std::ceil(y.first / y.step - 1e-9) * y.step; v <= y.last + 1e-9; v += y.step) {
    out += fmt::format(
        "<path d=\"M{1} {0:.1f}H{2}\" stroke=\"#ddd\"/>"
        "<text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.4g}</text>\n",
        py(v), kLeft, kWidth - kRight, kLeft - 6, py(v) + 4, clean(v));
  }
  out += fmt::format(
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n"
      "<text transform=\"translate(18 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      kWidth / 2, kHeight - 12, x.label, kHeight / 2, y.label);
  double legend = kTop + 18;
  std::size_t next = 0;
  for (const LinearSeries& s : series) {
    const std::string colour = s.colour.empty() ? kColours[next++ % std::size(kColours)] : s.colour;
    const char* dash = s.dashed ? " stroke-dasharray=\"6 4\"" : "";
    std::string path, inside;
    for (const auto& [u, v] : s.points) {
      if (s.dots) {
        inside += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>\n",
                              px(u), py(v), colour);
      } else {
        path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", px(u), py(v));
      }
    }
    if (!path.empty()) {
      inside += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\"{}/>\n",
                            path, colour, dash);
    }
    for (const auto& [index, text] : s.marks) {
      const auto& [u, v] = s.points.at(static_cast<std::size_t>(index));
      inside += fmt::format(
          "<circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"3\" fill=\"{2}\"/>"
          "<text x=\"{3:.1f}\" y=\"{4:.1f}\" font-size=\"10\" fill=\"{2}\">{5}</text>\n",
          px(u), py(v), colour, px(u) + 5, py(v) - 4, text);
    }
    out += "<g clip-path=\"url(#axes)\">\n" + inside + "</g>\n";
    if (s.label.empty()) continue;
    out += fmt::format(
        "<path d=\"M{0} {1}h24\" stroke=\"{2}\" stroke-width=\"1.8\"{3}/>"
        "<text x=\"{4}\" y=\"{5}\" fill=\"{2}\">{6}</text>\n",
        kLeft + 12, legend - 4, colour, dash, kLeft + 42, legend, s.label);
    legend += kLegendRow;
  }
  out += "</svg>\n";
  std::ofstream stream(file);
  stream << out;
  if (!stream) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace twilight::validation
