#include "output/fit_sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180;

std::vector<ViewDirection> directions() {
  std::vector<ViewDirection> all;
  for (const WeightedView& v : fit_views()) all.push_back(v.direction);
  return all;
}

FitSky look(const Sky& sky, const ColourIntegrator& colour, const std::vector<ViewDirection>& views,
            const std::string& place) {
  FitSky node;
  node.radiance = sky.radiance(views);
  node.sun_transmittance = sky.sun_transmittance();
  node.solar_irradiance.assign(sky.solar_irradiance().begin(), sky.solar_irradiance().end());
  for (double& t : node.sun_transmittance) t = std::clamp(t, 0.0, 1.0);
  const std::size_t W = sky.wavelength_nm().size();
  for (std::size_t k = 0; k < node.radiance.size(); ++k) {
    if (node.radiance[k] > 0) continue;
    const ViewDirection& v = views[k / W];
    throw std::invalid_argument(fmt::format(
        "the sky at {} is dark (radiance 0) at elevation {:.4g} deg, azimuth {:.4g} deg from the "
        "Sun, {} nm: nothing to fit",
        place, v.elevation_rad / kRadPerDeg, v.relative_azimuth_rad / kRadPerDeg,
        sky.wavelength_nm()[k % W]));
  }
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Tristimulus xyz =
        colour.xyz(std::span(node.radiance).subspan(v * W, W), sky.solar_irradiance());
    const auto xy = chromaticity(xyz);
    node.luminance.push_back(kLuminousEfficacy_lm_w * xyz[1]);
    node.x.push_back(xy[0]);
    node.y.push_back(xy[1]);
  }
  return node;
}

}  // namespace

std::vector<WeightedView> fit_views() {
  constexpr int kRings = 18, kAzimuths = 18;  // steps of 5 and 10 degrees
  constexpr double kStep = 5 * kRadPerDeg, kTurn = 10 * kRadPerDeg;
  using std::numbers::pi;
  std::vector<WeightedView> views = {{{pi / 2, 0.0}, 2 * pi * (1 - std::cos(0.5 * kStep))}};
  for (int ring = 1; ring <= kRings; ++ring) {
    const double upper = (ring - 0.5) * kStep, lower = std::min(upper + kStep, pi / 2);
    const double elevation = ring < kRings ? pi / 2 - ring * kStep : pi / 2 - 0.5 * (upper + lower);
    for (int k = 0; k <= kAzimuths; ++k) {
      const double share = k == 0 || k == kAzimuths ? 0.5 : 1.0;
      views.push_back(
          {{elevation, k * kTurn}, 2 * share * kTurn * (std::cos(upper) - std::cos(lower))});
    }
  }
  return views;
}

FitError fit_error(const std::vector<double>& form, const std::vector<double>& value) {
  const std::vector<WeightedView> views = fit_views();
  std::vector<WeightedValue> sizes;
  FitError error;
  double weight = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const double off = form.at(v) / value.at(v) - 1, w = views[v].solid_angle_sr;
    sizes.push_back({std::abs(off), w});
    error.rms += w * off * off;
    error.bias += w * off;
    weight += w;
  }
  error.rms = std::sqrt(error.rms / weight);
  error.bias /= weight;
  const Spread spread = spread_of(sizes);
  error.p95 = spread.p95;
  error.largest = spread.largest;
  return error;
}

std::vector<FormSample> fit_samples(double sun_zenith_rad) {
  const double cos_sun = std::cos(sun_zenith_rad), sin_sun = std::sin(sun_zenith_rad);
  std::vector<FormSample> all;
  for (const WeightedView& v : fit_views()) {
    const double up = std::sin(v.direction.elevation_rad);
    const double flat = std::cos(v.direction.elevation_rad);
    const double cosine =
        up * cos_sun + flat * sin_sun * std::cos(v.direction.relative_azimuth_rad);
    all.push_back({std::min(1.0, up), std::acos(std::clamp(cosine, -1.0, 1.0)),
                   v.solid_angle_sr / (2 * std::numbers::pi), 0.0});
  }
  return all;
}

std::vector<double> channel_values(const FitSky& sky, FitQuantity quantity, std::size_t channel) {
  if (quantity == FitQuantity::kLuminanceChromaticity) {
    return channel == 0 ? sky.luminance : channel == 1 ? sky.x : sky.y;
  }
  const std::size_t W = sky.radiance.size() / sky.luminance.size();
  std::vector<double> values;
  for (std::size_t k = channel; k < sky.radiance.size(); k += W) {
    values.push_back(sky.radiance[k]);
  }
  return values;
}

std::vector<FitSky> simulate_suns(SceneModel model, const std::vector<double>& suns_deg,
                                  const ColourIntegrator& colour, const std::string& place,
                                  const RunControl& control,
                                  const std::function<void(std::size_t)>& begin) {
  const std::vector<ViewDirection> views = directions();
  const RunControl quiet{{}, control.cancel};
  std::vector<FitSky> skies;
  std::shared_ptr<const OrdersField> field;
  for (std::size_t s = 0; s < suns_deg.size(); ++s) {
    control.check();
    if (begin) begin(s);
    model.sun_elevation_rad = suns_deg[s] * kRadPerDeg;
    std::unique_ptr<Sky> sky;
    if (model.scene.solver.method != "orders") {
      sky = solve_sky(model, quiet);
    } else {
      FieldSky solved =
          field ? sky_from_field(model, field, quiet) : solve_sky_and_field(model, quiet);
      sky = std::move(solved.sky);
      field = std::move(solved.field);
    }
    skies.push_back(
        look(*sky, colour, views, fmt::format("{} = {}{}", kSunElevationKey, suns_deg[s], place)));
  }
  return skies;
}

}  // namespace twilight
