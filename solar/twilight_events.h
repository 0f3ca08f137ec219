// When the Sun crosses the elevations that bound day, the three twilights and night.
#pragma once

#include <optional>

#include "solar/place.h"
#include "solar/time_point.h"

namespace twilight {

/// Geometric elevations of the Sun's centre, degrees. Sunrise and sunset: 34' of refraction and 16'
/// of semidiameter below the horizon (U.S. Naval Observatory's convention).
inline constexpr double kSunriseElevationDeg = -50.0 / 60.0;
inline constexpr double kCivilTwilightElevationDeg = -6.0;
inline constexpr double kNauticalTwilightElevationDeg = -12.0;
inline constexpr double kAstronomicalTwilightElevationDeg = -18.0;

/// Instants of one local civil day; empty where the Sun does not cross that elevation on the day.
/// "begin" is the morning's crossing upward, "end" the evening's downward. Near the limits of polar
/// day and night an evening may end after local midnight and then belongs to the next civil day:
/// an end may precede the begin of the same day.
struct TwilightTimes {
  std::optional<UtcTime> sunrise, sunset;
  std::optional<UtcTime> civil_begin, civil_end;
  std::optional<UtcTime> nautical_begin, nautical_end;
  std::optional<UtcTime> astronomical_begin, astronomical_end;
};

/// Events of the civil day (24 h from local midnight, offset utc_offset_minutes from UTC,
/// -1439..1439, east positive) that contains the instant. The Sun's elevation is sun_position's at
/// the place: topocentric, without dip of the horizon, whatever the height. Where a day holds two
/// crossings of a kind, begin is the first one and end the first after it (or, with none after it,
/// the last before it).
/// Error: below 0.01 s of this definition wherever the Sun's extreme elevation is not within
/// 1e-6 deg of the threshold; real sunrises vary by minutes with refraction. Throws
/// std::invalid_argument for a bad place or offset or an instant outside 1900..2100.
TwilightTimes twilight_times(const Place& place, const UtcTime& any_instant_of_day,
                             int utc_offset_minutes);

}  // namespace twilight
