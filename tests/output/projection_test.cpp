#include "output/projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace twilight {
namespace {

using std::numbers::pi;

constexpr MapDirection kNorth = {0.0, 0.0}, kEast = {0.0, 0.5 * pi}, kSouth = {0.0, pi},
                       kWest = {0.0, 1.5 * pi}, kZenith = {0.5 * pi, 0.0},
                       kNadir = {-0.5 * pi, 0.0};
constexpr Projection kAll[] = {Projection::kFisheye, Projection::kLatLong, Projection::kOctahedral};

void expect_place(Projection projection, MapDirection direction, double x, double y) {
  const auto place = pixel_of_direction(projection, 100, direction);
  ASSERT_TRUE(place);
  EXPECT_NEAR(place->x, x, 1e-9);
  EXPECT_NEAR(place->y, y, 1e-9);
}

double total_sr(Projection projection, int size) {
  double sum = 0.0;
  for (int y = 0; y < map_height(projection, size); ++y) {
    for (int x = 0; x < map_width(projection, size); ++x) {
      sum += pixel_solid_angle_sr(projection, size, x, y);
    }
  }
  return sum;
}

TEST(Projection, PixelCentresComeBack) {
  for (auto projection : kAll) {
    for (int size : {1, 2, 7, 64}) {
      for (int y = 0; y < map_height(projection, size); ++y) {
        for (int x = 0; x < map_width(projection, size); ++x) {
          const auto direction = direction_of_pixel(projection, size, x, y);
          if (!direction) continue;
          EXPECT_GE(direction->azimuth_rad, 0.0);
          EXPECT_LT(direction->azimuth_rad, 2.0 * pi);
          const auto back = pixel_of_direction(projection, size, *direction);
          ASSERT_TRUE(back);
          EXPECT_NEAR(back->x, x + 0.5, 1e-9) << projection_name(projection) << size;
          EXPECT_NEAR(back->y, y + 0.5, 1e-9) << projection_name(projection) << size;
        }
      }
    }
  }
}

TEST(Projection, DirectionsComeBack) {
  for (auto projection : kAll) {
    for (double elevation = -1.5; elevation < 1.55; elevation += 0.1) {
      if (projection == Projection::kFisheye && elevation < 0.0) continue;
      for (double azimuth = 0.0; azimuth < 6.28; azimuth += 0.17) {
        const auto place = pixel_of_direction(projection, 512, {elevation, azimuth});
        ASSERT_TRUE(place);
        const auto back = direction_at(projection, 512, *place);
        ASSERT_TRUE(back);
        EXPECT_NEAR(back->elevation_rad, elevation, 1e-12);
        EXPECT_NEAR(std::remainder(back->azimuth_rad - azimuth, 2.0 * pi), 0.0, 1e-11);
      }
    }
  }
}

TEST(LatLong, NorthIsTheLeftEdge) { expect_place(Projection::kLatLong, kNorth, 0.0, 50.0); }
TEST(LatLong, EastIsAQuarterFromTheLeft) { expect_place(Projection::kLatLong, kEast, 50.0, 50.0); }
TEST(LatLong, SouthIsTheMiddle) { expect_place(Projection::kLatLong, kSouth, 100.0, 50.0); }
TEST(LatLong, WestIsAQuarterFromTheRight) {
  expect_place(Projection::kLatLong, kWest, 150.0, 50.0);
}
TEST(LatLong, ZenithIsTheTopRow) {
  expect_place(Projection::kLatLong, kZenith, 0.0, 0.0);
  EXPECT_GT(direction_of_pixel(Projection::kLatLong, 100, 3, 0)->elevation_rad, 1.5);
}

TEST(Fisheye, NorthIsAtTheTop) { expect_place(Projection::kFisheye, kNorth, 50.0, 0.0); }
TEST(Fisheye, EastIsAtTheLeft) { expect_place(Projection::kFisheye, kEast, 0.0, 50.0); }
TEST(Fisheye, SouthIsAtTheBottom) { expect_place(Projection::kFisheye, kSouth, 50.0, 100.0); }
TEST(Fisheye, WestIsAtTheRight) { expect_place(Projection::kFisheye, kWest, 100.0, 50.0); }
TEST(Fisheye, ZenithIsTheCentre) { expect_place(Projection::kFisheye, kZenith, 50.0, 50.0); }
TEST(Fisheye, IsEquidistant) {
  expect_place(Projection::kFisheye, {pi / 6.0, 0.0}, 50.0, 50.0 * (1.0 - 2.0 / 3.0));
}
TEST(Fisheye, CornersAndTheGroundAreOutside) {
  EXPECT_FALSE(direction_of_pixel(Projection::kFisheye, 100, 0, 0));
  EXPECT_FALSE(pixel_of_direction(Projection::kFisheye, 100, {-0.01, 1.0}));
}

TEST(Octahedral, ZenithIsTheCentre) { expect_place(Projection::kOctahedral, kZenith, 50.0, 50.0); }
TEST(Octahedral, HorizonJoinsTheMiddlesOfTheEdges) {
  expect_place(Projection::kOctahedral, kNorth, 50.0, 0.0);
  expect_place(Projection::kOctahedral, kEast, 0.0, 50.0);
  expect_place(Projection::kOctahedral, kSouth, 50.0, 100.0);
  expect_place(Projection::kOctahedral, kWest, 100.0, 50.0);
  expect_place(Projection::kOctahedral, {0.0, 0.25 * pi}, 25.0, 25.0);
}
TEST(Octahedral, NadirIsAtTheCorners) {
  for (double x : {0.0, 100.0}) {
    for (double y : {0.0, 100.0}) {
      EXPECT_NEAR(direction_at(Projection::kOctahedral, 100, {x, y})->elevation_rad,
                  kNadir.elevation_rad, 1e-7);
    }
  }
}
TEST(Octahedral, IsContinuousOverTheHorizon) {
  for (double azimuth = 0.05; azimuth < 6.28; azimuth += 0.1) {
    const auto above = pixel_of_direction(Projection::kOctahedral, 100, {1e-9, azimuth});
    const auto below = pixel_of_direction(Projection::kOctahedral, 100, {-1e-9, azimuth});
    EXPECT_NEAR(above->x, below->x, 1e-6);
    EXPECT_NEAR(above->y, below->y, 1e-6);
  }
}

// The Jacobian |d(sin e, azimuth)/d(x, y)| is 4 pi / N^2 everywhere.
TEST(Octahedral, EveryPixelHasTheSameSolidAngle) {
  constexpr int kSize = 32;
  constexpr double kStep = 1e-5;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      // Off the folds (pixel centres of an even map lie on the diagonals).
      const MapPosition p = {x + 0.45, y + 0.53};
      const auto at = [&](double dx, double dy) {
        return *direction_at(Projection::kOctahedral, kSize, {p.x + dx, p.y + dy});
      };
      const auto slope = [&](const MapDirection& a, const MapDirection& b) {
        return std::pair{(std::sin(a.elevation_rad) - std::sin(b.elevation_rad)) / (2.0 * kStep),
                         std::remainder(a.azimuth_rad - b.azimuth_rad, 2.0 * pi) / (2.0 * kStep)};
      };
      const auto [sx, ax] = slope(at(kStep, 0.0), at(-kStep, 0.0));
      const auto [sy, ay] = slope(at(0.0, kStep), at(0.0, -kStep));
      EXPECT_NEAR(std::abs(sx * ay - sy * ax) * kSize * kSize / (4.0 * pi), 1.0, 1e-6)
          << x << "," << y;
    }
  }
}

