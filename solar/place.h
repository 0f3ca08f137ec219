// The observer's place on the WGS84 ellipsoid and the sphere that fits it there.
#pragma once

namespace twilight {

/// A place by WGS84 geodetic coordinates.
struct Place {
  double latitude_deg = 0.0;   ///< geodetic, north positive, -90..90
  double longitude_deg = 0.0;  ///< east positive, -180..360
  double height_m = 0.0;       ///< above the ellipsoid, -500..200000
};

/// Throws std::invalid_argument, naming the quantity, its value and its range, unless all three
/// coordinates of the place are finite and inside the ranges given above.
void check_place(const Place& place);

/// Radius of curvature, km, of the WGS84 ellipsoid's normal section through the place in an
/// azimuth (degrees clockwise from north, any finite value): Euler's formula
/// 1/R = cos^2(A)/M + sin^2(A)/N with the meridional radius M and the transverse radius N. It is
/// the radius of the sphere that best fits the ground under a path of sunlight in that azimuth;
/// the height of the place is not added. From 6335.439 (north-south at the equator) to 6399.594
/// (poles); error below 1e-9 km (GeographicLib). Throws std::invalid_argument for a bad place or
/// azimuth.
double radius_of_curvature_km(const Place& place, double azimuth_deg);

}  // namespace twilight
