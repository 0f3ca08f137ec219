// The far end of a view, against vectors in space.
#include "sim/view_segment.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

namespace twilight {
namespace {

using std::numbers::pi;
using Vector = std::array<double, 3>;

constexpr double kRadiusKm = 6371.0;

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Height, Sun and view at the end of a line, from scratch.
struct Truth {
  double altitude_km, sun_sine, view_sine, sun_view_cosine;
};
Truth by_vectors(double altitude_km, double sun, const ViewDirection& view, double km) {
  const Vector v = {std::cos(view.elevation_rad) * std::cos(view.relative_azimuth_rad),
                    std::cos(view.elevation_rad) * std::sin(view.relative_azimuth_rad),
                    std::sin(view.elevation_rad)};
  const Vector s = {std::cos(sun), 0, std::sin(sun)};
  Vector p = {0, 0, kRadiusKm + altitude_km};
  for (std::size_t i = 0; i < 3; ++i) p[i] += km * v[i];
  const double r = std::sqrt(dot(p, p));
  return {r - kRadiusKm, dot(p, s) / r, dot(p, v) / r, dot(v, s)};
}

TEST(ViewSegment, EndsWhereVectorsSay) {
  for (const double altitude_km : {0.0, 2.5, 400.0, 36000.0}) {
    for (const double sun : {1.2, 0.0, -0.2}) {
      for (const double elevation : {-1.5, -0.01, 0.0, 0.3, 1.57}) {
        for (const double azimuth : {0.0, 1.0, 3.0}) {
          const ViewDirection view{elevation, azimuth};
          const ViewSegment end = view_segment(kRadiusKm, altitude_km, sun, view, 700.0);
          const Truth truth = by_vectors(altitude_km, sun, view, end.length_km);
          EXPECT_NEAR(end.altitude_km, truth.altitude_km, 1e-8);
          EXPECT_NEAR(std::sin(end.sun_elevation_rad), truth.sun_sine, 1e-12);
          EXPECT_NEAR(std::sin(end.view.elevation_rad), truth.view_sine, 1e-12);
          // The angle between line and Sun is the same from both ends.
          const double there = std::sin(end.view.elevation_rad) * std::sin(end.sun_elevation_rad) +
                               std::cos(end.view.elevation_rad) * std::cos(end.sun_elevation_rad) *
                                   std::cos(end.view.relative_azimuth_rad);
          EXPECT_NEAR(there, truth.sun_view_cosine, 1e-12);
          EXPECT_GE(end.view.relative_azimuth_rad, 0.0);
        }
      }
    }
  }
}

TEST(ViewSegment, StopsAtTheGround) {
  const ViewSegment down = view_segment(kRadiusKm, 3.0, 0.5, {-pi / 2, 0}, 100.0);
  EXPECT_NEAR(down.length_km, 3.0, 1e-9);
  EXPECT_NEAR(down.altitude_km, 0.0, 1e-9);
  // To the horizon: the tangent, sqrt(h (2R + h)).
  const double dip = std::acos(kRadiusKm / (kRadiusKm + 3.0));
  const double tangent_km = std::sqrt(3.0 * (2 * kRadiusKm + 3.0));
  const ViewSegment grazing = view_segment(kRadiusKm, 3.0, 0.5, {-dip - 1e-9, 0}, 1000.0);
  EXPECT_NEAR(grazing.length_km, tangent_km, 0.5);
  EXPECT_EQ(view_segment(kRadiusKm, 3.0, 0.5, {-dip + 1e-6, 0}, 1000.0).length_km, 1000.0);
  EXPECT_EQ(view_segment(kRadiusKm, 0.0, 0.5, {-0.1, 0}, 10.0).length_km, 0.0);
}

TEST(ViewSegment, RefusesDistancesOutOfRange) {
  EXPECT_THROW(view_segment(kRadiusKm, 0, 0, {}, -1.0), std::invalid_argument);
  EXPECT_THROW(view_segment(kRadiusKm, 0, 0, {}, INFINITY), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
