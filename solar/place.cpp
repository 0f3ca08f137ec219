#include "solar/place.h"

#include <fmt/format.h>

#include <GeographicLib/Ellipsoid.hpp>
#include <cmath>
#include <stdexcept>

namespace twilight {
namespace {

void check_range(const char* quantity, double value, double lowest, double highest,
                 const char* unit) {
  if (!(value >= lowest && value <= highest)) {  // also refuses NaN
    throw std::invalid_argument(
        fmt::format("{} {} {} is outside {}..{}", quantity, value, unit, lowest, highest));
  }
}

}  // namespace

void check_place(const Place& place) {
  check_range("latitude", place.latitude_deg, -90.0, 90.0, "deg");
  check_range("longitude", place.longitude_deg, -180.0, 360.0, "deg");
  check_range("height", place.height_m, -500.0, 200000.0, "m");
}

double radius_of_curvature_km(const Place& place, double azimuth_deg) {
  check_place(place);
  if (!std::isfinite(azimuth_deg)) {
    throw std::invalid_argument(fmt::format("azimuth {} deg is not finite", azimuth_deg));
  }
  constexpr double kKmPerM = 1e-3;
  return kKmPerM *
         GeographicLib::Ellipsoid::WGS84().NormalCurvatureRadius(place.latitude_deg, azimuth_deg);
}

}  // namespace twilight
