#include "output/study_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "output/study_plots.h"
#include "output/svg_plot.h"
#include "output/xml_text.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string text_of_file(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// Nothing where the text is well-formed XML (elements, attributes and the five entities; comments
// and CDATA are not written), else what is wrong.
std::string xml_fault(std::string text) {
  const std::string doctype = "<!DOCTYPE html>";
  if (text.starts_with(doctype)) text.erase(0, doctype.size());
  const std::regex entity("^&(amp|lt|gt|quot|#[0-9]+);");
  const std::regex tag("^<(/?)([a-zA-Z][a-zA-Z0-9]*)((\\s+[a-zA-Z:-]+=\"[^\"<]*\")*)\\s*(/?)>");
  std::vector<std::string> open;
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] != '<' && text[i] != '&') {
      if (text[i] == '>') return "stray >";
      ++i;
      continue;
    }
    const std::string rest = text.substr(i, 2000);
    std::smatch match;
    if (text[i] == '&') {
      if (!std::regex_search(rest, match, entity)) return "bad entity: " + rest.substr(0, 30);
    } else {
      if (!std::regex_search(rest, match, tag)) return "bad tag: " + rest.substr(0, 60);
      const std::string attributes = match[3];
      for (std::size_t a = attributes.find('&'); a != std::string::npos;
           a = attributes.find('&', a + 1)) {
        const std::string from = attributes.substr(a);
        if (!std::regex_search(from, entity)) return "bad entity in " + attributes;
      }
      std::set<std::string> names;
      const std::regex name("([a-zA-Z:-]+)=\"");
      for (std::sregex_iterator it(attributes.begin(), attributes.end(), name), end; it != end;
           ++it) {
        if (!names.insert((*it)[1]).second) return "attribute twice: " + attributes;
      }
      if (match[1] == "/") {
        if (open.empty() || open.back() != match[2]) return "closes " + match[2].str();
        open.pop_back();
      } else if (match[5] != "/") {
        open.push_back(match[2]);
      }
    }
    i += match[0].str().size();
  }
  return open.empty() ? "" : "never closes " + open.back();
}

StudyColumn numbers(std::string name, std::string unit, std::vector<double> values) {
  return {std::move(name), std::move(unit), std::move(values), {}};
}
StudyColumn words(std::string name, std::vector<std::string> values) {
  return {std::move(name), "", {}, std::move(values)};
}

// Types x humidities x Suns, with a failure, a NaN and names that need escaping.
StudyTable crossed_table() {
  StudyTable table;
  table.title = "Haze & <dust> \"study\"";
  const std::vector<std::string> types = {"urban", "de<sert>&", "arctic"};
  const std::vector<double> humidities = {50, 80}, suns = {10, 0, -6, -12};
  table.axes = {words("aerosols.type", {}), numbers("aerosols.relative_humidity_percent", "%", {}),
                numbers("sun.elevation_deg", "degree", {})};
  table.crossed_sizes = {3, 2, 4};
  table.quantities = {
      numbers("illuminance", "lux", {}), numbers("horizontal_chromaticity_x", "1", {}),
      numbers("zenith_magnitude[V]", "1", {}), numbers("zenith_magnitude[R]", "1", {})};
  for (int k = 0; k < 6; ++k) {
    table.quantities.push_back(numbers(
        "radiance[el 90 az 0, " + std::to_string(400 + 50 * k) + " nm]", "W m-2 sr-1 nm-1", {}));
  }
  for (std::size_t t = 0; t < 3; ++t) {
    for (const double rh : humidities) {
      for (const double sun : suns) {
        const std::size_t k = table.cases();
        table.axes[0].words.push_back(types[t]);
        table.axes[1].values.push_back(rh);
        table.axes[2].values.push_back(sun);
        const double light = 400 * std::pow(10, 0.4 * sun) * (1 + static_cast<double>(t));
        const bool failed = k == 9;
        table.errors.push_back(failed ? "key 'x' = <3> & more: must be 1..2" : "");
        table.pictures.push_back(failed ? "" : "pictures/case " + std::to_string(k) + "#.png");
        const double none = std::nan("");
        table.quantities[0].values.push_back(failed ? none : light);
        table.quantities[1].values.push_back(failed || k == 5 ? none : 0.3 + 0.001 * sun);
        table.quantities[2].values.push_back(failed ? none : 10 - sun);
        table.quantities[3].values.push_back(none);
        for (std::size_t q = 4; q < table.quantities.size(); ++q) {
          table.quantities[q].values.push_back(failed ? none : light * static_cast<double>(q));
        }
      }
    }
  }
  return table;
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t i = text.find(part); i != std::string::npos; i = text.find(part, i + 1)) ++count;
  return count;
}

