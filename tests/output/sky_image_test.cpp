#include "output/sky_image.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "output/sun_disc.h"
#include "tests/output/fake_sky.h"

namespace twilight {
namespace {

using std::numbers::pi;

constexpr Projection kAll[] = {Projection::kFisheye, Projection::kLatLong, Projection::kOctahedral};

ColourIntegrator integrator_of(const Sky& sky) {
  return ColourIntegrator(sky.wavelength_nm(), FakeSky::solar_irradiance_at,
                          ColourObserver::kCie1931);
}

double deg(double degrees) { return degrees * pi / 180.0; }

/// Radiance, red channel, where a map shows a direction.
float value_towards(const SkyImage& image, Projection projection, MapDirection direction) {
  const auto place = *pixel_of_direction(projection, image.height, direction);
  const auto x = std::min(static_cast<int>(place.x), image.width - 1);
  const auto y = std::min(static_cast<int>(place.y), image.height - 1);
  return image.pixels[static_cast<std::size_t>(y * image.width + x) * image.channels.size()];
}

TEST(SkyImage, TheSunsSideIsWhereTheSunIs) {
  const FakeSky sky({500.0}, [](const ViewDirection& v, double) {
    return 1.0 + std::cos(v.relative_azimuth_rad) * std::cos(v.elevation_rad);
  });
  for (auto projection : kAll) {
    for (double sun_deg : {0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0, 233.7}) {
      MapSettings settings{.projection = projection, .size = 64, .sun_azimuth_rad = deg(sun_deg)};
      const auto map = render_map(sky, integrator_of(sky), settings);
      const auto at = [&](double relative_deg) {
        return value_towards(map.colour, projection, {0.03, deg(sun_deg + relative_deg)});
      };
      EXPECT_GT(at(0.0), 1.8f * at(90.0)) << projection_name(projection) << sun_deg;
      EXPECT_LT(at(180.0), 0.2f * at(90.0)) << projection_name(projection) << sun_deg;
      EXPECT_NEAR(at(90.0) / at(-90.0), 1.0f, 0.2f) << projection_name(projection) << sun_deg;
    }
  }
}

TEST(SkyImage, MirrorsOnlyWhereTheGridIsSymmetric) {
  for (auto projection : kAll) {
    for (double sun_deg : {0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0}) {
      const auto formula = [](const ViewDirection& v, double) {
        return 3.0 + v.elevation_rad + std::cos(v.relative_azimuth_rad);
      };
      // Turned by 1e-6 rad the grid has no symmetry: every pixel is asked for,
      // and the mirrored map must equal that one up to the turn.
      const FakeSky half({550.0}, formula), whole({550.0}, formula);
      const MapSettings exact{
          .projection = projection, .size = 24, .sun_azimuth_rad = deg(sun_deg)};
      MapSettings turned = exact;
      turned.sun_azimuth_rad += 1e-6;
      const auto a = render_map(half, integrator_of(half), exact);
      const auto b = render_map(whole, integrator_of(whole), turned);
      EXPECT_LE(half.views_asked(), whole.views_asked() / 2 + 24) << projection_name(projection);
      EXPECT_EQ(whole.views_asked(), b.sky_pixels);
      EXPECT_EQ(a.sky_pixels, b.sky_pixels);
      for (std::size_t i = 0; i < a.colour.pixels.size(); ++i) {
        ASSERT_NEAR(a.colour.pixels[i], b.colour.pixels[i], 1e-5f * (1.0f + b.colour.pixels[i]))
            << projection_name(projection) << " " << sun_deg << " " << i;
      }
    }
  }
}

TEST(SkyImage, MirrorIsAnInvolutionAndNegatesTheAzimuth) {
  for (auto projection : kAll) {
    for (int eighth = -3; eighth < 12; ++eighth) {
      const double sun = eighth * 0.25 * pi;
      constexpr int kSize = 12;
      const int width = map_width(projection, kSize);
      for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < width; ++x) {
          const auto index = mirrored_pixel(projection, kSize, sun, x, y);
          ASSERT_TRUE(index);
          const int mx = static_cast<int>(*index) % width, my = static_cast<int>(*index) / width;
          EXPECT_EQ(*mirrored_pixel(projection, kSize, sun, mx, my),
                    static_cast<std::size_t>(y * width + x));
          const auto a = direction_of_pixel(projection, kSize, x, y);
          const auto b = direction_of_pixel(projection, kSize, mx, my);
          ASSERT_EQ(a.has_value(), b.has_value());
          if (!a) continue;
          EXPECT_NEAR(a->elevation_rad, b->elevation_rad, 1e-12);
          EXPECT_NEAR(std::remainder(a->azimuth_rad + b->azimuth_rad - 2.0 * sun, 2.0 * pi), 0.0,
                      1e-12);
        }
      }
    }
  }
  EXPECT_FALSE(mirrored_pixel(Projection::kFisheye, 12, 0.3, 1, 1));
  EXPECT_FALSE(mirrored_pixel(Projection::kLatLong, 12, 0.3, 1, 1));
}

