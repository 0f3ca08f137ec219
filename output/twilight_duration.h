// How long twilight lasts, by the light that is left and by the almanac.
#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "output/colour.h"
#include "sim/run_control.h"
#include "sim/sky.h"
#include "solar/place.h"
#include "solar/time_point.h"

namespace twilight {

/// Geometric elevations of the Sun between which a threshold is looked for, deg.
inline constexpr double kHighestTwilightSun_deg = 90;
inline constexpr double kLowestTwilightSun_deg = -36;
/// Width of the bracket a crossing is found in, deg.
inline constexpr double kTwilightSunTolerance_deg = 0.01;

/// Depression of the Sun (deg below the horizon, geometric; below 0 where it is above it) at which
/// an illuminance that grows with the Sun's elevation (deg, geometric) falls to each threshold (>
/// 0, decreasing), to kTwilightSunTolerance_deg: brackets grow from the Sun 6 deg down in steps of
/// 3 deg, then shrink by secants in the logarithm of the illuminance and by halves. What is found
/// for one threshold serves the others. NaN where the illuminance stays above or below the
/// threshold.
std::vector<double> twilight_depressions_deg(
    const std::function<double(double sun_elevation_deg)>& illuminance_lux,
    std::span<const double> thresholds_lux);

/// The same of a sky's global horizontal illuminance under other Suns, which Sky::with_sun_at
/// gives; all NaN where that is null. `photopic` is of the sky's wavelengths (CIE 1931). Throws as
/// Sky's functions, Cancelled when told to stop.
std::vector<double> twilight_depressions_deg(const Sky& sky, const ColourIntegrator& photopic,
                                             std::span<const double> thresholds_lux,
                                             const RunControl& control = {});

/// Depressions found before, for skies that share air, ground, observer and method: the Sun of each
/// does not matter to them. Of several threads the first computes, the others wait.
class KnownTwilight {
 public:
  /// As twilight_depressions_deg(), to the bit, which it calls for another sunlight or other
  /// thresholds than the last time.
  std::vector<double> depressions_deg(const Sky& sky, const ColourIntegrator& photopic,
                                      std::span<const double> thresholds_lux,
                                      const RunControl& control = {});

 private:
  std::mutex mutex_;
  std::vector<double> solar_irradiance_, thresholds_lux_, depressions_deg_;
};

/// Minutes from the sunset of an evening (the Sun's centre at kSunriseElevationDeg) until the Sun
/// is so far below the horizon, by the ephemeris; below 0 before sunset. The evening is that of the
/// civil day of a time "2003-12-08T17:00:00+01:00", past midnight if need be. NaN where the Sun
/// does not set that day or has not sunk so far when it rises again, and for a depression that is
/// NaN. Error: that of the elevation, 0.004 deg over the rate it sinks with (4 deg an hour at
/// latitude 74: 4 s). Throws std::invalid_argument for a bad place or time.
std::vector<double> minutes_after_sunset(const Place& place, const std::string& time,
                                         std::span<const double> depressions_deg);

}  // namespace twilight
