// Studies: scenes and axes, and what is said of wrong ones.
#include "output/study_axes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "output/sky_fit.h"
#include "tests/temporary_folder.h"

namespace twilight {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class StudyAxes : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    return folder_.write(name, text);
  }
  Study study(const std::string& text) const { return load_study(write("study.toml", text)); }
  std::string refusal(const std::string& text) const {
    try {
      study(text);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "accepted";
  }

  TemporaryFolder folder_;
};

constexpr const char* kScene = "[sun]\nelevation_deg = 3\n";

TEST_F(StudyAxes, AreCrossedTheLastFastest) {
  write("scene.toml", kScene);
  const Study s = study(R"(scene = "scene.toml"
[[axis]]
key = "earth.ground_albedo"
values = [0.1, 0.5]
[[axis]]
key = "sun.elevation_deg"
from = -6
to = 6
count = 3
)");
  EXPECT_EQ(s.nodes(), 6u);
  EXPECT_THAT(s.values_at(0), ElementsAre(0.1, -6));
  EXPECT_THAT(s.values_at(1), ElementsAre(0.1, 0));
  EXPECT_THAT(s.values_at(3), ElementsAre(0.5, -6));
  EXPECT_EQ(s.scene.scene.sun.elevation_deg, 3);
}

TEST_F(StudyAxes, LogarithmicStepsHaveOneRatio) {
  const Study s = study(std::string(kScene) + R"([[axis]]
key = "aerosols.optical_depth_550nm"
from = 0.05
to = 0.8
count = 5
spacing = "log"
)");
  const auto& v = s.axes.at(0).values;
  ASSERT_EQ(v.size(), 5u);
  EXPECT_EQ(v.front(), 0.05);
  EXPECT_EQ(v.back(), 0.8);
  for (std::size_t k = 1; k < v.size(); ++k) EXPECT_NEAR(v[k] / v[k - 1], 2, 1e-12);
}

TEST_F(StudyAxes, ASceneIsAStudyOfOne) {
  const Study s = study(kScene);
  EXPECT_TRUE(s.axes.empty());
  EXPECT_EQ(s.nodes(), 1u);
}

TEST_F(StudyAxes, AnAxisOfTheSunIsSunEnough) {
  EXPECT_EQ(study("[[axis]]\nkey = \"sun.elevation_deg\"\nvalues = [7]\n").nodes(), 1u);
}

TEST_F(StudyAxes, ComplaintsNameFileLineKeyAndValue) {
  const auto axis = [](const std::string& lines) { return kScene + ("[[axis]]\n" + lines); };
  EXPECT_THAT(
      refusal(axis("key = \"earth.ground_albed\"\nvalues = [1]\n")),
      testing::AllOf(HasSubstr("study.toml:4: key 'axis.key' = "), HasSubstr("earth.ground_albed"),
                     HasSubstr("did you mean 'earth.ground_albedo'?")));
  EXPECT_THAT(
      refusal(axis("key = \"aerosols.type\"\nvalues = [1]\n")),
      testing::AllOf(HasSubstr("study.toml:4:"), HasSubstr("'aerosols.type' = 1: must be a")));
  EXPECT_THAT(refusal(axis("key = \"spectrum.solved_nm\"\nvalues = [1]\n")),
              HasSubstr("must be a key that holds one value"));
  EXPECT_THAT(refusal(axis("key = \"earth.ground_albedo\"\nvalues = [0.1, 1.4]\n")),
              testing::AllOf(HasSubstr("study.toml:4:"), HasSubstr("= 1.4: must be 0..1")));
  EXPECT_THAT(refusal(axis("key = \"earth.ground_albedo\"\nvalues = []\n")),
              HasSubstr("study.toml:5: key 'axis.values'"));
  EXPECT_THAT(refusal(axis("key = \"earth.ground_albedo\"\nvalues = [0.1, 0.1]\n")),
              HasSubstr("has the value 0.1 twice"));
  EXPECT_THAT(refusal(axis("key = \"earth.ground_albedo\"\nvalues = [\"a\"]\n")),
              HasSubstr("must be a number"));
  EXPECT_THAT(refusal(axis("key = \"earth.ground_albedo\"\nvalue = [0.1]\n")),
              HasSubstr("key 'axis.value' = "));
  EXPECT_THAT(refusal(axis("key = \"earth.ground_albedo\"\nfrom = 0\nto = 1\ncount = 1\n")),
              HasSubstr("study.toml:7: key 'axis.count' = 1: must be an integer, 2..1000"));
  EXPECT_THAT(refusal(axis(
                  "key = \"earth.ground_albedo\"\nfrom = 0\nto = 1\ncount = 3\nspacing=\"log\"\n")),
              HasSubstr("must be above 0"));
  EXPECT_THAT(refusal(axis("values = [1]\n")), HasSubstr("must have a key 'key'"));
  EXPECT_THAT(refusal(axis("key = \"solver.threads\"\nvalues = [1.5]\n")),
              HasSubstr("must be an integer"));
}

