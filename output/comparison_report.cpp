#include "output/comparison_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <string_view>

#include "output/atomic_file.h"
#include "output/false_colour.h"
#include "output/png_file.h"
#include "output/preview.h"

namespace twilight {
namespace {

namespace fs = std::filesystem;

constexpr Rgb8 kGrey = {200, 200, 200};

std::size_t contenders_of(const Comparison& comparison) {
  return comparison.plan.contenders.size();
}

std::string sun_text(const ComparisonRow& row) {
  return row.sun_elevation_deg ? fmt::format("{:g}", *row.sun_elevation_deg) : "";
}

// Contenders side by side as one X, Y, Z image without a projection, so that they share an
// exposure.
SkyImage side_by_side(const Comparison& comparison, std::size_t first_row) {
  const int size = comparison.plan.options.picture_size;
  const auto n = static_cast<std::size_t>(size), count = contenders_of(comparison);
  SkyImage strip{size * static_cast<int>(count), size, {"X", "Y", "Z"}, {}, std::nullopt};
  strip.pixels.assign(3 * n * n * count, 0.0F);
  for (std::size_t c = 0; c < count; ++c) {
    const SkyImage& one = comparison.rows[first_row + c].picture;
    if (one.pixels.empty()) continue;
    for (std::size_t y = 0; y < n; ++y) {
      std::copy_n(&one.pixels[3 * n * y], 3 * n, &strip.pixels[3 * (y * n * count + c * n)]);
    }
  }
  return strip;
}

std::string base64(const std::vector<std::uint8_t>& bytes) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8 | (k < left ? static_cast<std::uint32_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= left ? kLetters[group >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

std::string xml_text(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : std::string(1, c);
  }
  return out;
}

// The scale of the error maps: ratios 1/full .. full.
std::string legend(double x, double y, double width) {
  constexpr int kSteps = 60;
  std::string svg;
  for (int i = 0; i < kSteps; ++i) {
    const Rgb8 c = diverging_colour(2.0 * (i + 0.5) / kSteps - 1);
    svg += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{}\" width=\"{:.1f}\" height=\"10\" "
        "fill=\"#{:02x}{:02x}{:02x}\"/>",
        x + width * i / kSteps, y, width / kSteps + 0.5, c[0], c[1], c[2]);
  }
  const std::pair<double, std::string> ticks[] = {{0.0, fmt::format("1/{:g}", kFullErrorRatio)},
                                                  {0.25, "1/2"},
                                                  {0.5, "1"},
                                                  {0.75, "2"},
                                                  {1.0, fmt::format("{:g}", kFullErrorRatio)}};
  for (const auto& [at, text] : ticks) {
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
                       x + at * width, y + 24, text);
  }
  return svg + fmt::format("<text x=\"{:.1f}\" y=\"{}\">luminance over that of {}</text>",
                           x + width + 24, y + 9, "the first");
}

// A label's settings stand under one another, the last one at `bottom`.
std::string caption(std::string_view label, int x, int bottom) {
  constexpr int kLine = 11;
  std::vector<std::string> lines(1);
  for (const char c : label) {
    lines.back() += c;
    if (c == ',') lines.emplace_back();
  }
  std::string svg;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    svg +=
        fmt::format("<text x=\"{}\" y=\"{}\" font-size=\"{}\" text-anchor=\"middle\">{}</text>\n",
                    x, bottom - kLine * static_cast<int>(lines.size() - 1 - i), i == 0 ? 12 : 9,
                    xml_text(lines[i]));
  }
  return svg;
}

std::string sheet(const Comparison& comparison, const std::vector<ComparisonPicture>& pictures) {
  const std::size_t count = contenders_of(comparison);
  const int size = comparison.plan.options.picture_size, left = 60, top = 76, gap = 8;
  const int width = left + size * static_cast<int>(count) + 20;
  const int row_height = 2 * size + gap;
  const int height = top + row_height * static_cast<int>(pictures.size()) + 10;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" "
      "width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" "
      "font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      std::max(width, 480), height);
  svg += legend(left + 10, 12, 200) + "\n";
  for (std::size_t c = 0; c < count; ++c) {
    svg += caption(comparison.plan.contenders[c].label,
                   left + size * static_cast<int>(c) + size / 2, top - 8);
  }
  for (std::size_t s = 0; s < pictures.size(); ++s) {
    const ComparisonPicture& p = pictures[s];
    const int y = top + row_height * static_cast<int>(s);
    svg += fmt::format("<text x=\"6\" y=\"{}\">{}&#176;</text>\n", y + size / 2,
                       sun_text(comparison.rows[s * count]));
    svg += fmt::format(
        "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" "
        "xlink:href=\"data:image/png;base64,{}\"/>\n",
        left, y, p.width, p.height, base64(png_of(p.width, p.height, p.rgb)));
    for (std::size_t c = 0; c < count; ++c) {
      if (comparison.rows[s * count + c].undefined.empty()) continue;
      svg += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">undefined</text>\n",
                         left + size * static_cast<int>(c) + size / 2, y + size / 2);
    }
  }
  return svg + "</svg>\n";
}

}  // namespace

