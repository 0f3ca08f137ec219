#include "output/twilight_duration.h"

#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <numbers>

#include "output/photometry.h"
#include "solar/sun_position.h"
#include "solar/twilight_events.h"

namespace twilight {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Illuminances by the Sun's elevation, each computed once.
class IlluminanceCurve {
 public:
  explicit IlluminanceCurve(const std::function<double(double)>& illuminance_lux)
      : illuminance_lux_(illuminance_lux) {}

  double at(double sun_deg) {
    const auto [known, fresh] = lux_.try_emplace(sun_deg, 0.0);
    if (fresh) known->second = illuminance_lux_(sun_deg);
    return known->second;
  }

  /// Elevation at which the curve crosses a threshold.
  double crossing(double threshold_lux);

 private:
  const std::function<double(double)>& illuminance_lux_;
  std::map<double, double> lux_;
};

double IlluminanceCurve::crossing(double threshold_lux) {
  constexpr double kStart_deg = -6, kStep_deg = 3;
  double low = kStart_deg, high = kStart_deg;
  while (at(high) < threshold_lux) {
    if (high >= kHighestTwilightSun_deg) return kNone;
    low = high;
    high = std::min(high + kStep_deg, kHighestTwilightSun_deg);
  }
  while (at(low) >= threshold_lux) {
    if (low <= kLowestTwilightSun_deg) return kNone;
    high = low;
    low = std::max(low - kStep_deg, kLowestTwilightSun_deg);
  }
  // Other thresholds may have left closer ones.
  for (const auto& [sun, lux] : lux_) {
    if (sun > low && sun < high) (lux >= threshold_lux ? high : low) = sun;
  }
  const auto log_ratio = [&](double sun) { return std::log(at(sun) / threshold_lux); };
  while (high - low > kTwilightSunTolerance_deg) {
    const double f_low = log_ratio(low), f_high = log_ratio(high);
    double next = 0.5 * (low + high);
    if (std::isfinite(f_low) && f_high > f_low) {
      const double root = low - f_low / (f_high - f_low) * (high - low);
      // A little beyond the root, so that the bracket closes from its far side too.
      const double margin = 0.4 * kTwilightSunTolerance_deg;
      const bool low_is_far = root - low > high - root;
      next = std::clamp(low_is_far ? root - margin : root + margin, low + margin, high - margin);
    }
    // The secant closes a smooth curve in a few steps; where it does not, halves do.
    const double before = high - low;
    (at(next) >= threshold_lux ? high : low) = next;
    if (high - low > 0.5 * before && high - low > kTwilightSunTolerance_deg) {
      const double middle = 0.5 * (low + high);
      (at(middle) >= threshold_lux ? high : low) = middle;
    }
  }
  return 0.5 * (low + high);
}

/// The Sun's elevation after a sunset.
class Evening {
 public:
  Evening(const Place& place, const UtcTime& sunset) : place_(place), sunset_(sunset) {}

  double minutes_until(double elevation_deg) const {
    constexpr double kStep_min = 5, kLongest_min = 24 * 60;
    const bool later = elevation_deg <= kSunriseElevationDeg;
    const double step = later ? kStep_min : -kStep_min;
    double near = 0;
    while (std::abs(near) < kLongest_min) {
      const double far = near + step;
      const double at_near = elevation_at(near), at_far = elevation_at(far);
      const bool reached = later ? at_far <= elevation_deg : at_far >= elevation_deg;
      if (reached) return between(near, far, elevation_deg);
      // Past the lowest (highest) point.
      if (later ? at_far > at_near : at_far < at_near) return kNone;
      near = far;
    }
    return kNone;
  }

 private:
  double elevation_at(double minutes) const {
    return sun_position(place_, add_days(sunset_, minutes / 1440)).elevation_deg;
  }
  double between(double near, double far, double elevation_deg) const {
    constexpr double kClose_min = 1e-4;
    const bool later = far > near;
    while (std::abs(far - near) > kClose_min) {
      const double middle = 0.5 * (near + far);
      const double there = elevation_at(middle);
      ((later ? there <= elevation_deg : there >= elevation_deg) ? far : near) = middle;
    }
    return 0.5 * (near + far);
  }

  Place place_;
  UtcTime sunset_;
};

}  // namespace

std::vector<double> twilight_depressions_deg(const std::function<double(double)>& illuminance_lux,
                                             std::span<const double> thresholds_lux) {
  IlluminanceCurve curve(illuminance_lux);
  std::vector<double> depressions;
  for (const double lux : thresholds_lux) depressions.push_back(-curve.crossing(lux));
  return depressions;
}

std::vector<double> twilight_depressions_deg(const Sky& sky, const ColourIntegrator& photopic,
                                             std::span<const double> thresholds_lux,
                                             const RunControl& control) {
  const auto under = [&](double sun_deg) {
    return sky.with_sun_at(sun_deg * std::numbers::pi / 180);
  };
  if (!under(kCivilTwilightElevationDeg)) {
    return std::vector<double>(thresholds_lux.size(), kNone);
  }
  const auto illuminance = [&](double sun_deg) {
    control.check();
    const std::unique_ptr<Sky> other = under(sun_deg);
    const Irradiance light = other->irradiance();
    std::vector<double> global(light.direct.size());
    std::ranges::transform(light.direct, light.diffuse, global.begin(), std::plus<>());
    return illuminance_lux(photopic, global, other->solar_irradiance());
  };
  return twilight_depressions_deg(illuminance, thresholds_lux);
}

std::vector<double> KnownTwilight::depressions_deg(const Sky& sky, const ColourIntegrator& photopic,
                                                   std::span<const double> thresholds_lux,
                                                   const RunControl& control) {
  const std::lock_guard lock(mutex_);
  if (!std::ranges::equal(solar_irradiance_, sky.solar_irradiance()) ||
      !std::ranges::equal(thresholds_lux_, thresholds_lux)) {
    // Waiting for its own tasks, a thread must not take up a case that waits for the lock.
    depressions_deg_ = tbb::this_task_arena::isolate(
        [&] { return twilight_depressions_deg(sky, photopic, thresholds_lux, control); });
    solar_irradiance_.assign(sky.solar_irradiance().begin(), sky.solar_irradiance().end());
    thresholds_lux_.assign(thresholds_lux.begin(), thresholds_lux.end());
  }
  return depressions_deg_;
}

std::vector<double> minutes_after_sunset(const Place& place, const std::string& time,
                                         std::span<const double> depressions_deg) {
  const TwilightTimes day =
      twilight_times(place, parse_offset_date_time(time), parse_utc_offset_minutes(time));
  std::vector<double> minutes(depressions_deg.size(), kNone);
  if (!day.sunset) return minutes;
  const Evening evening(place, *day.sunset);
  for (std::size_t k = 0; k < minutes.size(); ++k) {
    if (std::isfinite(depressions_deg[k])) minutes[k] = evening.minutes_until(-depressions_deg[k]);
  }
  return minutes;
}

}  // namespace twilight