TEST(XmlFault, IsFound) {
  EXPECT_EQ(xml_fault("<a b=\"c &amp; d\"><e/>&#8230;</a>"), "");
  EXPECT_NE(xml_fault("<a><b></a></b>"), "");
  EXPECT_NE(xml_fault("<a>x & y</a>"), "");
  EXPECT_NE(xml_fault("<a>x < y</a>"), "");
  EXPECT_NE(xml_fault("<a b=\"1\" b=\"2\"/>"), "");
  EXPECT_NE(xml_fault("<a>"), "");
}

TEST(XmlText, EscapesWhatMarkupWouldTake) {
  EXPECT_EQ(xml_escaped("a<b>&\"'"), "a&lt;b&gt;&amp;&quot;&#39;");
  EXPECT_EQ(xml_escaped("\xC3\xBC \xE2\x82\xAC \xF0\x9F\x8C\x85"),
            "\xC3\xBC \xE2\x82\xAC \xF0\x9F\x8C\x85");
  // Control characters, broken and overlong UTF-8, surrogates.
  for (const char* bad : {"\x01", "\xFF", "\xC3", "\xC0\xAF", "\xED\xA0\x80", "\xF5\x80\x80\x80"}) {
    EXPECT_THAT(xml_escaped(bad), HasSubstr("\xEF\xBF\xBD"));
    EXPECT_EQ(xml_escaped(bad).find(bad), std::string::npos);
  }
  EXPECT_EQ(url_of_path("a b/c#?%.png"), "a%20b/c%23%3F%25.png");
}

TEST(StudyReport, IsWellFormedAndNamesEveryPicture) {
  const TemporaryFolder folder;
  const StudyTable table = crossed_table();
  const auto written = write_study_report(folder.path, table, {});
  ASSERT_FALSE(written.empty());
  EXPECT_EQ(written.back(), "index.html");
  for (const std::string& name : written) {
    EXPECT_EQ(xml_fault(text_of_file(folder.path / name)), "") << name;
  }
  const std::string page = text_of_file(folder.path / "index.html");
  for (const std::string& picture : table.pictures) {
    if (!picture.empty()) {
      EXPECT_THAT(page, HasSubstr("<img src=\"" + url_of_path(picture) + "\""));
    }
  }
  for (std::size_t k = 0; k + 1 < written.size(); ++k) {
    EXPECT_THAT(page, HasSubstr("<img src=\"" + written[k] + "\""));
  }
  EXPECT_THAT(page, AllOf(HasSubstr("study.nc"), HasSubstr("study.csv"), HasSubstr("24 cases"),
                          HasSubstr("1 failed"), Not(HasSubstr("<script"))));
  // Nothing but what was said is in the folder.
  std::set<std::string> there;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path)) {
    if (entry.is_regular_file()) {
      there.insert(std::filesystem::relative(entry.path(), folder.path).string());
    }
  }
  EXPECT_EQ(there, std::set<std::string>(written.begin(), written.end()));
}