CsvTable comparison_table(const Comparison& comparison) {
  CsvTable table({"sun_elevation_deg", "sky", "undefined", "clamped", "radiance_rmse_w_m2_sr_nm",
                  "radiance_mean_relative_error", "radiance_max_relative_error",
                  "luminance_rmse_cd_m2", "luminance_mean_relative_error",
                  "luminance_max_relative_error", "luminance_bias", "zenith_luminance_ratio",
                  "chromaticity_mean_duv", "chromaticity_max_duv", "setup_seconds",
                  "view_seconds"});
  table.add_comment(fmt::format("differences from {}", comparison.plan.contenders[0].label));
  const auto cell = [](const std::optional<double>& value) {
    return value ? CsvTable::Cell(*value) : CsvTable::Cell("");
  };
  const ComparisonRow* reference = nullptr;
  for (const ComparisonRow& row : comparison.rows) {
    if (row.contender == 0) reference = &row;
    const bool known = row.undefined.empty() && reference->undefined.empty();
    const auto figure = [&](double value) {
      return known ? CsvTable::Cell(value) : CsvTable::Cell("");
    };
    std::string clamps;
    for (const auto& [key, what] : row.clamps)
      clamps += (clamps.empty() ? "" : "; ") + key + " " + what;
    const SkyErrors& e = row.errors;
    table.add_row({cell(row.sun_elevation_deg), comparison.plan.contenders[row.contender].label,
                   row.undefined, clamps, cell(e.radiance_rmse), cell(e.radiance_mean_relative),
                   cell(e.radiance_max_relative), figure(e.luminance_rmse_cd_m2),
                   figure(e.luminance_mean_relative), figure(e.luminance_max_relative),
                   figure(e.luminance_bias), cell(e.zenith_luminance_ratio),
                   figure(e.chromaticity_mean), figure(e.chromaticity_max), row.setup_seconds,
                   row.view_seconds});
  }
  return table;
}

std::string comparison_markdown(const Comparison& comparison) {
  const std::size_t count = contenders_of(comparison), suns = comparison.rows.size() / count;
  std::string header = "| luminance: mean error %, zenith ratio | seconds per Sun |",
              rule = "|---|---|";
  for (std::size_t s = 0; s < suns; ++s) {
    header += fmt::format(" {}° |", sun_text(comparison.rows[s * count]));
    rule += "---|";
  }
  std::string text = header + "\n" + rule + "\n";
  for (std::size_t c = 0; c < count; ++c) {
    double seconds = 0;
    std::string cells;
    int defined = 0;
    for (std::size_t s = 0; s < suns; ++s) {
      const ComparisonRow& row = comparison.rows[s * count + c];
      const bool known = row.undefined.empty() && comparison.rows[s * count].undefined.empty();
      if (row.undefined.empty()) ++defined;
      seconds += row.setup_seconds + row.view_seconds;
      if (!known) {
        cells += " – |";
        continue;
      }
      cells += fmt::format(" {}{} |", c == 0 ? "0" : percent(row.errors.luminance_mean_relative),
                           row.errors.zenith_luminance_ratio
                               ? fmt::format(", {:.2f}", *row.errors.zenith_luminance_ratio)
                               : "");
    }
    text += fmt::format("| {} | {:.2g} |{}\n", comparison.plan.contenders[c].label,
                        defined > 0 ? seconds / defined : 0.0, cells);
  }
  return text;
}

ComparisonPicture comparison_picture(const Comparison& comparison, std::size_t first_row) {
  const SkyImage strip = side_by_side(comparison, first_row);
  const auto n = static_cast<std::size_t>(strip.height), count = contenders_of(comparison);
  const std::size_t width = n * count;
  ComparisonPicture picture{strip.width, 2 * strip.height, tone_map(strip)};
  picture.rgb.resize(2 * picture.rgb.size(), 255);
  for (std::size_t c = 0; c < count; ++c) {
    const bool known = !comparison.rows[first_row + c].picture.pixels.empty();
    for (std::size_t y = 0; y < n; ++y) {
      for (std::size_t x = 0; x < n; ++x) {
        const bool sky = direction_of_pixel(Projection::kFisheye, strip.height, static_cast<int>(x),
                                            static_cast<int>(y))
                             .has_value();
        const std::size_t at = y * width + c * n + x, below = (n + y) * width + c * n + x;
        if (!sky || !known) {
          if (!known && sky) std::ranges::copy(kGrey, &picture.rgb[3 * at]);
          if (sky) std::ranges::copy(kGrey, &picture.rgb[3 * below]);
          continue;
        }
        const auto here = static_cast<double>(strip.pixels[3 * at + 1]);
        const auto first = static_cast<double>(strip.pixels[3 * (y * width + x) + 1]);
        // Dark, or outside an image's frame.
        const double ratio =
            first > 0 && here > 0 ? here / first : std::numeric_limits<double>::quiet_NaN();
        std::ranges::copy(ratio_colour(ratio, kFullErrorRatio), &picture.rgb[3 * below]);
      }
    }
  }
  return picture;
}

std::vector<std::string> write_comparison(const Comparison& comparison) {
  const fs::path& directory = comparison.plan.options.directory;
  fs::create_directories(directory);
  std::vector<std::string> names = {"comparison.csv"};
  comparison_table(comparison).write(directory / names.back(), std::cout);
  std::vector<ComparisonPicture> pictures;
  for (std::size_t r = 0; r < comparison.rows.size(); r += contenders_of(comparison)) {
    const auto& sun = comparison.rows[r].sun_elevation_deg;
    pictures.push_back(comparison_picture(comparison, r));
    names.push_back(sun ? fmt::format("sun_{:+05.1f}.png", *sun) : "images.png");
    AtomicFile file(directory / names.back());
    write_png(file, pictures.back().width, pictures.back().height, pictures.back().rgb);
    file.commit();
  }
  names.emplace_back("comparison.svg");
  write_text_file(directory / names.back(), sheet(comparison, pictures));
  return names;
}

}  // namespace twilight
