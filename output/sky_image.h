// The sky as an image.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "output/colour.h"
#include "output/projection.h"
#include "sim/run_control.h"
#include "sim/sky.h"

namespace twilight {

/// Interleaved float pixels, [y][x][channel]; row 0 is the top.
struct SkyImage {
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;
  std::vector<float> pixels;
  std::optional<MapProjection> projection = std::nullopt;  ///< set by render_map
};

enum class MapColour {
  kLinearRec709,  ///< channels R, G, B; gamut-mapped, (1,1,1) = 683 cd/m^2
  kXyz,           ///< channels X, Y, Z in W m^-2 sr^-1; Y = 1 is 683 cd/m^2 (cie1931)
};

/// What a map shows. Not part of it: the Sun's glow, which is sky.
struct MapSettings {
  MapProjection projection = Projection::kFisheye;
  int size = 512;                ///< 1..16384; height in pixels, see projection.h
  double sun_azimuth_rad = 0.0;  ///< clockwise from north
  MapColour colour = MapColour::kLinearRec709;
  bool spectral = false;               ///< also keep the spectrum of every pixel
  bool sun_disc = false;               ///< add the disc at its refracted place
  double horizon_elevation_rad = 0.0;  ///< the disc is cut off below it (minus the dip)
};

struct SkyMap {
  SkyImage colour;
  /// Channels S0.<wavelength>nm (exr_image.h), W m^-2 sr^-1 nm^-1; if asked for.
  std::optional<SkyImage> spectral;
  std::size_t sky_pixels = 0;           ///< pixels that hold a direction
  std::size_t out_of_gamut_pixels = 0;  ///< of which gamut-mapped (0 for kXyz)
};

/// Renders the sky texture (paper Sec. 3 and 4.7): radiance at each pixel's
/// centre, integrated to colour. Pixels outside the fisheye's disc are 0.
///
/// Where the Sun's vertical plane maps pixel centres onto pixel centres (a Sun
/// at a multiple of 45 deg; in lat-long maps of 90 deg / size; before or behind a camera) each
/// mirrored
/// pair is computed once; that rests on Sky being symmetric about that plane.
///
/// The disc adds E/omega times the covered fraction of each pixel, E = solar
/// irradiance times Sky::sun_transmittance, so that its irradiance is right even
/// where it is smaller than a pixel (sun_disc.h).
///
/// Throws std::invalid_argument for a size outside 1..16384, an azimuth that is
/// not finite or an integrator of other wavelengths; std::logic_error if the
/// sky returns a value that is negative or not finite; Cancelled when told to stop.
SkyMap render_map(const Sky& sky, const ColourIntegrator& integrator, const MapSettings& settings,
                  const RunControl& control = {});

/// Pixel (x, y)'s mirror image in the vertical plane at sun_azimuth_rad as an
/// index y * width + x, or nothing where the map's grid has no such symmetry.
std::optional<std::size_t> mirrored_pixel(const MapProjection& projection, int size,
                                          double sun_azimuth_rad, int x, int y);

}  // namespace twilight
