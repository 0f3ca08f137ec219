// Colour and light as the eye weighs them, for a scene's wavelengths and Sun.
#pragma once

#include "output/colour.h"
#include "sim/scene_model.h"

namespace twilight {

/// Colour or photometric weights for the model's wavelengths, solar spectrum and distance from the
/// Sun, for skies solved of this model.
ColourIntegrator colour_integrator(const SceneModel& model, ColourObserver observer);

}  // namespace twilight
