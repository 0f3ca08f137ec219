// Which pixels the solar disc covers, and how much of each.
#pragma once

#include <cstddef>
#include <unordered_map>

#include "output/projection.h"

namespace twilight {

/// Mean angular radius of the Sun, 0.2666 deg (959.63 arcsec at 1 au; IAU nominal).
inline constexpr double kSunAngularRadius_rad = 0.2666 * 3.14159265358979323846 / 180.0;

/// Solid angle of the disc, 2 pi (1 - cos radius), sr.
double sun_disc_solid_angle_sr();

/// Covered fraction of every pixel (index y * width + x) that the disc around
/// `sun` touches. The part of the disc below `horizon_elevation_rad` is cut off.
///
/// The sum of fraction times pixel_solid_angle_sr is the solid angle of the
/// visible part of the disc (to 1e-4 where it is cut, 1e-10 where it is whole),
/// however small the disc is against a pixel; a fraction at the rim of the disc
/// is good to a few per cent. The disc is round and even: flattening by
/// refraction and limb darkening are left out.
/// Throws as pixel_of_direction.
std::unordered_map<std::size_t, double> sun_disc_coverage(const MapProjection& projection, int size,
                                                          MapDirection sun,
                                                          double horizon_elevation_rad);

}  // namespace twilight