TEST(StudyReport, GridHasTheLastAxisAcrossAndTheOthersDown) {
  const TemporaryFolder folder;
  write_study_report(folder.path, crossed_table(), {});
  const std::string page = text_of_file(folder.path / "index.html");
  const std::string grid = page.substr(page.find("class=\"pictures\""));
  const std::string body = grid.substr(grid.find("<tbody>"), grid.find("</tbody>"));
  const std::regex row("<tr>(.*)</tr>");
  std::vector<std::string> rows;
  const std::string rows_text = body.substr(0, body.find("</tbody>"));
  for (std::sregex_iterator it(rows_text.begin(), rows_text.end(), row), end; it != end; ++it) {
    rows.push_back((*it)[1]);
  }
  ASSERT_EQ(rows.size(), 6u);
  EXPECT_THAT(rows[2], HasSubstr("<th>de&lt;sert&gt;&amp;</th><th>50</th>"));
  for (std::size_t r = 0; r < 6; ++r) {
    EXPECT_EQ(count_of(rows[r], "<td>"), 4u);
    for (std::size_t c = 0; c < 4; ++c) {
      if (r == 2 && c == 1) continue;
      EXPECT_THAT(rows[r], HasSubstr("case%20" + std::to_string(4 * r + c) + "%23.png"));
    }
  }
  EXPECT_THAT(rows[2], HasSubstr("href=\"#case-9\">failed</a>"));
  EXPECT_THAT(page, HasSubstr("<tr id=\"case-9\"><td>9</td><td>de&lt;sert&gt;&amp;</td><td>50</td>"
                              "<td>0</td><td class=\"failed\">key &#39;x&#39; = &lt;3&gt; &amp; "
                              "more: must be 1..2</td></tr>"));
}

TEST(StudyReport, IsTheSameOfTheSameTable) {
  const TemporaryFolder a, b;
  const auto written = write_study_report(a.path, crossed_table(), {});
  EXPECT_EQ(written, write_study_report(b.path, crossed_table(), {}));
  for (const std::string& name : written) {
    EXPECT_EQ(text_of_file(a.path / name), text_of_file(b.path / name));
  }
}

TEST(StudyReport, OfCasesInAListFlows) {
  const TemporaryFolder folder;
  StudyTable table = crossed_table();
  table.crossed_sizes.clear();
  for (const std::string& name : write_study_report(folder.path, table, {})) {
    EXPECT_EQ(xml_fault(text_of_file(folder.path / name)), "") << name;
  }
  const std::string page = text_of_file(folder.path / "index.html");
  EXPECT_EQ(count_of(page, "<figure>"), table.cases());
  EXPECT_THAT(page, HasSubstr("aerosols.type = urban, aerosols.relative_humidity_percent = 50"));
}

TEST(StudyReport, OfOneSkyWithoutAxesHasItsPicture) {
  const TemporaryFolder folder;
  StudyTable table;
  table.quantities = {numbers("illuminance", "lux", {5})};
  table.errors = {""};
  table.pictures = {"a.png"};
  const auto written = write_study_report(folder.path, table, {});
  EXPECT_EQ(written, std::vector<std::string>{"index.html"});
  const std::string page = text_of_file(folder.path / "index.html");
  EXPECT_EQ(xml_fault(page), "");
  EXPECT_THAT(page, AllOf(HasSubstr("<img src=\"a.png\""), HasSubstr("1 case, all done")));
}

TEST(StudyReport, OfNoPicturesAndOnlyFailuresIsAPageToo) {
  const TemporaryFolder folder;
  StudyTable table = crossed_table();
  table.errors.assign(table.cases(), "no air");
  table.pictures.assign(table.cases(), "");
  for (StudyColumn& q : table.quantities) q.values.assign(table.cases(), std::nan(""));
  const auto written = write_study_report(folder.path, table, {});
  EXPECT_EQ(written, std::vector<std::string>{"index.html"});
  EXPECT_EQ(xml_fault(text_of_file(folder.path / "index.html")), "");
}

TEST(StudyReport, WhereItCannotBeWrittenSaysWhere) {
  const TemporaryFolder folder;
  const auto file = folder.write("taken", "");
  try {
    write_study_report(file, crossed_table(), {});
    ADD_FAILURE() << "wrote into a file";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("taken"));
  }
}

