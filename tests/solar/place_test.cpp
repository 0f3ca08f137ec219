#include "solar/place.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

// WGS84 (NIMA TR8350.2, 2000): a = 6378.137 km, b = 6356.7523142 km, polar radius of curvature
// c = a^2/b = 6399.5936258 km; at the equator the meridian's radius is b^2/a = 6335.4393273 km.
constexpr double kSemiMajorKm = 6378.137;
constexpr double kPolarCurvatureKm = 6399.5936258;
constexpr double kEquatorMeridianKm = 6335.4393273;

TEST(RadiusOfCurvature, Wgs84Published) {
  EXPECT_NEAR(radius_of_curvature_km({0.0, 0.0, 0.0}, 0.0), kEquatorMeridianKm, 1e-6);
  EXPECT_NEAR(radius_of_curvature_km({0.0, 0.0, 0.0}, 90.0), kSemiMajorKm, 1e-6);
  for (double azimuth_deg : {0.0, 37.0, 90.0, 250.0}) {
    EXPECT_NEAR(radius_of_curvature_km({90.0, 0.0, 0.0}, azimuth_deg), kPolarCurvatureKm, 1e-6);
    EXPECT_NEAR(radius_of_curvature_km({-90.0, 0.0, 0.0}, azimuth_deg), kPolarCurvatureKm, 1e-6);
  }
}

TEST(RadiusOfCurvature, EulersFormula) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  constexpr double kEccentricitySquared = 6.69437999014e-3;  // TR8350.2
  for (double latitude_deg : {-67.0, -12.0, 5.0, 39.7, 52.5, 81.0}) {
    const double s = std::sin(latitude_deg * kDegree);
    const double w2 = 1.0 - kEccentricitySquared * s * s;
    const double transverse_km = kSemiMajorKm / std::sqrt(w2);
    const double meridian_km = transverse_km * (1.0 - kEccentricitySquared) / w2;
    for (double azimuth_deg = -90.0; azimuth_deg <= 450.0; azimuth_deg += 15.0) {
      const double c = std::cos(azimuth_deg * kDegree);
      const double expected_km = 1.0 / (c * c / meridian_km + (1.0 - c * c) / transverse_km);
      const Place place{latitude_deg, 13.4, 100.0};
      EXPECT_NEAR(radius_of_curvature_km(place, azimuth_deg), expected_km, 1e-6);
      EXPECT_NEAR(radius_of_curvature_km(place, azimuth_deg + 180.0), expected_km, 1e-6);
    }
  }
}

TEST(Place, RefusesWhatIsNotOnEarth) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const Place& place : {Place{90.1, 0.0, 0.0}, Place{-91.0, 0.0, 0.0}, Place{0.0, 361.0, 0.0},
                             Place{0.0, -181.0, 0.0}, Place{0.0, 0.0, -501.0}, Place{0.0, 0.0, 3e5},
                             Place{kNan, 0.0, 0.0}, Place{0.0, kNan, 0.0}, Place{0.0, 0.0, kNan}}) {
    EXPECT_THROW(check_place(place), std::invalid_argument);
    EXPECT_THROW(radius_of_curvature_km(place, 0.0), std::invalid_argument);
  }
  EXPECT_THROW(radius_of_curvature_km({0.0, 0.0, 0.0}, kNan), std::invalid_argument);
  EXPECT_NO_THROW(check_place({-90.0, 360.0, 8848.0}));
  try {
    check_place({90.1, 0.0, 0.0});
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()), "latitude 90.1 deg is outside -90..90");
  }
}

}  // namespace
}  // namespace twilight
