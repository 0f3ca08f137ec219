#include "sim/models/hoffman_preetham_sky.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "aerosols/henyey_greenstein.h"
#include "atmosphere/power_law.h"

namespace twilight {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

// Haze scattering at the ground, km^-1, per wavelength.
std::vector<double> haze_scattering(const HoffmanPreethamOptions& options,
                                    std::span<const double> wavelength_nm) {
  std::vector<double> rgb = options.haze_scattering_per_km;
  if (rgb.empty()) {
    const auto row = haze_row(options.haze);
    if (!row) return std::vector<double>(wavelength_nm.size(), 0.0);
    for (const double per_m : row->scattering_per_m) rgb.push_back(1e3 * per_m);
  }
  // Increasing wavelengths; a power law has no zeros.
  const double at_nm[] = {kHoffmanPreethamNm[2], kHoffmanPreethamNm[1], kHoffmanPreethamNm[0]};
  const double value[] = {std::max(rgb[2], 1e-12), std::max(rgb[1], 1e-12),
                          std::max(rgb[0], 1e-12)};
  std::vector<double> scattering;
  for (const double nm : wavelength_nm) scattering.push_back(power_law(at_nm, value, nm));
  return scattering;
}

}  // namespace

HoffmanPreethamSky::HoffmanPreethamSky(const SceneModel& model) : HemisphereSky(model) {
  const HoffmanPreethamOptions& options = model_.scene.hoffman_preetham;
  model_.sun_elevation_rad =
      within_model_range(model_, "sun.elevation_deg", model_.sun_elevation_rad * kDegrees, 0.0,
                         90.0, summary_) /
      kDegrees;
  haze_per_km_ = haze_scattering(options, model_.medium.wavelength_nm);
  haze_absorption_per_km_ = options.haze_absorption_per_km;
  for (const double nm : model_.medium.wavelength_nm) {
    air_per_km_.push_back(1e3 * hoffman_preetham_air_per_m(nm));
  }
  printed_ = options.phase == "printed";
  const auto row = haze_row(options.haze);
  const double g = options.asymmetry.value_or(row ? row->asymmetry : 0.0);
  asymmetry_ = printed_ ? g : physical_asymmetry(g);
  sun_irradiance_ = HoffmanPreethamSky::sun_transmittance();
  for (std::size_t w = 0; w < sun_irradiance_.size(); ++w) {
    sun_irradiance_[w] *= model_.solar_irradiance[w];
  }
  summary_.figures.emplace_back("haze", options.haze);
  summary_.figures.emplace_back(
      "haze asymmetry",
      fmt::format("{:.4g}, {}", asymmetry_, printed_ ? "as printed" : "Henyey-Greenstein"));
}

std::vector<double> HoffmanPreethamSky::sun_transmittance() const {
  const double zenith_deg = 90.0 - model_.sun_elevation_rad * kDegrees;
  const double air = optical_length(kAirLengthKm, zenith_deg);
  const double haze = optical_length(kHazeLengthKm, zenith_deg);
  std::vector<double> result;
  for (std::size_t w = 0; w < air_per_km_.size(); ++w) {
    result.push_back(extinction_factor(air_per_km_[w], air) *
                     extinction_factor(haze_per_km_[w] + haze_absorption_per_km_, haze));
  }
  return result;
}

TwoShellOptics HoffmanPreethamSky::optics(const ViewDirection& view, std::size_t w) const {
  const double mu = cos_sun_angle(view);
  const double rayleigh = 3.0 / (16.0 * std::numbers::pi) * (1.0 + mu * mu);
  const double haze =
      printed_ ? printed_haze_phase_per_sr(mu, asymmetry_) : henyey_greenstein(mu, asymmetry_);
  return {air_per_km_[w], haze_per_km_[w] + haze_absorption_per_km_, air_per_km_[w] * rayleigh,
          haze_per_km_[w] * haze};
}

std::optional<AerialLight> HoffmanPreethamSky::aerial_light(const ViewDirection& view,
                                                            double distance_km) const {
  if (!(distance_km >= 0.0)) {
    throw std::invalid_argument(fmt::format("distance_km is {}; it must be >= 0", distance_km));
  }
  // The observer stands on the ground: nothing lies in front of it below the horizon.
  if (view.elevation_rad < 0) distance_km = 0.0;
  AerialLight result;
  for (std::size_t w = 0; w < air_per_km_.size(); ++w) {
    const TwoShellOptics o = optics(view, w);
    const double extinction = o.air_extinction_per_km + o.haze_extinction_per_km;
    result.transmittance.push_back(extinction_factor(extinction, distance_km));
    result.inscattered.push_back(
        sun_irradiance_[w] * inscattering(extinction,
                                          o.air_scattering_per_km_sr + o.haze_scattering_per_km_sr,
                                          distance_km));
  }
  return result;
}

void HoffmanPreethamSky::spectrum(const ViewDirection& view, std::span<double> out) const {
  const double zenith_deg = 90.0 - view.elevation_rad * kDegrees;
  const double air = optical_length(kAirLengthKm, zenith_deg);
  const double haze = optical_length(kHazeLengthKm, zenith_deg);
  for (std::size_t w = 0; w < out.size(); ++w) {
    out[w] = sun_irradiance_[w] * two_shell_inscattering(optics(view, w), air, haze);
  }
}

}  // namespace twilight
