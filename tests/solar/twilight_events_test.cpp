#include "solar/twilight_events.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "solar/sun_position.h"

namespace twilight {
namespace {

constexpr double kSecondsPerDay = 86400.0;
constexpr double kMinutesPerDay = 1440.0;

double minutes(const std::optional<UtcTime>& from, const std::optional<UtcTime>& to) {
  return kMinutesPerDay * days_between(from.value(), to.value());
}

void expect_within_s(const std::optional<UtcTime>& found, const std::string& published,
                     double tolerance_s) {
  ASSERT_TRUE(found.has_value()) << published;
  EXPECT_NEAR(kSecondsPerDay * days_between(parse_offset_date_time(published), *found), 0.0,
              tolerance_s)
      << published;
}

struct Published {
  Place place;
  std::string date, sunrise, sunset, offset;
};

void expect_published(const Published& day, double tolerance_s) {
  const UtcTime noon = parse_offset_date_time(day.date + "T12:00:00" + day.offset);
  const int offset_minutes = parse_utc_offset_minutes(day.date + "T12:00:00" + day.offset);
  const TwilightTimes times = twilight_times(day.place, noon, offset_minutes);
  expect_within_s(times.sunrise, day.date + "T" + day.sunrise + day.offset, tolerance_s);
  expect_within_s(times.sunset, day.date + "T" + day.sunset + day.offset, tolerance_s);
}

TEST(TwilightTimes, NrelPublishedToTheSecond) {
  // Reda & Andreas (2004), NREL/TP-560-34302, table of sunrise and sunset (whole seconds, cut off).
  // Theirs are geocentric: the Sun's parallax of 8.8" makes ours up to 1 s later in the morning and
  // earlier in the evening.
  for (const Published& day :
       std::vector<Published>{{{35.0, 0.0, 0.0}, "1994-01-02", "07:08:12", "16:59:55", "Z"},
                              {{-35.0, 0.0, 0.0}, "1996-07-05", "07:08:15", "17:01:04", "Z"},
                              {{-35.0, 0.0, 0.0}, "2004-12-04", "04:38:57", "19:02:02", "Z"}}) {
    expect_published(day, 2.0);
  }
  // The worked example (Golden, Colorado): sunrise 06:12:43, sunset 17:20:19. That program takes
  // both from one day of UT, so that its sunset is the one of the evening before, 2003-10-17 00:20
  // UT.
  const Place golden{39.742476, -105.1786, 0.0};
  expect_within_s(
      twilight_times(golden, parse_offset_date_time("2003-10-17T12:30:30-07:00"), -420).sunrise,
      "2003-10-17T06:12:43-07:00", 2.0);
  expect_within_s(
      twilight_times(golden, parse_offset_date_time("2003-10-16T12:30:30-07:00"), -420).sunset,
      "2003-10-16T17:20:19-07:00", 2.0);
}

TEST(TwilightTimes, UsnoPublishedToTheMinute) {
  // U.S. Naval Observatory tables for 39 N 105 W (UTC-7) and Beijing (UTC+8) in 2015, as carried in
  // pvlib's test suite (test_spa.py). Half a minute of rounding, some seconds of parallax and
  // place.
  const Place golden{39.0, -105.0, 0.0};
  const Place beijing{39.917, 116.383, 0.0};
  for (const Published& day :
       std::vector<Published>{{golden, "2015-01-02", "07:19:00", "16:49:00", "-07:00"},
                              {golden, "2015-04-02", "05:43:00", "18:24:00", "-07:00"},
                              {golden, "2015-08-02", "05:01:00", "19:10:00", "-07:00"},
                              {golden, "2015-12-02", "07:01:00", "16:38:00", "-07:00"},
                              {beijing, "2015-01-02", "07:36:00", "17:00:00", "+08:00"},
                              {beijing, "2015-04-02", "05:58:00", "18:39:00", "+08:00"},
                              {beijing, "2015-08-02", "05:13:00", "19:28:00", "+08:00"},
                              {beijing, "2015-12-02", "07:17:00", "16:50:00", "+08:00"}}) {
    expect_published(day, 35.0);
  }
}

TEST(TwilightTimes, TheSunStandsAtTheThresholdInOrder) {
  for (double latitude_deg : {-44.0, -10.0, 0.0, 23.4, 42.0}) {
    for (const char* noon :
         {"1905-06-21T12:00:00Z", "1959-12-31T12:00:00Z", "2003-12-08T12:00:00Z",
          "2016-12-31T12:00:00Z", "2024-03-20T12:00:00Z", "2100-12-31T12:00:00Z"}) {
      const Place place{latitude_deg, 5.0, 300.0};
      const TwilightTimes t = twilight_times(place, parse_offset_date_time(noon), 0);
      const std::vector<std::optional<UtcTime>> order = {
          t.astronomical_begin, t.nautical_begin, t.civil_begin,     t.sunrise, t.sunset,
          t.civil_end,          t.nautical_end,   t.astronomical_end};
      const std::vector<double> threshold_deg = {-18.0,        -12.0, -6.0,  -50.0 / 60.0,
                                                 -50.0 / 60.0, -6.0,  -12.0, -18.0};
      for (std::size_t i = 0; i < order.size(); ++i) {
        ASSERT_TRUE(order[i].has_value()) << latitude_deg << " " << noon << " " << i;
        EXPECT_NEAR(sun_position(place, *order[i]).elevation_deg, threshold_deg[i], 1e-5);
        if (i > 0) {
          EXPECT_GT(days_between(*order[i - 1], *order[i]), 0.0);
        }
      }
      // Morning and evening mirror each other about noon but for the drift of the declination.
      EXPECT_NEAR(minutes(t.civil_begin, t.sunrise), minutes(t.sunset, t.civil_end), 1.0);
      EXPECT_NEAR(minutes(t.astronomical_begin, t.sunrise), minutes(t.sunset, t.astronomical_end),
                  1.0);
    }
  }
}

TEST(TwilightTimes, EquatorAtTheEquinox) {
  // The Sun climbs vertically at 15 deg per hour (0.25 deg per minute): the day lasts 12 h plus
  // 2 x 0.8333/0.25 = 6.67 min, twilights (6 - 0.8333)/0.25 = 20.67 min and 6/0.25 = 24 min.
  const TwilightTimes t =
      twilight_times({0.0, 0.0, 0.0}, parse_offset_date_time("2024-03-20T12:00:00Z"), 0);
  EXPECT_NEAR(minutes(t.sunrise, t.sunset), 720.0 + 6.67, 0.5);
  EXPECT_NEAR(minutes(t.sunset, t.civil_end), 20.67, 0.05);
  EXPECT_NEAR(minutes(t.civil_end, t.nautical_end), 24.0, 0.05);
  EXPECT_NEAR(minutes(t.astronomical_begin, t.nautical_begin), 24.0, 0.05);
}

TEST(TwilightTimes, PolarDayAndNight) {
  const Place longyearbyen{78.22, 15.65, 0.0};
  const TwilightTimes summer =
      twilight_times(longyearbyen, parse_offset_date_time("2024-06-21T12:00:00+02:00"), 120);
  EXPECT_FALSE(summer.sunrise || summer.sunset || summer.civil_begin || summer.civil_end ||
               summer.nautical_begin || summer.nautical_end || summer.astronomical_begin ||
               summer.astronomical_end);
  // Noon elevation 90 - 78.22 - 23.44 = -11.66 deg: no civil twilight, but nautical.
  const TwilightTimes winter =
      twilight_times(longyearbyen, parse_offset_date_time("2024-12-21T12:00:00+01:00"), 60);
  EXPECT_FALSE(winter.sunrise || winter.sunset || winter.civil_begin || winter.civil_end);
  EXPECT_TRUE(winter.nautical_begin && winter.nautical_end);
  EXPECT_TRUE(winter.astronomical_begin && winter.astronomical_end);
}

TEST(TwilightTimes, GrazingSunIsFoundWhereItExists) {
  // Around the winter solstice's limit of sunrise, latitude 67.397: a Sun that shows for minutes.
  const UtcTime noon = parse_offset_date_time("2023-12-22T12:00:00Z");
  int risen = 0;
  for (double latitude_deg = 67.38; latitude_deg < 67.41; latitude_deg += 0.001) {
    const Place place{latitude_deg, 0.0, 0.0};
    double highest_deg = -90.0;
    for (int i = -60; i <= 60; ++i) {  // 20 minutes about culmination in steps of 10 s
      const UtcTime time = add_days(noon, (-120.0 + 10.0 * i) / kSecondsPerDay);
      highest_deg = std::max(highest_deg, sun_position(place, time).elevation_deg);
    }
    const TwilightTimes times = twilight_times(place, noon, 0);
    const bool visible = highest_deg > kSunriseElevationDeg;
    EXPECT_EQ(times.sunrise.has_value(), visible) << latitude_deg;
    EXPECT_EQ(times.sunset.has_value(), visible) << latitude_deg;
    risen += visible ? 1 : 0;
  }
  EXPECT_GT(risen, 5);
  EXPECT_LT(risen, 25);
}

TEST(TwilightTimes, EveryInstantOfALocalDayGivesTheSameDay) {
  const Place auckland{-36.85, 174.76, 0.0};
  const TwilightTimes morning =
      twilight_times(auckland, parse_offset_date_time("2024-08-01T00:00:00+12:00"), 720);
  const TwilightTimes night =
      twilight_times(auckland, parse_offset_date_time("2024-08-01T23:59:59+12:00"), 720);
  EXPECT_EQ(days_between(*morning.sunrise, *night.sunrise), 0.0);
  EXPECT_EQ(days_between(*morning.astronomical_end, *night.astronomical_end), 0.0);
  const TwilightTimes tomorrow =
      twilight_times(auckland, parse_offset_date_time("2024-08-02T00:00:00+12:00"), 720);
  EXPECT_NEAR(minutes(morning.sunrise, tomorrow.sunrise), kMinutesPerDay, 2.0);
  EXPECT_EQ(format_offset_date_time(*morning.sunrise, 720).substr(0, 10), "2024-08-01");
}

TEST(TwilightTimes, RefusesBadArguments) {
  EXPECT_THROW(twilight_times({91.0, 0.0, 0.0}, {}, 0), std::invalid_argument);
  EXPECT_THROW(twilight_times({0.0, 0.0, 0.0}, {}, 1440), std::invalid_argument);
  EXPECT_THROW(twilight_times({0.0, 0.0, 0.0}, {2400000.5, 0.0}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
