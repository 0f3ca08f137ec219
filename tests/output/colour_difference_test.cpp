#include "output/colour_difference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "output/colour.h"

namespace twilight {
namespace {

struct Pair {
  LabColour first, second;
  double difference;
};

// Sharma, Wu & Dalal (2005), Color Res. Appl. 30(1), 21-30, Table 1.
constexpr Pair kPublished[] = {
    {{50.0000, 2.6772, -79.7751}, {50.0000, 0.0000, -82.7485}, 2.0425},
    {{50.0000, 3.1571, -77.2803}, {50.0000, 0.0000, -82.7485}, 2.8615},
    {{50.0000, 2.8361, -74.0200}, {50.0000, 0.0000, -82.7485}, 3.4412},
    {{50.0000, -1.3802, -84.2814}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, -1.1848, -84.8006}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, -0.9009, -85.5211}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, 0.0000, 0.0000}, {50.0000, -1.0000, 2.0000}, 2.3669},
    {{50.0000, -1.0000, 2.0000}, {50.0000, 0.0000, 0.0000}, 2.3669},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0009}, 7.1792},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0010}, 7.1792},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0011}, 7.2195},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0012}, 7.2195},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0009, -2.4900}, 4.8045},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0010, -2.4900}, 4.8045},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0011, -2.4900}, 4.7461},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 0.0000, -2.5000}, 4.3065},
    {{50.0000, 2.5000, 0.0000}, {73.0000, 25.0000, -18.0000}, 27.1492},
    {{50.0000, 2.5000, 0.0000}, {61.0000, -5.0000, 29.0000}, 22.8977},
    {{50.0000, 2.5000, 0.0000}, {56.0000, -27.0000, -3.0000}, 31.9030},
    {{50.0000, 2.5000, 0.0000}, {58.0000, 24.0000, 15.0000}, 19.4535},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.1736, 0.5854}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.2972, 0.0000}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 1.8634, 0.5757}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.2592, 0.3350}, 1.0000},
    {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
    {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
    {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
    {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
    {{22.7233, 20.0904, -46.6940}, {23.0331, 14.9730, -42.5619}, 2.0373},
    {{36.4612, 47.8580, 18.3852}, {36.2715, 50.5065, 21.2231}, 1.4146},
    {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
    {{90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}, 1.5381},
    {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
    {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082},
};

TEST(ColourDifference, MeetsThePublishedPairsBothWays) {
  static_assert(std::size(kPublished) == 34);
  for (const Pair& pair : kPublished) {
    // Half a unit of the last printed digit.
    EXPECT_NEAR(ciede2000(pair.first, pair.second), pair.difference, 0.5001e-4);
    EXPECT_NEAR(ciede2000(pair.second, pair.first), pair.difference, 0.5001e-4);
  }
}

TEST(ColourDifference, IsZeroOfAColourAndItselfAndNeverNegative) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> lightness(0, 100), chroma(-120, 120);
  for (int k = 0; k < 2000; ++k) {
    const LabColour a{lightness(random), chroma(random), chroma(random)};
    const LabColour b{lightness(random), chroma(random), chroma(random)};
    EXPECT_EQ(ciede2000(a, a), 0.0);
    EXPECT_GT(ciede2000(a, b), 0.0);
  }
}

TEST(ColourDifference, GreysDifferByLightnessAlone) {
  // S_L at mean lightness 50 is 1 (eq. 15).
  EXPECT_NEAR(ciede2000({48, 0, 0}, {52, 0, 0}), 4.0, 1e-12);
}

TEST(Lab, WhiteIsHundredAndBlackZero) {
  const Tristimulus white = {0.9505, 1.0, 1.089};
  const LabColour of_white = lab_of(white, white), of_black = lab_of({0, 0, 0}, white);
  EXPECT_NEAR(of_white.lightness, 100, 1e-12);
  EXPECT_NEAR(of_white.a, 0, 1e-12);
  EXPECT_NEAR(of_white.b, 0, 1e-12);
  EXPECT_NEAR(of_black.lightness, 0, 1e-12);
  EXPECT_NEAR(of_black.a, 0, 1e-12);
}

TEST(Lab, RedPrimaryOfRec709) {
  // The well-known L*a*b* of sRGB's red in D65: 53.24, 80.09, 67.20 (Lindbloom).
  const ColourMatrix& matrix = xyz_from_rec709();
  Tristimulus red, white;
  for (std::size_t c = 0; c < 3; ++c) {
    red[c] = matrix[c][0];
    white[c] = matrix[c][0] + matrix[c][1] + matrix[c][2];
  }
  const LabColour lab = lab_of(red, white);
  EXPECT_NEAR(lab.lightness, 53.24, 0.02);
  EXPECT_NEAR(lab.a, 80.09, 0.03);
  EXPECT_NEAR(lab.b, 67.20, 0.03);
}

TEST(Lab, CurveIsContinuousWhereItTurnsStraight) {
  const double edge = std::pow(24.0 / 116.0, 3);
  const Tristimulus white = {1, 1, 1};
  const double below = lab_of({edge - 1e-12, edge - 1e-12, edge - 1e-12}, white).lightness;
  const double above = lab_of({edge + 1e-12, edge + 1e-12, edge + 1e-12}, white).lightness;
  EXPECT_NEAR(below, 8.0, 1e-8);  // CIE 15: L* = 8 there
  EXPECT_NEAR(above, below, 1e-8);
}

TEST(Lab, RefusesWhatIsNoColour) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(lab_of({1, 1, 1}, {1, 0, 1}), std::invalid_argument);
  EXPECT_THROW(lab_of({nan, 1, 1}, {1, 1, 1}), std::invalid_argument);
  EXPECT_THROW(ciede2000({nan, 0, 0}, {50, 0, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace twilight
