#include "output/measurement.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <stdexcept>

#include "output/colour_matching.h"
#include "output/csv_reader.h"
#include "output/photograph.h"
#include "output/scene_map.h"
#include "output/ubvri.h"
#include "solar/sun_position.h"
#include "solar/time_point.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kSmallest = 1e-300, kLargest = 1e300;

/// Suns and views of rows, each kept once.
class Directions {
 public:
  Directions(Measurement& measured, const Scene& scene) : measured_(measured), scene_(scene) {}

  std::size_t sun(const CsvFile& csv, std::size_t row) {
    const auto elevation = csv.column("sun_elevation_deg"), time = csv.column("time");
    const auto azimuth = csv.column("sun_azimuth_deg");
    std::string text = elevation ? csv.text(row, *elevation) : time ? csv.text(row, *time) : "";
    if (elevation && azimuth) text += "," + csv.text(row, *azimuth);
    const auto [it, fresh] = suns_.try_emplace(text, measured_.suns.size());
    if (!fresh) return it->second;
    if (elevation) {
      MeasuredSun sun = sun_of(scene_);
      sun.elevation_rad = kRadPerDeg * csv.number(row, *elevation, -90.0, 90.0);
      if (azimuth) sun.azimuth_rad = kRadPerDeg * csv.number(row, *azimuth, -360.0, 360.0);
      measured_.suns.push_back(sun);
    } else if (time) {
      try {
        measured_.suns.push_back(sun_at(scene_, text));
      } catch (const std::invalid_argument& error) {
        csv.refuse(row, *time, error.what());
      }
    } else {
      measured_.suns.push_back(sun_of(scene_));
    }
    return it->second;
  }
  std::size_t view(const ViewDirection& direction) {
    const auto [it, fresh] = views_.try_emplace(
        std::pair(direction.elevation_rad, direction.relative_azimuth_rad), measured_.views.size());
    if (fresh) measured_.views.push_back(direction);
    return it->second;
  }

 private:
  Measurement& measured_;
  const Scene& scene_;
  std::map<std::string, std::size_t> suns_;
  std::map<std::pair<double, double>, std::size_t> views_;
};

// A row's error in the unit of its value.
double error_of(const CsvFile& csv, std::size_t row, double value, bool magnitudes,
                std::optional<double> relative_error) {
  const auto column = csv.column("standard_error");
  if (column && !(csv.text(row, *column).empty() && relative_error)) {
    const double error = csv.number(row, *column, 0.0, kLargest);
    if (!(error > 0)) csv.refuse(row, *column, "must be above 0");
    return error;
  }
  if (!relative_error) {
    throw std::invalid_argument(fmt::format(
        "line {}: has no error: must have a column 'standard_error', or relative_error be given",
        csv.line(row)));
  }
  // d(-2.5 log10 L) = -1.0857 dL / L.
  return magnitudes ? 2.5 / std::numbers::ln10 * *relative_error : *relative_error * value;
}

SpectralResponse luminance_response() {
  SpectralResponse response{"luminance", std::nullopt, {}, {}};
  for (int nm = kFirstObserverWavelength_nm; nm <= kLastObserverWavelength_nm; ++nm) {
    response.sensitivity_nm.push_back(nm);
    response.sensitivity.push_back(683.0 * colour_matching(ColourObserver::kCie1931, nm)[1]);
  }
  return response;
}

// Two columns for one thing would leave one unread without a word.
void refuse_both(const CsvFile& csv, std::string_view one, std::string_view other) {
  if (csv.column(one) && csv.column(other)) {
    throw std::invalid_argument(
        fmt::format("columns '{}' and '{}' are both there: must be one", one, other));
  }
}

