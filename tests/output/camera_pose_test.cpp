// Cameras and the stars that tell where they look.
#include "output/camera_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "solar/star_position.h"

namespace twilight {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

double apart_rad(MapDirection a, MapDirection b) {
  return std::acos(std::min(1.0, std::sin(a.elevation_rad) * std::sin(b.elevation_rad) +
                                     std::cos(a.elevation_rad) * std::cos(b.elevation_rad) *
                                         std::cos(a.azimuth_rad - b.azimuth_rad)));
}

TEST(CameraPose, LevelIsTheMapsCamera) {
  const CameraPose pose{2.1, 0.3, 0.0, 0.9};
  CameraView view{2.1, 0.3, 0.9, 1.5};
  for (const MapPosition p : {MapPosition{10.5, 20.5}, {75, 50}, {149.5, 3.5}}) {
    const MapDirection own = direction_at(pose, 150, 100, p);
    const auto map = direction_at(MapProjection(view), 100, p);
    ASSERT_TRUE(map.has_value());
    EXPECT_LT(apart_rad(own, *map), 1e-7);
  }
}

TEST(CameraPose, PositionIsTheInverseOfDirection) {
  const CameraPose pose{5.9, -0.2, 0.4, 1.2};
  for (const MapPosition p : {MapPosition{0, 0}, {320, 240}, {639.5, 3.5}, {12, 470}}) {
    const auto back = position_of(pose, 640, 480, direction_at(pose, 640, 480, p));
    ASSERT_TRUE(back.has_value());
    EXPECT_NEAR(back->x, p.x, 1e-8);
    EXPECT_NEAR(back->y, p.y, 1e-8);
  }
}

// A camera that is turned clockwise shows the horizon turned the other way: its right side is low.
TEST(CameraPose, RollLowersTheRightSide) {
  const CameraPose pose{1.0, 0.0, 10 * kRadPerDeg, 1.0};
  EXPECT_LT(direction_at(pose, 300, 200, {290, 100}).elevation_rad, -0.05);
  EXPECT_GT(direction_at(pose, 300, 200, {10, 100}).elevation_rad, 0.05);
}

TEST(CameraPose, StarsTellPoseAndFieldOfView) {
  const CameraPose truth{228.3 * kRadPerDeg, 24.2 * kRadPerDeg, -3.1 * kRadPerDeg,
                         41.7 * kRadPerDeg};
  std::mt19937 random(3);
  std::uniform_real_distribution<double> x(20, 1580), y(20, 1180);
  std::normal_distribution<double> blur(0.0, 0.3);
  std::vector<StarPlace> sharp, blurred;
  for (int k = 0; k < 12; ++k) {
    const MapPosition p{x(random), y(random)};
    const MapDirection d = direction_at(truth, 1600, 1200, p);
    sharp.push_back({p, d});
    blurred.push_back({{p.x + blur(random), p.y + blur(random)}, d});
  }
  const auto expect_pose = [&](const FittedPose& f, double tolerance_deg) {
    EXPECT_NEAR(f.pose.azimuth_rad / kRadPerDeg, 228.3, tolerance_deg);
    EXPECT_NEAR(f.pose.elevation_rad / kRadPerDeg, 24.2, tolerance_deg);
    EXPECT_NEAR(f.pose.roll_rad / kRadPerDeg, -3.1, tolerance_deg);
    EXPECT_NEAR(f.pose.field_of_view_rad / kRadPerDeg, 41.7, tolerance_deg);
  };
  const FittedPose exact = fit_pose(sharp, 1600, 1200);
  expect_pose(exact, 1e-6);
  EXPECT_LT(exact.rms_pixels, 1e-6);
  // A third of a pixel of 0.035 deg, over a dozen stars: within 0.01 deg, but for the roll, whose
  // lever is half the picture: 0.3 px / 500 px / sqrt(12) = 0.01 deg per sigma.
  const FittedPose fitted = fit_pose(blurred, 1600, 1200);
  EXPECT_NEAR(fitted.pose.azimuth_rad / kRadPerDeg, 228.3, 0.01);
  EXPECT_NEAR(fitted.pose.elevation_rad / kRadPerDeg, 24.2, 0.01);
  EXPECT_NEAR(fitted.pose.roll_rad / kRadPerDeg, -3.1, 0.03);
  EXPECT_NEAR(fitted.pose.field_of_view_rad / kRadPerDeg, 41.7, 0.03);
  EXPECT_GT(fitted.rms_pixels, 0.1);
  EXPECT_LT(fitted.rms_pixels, 1.0);
}

TEST(CameraPose, OneStarIsTooFew) {
  const StarPlace one[] = {{{10, 10}, {0.3, 0.1}}};
  EXPECT_THROW(fit_pose(one, 100, 100), std::invalid_argument);
}

// Polaris, alpha UMi, ICRS 37.95456 deg, +89.26411 deg (ESA 1997, Hipparcos): from anywhere north
// it stands within 0.75 deg of the pole's elevation, the latitude, and of due north.
TEST(StarPosition, PolarisMarksThePole) {
  const Place saarbruecken{49.23, 7.0, 230};
  const StarPosition p = star_position(
      saarbruecken, parse_offset_date_time("2003-12-08T18:30:00+01:00"), 37.95456, 89.26411);
  EXPECT_NEAR(p.elevation_deg, 49.23, 0.76);
  EXPECT_LT(std::min(p.azimuth_deg, 360 - p.azimuth_deg), 1.2);
}

// Two sidereal days apart (2 x 0.99726957 d, IAU) a star stands where it stood.
TEST(StarPosition, ReturnsAfterASiderealDay) {
  const Place place{49.23, 7.0, 230};
  const UtcTime now = parse_offset_date_time("2003-12-08T18:30:00+01:00");
  const StarPosition a = star_position(place, now, 279.23473, 38.78369);
  const StarPosition b = star_position(place, add_days(now, 2 * 0.99726957), 279.23473, 38.78369);
  EXPECT_NEAR(a.elevation_deg, b.elevation_deg, 0.002);
  EXPECT_NEAR(a.azimuth_deg, b.azimuth_deg, 0.002);
}

// A star of declination 60 culminates at 90 - (60 - 49.23) and 49.23 - (90 - 60) degrees, lifted by
// refraction: 1.02' cot(h + 10.3 / (h + 5.11)), h in degrees, at 10 C and 1010 hPa (Meeus 1998, Ch.
// 16). Precession since 2000 has moved it by 20.04" cos(50 deg) a year, 0.014 deg; aberration by up
// to 0.006 deg.
TEST(StarPosition, CulminationsAreLiftedByRefraction) {
  const Place place{49.23, 7.0, 0};
  const UtcTime start = parse_offset_date_time("2003-12-08T00:00:00Z");
  double highest = -90, lowest = 90;
  for (int minute = 0; minute < 1440; minute += 2) {
    const double h =
        star_position(place, add_days(start, minute / 1440.0), 50.0, 60.0).elevation_deg;
    highest = std::max(highest, h);
    lowest = std::min(lowest, h);
  }
  const auto lift_deg = [](double h) {
    return 1.02 / 60 / std::tan((h + 10.3 / (h + 5.11)) * kRadPerDeg);
  };
  EXPECT_GT(lift_deg(19.23), 0.045);
  EXPECT_NEAR(highest, 79.23 - 0.014 + lift_deg(79.23), 0.01);
  EXPECT_NEAR(lowest, 19.23 + 0.014 + lift_deg(19.23), 0.01);
}

}  // namespace
}  // namespace twilight
