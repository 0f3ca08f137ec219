#include "output/sky_sequence.h"

#include <oneapi/tbb/parallel_for.h>

#include <mutex>
#include <numbers>
#include <stdexcept>

namespace twilight {
namespace {

void scale(SkyImage& image, double factor) {
  for (float& value : image.pixels) {
    value = static_cast<float>(factor * static_cast<double>(value));
  }
}

}  // namespace

void write_sky_frame(const Sky& sky, const ColourIntegrator& integrator,
                     const MapSettings& settings, const SequenceFrame& frame,
                     const FrameAttributes& attributes, const RunControl& control) {
  constexpr double kDegPerRad = 180 / std::numbers::pi;
  MapSettings here = settings;
  here.sun_azimuth_rad = frame.sun_azimuth_rad;
  SkyMap map = render_map(sky, integrator, here, control);
  if (frame.light != 1.0) {
    scale(map.colour, frame.light);
    if (map.spectral) scale(*map.spectral, frame.light);
  }
  ImageAttributes facts = attributes ? attributes(frame, sky) : ImageAttributes();
  facts.emplace_back("sunElevation", frame.sun_elevation_rad * kDegPerRad);
  facts.emplace_back("sunAzimuth", frame.sun_azimuth_rad * kDegPerRad);
  if (map.spectral) {
    const bool rgb = settings.colour == MapColour::kLinearRec709;
    write_spectral_exr(frame.spectral_file, *map.spectral, rgb ? &map.colour : nullptr,
                       settings.projection, facts);
  }
  write_exr(frame.file, map.colour, settings.projection, facts);
}

void write_sky_sequence(const Sky& sky, const ColourIntegrator& integrator,
                        const MapSettings& settings, std::span<const SequenceFrame> frames,
                        const FrameAttributes& attributes, const RunControl& control) {
  std::mutex report;
  std::size_t done = 0;
  RunControl quiet;
  quiet.cancel = control.cancel;
  tbb::parallel_for(std::size_t{0}, frames.size(), [&](std::size_t k) {
    const SequenceFrame& frame = frames[k];
    quiet.check();
    const auto lit = sky.with_sun_at(frame.sun_elevation_rad);
    if (!lit) throw std::invalid_argument("this sky shares nothing with one under another Sun");
    write_sky_frame(*lit, integrator, settings, frame, attributes, quiet);
    const std::lock_guard lock(report);
    control.report("frames", static_cast<double>(++done) / static_cast<double>(frames.size()));
  });
}

}  // namespace twilight
