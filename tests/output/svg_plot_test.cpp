#include "output/svg_plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <regex>
#include <stdexcept>

namespace twilight {
namespace {

struct Circle {
  double x, y;
};

std::vector<Circle> circles_of(const std::string& svg) {
  const std::regex circle("<circle cx=\"([-0-9.]+)\" cy=\"([-0-9.]+)\"");
  std::vector<Circle> circles;
  for (std::sregex_iterator it(svg.begin(), svg.end(), circle), end; it != end; ++it) {
    circles.push_back({std::stod((*it)[1]), std::stod((*it)[2])});
  }
  return circles;
}

std::string plot(const PlotAxis& x, const PlotAxis& y, const PlotSeries& series) {
  return svg_plot("", {{"title", x, y, {series}}}, 1);
}

TEST(SvgPlot, LogarithmicAxesGiveEqualRatiosEqualSteps) {
  PlotSeries dots{.label = "", .dots = true};
  dots.points = {{0.1, 10}, {1, 100}, {10, 1000}, {0, 5}, {-1, 5}, {3, NAN}};
  const auto circles = circles_of(
      plot({.label = "x", .logarithmic = true}, {.label = "y", .logarithmic = true}, dots));
  ASSERT_EQ(circles.size(), 3u);  // what has no logarithm is left out
  EXPECT_NEAR(circles[1].x - circles[0].x, circles[2].x - circles[1].x, 0.11);
  EXPECT_NEAR(circles[1].y - circles[0].y, circles[2].y - circles[1].y, 0.11);
  EXPECT_GT(circles[1].x, circles[0].x);
  EXPECT_LT(circles[1].y, circles[0].y);  // up is up
}

TEST(SvgPlot, LinearAxesGiveEqualDifferencesEqualSteps) {
  PlotSeries dots{.label = "", .dots = true};
  dots.points = {{-3, 1}, {0, 2}, {3, 3}};
  const auto circles = circles_of(plot({"x", -6, 6, 1}, {"y", 0, 4, 1}, dots));
  ASSERT_EQ(circles.size(), 3u);
  EXPECT_NEAR(circles[1].x - circles[0].x, circles[2].x - circles[1].x, 0.11);
  EXPECT_NEAR(circles[2].y - circles[1].y, circles[1].y - circles[0].y, 0.11);
}

struct Text {
  double x, y;
  std::string words;
};

TEST(SvgPlot, TextsKeepApartAndOptionalOnesGiveWay) {
  PlotSeries dots{.label = "", .dots = true};
  for (int k = 0; k < 40; ++k) {
    dots.points.emplace_back(1 + 0.02 * (k % 7), 1 + 0.03 * (k / 7));
    dots.marks.emplace_back(k, "some-name-" + std::to_string(k));
  }
  dots.points.emplace_back(9, 9);
  const PlotAxis axis{"", 0.0, 10.0, 1};
  dots.optional_marks = true;
  const std::string svg = plot(axis, axis, dots);
  const std::regex mark("<text x=\"([-0-9.]+)\" y=\"([-0-9.]+)\" font-size=\"10\"[^>]*>([^<]+)<");
  std::vector<Text> texts;
  for (std::sregex_iterator it(svg.begin(), svg.end(), mark), end; it != end; ++it) {
    texts.push_back({std::stod((*it)[1]), std::stod((*it)[2]), (*it)[3]});
  }
  EXPECT_GT(texts.size(), 2u);
  EXPECT_LT(texts.size(), 40u);
  for (std::size_t a = 0; a < texts.size(); ++a) {
    for (std::size_t b = a + 1; b < texts.size(); ++b) {
      const double width = 5.4 * static_cast<double>(texts[a].words.size());
      const bool apart =
          std::abs(texts[a].y - texts[b].y) > 10.8 || std::abs(texts[a].x - texts[b].x) > width - 6;
      EXPECT_TRUE(apart) << texts[a].words << " on " << texts[b].words;
    }
  }
  // Those that must be there are there.
  dots.optional_marks = false;
  const std::string all = plot(axis, axis, dots);
  for (int k = 0; k < 40; ++k) {
    EXPECT_NE(all.find(">some-name-" + std::to_string(k) + "<"), std::string::npos);
  }
}

TEST(SvgPlot, PanelsLieInRowsAndRefuseNonsense) {
  PlotSeries line{.label = "a line"};
  line.points = {{1, 1}, {2, 2}};
  const PlotPanel panel{"one", {.label = "x"}, {.label = "y"}, {line}};
  const std::string svg = svg_plot("all", {panel, panel, panel}, 2);
  EXPECT_NE(svg.find("translate(0 34)"), std::string::npos);
  EXPECT_NE(svg.find("translate(760 34)"), std::string::npos);
  EXPECT_NE(svg.find("translate(0 554)"), std::string::npos);
  EXPECT_NE(svg.find(">a line<"), std::string::npos);
  EXPECT_THROW(svg_plot("", {}, 1), std::invalid_argument);
  PlotPanel wrong = panel;
  wrong.series[0].marks.emplace_back(2, "beyond");
  EXPECT_THROW(svg_plot("", {wrong}, 1), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