// The same for a camera towards the Sun, away from it, and aside, where nothing mirrors.
TEST(SkyImage, CameraMirrorsBeforeAndBehindTheSun) {
  const auto formula = [](const ViewDirection& v, double) {
    return 3.0 + v.elevation_rad + std::cos(v.relative_azimuth_rad);
  };
  for (const double sun_deg : {40.0, 220.0, 80.0}) {
    const FakeSky half({550.0}, formula), whole({550.0}, formula);
    const CameraView camera{.azimuth_rad = deg(40), .elevation_rad = deg(-20)};
    const MapSettings exact{.projection = camera, .size = 25, .sun_azimuth_rad = deg(sun_deg)};
    MapSettings turned = exact;
    turned.sun_azimuth_rad += 1e-6;
    const auto a = render_map(half, integrator_of(half), exact);
    const auto b = render_map(whole, integrator_of(whole), turned);
    EXPECT_EQ(a.colour.width, 38);
    EXPECT_EQ(a.sky_pixels, 38U * 25);
    EXPECT_EQ(half.views_asked(), sun_deg == 80.0 ? 38U * 25 : 38U * 25 / 2);
    for (std::size_t i = 0; i < a.colour.pixels.size(); ++i) {
      ASSERT_NEAR(a.colour.pixels[i], b.colour.pixels[i], 2e-5f * (1.0f + b.colour.pixels[i]));
    }
  }
}

TEST(SkyImage, AnEvenSkyHasOneValueAndEmptyCorners) {
  const FakeSky sky(fifteen_wavelengths_nm(), [](const ViewDirection&, double) { return 0.01; });
  MapSettings settings{.size = 33, .spectral = true};
  const auto map = render_map(sky, integrator_of(sky), settings);
  EXPECT_EQ(map.colour.pixels[0], 0.0f);
  EXPECT_EQ(map.spectral->pixels[0], 0.0f);
  const std::size_t centre = 16 * 33 + 16;
  EXPECT_FLOAT_EQ(map.spectral->pixels[centre * 15 + 7], 0.015f);
  EXPECT_EQ(map.spectral->channels[7], "S0.590,000nm");
  EXPECT_NEAR(static_cast<double>(map.sky_pixels), pi / 4.0 * 33 * 33, 40.0);
}

// The illuminance on the ground of an even hemisphere of radiance L is pi L.
TEST(SkyImage, EvenSkyLightsTheGroundWithPiTimesItsRadiance) {
  const FakeSky sky(
      {550.0}, [](const ViewDirection& v, double) { return v.elevation_rad > 0.0 ? 0.02 : 0.0; });
  for (auto projection : kAll) {
    MapSettings settings{.projection = projection, .size = 128, .spectral = true};
    const auto map = render_map(sky, integrator_of(sky), settings);
    double sum = 0.0;
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < map.colour.width; ++x) {
        const auto d = direction_of_pixel(projection, 128, x, y);
        if (!d || d->elevation_rad < 0.0) continue;
        sum += map.spectral->pixels[static_cast<std::size_t>(y * map.colour.width + x)] *
               pixel_solid_angle_sr(projection, 128, x, y) * std::sin(d->elevation_rad);
      }
    }
    EXPECT_NEAR(sum / (pi * 0.03), 1.0, 1e-3) << projection_name(projection);
  }
}