void read_radiances(const CsvFile& csv, const Scene& scene, std::optional<double> relative_error,
                    Measurement& measured) {
  refuse_both(csv, "relative_azimuth_deg", "azimuth_deg");
  refuse_both(csv, "sun_elevation_deg", "time");
  if (csv.column("azimuth_deg") && csv.column("sun_elevation_deg")) csv.required("sun_azimuth_deg");
  Directions directions(measured, scene);
  const std::size_t elevation = csv.required("view_elevation_deg");
  const auto relative = csv.column("relative_azimuth_deg"), azimuth = csv.column("azimuth_deg");
  if (!relative && !azimuth) csv.required("relative_azimuth_deg");
  const std::size_t wavelength = csv.required("wavelength_nm");
  const std::size_t radiance = csv.required("radiance_w_m2_sr_nm");
  std::map<double, std::size_t> responses;
  for (std::size_t row = 0; row < csv.rows(); ++row) {
    MeasuredValue value;
    value.line = csv.line(row);
    value.sun = directions.sun(csv, row);
    ViewDirection view;
    view.elevation_rad = kRadPerDeg * csv.number(row, elevation, -90.0, 90.0);
    view.relative_azimuth_rad = relative ? kRadPerDeg * csv.number(row, *relative, -360.0, 360.0)
                                         : kRadPerDeg * csv.number(row, *azimuth, -360.0, 360.0) -
                                               measured.suns[value.sun].azimuth_rad;
    value.views = {{directions.view(view), 1.0}};
    const double nm = csv.number(row, wavelength, 280.0, 1000.0);
    const auto [it, fresh] = responses.try_emplace(nm, measured.responses.size());
    if (fresh) measured.responses.push_back({fmt::format("{:g} nm", nm), nm, {}, {}});
    value.response = it->second;
    value.value = csv.number(row, radiance, kSmallest, kLargest);
    value.standard_error = error_of(csv, row, value.value, false, relative_error);
    measured.values.push_back(std::move(value));
  }
}

void read_zenith_curve(const CsvFile& csv, const Scene& scene, std::optional<double> relative_error,
                       Measurement& measured) {
  refuse_both(csv, "luminance_cd_m2", "magnitude_per_arcsec2");
  refuse_both(csv, "sun_elevation_deg", "time");
  Directions directions(measured, scene);
  const auto luminance = csv.column("luminance_cd_m2");
  const std::size_t column = luminance ? *luminance : csv.required("magnitude_per_arcsec2");
  measured.kind = MeasuredKind::kZenithCurve;
  measured.magnitudes = !luminance;
  const auto band = csv.column("magnitude_band");
  std::map<std::string, std::size_t> responses;
  if (luminance) measured.responses = {luminance_response()};
  measured.views = {{std::numbers::pi / 2, 0.0}};
  for (std::size_t row = 0; row < csv.rows(); ++row) {
    MeasuredValue value;
    value.line = csv.line(row);
    value.sun = directions.sun(csv, row);
    value.views = {{0, 1.0}};
    if (!luminance) {
      const std::string name = band ? csv.text(row, *band) : "V";
      const auto known = std::ranges::find(kUbvriBands, name);
      if (known == kUbvriBands.end()) csv.refuse(row, *band, "must be U, B, V, R or I");
      const auto [it, fresh] = responses.try_emplace(name, measured.responses.size());
      if (fresh) {
        measured.responses.push_back(
            band_response(static_cast<std::size_t>(known - kUbvriBands.begin())));
      }
      value.response = it->second;
    }
    value.value = luminance ? csv.number(row, column, kSmallest, kLargest)
                            : csv.number(row, column, -30.0, 30.0);
    value.standard_error = error_of(csv, row, value.value, measured.magnitudes, relative_error);
    measured.values.push_back(std::move(value));
  }
}

Measurement read_csv(const std::filesystem::path& file, const Scene& scene,
                     std::optional<double> relative_error, std::optional<MeasuredKind> kind) {
  const CsvFile csv(file);
  Measurement measured;
  measured.file = file;
  const bool zenith = csv.column("luminance_cd_m2") || csv.column("magnitude_per_arcsec2");
  try {
    if (kind.value_or(zenith ? MeasuredKind::kZenithCurve : MeasuredKind::kRadiances) ==
        MeasuredKind::kZenithCurve) {
      read_zenith_curve(csv, scene, relative_error, measured);
    } else {
      read_radiances(csv, scene, relative_error, measured);
    }
  } catch (const std::invalid_argument& error) {
    const std::string what = error.what();
    if (what.starts_with(file.string())) throw;
    throw std::invalid_argument(fmt::format("{}: {}", file.string(), what));
  }
  if (measured.values.empty()) {
    throw std::invalid_argument(fmt::format("{}: holds no data", file.string()));
  }
  return measured;
}

