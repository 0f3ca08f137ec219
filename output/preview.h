// An 8-bit picture of a sky map for looking at.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "output/atomic_file.h"
#include "output/sky_image.h"

namespace twilight {

/// What the tone curve adapts to, in the map's unit of luminance (whiteLuminance cd/m^2).
struct ToneExposure {
  double grey = 1.0;   ///< luminance carried to the key before the curve; finite, > 0
  double white = 1.0;  ///< luminance shown as white, at least that of 1 before the curve; > 0
};

struct PreviewSettings {
  /// Display luminance (linear, 0..1) that the sky's mean log luminance is
  /// carried to before the curve; (0, 1].
  double key = 0.2;
  /// Unset: the image's own, sky_exposure(). Pictures of one exposure can be compared.
  std::optional<ToneExposure> exposure = std::nullopt;
};

/// What an image would be exposed for: grey is its mean log luminance, white the 99.5th percentile
/// (tone_map says of which pixels). Nothing where no pixel is lit. Throws as tone_map.
std::optional<ToneExposure> sky_exposure(const SkyImage& image);

/// Tone-maps a map with channels R, G, B or X, Y, Z to 8-bit sRGB (IEC
/// 61966-2-1), [y][x][3].
///
/// One global curve on luminance (Reinhard et al. 2002, "Photographic tone
/// reproduction", their eqs. 1, 2 and 4): exposure from the mean log luminance of
/// the lit pixels above the horizon (of all where the image tells no projection or none is lit
/// there), the darkest and brightest 1 % clamped, so that neither a disc nor empty pixels set it;
/// burn-out at the 99.5th percentile. Colour ratios stay; a colour too vivid for the display is
/// dimmed and moved towards the grey of its luminance. Of two pixels of one chromaticity the
/// brighter is never shown darker. An image without light is black. Throws std::logic_error if a
/// pixel is negative or not finite or the channels are others; std::invalid_argument if the key is
/// outside (0, 1] or an exposure not above 0.
std::vector<std::uint8_t> tone_map(const SkyImage& image, const PreviewSettings& settings = {});

/// Writes tone_map's result as a PNG, whole or not at all; with an AtomicFile its commit is
/// the caller's. Throws as tone_map,
/// and std::runtime_error naming the path if writing fails.
void write_preview_png(AtomicFile& file, const SkyImage& image,
                       const PreviewSettings& settings = {});
void write_preview_png(const std::filesystem::path& path, const SkyImage& image,
                       const PreviewSettings& settings = {});

}  // namespace twilight
