#include "sim/horizontal_quadrature.h"

#include <cmath>
#include <numbers>

#include "sim/gauss_legendre.h"

namespace twilight {

HorizontalQuadrature horizontal_quadrature(int elevations, int azimuths) {
  using std::numbers::pi;
  HorizontalQuadrature all;
  for (const GaussNode& g : gauss_legendre(elevations, 0, 1)) {
    const double sine = g.x * g.x;
    for (int k = 0; k < azimuths; ++k) {
      all.views.push_back({std::asin(sine), (k + 0.5) * pi / azimuths});
      all.weight_sr.push_back(2 * g.x * g.weight * sine * 2 * pi / azimuths);
    }
  }
  return all;
}

}  // namespace twilight
