#include "solar/time_point.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

constexpr double kSecondsPerDay = 86400.0;

double julian_date(const char* text) {
  const UtcTime time = parse_offset_date_time(text);
  return time.jd1 + time.jd2;
}

double seconds_between(const char* earlier, const char* later) {
  return kSecondsPerDay *
         days_between(parse_offset_date_time(earlier), parse_offset_date_time(later));
}

double tt_minus_ut1_s(const UtcTime& time) {
  const EphemerisTime t = ephemeris_time(time);
  return kSecondsPerDay * ((t.tt1 - t.ut11) + (t.tt2 - t.ut12));
}

double terrestrial_seconds_between(const char* earlier, const char* later) {
  const EphemerisTime a = ephemeris_time(parse_offset_date_time(earlier));
  const EphemerisTime b = ephemeris_time(parse_offset_date_time(later));
  return kSecondsPerDay * ((b.tt1 - a.tt1) + (b.tt2 - a.tt2));
}

std::string complaint(const std::string& text) {
  try {
    parse_offset_date_time(text);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(OffsetDateTime, JulianDatesPublished) {
  // J2000.0 in UTC is JD 2451545.0 at noon; Reda & Andreas 2004, worked example: JD 2452930.312847;
  // Meeus, Astronomical Algorithms, Ch. 7: 1957 October 4.81 = 2436116.31, 1987 April 10 0h =
  // 2446895.5, 1900 January 1 0h = 2415020.5.
  EXPECT_DOUBLE_EQ(julian_date("2000-01-01T12:00:00Z"), 2451545.0);
  EXPECT_NEAR(julian_date("2003-10-17T12:30:30-07:00"), 2452930.312847, 5e-7);
  EXPECT_NEAR(julian_date("1957-10-04T19:26:24Z"), 2436116.31, 1e-9);
  EXPECT_DOUBLE_EQ(julian_date("1987-04-10T00:00:00Z"), 2446895.5);
  EXPECT_DOUBLE_EQ(julian_date("1900-01-01T00:00:00Z"), 2415020.5);
}

TEST(OffsetDateTime, TheSameInstantInEveryZone) {
  EXPECT_EQ(seconds_between("2003-12-08T16:00:00Z", "2003-12-08T17:00:00+01:00"), 0.0);
  EXPECT_EQ(seconds_between("2003-12-08T16:00:00Z", "2003-12-08T10:30:00-05:30"), 0.0);
  EXPECT_EQ(seconds_between("2003-12-31T23:30:00Z", "2004-01-01T01:30:00+02:00"), 0.0);
  EXPECT_EQ(seconds_between("2004-03-01T02:00:00Z", "2004-02-29T23:00:00-03:00"), 0.0);
  EXPECT_EQ(seconds_between("2003-12-08t16:00:00z", "2003-12-08T16:00:00-00:00"), 0.0);
  EXPECT_NEAR(seconds_between("2003-12-08T16:00:00Z", "2003-12-08T16:00:00.123456Z"), 0.123456,
              1e-7);
}

TEST(OffsetDateTime, OffsetKept) {
  EXPECT_EQ(parse_utc_offset_minutes("2003-12-08T17:00:00+01:00"), 60);
  EXPECT_EQ(parse_utc_offset_minutes("2003-12-08T17:00:00-09:30"), -570);
  EXPECT_EQ(parse_utc_offset_minutes("2003-12-08T17:00:00Z"), 0);
  EXPECT_THROW(parse_utc_offset_minutes("2003-12-08T17:00:60Z"), std::invalid_argument);
}

TEST(OffsetDateTime, PrintsWhatItRead) {
  for (const char* text :
       {"2003-12-08T17:00:00+01:00", "1900-01-01T00:00:00+14:00", "2100-12-31T23:59:59-12:00",
        "1999-12-31T23:59:59Z", "2024-02-29T00:00:00+05:45", "1959-12-31T23:59:59Z",
        "1960-01-01T00:00:00Z", "1968-01-31T23:59:59Z", "2016-12-31T23:59:60Z",
        "2017-01-01T05:29:60+05:30"}) {
    EXPECT_EQ(format_offset_date_time(parse_offset_date_time(text), parse_utc_offset_minutes(text)),
              text);
  }
  const UtcTime precise = parse_offset_date_time("2003-12-08T16:59:59.987654321Z");
  EXPECT_EQ(format_offset_date_time(precise, 0, 6), "2003-12-08T16:59:59.987654Z");
  EXPECT_EQ(format_offset_date_time(precise, 60), "2003-12-08T18:00:00+01:00");
  EXPECT_EQ(format_offset_date_time(parse_offset_date_time("2003-12-31T23:59:59.6Z"), 0),
            "2004-01-01T00:00:00Z");
}

TEST(OffsetDateTime, LeapSecondLastsOneSecond) {
  // IERS Bulletin C 52: leap second at the end of 2016-12-31.
  EXPECT_NEAR(terrestrial_seconds_between("2016-12-31T23:59:59Z", "2016-12-31T23:59:60Z"), 1.0,
              1e-6);
  EXPECT_NEAR(terrestrial_seconds_between("2016-12-31T23:59:60Z", "2017-01-01T00:00:00Z"), 1.0,
              1e-6);
  EXPECT_NEAR(terrestrial_seconds_between("2015-12-31T23:59:59Z", "2016-01-01T00:00:00Z"), 1.0,
              1e-6);
  EXPECT_EQ(seconds_between("2016-12-31T23:59:60.5Z", "2017-01-01T00:59:60.5+01:00"), 0.0);
}

TEST(OffsetDateTime, SecondSixtyOnlyWhereUtcHadOne) {
  for (const char* text : {"2015-12-31T23:59:60Z", "2016-12-31T23:58:60Z", "2016-12-31T22:59:60Z",
                           "2016-12-31T23:59:60+01:00", "1959-12-31T23:59:60Z",
                           "1971-12-31T23:59:60Z", "2050-12-31T23:59:60Z"}) {
    EXPECT_NE(complaint(text).find("leap second"), std::string::npos) << text;
  }
}

TEST(OffsetDateTime, RefusesWhatIsNotRfc3339) {
  for (const char* text : {"",
                           "2003",
                           "2003-12-08",
                           "2003-12-08T17:00:00",
                           "2003-12-08T17:00Z",
                           "2003-12-08 17:00:00Z",
                           "2003-12-08T17:00:00+0100",
                           "2003-12-08T17:00:00+1:00",
                           "2003-12-08T17:00:00+01:00 ",
                           " 2003-12-08T17:00:00+01:00",
                           "2003-12-08T17:00:00.Z",
                           "2003-12-08T17:00:00,5Z",
                           "2003-13-08T17:00:00Z",
                           "2003-00-08T17:00:00Z",
                           "2003-02-29T17:00:00Z",
                           "2100-02-29T17:00:00Z",
                           "2003-04-31T00:00:00Z",
                           "2003-12-00T17:00:00Z",
                           "2003-12-08T24:00:00Z",
                           "2003-12-08T17:60:00Z",
                           "2003-12-08T17:00:61Z",
                           "2003-12-08T17:00:00+24:00",
                           "2003-12-08T17:00:00+01:60",
                           "1899-12-31T23:59:59Z",
                           "2101-01-01T00:00:00Z",
                           "03-12-08T17:00:00Z",
                           "2003-12-08T17:00:00ZZ",
                           "-003-12-08T17:00:00Z"}) {
    const std::string message = complaint(text);
    EXPECT_NE(message.find('"' + std::string(text) + '"'), std::string::npos) << text;
  }
  EXPECT_NE(complaint("2003-13-08T17:00:00Z").find("month 13 is outside 1..12"), std::string::npos);
}

TEST(OffsetDateTime, RefusesToPrintOutsideItsRange) {
  const UtcTime time;
  EXPECT_THROW(format_offset_date_time(time, 1440), std::invalid_argument);
  EXPECT_THROW(format_offset_date_time(time, 0, 10), std::invalid_argument);
  EXPECT_THROW(format_offset_date_time({2400000.0, 0.0}, 0), std::invalid_argument);
  EXPECT_THROW(format_offset_date_time({std::nan(""), 0.0}, 0), std::invalid_argument);
}

TEST(LocalMidnight, BeginsTheCivilDayOfTheInstant) {
  const UtcTime evening = parse_offset_date_time("2003-12-08T23:30:00Z");
  EXPECT_EQ(format_offset_date_time(local_midnight(evening, 0), 0), "2003-12-08T00:00:00Z");
  EXPECT_EQ(format_offset_date_time(local_midnight(evening, 60), 60), "2003-12-09T00:00:00+01:00");
  EXPECT_EQ(format_offset_date_time(local_midnight(evening, 60, 1), 60),
            "2003-12-10T00:00:00+01:00");
  for (int offset : {-720, -570, -1, 0, 60, 345, 840}) {  // midnight begins its own day
    const UtcTime midnight = local_midnight(evening, offset);
    EXPECT_EQ(days_between(midnight, local_midnight(midnight, offset)), 0.0) << offset;
  }
}

TEST(DeltaT, EspenakMeeusValues) {
  // Espenak & Meeus 2006 polynomials at mid-June 1900 and mid-July 1950 as evaluated in pvlib's
  // test suite (test_spa.py): -2.1171894 s, 29.289261 s.
  EXPECT_NEAR(delta_t_s(1900.0 + 5.5 / 12.0), -2.1171894, 1e-6);
  EXPECT_NEAR(delta_t_s(1950.0 + 6.5 / 12.0), 29.289261, 1e-6);
  EXPECT_THROW(delta_t_s(1963.0), std::invalid_argument);
  EXPECT_THROW(delta_t_s(std::nan("")), std::invalid_argument);
}

TEST(DeltaT, TerrestrialTimeRunsOnAcrossThePieces) {
  // IERS: TAI - UTC was 10 s from 1972-01-01, 32 s from 1999-01-01 and 37 s from 2017-01-01.
  EXPECT_NEAR(tt_minus_ut1_s(parse_offset_date_time("1972-01-01T00:00:00Z")), 42.184, 1e-4);
  EXPECT_NEAR(tt_minus_ut1_s(parse_offset_date_time("2003-12-08T16:00:00Z")), 64.184, 1e-4);
  EXPECT_NEAR(tt_minus_ut1_s(parse_offset_date_time("2026-06-01T00:00:00Z")), 69.184, 1e-4);
  // Pieces of Delta T join to 0.1 s; Delta T joins UTC's own difference in 1960 to 1 s.
  EXPECT_NEAR(delta_t_s(1920.0 - 1e-9), delta_t_s(1920.0), 0.1);
  EXPECT_NEAR(delta_t_s(1941.0 - 1e-9), delta_t_s(1941.0), 0.1);
  EXPECT_NEAR(terrestrial_seconds_between("1959-12-31T12:00:00Z", "1960-01-01T12:00:00Z"),
              kSecondsPerDay, 1.0);
}

TEST(EphemerisTime, RefusesOtherCenturies) {
  EXPECT_THROW(ephemeris_time({2415019.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(ephemeris_time({2488436.0, 0.0}), std::invalid_argument);
  EXPECT_NO_THROW(ephemeris_time(parse_offset_date_time("1900-01-01T00:00:00+14:00")));
  EXPECT_NO_THROW(ephemeris_time(parse_offset_date_time("2100-12-31T23:59:59-12:00")));
}

}  // namespace
}  // namespace twilight
