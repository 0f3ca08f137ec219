#include "output/sky_sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>

#include "output/colour.h"
#include "output/colour_difference.h"
#include "output/scene_colour.h"
#include "sim/elapsed_time.h"

namespace twilight {
namespace {

constexpr double kSameWavelength_nm = 1e-6;

/// Wall and processor time since it was made.
class Clocks {
 public:
  double wall() const { return seconds_since(start_); }
  double cpu() const { return processor_seconds() - cpu_start_; }

 private:
  Clock::time_point start_ = Clock::now();
  double cpu_start_ = processor_seconds();
};

// The process's own high-water mark. ru_maxrss is no measure for a child: Linux counts the pages of
// the process that started it until it has become a program of its own.
double peak_resident_mib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024.0;
  }
  return 0.0;
}

void gather(const Sky& sky, bool noisy, const ColourIntegrator& colour, SunSample& sample) {
  std::vector<ViewDirection> views;
  for (const WeightedView& v : hemisphere_views()) views.push_back(v.direction);
  if (noisy) {
    StokesRadiance light = sky.stokes(views);
    sample.radiance = std::move(light.i);
    sample.standard_error = std::move(light.standard_error);
  } else {
    sample.radiance = sky.radiance(views);
  }
  const std::size_t W = sky.wavelength_nm().size();
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Tristimulus xyz =
        colour.xyz(std::span(sample.radiance).subspan(v * W, W), sky.solar_irradiance());
    sample.xyz.insert(sample.xyz.end(), xyz.begin(), xyz.end());
  }
}

Tristimulus xyz_at(const SunSample& sample, std::size_t view) {
  return {sample.xyz[3 * view], sample.xyz[3 * view + 1], sample.xyz[3 * view + 2]};
}

void require_sizes(const SunSample& sample, std::size_t wavelengths, std::size_t views) {
  const bool noise_fits =
      sample.standard_error.empty() || sample.standard_error.size() == sample.radiance.size();
  if (sample.radiance.size() == views * wavelengths && sample.xyz.size() == 3 * views &&
      noise_fits) {
    return;
  }
  throw std::invalid_argument(fmt::format(
      "sample of the sky at Sun {} deg has {} radiances and {} colour values: must have {} and {}",
      sample.sun_elevation_deg, sample.radiance.size(), sample.xyz.size(), views * wavelengths,
      3 * views));
}

std::optional<Spread> spread_or_none(const std::vector<WeightedValue>& values) {
  if (values.empty()) return std::nullopt;
  return spread_of(values);
}

// Ratios to the reference, gathered over views (and wavelengths).
struct RelativeErrors {
  std::vector<WeightedValue> sizes;
  double signed_sum = 0, weight = 0;

  void add(double value, double reference, double solid_angle) {
    if (!(reference > 0)) return;
    const double error = value / reference - 1;
    sizes.push_back({std::abs(error), solid_angle});
    signed_sum += solid_angle * error;
    weight += solid_angle;
  }
  double bias() const { return weight > 0 ? signed_sum / weight : 0.0; }
};

}  // namespace

SkySample sample_sky(SceneModel model, const std::vector<double>& sun_elevations_deg,
                     const RunControl& control) {
  const bool one_field = model.scene.solver.method == "orders";
  const bool noisy = model.scene.solver.method == "monte-carlo";
  const ColourIntegrator colour = colour_integrator(model, ColourObserver::kCie1931);
  SkySample result;
  result.wavelength_nm = model.medium.wavelength_nm;
  std::shared_ptr<const OrdersField> field;
  for (const double sun_deg : sun_elevations_deg) {
    model.sun_elevation_rad = sun_deg * std::numbers::pi / 180;
    SunSample sample;
    sample.sun_elevation_deg = sun_deg;
    const Clocks setup;
    std::unique_ptr<Sky> sky;
    if (!one_field) {
      sky = solve_sky(model, control);
    } else {
      FieldSky solved =
          field ? sky_from_field(model, field, control) : solve_sky_and_field(model, control);
      sky = std::move(solved.sky);
      if (field) {
        sample.setup_seconds = setup.wall();
        sample.setup_cpu_seconds = setup.cpu();
      }
      field = std::move(solved.field);
    }
    const Clocks views;
    gather(*sky, noisy, colour, sample);
    sample.view_seconds = views.wall();
    sample.view_cpu_seconds = views.cpu();
    result.suns.push_back(std::move(sample));
    control.check();
  }
  result.peak_mib = peak_resident_mib();
  return result;
}

