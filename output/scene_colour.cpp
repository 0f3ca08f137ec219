#include "output/scene_colour.h"

#include "solar/solar_spectrum.h"

namespace twilight {

ColourIntegrator colour_integrator(const SceneModel& model, ColourObserver observer) {
  const double per_distance = 1.0 / (model.sun_distance_au * model.sun_distance_au);
  return ColourIntegrator(
      model.scene.spectrum.wavelengths_nm,
      [&](double wavelength_nm) {
        return per_distance * solar_irradiance_w_m2_nm(model.scene.sun.spectrum, wavelength_nm);
      },
      observer);
}

}  // namespace twilight