TEST(SolidAngle, FullSphereIsFourPi) {
  for (int size : {1, 5, 64}) {
    EXPECT_NEAR(total_sr(Projection::kLatLong, size), 4.0 * pi, 1e-11);
    EXPECT_NEAR(total_sr(Projection::kOctahedral, size), 4.0 * pi, 1e-11);
  }
}

// What is missing from 2 pi is the staircase of the rim: as many pixels too many
// or too few as Gauss's circle problem says, each of 2 pi / N^2.
TEST(SolidAngle, HemisphereIsTwoPi) {
  for (int size : {64, 65, 100, 256, 512}) {
    const double pixels = static_cast<double>(size) * size;
    int count = 0;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        count += direction_of_pixel(Projection::kFisheye, size, x, y) ? 1 : 0;
      }
    }
    const double staircase_sr = (count - 0.25 * pi * pixels) * 2.0 * pi / pixels;
    const double total = total_sr(Projection::kFisheye, size);
    EXPECT_NEAR((total - staircase_sr) / (2.0 * pi), 1.0, 1.0 / pixels) << size;
    EXPECT_NEAR(total / (2.0 * pi), 1.0, 3e-3) << size;
  }
}

// --- The camera ---

CameraView camera(double azimuth_deg, double elevation_deg, double field_of_view_deg,
                  double aspect_ratio = 1.5) {
  constexpr double kRad = pi / 180.0;
  return {azimuth_deg * kRad, elevation_deg * kRad, field_of_view_deg * kRad, aspect_ratio};
}

TEST(Camera, PixelsComeBack) {
  for (const CameraView& view : {camera(0, 0, 65), camera(200, -50, 100, 0.7), camera(30, 90, 40),
                                 camera(30, -90, 170, 5), camera(350, 20, 0.5, 1)}) {
    for (const int size : {1, 7, 64}) {
      for (int y = 0; y < map_height(view, size); ++y) {
        for (int x = 0; x < map_width(view, size); ++x) {
          const auto direction = direction_of_pixel(view, size, x, y);
          ASSERT_TRUE(direction);
          const auto back = pixel_of_direction(view, size, *direction);
          ASSERT_TRUE(back);
          EXPECT_NEAR(back->x, x + 0.5, 1e-8);
          EXPECT_NEAR(back->y, y + 0.5, 1e-8);
        }
      }
    }
  }
}

