// Instants: UTC as ERFA's two-part Julian date, RFC 3339 text, and the time scales behind the Sun.
#pragma once

#include <string>
#include <string_view>

namespace twilight {

/// An instant, as a two-part (quasi-)Julian date jd1 + jd2 in days of UTC, ERFA's convention: on a
/// day with a leap second the day is 86401 s long. Before 1960, where UTC is not defined, the
/// scale is universal time (UT1). The default is 2000-01-01T12:00:00Z.
struct UtcTime {
  double jd1 = 2451545.0;
  double jd2 = 0.0;
};

/// First and last calendar year accepted (of the local date in the text). ERFA's solar ephemeris
/// and the Delta T expressions used here hold over 1900..2100.
inline constexpr int kFirstYear = 1900;
inline constexpr int kLastYear = 2100;

/// The instant of an RFC 3339 date-time "2003-12-08T17:00:00+01:00": full date, 'T', hh:mm:ss,
/// optional fraction of a second (any number of digits), then 'Z' or +hh:mm / -hh:mm (up to
/// 23:59). "t" and "z" are accepted (RFC 3339, Sec. 5.6). A second of 60 is accepted exactly where
/// UTC inserted a leap second (ERFA's table, complete to 2017-01-01).
/// Error: below 1 us. Throws std::invalid_argument, quoting the text and what is wrong with it,
/// on any departure from the form, dates that do not exist and years outside 1900..2100.
UtcTime parse_offset_date_time(std::string_view text);

/// The offset of local time from UTC in such a text, in minutes, east positive (+60 for "+01:00",
/// 0 for "Z"). Checks the whole text like parse_offset_date_time and throws the same.
int parse_utc_offset_minutes(std::string_view text);

/// The instant as RFC 3339 text in the zone offset_minutes (-1439..1439, east positive) from UTC,
/// rounded to fraction_digits (0..9) decimals of the second; offset 0 is written "Z". Leap seconds
/// print as second 60. Throws std::invalid_argument for an argument outside its range or an
/// instant outside 1900..2100.
std::string format_offset_date_time(const UtcTime& time, int offset_minutes,
                                    int fraction_digits = 0);

/// The instant at which the local civil day containing `time` begins (00:00:00 at the offset of
/// offset_minutes, -1439..1439, from UTC); plus_days (may be negative) civil days later. An
/// instant within 1 us of midnight counts as midnight. Throws std::invalid_argument as
/// format_offset_date_time does.
UtcTime local_midnight(const UtcTime& time, int offset_minutes, int plus_days = 0);

/// The instant `days` days of UTC (quasi-Julian; may be negative) after `time`.
UtcTime add_days(const UtcTime& time, double days);

/// later - earlier in days of UTC (quasi-Julian: a leap second is not counted as extra).
double days_between(const UtcTime& earlier, const UtcTime& later);

/// Terrestrial time (for the ephemeris) and UT1 (for the Earth's rotation) of one instant, both as
/// two-part Julian dates in days.
struct EphemerisTime {
  double tt1 = 0.0, tt2 = 0.0;
  double ut11 = 0.0, ut12 = 0.0;
};

/// TT and UT1 of an instant.
/// From 1960: TT = UTC + (TAI - UTC) + 32.184 s with ERFA's leap seconds, and UT1 = UTC for lack
/// of IERS data. |UT1 - UTC| < 0.9 s by definition of UTC since 1972 (below 0.2 s in 1960..1971),
/// so the Earth's angle is off by less than 0.0038 deg.
/// Before 1960: UT1 = the given time, TT = UT1 + delta_t_s.
/// Through a leap second UT1 = UTC makes the Earth pause: the jump of UT1 - UTC that IERS
/// tabulates. After the last leap second known the table's last value stays: leap seconds to come
/// (or their abolition) leave TT some seconds to two minutes off by 2100, 0.0015 deg in the Sun's
/// place; but if UTC is then no longer kept near UT1, times read as UTC turn the Earth wrongly by
/// that drift (0.0042 deg per second). Throws std::invalid_argument for an instant more than a day
/// outside 1900..2100.
EphemerisTime ephemeris_time(const UtcTime& time);

/// Delta T = TT - UT1 in seconds of a decimal year in 1899..1962: polynomials of Espenak & Meeus,
/// Five Millennium Canon of Solar Eclipses, NASA/TP-2006-214141 (2006), Sec. 2.7, pieces 1900-1920,
/// 1920-1941 and 1941-1961. Error: below 1 s. Throws std::invalid_argument outside that range.
double delta_t_s(double decimal_year);

}  // namespace twilight