TEST(StudyPlots, AreOfSingleNumbersAgainstAxesOfNumbers) {
  const auto plots = study_plots(crossed_table(), {});
  std::set<std::string> names;
  for (const StudyPlot& p : plots) names.insert(p.name);
  EXPECT_EQ(names, (std::set<std::string>{
                       "illuminance-against-sun.elevation_deg",
                       "illuminance-against-aerosols.relative_humidity_percent",
                       "horizontal_chromaticity_x-against-sun.elevation_deg",
                       "horizontal_chromaticity_x-against-aerosols.relative_humidity_percent",
                       "zenith_magnitude-V-against-sun.elevation_deg",
                       "zenith_magnitude-V-against-aerosols.relative_humidity_percent"}));
}

TEST(StudyPlots, TakeALogarithmWhereNumbersSpanDecades) {
  for (const StudyPlot& p : study_plots(crossed_table(), {})) {
    if (p.name == "illuminance-against-sun.elevation_deg") {
      // Ticks a decade apart, one series for each type, a panel for each humidity.
      EXPECT_THAT(p.svg, AllOf(HasSubstr(">100<"), HasSubstr(">10<"), HasSubstr(">1<")));
      EXPECT_THAT(p.svg, AllOf(HasSubstr(">relative_humidity_percent 50<"),
                               HasSubstr(">relative_humidity_percent 80<")));
      EXPECT_THAT(p.svg, AllOf(HasSubstr(">urban<"), HasSubstr(">de&lt;sert&gt;&amp;<")));
      EXPECT_THAT(p.svg, HasSubstr(">illuminance (lux)<"));
    }
    if (p.y == "zenith_magnitude[V]") {
      EXPECT_THAT(p.svg, HasSubstr(">zenith_magnitude[V] (mag arcsec-2)<"));
    }
  }
}

TEST(StudyPlots, DrawWhatWasWanted) {
  WantedQuantities wanted;
  wanted.plots = {
      {"sun.elevation_deg", "radiance", "", {}, ""},                  // a curve of each
      {"sun.elevation_deg", "radiance", "aerosols.type", false, ""},  // a panel of each
      {"illuminance", "horizontal_chromaticity_x", "", {}, ""},       // dots
      {"sun.elevation_deg", "nothing", "", {}, ""},
  };
  const auto plots = study_plots(crossed_table(), wanted);
  ASSERT_EQ(plots.size(), 3u);
  EXPECT_EQ(plots[0].name, "radiance-against-sun.elevation_deg");
  EXPECT_EQ(plots[1].name, "radiance-against-sun.elevation_deg-2");
  EXPECT_THAT(plots[0].svg, HasSubstr(">[el 90 az 0, 400 nm]<"));
  EXPECT_THAT(plots[0].svg, Not(HasSubstr("curves)")));
  EXPECT_THAT(plots[1].svg, HasSubstr("(6 of 12 panels)"));
  EXPECT_THAT(plots[2].svg, Not(HasSubstr("stroke-width=\"1.8\"/>\n<circle")));
  for (const StudyPlot& p : plots) EXPECT_EQ(xml_fault(p.svg), "") << p.name;
}

TEST(StudyPlots, GapsStayOpen) {
  StudyTable table;
  table.axes = {numbers("a", "", {1, 2, 3, 4, 5})};
  table.crossed_sizes = {5};
  table.quantities = {numbers("q", "", {1, 2, std::nan(""), 4, 5})};
  table.errors.assign(5, "");
  table.pictures.assign(5, "");
  const auto plots = study_plots(table, {});
  ASSERT_EQ(plots.size(), 1u);
  // Two pieces, each of a start and one line.
  EXPECT_TRUE(std::regex_search(
      plots[0].svg, std::regex("d=\"M[0-9. ]+L[0-9. ]+M[0-9. ]+L[0-9. ]+\" fill=\"none\"")));
  EXPECT_EQ(count_of(plots[0].svg, "<circle"), 4u);
  table.quantities[0].values[2] = 3;
  table.errors[2] = "failed";  // its number is not to be trusted
  EXPECT_EQ(count_of(study_plots(table, {})[0].svg, "<circle"), 4u);
}

