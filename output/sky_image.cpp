#include "output/sky_image.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <unordered_map>

#include "output/exr_image.h"
#include "output/sun_disc.h"

namespace twilight {
namespace {

using std::numbers::pi;

constexpr std::size_t kNoPixel = static_cast<std::size_t>(-1);
// Enough views per call to keep every thread of a solver busy, few enough to
// stay small in memory and to answer a cancel quickly.
constexpr std::size_t kViewsPerBatch = 16384;
// Pixels put into the order of their elevations, in which solvers find neighbours that share work.
constexpr std::size_t kViewsSorted = 1 << 19;

/// A count of half steps, if an azimuth is a whole number of them.
std::optional<long> whole_steps(double azimuth_rad, double step_rad) {
  const double steps = azimuth_rad / step_rad;
  const double whole = std::round(steps);
  // 1e-9 of a step: rounding of degrees to radians, far below what a pixel shows.
  if (std::abs(steps - whole) > 1e-9) return std::nullopt;
  return static_cast<long>(whole);
}

double relative_azimuth_rad(double azimuth_rad, double sun_azimuth_rad) {
  return std::remainder(azimuth_rad - sun_azimuth_rad, 2.0 * pi);
}

struct Pending {
  ViewDirection view;
  std::size_t pixel;
  std::size_t mirror;  // kNoPixel if none
};

void check_spectrum(std::span<const double> radiance, std::span<const double> wavelength_nm,
                    const ViewDirection& view) {
  for (std::size_t w = 0; w < radiance.size(); ++w) {
    if (!std::isfinite(radiance[w]) || radiance[w] < 0.0) {
      throw std::logic_error("sky radiance at " + std::to_string(wavelength_nm[w]) +
                             " nm, elevation " + std::to_string(view.elevation_rad) +
                             " rad, relative azimuth " + std::to_string(view.relative_azimuth_rad) +
                             " rad is " + std::to_string(radiance[w]) +
                             " W m^-2 sr^-1 nm^-1; it must be finite and >= 0");
    }
  }
}

}  // namespace

std::optional<std::size_t> mirrored_pixel(const MapProjection& projection, int size,
                                          double sun_azimuth_rad, int x, int y) {
  const int width = map_width(projection, size);
  int mx = x;
  int my = y;
  if (projection.kind == Projection::kCamera) {
    if (!whole_steps(sun_azimuth_rad - projection.camera.azimuth_rad, pi)) return std::nullopt;
    mx = width - 1 - x;
  } else if (projection.kind == Projection::kLatLong) {
    // Column centres (x + 1/2) mirror onto 2 s - (x + 1/2), s the Sun's column.
    const auto twice_sun = whole_steps(sun_azimuth_rad, pi / width);
    if (!twice_sun) return std::nullopt;
    const long column = (*twice_sun - x - 1) % width;
    mx = static_cast<int>(column < 0 ? column + width : column);
  } else {
    const auto eighths = whole_steps(sun_azimuth_rad, 0.25 * pi);
    if (!eighths) return std::nullopt;
    switch (((*eighths % 4) + 4) % 4) {
      case 0:  // north-south: the image's vertical axis
        mx = size - 1 - x;
        break;
      case 1:  // north-east is up and to the left
        std::swap(mx, my);
        break;
      case 2:
        my = size - 1 - y;
        break;
      default:
        mx = size - 1 - y;
        my = size - 1 - x;
    }
  }
  return static_cast<std::size_t>(my) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(mx);
}

SkyMap render_map(const Sky& sky, const ColourIntegrator& integrator, const MapSettings& settings,
                  const RunControl& control) {
  const int width = map_width(settings.projection, settings.size);
  const int height = map_height(settings.projection, settings.size);
  if (!std::isfinite(settings.sun_azimuth_rad)) {
    throw std::invalid_argument("sun_azimuth_rad is " + std::to_string(settings.sun_azimuth_rad) +
                                "; it must be finite");
  }
  const auto wavelength_nm = sky.wavelength_nm();
  const auto solar = sky.solar_irradiance();
  const std::size_t wavelengths = wavelength_nm.size();
  if (integrator.weights().size() != wavelengths) {
    throw std::invalid_argument(
        "colour integrator has " + std::to_string(integrator.weights().size()) +
        " wavelengths; it must have the sky's " + std::to_string(wavelengths));
  }

  SkyMap map;
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const bool rgb = settings.colour == MapColour::kLinearRec709;
  map.colour = {
      width, height,
      rgb ? std::vector<std::string>{"R", "G", "B"} : std::vector<std::string>{"X", "Y", "Z"},
      std::vector<float>(pixels * 3, 0.0f), settings.projection};
  if (settings.spectral) {
    std::vector<std::string> names;
    for (double nm : wavelength_nm) names.push_back(spectral_channel_name(nm));
    map.spectral = {width, height, std::move(names), std::vector<float>(pixels * wavelengths, 0.0f),
                    settings.projection};
  }

  std::vector<double> disc_radiance(wavelengths, 0.0);
  std::unordered_map<std::size_t, double> disc;
  if (settings.sun_disc) {
    const auto transmittance = sky.sun_transmittance();
    bool visible = false;
    for (std::size_t w = 0; w < wavelengths; ++w) {
      disc_radiance[w] = solar[w] * transmittance[w] / sun_disc_solid_angle_sr();
      visible = visible || disc_radiance[w] > 0.0;
    }
    if (visible) {
      disc = sun_disc_coverage(settings.projection, settings.size,
                               {sky.apparent_sun_elevation_rad(), settings.sun_azimuth_rad},
                               settings.horizon_elevation_rad);
    }
  }

  std::vector<double> seen(wavelengths);
  const auto store = [&](std::size_t pixel, std::span<const double> radiance) {
    std::copy(radiance.begin(), radiance.end(), seen.begin());
    if (const auto covered = disc.find(pixel); covered != disc.end()) {
      for (std::size_t w = 0; w < wavelengths; ++w) {
        seen[w] += covered->second * disc_radiance[w];
      }
    }
    if (map.spectral) {
      for (std::size_t w = 0; w < wavelengths; ++w) {
        map.spectral->pixels[pixel * wavelengths + w] = static_cast<float>(seen[w]);
      }
    }
    auto colour = integrator.xyz(seen, solar);
    if (rgb) {
      const auto mapped = into_gamut(linear_rec709(colour));
      colour = mapped.rgb;
      if (mapped.moved) ++map.out_of_gamut_pixels;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      map.colour.pixels[pixel * 3 + c] = static_cast<float>(colour[c]);
    }
    ++map.sky_pixels;
  };

  std::vector<ViewDirection> views;
  std::vector<Pending> pending;
  std::size_t reached = 0, reported = 0;
  const auto answer = [&](std::span<const Pending> batch) {
    control.check();
    views.clear();
    for (const Pending& p : batch) views.push_back(p.view);
    const auto radiance = sky.map_radiance(views);
    if (radiance.size() != views.size() * wavelengths) {
      throw std::logic_error("sky returned " + std::to_string(radiance.size()) + " radiances for " +
                             std::to_string(views.size()) + " views of " +
                             std::to_string(wavelengths) + " wavelengths");
    }
    for (std::size_t i = 0; i < views.size(); ++i) {
      const auto spectrum = std::span(radiance).subspan(i * wavelengths, wavelengths);
      check_spectrum(spectrum, wavelength_nm, views[i]);
      store(batch[i].pixel, spectrum);
      if (batch[i].mirror != kNoPixel) store(batch[i].mirror, spectrum);
    }
  };
  const auto flush = [&] {
    std::ranges::stable_sort(pending, {}, [](const Pending& p) { return p.view.elevation_rad; });
    for (std::size_t i = 0; i < pending.size(); i += kViewsPerBatch) {
      const std::size_t count = std::min(kViewsPerBatch, pending.size() - i);
      answer(std::span(pending).subspan(i, count));
      const double share = static_cast<double>(i + count) / static_cast<double>(pending.size());
      control.report("image", (static_cast<double>(reported) +
                               share * static_cast<double>(reached - reported)) /
                                  static_cast<double>(pixels));
    }
    control.check();
    pending.clear();
    reported = reached;
  };

  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t pixel = reached++;
      const auto direction = direction_of_pixel(settings.projection, settings.size, x, y);
      if (!direction) continue;
      const auto mirror =
          mirrored_pixel(settings.projection, settings.size, settings.sun_azimuth_rad, x, y);
      if (mirror && *mirror < pixel) continue;  // done with its twin
      const double azimuth = relative_azimuth_rad(direction->azimuth_rad, settings.sun_azimuth_rad);
      pending.push_back({{direction->elevation_rad, azimuth},
                         pixel,
                         mirror && *mirror != pixel ? *mirror : kNoPixel});
    }
    if (pending.size() >= kViewsSorted || y == height - 1) flush();
  }
  return map;
}

}  // namespace twilight
