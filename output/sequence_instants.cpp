#include "output/sequence_instants.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "solar/time_point.h"

namespace twilight {
namespace {

std::optional<double> number_of(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

double elevation_of(const char* option, const std::string& text) {
  const std::optional<double> value = number_of(text);
  if (value && *value >= -90.0 && *value <= 90.0) return *value;
  throw std::invalid_argument(
      fmt::format("{} {}: must be an elevation of the Sun in -90..90 degrees, as the scene names "
                  "no place (observer.latitude_deg, longitude_deg and time)",
                  option, text));
}

UtcTime time_of(const char* option, const std::string& text) {
  if (number_of(text)) {
    throw std::invalid_argument(
        fmt::format("{} {}: must be a time with offset, as 2003-12-08T17:00:00+01:00: the scene "
                    "names a place; elevations of the Sun go with sun.elevation_deg",
                    option, text));
  }
  try {
    return parse_offset_date_time(text);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(fmt::format("{}: {}", option, error.what()));
  }
}

// To the millisecond, which is left out where it is none.
std::string time_text(const UtcTime& time, int offset_minutes) {
  std::string text = format_offset_date_time(time, offset_minutes, 3);
  const std::size_t fraction = text.find(".000");
  if (fraction != std::string::npos) text.erase(fraction, 4);
  return text;
}

[[noreturn]] void complain_of_equal_ends(const std::string& from, const std::string& to) {
  throw std::invalid_argument(
      fmt::format("--to {}: must differ from --from {}; twilight render makes one sky", to, from));
}

}  // namespace

std::vector<Scene> sequence_scenes(const Scene& scene, const std::string& from,
                                   const std::string& to, int frames) {
  if (frames < kFewestFrames || frames > kMostFrames) {
    throw std::invalid_argument(
        fmt::format("--frames {}: must be in {}..{}", frames, kFewestFrames, kMostFrames));
  }
  std::vector<Scene> scenes(static_cast<std::size_t>(frames), scene);
  const auto share = [&](std::size_t k) {
    return static_cast<double>(k) / static_cast<double>(frames - 1);
  };
  if (scene.observer.time) {
    const UtcTime first = time_of("--from", from), last = time_of("--to", to);
    const int offset_minutes = parse_utc_offset_minutes(from);
    const double days = days_between(first, last);
    if (days == 0.0) complain_of_equal_ends(from, to);
    for (std::size_t k = 0; k < scenes.size(); ++k) {
      scenes[k].observer.time = time_text(add_days(first, share(k) * days), offset_minutes);
    }
    return scenes;
  }
  const double first = elevation_of("--from", from), last = elevation_of("--to", to);
  if (first == last) complain_of_equal_ends(from, to);
  for (std::size_t k = 0; k < scenes.size(); ++k) {
    scenes[k].sun.elevation_deg = std::lerp(first, last, share(k));
  }
  return scenes;
}

}  // namespace twilight
