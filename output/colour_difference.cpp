#include "output/colour_difference.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace twilight {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;

// The cube root with its straight start (CIE 15:2004, eqs. 8.6 to 8.11).
double lab_curve(double ratio) {
  constexpr double kEdge = 24.0 / 116.0;
  if (ratio > kEdge * kEdge * kEdge) return std::cbrt(ratio);
  return 841.0 / 108.0 * ratio + 16.0 / 116.0;
}

void require_finite(const LabColour& colour) {
  if (std::isfinite(colour.lightness) && std::isfinite(colour.a) && std::isfinite(colour.b)) return;
  throw std::invalid_argument("L*a*b* is " + std::to_string(colour.lightness) + ", " +
                              std::to_string(colour.a) + ", " + std::to_string(colour.b) +
                              "; it must be finite");
}

// c^7/(c^7 + 25^7) under the root of eqs. 4 and 17.
double saturation_of(double chroma) {
  const double seventh = std::pow(chroma, 7);
  return std::sqrt(seventh / (seventh + std::pow(25.0, 7)));
}

// Hue angle in degrees, 0..360; 0 for greys (eq. 7).
double hue_deg(double a, double b) {
  if (a == 0.0 && b == 0.0) return 0.0;
  const double hue = std::atan2(b, a) / kDeg;
  return hue < 0.0 ? hue + 360.0 : hue;
}

}  // namespace

LabColour lab_of(const Tristimulus& xyz, const Tristimulus& white) {
  Tristimulus f;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!std::isfinite(white[c]) || white[c] <= 0.0 || !std::isfinite(xyz[c])) {
      throw std::invalid_argument(
          "component " + std::to_string(c) + " of the colour is " + std::to_string(xyz[c]) +
          ", of the white " + std::to_string(white[c]) + "; they must be finite, the white's > 0");
    }
    f[c] = lab_curve(xyz[c] / white[c]);
  }
  return {116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])};
}

double ciede2000(const LabColour& first, const LabColour& second) {
  require_finite(first);
  require_finite(second);
  const double mean_ab = 0.5 * (std::hypot(first.a, first.b) + std::hypot(second.a, second.b));
  const double stretch = 1.5 - 0.5 * saturation_of(mean_ab);  // 1 + G, eqs. 4, 5
  const double a1 = stretch * first.a, a2 = stretch * second.a;
  const double c1 = std::hypot(a1, first.b), c2 = std::hypot(a2, second.b);
  const double h1 = hue_deg(a1, first.b), h2 = hue_deg(a2, second.b);
  const bool grey = c1 * c2 == 0.0;

  const double lightness = second.lightness - first.lightness, chroma = c2 - c1;
  // Hues opposite each other are 180 degrees apart whatever rounding says (published pairs 9, 10).
  constexpr double kHalfTurn = 180.0 + 1e-9;
  double hue_step = grey ? 0.0 : h2 - h1;
  if (hue_step > kHalfTurn) hue_step -= 360.0;
  if (hue_step < -kHalfTurn) hue_step += 360.0;
  const double hue = 2.0 * std::sqrt(c1 * c2) * std::sin(0.5 * hue_step * kDeg);

  const double mean_lightness = 0.5 * (first.lightness + second.lightness);
  const double mean_chroma = 0.5 * (c1 + c2);
  double mean_hue = h1 + h2;  // of a grey and a colour: the colour's (eq. 14)
  if (!grey) {
    if (std::abs(h1 - h2) > kHalfTurn) mean_hue += mean_hue < 360.0 ? 360.0 : -360.0;
    mean_hue *= 0.5;
  }
  const double t = 1.0 - 0.17 * std::cos((mean_hue - 30.0) * kDeg) +
                   0.24 * std::cos(2.0 * mean_hue * kDeg) +
                   0.32 * std::cos((3.0 * mean_hue + 6.0) * kDeg) -
                   0.20 * std::cos((4.0 * mean_hue - 63.0) * kDeg);
  const double from_blue = (mean_hue - 275.0) / 25.0;
  const double turn_deg = 30.0 * std::exp(-from_blue * from_blue);
  const double from_50 = (mean_lightness - 50.0) * (mean_lightness - 50.0);
  const double l = lightness / (1.0 + 0.015 * from_50 / std::sqrt(20.0 + from_50));
  const double c = chroma / (1.0 + 0.045 * mean_chroma);
  const double h = hue / (1.0 + 0.015 * mean_chroma * t);
  const double rotation = -std::sin(2.0 * turn_deg * kDeg) * 2.0 * saturation_of(mean_chroma);
  return std::sqrt(l * l + c * c + h * h + rotation * c * h);
}

}  // namespace twilight
