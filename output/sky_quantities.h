// What a study measures of a sky.
#pragma once

#include <optional>
#include <vector>

#include "output/sky_image.h"
#include "output/study_results.h"
#include "output/twilight_duration.h"
#include "output/wanted_quantities.h"
#include "sim/run_control.h"
#include "sim/scene.h"
#include "sim/scene_model.h"
#include "sim/sky.h"

namespace twilight {

/// The coordinates that the quantities of a case have, for a scene's wavelengths and projection:
/// the same for all cases of a study. "wavelength" (nm), "view" (words, "el 20 az 90"), "band"
/// (U..I), "threshold" (lux), "y" and "x" (pixels of the texture, from their centres) and "channel"
/// (R, G, B or X, Y, Z), those that are needed.
std::vector<StudyCoordinate> quantity_coordinates(const WantedQuantities& wanted,
                                                  const Scene& scene);

/// Names, dimensions and sizes of what observe() gives for quantity_coordinates(), every value NaN,
/// without a sky; a texture without values, as it may be large.
std::vector<StudyQuantity> quantity_shapes(const WantedQuantities& wanted,
                                           const std::vector<StudyCoordinate>& coordinates);

/// The quantities of a sky solved of the model; their names and definitions: README, "What a study
/// measures". Every one has the same name, dimensions and size for every case of a study; what the
/// sky or its method does not tell (polarisation of a scalar solver, the colour of darkness, a band
/// outside the wavelengths) is NaN. Throws as Sky's functions do, std::logic_error if the sky
/// returns a value that is negative or not finite, Cancelled when told to stop. `known` saves
/// skies of one air the search for the depressions of twilight.
std::vector<StudyQuantity> observe(const Sky& sky, const SceneModel& model,
                                   const WantedQuantities& wanted, const RunControl& control = {},
                                   KnownTwilight* known = nullptr);

/// The views whose largest degree of polarisation observe() gives, for a Sun at a geometric
/// elevation (rad): 30 views over the hemisphere and, in steps of 2 degrees, the Sun's vertical
/// about a right angle from the Sun, none below 2 degrees. The largest of a sky scattered once is
/// within 0.1 % (SkyQuantities.LightScatteredOnceAtARightAngleIsPolarisedWholly).
std::vector<ViewDirection> polarisation_views(double sun_elevation_rad);

/// The sky in colour as render_map shows it in the scene's projection, `picture_size` pixels high,
/// for write_preview_png; nothing where that is 0. Throws as observe().
std::optional<SkyImage> case_picture(const Sky& sky, const SceneModel& model,
                                     const WantedQuantities& wanted,
                                     const RunControl& control = {});

/// The same `exr_size` pixels high, the scene's channels and projection, for write_exr.
std::optional<SkyImage> case_exr(const Sky& sky, const SceneModel& model,
                                 const WantedQuantities& wanted, const RunControl& control = {});

}  // namespace twilight
