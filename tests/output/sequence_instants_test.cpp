#include "output/sequence_instants.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "solar/time_point.h"

namespace twilight {
namespace {

Scene elevation_scene() {
  Scene scene;
  scene.sun.elevation_deg = 1;
  return scene;
}

Scene place_scene() {
  Scene scene;
  scene.observer.latitude_deg = 49.25;
  scene.observer.longitude_deg = 6.97;
  scene.observer.time = "2003-12-08T17:00:00+01:00";
  return scene;
}

std::string complaint(const Scene& scene, const std::string& from, const std::string& to,
                      int frames = 3) {
  try {
    sequence_scenes(scene, from, to, frames);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

TEST(SequenceInstants, ElevationsAreEvenAndTheirEndsExact) {
  for (const auto& [from, to] : {std::pair("5", "-12"), std::pair("-12", "+5")}) {
    const auto scenes = sequence_scenes(elevation_scene(), from, to, 35);
    ASSERT_EQ(scenes.size(), 35u);
    EXPECT_EQ(*scenes.front().sun.elevation_deg, std::stod(from));
    EXPECT_EQ(*scenes.back().sun.elevation_deg, std::stod(to));
    const double step = (std::stod(to) - std::stod(from)) / 34;
    for (std::size_t k = 1; k < scenes.size(); ++k) {
      EXPECT_NEAR(*scenes[k].sun.elevation_deg - *scenes[k - 1].sun.elevation_deg, step, 1e-12);
    }
  }
}

TEST(SequenceInstants, TimesAreEvenAcrossOffsetsAndMidnight) {
  const auto scenes =
      sequence_scenes(place_scene(), "2003-12-08T23:00:00+01:00", "2003-12-09T00:30:00Z", 4);
  const std::vector<std::string> wanted = {"2003-12-08T23:00:00+01:00", "2003-12-08T23:50:00+01:00",
                                           "2003-12-09T00:40:00+01:00",
                                           "2003-12-09T01:30:00+01:00"};
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(*scenes[k].observer.time, wanted[k]);
  // Steps that are no whole seconds are kept to the millisecond.
  const auto fine =
      sequence_scenes(place_scene(), "2003-12-08T17:00:00Z", "2003-12-08T17:00:01Z", 8);
  EXPECT_EQ(*fine[1].observer.time, "2003-12-08T17:00:00.143Z");
  // Backwards in time.
  const auto back =
      sequence_scenes(place_scene(), "2003-12-08T18:00:00Z", "2003-12-08T17:00:00Z", 3);
  EXPECT_EQ(*back[1].observer.time, "2003-12-08T17:30:00Z");
}

TEST(SequenceInstants, RefusesWhatTheSceneCannotMean) {
  using testing::HasSubstr;
  EXPECT_THAT(
      complaint(elevation_scene(), "2003-12-08T17:00:00Z", "5"),
      testing::AllOf(HasSubstr("--from 2003"), HasSubstr("-90..90"), HasSubstr("no place")));
  EXPECT_THAT(complaint(elevation_scene(), "5", "-91"), HasSubstr("--to -91"));
  EXPECT_THAT(complaint(elevation_scene(), "5", "nan"), HasSubstr("--to nan"));
  EXPECT_THAT(complaint(elevation_scene(), "5", "5.0"), HasSubstr("must differ"));
  EXPECT_THAT(complaint(place_scene(), "5", "-12"), HasSubstr("names a place"));
  EXPECT_THAT(complaint(place_scene(), "2003-12-08T17:00:00", "2003-12-08T18:00:00Z"),
              HasSubstr("--from"));
  EXPECT_THAT(complaint(place_scene(), "2003-12-08T17:00:00Z", "2003-13-08T18:00:00Z"),
              HasSubstr("--to"));
  for (const int frames : {-1, 0, 1, 100001}) {
    EXPECT_THAT(complaint(elevation_scene(), "5", "-12", frames), HasSubstr("2..100000"));
  }
}

}  // namespace
}  // namespace twilight