TEST(StudyPlots, ShowAFewOfManyCurvesAndSaySo) {
  StudyTable table;
  table.axes = {numbers("a", "", {}), numbers("b", "", {})};
  table.crossed_sizes = {20, 30};
  table.quantities = {numbers("q", "", {})};
  for (int a = 0; a < 20; ++a) {
    for (int b = 0; b < 30; ++b) {
      table.axes[0].values.push_back(a);
      table.axes[1].values.push_back(b);
      table.quantities[0].values.push_back(a + b);
      table.errors.emplace_back();
      table.pictures.emplace_back();
    }
  }
  const auto plots = study_plots(table, {});
  ASSERT_EQ(plots.size(), 2u);
  EXPECT_THAT(plots[1].svg, HasSubstr("q against b by a (8 of 20 curves)"));
  EXPECT_THAT(plots[1].svg, AllOf(HasSubstr(">a 0<"), HasSubstr(">a 19<")));
  EXPECT_EQ(count_of(plots[1].svg, "<circle"), 8u * 30u);
}

TEST(StudyPlots, AnAxisThatChangesNothingIsOneCurve) {
  StudyTable table;
  table.axes = {numbers("haze", "1", {}), numbers("sun.elevation_deg", "degree", {})};
  table.crossed_sizes = {3, 2};
  table.quantities = {numbers("end_of_twilight", "degree", {}), numbers("light", "lux", {})};
  for (const double haze : {0.1, 0.2, 0.4}) {
    for (const double sun : {5.0, -5.0}) {
      table.axes[0].values.push_back(haze);
      table.axes[1].values.push_back(sun);
      table.quantities[0].values.push_back(6 + haze);
      table.quantities[1].values.push_back(10 + sun + haze);
      table.errors.emplace_back();
      table.pictures.emplace_back();
    }
  }
  WantedQuantities wanted;
  wanted.plots = {{.x = "haze", .y = "end_of_twilight"}, {.x = "haze", .y = "light"}};
  const auto plots = study_plots(table, wanted);
  ASSERT_EQ(plots.size(), 2u);
  const std::string curve = "fill=\"none\" stroke=";
  EXPECT_EQ(count_of(plots[0].svg, curve), 1u);
  EXPECT_EQ(count_of(plots[1].svg, curve), 2u);
  EXPECT_THAT(plots[0].svg, Not(HasSubstr(" by sun.elevation_deg")));
  EXPECT_THAT(plots[1].svg, HasSubstr(" by sun.elevation_deg"));
}

TEST(StudyPlots, PanelsShareTheirYWhereThatShowsThem) {
  const auto plot_of = [](double step) {
    StudyTable table;
    table.axes = {words("w", {}), numbers("a", "", {}), numbers("b", "", {})};
    table.crossed_sizes = {2, 2, 3};
    table.quantities = {numbers("q", "", {})};
    for (const char* word : {"u", "v"}) {
      for (const double a : {0.0, 1.0}) {
        for (const double b : {0.0, 1.0, 2.0}) {
          table.axes[0].words.emplace_back(word);
          table.axes[1].values.push_back(a);
          table.axes[2].values.push_back(b);
          table.quantities[0].values.push_back(100 + 100 * a + step * b);
          table.errors.emplace_back();
          table.pictures.emplace_back();
        }
      }
    }
    WantedQuantities wanted;
    wanted.plots = {{"b", "q", "w", {}, ""}};
    return study_plots(table, wanted).at(0).svg;
  };
  // A tick at 200 stands in both panels, or in the one whose range holds it.
  EXPECT_EQ(count_of(plot_of(40), ">200</text>"), 2u);
  EXPECT_EQ(count_of(plot_of(1), ">200</text>"), 1u);
  EXPECT_EQ(count_of(plot_of(1), ">201</text>"), 1u);
}

TEST(SvgPlot, LinesBreakWherePointsAreMissing) {
  const std::string svg = svg_plot(
      "",
      {{"", {.label = "x"}, {.label = "y"}, {{.label = "", .points = {{0, 1}, {1, NAN}, {2, 2}}}}}},
      1);
  EXPECT_FALSE(std::regex_search(svg, std::regex("d=\"M[0-9. ]+L[0-9. ]+\" fill")));
}

}  // namespace
}  // namespace twilight
