// What a run will take, before it starts.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "sim/scene.h"

namespace twilight {

/// Work and needs of a run.
struct RunCost {
  bool known = true;  ///< false: Monte Carlo's photons are known only once they are traced
  double reference_seconds =
      0;                  ///< processor seconds on the machine the constants were measured on
  double peak_bytes = 0;  ///< largest resident memory
};

/// Predicts a run of a valid scene that looks at `views` directions (0 and more; maps are
/// interpolated where the method does so), from counts of its work (samples of rays x pairs of Sun
/// and azimuth x wavelengths for "orders", ring pairs x azimuths x wavelengths for "cells",
/// component states x wavelengths for the scattering matrices) times measured constants. Within a
/// factor of two for time and memory (sim/README.md, "Quality and budget").
RunCost predict_run(const Scene& scene, std::size_t views);

/// How many times longer than on the machine of the constants a fixed piece of work (exponentials
/// and products in floats, some milliseconds) takes here and now. Results do not depend on it.
double machine_slowness();

/// Wall time of processor time spread over the scene's threads.
double wall_seconds(double processor_seconds, const Scene& scene);

/// Memory that this process may still take: /proc/meminfo's MemAvailable and what the control
/// groups leave; nothing where the system does not say.
std::optional<double> available_bytes();

/// Throws std::invalid_argument naming the predicted and the available MiB, and a setting that
/// would fit, where the machine cannot hold the run.
void require_memory(const Scene& scene, const RunCost& cost, std::optional<double> available);

}  // namespace twilight