std::string to_json(const SkySample& sample) {
  nlohmann::json suns = nlohmann::json::array();
  for (const SunSample& s : sample.suns) {
    suns.push_back({{"sun_elevation_deg", s.sun_elevation_deg},
                    {"setup_seconds", s.setup_seconds},
                    {"view_seconds", s.view_seconds},
                    {"setup_cpu_seconds", s.setup_cpu_seconds},
                    {"view_cpu_seconds", s.view_cpu_seconds},
                    {"radiance_w_m2_sr_nm", s.radiance},
                    {"standard_error_w_m2_sr_nm", s.standard_error},
                    {"xyz_w_m2_sr", s.xyz}});
  }
  return nlohmann::json({{"wavelengths_nm", sample.wavelength_nm},
                         {"peak_mib", sample.peak_mib},
                         {"suns", std::move(suns)}})
      .dump();
}

SkySample sky_sample_from_json(const std::string& text) {
  SkySample sample;
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    json.at("wavelengths_nm").get_to(sample.wavelength_nm);
    json.at("peak_mib").get_to(sample.peak_mib);
    const std::size_t views = hemisphere_views().size();
    for (const nlohmann::json& sun : json.at("suns")) {
      SunSample s;
      sun.at("sun_elevation_deg").get_to(s.sun_elevation_deg);
      sun.at("setup_seconds").get_to(s.setup_seconds);
      sun.at("view_seconds").get_to(s.view_seconds);
      sun.at("setup_cpu_seconds").get_to(s.setup_cpu_seconds);
      sun.at("view_cpu_seconds").get_to(s.view_cpu_seconds);
      sun.at("radiance_w_m2_sr_nm").get_to(s.radiance);
      sun.at("standard_error_w_m2_sr_nm").get_to(s.standard_error);
      sun.at("xyz_w_m2_sr").get_to(s.xyz);
      require_sizes(s, sample.wavelength_nm.size(), views);
      sample.suns.push_back(std::move(s));
    }
  } catch (const std::exception& error) {
    throw std::runtime_error(fmt::format("no sample of a sky: {}", error.what()));
  }
  return sample;
}

SkyDifference sky_difference(const SunSample& sky, const std::vector<double>& wavelength_nm,
                             const SunSample& reference,
                             const std::vector<double>& reference_wavelength_nm) {
  const std::vector<WeightedView> views = hemisphere_views();
  const std::size_t W = wavelength_nm.size(), R = reference_wavelength_nm.size();
  require_sizes(sky, W, views.size());
  require_sizes(reference, R, views.size());
  std::vector<std::pair<std::size_t, std::size_t>> shared;  // wavelength here and there
  for (std::size_t w = 0; w < W; ++w) {
    for (std::size_t r = 0; r < R; ++r) {
      const double apart = std::abs(wavelength_nm[w] - reference_wavelength_nm[r]);
      if (apart < kSameWavelength_nm) shared.emplace_back(w, r);
    }
  }

  // D65 as bright as the reference's brightest view.
  double brightest = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    brightest = std::max(brightest, xyz_at(reference, v)[1]);
  }
  Tristimulus white;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto& row = xyz_from_rec709()[c];
    white[c] = brightest * (row[0] + row[1] + row[2]);
  }

  RelativeErrors radiance, luminance;
  std::vector<WeightedValue> colour;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const double solid_angle = views[v].solid_angle_sr;
    for (const auto& [w, r] : shared) {
      radiance.add(sky.radiance[v * W + w], reference.radiance[v * R + r], solid_angle);
    }
    const Tristimulus here = xyz_at(sky, v), there = xyz_at(reference, v);
    luminance.add(here[1], there[1], solid_angle);
    if (brightest > 0) {
      colour.push_back({ciede2000(lab_of(here, white), lab_of(there, white)), solid_angle});
    }
  }
  return {spread_or_none(radiance.sizes), spread_or_none(luminance.sizes), spread_or_none(colour),
          radiance.bias(), luminance.bias()};
}

double mean_relative_noise(const SunSample& sample) {
  if (sample.standard_error.empty()) return 0.0;
  const std::vector<WeightedView> views = hemisphere_views();
  const std::size_t W = sample.radiance.size() / views.size();
  double sum = 0, weight = 0;
  for (std::size_t k = 0; k < sample.radiance.size(); ++k) {
    if (!(sample.radiance[k] > 0)) continue;
    sum += views[k / W].solid_angle_sr * sample.standard_error[k] / sample.radiance[k];
    weight += views[k / W].solid_angle_sr;
  }
  return weight > 0 ? sum / weight : 0.0;
}

}  // namespace twilight
