#include "sim/models/preetham_sky.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "sim/models/preetham_sun_position.h"
#include "sim/models/preetham_sunlight.h"
#include "sim/models/turbidity.h"

namespace twilight {
namespace {

using std::numbers::pi;

constexpr double kFirstDaylightNm = 380.0, kLastDaylightNm = 780.0;

// Rows: theta^3, theta^2, theta, 1 of the Sun's zenith angle, for T^2, T and 1.
using ZenithTable = double[3][4];
constexpr ZenithTable kZenithX = {{0.0017, -0.0037, 0.0021, 0.000},
                                  {-0.0290, 0.0638, -0.0320, 0.0039},
                                  {0.1169, -0.2120, 0.0605, 0.2589}};
constexpr ZenithTable kZenithY = {{0.0028, -0.0061, 0.0032, 0.000},
                                  {-0.0421, 0.0897, -0.0415, 0.0052},
                                  {0.1535, -0.2676, 0.0667, 0.2669}};

double zenith_chromaticity(const ZenithTable& table, double turbidity, double theta) {
  double sum = 0;
  for (const auto& row : table) {
    const double of_sun = ((row[0] * theta + row[1]) * theta + row[2]) * theta + row[3];
    sum = sum * turbidity + of_sun;
  }
  return sum;
}

// With preetham.sun_position = "preetham" the Sun stands as high as their appendix says; views are
// relative to its azimuth as they are.
SceneModel with_its_sun(const SceneModel& model) {
  SceneModel own = model;
  const ObserverOptions& observer = model.scene.observer;
  if (model.scene.preetham.sun_position == "preetham" && observer.time) {
    own.sun_elevation_rad = pi / 2 - preetham_sun_position(*observer.latitude_deg,
                                                           *observer.longitude_deg, *observer.time)
                                         .zenith_angle_rad;
  }
  return own;
}

}  // namespace

PreethamDistribution preetham_distribution(double turbidity) {
  const double t = turbidity;
  return {{0.1787 * t - 1.4630, -0.3554 * t + 0.4275, -0.0227 * t + 5.3251, 0.1206 * t - 2.5771,
           -0.0670 * t + 0.3703},
          {-0.0193 * t - 0.2592, -0.0665 * t + 0.0008, -0.0004 * t + 0.2125, -0.0641 * t - 0.8989,
           -0.0033 * t + 0.0452},
          {-0.0167 * t - 0.2608, -0.0950 * t + 0.0092, -0.0079 * t + 0.2102, -0.0441 * t - 1.6537,
           -0.0109 * t + 0.0529}};
}

PreethamZenith preetham_zenith(double turbidity, double sun_zenith_angle_rad) {
  const double chi = (4.0 / 9.0 - turbidity / 120.0) * (pi - 2 * sun_zenith_angle_rad);
  return {1e3 * ((4.0453 * turbidity - 4.9710) * std::tan(chi) - 0.2155 * turbidity + 2.4192),
          zenith_chromaticity(kZenithX, turbidity, sun_zenith_angle_rad),
          zenith_chromaticity(kZenithY, turbidity, sun_zenith_angle_rad)};
}

double model_turbidity(const SceneModel& model, RunSummary& summary) {
  const auto& given = model.scene.preetham.turbidity;
  const double asked = given ? *given : scene_turbidity(model.scene);
  const double taken =
      within_model_range(model, "preetham.turbidity", asked, kPreethamLowestTurbidity,
                         kPreethamHighestTurbidity, summary);
  summary.figures.emplace_back(
      "turbidity", fmt::format("{:.3f}{}", taken, given ? "" : ", the scene's air at 550 nm"));
  return taken;
}

double daytime_elevation_rad(const SceneModel& model, RunSummary& summary) {
  const double degrees = model.sun_elevation_rad * 180 / pi;
  const double taken = within_model_range(model, "sun.elevation_deg", degrees, 0.0, 90.0, summary);
  return taken == degrees ? model.sun_elevation_rad : taken * pi / 180;
}

std::vector<double> clear_sun_transmittance(const SceneModel& model, double turbidity,
                                            double sun_elevation_rad) {
  const double mass = relative_optical_mass(std::max(0.0, pi / 2 - sun_elevation_rad));
  PreethamColumns columns;
  columns.turbidity = turbidity;
  std::vector<double> out;
  for (const double nm : model.medium.wavelength_nm) {
    out.push_back(preetham_transmittance(nm, mass, columns).total());
  }
  return out;
}

PreethamSky::PreethamSky(const SceneModel& model)
    : HemisphereSky(with_its_sun(model)), daylight_(model.medium.wavelength_nm) {
  model_.sun_elevation_rad = daytime_elevation_rad(model_, summary_);
  turbidity_ = model_turbidity(model_, summary_);
  form_ = preetham_distribution(turbidity_);
  const double theta = pi / 2 - model_.sun_elevation_rad;
  zenith_ = preetham_zenith(turbidity_, theta);
  per_form_ = {zenith_.luminance_cd_m2 / perez(form_.luminance, 1.0, theta),
               zenith_.x / perez(form_.x, 1.0, theta), zenith_.y / perez(form_.y, 1.0, theta)};
  record();
}

// What the run's summary and the images say. That a spectrum is clipped is looked for on a grid of
// 2 degrees, so that it is said alike whatever is looked at.
void PreethamSky::record() {
  summary_.figures.emplace_back(
      "zenith", fmt::format("{:.0f} cd/m2, x = {:.4f}, y = {:.4f}", zenith_.luminance_cd_m2,
                            zenith_.x, zenith_.y));
  if (model_.scene.preetham.sun_position == "preetham" && model_.scene.observer.time) {
    summary_.figures.emplace_back(
        "Sun by Preetham's A.6",
        fmt::format("elevation {:.3f} degrees", model_.sun_elevation_rad * 180 / pi));
  }
  for (const double nm : model_.medium.wavelength_nm) {
    if (nm >= kFirstDaylightNm && nm <= kLastDaylightNm) continue;
    summary_.clamps.emplace_back("spectrum.wavelengths_nm",
                                 "beyond 380..780 nm the daylight basis of the end");
    break;
  }
  constexpr int kSteps = 45;
  std::vector<double> out(model_.medium.wavelengths());
  int clipped = 0, views = 0;
  for (int e = 0; e <= kSteps; ++e) {
    for (int a = 0; a <= 2 * kSteps; ++a, ++views) {
      clipped += spectrum_clipped({e * pi / 2 / kSteps, a * pi / (2 * kSteps)}, out);
    }
  }
  if (clipped > 0) {
    summary_.clamps.emplace_back(
        "radiance",
        fmt::format("negative daylight spectra taken as 0 in {} of {} directions", clipped, views));
  }
}

bool PreethamSky::spectrum_clipped(const ViewDirection& view, std::span<double> out) const {
  const double cosine = std::sin(view.elevation_rad);
  const double gamma = std::acos(cos_sun_angle(view));
  return daylight_.radiance(per_form_.luminance_cd_m2 * perez(form_.luminance, cosine, gamma),
                            per_form_.x * perez(form_.x, cosine, gamma),
                            per_form_.y * perez(form_.y, cosine, gamma), out);
}

void PreethamSky::spectrum(const ViewDirection& view, std::span<double> out) const {
  spectrum_clipped(view, out);
}

std::vector<double> PreethamSky::sun_transmittance() const {
  return clear_sun_transmittance(model_, turbidity_, model_.sun_elevation_rad);
}

std::optional<AerialLight> PreethamSky::aerial_light(const ViewDirection& view,
                                                     double distance_km) const {
  if (!(distance_km >= 0) || !std::isfinite(distance_km)) {
    throw std::invalid_argument("the distance along a view must be finite and at least 0 km");
  }
  std::call_once(air_made_, [&] {
    air_ = std::make_unique<const PreethamAerialPerspective>(*this, turbidity_);
  });
  // Their observer stands on the ground: nothing lies in front of it below the horizon.
  const AerialPath path{0.0, std::max(0.0, view.elevation_rad),
                        view.elevation_rad < 0 ? 0.0 : distance_km};
  return AerialLight{air_->transmittance(path), air_->inscattered(path, view.relative_azimuth_rad)};
}

}  // namespace twilight
