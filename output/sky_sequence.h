// A film of the sky: many Suns, one solved atmosphere.
#pragma once

#include <filesystem>
#include <span>

#include "output/exr_image.h"
#include "output/sky_image.h"
#include "sim/orders_sky.h"

namespace twilight {

/// One frame: the Sun's place and the file of its map.
struct SequenceFrame {
  double sun_elevation_rad = 0;  ///< geometric
  double sun_azimuth_rad = 0;    ///< clockwise from north
  std::filesystem::path file;
};

/// Renders and writes (write_exr) the map of every frame, some frames at a time on all threads of
/// the current oneTBB arena. The frames share the sky's atmosphere and observer; each is what
/// render_map() of sky.under() gives, whatever the number of threads. Of the settings the Sun's
/// azimuth is the frame's. A frame's file appears whole or not at all; those written before an
/// error stay. Attributes are added to every frame, "sunElevation" and "sunAzimuth" (deg) to each.
/// Throws as render_map and write_exr do; Cancelled when told to stop.
void write_sky_sequence(const OrdersSky& sky, const ColourIntegrator& integrator,
                        const MapSettings& settings, std::span<const SequenceFrame> frames,
                        const ImageAttributes& attributes = {}, const RunControl& control = {});

}  // namespace twilight