Measurement read_toml(const std::filesystem::path& file, const Scene& scene,
                      std::optional<double> relative_error) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) {
    throw std::runtime_error(fmt::format("{}: cannot read this file", file.string()));
  }
  toml::table root;
  try {
    root = toml::parse(stream, file.string());
  } catch (const toml::parse_error& error) {
    throw std::invalid_argument(fmt::format("{}:{}: not valid TOML: {}", file.string(),
                                            error.source().begin.line, error.description()));
  }
  const std::string kind = root["kind"].value_or(std::string());
  if (kind == "photograph") return read_photograph(file, scene, relative_error);
  const auto line = [&](std::string_view key) {
    const toml::node* node = root.get(key);
    return fmt::format("{}:{}", file.string(), node != nullptr ? node->source().begin.line : 1);
  };
  if (kind != "radiances" && kind != "zenith_curve") {
    throw std::invalid_argument(
        fmt::format("{}: key 'kind' = \"{}\": must be \"radiances\", \"zenith_curve\" or "
                    "\"photograph\"",
                    line("kind"), kind));
  }
  for (const auto& [name, node] : root) {
    if (name == "kind" || name == "file" || name == "relative_error") continue;
    throw std::invalid_argument(
        fmt::format("{}: key '{}' is unknown: must be kind, file or relative_error",
                    line(name.str()), name.str()));
  }
  const auto named = root["file"].value<std::string>();
  if (!named || named->empty()) {
    throw std::invalid_argument(fmt::format("{}: must have a key 'file'", line("file")));
  }
  if (root.contains("relative_error")) {
    const auto own =
        root["relative_error"].is_number() ? root["relative_error"].value<double>() : std::nullopt;
    if (!own || !(*own > 0 && *own <= 10)) {
      throw std::invalid_argument(fmt::format(
          "{}: key 'relative_error': must be a number above 0, to 10", line("relative_error")));
    }
    if (!relative_error) relative_error = own;
  }
  return read_csv(file.parent_path() / *named, scene, relative_error,
                  kind == "radiances" ? MeasuredKind::kRadiances : MeasuredKind::kZenithCurve);
}

}  // namespace

SpectralResponse band_response(std::size_t band) {
  SpectralResponse response{
      std::string(kUbvriBands.at(band)), std::nullopt, {}, {}, kUbvriCoverage};
  const auto [first, last] = ubvri_range_nm(band);
  double whole = 0;
  for (double nm = first; nm <= last; ++nm) {
    response.sensitivity_nm.push_back(nm);
    response.sensitivity.push_back(ubvri_response(band, nm));
    whole += response.sensitivity.back();
  }
  for (double& s : response.sensitivity)
    s *= kSquareArcsecond_sr / (whole * ubvri_zero_w_m2_nm(band));
  return response;
}

MeasuredSun sun_at(const Scene& scene, const std::string& time) {
  const std::optional<Place> place = place_of(scene);
  if (!place) {
    throw std::invalid_argument("must come with a scene that has a place (observer.latitude_deg)");
  }
  const SunPosition sun = sun_position(*place, parse_offset_date_time(time));
  return {sun.elevation_deg * kRadPerDeg, sun.azimuth_deg * kRadPerDeg, sun.distance_au};
}

MeasuredSun sun_of(const Scene& scene) {
  if (scene.observer.time) return sun_at(scene, *scene.observer.time);
  return {*scene.sun.elevation_deg * kRadPerDeg, scene.sun.azimuth_deg * kRadPerDeg, 1.0};
}

std::vector<SpectralResponse> read_sensitivities(const std::filesystem::path& file) {
  const CsvFile csv(file);
  const std::size_t wavelength = csv.required("wavelength_nm");
  std::vector<SpectralResponse> responses;
  for (std::size_t column = 0; column < csv.columns().size(); ++column) {
    if (column == wavelength) continue;
    SpectralResponse response{csv.columns()[column], std::nullopt, {}, {}};
    for (std::size_t row = 0; row < csv.rows(); ++row) {
      const double nm = csv.number(row, wavelength, 100.0, 10000.0);
      if (row > 0 && !(nm > response.sensitivity_nm.back())) {
        csv.refuse(row, wavelength, "must be above the one before");
      }
      response.sensitivity_nm.push_back(nm);
      response.sensitivity.push_back(csv.number(row, column, -1e12, 1e12));
    }
    responses.push_back(std::move(response));
  }
  if (responses.empty() || csv.rows() < 2) {
    throw std::invalid_argument(fmt::format(
        "{}: must have a column per channel beside wavelength_nm, and two rows at least",
        file.string()));
  }
  return responses;
}

Measurement read_measurement(const std::filesystem::path& file, const Scene& scene,
                             std::optional<double> relative_error) {
  if (file.extension() == ".toml") return read_toml(file, scene, relative_error);
  return read_csv(file, scene, relative_error, std::nullopt);
}

}  // namespace twilight
