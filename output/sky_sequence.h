// A film of the sky: many Suns, one solved atmosphere.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>

#include "output/exr_image.h"
#include "output/sky_image.h"
#include "sim/sky.h"

namespace twilight {

/// One frame: the Sun's place and the files of its map.
struct SequenceFrame {
  double sun_elevation_rad = 0;  ///< geometric
  double sun_azimuth_rad = 0;    ///< clockwise from north
  std::filesystem::path file;
  /// Of the settings' spectral map; written first, so that a frame whose `file` is there is whole.
  std::filesystem::path spectral_file = {};
  double light = 1;  ///< factor of all radiance: the solar irradiance over that of the sky
};

/// What a frame's files say of it, from its sky.
using FrameAttributes = std::function<ImageAttributes(const SequenceFrame&, const Sky&)>;

/// Renders and writes (write_exr, write_spectral_exr) one frame of the sky under the frame's Sun:
/// render_map() times the frame's light. Of the settings the Sun's azimuth is the frame's.
/// Attributes `sunElevation` and `sunAzimuth` (deg) are added. Each file appears whole or not at
/// all. Throws as render_map and write_exr do; Cancelled when told to stop.
void write_sky_frame(const Sky& sky, const ColourIntegrator& integrator,
                     const MapSettings& settings, const SequenceFrame& frame,
                     const FrameAttributes& attributes = {}, const RunControl& control = {});

/// The same of every frame, with the sky's with_sun_at(); some frames at a time on all threads of
/// the current oneTBB arena, whatever their number the same bytes. The frames share the sky's
/// atmosphere and observer; those written before an error stay. Throws std::invalid_argument where
/// the sky's method shares nothing between Suns, else as write_sky_frame.
void write_sky_sequence(const Sky& sky, const ColourIntegrator& integrator,
                        const MapSettings& settings, std::span<const SequenceFrame> frames,
                        const FrameAttributes& attributes = {}, const RunControl& control = {});

}  // namespace twilight
