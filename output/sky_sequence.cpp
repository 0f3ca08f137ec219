#include "output/sky_sequence.h"

#include <oneapi/tbb/parallel_for.h>

#include <mutex>
#include <numbers>

namespace twilight {

void write_sky_sequence(const OrdersSky& sky, const ColourIntegrator& integrator,
                        const MapSettings& settings, std::span<const SequenceFrame> frames,
                        const ImageAttributes& attributes, const RunControl& control) {
  constexpr double kDegPerRad = 180 / std::numbers::pi;
  std::mutex report;
  std::size_t done = 0;
  RunControl quiet;
  quiet.cancel = control.cancel;
  tbb::parallel_for(std::size_t{0}, frames.size(), [&](std::size_t k) {
    const SequenceFrame& frame = frames[k];
    quiet.check();
    MapSettings here = settings;
    here.sun_azimuth_rad = frame.sun_azimuth_rad;
    const auto lit = sky.under(frame.sun_elevation_rad);
    const SkyMap map = render_map(*lit, integrator, here, quiet);
    ImageAttributes facts = attributes;
    facts.emplace_back("sunElevation", frame.sun_elevation_rad * kDegPerRad);
    facts.emplace_back("sunAzimuth", frame.sun_azimuth_rad * kDegPerRad);
    write_exr(frame.file, map.colour, settings.projection, facts);
    const std::lock_guard lock(report);
    control.report("frames", static_cast<double>(++done) / static_cast<double>(frames.size()));
  });
}

}  // namespace twilight
