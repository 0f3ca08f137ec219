#include "output/preview.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <numbers>
#include <stdexcept>

#include "output/colour.h"
#include "tests/output/fake_sky.h"

namespace twilight {
namespace {

SkyImage grey_ramp(float factor) {
  SkyImage image{256, 1, {"R", "G", "B"}, {}};
  for (int i = 0; i < 256; ++i) {
    for (int c = 0; c < 3; ++c) {
      image.pixels.push_back(factor * std::pow(10.0f, static_cast<float>(i) / 100.0f));
    }
  }
  return image;
}

TEST(Preview, DoesNotDependOnTheUnitOfLight) {
  EXPECT_EQ(tone_map(grey_ramp(1e-6f)), tone_map(grey_ramp(1e-6f * 1024.0f)));
}

TEST(Preview, GreyStaysGreyAndRisesWithLight) {
  const auto bytes = tone_map(grey_ramp(1.0f));
  for (std::size_t i = 0; i < 256; ++i) {
    EXPECT_EQ(bytes[3 * i], bytes[3 * i + 1]);
    EXPECT_EQ(bytes[3 * i], bytes[3 * i + 2]);
    if (i > 0) {
      EXPECT_GE(bytes[3 * i], bytes[3 * i - 3]);
    }
  }
  EXPECT_GT(bytes[0], 20) << "crushed blacks";
  EXPECT_GT(bytes[765], 250);
}

// An even sky: key 0.2, burn-out 1: 0.2 (1 + 0.2)/1.2 = 0.2, in sRGB (IEC 61966-2-1) 0.4845 = 124.
TEST(Preview, EvenSkyIsShownAtTheKey) {
  SkyImage image{4, 4, {"R", "G", "B"}, std::vector<float>(48, 7.0f)};
  for (auto byte : tone_map(image)) EXPECT_EQ(byte, 124);
}

TEST(Preview, HueIsKeptWhereThereIsRoom) {
  SkyImage image{64, 1, {"R", "G", "B"}, {}};
  for (int i = 0; i < 64; ++i) {
    for (float part : {0.3f, 0.6f, 1.0f}) {
      image.pixels.push_back(part * std::exp2(static_cast<float>(i) / 16.0f));
    }
  }
  const auto bytes = tone_map(image);
  const auto linear = [&](std::size_t i) {
    const double s = bytes[i] / 255.0;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  };
  EXPECT_NEAR(linear(0) / linear(2), 0.3, 0.02);
  EXPECT_NEAR(linear(1) / linear(2), 0.6, 0.02);
  for (std::size_t i = 0; i < 64; ++i) {  // the order of the channels stays to the end
    EXPECT_LE(bytes[3 * i], bytes[3 * i + 1]);
    EXPECT_LE(bytes[3 * i + 1], bytes[3 * i + 2]);
  }
}

TEST(Preview, ASunDiscDoesNotDarkenTheSky) {
  SkyImage image{100, 100, {"R", "G", "B"}, std::vector<float>(30000, 1.0f)};
  const auto without = tone_map(image);
  for (std::size_t i = 0; i < 3; ++i) image.pixels[i] = 1e5f;
  const auto with = tone_map(image);
  EXPECT_NEAR(with[300], without[300], 2);
  EXPECT_EQ(with[0], 255);
}

// A Sun redder than its glow and 20 to 1e5 times as bright, as near the horizon.
TEST(Preview, ALowRedSunIsNoDarkerThanItsGlow) {
  SkyImage image{100, 100, {"R", "G", "B"}, {}};
  for (int i = 0; i < 10000; ++i) {
    const float bright = std::exp2(static_cast<float>(i) / 2000.0f);
    for (const float part : {1.0f, 0.5f, 0.08f}) image.pixels.push_back(bright * part);
  }
  const std::size_t sun = 30000 - 3 * 40;  // in the brightest sky
  for (int step = 0; step < 40; ++step) {
    const float bright = 32.0f * 20.0f * std::pow(10.0f, static_cast<float>(step) / 10.0f);
    for (std::size_t i = 0; i < 40; ++i) {
      const float part = 1.0f - static_cast<float>(i) / 40.0f;  // of the pixel
      image.pixels[sun + 3 * i] = 32.0f + part * bright;
      image.pixels[sun + 3 * i + 1] = 16.0f + part * bright * 0.22f;
      image.pixels[sun + 3 * i + 2] = 2.56f;
    }
    const auto bytes = tone_map(image);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_GE(bytes[sun + c], bytes[sun - 3 + c]) << bright;
  }
}

TEST(Preview, EmptyPixelsDoNotCount) {
  SkyImage image{2, 1, {"R", "G", "B"}, {0, 0, 0, 5, 5, 5}};
  const auto bytes = tone_map(image);
  EXPECT_EQ(bytes[0], 0);
  EXPECT_EQ(bytes[3], 124);
  const SkyImage dark{2, 1, {"R", "G", "B"}, std::vector<float>(6, 0.0f)};
  for (auto byte : tone_map(dark)) EXPECT_EQ(byte, 0);
}

TEST(Preview, XyzLooksLikeRgb) {
  const FakeSky sky(fifteen_wavelengths_nm(), dusk_formula);
  const ColourIntegrator integrator(sky.wavelength_nm(), FakeSky::solar_irradiance_at,
                                    ColourObserver::kCie1931);
  MapSettings settings{.size = 32, .sun_azimuth_rad = std::numbers::pi};
  const auto rgb = tone_map(render_map(sky, integrator, settings).colour);
  settings.colour = MapColour::kXyz;
  const auto xyz = tone_map(render_map(sky, integrator, settings).colour);
  for (std::size_t i = 0; i < rgb.size(); ++i) EXPECT_NEAR(rgb[i], xyz[i], 1);
}

TEST(Preview, ItsOwnExposureIsTheDefault) {
  const SkyImage image = grey_ramp(3.0f);
  EXPECT_EQ(tone_map(image, {.exposure = sky_exposure(image)}), tone_map(image));
  EXPECT_FALSE(sky_exposure({2, 1, {"R", "G", "B"}, std::vector<float>(6, 0.0f)}));
}

// With a given exposure what is shown depends on a pixel alone, not on the picture around it.
TEST(Preview, OneExposureShowsOneLightAlike) {
  const PreviewSettings fixed{.exposure = ToneExposure{2.0, 30.0}};
  const SkyImage alone{1, 1, {"R", "G", "B"}, {3, 4, 5}};
  const SkyImage beside{2, 1, {"R", "G", "B"}, {3, 4, 5, 900, 900, 900}};
  const auto one = tone_map(alone, fixed), two = tone_map(beside, fixed);
  for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(one[c], two[c]);
  // Grey 2 goes to the key: 0.2 (1 + 0.2/9)/1.2 = 0.17037 with white 30 (3 before the curve), in
  // sRGB 0.4497 = 115.
  const auto grey = tone_map({1, 1, {"R", "G", "B"}, {2, 2, 2}}, fixed);
  EXPECT_EQ(grey[0], 115);
  EXPECT_THROW(tone_map(alone, {.exposure = ToneExposure{0.0, 1.0}}), std::invalid_argument);
}

TEST(Preview, RefusesBadInput) {
  SkyImage image{1, 1, {"R", "G", "B"}, {1, 1, 1}};
  EXPECT_THROW(tone_map(image, {.key = 0.0}), std::invalid_argument);
  image.channels = {"A", "B", "C"};
  EXPECT_THROW(tone_map(image), std::logic_error);
}

}  // namespace
}  // namespace twilight
