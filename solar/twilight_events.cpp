#include "solar/twilight_events.h"

#include <cmath>
#include <vector>

#include "solar/sun_position.h"

namespace twilight {
namespace {

struct Node {
  double day_fraction = 0.0;
  double elevation_deg = 0.0;
};

// The Sun's elevation over one civil day, as its monotone pieces.
class ElevationCurve {
 public:
  ElevationCurve(const Place& place, const UtcTime& start, double length_days)
      : place_(place), start_(start) {
    constexpr int kSamples = 96;  // every 15 min: the Sun has one summit and one trough a day
    std::vector<Node> samples;
    samples.reserve(kSamples + 1);
    for (int i = 0; i <= kSamples; ++i) samples.push_back(at(length_days * i / kSamples));
    nodes_.push_back(samples.front());
    for (std::size_t i = 1; i + 1 < samples.size(); ++i) {
      const double before = samples[i].elevation_deg - samples[i - 1].elevation_deg;
      const double after = samples[i + 1].elevation_deg - samples[i].elevation_deg;
      if (before * after <= 0.0) {
        nodes_.push_back(extremum(samples[i - 1], samples[i + 1], before > 0.0 || after < 0.0));
      }
    }
    nodes_.push_back(samples.back());
  }

  void find(double threshold_deg, std::optional<UtcTime>& begin,
            std::optional<UtcTime>& end) const {
    std::vector<double> upward, downward;
    for (std::size_t i = 0; i + 1 < nodes_.size(); ++i) {
      // A node exactly on the threshold counts as above it, so no crossing is found twice.
      const bool above = nodes_[i].elevation_deg >= threshold_deg;
      if (above == (nodes_[i + 1].elevation_deg >= threshold_deg)) continue;
      const double crossing = bisect(nodes_[i], nodes_[i + 1], threshold_deg);
      (above ? downward : upward).push_back(crossing);
    }
    if (!upward.empty()) begin = add_days(start_, upward.front());
    if (downward.empty()) return;
    double last = downward.back();
    for (auto it = downward.rbegin(); it != downward.rend(); ++it) {
      if (!upward.empty() && *it > upward.front()) last = *it;
    }
    end = add_days(start_, last);
  }

 private:
  Node at(double day_fraction) const {
    return {day_fraction, sun_position(place_, add_days(start_, day_fraction)).elevation_deg};
  }

  // Golden section; good to about 0.1 s in time and 1e-8 deg in elevation,
  // where an extremum is flat.
  Node extremum(const Node& low, const Node& high, bool summit) const {
    constexpr double kGolden = 0.6180339887498949;
    const double sign = summit ? 1.0 : -1.0;
    double a = low.day_fraction, b = high.day_fraction;
    Node left = at(b - kGolden * (b - a)), right = at(a + kGolden * (b - a));
    while (b - a > 1e-6) {
      if (sign * left.elevation_deg > sign * right.elevation_deg) {
        b = right.day_fraction;
        right = left;
        left = at(b - kGolden * (b - a));
      } else {
        a = left.day_fraction;
        left = right;
        right = at(a + kGolden * (b - a));
      }
    }
    return at(0.5 * (a + b));
  }

  double bisect(const Node& first, const Node& second, double threshold_deg) const {
    const bool rising = second.elevation_deg > first.elevation_deg;
    double a = first.day_fraction, b = second.day_fraction;
    while (b - a > 1e-8) {  // 0.9 ms
      const double middle = 0.5 * (a + b);
      if ((at(middle).elevation_deg >= threshold_deg) == rising) {
        b = middle;
      } else {
        a = middle;
      }
    }
    return 0.5 * (a + b);
  }

  Place place_;
  UtcTime start_;
  std::vector<Node> nodes_;
};

}  // namespace

TwilightTimes twilight_times(const Place& place, const UtcTime& any_instant_of_day,
                             int utc_offset_minutes) {
  check_place(place);
  const UtcTime start = local_midnight(any_instant_of_day, utc_offset_minutes);
  const UtcTime next = local_midnight(any_instant_of_day, utc_offset_minutes, 1);
  const ElevationCurve curve(place, start, days_between(start, next));
  TwilightTimes times;
  curve.find(kSunriseElevationDeg, times.sunrise, times.sunset);
  curve.find(kCivilTwilightElevationDeg, times.civil_begin, times.civil_end);
  curve.find(kNauticalTwilightElevationDeg, times.nautical_begin, times.nautical_end);
  curve.find(kAstronomicalTwilightElevationDeg, times.astronomical_begin, times.astronomical_end);
  return times;
}

}  // namespace twilight
