#include "solar/sun_position.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace twilight {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// Sun's place at distance `au` seen from the Earth's centre, whose parallax of 8.794143" at 1 au
// (IAU 1976) is taken off; good to 0.03", the figure of the Earth.
struct Geocentric {
  double declination_deg;
  double distance_au;
};

Geocentric geocentric(const Place& place, const SunPosition& sun) {
  constexpr double kParallaxRad = 8.794143 / 3600.0 * kDegree;
  const double e = sun.elevation_deg * kDegree +
                   kParallaxRad / sun.distance_au * std::cos(sun.elevation_deg * kDegree);
  const double latitude = place.latitude_deg * kDegree;
  const double sine = std::sin(latitude) * std::sin(e) +
                      std::cos(latitude) * std::cos(e) * std::cos(sun.azimuth_deg * kDegree);
  return {std::asin(sine) / kDegree, sun.distance_au + kParallaxRad * std::sin(e)};
}

TEST(SunPosition, NrelWorkedExample) {
  // Reda & Andreas (2004), Solar Energy 76, 577, Table A5.1: 2003-10-17 12:30:30 UTC-7, Delta T =
  // 67 s (3 s more than was true: 0.00003 deg). Their algorithm claims 0.0003 deg.
  const Place place{39.742476, -105.1786, 1830.14};
  const SunPosition sun = sun_position(place, parse_offset_date_time("2003-10-17T12:30:30-07:00"));
  EXPECT_NEAR(sun.elevation_deg, 39.872046, 3e-4);
  EXPECT_NEAR(sun.azimuth_deg, 194.34024, 4e-4);
  // Refraction after their Eq. 42 with 820 hPa, 11 deg C: zenith angle 50.11162 deg.
  const double refraction_deg =
      820.0 / 1010.0 * 283.0 / (273.0 + 11.0) * 1.02 /
      (60.0 * std::tan((sun.elevation_deg + 10.3 / (sun.elevation_deg + 5.11)) * kDegree));
  EXPECT_NEAR(90.0 - sun.elevation_deg - refraction_deg, 50.11162, 3e-4);
  const Geocentric centre = geocentric(place, sun);
  EXPECT_NEAR(centre.declination_deg, -9.31434, 3e-4);
  EXPECT_NEAR(centre.distance_au, 0.9965422974, 2e-6);
}

TEST(SunPosition, MeeusExample25b) {
  // Meeus, Astronomical Algorithms (2nd ed.), Example 25.b: 1992-10-13 0h TD (TT - UTC = 59.184 s):
  // apparent declination -7 deg 47' 01.74", distance 0.99760775 au.
  const UtcTime time = parse_offset_date_time("1992-10-12T23:59:00.816Z");
  for (const Place& place :
       {Place{0.0, 0.0, 0.0}, Place{52.0, 120.0, 0.0}, Place{-33.0, -100.0, 0.0}}) {
    const Geocentric centre = geocentric(place, sun_position(place, time));
    EXPECT_NEAR(centre.declination_deg, -(7.0 + 47.0 / 60.0 + 1.74 / 3600.0), 3e-5);
    EXPECT_NEAR(centre.distance_au, 0.99760775, 1e-6);
  }
}

TEST(SunPosition, EquinoxesAndSolstices2024) {
  // U.S. Naval Observatory, Earth's Seasons: 2024 Mar 20 03:06, Jun 20 20:51, Sep 22 12:44, Dec 21
  // 09:20 (UT). Half a minute is 0.00014 deg at an equinox, the Sun's latitude up to 0.0003 deg.
  const Place place{30.0, 10.0, 0.0};
  const auto declination_deg = [&](const char* time) {
    return geocentric(place, sun_position(place, parse_offset_date_time(time))).declination_deg;
  };
  EXPECT_NEAR(declination_deg("2024-03-20T03:06:00Z"), 0.0, 5e-4);
  EXPECT_NEAR(declination_deg("2024-09-22T12:44:00Z"), 0.0, 5e-4);
  // Obliquity of date (IAU 2006: 23.43928 - 0.01300 T deg) plus up to 0.0026 deg of nutation.
  EXPECT_NEAR(declination_deg("2024-06-20T20:51:00Z"), 23.4361, 3e-3);
  EXPECT_NEAR(declination_deg("2024-12-21T09:20:00Z"), -23.4360, 3e-3);
}

TEST(SunPosition, PerihelionAndAphelion2024) {
  // U.S. Naval Observatory / JPL: perihelion 2024 Jan 3 00:39 UT, 147 100 632 km; aphelion Jul 5
  // 05:06 UT, 152 099 968 km.
  constexpr double kAuKm = 149597870.7;
  const Place place{30.0, 10.0, 0.0};
  const auto distance_au = [&](const char* time) {
    return geocentric(place, sun_position(place, parse_offset_date_time(time))).distance_au;
  };
  EXPECT_NEAR(distance_au("2024-01-03T00:39:00Z"), 147100632.0 / kAuKm, 2e-6);
  EXPECT_NEAR(distance_au("2024-07-05T05:06:00Z"), 152099968.0 / kAuKm, 2e-6);
}