TEST(Camera, CentreIsWhereItLooksAndEastIsRightOfNorth) {
  const MapProjection view = camera(0, 10, 60);
  const auto centre = direction_at(view, 100, {75, 50});
  EXPECT_NEAR(centre->elevation_rad, pi / 18, 1e-12);
  EXPECT_NEAR(std::remainder(centre->azimuth_rad, 2 * pi), 0.0, 1e-12);
  const auto right = direction_at(view, 100, {140, 50});
  EXPECT_GT(right->azimuth_rad, 0.0);
  EXPECT_LT(right->azimuth_rad, 0.5 * pi);
  EXPECT_GT(direction_at(view, 100, {75, 5})->elevation_rad, centre->elevation_rad);
}

// tan(30 deg) above the axis at the upper edge; the horizon is a straight level line.
TEST(Camera, FieldOfViewIsFromBottomToTop) {
  const MapProjection level = camera(90, 0, 60);
  EXPECT_NEAR(direction_at(level, 100, {75, 0})->elevation_rad, pi / 6, 1e-12);
  EXPECT_NEAR(direction_at(level, 100, {75, 100})->elevation_rad, -pi / 6, 1e-12);
  EXPECT_NEAR(direction_at(level, 100, {10, 50})->elevation_rad, 0.0, 1e-12);
  const MapProjection up = camera(90, 25, 60);
  const double row = pixel_of_direction(up, 100, {0.0, 0.5 * pi})->y;
  EXPECT_NEAR(pixel_of_direction(up, 100, {0.0, 0.5 * pi + 0.4})->y, row, 1e-9);
  EXPECT_NEAR(row, 50 + 50 * std::tan(25 * pi / 180) / std::tan(pi / 6), 1e-9);
}

TEST(Camera, SeesOnlyItsFrame) {
  const MapProjection view = camera(0, 0, 60);
  EXPECT_FALSE(pixel_of_direction(view, 100, kSouth));
  EXPECT_FALSE(pixel_of_direction(view, 100, kZenith));
  EXPECT_FALSE(pixel_of_direction(view, 100, kEast));
  EXPECT_TRUE(pixel_of_direction(view, 100, kNorth));
}

TEST(Camera, WidthFollowsTheAspectRatio) {
  EXPECT_EQ(map_width(camera(0, 0, 60, 1.5), 100), 150);
  EXPECT_EQ(map_width(camera(0, 0, 60, 0.2), 1), 1);
  EXPECT_EQ(map_height(camera(0, 0, 60, 1.5), 100), 100);
}

// A rectangle of half angles a, b: 4 asin(sin a' sin b'), here 4 atan(u v / sqrt(1 + u^2 + v^2)).
TEST(Camera, SolidAnglesSumToTheFrustums) {
  for (const double field_deg : {1.0, 65.0, 150.0}) {
    const MapProjection view = camera(40, 15, field_deg, 1.5);
    for (const int size : {2, 60}) {
      double sum = 0;
      for (int y = 0; y < size; ++y) {
        for (int x = 0; x < map_width(view, size); ++x) {
          sum += pixel_solid_angle_sr(view, size, x, y);
        }
      }
      const double v = std::tan(0.5 * field_deg * pi / 180), u = 1.5 * v;
      const double frustum = 4 * std::asin(u * v / std::sqrt((1 + u * u) * (1 + v * v)));
      EXPECT_NEAR(sum / frustum, 1.0, 1e-9) << field_deg << " " << size;
    }
  }
  // 90 degrees, square: a sixth of the sphere.
  EXPECT_NEAR(pixel_solid_angle_sr(camera(0, 0, 90, 1), 1, 0, 0), 4 * pi / 6, 1e-12);
}

TEST(Camera, RefusesBadInput) {
  EXPECT_THROW(map_width(camera(0, 0, 180), 10), std::invalid_argument);
  EXPECT_THROW(map_width(camera(0, 0, 0), 10), std::invalid_argument);
  EXPECT_THROW(map_width(camera(0, 91, 60), 10), std::invalid_argument);
  EXPECT_THROW(map_width(camera(0, 0, 60, 0.1), 10), std::invalid_argument);
  EXPECT_THROW(map_width(camera(std::nan(""), 0, 60), 10), std::invalid_argument);
  EXPECT_EQ(projection_from_name("camera"), Projection::kCamera);
  EXPECT_EQ(projection_name(Projection::kCamera), "camera");
}

TEST(Projection, RefusesBadInput) {
  EXPECT_THROW(map_width(Projection::kLatLong, 0), std::invalid_argument);
  EXPECT_THROW(map_width(Projection::kLatLong, 16385), std::invalid_argument);
  EXPECT_THROW(direction_of_pixel(Projection::kFisheye, 4, 4, 0), std::invalid_argument);
  EXPECT_THROW(pixel_solid_angle_sr(Projection::kFisheye, 4, 0, -1), std::invalid_argument);
  EXPECT_THROW(pixel_of_direction(Projection::kLatLong, 4, {2.0, 0.0}), std::invalid_argument);
  EXPECT_THROW(pixel_of_direction(Projection::kLatLong, 4, {0.0, std::nan("")}),
               std::invalid_argument);
  EXPECT_THROW(projection_from_name("mercator"), std::invalid_argument);
  for (auto projection : kAll) {
    EXPECT_EQ(projection_from_name(projection_name(projection)), projection);
  }
}

}  // namespace
}  // namespace twilight
