#include "solar/sun_position.h"

#include <erfa.h>
#include <erfam.h>

#include <cmath>

namespace twilight {

SunPosition sun_position(const Place& place, const UtcTime& time) {
  check_place(place);
  const EphemerisTime t = ephemeris_time(time);

  // TT stands in for TDB: they differ by less than 2 ms. Outside 1900..2100 by
  // the day a zone's offset may add, ERFA's warning means nothing.
  double earth_heliocentric[2][3], earth_barycentric[2][3];
  eraEpv00(t.tt1, t.tt2, earth_heliocentric, earth_barycentric);

  double x = 0.0, y = 0.0, s = 0.0;
  eraXys06a(t.tt1, t.tt2, &x, &y, &s);
  eraASTROM observer;
  eraApco(t.tt1, t.tt2, earth_barycentric, earth_heliocentric[0], x, y, s, eraEra00(t.ut11, t.ut12),
          place.longitude_deg * ERFA_DD2R, place.latitude_deg * ERFA_DD2R, place.height_m, 0.0, 0.0,
          eraSp00(t.tt1, t.tt2), 0.0, 0.0, &observer);

  // The Sun when its light left: 8 min earlier. Its motion about the
  // barycentre is even over that time.
  const double light_time_days = observer.em * ERFA_AULT / ERFA_DAYSEC;
  double to_sun_au[3], direction[3], apparent[3], intermediate[3];
  double distance_au = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double sun = earth_barycentric[0][i] - earth_heliocentric[0][i];
    const double sun_velocity = earth_barycentric[1][i] - earth_heliocentric[1][i];
    to_sun_au[i] = sun - light_time_days * sun_velocity - observer.eb[i];
  }
  eraPn(to_sun_au, &distance_au, direction);
  eraAb(direction, observer.v, observer.em, observer.bm1, apparent);
  eraRxp(observer.bpn, apparent, intermediate);

  double right_ascension = 0.0, declination = 0.0;
  eraC2s(intermediate, &right_ascension, &declination);
  double azimuth = 0.0, zenith_distance = 0.0, hour_angle = 0.0;
  double observed_declination = 0.0, observed_right_ascension = 0.0;
  // The refraction constants given to eraApco are zero.
  eraAtioq(right_ascension, declination, &observer, &azimuth, &zenith_distance, &hour_angle,
           &observed_declination, &observed_right_ascension);

  double azimuth_deg = azimuth * ERFA_DR2D;
  if (azimuth_deg >= 360.0) azimuth_deg -= 360.0;
  return {90.0 - zenith_distance * ERFA_DR2D, azimuth_deg, distance_au};
}

}  // namespace twilight