TEST(SunPosition, SteadyThroughTheYears) {
  // The tropical year is 365.24219 d: the declination returns after it to a few arc minutes (the
  // Moon and planets disturb the Earth), in every part of the time scale and across its seams.
  const Place place{45.0, 0.0, 0.0};
  const UtcTime start = parse_offset_date_time("1900-03-21T12:00:00Z");
  double previous = geocentric(place, sun_position(place, start)).declination_deg;
  for (int year = 1; year <= 200; ++year) {
    const SunPosition sun = sun_position(place, add_days(start, 365.24219 * year));
    const double declination_deg = geocentric(place, sun).declination_deg;
    EXPECT_NEAR(declination_deg, previous, 0.02) << 1900 + year;
    previous = declination_deg;
  }
  // In the second before a seam the Earth turns 15.041" per second of UT1 and the Sun's right
  // ascension grows by 0.046" (early January). UTC was set back by 0.10776 s into 1972 and by a
  // leap second into 2017 (IERS), and UT1 = UTC follows it; a jump of 0.04" would show.
  struct Seam {
    const char* time;
    double set_back_s;
  };
  for (const Seam& seam : {Seam{"1920-01-01T00:00:00Z", 0.0}, Seam{"1941-01-01T00:00:00Z", 0.0},
                           Seam{"1960-01-01T00:00:00Z", 0.0}, Seam{"1972-01-01T00:00:00Z", 0.10776},
                           Seam{"2017-01-01T00:00:00Z", 1.0}}) {
    const UtcTime after = parse_offset_date_time(seam.time);
    const SunPosition a = sun_position(place, add_days(after, -1.0 / 86400.0));
    const SunPosition b = sun_position(place, after);
    const double moved_deg =
        std::hypot(b.elevation_deg - a.elevation_deg,
                   (b.azimuth_deg - a.azimuth_deg) * std::cos(b.elevation_deg * kDegree));
    const double expected_deg = std::abs(15.041 * (1.0 - seam.set_back_s) - 0.046) / 3600.0 *
                                std::cos(geocentric(place, b).declination_deg * kDegree);
    EXPECT_NEAR(moved_deg, expected_deg, 0.04 / 3600.0) << seam.time;
  }
}

TEST(SunPosition, SouthAtNoonOfTheNorthEastInTheMorning) {
  const Place berlin{52.52, 13.40, 34.0};
  EXPECT_NEAR(sun_position(berlin, parse_offset_date_time("2024-03-20T06:00:00+01:00")).azimuth_deg,
              90.0, 8.0);
  EXPECT_NEAR(sun_position(berlin, parse_offset_date_time("2024-03-20T12:14:00+01:00")).azimuth_deg,
              180.0, 0.5);
  EXPECT_NEAR(sun_position(berlin, parse_offset_date_time("2024-03-20T18:20:00+01:00")).azimuth_deg,
              270.0, 8.0);
}

TEST(SunPosition, LongitudesAFullTurnApartAreOnePlace) {
  const UtcTime time = parse_offset_date_time("2003-12-08T17:00:00+01:00");
  const SunPosition west = sun_position({48.0, -75.0, 200.0}, time);
  const SunPosition east = sun_position({48.0, 285.0, 200.0}, time);
  EXPECT_NEAR(west.elevation_deg, east.elevation_deg, 1e-10);
  EXPECT_NEAR(west.azimuth_deg, east.azimuth_deg, 1e-10);
}

TEST(SunPosition, AntipodesSeeOppositeElevationsButForParallaxAndAberration) {
  // The ellipsoid's normals at antipodes are opposite. Parallax lowers each Sun by p cos e, p =
  // 8.794" at 1 au; the rotation's speed (0.319" of aberration at the equator) shifts it east, by
  // -0.319" cos(latitude) sin e sin A in elevation. 0.05" are left to the figure of the Earth.
  const UtcTime time = parse_offset_date_time("2010-05-05T03:00:00Z");
  const SunPosition suns[] = {sun_position({35.0, 20.0, 0.0}, time),
                              sun_position({-35.0, 200.0, 0.0}, time)};
  double sum_deg = 0.0, expected_deg = 0.0;
  for (const SunPosition& sun : suns) {
    const double e = sun.elevation_deg * kDegree;
    sum_deg += sun.elevation_deg;
    expected_deg -= 8.794143 / 3600.0 / sun.distance_au * std::cos(e) +
                    0.319 / 3600.0 * std::cos(35.0 * kDegree) * std::sin(e) *
                        std::sin(sun.azimuth_deg * kDegree);
  }
  EXPECT_NEAR(sum_deg, expected_deg, 0.05 / 3600.0);
}

TEST(SunPosition, RefusesBadPlaceAndTime) {
  EXPECT_THROW(sun_position({91.0, 0.0, 0.0}, {}), std::invalid_argument);
  EXPECT_THROW(sun_position({0.0, 0.0, 0.0}, {2400000.5, 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
