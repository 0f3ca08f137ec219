// The Sun's place after Preetham et al. (1999), A.6.
#pragma once

#include <string_view>

namespace twilight {

/// Direction of the Sun.
struct PreethamSunAngles {
  double zenith_angle_rad = 0.0;           ///< 0..pi; above pi/2 below the horizon
  double azimuth_west_of_south_rad = 0.0;  ///< -pi..pi
};

/// Solar time, decimal hours, of standard time (decimal hours), day of the year J (1..366), the
/// zone's standard meridian SM and the site's longitude L: t_s + 0.170 sin(4 pi (J - 80) / 373)
/// - 0.129 sin(2 pi (J - 8) / 355) + 12 (SM - L) / pi. Their longitudes count west; these count
/// east (rad), so the last term is 12 (L - SM) / pi.
double preetham_solar_time_h(double standard_time_h, int day_of_year, double meridian_east_rad,
                             double longitude_east_rad);

/// Declination, rad, of a day of the year: 0.4093 sin(2 pi (J - 81) / 368).
double preetham_declination_rad(int day_of_year);

/// From latitude (rad, north), declination (rad) and solar time (h). The azimuth's denominator is
/// -(cos l sin d + sin l cos d cos(pi t / 12)): as printed, cos l sin d - sin l cos d cos(pi t /
/// 12), it would put the Sun of a summer evening south of west.
PreethamSunAngles preetham_sun_angles(double latitude_rad, double declination_rad,
                                      double solar_time_h);

/// Of a place (degrees, east positive) and an RFC 3339 date-time, whose offset from UTC says the
/// standard meridian (15 degrees an hour). Within 1 degree of elevation of solar/sun_position.h
/// (PreethamSunPosition.StaysByTheEphemeris), no refraction. Throws std::invalid_argument as
/// parse_offset_date_time.
PreethamSunAngles preetham_sun_position(double latitude_deg, double longitude_deg,
                                        std::string_view time);

}  // namespace twilight
