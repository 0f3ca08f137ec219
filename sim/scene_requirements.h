// What a scene requires: how much the sky changes when an effect is left out.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "sim/relative_difference.h"
#include "sim/run_control.h"
#include "sim/scene.h"
#include "sim/scene_model.h"

namespace twilight {

/// What can be left out of a scene.
enum class Effect {
  kRefraction,
  kRefractiveSpreading,
  kPolarisation,
  kSunDisc,
  kMixingLayer,
  kFreeTroposphere,
  kStratosphere,
  kOzone,
  kNitrogenDioxide,
  kGroundLight,
  kAirAbove80,
  kAirAbove60,
};

/// "refraction", "aerosols of the mixing layer", "air above 80 km"...
std::string_view effect_name(Effect effect);

/// Whether the scene models it: not where a key already switches it off or there is none of it.
/// Polarisation and the Sun's disc that a key asks for by name (true, not auto) are always kept and
/// so not `modelled` here; so is all that a user's own layers hold.
bool can_leave_out(const Scene& scene, Effect effect);

/// The scene without it.
void leave_out(Effect effect, Scene& scene);

/// What of the sky is asked for.
struct WantedSky {
  WeightedViews views = coarse_hemisphere();
  bool every_sun = false;  ///< a field, which serves every Sun elevation
};

struct EffectError {
  Effect effect;
  double error;  ///< relative, see estimate_requirements()
};

/// Some of the scene's wavelengths, and the error of interpolating the others.
struct SpectrumChoice {
  std::vector<double> solved_nm;
  double error;
};

struct SceneRequirements {
  std::vector<EffectError> effects;     ///< of everything that can be left out
  std::vector<SpectrumChoice> spectra;  ///< fewer and fewer wavelengths; the first has all
  /// Solar zenith angle (deg) beyond which air is neither seen nor lights what is: for
  /// solver.darkest_zenith_deg.
  double darkest_zenith_deg = 126;
  double aerosol_optical_depth = 0;  ///< vertical, of the pilot's wavelength nearest to 550 nm
  double sun_elevation_deg = 0;      ///< geometric; of a field, the highest looked at
};

/// Error that darkest_zenith_deg leaves (tests/sim/budget_plan_test).
inline constexpr double kDarkAirError = 5e-4;

/// Estimates by a pilot: a coarse scalar solution ("orders", sim/scene_requirements.cpp has its
/// steps) of the scene at up to three of its wavelengths, and of the scene without each effect, all
/// of them side by side as if they were wavelengths; one more solution for polarisation; sunlight
/// scattered once alone for the refractive spreading and the Sun's disc; and all wavelengths in air
/// without aerosols for the interpolation between them, for gases have bands where aerosols are
/// smooth. The error of an effect is the 95th percentile of relative_difference() over the wanted
/// views (all in the hemisphere, or the ones listed), the largest of the wavelengths, and, for
/// every_sun, of Suns at 30, 5, 0, -4, -8 and -12 degrees.
///
/// The same bytes for any number of threads. `known` keeps the phase functions computed on the way.
/// Throws as build_scene_model(), and Cancelled.
SceneRequirements estimate_requirements(const Scene& scene, const WantedSky& wanted,
                                        KnownPhases& known, const RunControl& control);

}  // namespace twilight
