#include "output/photometry.h"

#include <stdexcept>

namespace twilight {

double photometric_value(const ColourIntegrator& integrator, std::span<const double> spectrum,
                         std::span<const double> solar_irradiance) {
  if (integrator.observer() != ColourObserver::kCie1931) {
    throw std::invalid_argument(
        "colour observer is \"cie1964\"; photometry needs \"cie1931\" (its y is V(lambda))");
  }
  return kLuminousEfficacy_lm_w * integrator.xyz(spectrum, solar_irradiance)[1];
}

}  // namespace twilight