TEST_F(StudyAxes, OneKeyIsOneAxis) {
  const std::string axis = "[[axis]]\nkey = \"sun.elevation_deg\"\nvalues = [1]\n";
  EXPECT_THAT(refusal(axis + axis), HasSubstr("is an axis already"));
}

TEST_F(StudyAxes, ASceneIsNamedOrGivenNotBoth) {
  write("scene.toml", kScene);
  EXPECT_THAT(refusal("scene = \"scene.toml\"\n" + std::string(kScene)),
              HasSubstr("study.toml:2: key 'sun' must not be given beside 'scene'"));
}

TEST_F(StudyAxes, MayBeWordsAndTruths) {
  const Study s = study(std::string(kScene) + R"([[axis]]
key = "aerosols.type"
values = ["desert", "urban"]
[[axis]]
key = "aerosols.stratosphere"
values = [true, false]
)");
  EXPECT_EQ(s.nodes(), 4u);
  const Scene scene = s.scene_at(2).scene;
  EXPECT_EQ(scene.aerosols.type, "urban");
  EXPECT_TRUE(scene.aerosols.stratosphere);
  EXPECT_EQ(s.place(1), "aerosols.type = desert, aerosols.stratosphere = false");
  EXPECT_THAT(refusal(std::string(kScene) +
                      "[[axis]]\nkey = \"aerosols.type\"\nvalues = [\"desert\", 3]\n"),
              HasSubstr("must be all numbers, all words"));
}

TEST_F(StudyAxes, OfTheSunTakeThePlaceOfPlaceAndTime) {
  const Study s = study(R"([observer]
latitude_deg = 49
longitude_deg = 7
time = "2003-12-08T17:00:00+01:00"
[[axis]]
key = "sun.elevation_deg"
values = [7, 2]
)");
  EXPECT_TRUE(s.scene.scene.observer.time);
  EXPECT_EQ(s.scene_at(1).scene.sun.elevation_deg, 2);
  EXPECT_FALSE(s.scene_at(1).scene.observer.time);
}

constexpr const char* kTwoAxes = R"([[axis]]
key = "earth.ground_albedo"
values = [0.1, 0.5, 0.1]
zip = "surface"
[[axis]]
key = "sun.elevation_deg"
values = [4, 2]
[[axis]]
key = "atmosphere.ozone_du"
values = [200, 300, 400]
zip = "surface"
)";

TEST_F(StudyAxes, OfOneZipMoveTogetherCrossedWithTheOthers) {
  const Study s = study(kScene + std::string(kTwoAxes));
  EXPECT_EQ(s.nodes(), 6u);
  EXPECT_FALSE(s.crossed());
  EXPECT_THAT(s.values_at(3), ElementsAre(0.5, 2, 300));
  EXPECT_THAT(s.values_at(4), ElementsAre(0.1, 4, 400));
}

