#include "solar/star_position.h"

#include <erfa.h>
#include <erfam.h>
#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

namespace twilight {
namespace {

void require_range(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return;
  throw std::invalid_argument(
      fmt::format("{} = {} deg: must be in {}..{}", name, value, low, high));
}

}  // namespace

StarPosition star_position(const Place& place, const UtcTime& time, double right_ascension_deg,
                           double declination_deg) {
  check_place(place);
  require_range("right ascension", right_ascension_deg, 0.0, 360.0);
  require_range("declination", declination_deg, -90.0, 90.0);
  const EphemerisTime t = ephemeris_time(time);

  double earth_heliocentric[2][3], earth_barycentric[2][3];
  eraEpv00(t.tt1, t.tt2, earth_heliocentric, earth_barycentric);
  double x = 0.0, y = 0.0, s = 0.0;
  eraXys06a(t.tt1, t.tt2, &x, &y, &s);
  constexpr double kTemperatureC = 10.0, kHumidity = 0.5, kWavelengthUm = 0.55;
  const double pressure_hpa = 1013.25 * std::exp(-place.height_m / 8434.0);
  double refraction_a = 0.0, refraction_b = 0.0;
  eraRefco(pressure_hpa, kTemperatureC, kHumidity, kWavelengthUm, &refraction_a, &refraction_b);
  eraASTROM observer;
  eraApco(t.tt1, t.tt2, earth_barycentric, earth_heliocentric[0], x, y, s, eraEra00(t.ut11, t.ut12),
          place.longitude_deg * ERFA_DD2R, place.latitude_deg * ERFA_DD2R, place.height_m, 0.0, 0.0,
          eraSp00(t.tt1, t.tt2), refraction_a, refraction_b, &observer);
  double right_ascension = 0.0, declination = 0.0;
  eraAtciqz(right_ascension_deg * ERFA_DD2R, declination_deg * ERFA_DD2R, &observer,
            &right_ascension, &declination);
  double azimuth = 0.0, zenith_distance = 0.0, hour_angle = 0.0;
  double observed_declination = 0.0, observed_right_ascension = 0.0;
  eraAtioq(right_ascension, declination, &observer, &azimuth, &zenith_distance, &hour_angle,
           &observed_declination, &observed_right_ascension);
  double azimuth_deg = azimuth * ERFA_DR2D;
  if (azimuth_deg >= 360.0) azimuth_deg -= 360.0;
  return {90.0 - zenith_distance * ERFA_DR2D, azimuth_deg};
}

}  // namespace twilight
