// Points within a piece of a ray.
#pragma once

#include <algorithm>
#include <cmath>

#include "atmosphere/refraction.h"

namespace twilight {

/// A point of a ray: its place, and the ray's zenith angle there.
struct PiecePoint {
  double altitude_km, angle_rad, zenith_rad;
};

/// The point at the share f (0..1) of a piece's length, on the chord between its ends about an
/// Earth of radius_km: exact for straight rays, however thick the shell.
inline PiecePoint point_on(const PathPiece& piece, double f, double radius_km) {
  const double r0 = radius_km + piece.start_altitude_km, r1 = radius_km + piece.end_altitude_km;
  const double turn = piece.end_angle_rad - piece.start_angle_rad;
  const double line = std::lerp(r0, r1, f), half = std::sin(0.5 * turn);
  // r^2 = line^2 - sag, without cancellation.
  const double sag = 4 * f * (1 - f) * r0 * r1 * half * half;
  const double r = std::sqrt(line * line - sag);
  const double angle = std::atan2(f * r1 * std::sin(turn), (1 - f) * r0 + f * r1 * std::cos(turn));
  const double bent = piece.end_zenith_rad - piece.start_zenith_rad + turn;
  return {std::lerp(piece.start_altitude_km, piece.end_altitude_km, f) - sag / (r + line),
          piece.start_angle_rad + angle, piece.start_zenith_rad - angle + f * bent};
}

/// The share of the piece's length at which it reaches an altitude between those of its ends.
inline double share_at(const PathPiece& piece, double altitude_km, double radius_km) {
  const double z0 = piece.start_altitude_km, z1 = piece.end_altitude_km;
  const double half = std::sin(0.5 * (piece.end_angle_rad - piece.start_angle_rad));
  const double chord =
      std::sqrt((z1 - z0) * (z1 - z0) + 4 * (radius_km + z0) * (radius_km + z1) * half * half);
  if (!(chord > 0)) return 0;
  const double foot = ((z1 - z0) * (2 * radius_km + z0 + z1) - chord * chord) / (2 * chord);
  const double square = foot * foot + (altitude_km - z0) * (2 * radius_km + altitude_km + z0);
  const double root = std::sqrt(std::max(0.0, square));
  return std::clamp((-foot + (z1 > z0 ? root : -root)) / chord, 0.0, 1.0);
}

}  // namespace twilight