TEST(SkyImage, OutOfGamutPixelsAreCountedAndMapped) {
  // Light at 440 nm alone lies outside Rec. 709.
  const FakeSky sky({430.0, 440.0, 450.0},
                    [](const ViewDirection&, double nm) { return nm == 440.0 ? 1.0 : 0.0; });
  MapSettings settings{.projection = Projection::kOctahedral, .size = 8};
  const auto map = render_map(sky, integrator_of(sky), settings);
  EXPECT_EQ(map.out_of_gamut_pixels, 64u);
  for (float value : map.colour.pixels) EXPECT_GE(value, 0.0f);
  settings.colour = MapColour::kXyz;
  EXPECT_EQ(render_map(sky, integrator_of(sky), settings).out_of_gamut_pixels, 0u);
}

TEST(SkyImage, ReportsProgressAndStops) {
  const FakeSky sky({550.0}, [](const ViewDirection&, double) { return 1.0; });
  const MapSettings settings{
      .projection = Projection::kLatLong, .size = 256, .sun_azimuth_rad = 0.123};
  RunControl control;
  double last = -1.0;
  int calls = 0;
  control.progress = [&](std::string_view, double fraction) {
    EXPECT_GT(fraction, last);
    last = fraction;
    ++calls;
  };
  render_map(sky, integrator_of(sky), settings, control);
  EXPECT_EQ(last, 1.0);
  EXPECT_GT(calls, 4);
  std::atomic<bool> stop = true;
  control.cancel = &stop;
  EXPECT_THROW(render_map(sky, integrator_of(sky), settings, control), Cancelled);
}

TEST(SkyImage, RefusesASkyThatIsNotANumber) {
  const MapSettings settings{.size = 8};
  for (double bad : {-1.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    const FakeSky sky({550.0}, [&](const ViewDirection&, double) { return bad; });
    EXPECT_THROW(render_map(sky, integrator_of(sky), settings), std::logic_error);
  }
  const FakeSky sky({550.0}, [](const ViewDirection&, double) { return 1.0; });
  const FakeSky other({450.0, 550.0}, [](const ViewDirection&, double) { return 1.0; });
  EXPECT_THROW(render_map(sky, integrator_of(other), settings), std::invalid_argument);
}

// Without a sky, the map's radiance times solid angle is the Sun's irradiance,
// whether a pixel is 45 deg or 0.02 deg wide.
TEST(SunDisc, CarriesTheSunsIrradiance) {
  FakeSky sky({500.0, 600.0}, [](const ViewDirection&, double) { return 0.0; });
  for (auto projection : kAll) {
    for (int size : {4, 31, 512, 4096}) {
      for (double elevation_deg : {0.5, 12.0, 89.9}) {
        const auto disc = sun_disc_coverage(projection, size, {deg(elevation_deg), deg(77.0)}, 0.0);
        double sum = 0.0;
        for (const auto& [index, fraction] : disc) {
          const auto width = static_cast<std::size_t>(map_width(projection, size));
          sum += fraction * pixel_solid_angle_sr(projection, size, static_cast<int>(index % width),
                                                 static_cast<int>(index / width));
          EXPECT_LT(fraction, 1.1);
        }
        EXPECT_NEAR(sum / sun_disc_solid_angle_sr(), 1.0, 1e-10)
            << projection_name(projection) << size << " " << elevation_deg;
      }
    }
  }
  const MapProjection camera = CameraView{
      .azimuth_rad = deg(70.0), .elevation_rad = deg(10.0), .field_of_view_rad = deg(30.0)};
  for (const int size : {4, 31, 512, 2048}) {
    double sum = 0.0;
    const auto width = static_cast<std::size_t>(map_width(camera, size));
    for (const auto& [index, fraction] :
         sun_disc_coverage(camera, size, {deg(12.0), deg(77.0)}, 0.0)) {
      sum += fraction * pixel_solid_angle_sr(camera, size, static_cast<int>(index % width),
                                             static_cast<int>(index / width));
    }
    EXPECT_NEAR(sum / sun_disc_solid_angle_sr(), 1.0, 1e-9) << size;
  }
  sky.set_sun(deg(5.0), 0.25);
  for (int size : {8, 300}) {
    MapSettings settings{.projection = Projection::kLatLong,
                         .size = size,
                         .sun_azimuth_rad = pi,
                         .spectral = true,
                         .sun_disc = true};
    const auto map = render_map(sky, integrator_of(sky), settings);
    double irradiance = 0.0;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < 2 * size; ++x) {
        irradiance += map.spectral->pixels[static_cast<std::size_t>(y * 2 * size + x) * 2 + 1] *
                      pixel_solid_angle_sr(Projection::kLatLong, size, x, y);
      }
    }
    EXPECT_NEAR(irradiance, 1.5 * 0.25, 1e-6);
  }
}

