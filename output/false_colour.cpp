#include "output/false_colour.h"

#include <algorithm>
#include <cmath>

namespace twilight {

Rgb8 diverging_colour(double value) {
  if (std::isnan(value)) return {128, 128, 128};
  constexpr double kCool[] = {59, 76, 192}, kMiddle[] = {242, 242, 242}, kWarm[] = {180, 4, 38};
  const double t = std::min(1.0, std::abs(value));
  Rgb8 colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double end = value < 0 ? kCool[c] : kWarm[c];
    colour[c] = static_cast<std::uint8_t>(std::lround(std::lerp(kMiddle[c], end, t)));
  }
  return colour;
}

Rgb8 ratio_colour(double ratio, double full) {
  return diverging_colour(ratio > 0 ? std::log(ratio) / std::log(full) : ratio == 0 ? -1 : ratio);
}

}  // namespace twilight
