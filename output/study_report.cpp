#include "output/study_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "output/atomic_file.h"
#include "output/study_plots.h"
#include "output/xml_text.h"

namespace twilight {
namespace {

constexpr const char* kStyle = R"(
body { font-family: sans-serif; margin: 1.5em; color: #222; background: #fff; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.85em; }
th, td { padding: 3px 6px; text-align: center; vertical-align: middle; }
th { font-weight: normal; color: #555; white-space: nowrap; }
thead th { position: sticky; top: 0; background: #fff; }
.pictures th { position: sticky; left: 0; background: #fff; }
.pictures img { display: block; max-height: 160px; background: #000; }
.list td, .list th { border-bottom: 1px solid #ddd; text-align: left; vertical-align: top; }
.failed, .failed a { color: #b00020; }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(420px, 1fr)); gap: 12px; }
.plots img { width: 100%; border: 1px solid #ddd; }
.flow { display: flex; flex-wrap: wrap; gap: 12px; }
figure { margin: 0; max-width: 240px; font-size: 0.8em; }
)";

std::string axis_values(const StudyTable& table, std::size_t row) {
  std::string text;
  for (const StudyColumn& axis : table.axes) {
    text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", axis.name, text_of(axis, row));
  }
  return text;
}

/// The page while it is written.
class Page {
 public:
  Page(const StudyTable& table, const std::vector<StudyPlot>& plots)
      : table_(table), plots_(plots) {}

  std::string html() {
    head();
    axes();
    pictures();
    plots();
    failures();
    return std::move(out_) + "</body>\n</html>\n";
  }

 private:
  bool crossed() const {
    std::size_t cases = 1;
    for (const std::size_t n : table_.crossed_sizes) cases *= n;
    return !table_.crossed_sizes.empty() && table_.crossed_sizes.size() == table_.axes.size() &&
           cases == table_.cases();
  }
  void head();
  void axes();
  void pictures();
  void picture_grid();
  std::string picture(std::size_t row) const;
  void plots();
  void failures();

  const StudyTable& table_;
  const std::vector<StudyPlot>& plots_;
  std::string out_;
};

void Page::head() {
  const std::string title = xml_escaped(table_.title.empty() ? "Study" : table_.title);
  const auto failed =
      std::ranges::count_if(table_.errors, [](const auto& e) { return !e.empty(); });
  out_ += fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta "
      "name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<title>{0}</title>\n<style>{1}</style>\n</head>\n<body>\n<h1>{0}</h1>\n"
      "<p>{2} {3}, {4}. Numbers: <a href=\"study.nc\">study.nc</a> (netCDF), <a "
      "href=\"study.csv\">study.csv</a>.</p>\n",
      title, kStyle, table_.cases(), table_.cases() == 1 ? "case" : "cases",
      failed == 0 ? "all done"
                  : fmt::format("<a class=\"failed\" href=\"#failed\">{} failed</a>", failed));
}

void Page::axes() {
  if (table_.axes.empty()) return;
  constexpr std::size_t kMost = 16;
  out_ += "<h2>Axes</h2>\n<table class=\"list\">\n";
  for (const StudyColumn& axis : table_.axes) {
    std::vector<std::string> values;
    for (std::size_t k = 0; k < table_.cases(); ++k) {
      std::string text = text_of(axis, k);
      if (std::ranges::find(values, text) == values.end()) values.push_back(std::move(text));
      if (values.size() > kMost) break;
    }
    std::string shown;
    for (std::size_t k = 0; k < std::min(values.size(), kMost); ++k) {
      shown += (k == 0 ? "" : ", ") + xml_escaped(values[k]);
    }
    if (values.size() > kMost) shown += ", &#8230;";
    out_ += fmt::format("<tr><th>{}</th><td>{}</td><td>{}</td></tr>\n", xml_escaped(axis.name),
                        xml_escaped(axis.unit), shown);
  }
  out_ += "</table>\n";
}

std::string Page::picture(std::size_t row) const {
  if (!table_.errors[row].empty()) {
    return fmt::format("<a class=\"failed\" href=\"#case-{}\">failed</a>", row);
  }
  if (table_.pictures.empty() || table_.pictures[row].empty()) return "&#8211;";
  const std::string about = xml_escaped(axis_values(table_, row));
  return fmt::format(
      "<a href=\"{0}\"><img src=\"{0}\" alt=\"{1}\" title=\"{1}\" loading=\"lazy\"/></a>",
      url_of_path(table_.pictures[row]), about);
}

// The last axis across, the others down.
void Page::picture_grid() {
  const std::size_t axes = table_.axes.size();
  const std::size_t across = axes == 0 ? 1 : table_.crossed_sizes.back();
  out_ += "<div class=\"wide\"><table class=\"pictures\">\n<thead>\n";
  if (axes > 0) {
    out_ += "<tr>";
    for (std::size_t a = 0; a + 1 < axes; ++a) out_ += "<th></th>";
    out_ += fmt::format("<th colspan=\"{}\">{}</th></tr>\n<tr>", across,
                        xml_escaped(table_.axes.back().name));
    for (std::size_t a = 0; a + 1 < axes; ++a) {
      out_ += fmt::format("<th>{}</th>", xml_escaped(table_.axes[a].name));
    }
    for (std::size_t c = 0; c < across; ++c) {
      out_ += fmt::format("<th>{}</th>", xml_escaped(text_of(table_.axes.back(), c)));
    }
    out_ += "</tr>\n";
  }
  out_ += "</thead>\n<tbody>\n";
  for (std::size_t first = 0; first < table_.cases(); first += across) {
    out_ += "<tr>";
    for (std::size_t a = 0; a + 1 < axes; ++a) {
      out_ += fmt::format("<th>{}</th>", xml_escaped(text_of(table_.axes[a], first)));
    }
    for (std::size_t c = 0; c < across; ++c) out_ += "<td>" + picture(first + c) + "</td>";
    out_ += "</tr>\n";
  }
  out_ += "</tbody>\n</table></div>\n";
}

void Page::pictures() {
  const bool any = std::ranges::any_of(table_.pictures, [](const auto& p) { return !p.empty(); });
  if (!any) return;
  out_ += "<h2>Skies</h2>\n<p>Each has an exposure of its own.</p>\n";
  if (crossed() || table_.axes.empty()) return picture_grid();
  out_ += "<div class=\"flow\">\n";
  for (std::size_t k = 0; k < table_.cases(); ++k) {
    out_ += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", picture(k),
                        xml_escaped(axis_values(table_, k)));
  }
  out_ += "</div>\n";
}

void Page::plots() {
  if (plots_.empty()) return;
  out_ += "<h2>Plots</h2>\n<div class=\"plots\">\n";
  for (const StudyPlot& plot : plots_) {
    out_ += fmt::format(
        "<a href=\"plots/{0}.svg\"><img src=\"plots/{0}.svg\" alt=\"{1} against {2}\" "
        "loading=\"lazy\"/></a>\n",
        url_of_path(plot.name), xml_escaped(plot.y), xml_escaped(plot.x));
  }
  out_ += "</div>\n";
}

void Page::failures() {
  if (std::ranges::all_of(table_.errors, [](const auto& e) { return e.empty(); })) return;
  out_ += "<h2 id=\"failed\">Failed cases</h2>\n<table class=\"list\">\n<thead><tr><th>case</th>";
  for (const StudyColumn& axis : table_.axes) {
    out_ += fmt::format("<th>{}</th>", xml_escaped(axis.name));
  }
  out_ += "<th>error</th></tr></thead>\n<tbody>\n";
  for (std::size_t k = 0; k < table_.cases(); ++k) {
    if (table_.errors[k].empty()) continue;
    out_ += fmt::format("<tr id=\"case-{0}\"><td>{0}</td>", k);
    for (const StudyColumn& axis : table_.axes) {
      out_ += fmt::format("<td>{}</td>", xml_escaped(text_of(axis, k)));
    }
    out_ += fmt::format("<td class=\"failed\">{}</td></tr>\n", xml_escaped(table_.errors[k]));
  }
  out_ += "</tbody>\n</table>\n";
}

}  // namespace

std::vector<std::string> write_study_report(const std::filesystem::path& directory,
                                            const StudyTable& table,
                                            const WantedQuantities& wanted) {
  const std::vector<StudyPlot> plots = study_plots(table, wanted);
  std::vector<std::string> written;
  if (!plots.empty()) std::filesystem::create_directories(directory / "plots");
  for (const StudyPlot& plot : plots) {
    written.push_back("plots/" + plot.name + ".svg");
    write_text_file(directory / written.back(), plot.svg);
  }
  written.emplace_back("index.html");
  write_text_file(directory / written.back(), Page(table, plots).html());
  return written;
}

}  // namespace twilight
