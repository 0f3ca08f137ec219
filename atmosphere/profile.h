// Model atmospheres: state of the air against height.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace twilight {

/// One level of a profile. Number densities in cm^-3; air counts every molecule, water vapour
/// included.
struct ProfileLevel {
  double height_km;
  double pressure_hpa;
  double temperature_k;
  double air_per_cm3;
  double ozone_per_cm3;
  double water_vapour_per_cm3;
  double nitrogen_dioxide_per_cm3;
};

/// Number density of air at 288.15 K and 1013.25 hPa, cm^-3 (Bodhaine et al. 1999, N_s).
inline constexpr double kAirAt15CPerCm3 = 2.546899e19;

/// Scale height of the paper's air, km (Haber et al. 2005, Sec. 4.1.2).
inline constexpr double kHaberScaleHeightKm = 8.0;

/// A model atmosphere. Between levels pressure and number densities are interpolated linearly in
/// their logarithm, temperature linearly; integrals are exact for that interpolation.
class Profile {
 public:
  /// A gas, by its member of ProfileLevel.
  using Gas = double ProfileLevel::*;

  /// The profile of that name: "us_standard", "tropical", "midlatitude_summer",
  /// "midlatitude_winter", "subarctic_summer", "subarctic_winter" (AFGL models 6, 1..5; Anderson et
  /// al. 1986; 0..120 km), or "exponential": the paper's exp(-h / 8 km) at 15 C with 1013.25 hPa at
  /// the ground, 0..200 km, no water vapour, ozone after Green (1964) with its maximum at 22 km and
  /// 300 DU. Throws std::invalid_argument for any other name.
  static Profile named(std::string_view name);

  /// The profile of levels from the ground (0 km) upwards, two or more: heights strictly
  /// increasing, all finite, pressure, temperature and air above 0, other gases 0 or above. Throws
  /// std::invalid_argument otherwise.
  static Profile of_levels(std::string name, std::vector<ProfileLevel> levels);

  /// Every name that named() takes.
  static std::span<const std::string_view> names();

  /// The same atmosphere over ground that lies depth_km (0..1) below sea level, heights counted
  /// from that ground: below its lowest level pressure and densities go on as between the lowest
  /// two (exponential), and so does the temperature (linear). Throws std::invalid_argument for
  /// another depth.
  Profile over_ground_below_sea(double depth_km) const;

  const std::string& name() const { return name_; }
  double top_km() const { return levels_.back().height_km; }
  std::span<const ProfileLevel> levels() const { return levels_; }

  /// State at a height, 0..top_km(). Throws std::invalid_argument outside.
  ProfileLevel at(double height_km) const;

  /// Mean of a gas (or of the pressure) over bottom_km < top_km, in its own unit. Throws
  /// std::invalid_argument unless 0 <= bottom_km < top_km <= top_km().
  double mean(Gas gas, double bottom_km, double top_km) const;

  /// Mean temperature over a layer, K. Range as in mean().
  double mean_temperature_k(double bottom_km, double top_km) const;

  /// Integral over height of (gas)^exponent, in (cm^-3)^exponent km. Range as in mean(), and
  /// bottom_km == top_km gives 0.
  double power_integral(Gas gas, double exponent, double bottom_km, double top_km) const;

 private:
  /// Sum over the parts of levels within bottom_km..top_km of thickness x mean(level below, level
  /// above, fraction of the way up at the part's bottom, and at its top).
  template <typename Mean>
  double integral(double bottom_km, double top_km, Mean mean) const;

  Profile(std::string name, std::vector<ProfileLevel> levels);

  std::string name_;
  std::vector<ProfileLevel> levels_;
};

/// Saturation pressure of water vapour over liquid water, hPa, at a temperature in K: Bolton
/// (1980), Mon. Weather Rev. 108, 1046, eq. 10; within 0.1 % for -30..35 C.
double water_saturation_pressure_hpa(double temperature_k);

/// Relative humidity over liquid water, 0..1 (clamped at 1), of water vapour of the given number
/// density and temperature.
double relative_humidity(double water_vapour_per_cm3, double temperature_k);

}  // namespace twilight
