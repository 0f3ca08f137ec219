// Where the Sun stands for an observer: its apparent topocentric place without refraction.
#pragma once

#include "solar/place.h"
#include "solar/time_point.h"

namespace twilight {

/// Direction and distance of the Sun's centre from the observer.
struct SunPosition {
  double elevation_deg = 0.0;  ///< above the plane normal to the ellipsoid's normal; no refraction
  double azimuth_deg = 0.0;    ///< clockwise from north, [0, 360)
  double distance_au = 1.0;    ///< observer to Sun's centre at emission, astronomical units
};

/// The Sun's apparent topocentric place: the Earth by ERFA's VSOP2000-based ephemeris, light time,
/// stellar aberration (annual and diurnal), IAU 2006/2000A precession-nutation, Earth rotation
/// angle, and diurnal parallax of a WGS84 observer; no refraction, no polar motion.
/// Error: 0.0002 deg (polar motion) for given TT and UT1; with UT1 = UTC (see ephemeris_time) below
/// 0.004 deg; the plumb line departs from the ellipsoid's normal, which is the vertical here, by up
/// to about 0.02 deg in high mountains. Throws std::invalid_argument for a bad place or an instant
/// outside 1900..2100.
SunPosition sun_position(const Place& place, const UtcTime& time);

}  // namespace twilight
