#include "atmosphere/profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace twilight {
namespace {

#include "atmosphere/afgl_profiles.inc"

constexpr std::array<std::string_view, 7> kNames = {
    "us_standard",      "tropical",         "midlatitude_summer", "midlatitude_winter",
    "subarctic_summer", "subarctic_winter", "exponential"};

constexpr double kBoltzmannHpaCm3PerK = 1.380649e-19;  // k_B = 1.380649e-23 J/K (SI 2019)

// Ozone of the exponential profile: Green (1964), Appl. Opt. 3, 203; its column above h is
// proportional to 1 / (1 + exp((h - b) / c)). b and c as fit the maximum and the decay to 50 km of
// the US standard atmosphere.
constexpr double kGreenPeakKm = 22.0;
constexpr double kGreenWidthKm = 5.0;
constexpr double kGreenColumnPerCm2 = 300.0 * 2.6867e16;

// Value at fraction t of a segment, linear in the logarithm.
double log_interpolated(double a, double b, double t) {
  if (a > 0.0 && b > 0.0) return a * std::exp(t * std::log(b / a));
  return a + t * (b - a);
}

// Mean over a segment of (value)^exponent, the value being linear in its logarithm.
double log_mean(double a, double b, double exponent) {
  if (!(a > 0.0 && b > 0.0))
    return a == b ? 0.0 : 0.5 * (std::pow(a, exponent) + std::pow(b, exponent));
  const double x = exponent * std::log(b / a);
  const double ratio = std::abs(x) < 1e-8 ? 1.0 + 0.5 * x : std::expm1(x) / x;
  return std::pow(a, exponent) * ratio;
}

std::vector<ProfileLevel> exponential_levels() {
  constexpr int kTopKm = 200;
  std::vector<ProfileLevel> levels;
  for (int h = 0; h <= kTopKm; ++h) {
    const double fall = std::exp(-h / kHaberScaleHeightKm);
    const double e = std::exp(-std::abs(h - kGreenPeakKm) / kGreenWidthKm);
    const double ozone = e / ((1.0 + e) * (1.0 + e));  // scaled below
    levels.push_back(
        {static_cast<double>(h), 1013.25 * fall, 288.15, kAirAt15CPerCm3 * fall, ozone, 0.0, 0.0});
  }
  // Interpolation between the levels loses 0.1 % of the column: give it back.
  double column_per_cm2 = 0.0;
  for (std::size_t i = 0; i + 1 < levels.size(); ++i) {
    column_per_cm2 += 1e5 * log_mean(levels[i].ozone_per_cm3, levels[i + 1].ozone_per_cm3, 1.0);
  }
  for (ProfileLevel& level : levels) level.ozone_per_cm3 *= kGreenColumnPerCm2 / column_per_cm2;
  return levels;
}

[[noreturn]] void fail(const std::string& what) { throw std::invalid_argument(what); }

}  // namespace

Profile::Profile(std::string name, std::vector<ProfileLevel> levels)
    : name_(std::move(name)), levels_(std::move(levels)) {}

std::span<const std::string_view> Profile::names() { return kNames; }

Profile Profile::named(std::string_view name) {
  const auto made = [&](const auto& table) {
    return Profile(std::string(name), std::vector<ProfileLevel>(table.begin(), table.end()));
  };
  if (name == "us_standard") return made(kUsStandard);
  if (name == "tropical") return made(kTropical);
  if (name == "midlatitude_summer") return made(kMidlatitudeSummer);
  if (name == "midlatitude_winter") return made(kMidlatitudeWinter);
  if (name == "subarctic_summer") return made(kSubarcticSummer);
  if (name == "subarctic_winter") return made(kSubarcticWinter);
  if (name == "exponential") return made(exponential_levels());
  std::string list;
  for (const auto n : kNames) list += (list.empty() ? "" : ", ") + std::string(n);
  fail("atmosphere profile '" + std::string(name) + "' must be one of " + list);
}

Profile Profile::of_levels(std::string name, std::vector<ProfileLevel> levels) {
  const auto refuse = [&](std::size_t level, const char* what) {
    fail("profile " + name + ", level " + std::to_string(level) + ": " + what);
  };
  if (levels.size() < 2) fail("profile " + name + " must have at least two levels");
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const ProfileLevel& l = levels[i];
    const double gases[] = {l.ozone_per_cm3, l.water_vapour_per_cm3, l.nitrogen_dioxide_per_cm3};
    if (i == 0 ? l.height_km != 0.0 : !(l.height_km > levels[i - 1].height_km)) {
      refuse(i, "heights must rise from 0 km");
    }
    for (const double positive : {l.pressure_hpa, l.temperature_k, l.air_per_cm3}) {
      if (!(positive > 0.0)) refuse(i, "pressure, temperature and air must be above 0");
    }
    for (const double gas : gases) {
      if (!(gas >= 0.0)) refuse(i, "gases must be 0 or above");
    }
    for (const double value : {l.height_km, l.pressure_hpa, l.temperature_k, l.air_per_cm3,
                               gases[0], gases[1], gases[2]}) {
      if (!std::isfinite(value)) refuse(i, "every value must be finite");
    }
  }
  return Profile(std::move(name), std::move(levels));
}