TEST_F(StudyAxes, AllZippedAreAList) {
  const Study s = study(R"(sampling = "zipped"
[[axis]]
key = "earth.ground_albedo"
values = [0.1, 0.5]
[[axis]]
key = "sun.elevation_deg"
from = 3
to = 9
count = 2
)");
  EXPECT_EQ(s.nodes(), 2u);
  EXPECT_THAT(s.values_at(1), ElementsAre(0.5, 9));
  EXPECT_THAT(refusal(R"(sampling = "zipped"
[[axis]]
key = "earth.ground_albedo"
values = [0.1, 0.5, 0.7]
[[axis]]
key = "sun.elevation_deg"
values = [1, 2]
)"),
              HasSubstr("axis 'sun.elevation_deg' has 2 values: must have 3"));
}

// The law of the design: of every axis each of N equal steps holds exactly one of N points.
TEST_F(StudyAxes, ALatinHypercubeHitsEveryStepOfEveryAxisOnce) {
  const auto cube = [&](int seed) {
    return study("sampling = \"latin-hypercube\"\nsamples = 37\nseed = " + std::to_string(seed) +
                 "\n" + kScene + R"([[axis]]
key = "earth.ground_albedo"
from = 0
to = 1
[[axis]]
key = "aerosols.optical_depth_550nm"
from = 0.01
to = 1
spacing = "log"
[[axis]]
key = "sun.elevation_deg"
values = [4, 2]
)");
  };
  const Study s = cube(5);
  EXPECT_EQ(s.nodes(), 74u);
  std::vector<int> linear(37), logarithmic(37);
  for (std::size_t node = 0; node < s.nodes(); node += 2) {
    const std::vector<double> v = s.values_at(node);
    ++linear.at(static_cast<std::size_t>(v[0] * 37));
    ++logarithmic.at(static_cast<std::size_t>(std::log(v[1] / 0.01) / std::log(100.0) * 37));
  }
  EXPECT_THAT(linear, testing::Each(1));
  EXPECT_THAT(logarithmic, testing::Each(1));
  EXPECT_EQ(cube(5).axes[0].values, s.axes[0].values);
  EXPECT_NE(cube(6).axes[0].values, s.axes[0].values);
  EXPECT_NE(s.axes[0].values, s.axes[1].values);
}

TEST_F(StudyAxes, SamplingKeysAreChecked) {
  EXPECT_THAT(refusal("sampling = \"random\"\n" + std::string(kScene)),
              HasSubstr("study.toml:1: key 'sampling' = 'random': must be \"crossed\""));
  EXPECT_THAT(refusal("samples = 5\n" + std::string(kScene)),
              HasSubstr("must only be given where sampling is \"latin-hypercube\""));
  EXPECT_THAT(refusal("sampling = \"latin-hypercube\"\nsamples = 1\n" + std::string(kScene)),
              HasSubstr("must be an integer, 2..100000"));
}

TEST_F(StudyAxes, FitsTakeNeitherWordsNorLists) {
  EXPECT_THROW(study_for_fit(study(kScene + std::string(kTwoAxes)), {}), std::invalid_argument);
  EXPECT_THROW(study_for_fit(study(kScene + std::string("[[axis]]\nkey = \"aerosols.type\"\n"
                                                        "values = [\"desert\"]\n")),
                             {}),
               std::invalid_argument);
}

TEST_F(StudyAxes, FitsTakeAxesOfTheSkyAlone) {
  const auto fitted = [&](const std::string& key) {
    return study_for_fit(study(kScene + ("[[axis]]\nkey = \"" + key + "\"\nvalues = [32]\n")), {});
  };
  EXPECT_THROW(fitted("solver.phase_degree"), std::invalid_argument);
  EXPECT_THROW(fitted("atmosphere.layers"), std::invalid_argument);
  EXPECT_THROW(fitted("output.size"), std::invalid_argument);
  const Study s = fitted("aerosols.relative_humidity_percent");
  ASSERT_EQ(s.axes.size(), 2u);
  EXPECT_EQ(s.axes[1].key, "sun.elevation_deg");
  EXPECT_TRUE(std::ranges::is_sorted(s.axes[1].values));
  EXPECT_EQ(s.scene.scene.solver.method, "orders");
}

}  // namespace
}  // namespace twilight
