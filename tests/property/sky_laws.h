// The laws that every solved sky obeys.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/scene.h"
#include "sim/scene_file.h"
#include "sim/scene_model.h"

namespace twilight {

enum class Law {
  kSolved,      ///< a valid scene is solved, or refused with std::invalid_argument's reason
  kFinite,      ///< radiance, Stokes parameters, irradiances, transmittances
  kPositive,    ///< radiance and irradiances are >= 0, transmittances 0..1
  kMirror,      ///< I and Q are even, U is odd in the azimuth from the Sun's
  kPolarised,   ///< q^2 + u^2 <= i^2
  kAlbedo,      ///< a brighter ground darkens no view
  kIrradiance,  ///< the sky is linear in the Sun's irradiance
  kEnergy,      ///< no more light than the Sun sends
  kThreads,     ///< the same bytes for 1 and 2 threads
};
const char* name(Law law);

struct BrokenLaw {
  Law law;
  std::string what;
};

struct Verdict {
  std::vector<BrokenLaw> broken;
  bool refused = false;  ///< for a reason the solver documents
};

/// What is asked of a scene, each with what is before it.
enum class Depth {
  kGlance,    ///< solves it and looks at it all around
  kCompare,   ///< each wavelength three times side by side: as it is, over a brighter ground and
              ///< under a Sun of another irradiance
  kThorough,  ///< its irradiances, and a second solve on two threads
};

Verdict judge(const Scene& scene, Depth depth);

/// The same scene made as plain as it gets in the time while `still_broken` holds: defaults in
/// place of what is not needed, fewer layers, smaller grids.
Scene simplest(Scene scene, const std::function<bool(const Scene&)>& still_broken,
               double most_seconds);

/// Each wavelength `copies` times, next to each other, everything equal.
SceneModel with_copies(const SceneModel& model, std::size_t copies);

/// Directions all around: up, down, at the horizon, towards and away from the Sun.
std::vector<ViewDirection> law_views();

}  // namespace twilight
