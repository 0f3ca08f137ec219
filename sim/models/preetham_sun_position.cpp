#include "sim/models/preetham_sun_position.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <string>

#include "solar/time_point.h"

namespace twilight {
namespace {

using std::numbers::pi;

constexpr double kRadPerDeg = pi / 180;

}  // namespace

double preetham_solar_time_h(double standard_time_h, int day_of_year, double meridian_east_rad,
                             double longitude_east_rad) {
  return standard_time_h + 0.170 * std::sin(4 * pi * (day_of_year - 80) / 373.0) -
         0.129 * std::sin(2 * pi * (day_of_year - 8) / 355.0) +
         12 * (longitude_east_rad - meridian_east_rad) / pi;
}

double preetham_declination_rad(int day_of_year) {
  return 0.4093 * std::sin(2 * pi * (day_of_year - 81) / 368.0);
}

PreethamSunAngles preetham_sun_angles(double latitude_rad, double declination_rad,
                                      double solar_time_h) {
  const double turn = pi * solar_time_h / 12;
  const double sin_l = std::sin(latitude_rad), cos_l = std::cos(latitude_rad);
  const double sin_d = std::sin(declination_rad), cos_d = std::cos(declination_rad);
  const double sine = std::clamp(sin_l * sin_d - cos_l * cos_d * std::cos(turn), -1.0, 1.0);
  return {pi / 2 - std::asin(sine),
          std::atan2(-cos_d * std::sin(turn), -(cos_l * sin_d + sin_l * cos_d * std::cos(turn)))};
}

PreethamSunAngles preetham_sun_position(double latitude_deg, double longitude_deg,
                                        std::string_view time) {
  const double meridian_deg = parse_utc_offset_minutes(time) / 4.0;  // checks the whole text
  const auto number = [&](std::size_t from, std::size_t count) {
    return std::stoi(std::string(time.substr(from, count)));
  };
  using namespace std::chrono;
  const sys_days date = year(number(0, 4)) / month(static_cast<unsigned>(number(5, 2))) /
                        day(static_cast<unsigned>(number(8, 2)));
  const sys_days new_year = year(number(0, 4)) / January / 1;
  const int day_of_year = static_cast<int>((date - new_year).count()) + 1;
  const std::size_t seconds_end = time.find_first_not_of("0123456789.", 17);
  const double seconds = std::stod(std::string(time.substr(17, seconds_end - 17)));
  const double hours = number(11, 2) + number(14, 2) / 60.0 + seconds / 3600;
  const double solar_time_h = preetham_solar_time_h(hours, day_of_year, meridian_deg * kRadPerDeg,
                                                    longitude_deg * kRadPerDeg);
  // Longitudes go on to 360: the Sun does not mind whole days.
  return preetham_sun_angles(latitude_deg * kRadPerDeg, preetham_declination_rad(day_of_year),
                             solar_time_h);
}

}  // namespace twilight
