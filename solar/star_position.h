// Where a star stands for an observer.
#pragma once

#include "solar/place.h"
#include "solar/time_point.h"

namespace twilight {

struct StarPosition {
  double elevation_deg = 0.0;  ///< as it is seen, refraction included
  double azimuth_deg = 0.0;    ///< clockwise from north, [0, 360)
};

/// The observed place of a star of ICRS right ascension (0..360 deg) and declination (-90..90 deg)
/// at the epoch of `time`: its own proper motion and parallax are left out (the catalogue's place
/// of 2000 is off by below 0.02 deg for all but some dozen bright stars). Aberration,
/// precession-nutation and Earth rotation as in sun_position; refraction at 550 nm for 10 degrees C
/// and the standard atmosphere's pressure at the place's height (ERFA eraRefco), within 0.01 deg
/// down to 10 degrees of elevation and 0.1 deg at 3; nearer to the horizon it is not meant to hold.
/// Throws std::invalid_argument for what is out of range.
StarPosition star_position(const Place& place, const UtcTime& time, double right_ascension_deg,
                           double declination_deg);

}  // namespace twilight
