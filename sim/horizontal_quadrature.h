// The irradiance of a horizontal surface as a sum over views.
#pragma once

#include <vector>

#include "sim/sky.h"

namespace twilight {

/// Views of the upper hemisphere and the weights, sr, with which their radiances add up to the
/// irradiance of a horizontal surface, of skies that are even functions of the azimuth from the
/// Sun.
struct HorizontalQuadrature {
  std::vector<ViewDirection> views;
  std::vector<double> weight_sr;
};

/// Gauss-Legendre in the root of sin(elevation), which crowds at the horizon, times midpoints in
/// azimuth over half a turn; 24 x 16 gives smooth skies within 1e-3. The weights add up to pi.
HorizontalQuadrature horizontal_quadrature(int elevations, int azimuths);

}  // namespace twilight