TEST(SunDisc, IsCutByTheHorizon) {
  const auto sum = [](double elevation_rad) {
    double sr = 0.0;
    for (const auto& [index, fraction] :
         sun_disc_coverage(Projection::kLatLong, 2000, {elevation_rad, 1.0}, 0.0)) {
      sr += fraction * pixel_solid_angle_sr(Projection::kLatLong, 2000,
                                            static_cast<int>(index % 4000),
                                            static_cast<int>(index / 4000));
    }
    return sr / sun_disc_solid_angle_sr();
  };
  EXPECT_NEAR(sum(0.0), 0.5, 1e-4);
  EXPECT_NEAR(sum(kSunAngularRadius_rad * 1.0001), 1.0, 1e-4);
  EXPECT_EQ(sum(-kSunAngularRadius_rad * 1.0001), 0.0);
}

TEST(SunDisc, InsideOfAFineDiscIsWholeAndOutsideIsNothing) {
  const MapDirection sun = {deg(10.0), deg(200.0)};
  const auto disc = sun_disc_coverage(Projection::kOctahedral, 8192, sun, 0.0);
  const auto centre = *pixel_of_direction(Projection::kOctahedral, 8192, sun);
  const auto index = static_cast<std::size_t>(centre.y) * 8192 + static_cast<std::size_t>(centre.x);
  EXPECT_EQ(disc.at(index), 1.0);
  for (const auto& [i, fraction] : disc) {
    const auto d = *direction_of_pixel(Projection::kOctahedral, 8192, static_cast<int>(i % 8192),
                                       static_cast<int>(i / 8192));
    const double cosine = std::sin(d.elevation_rad) * std::sin(sun.elevation_rad) +
                          std::cos(d.elevation_rad) * std::cos(sun.elevation_rad) *
                              std::cos(d.azimuth_rad - sun.azimuth_rad);
    EXPECT_LT(std::acos(std::min(1.0, cosine)), kSunAngularRadius_rad + deg(0.05));
  }
}

TEST(SunDisc, IsAbsentBehindTheEarth) {
  FakeSky sky({500.0}, [](const ViewDirection&, double) { return 0.5; });
  sky.set_sun(deg(-3.0), 0.0);
  MapSettings settings{.projection = Projection::kLatLong, .size = 16, .sun_disc = true};
  const auto with = render_map(sky, integrator_of(sky), settings);
  settings.sun_disc = false;
  EXPECT_EQ(with.colour.pixels, render_map(sky, integrator_of(sky), settings).colour.pixels);
}

}  // namespace
}  // namespace twilight
