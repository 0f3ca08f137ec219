// The particles of a scene, put into its layers of air.
#pragma once

#include <filesystem>
#include <vector>

#include "aerosols/known_phases.h"
#include "aerosols/mixtures.h"
#include "atmosphere/medium.h"
#include "sim/scene.h"

namespace twilight {

/// Largest relative humidity that particles take from the atmosphere, percent: the tables' end.
inline constexpr double kLargestAerosolHumidity_percent = 99.0;

/// A layer of a scene's particles.
struct SceneAerosolLayer {
  MixtureLayer layer;
  bool added = false;      ///< of [volcanic_sulfate] or [dust_layer]: out of the column's targets
  bool takes_part = true;  ///< false: counts for the column's optical depth, but is left out
};

/// The layers of the scene's type or mixture file, then the added ones, before any scaling. Throws
/// as read_mixture_file().
std::vector<SceneAerosolLayer> scene_aerosol_layers(const Scene& scene);

/// The mixture file of a scene and the files it names; none where it has no mixture or its aerosols
/// are not looked at (replaces_profile). Throws as read_mixture_file().
std::vector<std::filesystem::path> aerosol_files(const Scene& scene);

/// Heights where the aerosol begins or ends, below top_km: tops first, then bottoms above the
/// ground; each once.
std::vector<double> aerosol_boundaries_km(const std::vector<SceneAerosolLayer>& layers,
                                          double top_km);

/// Adds the particles to a medium whose air is in place (its relative humidity too), scaled to the
/// targets of the layers, of the column and of the added layers:
///  - each coefficient is the layer of air's mean, or at its centre (`centre`, the paper);
///  - humidity of the atmosphere or of a table is taken layer of air by layer of air; the
///    scattering matrices of those layers whose humidity lies between the same two of 0, 25, 50,
///    70, 80, 90, 95, 98, 99 % are one kind, at their mean humidity, so that kinds stay few;
///  - mixtures that differ in amount alone are one kind.
/// Without `matrices` all aerosol scatters after Henyey and Greenstein.
/// The Angstrom exponent a of the column between 440 and 870 nm is met by fine particles times x
/// and coarse ones (MixtureComponent::coarse) times y: x (F440 - R F870) = y (R C870 - C440), R =
/// (440/870)^-a, F and C the optical depths of the fine and the coarse, x and y such that the depth
/// at 550 nm stays. Throws std::invalid_argument where that asks for a negative amount, naming the
/// exponents in reach, and where a target cannot be met for want of particles below the model's
/// top.
void add_aerosols(Medium& medium, const Scene& scene, std::vector<SceneAerosolLayer> layers,
                  bool centre, bool matrices, KnownPhases& known);

}  // namespace twilight