Profile Profile::over_ground_below_sea(double depth_km) const {
  if (!(depth_km >= 0.0 && depth_km <= 1.0)) {
    std::ostringstream s;
    s << "depth " << depth_km << " km of the ground below sea level must be 0..1";
    fail(s.str());
  }
  if (depth_km == 0.0) return *this;
  std::vector<ProfileLevel> levels = levels_;
  const ProfileLevel a = levels[0], b = levels[1];
  const double t = -depth_km / (b.height_km - a.height_km);
  const auto log_of = [&](Gas gas) { return log_interpolated(a.*gas, b.*gas, t); };
  for (ProfileLevel& level : levels) level.height_km += depth_km;
  levels.insert(
      levels.begin(),
      ProfileLevel{0.0, log_of(&ProfileLevel::pressure_hpa),
                   a.temperature_k + t * (b.temperature_k - a.temperature_k),
                   log_of(&ProfileLevel::air_per_cm3), log_of(&ProfileLevel::ozone_per_cm3),
                   log_of(&ProfileLevel::water_vapour_per_cm3),
                   log_of(&ProfileLevel::nitrogen_dioxide_per_cm3)});
  return Profile(name_, std::move(levels));
}

ProfileLevel Profile::at(double height_km) const {
  if (!(height_km >= 0.0 && height_km <= top_km())) {
    std::ostringstream s;
    s << "height " << height_km << " km must be within 0.." << top_km() << " km of profile "
      << name_;
    fail(s.str());
  }
  auto above = std::upper_bound(levels_.begin(), levels_.end(), height_km,
                                [](double h, const ProfileLevel& l) { return h < l.height_km; });
  if (above == levels_.end()) return levels_.back();
  const ProfileLevel& a = *(above - 1);
  const ProfileLevel& b = *above;
  const double t = (height_km - a.height_km) / (b.height_km - a.height_km);
  const auto log_of = [&](Gas gas) { return log_interpolated(a.*gas, b.*gas, t); };
  return {height_km,
          log_of(&ProfileLevel::pressure_hpa),
          a.temperature_k + t * (b.temperature_k - a.temperature_k),
          log_of(&ProfileLevel::air_per_cm3),
          log_of(&ProfileLevel::ozone_per_cm3),
          log_of(&ProfileLevel::water_vapour_per_cm3),
          log_of(&ProfileLevel::nitrogen_dioxide_per_cm3)};
}

template <typename Mean>
double Profile::integral(double bottom_km, double top_km, Mean mean) const {
  if (!(bottom_km >= 0.0 && bottom_km <= top_km && top_km <= this->top_km())) {
    std::ostringstream s;
    s << "height interval " << bottom_km << ".." << top_km << " km must rise within 0.."
      << this->top_km() << " km of profile " << name_;
    fail(s.str());
  }
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < levels_.size(); ++i) {
    const ProfileLevel& a = levels_[i];
    const ProfileLevel& b = levels_[i + 1];
    const double lo = std::max(bottom_km, a.height_km);
    const double hi = std::min(top_km, b.height_km);
    if (lo >= hi) continue;
    const double step = b.height_km - a.height_km;
    sum += (hi - lo) * mean(a, b, (lo - a.height_km) / step, (hi - a.height_km) / step);
  }
  return sum;
}

double Profile::power_integral(Gas gas, double exponent, double bottom_km, double top_km) const {
  return integral(bottom_km, top_km,
                  [&](const ProfileLevel& a, const ProfileLevel& b, double from, double to) {
                    return log_mean(log_interpolated(a.*gas, b.*gas, from),
                                    log_interpolated(a.*gas, b.*gas, to), exponent);
                  });
}

double Profile::mean(Gas gas, double bottom_km, double top_km) const {
  if (!(bottom_km < top_km)) fail("layer must have a bottom below its top");
  return power_integral(gas, 1.0, bottom_km, top_km) / (top_km - bottom_km);
}

double Profile::mean_temperature_k(double bottom_km, double top_km) const {
  if (!(bottom_km < top_km)) fail("layer must have a bottom below its top");
  return integral(bottom_km, top_km,
                  [](const ProfileLevel& a, const ProfileLevel& b, double from, double to) {
                    return a.temperature_k +
                           0.5 * (from + to) * (b.temperature_k - a.temperature_k);
                  }) /
         (top_km - bottom_km);
}

double water_saturation_pressure_hpa(double temperature_k) {
  const double celsius = temperature_k - 273.15;
  // Far outside the fit's range (mesosphere) the exponent's pole at -243.5 C is kept away.
  const double t = std::max(celsius, -150.0);
  return 6.112 * std::exp(17.67 * t / (t + 243.5));
}

double relative_humidity(double water_vapour_per_cm3, double temperature_k) {
  const double pressure_hpa = water_vapour_per_cm3 * kBoltzmannHpaCm3PerK * temperature_k;
  return std::clamp(pressure_hpa / water_saturation_pressure_hpa(temperature_k), 0.0, 1.0);
}

}  // namespace twilight
