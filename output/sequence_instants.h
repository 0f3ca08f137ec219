// The instants of a sequence, evenly spaced between two.
#pragma once

#include <string>
#include <vector>

#include "sim/scene.h"

namespace twilight {

/// Fewest and most frames of a sequence.
inline constexpr int kFewestFrames = 2;
inline constexpr int kMostFrames = 100000;

/// The scene once per frame. With a place, `from` and `to` are RFC 3339 times with offset and each
/// frame has an observer.time (offset of `from`, to the millisecond); without one they are
/// elevations of the Sun, degrees, and each has a sun.elevation_deg. Both ends are included, either
/// may be the greater: time and Sun run backwards then. Throws std::invalid_argument, naming
/// option, value and what is wanted, for times where elevations are wanted and the reverse, ends
/// that are equal, and frames outside kFewestFrames..kMostFrames.
std::vector<Scene> sequence_scenes(const Scene& scene, const std::string& from,
                                   const std::string& to, int frames);

}  // namespace twilight
